//! What a design takes from elsewhere: a camera's calibration, and parts of the catalogue by their keys.
//!
//! This works on the file's tree, before anything else looks at it. What the file gives itself always wins; the source
//! of each value that is filled in is written into the section's `why`, and the words that named it are taken out.
//! What follows sees an ordinary design, complete in itself.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::calibration::{CalibrationHints, CameraCalibration};
use super::catalogue::{self, CatalogueKind};
use super::design::DesignWarning;
use super::error::DesignError;
use super::source::{parse, read_text};
use domecast_optics::camera::LensModel;

/// A field that a calibration or the catalogue filled in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Filled {
    /// Its path: `camera.matrix`.
    pub field: String,
    /// Where the value comes from.
    pub source: String,
}

/// What filling a design gave.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Filling {
    /// The fields that were filled in.
    pub fields: Vec<Filled>,
    /// What is unusual about their sources.
    pub warnings: Vec<DesignWarning>,
}

/// The sections that may name a part of the catalogue.
const SECTIONS: [(&str, &[CatalogueKind]); 6] = [
    ("camera", &[CatalogueKind::Cameras]),
    ("camera_body", &[CatalogueKind::Cameras]),
    ("leds", &[CatalogueKind::Leds]),
    ("elastomer", &[CatalogueKind::Silicones]),
    ("springs", &[CatalogueKind::Springs]),
    ("magnets", &[CatalogueKind::Magnets]),
];

/// Fills the sections that name a calibration or a part of the catalogue; relative paths are from `folder`.
///
/// A calibration comes before the catalogue: it is of the very camera.
///
/// # Errors
/// A calibration that cannot be read or is of another camera, a key that the catalogue does not have, a relative path
/// without a folder.
pub fn fill(design: &mut Value, folder: Option<&Path>) -> Result<Filling, DesignError> {
    let mut done = Filling::default();
    let Value::Object(design) = design else { return Ok(done) };
    if let Some(Value::Object(camera)) = design.get_mut("camera") {
        calibrate(camera, folder, &mut done)?;
    }
    for (name, kinds) in SECTIONS {
        if let Some(Value::Object(section)) = design.get_mut(name) {
            from_catalogue(section, name, name, kinds, &mut done)?;
        }
    }
    if let Some(Value::Array(layers)) = design.get_mut("optics").and_then(|optics| optics.get_mut("layers")) {
        for (i, layer) in layers.iter_mut().enumerate() {
            if let Value::Object(layer) = layer {
                let kinds = &[CatalogueKind::Sheets, CatalogueKind::Silicones];
                from_catalogue(layer, &format!("optics.layers[{i}]"), "layer", kinds, &mut done)?;
            }
        }
    }
    Ok(done)
}

/// Reads a design file and fills it.
///
/// # Errors
/// As [`fill`], and what is no JSON.
pub fn read_filled(path: &Path) -> Result<Value, DesignError> {
    let mut value = parse(&read_text(path)?).map_err(|error| error.in_file(path))?;
    fill(&mut value, path.parent()).map_err(|error| error.in_file(path))?;
    Ok(value)
}

/// A text under `key`, taken out of the section.
fn take(section: &mut Map<String, Value>, place: &str, key: &str) -> Result<Option<String>, DesignError> {
    match section.shift_remove(key) {
        None => Ok(None),
        Some(Value::String(text)) if !text.is_empty() => Ok(Some(text)),
        Some(other) => {
            Err(DesignError::at(format!("{place}.{key}"), other, "is no name", "a text that is not empty"))
        }
    }
}

/// The camera's calibration.
fn calibrate(
    camera: &mut Map<String, Value>,
    folder: Option<&Path>,
    done: &mut Filling,
) -> Result<(), DesignError> {
    let name = take(camera, "camera", "calibration")?;
    let which = take(camera, "camera", "calibration_camera")?;
    let Some(name) = name else {
        return match which {
            Some(which) => {
                let problem = "there is no calibration that it could choose from";
                Err(DesignError::at(
                    "camera.calibration_camera",
                    json!(which),
                    problem,
                    "beside `calibration` only",
                ))
            }
            None => Ok(()),
        };
    };
    for field in ["matrix", "distortion"] {
        if let Some(value) = camera.get(field) {
            let problem = "the calibration gives this field too";
            return Err(DesignError::at(format!("camera.{field}"), value, problem, "one of the two")
                .with_help(format!("leave `camera.{field}` out, or `camera.calibration`")));
        }
    }
    let path = match folder {
        Some(folder) => folder.join(&name),
        None if Path::new(&name).is_absolute() => name.clone().into(),
        None => {
            let problem =
                "a path beside the design file, but this design was read from a text that lies nowhere";
            return Err(DesignError::at("camera.calibration", json!(name), problem, "an absolute path"));
        }
    };
    let model = match camera.get("model").and_then(Value::as_str) {
        None => None,
        Some(text) => Some(LensModel::parse(text).ok_or_else(|| {
            let allowed = "pinhole, brown_conrady or kannala_brandt";
            DesignError::at("camera.model", json!(text), "is no lens model", allowed)
        })?),
    };
    let side = |name: &str| camera.get(name).and_then(Value::as_u64);
    let hints = CalibrationHints { camera: which, model, width: side("width"), height: side("height") };
    let read = CameraCalibration::load(&path, &hints).map_err(|mut fault| {
        fault.file = None;
        let problem = format!("this calibration cannot be used: {}", described(&fault));
        let place = fault.place;
        let mut outer = DesignError::at("camera.calibration", json!(name), problem, fault.allowed);
        outer.help = match (fault.help, place) {
            (help, None) => help,
            (None, Some((line, column))) => Some(format!("see its line {line}, column {column}")),
            (Some(help), Some((line, column))) => {
                Some(format!("see its line {line}, column {column}; {help}"))
            }
        };
        outer
    })?;
    done.warnings.extend(
        read.warnings()
            .iter()
            .map(|message| DesignWarning { field: "camera.calibration".into(), message: message.clone() }),
    );
    let source = format!("calibration: {name} ({})", read.form.as_str());
    for (field, value) in read.fields() {
        if !camera.contains_key(&field) {
            put(camera, "camera", &field, value, &source, done);
        }
    }
    Ok(())
}

/// A fault without its file and advice: field, value, problem.
fn described(fault: &DesignError) -> String {
    let value = if fault.value.is_empty() { String::new() } else { format!(" is {}", fault.value) };
    let field = if fault.field.is_empty() { String::new() } else { format!("`{}`{value}: ", fault.field) };
    format!("{field}{}", fault.problem)
}

/// The fields of the part that the section names.
fn from_catalogue(
    section: &mut Map<String, Value>,
    place: &str,
    target: &str,
    kinds: &[CatalogueKind],
    done: &mut Filling,
) -> Result<(), DesignError> {
    let Some(key) = take(section, place, "from")? else { return Ok(()) };
    let entry = catalogue::find(kinds, &key).map_err(|mut fault| {
        fault.field = format!("{place}.from");
        fault
    })?;
    let mut known = false;
    // a lens model belongs together: a calibrated or given one is not mixed with the nominal one
    let own_lens =
        target == "camera" && ["model", "matrix", "distortion"].iter().any(|f| section.contains_key(*f));
    for (field, fact) in entry.section(target) {
        known = true;
        let lens = own_lens && ["model", "matrix", "distortion"].contains(&field);
        // a field below a part of the section, `electrical.max_current_ma`, is put into that part
        let (inner_place, section, field) = match field.split_once('.') {
            Some((part, field)) => {
                let inner = section.entry(part).or_insert_with(|| json!({}));
                let Value::Object(inner) = inner else { continue };
                (format!("{place}.{part}"), inner, field)
            }
            None => (place.to_owned(), &mut *section, field),
        };
        if !section.contains_key(field) && !lens {
            let source = format!("catalogue {key}: {}", fact.source);
            put(section, &inner_place, field, fact.value.clone(), &source, done);
        }
    }
    if known {
        return Ok(());
    }
    let problem = entry
        .refused
        .clone()
        .unwrap_or_else(|| "the catalogue's entry has nothing for this section".to_owned());
    let command = format!("list them: domecast list {}", entry.kind.as_str());
    Err(DesignError::at(format!("{place}.from"), json!(key), problem, "a part that fits here")
        .with_help(command))
}

/// Writes a value and, beside the section's reasons, its source.
fn put(
    section: &mut Map<String, Value>,
    place: &str,
    field: &str,
    value: Value,
    source: &str,
    done: &mut Filling,
) {
    // one reason for the whole section becomes one for each field, so that none of them claims the new value
    if let Some(Value::String(whole)) = section.get("why") {
        let reasons: Map<String, Value> =
            section.keys().filter(|key| *key != "why").map(|key| (key.clone(), json!(whole))).collect();
        section.insert("why".into(), Value::Object(reasons));
    }
    section.insert(field.to_owned(), value);
    let reasons = section.entry("why").or_insert_with(|| json!({}));
    if let Value::Object(reasons) = reasons {
        reasons.entry(field.to_owned()).or_insert_with(|| json!(source));
    }
    done.fields.push(Filled { field: format!("{place}.{field}"), source: source.to_owned() });
}

/// In the published schema, a section that names its source need not have the fields that the source fills.
pub(super) fn relax(schema: &mut Value) {
    let Some(Value::Object(definitions)) = schema.get_mut("$defs") else { return };
    for definition in definitions.values_mut() {
        let Some(Value::Object(properties)) = definition.get("properties") else { continue };
        let sources: Vec<&str> =
            ["from", "calibration"].into_iter().filter(|key| properties.contains_key(*key)).collect();
        if sources.is_empty() || !properties.contains_key("why") {
            continue;
        }
        let mut choices: Vec<Value> = sources.iter().map(|key| json!({ "required": [key] })).collect();
        let Value::Object(definition) = definition else { continue };
        if let Some(required) = definition.shift_remove("required") {
            choices.push(json!({ "required": required }));
            definition.insert("anyOf".into(), Value::Array(choices));
        }
    }
}
