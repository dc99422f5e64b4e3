//! Dust and scratches on sheet and lens, as out of focus as what lies there is; drawn by `crate::raster::specks`.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound;
use crate::effects::light_bound;
use crate::light::bounds;
use crate::raster::overlap::area;
use crate::raster::specks::{Face, FaceView, Specks, Thing};
use crate::scene::dust::{DustyFace, ScratchLot, SpeckLot};
use crate::{Pipeline, Scene, SimError};
use domecast_optics::numeric::SeededRandom;

/// See the module.
pub struct Dust;

/// Corners of a speck, and the standard deviation of their distances from its middle, parts of its radius.
const CORNERS: usize = 12;
const ROUGHNESS: f64 = 0.2;
/// No corner is nearer or farther than this, parts of the radius.
const MAX_ROUGH: f64 = 0.5;

/// Numbers of the streams of random numbers, beside others of the seed.
const STREAM: u64 = 0x6475_7374;

/// Places along a thing at which its strength is looked at.
const ALONG: u32 = 9;
/// Between those places, and in frames between those that are looked at, a thing may be stronger by this factor.
const MARGIN: f64 = 1.1;
/// The cone of a pixel may be wider than at the middle of the thing, by this factor.
const WIDER: f64 = 1.5;

impl Effect for Dust {
    fn name(&self) -> EffectName {
        EffectName::Dust
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let dust = scene.file().dust.as_ref().filter(|_| scene.draws())?;
        let specks: usize = dust.specks.iter().map(|lot| lot.at_mm.len() + lot.random as usize).sum();
        let scratches: usize =
            dust.scratches.iter().map(|lot| lot.between_mm.len() + lot.random as usize).sum();
        (specks + scratches > 0).then(|| format!("{specks} specks and {scratches} scratches"))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let specks = specks_of(scene);
        let taken = max_taken(scene, &specks)?;
        let gamma = scene.file().electronics.gamma;
        let level = specks.things.iter().map(|thing| thing.level).fold(0.0, f64::max);
        let darker = bounds::grey_of_loss(gamma, light_bound::brightest_level(scene)?, taken);
        Ok(Bound::grey(darker.max(bounds::grey_of_change(gamma, taken * level))))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: specks_of(scene).predicted_units(scene.optics(), scene.image_size()) }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.dust = Some(specks_of(scene));
        Ok(())
    }
}

/// The dust of a scene; its random part follows from the seed.
fn specks_of(scene: &Scene) -> Specks {
    let Some(dust) = &scene.file().dust else { return Specks::default() };
    let focus = scene.file().electronics.focus.as_ref();
    let mut things = Vec::new();
    for (lot, number) in dust.specks.iter().zip(0..) {
        speck_things(scene, lot, &mut SeededRandom::stream(scene.file().seed, STREAM + number), &mut things);
    }
    for (lot, number) in dust.scratches.iter().zip(0..) {
        let mut random = SeededRandom::stream(scene.file().seed, STREAM + 0x100 + number);
        scratch_things(scene, lot, &mut random, &mut things);
    }
    Specks {
        things,
        pupil_mm: focus.map_or(0.0, |focus| focus.pupil_diameter_mm),
        sharp_mm: focus.map_or(1.0, |focus| focus.distance_mm),
    }
}

fn face_of(scene: &Scene, on: DustyFace) -> Face {
    match on {
        DustyFace::Sheet => Face::Sheet(scene.design().sheet_underside_z_mm()),
        DustyFace::Lens(distance_mm) => Face::Lens(distance_mm),
    }
}

/// Middle and radius of the part of a face through which the camera at rest sees the dome's foot, mm.
fn seen_part(scene: &Scene, face: Face) -> (DVec2, f64) {
    let (camera_mm, radius_mm) = (camera_mm(scene), scene.optics().dome().rim_radius_mm());
    let height_mm = (-camera_mm.z).max(1e-6);
    match face {
        Face::Lens(distance_mm) => (DVec2::ZERO, radius_mm * distance_mm / height_mm),
        Face::Sheet(z_mm) => {
            let part = (z_mm - camera_mm.z) / height_mm;
            (camera_mm.truncate() * (1.0 - part), radius_mm * part)
        }
    }
}

fn camera_mm(scene: &Scene) -> DVec3 {
    scene.optics().sensor_from_camera().translation_mm
}

/// A place drawn evenly from the seen part of a face.
fn random_place((middle, radius_mm): (DVec2, f64), random: &mut SeededRandom) -> DVec2 {
    let far = radius_mm * random.uniform().sqrt();
    middle + DVec2::from_angle(TAU * random.uniform()) * far
}

/// Even in the logarithm.
fn log_between(random: &mut SeededRandom, [low, high]: [f64; 2]) -> f64 {
    (low * (high / low).powf(random.uniform())).clamp(low.min(high), low.max(high))
}

fn speck_things(scene: &Scene, lot: &SpeckLot, random: &mut SeededRandom, things: &mut Vec<Thing>) {
    let face = face_of(scene, lot.on);
    let part = seen_part(scene, face);
    let given = lot.at_mm.iter().map(|at| Some(DVec2::from_array(*at)));
    for place in given.chain((0..lot.random).map(|_| None)) {
        let middle = place.unwrap_or_else(|| random_place(part, random));
        let radius_mm = 0.5 * log_between(random, lot.diameter_mm);
        let corner = |k: usize, random: &mut SeededRandom| {
            let rough = (ROUGHNESS * random.normal()).clamp(-MAX_ROUGH, MAX_ROUGH);
            DVec2::from_angle(TAU * k as f64 / CORNERS as f64) * (1.0 + rough)
        };
        let unit: Vec<DVec2> = (0..CORNERS).map(|k| corner(k, random)).collect();
        // The disc of the given diameter has its area.
        let scale = radius_mm * (0.5 * TAU / area(&unit)).sqrt();
        let reach_mm = unit.iter().map(|p| scale * p.length()).fold(0.0, f64::max);
        things.push(Thing {
            face,
            outline_mm: unit.iter().map(|p| middle + *p * scale).collect(),
            axis_mm: [middle; 2],
            reach_mm,
            opacity: lot.opacity,
            level: lot.level,
        });
    }
}

fn scratch_things(scene: &Scene, lot: &ScratchLot, random: &mut SeededRandom, things: &mut Vec<Thing>) {
    let face = face_of(scene, lot.on);
    let part = seen_part(scene, face);
    let given = lot.between_mm.iter().map(|ends| Some(ends.map(DVec2::from_array)));
    for ends in given.chain((0..lot.random).map(|_| None)) {
        let [from, to] = ends.unwrap_or_else(|| {
            let middle = random_place(part, random);
            let half = DVec2::from_angle(TAU * random.uniform()) * (0.5 * log_between(random, lot.length_mm));
            [middle - half, middle + half]
        });
        let half_mm = 0.5 * lot.width_mm;
        let side = (to - from).normalize_or(DVec2::X).perp() * half_mm;
        things.push(Thing {
            face,
            outline_mm: vec![from - side, to - side, to + side, from + side],
            axis_mm: [from, to],
            reach_mm: half_mm,
            opacity: lot.opacity,
            level: lot.level,
        });
    }
}

/// The largest part of its light that any pixel can lose to the dust, in the frames that stand for the scene's.
fn max_taken(scene: &Scene, specks: &Specks) -> Result<f64, SimError> {
    // What each thing takes at most, and the widest cone at it.
    let mut found = vec![(0.0_f64, 0.0_f64); specks.things.len()];
    let solved = geometry_bound::solved_frames(scene)?;
    for (frame, touch) in solved.touches() {
        let optics = scene.optics().at_pose(&touch.state.pose).map_err(|fault| SimError::Frame {
            frame,
            problem: format!("{} = {}: the platform cannot be there", fault.field, fault.value),
        })?;
        for (thing, (taken, cone_mm)) in specks.things.iter().zip(&mut found) {
            let view = FaceView { optics: &optics, face: thing.face };
            let [from, to] = thing.axis_mm;
            let count = if from == to { 1 } else { ALONG };
            let middles = (0..count).map(|k| from.lerp(to, (f64::from(k) + 0.5) / f64::from(count)));
            // At the picture's edge a thing is seen in part.
            for place in middles.chain(thing.outline_mm.iter().map(|p| p.midpoint(from))) {
                let Some(pixel) = view.pixel(place) else { continue };
                let (Some(pixel_mm), Some((_, far_mm))) = (view.pixel_mm(pixel), view.meet(pixel)) else {
                    continue;
                };
                let share = MARGIN * specks.taken(thing, &view, pixel, pixel_mm);
                *taken = taken.max(share.min(thing.opacity));
                *cone_mm = cone_mm.max(WIDER * specks.cone_mm(far_mm, pixel_mm));
            }
        }
    }
    // Things on one face that one pixel sees take of each other's rest; so do the faces.
    let mut faces: Vec<(Face, f64)> = Vec::new();
    for (thing, (_, cone_mm)) in specks.things.iter().zip(&found) {
        let near = specks.things.iter().zip(&found).filter(|(other, (_, other_cone_mm))| {
            let reach_mm = thing.reach_mm + other.reach_mm + cone_mm + other_cone_mm;
            other.face == thing.face && thing.apart_mm(other) <= reach_mm
        });
        let left: f64 = near.map(|(_, (taken, _))| 1.0 - taken).product();
        match faces.iter_mut().find(|(face, _)| *face == thing.face) {
            Some((_, lowest)) => *lowest = lowest.min(left),
            None => faces.push((thing.face, left)),
        }
    }
    Ok(1.0 - faces.iter().map(|(_, left)| left).product::<f64>())
}
