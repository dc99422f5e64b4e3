//! Where the coarse picture of the light is taken, and what each light gives there.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::direct::EmitterRule;
use super::parts::LightUse;
use super::radiosity::{DomeRoom, Rings, Underside};
use super::setup::{self, Channels};
use super::shelf::Shelf;
use super::tables::Ways;
use crate::SimError;
use crate::scene::Scene;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// The patches.
pub(super) const RINGS: Rings = Rings { rings: 10, patches: 20, ..Rings::USUAL };

/// Depths at which a membrane that objects move is looked at, parts of the dome's radius.
const DEPTHS: [f64; 2] = [1.0, 0.8];

/// Places across a light, each way.
const PLACES: usize = 2;

/// Pixels by which what the camera sees may reach beyond the picture.
const BESIDE_PX: f64 = 4.0;

/// Fluxes of one source at one place, for a flux of one: by tape, faces and shadow.
pub(super) type Fluxes = [DVec3; 8];

/// A place that the light is known at.
#[derive(Debug)]
pub(super) struct Sample {
    pub place: DVec3,
    /// The normal that counts: a marker's and a resting membrane's; `None` where it may be any.
    pub normal: Option<DVec3>,
    /// The nearest patch.
    pub patch: usize,
    /// Of a white marker, not of the dome: what an even exitance of one gives it, by channel.
    pub beside: Option<Channels>,
    pub flux: Vec<Fluxes>,
}

/// What is known of a design's light, whatever it is driven with. The patches come first, then the pole.
#[derive(Debug)]
pub(super) struct Samples {
    pub list: Vec<Sample>,
    /// The dome as a room, without faces and with them, for each channel.
    pub rooms: [Vec<DomeRoom>; 2],
}

/// How a place is seen over the frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Smallest and largest momentum (index times sine) towards the camera.
    pub momentum: [f64; 2],
    /// Largest field angle.
    pub field_rad: f64,
}

/// The samples of a design, made once.
pub(super) fn samples(scene: &Scene) -> Result<Arc<Samples>, SimError> {
    let moved = !scene.file().objects.is_empty();
    static SHELF: Shelf<OnceLock<Arc<Samples>>> = Shelf::new();
    let kept = SHELF.get(&format!("{moved} {}", scene.design().text()));
    if let Some(found) = kept.get() {
        return Ok(Arc::clone(found));
    }
    let made = Arc::new(Samples::new(scene, moved)?);
    Ok(Arc::clone(kept.get_or_init(|| made)))
}

impl Samples {
    fn new(scene: &Scene, moved: bool) -> Result<Self, SimError> {
        let cases = cases(scene)?;
        let open = &cases[0][0];
        let (face, dome) = (open.face(), open.optics[1].dome());
        let rings = Rings { face, ..RINGS };
        let room = |underside| open.optics.iter().map(|o| DomeRoom::new(o, rings, underside)).collect();
        let rooms: [Vec<DomeRoom>; 2] = [room(Underside::Dark), room(Underside::Fresnel)];
        let rule = EmitterRule::with_places(PLACES);
        let fluxes = |place: DVec3| -> Vec<Fluxes> {
            (0..open.sources.len()).map(|i| fluxes(&cases, i, place, &rule)).collect()
        };
        let directions = directions(open);
        let depths: &[f64] = if moved { &DEPTHS } else { &DEPTHS[..1] };
        let mut places: Vec<(DVec3, Option<DVec3>, usize)> = Vec::new();
        for (depth, part) in depths.iter().enumerate() {
            for (direction, patch) in &directions {
                // The rim is bonded: a point moves by less than it stands above the sheet.
                let above = dome.center_mm().z + direction.z * dome.radius_mm();
                let place = open.point(*direction, part.max(1.0 - above / dome.radius_mm()));
                // A membrane that is moved has any normal, there and about it.
                places.push((place, (depth == 0).then_some(face.normal(*direction)), *patch));
                if moved && depth == 0 {
                    places.push((place, None, *patch));
                }
            }
        }
        // The patches and the pole first, in their order.
        places.sort_by_key(|(_, normal, _)| normal.is_none());
        let on_dome = |(place, normal, patch): (DVec3, Option<DVec3>, usize)| Sample {
            place,
            normal,
            patch,
            beside: None,
            flux: fluxes(place),
        };
        let mut list: Vec<Sample> = places.into_par_iter().map(on_dome).collect();
        let ones = vec![1.0; RINGS.count()];
        for marker in scene.markers() {
            let place = marker.position_mm;
            let beside: Vec<f64> =
                rooms[1].iter().zip(&open.optics).map(|(room, o)| room.beside(o, &ones, place)).collect();
            list.push(Sample {
                place,
                normal: Some(DVec3::Z),
                patch: 0,
                beside: Some(std::array::from_fn(|c| beside.get(c).copied().unwrap_or(0.0))),
                flux: fluxes(place),
            });
        }
        Ok(Self { list, rooms })
    }
}

/// A source's ways to a place: free, through the faces, and past the platform as well; bare and behind the tape.
type Cases = [[Ways; 3]; 2];

fn cases(scene: &Scene) -> Result<Cases, SimError> {
    let cavities = setup::cavities(scene.design())?;
    let of = |diffuser: bool| -> Result<[Ways; 3], SimError> {
        let used = LightUse { diffuser, fresnel: false, platform_shadow: false, ..LightUse::ALL };
        let open = setup::ways(scene, &used)?;
        let passed = Ways { fresnel: true, ..open.clone() };
        let left = Ways { cavities: Some(cavities.clone()), ..passed.clone() };
        Ok([open, passed, left])
    };
    Ok([of(false)?, of(true)?])
}

/// Fluxes of a source at a place. The shadow is solved with the faces' losses; without them as much is hidden.
fn fluxes(cases: &Cases, i: usize, place: DVec3, rule: &EmitterRule) -> Fluxes {
    let mut out = [DVec3::ZERO; 8];
    for (case, out) in cases.iter().zip(out.chunks_exact_mut(4)) {
        let [open, passed, left] = case
            .each_ref()
            .map(|w| w.sources.get(i).map_or(DVec3::ZERO, |source| w.flux(source, place, rule)));
        let share = if passed.length() > 0.0 { left.length() / passed.length() } else { 0.0 };
        out.copy_from_slice(&[open, open * share, passed, left]);
    }
    out
}

/// The patches, the pole, and what faces each light on every ring; each with its patch.
fn directions(ways: &Ways) -> Vec<(DVec3, usize)> {
    let (patches, face) = (RINGS.patches, ways.face());
    let rings = Rings { face, ..RINGS };
    let all = (0..rings.count()).map(|i| (rings.place(i / patches, i % patches), i));
    let mut out: Vec<(DVec3, usize)> = all.collect();
    out.push((DVec3::Z, RINGS.count() - 1));
    for source in &ways.sources {
        let at = source.emitter.platform_from_emitter.translation.truncate();
        let Some(aside) = at.try_normalize() else { continue };
        let turn = aside.to_angle().rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let patch = ((turn * patches as f64) as usize).min(patches - 1);
        for ring in 0..RINGS.rings {
            let facing = face.place(aside.to_angle(), rings.place(ring, 0).z);
            if !out.iter().any(|(other, _)| other.distance(facing) < 1e-6) {
                out.push((facing, ring * patches + patch));
            }
        }
    }
    out
}

/// How each sample is seen over some poses; a place of the dome that is not, as its neighbours on the next rings, if they are.
pub(super) fn views(scene: &Scene, samples: &Samples, poses: &[Rigid]) -> Vec<Option<View>> {
    let posed: Vec<SensorOptics> =
        poses.iter().filter_map(|pose| scene.optics().at_pose(pose).ok()).collect();
    let (width, height) = scene.image_size();
    let last = DVec2::new(width as f64, height as f64) + BESIDE_PX;
    let look = |place: DVec3| {
        let at = |optics: &SensorOptics| {
            let pixel = optics.project(place).ok()?;
            let inside = pixel.cmpge(DVec2::splat(-BESIDE_PX)).all() && pixel.cmple(last).all();
            let ray = optics.lens().unproject(pixel).ok().filter(|_| inside)?;
            let aside = optics.sensor_from_camera().vector(ray).truncate().length().min(1.0);
            Some(View { momentum: [aside; 2], field_rad: ray.z.clamp(-1.0, 1.0).acos() })
        };
        posed.iter().filter_map(at).reduce(View::and)
    };
    let own: Vec<Option<View>> = samples.list.iter().map(|sample| look(sample.place)).collect();
    let mut patches: Vec<Option<View>> = vec![None; RINGS.count()];
    for (sample, view) in samples.list.iter().zip(&own).filter(|(sample, _)| sample.beside.is_none()) {
        if let (Some(known), Some(view)) = (patches.get_mut(sample.patch), view) {
            *known = Some(known.map_or(*view, |known| known.and(*view)));
        }
    }
    let next = |patch: usize| {
        let rings = [Some(patch), patch.checked_sub(RINGS.patches), patch.checked_add(RINGS.patches)];
        rings
            .into_iter()
            .flatten()
            .filter_map(|patch| patches.get(patch).copied().flatten())
            .reduce(View::and)
    };
    let pair = samples.list.iter().zip(own);
    pair.map(|(sample, view)| {
        view.or_else(|| if sample.beside.is_none() { next(sample.patch) } else { None })
    })
    .collect()
}

impl View {
    /// Both ranges.
    fn and(self, other: Self) -> Self {
        let [low, high] = self.momentum;
        Self {
            momentum: [low.min(other.momentum[0]), high.max(other.momentum[1])],
            field_rad: self.field_rad.max(other.field_rad),
        }
    }
}
