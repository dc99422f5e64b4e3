//! From the file as written to a scene in which the rules between fields hold.

use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;

use super::check_camera;
use super::file::{LevelName, MotionSection, SceneFile};
use super::model::{RIM_POINTS, Scene, SceneDot};
use super::motion::Motion;
use super::object::SceneObject;
use crate::SimError;
use domecast_contact::ContactError;
use domecast_design;
use domecast_design::layout::{Dot, Layout};
use domecast_design::suspension_of;
use domecast_design::{Design, DesignError};
use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;
use domecast_springs::Suspension;

impl Scene {
    /// Reads and resolves a scene file, with the design that it names.
    ///
    /// # Errors
    /// The first fault of scene, design or meshes, with its file and field.
    pub fn load(path: &Path) -> Result<Self, SimError> {
        load(path)
    }

    /// Resolves a scene's text; relative paths start at `folder`.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_text(text: &str, folder: &Path) -> Result<Self, SimError> {
        from_text(text, folder)
    }

    /// Resolves a scene with a design that is there already.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn new(file: SceneFile, folder: &Path, design: Design) -> Result<Self, SimError> {
        resolve(file, folder, design)
    }
}

fn load(path: &Path) -> Result<Scene, SimError> {
    let text = domecast_design::read_text(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    from_text(&text, folder).map_err(|error| match error {
        SimError::Input(error) if error.file.is_none() => error.in_file(path).into(),
        other => other,
    })
}

fn from_text(text: &str, folder: &Path) -> Result<Scene, SimError> {
    let value = domecast_design::parse_json(text)?;
    domecast_design::FileKind::Scene.expect(&value)?;
    let file: SceneFile = domecast_design::from_value(&value)?;
    let path = folder.join(&file.design);
    let design = Design::load(&path)?;
    resolve(file, folder, design)
}

fn resolve(file: SceneFile, folder: &Path, design: Design) -> Result<Scene, SimError> {
    check_own(&file, &design)?;
    let layout = Layout::of_design(&design)?;
    let suspension = if design.is_rigid() { None } else { Some(suspension_of(&design)?) };
    let dots = layout.dots.iter().map(|dot| scene_dot(dot, design.optics())).collect();
    let diameter_mm = design.sections().white_markers.diameter_mm;
    let numbered = (0..).zip(design.white_markers_mm());
    let markers = numbered.map(|(id, position_mm)| Marker { id, position_mm, diameter_mm }).collect();
    happening(file, folder, Sensor { design, layout, suspension, dots, markers })
}

/// What a scene's own fields say against each other and the camera.
fn check_own(file: &SceneFile, design: &Design) -> Result<(), SimError> {
    check(file)?;
    let lens = design.optics().lens().spec();
    Ok(check_camera::check(file, [lens.width, lens.height])?)
}

/// What of a scene is the sensor's.
pub(super) struct Sensor {
    pub design: Design,
    pub layout: Layout,
    pub suspension: Option<Suspension>,
    /// The dots, none of them broken.
    pub dots: Vec<SceneDot>,
    pub markers: Vec<Marker>,
}

/// What happens to a sensor.
pub(super) fn happening(file: SceneFile, folder: &Path, sensor: Sensor) -> Result<Scene, SimError> {
    let Sensor { design, layout, suspension, mut dots, markers } = sensor;
    check_own(&file, &design)?;
    if design.is_rigid() && file.motion.is_some() {
        let allowed = "no `motion`: objects may press on the dome, or a design with mount.kind = \"springs\"";
        return Err(DesignError::at("motion", "", "rigid mount: the platform does not move", allowed).into());
    }
    check_dome(&file, &design)?;
    check_gel(&file, &design)?;
    for (index, broken) in file.ink.broken.iter().enumerate() {
        let count = dots.len();
        let dot = dots.get_mut(broken.id as usize).ok_or_else(|| {
            let allowed = format!("a dot of the design, 0 to {}", count.saturating_sub(1));
            DesignError::at(format!("ink.broken[{index}].id"), broken.id, "there is no such dot", allowed)
        })?;
        dot.cut = Some((broken.left, broken.direction_deg.to_radians()));
    }
    let motion = Motion::new(file.motion.as_ref(), &design, suspension.as_ref());
    let object = |(index, section): (usize, &super::objects::ObjectSection)| {
        SceneObject::new(section, &format!("objects[{index}]"), folder)
    };
    let objects = file.objects.iter().enumerate().map(object).collect::<Result<Vec<_>, _>>()?;
    if let Some(suspension) = &suspension {
        check_loads(&motion, suspension, &file)?;
    }
    Ok(Scene {
        file,
        folder: folder.to_path_buf(),
        design,
        layout,
        suspension,
        dots,
        markers,
        motion,
        objects,
        kept: OnceLock::new(),
        cache: None,
    })
}

/// A dot as printed: its outline carried from the image at rest to the dome.
fn scene_dot(dot: &Dot, optics: &SensorOptics) -> SceneDot {
    let pieces = dot.image_outline.pieces().len().max(1);
    let fine = dot.image_outline.polygon((RIM_POINTS / pieces).max(1) as u32);
    let mut rim_mm = [dot.surface_mm; RIM_POINTS];
    let (radius_mm, center_mm) = (0.5 * dot.diameter_mm, optics.dome().center_mm());
    let side = if dot.normal.z.abs() < 0.9 { DVec3::Z.cross(dot.normal) } else { DVec3::X.cross(dot.normal) };
    let side = side.normalize_or_zero();
    let up = dot.normal.cross(side);
    for (k, place) in rim_mm.iter_mut().enumerate() {
        // An outline with another number of pieces, or a point of it that the lens does not see, is replaced by
        // the circle of the same area.
        let seen = fine.get(k).filter(|_| fine.len() == RIM_POINTS).and_then(|px| optics.trace(*px).ok());
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / RIM_POINTS as f64).sin_cos();
        let flat = dot.surface_mm + (side * cos + up * sin) * radius_mm;
        *place = seen
            .map_or(center_mm + (flat - center_mm).normalize_or_zero() * optics.dome_radius_mm(), |hit| {
                hit.surface_mm
            });
    }
    SceneDot { id: dot.id, center_mm: dot.surface_mm, rim_mm, cut: None }
}

fn check(file: &SceneFile) -> Result<(), DesignError> {
    let name_ok = !file.name.is_empty()
        && file.name.len() <= 64
        && file.name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    if !name_ok {
        return Err(DesignError::at(
            "name",
            serde_json::json!(file.name),
            "not a name for a scene",
            "1 to 64 letters, digits, `-` or `_`",
        ));
    }
    match &file.motion {
        None => {}
        Some(MotionSection::Wrench(motion)) => {
            check_times("motion.wrench", motion.wrench.iter().map(|key| key.time_s))?;
        }
        Some(MotionSection::Pose(motion)) => {
            check_times("motion.pose", motion.pose.iter().map(|key| key.time_s))?;
        }
    }
    for (index, object) in file.objects.iter().enumerate() {
        check_times(&format!("objects[{index}].path"), object.path.iter().map(|key| key.time_s))?;
        if let Some(press) = &object.press {
            check_times(&format!("objects[{index}].press.force"), press.force.iter().map(|key| key.time_s))?;
        }
        if file.motion.is_some() {
            return Err(DesignError::at(
                "motion",
                "",
                "an object moves the platform by itself",
                "no `motion` beside objects: what they press is what the springs carry",
            ));
        }
    }
    Ok(())
}

/// A slow gel has terms that are some, and a level that knows them.
fn check_gel(file: &SceneFile, design: &Design) -> Result<(), DesignError> {
    let Some(gel) = &file.slow_gel else { return Ok(()) };
    let fault = |error: ContactError| {
        let allowed = "terms of positive times whose parts leave 0.01 of the modulus or more";
        DesignError::at("slow_gel.terms", "", error.to_string(), allowed)
    };
    gel.resolved(design.sections().elastomer.young_modulus_mpa).map_err(fault)?;
    if !file.objects.is_empty() && file.contact.level != LevelName::Linear {
        let problem = "a slow gel is computed by the linear level only";
        let allowed = "`linear`, or a scene without `slow_gel`";
        return Err(DesignError::at("contact.level", file.contact.level.as_str(), problem, allowed));
    }
    Ok(())
}

/// Another dome than a hemisphere is computed by the linear level only.
fn check_dome(file: &SceneFile, design: &Design) -> Result<(), DesignError> {
    let dome = design.optics().dome();
    let level = file.contact.level;
    if dome.is_hemisphere() || file.objects.is_empty() || level == LevelName::Linear {
        return Ok(());
    }
    let problem = format!("the dome is {}, this level computes hemispheres only", dome.kind());
    let allowed = "`linear`, or a design whose dome is a hemisphere";
    Err(DesignError::at("contact.level", level.as_str(), problem, allowed))
}

/// Every load of the scene has a place inside the envelope; coils that bind are a matter of the frame.
fn check_loads(motion: &Motion, suspension: &Suspension, file: &SceneFile) -> Result<(), DesignError> {
    let Some(MotionSection::Wrench(keys)) = &file.motion else { return Ok(()) };
    for (index, key) in keys.wrench.iter().enumerate() {
        if let Some(passed) = motion.passed_at(suspension, key.time_s) {
            let [value, bound] = [passed.value, passed.bound];
            return Err(DesignError::at(
                format!("motion.wrench[{index}]"),
                serde_json::json!(key),
                format!(
                    "the load is beyond the envelope: {} at {}, {value:.3} {}",
                    passed.limit.as_str(),
                    passed.part,
                    passed.unit
                ),
                format!("at most {bound:.3} {}", passed.unit),
            ));
        }
    }
    Ok(())
}

/// Times rise strictly, so that there is one state at each.
fn check_times(field: &str, times: impl Iterator<Item = f64>) -> Result<(), DesignError> {
    let mut last = f64::NEG_INFINITY;
    for (index, time) in times.enumerate() {
        if time <= last {
            return Err(DesignError::at(
                format!("{field}[{index}].time_s"),
                time,
                "the times do not rise",
                format!("more than {last}"),
            ));
        }
        last = time;
    }
    Ok(())
}
