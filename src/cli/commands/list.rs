//! `domecast list KIND [KEY]`

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::{Map, Value, json};

use super::output::{Failure, Output};
use domecast_design::catalogue::{self, CatalogueEntry, CatalogueKind};

/// Reads the name of a kind; clap lists the names in help and faults.
pub fn kind_parser() -> impl TypedValueParser<Value = CatalogueKind> {
    let names = PossibleValuesParser::new(CatalogueKind::ALL.map(CatalogueKind::as_str));
    names.try_map(|name| CatalogueKind::parse(&name).ok_or("is no kind of the catalogue"))
}

/// Heads of the table's columns and the fields below them.
fn columns(kind: CatalogueKind) -> &'static [(&'static str, &'static str)] {
    match kind {
        CatalogueKind::Cameras => &[
            ("width px", "camera.width"),
            ("height px", "camera.height"),
            ("view deg", "camera.field_of_view_deg"),
            ("body", "camera_body.kind"),
        ],
        CatalogueKind::Leds => &[("package mm", "leds.package_mm"), ("height mm", "leds.package_height_mm")],
        CatalogueKind::Silicones => &[
            ("E MPa", "elastomer.young_modulus_mpa"),
            ("nu", "elastomer.poisson_ratio"),
            ("index", "layer.index"),
            ("shrinkage %", "elastomer.shrinkage_percent"),
        ],
        CatalogueKind::Sheets => &[("thickness mm", "layer.thickness_mm"), ("index", "layer.index")],
        CatalogueKind::Springs => &[
            ("wire mm", "springs.wire_diameter_mm"),
            ("outer mm", "springs.outer_diameter_mm"),
            ("length mm", "springs.free_length_mm"),
            ("coils", "springs.active_coils"),
        ],
        CatalogueKind::Magnets => &[
            ("diameter mm", "magnets.diameter_mm"),
            ("thickness mm", "magnets.thickness_mm"),
            ("grip N", "magnets.grip_force_n"),
        ],
    }
}

/// Prints the catalogue's entries of a kind, or one of them with the source of every number.
pub fn run(output: &Output, kind: CatalogueKind, key: Option<&str>) -> Result<(), Failure> {
    if let Some(key) = key {
        let entry = catalogue::find(&[kind], key)?;
        output.say(&format!("{}: {}", entry.key, entry.name))?;
        if let Some(refused) = &entry.refused {
            output.say(&format!("  not for every section: {refused}"))?;
        }
        for (field, fact) in &entry.fields {
            output.say(&format!("  {field} = {}", fact.value))?;
            output.say(&format!("      {}", fact.source))?;
        }
        return output.result(&entry_json(entry));
    }
    let entries = catalogue::entries(kind);
    let columns = columns(kind);
    let mut rows: Vec<Vec<String>> =
        vec![["key"].iter().chain(columns.iter().map(|(head, _)| head)).map(ToString::to_string).collect()];
    rows[0].push("name".into());
    for entry in entries {
        let mut row = vec![entry.key.clone()];
        row.extend(columns.iter().map(|(_, field)| cell(entry.value(field))));
        row.push(entry.name.clone());
        rows.push(row);
    }
    let widths: Vec<usize> = (0..columns.len() + 2)
        .map(|i| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0))
        .collect();
    for row in &rows {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(text, width)| format!("{text:<width$}")).collect();
        output.say(cells.join("  ").trim_end())?;
    }
    output
        .say(&format!("in a design: \"from\": \"{}\"", entries.first().map_or("KEY", |entry| &entry.key)))?;
    output.say(&format!("with sources: domecast list {} KEY", kind.as_str()))?;
    let all: Vec<Value> = entries.iter().map(entry_json).collect();
    output.result(&json!({ kind.as_str(): all }))
}

/// A value as a table shows it: lists with a cross, an index by its green.
fn cell(value: Option<&Value>) -> String {
    match value {
        None => "-".into(),
        Some(Value::String(text)) => text.clone(),
        Some(Value::Array(items)) => {
            items.iter().map(|item| cell(Some(item))).collect::<Vec<_>>().join(" x ")
        }
        Some(Value::Object(colors)) => cell(colors.get("g")),
        Some(other) => other.to_string(),
    }
}

fn entry_json(entry: &CatalogueEntry) -> Value {
    let fields: Map<String, Value> = entry
        .fields
        .iter()
        .map(|(name, fact)| (name.clone(), json!({ "value": fact.value, "source": fact.source })))
        .collect();
    json!({ "key": entry.key, "name": entry.name, "refused": entry.refused, "fields": fields })
}
