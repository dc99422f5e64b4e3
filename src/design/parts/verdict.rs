//! Everything that is checked of the assembled sensor, with all faults in one answer.

use super::checks::lights_fit_envelope;
use super::error::infeasible;
use super::pits::missing_light_wall_mm;
use super::traced::{PoseSight, trace_sight};
use super::{
    Assembly, Measures, Part, PartError, bearing, board_seat, build, check_assembly, light_ways, mount,
    openings, seats, trial,
};
use crate::layout::{Dot, PrintPass};
use crate::spec::{Design, DesignWarning};

/// What a wall may miss by rounding, mm.
const WALL_ROUNDING_MM: f64 = 1e-3;

/// What the checks of a sound sensor found.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckedSensor {
    /// The traced rays at rest and under each claimed load; none is blocked.
    pub sight: Vec<PoseSight>,
    /// What does not stop a build, but should be known.
    pub notes: Vec<DesignWarning>,
}

/// Makes all parts as [`super::build`] does, after a look at the seat of each purchased part.
///
/// # Errors
/// All faults of the seats, and those of the parts that cannot be made.
pub fn build_seated(design: &Design, m: &Measures, passes: &[PrintPass]) -> Result<Vec<Part>, PartError> {
    let mut faults = seats::faults(design, m);
    faults.extend(board_seat::faults(m));
    faults.extend(mount::faults(m));
    let made = build(m, passes);
    if let Err(fault) = &made {
        // A wall's thickness alone does not tell where its neighbours should be.
        faults.extend(openings::faults(design, m));
        faults.push(fault.clone());
    }
    PartError::all(faults)?;
    made
}

/// Looks at the seats, the envelope, the hood and the pits' walls, before any part is made: what most changes of the lights fail at.
///
/// # Errors
/// The first of their faults.
pub fn check_light_room(design: &Design, m: &Measures) -> Result<(), PartError> {
    let missing_mm = missing_light_wall_mm(m);
    // the mesh has the last word where it is a matter of rounding
    if missing_mm > WALL_ROUNDING_MM {
        let min_mm = m.process.min_wall_mm;
        let place = "wall at an LED's pit or a set screw".to_owned();
        return Err(infeasible(
            "upper_platform",
            place,
            min_mm - missing_mm,
            min_mm,
            "leds.center_radius_mm",
        ));
    }
    PartError::all(seats::faults(design, m))?;
    lights_fit_envelope(m)?;
    light_ways::check(m)
}

/// The faults of [`build_seated`], each that names fields and no change with the first change that was tried and helps.
pub fn with_tried_cures(design: &Design, passes: &[PrintPass], fault: PartError) -> PartError {
    let cured = trial::with_cures(design, passes, vec![fault.clone()]);
    PartError::all(cured).err().unwrap_or(fault)
}

/// Runs every check of the assembled sensor, the traced view among them.
///
/// # Errors
/// All faults that were found, each with its part, value, limit and design field.
pub fn check_sensor(
    design: &Design,
    m: &Measures,
    parts: &[Part],
    assembly: &Assembly,
    dots: &[Dot],
) -> Result<CheckedSensor, PartError> {
    let (whole, sight) =
        rayon::join(|| check_assembly(m, parts, assembly), || trace_sight(design, m, assembly, dots));
    let mut faults = bearing::faults(m, assembly);
    faults.extend(board_seat::bearing(m, assembly));
    let upper = assembly.items.iter().find(|item| item.name == "upper_platform");
    faults.extend(mount::bearing(m, upper.map(|item| &item.mesh)));
    faults.extend(whole.err());
    let sight = sight.unwrap_or_else(|fault| {
        faults.push(fault);
        Vec::new()
    });
    let cured = |fault: &PartError| match trial::at_limit(design, fault) {
        Some(cure) => PartError::Cured { fault: Box::new(fault.clone()), cure },
        None => fault.clone(),
    };
    PartError::all(faults.iter().flat_map(PartError::faults).map(cured).collect())?;
    let notes = seats::notes(m).into_iter().chain(board_seat::notes(m)).collect();
    Ok(CheckedSensor { sight, notes })
}
