//! A change that takes a fault of a part away, found by trying: where no formula says what would do, the field that the
//! fault names is moved a little, then farther, until the part can be made.

use rayon::prelude::*;
use serde_json::{Map, Value, json};
use std::path::Path;

use super::{Measures, Part, PartError};
use crate::layout::PrintPass;
use crate::spec::{Cure, Design};

/// Changes of a field that are tried, smallest first; each up and down.
const SHARES: [f64; 4] = [0.04, 0.12, 0.3, 0.6];
/// Fields that are tried at most for a fault.
const MAX_FIELDS: usize = 4;
/// Changes that are tried at most in a run: each makes a part.
const MAX_TRIED: usize = 24;

/// The faults, each that names fields and no change with the first change that was found to help.
pub(super) fn with_cures(design: &Design, passes: &[PrintPass], faults: Vec<PartError>) -> Vec<PartError> {
    let mut left = MAX_TRIED;
    // What stands in a seat's way often makes thin walls too: with the seats mended the walls are looked at again.
    let seats = faults.iter().flat_map(PartError::faults).any(|fault| fault.cure().is_some());
    if seats {
        left = 0;
    }
    faults
        .into_iter()
        .flat_map(|fault| match fault {
            PartError::Several(several) => several,
            one => vec![one],
        })
        .map(|fault| match at_limit(design, &fault).or_else(|| cure_of(design, passes, &fault, &mut left)) {
            Some(cure) => PartError::Cured { fault: Box::new(fault), cure },
            None => fault,
        })
        .collect()
}

/// The limit itself, where a fault is that of a field's own value.
pub(super) fn at_limit(design: &Design, fault: &PartError) -> Option<Cure> {
    let PartError::Infeasible { field, value_mm, limit_mm, .. } = fault else { return None };
    let sections = serde_json::to_value(design.sections()).ok()?;
    let given = field.split('.').try_fold(&sections, |place, key| place.get(key))?.as_f64()?;
    ((given - value_mm).abs() <= 1e-9 * given.abs().max(1.0))
        .then(|| Cure { field: field.clone(), value: json!(limit_mm) })
}

/// The first change of a field that was tried and helps, of as many as are left.
fn cure_of(design: &Design, passes: &[PrintPass], fault: &PartError, tries_left: &mut usize) -> Option<Cure> {
    let (part, fields) = match fault {
        PartError::Infeasible { part, field, .. } | PartError::Broken { part, field, .. } => (part, field),
        _ => return None,
    };
    let sections = serde_json::to_value(design.sections()).ok()?;
    let given: Value = serde_json::from_str(design.text()).ok()?;
    let mut leaves = Vec::new();
    for field in fields.split(" or ") {
        numbers_below(&sections, field, &mut leaves);
    }
    leaves.truncate(MAX_FIELDS);
    let tried: Vec<Cure> = SHARES
        .iter()
        .flat_map(|share| {
            leaves.iter().flat_map(move |(field, value)| {
                [1.0 + share, 1.0 - share].map(|factor| (field.clone(), scaled(value, factor)))
            })
        })
        .map(|(field, value)| Cure { field, value })
        .take(*tries_left)
        .collect();
    *tries_left = tries_left.saturating_sub(tried.len());
    // In pieces, so that the smallest change that helps ends the search.
    let helps = |cure: &Cure| makes(&given, cure, part, passes);
    tried.chunks(8).find_map(|some| some.par_iter().find_first(|cure| helps(cure)).cloned())
}

/// Whether the part can be made with a change.
fn makes(given: &Value, cure: &Cure, part: &str, passes: &[PrintPass]) -> bool {
    let mut changed = given.clone();
    let mut made = || -> Option<Part> {
        set(&mut changed, &cure.field, cure.value.clone())?;
        let design = Design::from_text(&changed.to_string(), Path::new("")).ok()?;
        let measures = Measures::of(&design).ok()?;
        super::blueprint_of(&measures, part, passes)?.ok()?.build(&measures).ok()
    };
    made().is_some()
}

/// Sets a field by its path, and makes the objects on the way.
fn set(tree: &mut Value, field: &str, value: Value) -> Option<()> {
    let mut place = tree;
    for key in field.split('.') {
        place = place.as_object_mut()?.entry(key).or_insert_with(|| Value::Object(Map::new()));
    }
    *place = value;
    Some(())
}

/// The numbers, and lists of numbers, at and below a field.
fn numbers_below(sections: &Value, field: &str, found: &mut Vec<(String, Value)>) {
    let Some(value) = field.split('.').try_fold(sections, |place, key| place.get(key)) else { return };
    match value {
        Value::Object(below) => {
            for key in below.keys().filter(|key| *key != "why") {
                numbers_below(sections, &format!("{field}.{key}"), found);
            }
        }
        Value::Number(_) => found.push((field.to_owned(), value.clone())),
        Value::Array(list) if !list.is_empty() && list.iter().all(is_numeric) => {
            found.push((field.to_owned(), value.clone()));
        }
        _ => {}
    }
}

fn is_numeric(value: &Value) -> bool {
    match value {
        Value::Number(_) => true,
        Value::Array(list) => list.iter().all(is_numeric),
        _ => false,
    }
}

/// All numbers times a factor, to 0.01 away from what they were.
fn scaled(value: &Value, factor: f64) -> Value {
    match value {
        Value::Array(list) => list.iter().map(|one| scaled(one, factor)).collect(),
        Value::Number(number) => {
            let from = number.as_f64().unwrap_or(0.0);
            let steps = 100.0 * from * factor;
            let grows = (factor > 1.0) == (from > 0.0);
            let to = if grows { (steps - 1e-6).ceil() } else { (steps + 1e-6).floor() } / 100.0;
            if number.is_f64() { json!(to) } else { json!(to.round() as i64) }
        }
        other => other.clone(),
    }
}
