//! Objects deform the dome, and press the platform on its springs.

use crate::bound::Bound;
use crate::contact::level::{largest_px_per_mm, level_named, level_of};
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::raster::spots::Points;
use crate::scene::file::LevelName;
use crate::scene::object::{Hold, SceneObject};
use crate::{Pipeline, Scene, SimError};
use domecast_contact::{estimate, max_force_n};

/// See the module.
pub struct ContactEffect;

/// Times at which an object's way is looked at.
const LOOKS: u32 = 257;

/// Balances' worth of work of several contacts until they agree: their trials do not begin at each other's end.
const TURNS: f64 = 30.0;
/// Directions of the dome at which its depth in an object is looked at.
const DEPTH_LOOKS: u32 = 2000;

/// Predicted work of a level for a frame.
fn per_frame(scene: &Scene, name: LevelName) -> u64 {
    let elastomer = crate::elastomer_of(scene.design());
    let depth_mm = 0.1 * elastomer.depth_scale_mm();
    let of_object = |object: &SceneObject| {
        estimate(level_named(scene, name), &elastomer, &object.indenter, depth_mm).work
    };
    let work: f64 = scene.objects().iter().map(of_object).sum();
    let turns = if scene.objects().len() > 1 { TURNS } else { 1.0 };
    (turns * work) as u64
}

/// A coarser level than the scene's that the plan may take: its name, how far its pictures of dots may be from those
/// of the scene's level, px, and the work that it saves in a frame. Cheapest first; none where an object is
/// pressed on by a force, for its depth is not known before it is solved. Where the scene's tolerance names a force,
/// only levels whose force keeps it.
pub fn coarser_levels(scene: &Scene) -> Vec<(LevelName, f64, u64)> {
    let best = scene.file().contact.level;
    let Some(depth_mm) = deepest_mm(scene) else { return Vec::new() };
    // Several contacts, a slow gel, and a dome that is no hemisphere are what the scene's own level makes of them.
    let [object] = scene.objects() else { return Vec::new() };
    if scene.file().slow_gel.is_some() || !scene.optics().dome().is_hemisphere() {
        return Vec::new();
    }
    let elastomer = crate::elastomer_of(scene.design());
    let hardest_n = max_force_n(&elastomer, &object.indenter, depth_mm);
    let errors = |name| {
        let found = estimate(level_named(scene, name), &elastomer, &object.indenter, depth_mm);
        found.applies.then_some((found.displacement_mm, found.force_part * hardest_n))
    };
    let Some((own_mm, own_n)) = errors(best) else { return Vec::new() };
    let max_n = scene.file().tolerance.force_n.unwrap_or(f64::INFINITY);
    let px_per_mm = largest_px_per_mm(scene);
    let own_work = per_frame(scene, best);
    [LevelName::Geometric, LevelName::ClosedForm, LevelName::Linear]
        .into_iter()
        .filter(|name| *name < best)
        .filter_map(|name| {
            // Both are within their bounds of the reference.
            let (error_mm, error_n) = errors(name)?;
            let px = (error_mm + own_mm) * px_per_mm;
            (error_n + own_n <= max_n).then_some((name, px, own_work.saturating_sub(per_frame(scene, name))))
        })
        .filter(|(_, _, saved)| *saved > 0)
        .collect()
}

/// A bound on how deep the undeformed dome at rest lies in an object that is held, over the frames; `None` where
/// the object is pressed on instead.
fn deepest_mm(scene: &Scene) -> Option<f64> {
    let object = scene.objects().first()?;
    let radius_mm = scene.optics().dome_radius_mm();
    // No point of the dome is further from a direction looked at than this.
    let spacing_mm = 2.5 * radius_mm / f64::from(DEPTH_LOOKS).sqrt();
    let frames = scene.frame_count().min(LOOKS);
    let mut deepest: f64 = 0.0;
    for k in 0..frames {
        let frame = if frames > 1 { k * (scene.frame_count() - 1) / (frames - 1) } else { 0 };
        match object.hold_at(scene.time_s(frame)) {
            Hold::Pressed(..) => return None,
            Hold::Away(_) => {}
            Hold::At(pose) => {
                let object_from_rest = pose.inverse();
                for i in 0..DEPTH_LOOKS {
                    let height = (f64::from(i) + 0.5) / f64::from(DEPTH_LOOKS);
                    // The golden angle spreads them evenly.
                    let turn = f64::from(i) * 2.399_963_229_728_653;
                    let flat = (1.0 - height * height).max(0.0).sqrt();
                    let at = glam::DVec3::new(flat * turn.cos(), flat * turn.sin(), height) * radius_mm;
                    let distance = object.indenter.solid.distance(object_from_rest.point(at));
                    deepest = deepest.max(spacing_mm - distance.value_mm);
                }
            }
        }
    }
    Some(deepest)
}

impl Effect for ContactEffect {
    fn name(&self) -> EffectName {
        EffectName::Contact
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let dome = scene.optics().dome();
        let end_s = scene.time_s(scene.frame_count().saturating_sub(1));
        let touches = |object: &&SceneObject| {
            (0..LOOKS).any(|k| object.may_touch(end_s * f64::from(k) / f64::from(LOOKS - 1), dome))
        };
        let names: Vec<&str> =
            scene.objects().iter().filter(touches).map(|object| object.name.as_str()).collect();
        (!names.is_empty())
            .then(|| format!("{} may touch the dome; {} level", names.join(" and "), level_of(scene).name()))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        // What a touched dome shows without the touch has no bound worth a tolerance.
        Ok(Bound::UNBOUNDED)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let name = scene.file().contact.level;
        let elastomer = crate::elastomer_of(scene.design());
        let once = scene
            .objects()
            .first()
            .map_or(0.0, |object| estimate(level_of(scene), &elastomer, &object.indenter, 0.0).setup_work);
        Cost { once: once as u64, per_frame: per_frame(scene, name) + Points::count(scene) * 100 }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.contact = Some(level_of(scene));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::stepper::Stepper;
    use crate::work::Work;
    use std::path::Path;

    #[test]
    fn what_contact_costs_is_near_what_it_takes() {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes");
        for name in ["ball", "block-hard", "nut", "usb-plug"] {
            let scene = Scene::load(&folder.join(name).with_extension("json")).unwrap();
            let mut stepper = Stepper::new(&scene, level_of(&scene)).unwrap();
            let (mut work, mut touched) = (Work::default(), 0);
            for frame in 0..scene.frame_count().min(17) {
                let touch = stepper.next(frame, scene.time_s(frame), &mut work).unwrap();
                touched += u64::from(touch.contact.is_some());
            }
            let counted = work.of(EffectName::Contact) as f64 / touched as f64;
            let ratio = ContactEffect.cost(&scene).per_frame as f64 / counted;
            println!("{name}: {ratio:.2} times what {touched} touched frames take");
            assert!((0.1..10.0).contains(&ratio), "{name}: {ratio}");
        }
    }
}
