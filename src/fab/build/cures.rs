//! Faults that no formula cures get a change that was tried: the first that takes the fault away, and if one can be had,
//! one that leaves no other.
//!
//! Tried are, in this order: what a rule would give where the design says something else; more and less of the numbers
//! that the fault names; and what helps a view or a pattern in general: a deeper camera, a smaller dome, a wider mask,
//! fewer and larger dots.

use rayon::prelude::*;
use serde_json::json;

use super::claims;
use super::making::{check_parts, lay_out};
use crate::constants;
use crate::light::marker_noise_px;
use domecast_design::{Cure, Design, DesignError};

/// Changes of a number, smallest first; each up and down.
const SHARES: [f64; 4] = [0.04, 0.12, 0.3, 0.6];
/// Changes that are tried at most for a fault that shows before parts are made, and in a run; each takes some
/// hundredths of a second.
const MAX_TRIED: usize = 48;
const MAX_TRIED_IN_ALL: usize = 72;
/// The same where the parts have to be made, each in about a second; in a run.
const MAX_MADE: usize = 3;
/// The same where the light has to be computed.
const MAX_LIT: usize = 10;
/// Given fields that are off their rules, tried first.
const MAX_RULES: usize = 12;

/// The faults, each that has no cure with the first change that was found to help.
pub(super) fn with_cures(design: &Design, mut error: DesignError) -> DesignError {
    let mut faults = std::mem::take(&mut error.more);
    faults.insert(0, error);
    let (mut quick_left, mut made_left, mut lit_left) = (MAX_TRIED_IN_ALL, MAX_MADE, MAX_LIT);
    // What shows as the parts are made does not show before.
    let early: Vec<String> = quick(design).err().iter().flat_map(DesignError::kinds).collect();
    // What cures one fault often cures those that stand beside it.
    let beside: Vec<Cure> = faults.iter().filter_map(|fault| fault.cure.as_deref().cloned()).collect();
    let all: Vec<String> = faults.iter().map(DesignError::kind).collect();
    let mut found = faults.into_iter().map(|fault| {
        if fault.cure.is_some() {
            return fault;
        }
        let kind = fault.kind();
        let cure = if early.contains(&kind) {
            let tried = some(candidates(design, &fault, true), MAX_TRIED, &mut quick_left);
            first_that_helps(design, &tried, (&kind, &all), &quick)
        } else if !beside.is_empty() {
            let tried = some(beside.clone(), MAX_MADE, &mut made_left);
            first_that_helps(design, &tried, (&kind, &all), &with_parts)
        } else if lit(design).is_err_and(|error| error.kinds().contains(&kind)) {
            let tried = some(candidates(design, &fault, false), MAX_LIT, &mut lit_left);
            first_that_helps(design, &tried, (&kind, &all), &lit)
        } else {
            let tried = some(candidates(design, &fault, false), MAX_MADE, &mut made_left);
            first_that_helps(design, &tried, (&kind, &all), &with_parts)
        };
        match cure {
            Some(cure) => fault.with_tried(cure),
            None => fault,
        }
    });
    let first = found.next();
    let rest: Vec<DesignError> = found.collect();
    match first {
        Some(first) => first.with_more(rest),
        None => DesignError::at("", "", "no fault", ""),
    }
}

/// The first changes, as many as are left.
fn some(mut changes: Vec<Cure>, max_count: usize, left: &mut usize) -> Vec<Cure> {
    changes.truncate(max_count.min(*left));
    *left -= changes.len();
    changes
}

/// What shows of a design before its parts are made: claimed loads, markers, dots, the camera's view.
fn quick(design: &Design) -> Result<(), DesignError> {
    let sight = claims::check_claims(design)?;
    lay_out(design)?;
    sight.measures()?;
    Ok(())
}

/// What the sensor's own lights show.
fn lit(design: &Design) -> Result<(), DesignError> {
    marker_noise_px(design)?;
    Ok(())
}

/// The same with the parts, made and assembled.
pub(super) fn with_parts(design: &Design) -> Result<(), DesignError> {
    let sight = claims::check_claims(design)?;
    let (_, layout) = lay_out(design)?;
    let springs = constants::springs_of(design, sight)?;
    check_parts(design, &layout, &springs)?;
    Ok(())
}

/// Of the changes the first that leaves no fault, or the first without this kind of fault and with no new kind.
fn first_that_helps(
    design: &Design,
    tried: &[Cure],
    (kind, known): (&String, &[String]),
    judge: &(dyn Fn(&Design) -> Result<(), DesignError> + Sync),
) -> Option<Cure> {
    let mut helps = None;
    // As many at once as there are threads, so that a change that leaves nothing ends the search.
    for some in tried.chunks(rayon::current_num_threads()) {
        let judged: Vec<Option<bool>> = some
            .par_iter()
            .map(|cure| match design.changed(cure).and_then(|changed| judge(&changed)) {
                Ok(()) => Some(true),
                Err(error) => {
                    let left = error.kinds();
                    let only_known = left.iter().all(|one| known.contains(one));
                    (only_known && !left.contains(kind)).then_some(false)
                }
            })
            .collect();
        let at = |wanted: bool| judged.iter().position(|one| *one == Some(wanted));
        if let Some(best) = at(true) {
            return some.get(best).cloned();
        }
        if helps.is_none() {
            helps = at(false).and_then(|index| some.get(index).cloned());
        }
    }
    helps
}

/// Changes that may help with a fault, the likeliest first.
fn candidates(design: &Design, fault: &DesignError, of_view: bool) -> Vec<Cure> {
    let named: Vec<&str> =
        fault.field.split(" or ").map(|field| field.split('[').next().unwrap_or(field)).collect();
    let near = |cure: &Cure| {
        // By how much of the path is shared with a field that is named.
        let shared = |field: &&str| {
            field.split('.').zip(cure.field.split('.')).take_while(|(one, other)| one == other).count()
        };
        (Design::is_purchased(&cure.field), std::cmp::Reverse(named.iter().map(shared).max().unwrap_or(0)))
    };
    let mut found = design.off_their_rules();
    found.sort_by_key(near);
    found.truncate(MAX_RULES);
    // What meets the camera, a deeper one clears.
    if !of_view && named.contains(&"camera.position_mm") {
        let deeper = |factor| design.scaled("camera.position_mm", factor);
        found.splice(0..0, deeper(1.0 + SHARES[0]).into_iter().chain(deeper(1.0 + SHARES[1])));
    }
    if fault.field.starts_with("pattern") || fault.field.starts_with("print") {
        found.extend(of_the_pattern(design));
    } else if of_view {
        found.extend(of_the_view(design));
    }
    for share in SHARES {
        for factor in [1.0 + share, 1.0 - share] {
            found.extend(named.iter().flat_map(|field| design.scaled(field, factor)).take(4));
        }
    }
    let mut once: Vec<Cure> = Vec::new();
    for cure in found {
        if !once.contains(&cure) {
            once.push(cure);
        }
    }
    once
}

/// What lets a camera see more of dome and markers, and what lets more dots be printed.
fn of_the_view(design: &Design) -> Vec<Cure> {
    let sections = design.sections();
    let rounded = |value: f64| (100.0 * value).round() / 100.0;
    let change = |field: &str, value: serde_json::Value| Cure { field: field.to_owned(), value };
    let [x, y, z] = sections.camera.position_mm;
    let mut found = Vec::new();
    if sections.camera.rotation_deg.iter().any(|angle| *angle != 0.0) {
        found.push(change("camera.rotation_deg", json!([0, 0, 0])));
    }
    if x != 0.0 || y != 0.0 {
        found.push(change("camera.position_mm", json!([0, 0, z])));
    }
    for factor in [1.1, 1.25, 1.6, 2.2, 0.85, 0.7] {
        found.push(change("camera.position_mm", json!([x, y, rounded(z * factor)])));
    }
    for factor in [0.9, 0.75, 0.5] {
        let mask_deg = sections.runtime.mask_field_angle_deg;
        found.push(change("runtime.mask_field_angle_deg", json!(rounded(mask_deg / factor))));
        found.push(change("dome.radius_mm", json!(rounded(sections.dome.radius_mm * factor))));
    }
    found
}

/// What lets a pattern be seen and printed.
fn of_the_pattern(design: &Design) -> Vec<Cure> {
    let mut found = Vec::new();
    let change = |field: &str, value: serde_json::Value| Cure { field: field.to_owned(), value };
    for factor in [1.25, 1.6, 2.2, 3.5] {
        found.extend(design.scaled("pattern.pitch_px", factor));
        found.extend(design.scaled("pattern.dot_diameter_px", factor));
        found.extend(design.scaled("pattern.count", 1.0 / factor));
        found.extend(design.scaled("pattern.polar_angle_deg", 1.0 / factor));
    }
    for field in ["pattern.unprintable", "pattern.unseen"] {
        found.push(change(field, json!("drop")));
    }
    found
}
