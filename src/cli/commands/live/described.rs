//! What is said of a source.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use domecast_live::source::SourceInfo;

/// What a source says of itself, in a line.
pub fn head(info: &SourceInfo) -> String {
    let mut text = format!("domecast live: {}", info.name);
    if let Some([width, height]) = info.size {
        text += &format!(", {width} x {height}");
    }
    text += &format!(", {}", info.format);
    for control in &info.controls {
        text += &format!(", {} {}", control.name, control.value);
    }
    text
}

/// The same as members of an event.
pub fn described(info: &SourceInfo) -> Value {
    let controls: BTreeMap<&str, i32> = info.controls.iter().map(|c| (c.name, c.value)).collect();
    json!({
        "device": info.name, "size": info.size, "format": info.format, "rate_hz": info.rate_hz, "controls": controls,
        "warnings": info.warnings,
    })
}
