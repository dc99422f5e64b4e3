//! `domecast new NAME`

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use serde_json::{Map, Value, json};

use super::output::{Failure, Output};
use domecast_design::calibration::{CalibrationHints, CameraCalibration};
use domecast_design::catalogue::{self, CatalogueKind};
use domecast_design::{Design, DesignError};
use domecast_files::{OutputRules, StagedFile};

/// The paper's sensor: every field is there, each with its reason.
const START: &str = include_str!("../../../designs/thumb24.json");
/// The schema's name beside the design; editors find it through `$schema`.
const SCHEMA_NAME: &str = "domecast.schema.json";

/// The few numbers that a sensor of one's own follows from.
#[derive(Debug, Args)]
pub struct OwnSensor {
    /// Radius of the dome, mm; the rest follows by rules.
    #[arg(long)]
    radius: Option<f64>,
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
        design["dome"] = json!({ "radius_mm": radius_mm, "why": "asked for with --radius" });
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

    /// The key that stands for a camera of the catalogue; `None` for a calibration file.
    fn camera_key(&self) -> Option<String> {
        let path = self.camera.as_ref()?;
        (!path.is_file() && path.extension().is_none()).then(|| path.display().to_string())
    }

    /// The camera's section with its numbers, so that the design needs no other file.
    fn camera(&self) -> Result<Value, DesignError> {
        let mut section = Map::new();
        let key = match &self.camera {
            Some(path) if path.is_file() || path.extension().is_some() => {
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
    let text = match from {
        None => START.to_owned(),
        Some(path) => domecast_design::read_text(path)?,
    };
    // a start that does not hold would be blamed on the new design
    let start = domecast_design::Design::from_str(&text).map_err(|error| match from {
        Some(path) => error.in_file(path),
        None => error,
    })?;
    let fresh = renamed(&text, start.name(), name);
    domecast_design::Design::from_str(&fresh)?;
    let path = place(name, out);
    let inputs: Vec<&Path> = from.into_iter().collect();
    let schema = write_both(output, &path, fresh.as_bytes(), &output.rules(&inputs))?;
    output.say(&format!("{}: a start, equal to {} but in its name", path.display(), start.name()))?;
    output.say(&format!("{}: lets an editor complete and check it", schema.display()))?;
    output.say("change it, then:")?;
    output.say(&format!("  domecast build {} --watch", path.display()))?;
    output.say("  domecast explain FIELD")?;
    output.result(&json!({ "design": path.display().to_string(), "schema": schema.display().to_string() }))
}

/// Writes a design of one's own, after it was resolved and its dots laid out.
fn run_own(
    output: &Output,
    name: &str,
    own: &OwnSensor,
    radius_mm: f64,
    out: Option<&Path>,
) -> Result<(), Failure> {
    let text = format!("{:#}\n", own.design(name, radius_mm)?);
    let design = Design::from_text_with_cures(&text, Path::new(""))?;
    let laid_out = design.layout().map_err(DesignError::from)?.dots.len();
    let path = place(name, out);
    let inputs: Vec<&Path> = own.camera.as_deref().into_iter().collect();
    let schema = write_both(output, &path, text.as_bytes(), &output.rules(&inputs))?;
    let derived = design.derived().len();
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
    }))
}

/// Where a new design goes.
fn place(name: &str, out: Option<&Path>) -> PathBuf {
    let folder = if Path::new("designs").is_dir() { "designs" } else { "" };
    out.map_or_else(|| Path::new(folder).join(format!("{name}.json")), Path::to_path_buf)
}

/// Writes the design, which must not be there yet, and the schema beside it.
fn write_both(
    output: &Output,
    path: &Path,
    bytes: &[u8],
    rules: &OutputRules<'_>,
) -> Result<PathBuf, Failure> {
    if !rules.force && path.symlink_metadata().is_ok() {
        let problem = "this file exists and is not overwritten";
        return Err(DesignError::at("", "", problem, "a name that is not taken")
            .with_help("choose another name, or another place with --out")
            .in_file(path)
            .into());
    }
    let mut design = StagedFile::new(path, "new", rules)?;
    design.write(bytes)?;
    let schema = path.with_file_name(SCHEMA_NAME);
    let text = format!("{:#}\n", domecast_design::design_schema());
    if std::fs::read(&schema).ok().is_none_or(|earlier| earlier != text.as_bytes()) {
        let mut file = StagedFile::new(&schema, "new", rules)?;
        file.write(text.as_bytes())?;
        output.kept(file.commit()?);
    }
    output.kept(design.commit()?);
    Ok(schema)
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
