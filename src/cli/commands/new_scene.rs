//! `domecast new NAME --scene DESIGN`

use std::path::{Path, PathBuf};

use serde_json::json;

use super::new::write_both;
use super::output::{Failure, Output};
use crate::touch_scene;
use domecast_design::Design;
use domecast_sim::scene::SceneFile;
use domecast_sim::{Scene, SimError};

/// The schema's name beside the scene.
const SCHEMA_NAME: &str = "domecast.scene.schema.json";

/// Writes a starting scene for a design, after it was resolved, and its schema: beside the design, so that it can name it.
pub fn run(output: &Output, name: &str, design_path: &Path, out: Option<&Path>) -> Result<(), Failure> {
    let design = Design::load(design_path)?;
    let path = out.map_or_else(|| design_path.with_file_name(format!("{name}.json")), Path::to_path_buf);
    let mut file = touch_scene::file(name, &design, &from_folder_of(&path, design_path))?;
    Scene::new(domecast_design::from_value(&file)?, Path::new(""), design).map_err(|error| match error {
        SimError::Input(error) => Failure::from(error.in_file(&path)),
        other => Failure::Internal(other.to_string()),
    })?;
    if let Some(fields) = file.as_object_mut() {
        fields.shift_insert(0, "$schema".into(), json!(SCHEMA_NAME));
    }
    let text = format!("{file:#}\n");
    let schema = (SCHEMA_NAME, domecast_design::schema_of::<SceneFile>());
    let schema_path = write_both(output, &path, text.as_bytes(), schema, &output.rules(&[design_path]))?;
    output.say(&format!("{}: a ball pressed on the dome of {}", path.display(), design_path.display()))?;
    output.say("next:")?;
    output.say(&format!("  domecast simulate {} --frames 3", path.display()))?;
    output
        .result(&json!({ "scene": path.display().to_string(), "schema": schema_path.display().to_string() }))
}

/// The design as a scene at `scene` names it: by its name in the same folder, by its whole path from elsewhere.
fn from_folder_of(scene: &Path, design: &Path) -> String {
    let folder = |path: &Path| path.parent().map(Path::to_path_buf).and_then(absolute);
    match design.file_name() {
        Some(name) if folder(scene) == folder(design) => name.to_string_lossy().into_owned(),
        _ => absolute(design.to_path_buf()).unwrap_or_else(|| design.to_path_buf()).display().to_string(),
    }
}

fn absolute(path: PathBuf) -> Option<PathBuf> {
    let path = if path.as_os_str().is_empty() { PathBuf::from(".") } else { path };
    path.canonicalize().ok()
}
