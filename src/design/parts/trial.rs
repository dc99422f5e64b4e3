//! A change that takes a fault of a part away, found by trying: where no formula says what would do, the field that the
//! fault names is moved a little, then farther, until the part can be made.

use rayon::prelude::*;
use serde_json::json;

use super::{Measures, Part, PartError};
use crate::layout::PrintPass;
use crate::spec::{Cure, Design};

/// Changes of a field that are tried, smallest first; each up and down.
const SHARES: [f64; 4] = [0.04, 0.12, 0.3, 0.6];
/// Fields that are tried at most for a fault.
const MAX_FIELDS: usize = 4;
/// Changes that are tried at most in a run: each makes a part.
const MAX_TRIED: usize = 16;

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
    let mut named: Vec<&str> = fields.split(" or ").collect();
    if named.contains(&"magnet_pockets.push_out_diameter_mm") {
        // the holes are where the springs are
        named.insert(0, "springs.places.ring.radius_mm");
    }
    // What a rule would give instead, then a little more and less of each number.
    let off = design.off_their_rules().into_iter().filter(|cure| {
        named.iter().any(|field| cure.field.strip_prefix(field).is_some_and(|rest| !rest.starts_with('_')))
    });
    let by = |factor: f64| -> Vec<Cure> {
        let all = named.iter().flat_map(|field| design.scaled(field, factor));
        all.filter(|cure| !Design::is_purchased(&cure.field)).take(MAX_FIELDS).collect()
    };
    let moved = SHARES.iter().flat_map(|share| {
        by(1.0 + share).into_iter().zip(by(1.0 - share)).flat_map(|(more, less)| [more, less])
    });
    let tried: Vec<Cure> = off.take(MAX_FIELDS).chain(moved).take(*tries_left).collect();
    *tries_left = tries_left.saturating_sub(tried.len());
    // As many at once as there are threads, so that the smallest change that helps ends the search.
    let helps = |cure: &Cure| makes(design, cure, part, passes);
    tried
        .chunks(rayon::current_num_threads())
        .find_map(|some| some.par_iter().find_first(|cure| helps(cure)).cloned())
}

/// Whether the part can be made with a change.
fn makes(design: &Design, cure: &Cure, part: &str, passes: &[PrintPass]) -> bool {
    let made = || -> Option<Part> {
        let design = design.changed(cure).ok()?;
        let measures = Measures::of(&design).ok()?;
        super::blueprint_of(&measures, part, passes)?.ok()?.build(&measures).ok()
    };
    made().is_some()
}
