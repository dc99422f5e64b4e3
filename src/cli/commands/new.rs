//! `domecast new NAME`

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use serde_json::{Map, Value, json};

use super::output::{Failure, Output};
use domecast_design::calibration::{CalibrationHints, CameraCalibration};
use domecast_design::catalogue::{self, CatalogueKind};
use domecast_design::{Design, DesignError};
use domecast_fab::light::shadow_edges;
use domecast_files::{OutputRules, StagedFile};

/// The shipped designs by name. The first is the paper's sensor: every field is there, each with its reason.
const SHIPPED: [(&str, &str); 7] = [
    ("thumb24", include_str!("../../../designs/thumb24.json")),
    ("thumb24-fisheye", include_str!("../../../designs/thumb24-fisheye.json")),
    ("thumb24-pinhole", include_str!("../../../designs/thumb24-pinhole.json")),
    ("thumb24-wide", include_str!("../../../designs/thumb24-wide.json")),
    ("endoscope-r5", include_str!("../../../designs/endoscope-r5.json")),
    ("picam-r20", include_str!("../../../designs/picam-r20.json")),
    ("digit-rigid", include_str!("../../../designs/digit-rigid.json")),
];
/// The schema's name beside the design; editors find it through `$schema`.
const SCHEMA_NAME: &str = "domecast.schema.json";

/// The few numbers that a sensor of one's own follows from.
#[derive(Debug, Args)]
pub struct OwnSensor {
    /// Radius of the dome, mm; the rest follows by rules.
    #[arg(long)]
    radius: Option<f64>,
    /// Angle at which the dome ends, degrees: a spherical cap below 90 [default: a hemisphere].
    #[arg(long, requires = "radius", conflicts_with = "cylinder_height")]
    rim_angle: Option<f64>,
    /// Height of a cylinder that a hemisphere stands on, mm [default: none].
    #[arg(long, requires = "radius")]
    cylinder_height: Option<f64>,
    /// The camera: a calibration file (OpenCV, ROS, Kalibr), or a key of `domecast list cameras` [default: that of --body].
    #[arg(long, requires = "radius")]
    camera: Option<PathBuf>,
    /// The camera's body: a key of `domecast list cameras` [default: that of --camera, where it is a key].
    #[arg(long, requires = "radius")]
    body: Option<String>,
    /// What carries the upper platform: springs, or posts (rigid: no net wrench is promised).
    #[arg(long, requires = "radius", value_parser = ["springs", "rigid"])]
    mount: Option<String>,
    /// Wanted number of dots; as many as come nearest are laid out.
    #[arg(long, requires = "radius")]
    dots: Option<u32>,
    /// Kind of pattern: square, hexagonal, rings, fill.
    #[arg(long, requires = "radius")]
    pattern: Option<String>,
}

impl OwnSensor {
    /// The design file: only what no rule can give, each with its reason.
    fn design(&self, name: &str, radius_mm: f64) -> Result<Value, DesignError> {
        let mut design = json!({ "$schema": SCHEMA_NAME, "version": 1, "name": name });
        design["camera"] = self.camera()?;
        if let Some(key) = self.body.clone().or_else(|| self.camera_key()) {
            let key = key.as_str();
            let entry = catalogue::find(&[CatalogueKind::Cameras], key)?;
            let mut body = Map::new();
            let mut why = Map::new();
            for (field, value) in entry.section("camera_body") {
                body.insert(field.to_owned(), value.value.clone());
                why.insert(field.to_owned(), json!(format!("{}: {}", entry.name, value.source)));
            }
            if body.is_empty() {
                return Err(DesignError::at(
                    "camera_body",
                    json!(key),
                    "the catalogue has nothing of this camera's body",
                    "a camera whose body it has",
                )
                .with_help(
                    "leave --body out, and give camera_body.diameter_mm and length_mm of the lens barrel yourself",
                ));
            }
            body.insert("why".into(), Value::Object(why));
            design["camera_body"] = Value::Object(body);
        }
        if self.mount.as_deref() == Some("rigid") {
            design["mount"] = json!({ "kind": "rigid", "why": "asked for with --mount" });
        }
        design["dome"] = self.dome(radius_mm);
        let mut pattern = Map::new();
        let asked =
            [("kind", self.pattern.as_ref().map(|kind| json!(kind))), ("count", self.dots.map(|n| json!(n)))];
        for (field, value) in asked {
            pattern.extend(value.map(|value| (field.to_owned(), value)));
        }
        if !pattern.is_empty() {
            pattern.insert("why".into(), json!("asked for with --dots and --pattern"));
            design["pattern"] = Value::Object(pattern);
        }
        Ok(design)
    }

    /// The dome's section.
    fn dome(&self, radius_mm: f64) -> Value {
        let mut dome = json!({ "radius_mm": radius_mm });
        let mut asked = "asked for with --radius".to_owned();
        for (field, flag, value) in [
            ("rim_angle_deg", "--rim-angle", self.rim_angle),
            ("cylinder_height_mm", "--cylinder-height", self.cylinder_height),
        ] {
            if let Some(value) = value {
                dome[field] = json!(value);
                asked += " and ";
                asked += flag;
            }
        }
        dome["why"] = json!(asked);
        dome
    }

    /// The calibration file, where one is named.
    fn calibration_file(&self) -> Option<&Path> {
        self.camera.as_deref().filter(|path| path.is_file() || path.extension().is_some())
    }

    /// What is unusual about the calibration.
    fn warnings(&self) -> Vec<String> {
        let found =
            self.calibration_file().map(|path| CameraCalibration::load(path, &CalibrationHints::default()));
        found.and_then(Result::ok).map_or_else(Vec::new, |found| found.warnings().to_vec())
    }

    /// The key that stands for a camera of the catalogue; `None` for a calibration file.
    fn camera_key(&self) -> Option<String> {
        let path = self.camera.as_ref()?;
        (!path.is_file() && path.extension().is_none()).then(|| path.display().to_string())
    }

    /// The camera's section with its numbers, so that the design needs no other file.
    fn camera(&self) -> Result<Value, DesignError> {
        let mut section = Map::new();
        let key = match &self.camera {
            Some(path) if self.calibration_file().is_some() => {
                let found = CameraCalibration::load(path, &CalibrationHints::default())?;
                section.extend(found.fields());
                section.insert("why".into(), json!(format!("a calibration: {}", path.display())));
                return Ok(Value::Object(section));
            }
            Some(key) => key.display().to_string(),
            None => self.body.clone().ok_or_else(|| {
                DesignError::at(
                    "camera",
                    "",
                    "no camera is named",
                    "--camera with a calibration file or a key",
                )
                .with_help("`domecast list cameras` shows the keys")
            })?,
        };
        let entry = catalogue::find(&[CatalogueKind::Cameras], &key)?;
        let mut why = Map::new();
        for (field, value) in entry.section("camera") {
            section.insert(field.to_owned(), value.value.clone());
            why.insert(field.to_owned(), json!(format!("{}: {}", entry.name, value.source)));
        }
        section.insert("why".into(), Value::Object(why));
        Ok(Value::Object(section))
    }
}

/// Writes a starting design and the schema that lets an editor complete and check it. Nothing is overwritten but an
/// earlier schema of ours.
pub fn run(
    output: &Output,
    name: &str,
    from: Option<&Path>,
    own: &OwnSensor,
    out: Option<&Path>,
) -> Result<(), Failure> {
    if let Some(radius_mm) = own.radius {
        return run_own(output, name, own, radius_mm, out);
    }
    let (text, from) = start(from)?;
    // a start that does not hold would be blamed on the new design
    let start = domecast_design::Design::from_str(&text).map_err(|error| match from {
        Some(path) => error.in_file(path),
        None => error,
    })?;
    let fresh = renamed(&text, start.name(), name);
    domecast_design::Design::from_str(&fresh)?;
    let path = place(name, out);
    let inputs: Vec<&Path> = from.into_iter().collect();
    let schema = write_both(output, &path, fresh.as_bytes(), design_schema(), &output.rules(&inputs))?;
    output.say(&format!("{}: a start, equal to {} but in its name", path.display(), start.name()))?;
    output.say(&format!("{}: lets an editor complete and check it", schema.display()))?;
    output.say("change it, then:")?;
    output.say(&format!("  domecast build {} --watch", path.display()))?;
    output.say("  domecast explain FIELD")?;
    output.result(&json!({ "design": path.display().to_string(), "schema": schema.display().to_string() }))
}

/// The text to start from, and the file that it is of: a file comes before a shipped design of that name, a folder of that
/// name, such as a build, does not.
fn start(from: Option<&Path>) -> Result<(String, Option<&Path>), Failure> {
    let Some(path) = from else { return Ok((SHIPPED[0].1.to_owned(), None)) };
    let shipped = SHIPPED.iter().find(|(name, _)| path.as_os_str() == *name);
    if let Some((_, text)) = shipped.filter(|_| !path.is_file()) {
        return Ok(((*text).to_owned(), None));
    }
    let text = domecast_design::read_text(path).map_err(|error| {
        let names = SHIPPED.map(|(name, _)| name).join(", ");
        if path.exists() { error } else { error.with_help(format!("shipped designs: {names}")) }
    })?;
    Ok((text, Some(path)))
}

/// Writes a design of one's own, after it was resolved and its dots laid out.
fn run_own(
    output: &Output,
    name: &str,
    own: &OwnSensor,
    radius_mm: f64,
    out: Option<&Path>,
) -> Result<(), Failure> {
    let asked = own.design(name, radius_mm)?;
    let text = format!("{asked:#}\n");
    let design = Design::from_text_with_cures(&text, Path::new(""))?;
    let (text, design) = off_shadows(&design, asked).unwrap_or((text, design));
    let laid_out = design.layout().map_err(DesignError::from)?.dots.len();
    let path = place(name, out);
    let inputs: Vec<&Path> = own.camera.as_deref().into_iter().collect();
    let schema = write_both(output, &path, text.as_bytes(), design_schema(), &output.rules(&inputs))?;
    let derived = design.derived().len();
    let warnings = own.warnings();
    warnings.iter().for_each(|warning| output.warn(warning));
    output.say(&format!("{}: {laid_out} dots, {derived} fields left to rules", path.display()))?;
    if let Some(asked) = own.dots.filter(|asked| *asked as usize != laid_out) {
        output
            .say(&format!("{asked} dots were asked for; {laid_out} is the nearest that this pattern has"))?;
    }
    output.say("next:")?;
    output.say(&format!("  domecast build {}", path.display()))?;
    output.say(&format!("  domecast explain --design {}", path.display()))?;
    output.result(&json!({
        "design": path.display().to_string(),
        "schema": schema.display().to_string(),
        "dots": laid_out,
        "derived": derived,
        "warnings": warnings,
    }))
}

/// A pattern that ends nearer to the pole than this is none, degrees.
const MIN_POLAR_DEG: f64 = 20.0;

/// The design with its pattern inside of what its lights light evenly; `None` where it is already, or cannot be.
fn off_shadows(design: &Design, mut asked: Value) -> Option<(String, Design)> {
    let edges = shadow_edges(design).ok()??;
    let polar_deg = edges.from_polar_deg.filter(|deg| edges.dots > 0 && *deg >= MIN_POLAR_DEG)?.floor();
    let why = "dots lie inside of where the lights' shadows on the dome begin, by its lit frame at rest";
    asked["pattern"]["polar_angle_deg"] = json!(polar_deg);
    match &mut asked["pattern"]["why"] {
        Value::String(whole) => *whole = format!("{whole}; {why}"),
        other => *other = json!(why),
    }
    let text = format!("{asked:#}\n");
    let changed = Design::from_text_with_cures(&text, Path::new("")).ok()?;
    changed.layout().ok()?;
    Some((text, changed))
}

/// Where a new design goes.
fn place(name: &str, out: Option<&Path>) -> PathBuf {
    let folder = if Path::new("designs").is_dir() { "designs" } else { "" };
    out.map_or_else(|| Path::new(folder).join(format!("{name}.json")), Path::to_path_buf)
}

/// Name and content of the schema beside a design.
fn design_schema() -> (&'static str, Value) {
    (SCHEMA_NAME, domecast_design::design_schema().clone())
}

/// Writes a design or a scene, which must not be there yet, and the schema beside it.
pub(super) fn write_both(
    output: &Output,
    path: &Path,
    bytes: &[u8],
    (schema_name, schema): (&str, Value),
    rules: &OutputRules<'_>,
) -> Result<PathBuf, Failure> {
    if !rules.force && path.symlink_metadata().is_ok() {
        let problem = "this file exists and is not overwritten";
        return Err(DesignError::at("", "", problem, "a name that is not taken")
            .with_help("choose another name, or another place with --out")
            .in_file(path)
            .into());
    }
    let mut written = StagedFile::new(path, "new", rules)?;
    written.write(bytes)?;
    let schema_path = path.with_file_name(schema_name);
    let text = format!("{schema:#}\n");
    if std::fs::read(&schema_path).ok().is_none_or(|earlier| earlier != text.as_bytes()) {
        let mut file = StagedFile::new(&schema_path, "new", rules)?;
        file.write(text.as_bytes())?;
        output.kept(file.commit()?);
    }
    output.kept(written.commit()?);
    Ok(schema_path)
}

/// The text with its name replaced and the schema named on top; layout and reasons stay as they are.
fn renamed(text: &str, old: &str, new: &str) -> String {
    let name = |name: &str| format!("\"name\": {}", json!(name));
    let mut fresh = text.replacen(&name(old), &name(new), 1);
    if !fresh.contains("\"$schema\"") {
        fresh = fresh.replacen('{', &format!("{{\n  \"$schema\": \"{SCHEMA_NAME}\","), 1);
    }
    fresh
}
