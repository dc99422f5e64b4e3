//! How large an effect is, looked up in pictures: the scene's first frame, drawn as its frames are but under the coarse picture of
//! the light, with the effect and without it.
//!
//! What blurs, samples or sharpens acts on edges: on their contrast where they lie, on how they lie to the pixels, on what is
//! near them. All of that is in such a picture, and the whole chain from light to code. So is what a shift of dots and markers does
//! to a pixel: no more of a pixel changes than an edge passes over, from what is on its one side to what is on the other.

use std::cell::OnceCell;
use std::f64::consts::SQRT_2;

use glam::DVec2;

use crate::SimError;
use crate::bound::Bound;
use crate::effect_name::{EffectChoice, EffectName};
use crate::effects;
use crate::effects::effect::Effect;
use crate::effects::geometry_bound::{called_for, solved_frames};
use crate::effects::light_bound::grounds;
use crate::effects::pipeline::Pipeline;
use crate::electronics::pass::PassContext;
use crate::light::shading::Shading;
use crate::plan::growth::grown;
use crate::raster::edges::EDGE_GREY;
use crate::raster::frame::Frame;
use crate::raster::lens_field::LensField;
use crate::raster::picture::{Painter, Parts};
use crate::raster::projector::Projector;
use crate::raster::rolled::Slice;
use crate::raster::sensor_state::SensorState;
use crate::raster::settings::Ink;
use crate::raster::spots::{Points, Spots};
use crate::scene::Scene;
use crate::work::Work;
use domecast_optics::numeric::Rigid;

/// Other frames may show brighter edges, that lie worse to the pixels, by this factor.
const MARGIN: f64 = 1.3;

/// How far the membrane may be off that is filled in between rays, full scales: no place of it is known better than that.
const GROUND_TOLERANCE: f32 = 1.0;

/// Classes of levels by their square root, the darkest of which matter where the code is steep.
const CLASSES: usize = 256;

/// A larger shift shows other places than those next to a pixel, px.
const MAX_SHIFT_PX: f64 = 1.0;

/// Pictures of a scene, drawn when they are asked for.
pub(super) struct Pictures<'a> {
    scene: &'a Scene,
    drawn: OnceCell<Drawn<'a>>,
}

impl<'a> Pictures<'a> {
    /// Of a scene.
    pub fn of(scene: &'a Scene) -> Self {
        Self { scene, drawn: OnceCell::new() }
    }

    fn drawn(&self) -> Result<&Drawn<'a>, SimError> {
        if let Some(drawn) = self.drawn.get() {
            return Ok(drawn);
        }
        let drawn = Drawn::new(self.scene)?;
        Ok(self.drawn.get_or_init(|| drawn))
    }

    /// How large an effect is.
    ///
    /// # Errors
    /// A bound that cannot be computed, or what a picture of the scene cannot be drawn for.
    pub fn bound(&self, effect: &dyn Effect) -> Result<Bound, SimError> {
        let bound = effect.bound(self.scene)?;
        if !effect.is_drawn() {
            return Ok(bound);
        }
        let grey = if self.follows_frames() { 255.0 } else { self.drawn()?.change_grey(effect.name()) };
        Ok(Bound { grey, ..bound })
    }

    /// What a shift of some pixels can do to the value of a pixel, grey levels: zero where no images are drawn.
    ///
    /// # Errors
    /// What a picture of the scene cannot be drawn for.
    pub fn shift_grey(&self, px: f64) -> Result<f64, SimError> {
        if !self.scene.draws() || px == 0.0 {
            return Ok(0.0);
        }
        if px > MAX_SHIFT_PX || self.follows_frames() {
            return Ok(255.0);
        }
        // What any geometric effect moves, all others may enlarge.
        Ok(grown(self.scene, EffectName::LensDistortion, self.drawn()?.shift_grey(px)))
    }

    /// Whether the camera sets gains by the frames before: how bright the picture becomes is then known when it is drawn.
    fn follows_frames(&self) -> bool {
        let electronics = &self.scene.file().electronics;
        let used = |name: EffectName| self.scene.choice(name) != EffectChoice::Never;
        (electronics.auto_exposure.is_some() && used(EffectName::AutoExposure))
            || (electronics.white_balance.is_some() && used(EffectName::WhiteBalance))
    }
}

/// A scene's first frame in linear light, and the passes that make codes of it.
struct Drawn<'a> {
    scene: &'a Scene,
    pipeline: Pipeline,
    field: LensField,
    /// By class of a pixel's darkest neighbour (or itself) that and its brightest one, full scales.
    contrasts: OnceCell<Vec<(f64, f64)>>,
    /// With all of the ink's effects: at rest, and where anything moves each dot at a part of a pixel of its own.
    exposed: Vec<Frame>,
    /// The same with sharp edges of the ink, where it has soft ones.
    sharp: Vec<Frame>,
    /// Those with all effects after all passes, by way.
    with_all: Vec<[OnceCell<Frame>; 4]>,
}

/// Whether the picture is sharpened and whether it has noise.
type Way = (bool, bool);

fn is_on_way(name: EffectName, (sharpened, noisy): Way) -> bool {
    (noisy || name != EffectName::Noise) && (sharpened || name != EffectName::Sharpening)
}

impl<'a> Drawn<'a> {
    /// Draws the frame of a scene with all that acts on edges, at rest: without what takes time and what objects do.
    ///
    /// # Errors
    /// What an effect of the scene cannot be computed for.
    fn new(scene: &'a Scene) -> Result<Self, SimError> {
        let mut pipeline = Pipeline::default();
        for effect in effects::all() {
            let used =
                scene.choice(effect.name()) != EffectChoice::Never && effect.calls_for(scene).is_some();
            if used && !is_left_out(effect.name()) {
                effect.apply(scene, &mut pipeline)?;
            }
        }
        pipeline.passes.sort_by_key(|pass| pass.stage());
        let mut grounds = grounds(scene)?;
        if let Some(uneven) = &pipeline.unevenness {
            grounds = grounds.into_iter().map(|even| Some(uneven.clone().over(even))).collect();
        }
        let eye = Projector::new(scene, pipeline.geometry)?;
        let at_rest = eye.at(&Rigid::identity())?;
        let lens = at_rest.optics(eye.reference()).unwrap_or(scene.optics()).lens();
        let field = LensField::new(lens, scene.image_size(), grounds.iter().any(Option::is_some));
        let soft = pipeline.ink;
        let exposed = expose(scene, &pipeline, soft, (&eye, &field), &grounds)?;
        let hard = Ink { soft_edge: false, ..soft };
        let sharp = if soft.soft_edge {
            expose(scene, &pipeline, hard, (&eye, &field), &grounds)?
        } else {
            Vec::new()
        };
        let with_all = exposed.iter().map(|_| Default::default()).collect();
        Ok(Self { scene, pipeline, field, contrasts: OnceCell::new(), exposed, sharp, with_all })
    }

    /// The most that an effect's absence changes a pixel, grey levels: without noise, and of what noise makes of it the 99.9th
    /// percentile. It holds all that effects after it do to it.
    fn change_grey(&self, effect: EffectName) -> f64 {
        if self.pipeline.gloss.is_some() && self.exposed.len() > 1 {
            // In another frame another light may be mirrored, as bright as it is.
            return 255.0;
        }
        let gamma = self.scene.file().electronics.gamma;
        let sharpens = self.pipeline.passes.iter().any(|pass| pass.effect() == EffectName::Sharpening);
        // Soft edges and defocus change the light alone: the noise goes with it.
        let noise = self.pipeline.passes.iter().any(|pass| pass.effect() == EffectName::Noise);
        let noise = noise && effect >= EffectName::Bayer;
        let mut largest = 0.0_f64;
        for (at, exposed) in self.exposed.iter().enumerate() {
            let other = if effect == EffectName::InkEdge { self.sharp.get(at) } else { None };
            for way @ (sharpened, noisy) in [(false, false), (true, false), (false, true), (true, true)] {
                let is_called_for = (sharpened || effect != EffectName::Sharpening)
                    && (noisy || effect != EffectName::Noise)
                    && (!sharpened || sharpens)
                    // How edges lie to the pixels is nothing to noise: one picture is enough.
                    && (!noisy || (noise && at + 1 == self.exposed.len()));
                if !is_called_for {
                    continue;
                }
                let kept = |name: EffectName| name != effect && is_on_way(name, way);
                let Some(with) = self.with_all(at, way) else { continue };
                let without = self.developed(other.unwrap_or(exposed), &kept);
                largest = largest.max(difference(with, &without, gamma, noisy));
            }
        }
        (MARGIN * largest).min(255.0)
    }

    /// What a shift of some pixels does to a pixel at most, grey levels.
    fn shift_grey(&self, px: f64) -> f64 {
        if self.pipeline.gloss.is_some() {
            // A mirrored light may be smaller than a pixel, and as bright as it is.
            return 255.0;
        }
        // A straight or convex edge that moves by `d` passes over at most `d` times the pixel's width across its way.
        let part = (SQRT_2 * px).min(1.0);
        let power = 1.0 / self.scene.file().electronics.gamma;
        let code = |level: f64| level.clamp(0.0, 1.0).powf(power);
        let change = |(dark, bright): &(f64, f64)| {
            let step = part * (bright - dark);
            // The code is steepest in the dark, or at full scale.
            if power <= 1.0 {
                code(dark + step) - code(*dark)
            } else {
                code(*bright) - code(dark.max(bright.min(1.0) - step))
            }
        };
        let contrasts = self.contrasts.get_or_init(|| self.find_contrasts());
        (MARGIN * 255.0 * contrasts.iter().map(change).fold(0.0, f64::max)).min(255.0)
    }

    fn find_contrasts(&self) -> Vec<(f64, f64)> {
        let mut found = vec![(f64::INFINITY, f64::NEG_INFINITY); CLASSES];
        for exposed in &self.exposed {
            let frame = self.developed(exposed, &|name| name == EffectName::Vignetting);
            for plane in &frame.planes {
                let rows: Vec<&[f32]> = plane.chunks_exact(frame.width()).collect();
                for (y, three) in rows.windows(3).enumerate() {
                    let seen = (y..y + 3).map(|y| self.field.row(y));
                    let seen = seen.reduce(|a, b| a.start.max(b.start)..a.end.min(b.end)).unwrap_or(0..0);
                    for x in seen.start..seen.end.saturating_sub(2) {
                        let near = three.iter().filter_map(|row| row.get(x..x + 3)).flatten();
                        let (dark, bright) = near
                            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), value| {
                                (low.min(*value), high.max(*value))
                            });
                        let class = (dark.clamp(0.0, 1.0).sqrt() * CLASSES as f32) as usize;
                        if let Some((darkest, brightest)) = found.get_mut(class.min(CLASSES - 1)) {
                            *darkest = darkest.min(f64::from(dark));
                            *brightest = brightest.max(f64::from(bright));
                        }
                    }
                }
            }
        }
        found.retain(|(dark, bright)| dark <= bright);
        found
    }

    /// A picture with all effects.
    fn with_all(&self, at: usize, way: Way) -> Option<&Frame> {
        let cell = self.with_all.get(at)?.get(usize::from(way.0) * 2 + usize::from(way.1))?;
        let exposed = self.exposed.get(at)?;
        Some(cell.get_or_init(|| self.developed(exposed, &|name| is_on_way(name, way))))
    }

    /// The picture after the passes of some effects.
    fn developed(&self, exposed: &Frame, kept: &dyn Fn(EffectName) -> bool) -> Frame {
        let mut frame = exposed.clone();
        let context = PassContext { seed: self.scene.file().seed, ..PassContext::default() };
        for pass in self.pipeline.passes.iter().filter(|pass| kept(pass.effect())) {
            pass.run(&mut frame, &context, &mut Work::default());
        }
        frame
    }
}

/// What such pictures leave out: what takes time or needs frames before, touches, and the lossy code.
fn is_left_out(effect: EffectName) -> bool {
    matches!(
        effect,
        EffectName::Contact
            | EffectName::SlowGel
            | EffectName::MotionBlur
            | EffectName::RollingShutter
            | EffectName::AutoExposure
            | EffectName::WhiteBalance
            | EffectName::Compression
    )
}

/// The first frame in linear light, on the first ground; where anything moves also with dots at all parts of a pixel, on the last.
fn expose(
    scene: &Scene,
    pipeline: &Pipeline,
    ink: Ink,
    (eye, field): (&Projector, &LensField),
    grounds: &[Option<Box<dyn Shading>>],
) -> Result<Vec<Frame>, SimError> {
    let mut uncounted = Work::default();
    let geometry = pipeline.geometry;
    let points = Points::new(scene, (geometry, ink), eye, EDGE_GREY / 255.0, &mut uncounted);
    let solved = solved_frames(scene)?;
    let first = solved.touches().next();
    let (_, touch) = first.ok_or_else(|| SimError::Frame { frame: 0, problem: "it is not there".into() })?;
    let instant =
        SensorState::new(eye, geometry, 0.0, touch.state.clone(), Default::default(), &mut uncounted)?;
    let spots = |apart: bool| {
        points.gather(scene, eye.channels(), Vec::new(), &mut |item, channel, k| {
            let pixel = points.pixel(&instant, channel, item, points.items().get(item)?, k, false)?;
            Some(if apart { pixel + part_of_pixel(item) } else { pixel })
        })
    };
    let (width, height) = scene.image_size();
    let mut painter = Painter::default();
    let mut draw = |ground: &Option<Box<dyn Shading>>, spots: &Spots| {
        let parts = Parts {
            scene,
            dots: ink.dots,
            shading: ground.as_deref(),
            tolerance: GROUND_TOLERANCE,
            points: &points,
            field,
            gloss: pipeline.gloss.as_ref(),
            dust: pipeline.dust.as_ref(),
        };
        let mut frame = Frame::new(width, height, scene.planes());
        let rows = Slice { first: 0, end: height, instant: &instant };
        painter.draw(parts, &[rows], spots, &mut frame, &mut uncounted);
        frame
    };
    let mut frames: Vec<Frame> =
        grounds.first().map(|ground| draw(ground, &spots(false))).into_iter().collect();
    if called_for(scene).sheet_motion || !scene.objects().is_empty() {
        frames.extend(grounds.last().map(|ground| draw(ground, &spots(true))));
    }
    Ok(frames)
}

/// By how much a dot or marker is moved, px: up to half a pixel each way, and no two alike, so that they lie to the pixels as they
/// may when they move. (A design's dots may all lie alike at rest.) Multiples of powers of the plastic number fill a square evenly.
fn part_of_pixel(item: usize) -> DVec2 {
    (DVec2::new(0.754_877_666, 0.569_840_291) * item as f64).fract() - 0.5
}

/// The largest change of a code between two pictures, grey levels; of what is random the 99.9th percentile.
fn difference(a: &Frame, b: &Frame, gamma: f64, random: bool) -> f64 {
    let code = |value: f32| {
        let level = f64::from(value.clamp(0.0, 1.0));
        if gamma == 1.0 { level } else { level.powf(1.0 / gamma) }
    };
    let pairs = a.planes.iter().flatten().zip(b.planes.iter().flatten());
    let changes = pairs.map(|(a, b)| if a == b { 0.0 } else { (code(*a) - code(*b)).abs() });
    if !random {
        return 255.0 * changes.fold(0.0, f64::max);
    }
    let mut changes: Vec<f64> = changes.collect();
    let rank = changes.len() * 999 / 1000;
    if rank >= changes.len() {
        return 0.0;
    }
    255.0 * *changes.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_passes_over_the_step_between_marker_and_surround_and_a_blur_of_none_does_nothing() {
        let text = r#"{ "version": 1, "name": "even", "design": "thumb24.json",
            "frames": { "count": 1, "rate_hz": 30 }, "tolerance": { "px": 0.1, "grey": 4 },
            "light": { "membrane_level": 0.5, "marker_level": 0.9, "surround_level": 0.1 },
            "electronics": { "focus": { "pupil_diameter_mm": 1e-6, "distance_mm": 15 } } }"#;
        let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
        let scene = Scene::from_text(text, &folder).unwrap();
        let pictures = Pictures::of(&scene);
        for px in [0.01, 0.1, 0.5] {
            let expected = 255.0 * 1.3 * (SQRT_2 * px) * (0.9 - 0.1);
            let found = pictures.shift_grey(px).unwrap();
            assert!((found - expected).abs() < 0.01 * expected, "{px}: {found} {expected}");
        }
        assert_eq!(pictures.shift_grey(1.5).unwrap(), 255.0);
        let defocus = effects::all().iter().find(|effect| effect.name() == EffectName::Defocus).unwrap();
        assert!(pictures.bound(*defocus).unwrap().grey < 1e-3);
    }
}
