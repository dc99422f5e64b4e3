//! Two sides, field by field.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::difference::{Comparison, Difference, PartDifference};
use super::dots::dots;
use super::side::{CompareSide, numbers};
use domecast_runtime::constants::WRENCH_AXES;

/// Compares two sides.
pub fn compare(a: &CompareSide, b: &CompareSide) -> Comparison {
    let mut fields = Vec::new();
    let (flat_a, flat_b) = (flat(&a.design), flat(&b.design));
    let order: Vec<&String> = flat_a
        .iter()
        .map(|(path, _)| path)
        .chain(
            flat_b.iter().map(|(path, _)| path).filter(|path| flat_a.iter().all(|(other, _)| other != *path)),
        )
        .collect();
    let look = |list: &[(String, Value)], path: &str| {
        list.iter().find(|(other, _)| other == path).map(|(_, value)| value.clone())
    };
    for path in order {
        let (left, right) = (look(&flat_a, path), look(&flat_b, path));
        if !same(left.as_ref(), right.as_ref()) {
            fields.push(Difference { name: path.clone(), a: left, b: right });
        }
    }
    Comparison {
        names: [a.name(), b.name()],
        fields,
        dots: dots(a, b),
        parts: parts(a, b),
        loads: loads(a, b),
        wrench_sd: wrench_sd(a, b),
        stiffness_share: stiffness_share(a, b),
    }
}

/// 10 and 10.0 are the same number.
fn same(a: Option<&Value>, b: Option<&Value>) -> bool {
    match (a.and_then(Value::as_f64), b.and_then(Value::as_f64)) {
        (Some(a), Some(b)) => a == b,
        _ => a == b,
    }
}

/// Paths and values of all leaves but the reasons, in the file's order.
fn flat(design: &Value) -> Vec<(String, Value)> {
    fn walk(value: &Value, path: &str, out: &mut Vec<(String, Value)>) {
        match value {
            Value::Object(map) if !map.is_empty() => {
                for (key, below) in map.iter().filter(|(key, _)| *key != "why" && *key != "$schema") {
                    walk(below, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, out);
                }
            }
            Value::Array(items) if !items.is_empty() => {
                for (index, below) in items.iter().enumerate() {
                    walk(below, &format!("{path}[{index}]"), out);
                }
            }
            leaf => out.push((path.to_owned(), leaf.clone())),
        }
    }
    let mut out = Vec::new();
    walk(design, "", &mut out);
    out
}

fn parts(a: &CompareSide, b: &CompareSide) -> Vec<PartDifference> {
    let list = |side: &CompareSide| -> BTreeMap<String, Value> {
        let parts = side.manifest.get("parts").and_then(Value::as_array).cloned().unwrap_or_default();
        parts.into_iter().filter_map(|part| Some((part.get("name")?.as_str()?.to_owned(), part))).collect()
    };
    let (left, right) = (list(a), list(b));
    let names: BTreeSet<&String> = left.keys().chain(right.keys()).collect();
    let size = |part: &Value| {
        let corners = part.get("bbox_mm")?.as_array()?;
        let corner =
            |k: usize| corners.get(k).and_then(|c| numbers::<3>(&serde_json::json!({ "c": c }), "c"));
        let (low, high) = (corner(0)?, corner(1)?);
        Some([high[0] - low[0], high[1] - low[1], high[2] - low[2]])
    };
    names
        .into_iter()
        .map(|name| {
            let sides = [left.get(name), right.get(name)];
            PartDifference {
                name: name.clone(),
                volume_mm3: sides.map(|part| part?.get("volume_mm3")?.as_f64()),
                size_mm: sides.map(|part| part.and_then(size)),
            }
        })
        .filter(|part| part.volume_mm3[0] != part.volume_mm3[1] || part.size_mm[0] != part.size_mm[1])
        .collect()
}

fn loads(a: &CompareSide, b: &CompareSide) -> Vec<Difference<String>> {
    let list = |side: &CompareSide| -> Vec<(String, String)> {
        let lines = side.forces.get("envelope").and_then(Value::as_array).cloned().unwrap_or_default();
        let described = |line: &Value| {
            let size = line.get("size")?.as_f64()?;
            let ended = line.get("ended_by")?.as_str()?.replace('_', " ");
            Some((line.get("load")?.as_str()?.to_owned(), format!("{size:.3} until {ended}")))
        };
        lines.iter().filter_map(described).collect()
    };
    let (left, right) = (list(a), list(b));
    let look = |list: &[(String, String)], name: &str| {
        list.iter().find(|(other, _)| other == name).map(|(_, text)| text.clone())
    };
    let names =
        left.iter().chain(right.iter().filter(|(name, _)| left.iter().all(|(other, _)| other != name)));
    names
        .map(|(name, _)| Difference { name: name.clone(), a: look(&left, name), b: look(&right, name) })
        .filter(|line| line.a != line.b)
        .collect()
}

fn wrench_sd(a: &CompareSide, b: &CompareSide) -> Vec<Difference<f64>> {
    let list =
        |side: &CompareSide| side.forces.get("resolution_at_rest").and_then(|r| numbers::<6>(r, "wrench_sd"));
    let (left, right) = (list(a), list(b));
    WRENCH_AXES
        .iter()
        .enumerate()
        .map(|(k, name)| Difference {
            name: (*name).to_owned(),
            a: left.map(|sd| sd[k]),
            b: right.map(|sd| sd[k]),
        })
        .filter(|sd| sd.a != sd.b)
        .collect()
}

fn stiffness_share(a: &CompareSide, b: &CompareSide) -> Option<f64> {
    let matrix = |side: &CompareSide| -> Option<Vec<Vec<f64>>> {
        let rows = side.constants.pointer("/springs/stiffness")?.as_array()?;
        let rows: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| {
                row.as_array().map_or_else(Vec::new, |row| row.iter().filter_map(Value::as_f64).collect())
            })
            .collect();
        (rows.len() == 6 && rows.iter().all(|row| row.len() == 6)).then_some(rows)
    };
    let (left, right) = (matrix(a)?, matrix(b)?);
    let mut worst = 0.0f64;
    for i in 0..6 {
        for j in 0..6 {
            let scale = (left[i][i] * left[j][j]).abs().sqrt();
            if scale > 0.0 {
                worst = worst.max((left[i][j] - right[i][j]).abs() / scale);
            }
        }
    }
    Some(worst)
}
