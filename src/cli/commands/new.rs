//! `domecast new NAME`

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde_json::json;

use super::output::{Failure, Output};
use domecast_design::DesignError;

/// The paper's sensor: every field is there, each with its reason.
const START: &str = include_str!("../../../designs/thumb24.json");
/// The schema's name beside the design; editors find it through `$schema`.
const SCHEMA_NAME: &str = "domecast.schema.json";

/// Writes a starting design and the schema that lets an editor complete and check it. Nothing is overwritten but an
/// earlier schema.
pub fn run(output: &Output, name: &str, from: Option<&Path>, out: Option<&Path>) -> Result<(), Failure> {
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
    let path = out.map_or_else(
        || {
            let folder = if Path::new("designs").is_dir() { "designs" } else { "" };
            Path::new(folder).join(format!("{name}.json"))
        },
        Path::to_path_buf,
    );
    let schema = path.with_file_name(SCHEMA_NAME);
    write_new(&path, fresh.as_bytes())?;
    std::fs::write(&schema, format!("{:#}\n", domecast_design::design_schema()))
        .map_err(|error| refused(&schema, &error))?;
    output.say(&format!("{}: a start, equal to {} but in its name", path.display(), start.name()))?;
    output.say(&format!("{}: lets an editor complete and check it", schema.display()))?;
    output.say("change it, then:")?;
    output.say(&format!("  domecast build {} --watch", path.display()))?;
    output.say("  domecast explain FIELD")?;
    output.result(&json!({ "design": path.display().to_string(), "schema": schema.display().to_string() }))
}

fn refused(path: &Path, error: &std::io::Error) -> DesignError {
    DesignError::at("", "", format!("cannot be written ({error})"), "a folder that can be written")
        .in_file(path)
}

/// Writes a file that must not exist yet.
fn write_new(path: &PathBuf, bytes: &[u8]) -> Result<(), DesignError> {
    if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(|error| refused(parent, &error))?;
    }
    let mut file = std::fs::File::create_new(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            DesignError::at("", "", "this file exists and is not overwritten", "a name that is not taken")
                .with_help("choose another name, or another place with --out")
                .in_file(path)
        }
        _ => refused(path, &error),
    })?;
    file.write_all(bytes).map_err(|error| refused(path, &error))
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
