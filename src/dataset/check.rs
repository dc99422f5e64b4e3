//! The spec as read: every rule between its fields holds.

use std::path::{Path, PathBuf};

use serde_json::json;
use sha2::{Digest, Sha256};

use crate::spec::{DatasetSpec, Split};
use crate::splits::spread;
use domecast_design::{Design, DesignError, FileKind};
use domecast_sim::scene::objects::ShapeSection;

/// A spec, its design, and where relative paths start.
#[derive(Debug, Clone)]
pub struct Dataset {
    pub(crate) spec: DatasetSpec,
    pub(crate) folder: PathBuf,
    pub(crate) design: Design,
    pub(crate) hash: String,
    /// Split of each sensor.
    pub(crate) splits: Vec<Split>,
}

/// Changes when other bytes come of the same spec.
const FORM: &str = "domecast-dataset 2";

pub(crate) fn sha256_hex(parts: &[&[u8]]) -> String {
    let mut digest = Sha256::new();
    for part in parts {
        digest.update((part.len() as u64).to_le_bytes());
        digest.update(part);
    }
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Dataset {
    /// Reads a spec and the design that it names.
    ///
    /// # Errors
    /// The first fault of either, with its file and field.
    pub fn load(path: &Path) -> Result<Self, DesignError> {
        let text = domecast_design::read_text(path)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let read = || -> Result<DatasetSpec, DesignError> {
            let value = domecast_design::parse_json(&text)?;
            FileKind::Dataset.expect(&value)?;
            let spec: DatasetSpec = domecast_design::from_value(&value)?;
            check(&spec)?;
            Ok(spec)
        };
        let spec = read().map_err(|error| error.in_file(path))?;
        let design = Design::load(&folder.join(&spec.design))?;
        check_size(&spec, &design).map_err(|error| error.in_file(path))?;
        let meshes = meshes(&spec, &folder).map_err(|error| error.in_file(path))?;
        let written = json!(DatasetSpec { schema: None, description: None, why: None, ..spec.clone() });
        let mut parts = vec![FORM.as_bytes(), env!("CARGO_PKG_VERSION").as_bytes(), design.text().as_bytes()];
        let written = written.to_string();
        parts.push(written.as_bytes());
        parts.extend(meshes.iter().map(Vec::as_slice));
        let hash = sha256_hex(&parts);
        let sensors = &spec.sensors;
        let splits = spread([sensors.train, sensors.val, sensors.test]);
        Ok(Self { spec, folder, design, hash, splits })
    }

    /// The spec as read.
    pub fn spec(&self) -> &DatasetSpec {
        &self.spec
    }

    /// SHA-256 of all that the bytes of the set depend on, hexadecimal.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Number of pairs.
    pub fn pairs(&self) -> u32 {
        self.spec.videos / 2
    }

    /// Sensors of all splits.
    pub fn sensors(&self) -> u32 {
        let sensors = &self.spec.sensors;
        sensors.train + sensors.val + sensors.test
    }
}

fn meshes(spec: &DatasetSpec, folder: &Path) -> Result<Vec<Vec<u8>>, DesignError> {
    let mut found = Vec::new();
    for (index, shape) in spec.shapes.iter().enumerate() {
        if let ShapeSection::Mesh { file, .. } = &shape.shape {
            let read = std::fs::File::open(folder.join(file));
            let bytes = read.and_then(|file| domecast_design::read_up_to(file, 1 << 28));
            found.push(bytes.map_err(|error| {
                let field = format!("shapes[{index}].shape.file");
                DesignError::at(field, json!(file), format!("cannot be read ({error})"), "a closed STL file")
            })?);
        }
    }
    Ok(found)
}

fn fault(field: &str, value: impl std::fmt::Display, problem: &str, allowed: &str) -> DesignError {
    DesignError::at(field, value, problem, allowed)
}

/// A range that rises, its ends within bounds.
fn range(field: &str, [low, high]: [f64; 2], min: f64, max: f64) -> Result<(), DesignError> {
    if low <= high && low >= min && high <= max {
        return Ok(());
    }
    let problem = if low > high { "the range falls" } else { "the range is out of bounds" };
    Err(fault(field, json!([low, high]), problem, &format!("[low, high] from {min} to {max}")))
}

/// Above what a logarithm needs.
const TINY: f64 = 1e-9;

fn check(spec: &DatasetSpec) -> Result<(), DesignError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if spec.name.is_empty() || spec.name.len() > 48 || !spec.name.chars().all(plain) {
        let allowed = "1 to 48 letters, digits, `-` or `_`";
        return Err(fault("name", json!(spec.name), "not a name for a set", allowed));
    }
    if !spec.videos.is_multiple_of(2) {
        return Err(fault("videos", spec.videos, "videos come in pairs", "an even number"));
    }
    let frames = &spec.frames;
    range("frames.duration_s", frames.duration_s, 1e-3, 1e4)?;
    let [min_count, max_count] = frames.before_contact;
    if min_count < 1 || min_count > max_count || max_count + 1 >= frames.count {
        let allowed = "[min, max] from 1, with two frames left for the contact";
        return Err(fault(
            "frames.before_contact",
            json!([min_count, max_count]),
            "no such numbers",
            allowed,
        ));
    }
    match (&spec.hardness.classes, spec.hardness.young_mpa) {
        (Some([one, other]), None) => {
            if one.name == other.name || one.young_mpa >= other.young_mpa {
                let allowed = "two names, the softer class first";
                return Err(fault("hardness.classes", "", "no two classes in order", allowed));
            }
        }
        (None, Some(young)) => range("hardness.young_mpa", young, TINY, 1e7)?,
        _ => {
            let allowed = "either `classes` or `young_mpa`";
            return Err(fault("hardness", "", "it must be one of two things", allowed));
        }
    }
    range("poisson", spec.poisson, 0.0, 0.499)?;
    range("friction", spec.friction, 0.0, 10.0)?;
    check_press(spec)?;
    range("light.power", spec.light.power, TINY, 1000.0)?;
    range("light.stray_level", spec.light.stray_level, 0.0, 1.0)?;
    range("camera.full_scale_electrons", spec.camera.full_scale_electrons, 1.0, 1e8)?;
    range("camera.read_electrons", spec.camera.read_electrons, 0.0, 1e5)?;
    range("sensors.focus_mm", spec.sensors.focus_mm, TINY, 1e6)?;
    range("sensors.crosstalk", spec.sensors.crosstalk, 0.0, 1.0)?;
    check_splits(spec)?;
    check_noise(spec)
}

fn check_press(spec: &DatasetSpec) -> Result<(), DesignError> {
    let press = &spec.press;
    range("press.peak_force_n", press.peak_force_n, 1e-3, 1e4)?;
    range("press.ramp_exponent", press.ramp_exponent, 0.1, 10.0)?;
    range("press.hold_part", press.hold_part, 0.0, 0.9)?;
    range("press.approach_mm_s", press.approach_mm_s, 0.0, 1e4)?;
    range("press.polar_deg", press.polar_deg, 0.0, 60.0)?;
    range("press.lean_deg", press.lean_deg, 0.0, 45.0)?;
    range("press.drag_mm", press.drag_mm, 0.0, 10.0)
}

/// Every split that has sensors has shapes, and none is without both.
fn check_splits(spec: &DatasetSpec) -> Result<(), DesignError> {
    let sensors = &spec.sensors;
    let counts = [sensors.train, sensors.val, sensors.test];
    if counts.iter().all(|count| *count == 0) {
        return Err(fault("sensors", "", "there is no sensor", "at least one in `train`, `val` or `test`"));
    }
    if counts.iter().sum::<u32>() > spec.videos / 2 {
        let allowed = "at most one sensor for each pair of videos";
        return Err(fault("sensors", "", "there are more sensors than pairs", allowed));
    }
    for (split, count) in Split::ALL.into_iter().zip(counts) {
        let shapes = spec.shapes.iter().filter(|shape| shape.split == split).count();
        if (count > 0) != (shapes > 0) {
            let problem = format!("the split `{}` has {count} sensors and {shapes} shapes", split.as_str());
            let allowed = "both in each split, or neither";
            return Err(fault("shapes", "", &problem, allowed));
        }
    }
    for (index, shape) in spec.shapes.iter().enumerate() {
        let field = |name: &str| format!("shapes[{index}].{name}");
        if let Some(scale) = shape.scale {
            range(&field("scale"), scale, TINY, 1e4)?;
        }
        range(&field("tilt_deg"), shape.tilt_deg, 0.0, 90.0)?;
        if spec.shapes.iter().take(index).any(|other| other.name == shape.name) {
            return Err(fault(
                &field("name"),
                json!(shape.name),
                "another shape has it",
                "a name of its own",
            ));
        }
    }
    Ok(())
}

fn check_noise(spec: &DatasetSpec) -> Result<(), DesignError> {
    let n = &spec.readings.noise;
    let travel = spec.readings.robot_travel_sd_mm.unwrap_or(0.0);
    let all = [n.force_n, n.moment_nmm, n.shift_mm, n.turn_rad, n.spring_percent, n.dots_px, n.radius_mm];
    if all.iter().chain([&n.radius_percent, &travel]).all(|sd| (0.0..=1e6).contains(sd)) {
        return Ok(());
    }
    Err(fault("readings", "", "a standard deviation is negative or none", "numbers from 0 on"))
}

/// The small camera is the design's, coarser.
fn check_size(spec: &DatasetSpec, design: &Design) -> Result<(), DesignError> {
    let camera = &design.sections().camera;
    let (width, height) = (spec.frames.width, spec.frames.height);
    let same = u64::from(width) * u64::from(camera.height) == u64::from(height) * u64::from(camera.width);
    if same && width <= camera.width {
        return Ok(());
    }
    let allowed = format!("sides as {} to {}, at most those", camera.width, camera.height);
    Err(fault("frames.width", json!([width, height]), "not the design's picture, coarser", &allowed))
}
