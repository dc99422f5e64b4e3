//! Why a part cannot be made.

use std::fmt;

pub use crate::spec::Cure;
use crate::spec::DesignError;
use domecast_mesh::MeshError;

/// A part that cannot be made, and what to change.
#[derive(Debug, Clone, PartialEq)]
pub enum PartError {
    /// Dimensions of the design contradict each other.
    Infeasible {
        /// The part.
        part: String,
        /// Where in it, and what is wrong.
        place: String,
        /// What was found, mm.
        value_mm: f64,
        /// What it has to be, mm: the least allowed, or the largest where
        /// `place` says so.
        limit_mm: f64,
        /// The design field to change first.
        field: String,
    },
    /// A shape or a boolean failed.
    Mesh {
        /// The part.
        part: String,
        /// Why.
        error: MeshError,
    },
    /// The mesh came out, but is not the surface of the one solid that it
    /// should be.
    Broken {
        /// The part.
        part: String,
        /// What is wrong with it, with the features that meet.
        problem: String,
        /// The design fields that decide those features: "A or B"; empty where none is known.
        field: String,
    },
    /// Another fault, with a change that was tried and takes it away.
    Cured {
        /// The fault.
        fault: Box<PartError>,
        /// What would do.
        cure: Cure,
    },
    /// A file cannot be made.
    Unwritable {
        /// Which.
        path: String,
        /// Why.
        problem: String,
    },
    /// Rays of the image end on a part.
    Blocked {
        /// The part.
        part: String,
        /// At which position of the platform.
        when: String,
        /// Field angle of the first ray that it blocks, degrees.
        angle_deg: f64,
        /// How many rays of each kind it blocks: "dots 12.0 % (204 of 1700)".
        shares: String,
        /// What lets the rays pass.
        cure: Cure,
    },
    /// Something purchased has no sound seat.
    Unheld {
        /// What is not held.
        part: String,
        /// What should hold it, or is in its way.
        by: String,
        /// What is wrong.
        problem: String,
        /// What was found, mm.
        value_mm: f64,
        /// What it has to be, mm.
        limit_mm: f64,
        /// What would do.
        cure: Cure,
    },
    /// More than one fault, in the order in which they were found.
    Several(Vec<PartError>),
    /// The camera's view cannot be computed.
    View {
        /// Why.
        problem: String,
        /// The design field to change first.
        field: String,
    },
}

impl PartError {
    /// By how much the worst of the faults that are lengths misses its limit, mm; 0 where none is one.
    pub fn missing_mm(&self) -> f64 {
        match self {
            Self::Infeasible { value_mm, limit_mm, .. } | Self::Unheld { value_mm, limit_mm, .. } => {
                (value_mm - limit_mm).abs()
            }
            Self::Cured { fault, .. } => fault.missing_mm(),
            Self::Several(faults) => faults.iter().map(Self::missing_mm).fold(0.0, f64::max),
            _ => 0.0,
        }
    }

    /// One error of all: nothing if there is none.
    ///
    /// # Errors
    /// The faults.
    pub(super) fn all(faults: Vec<Self>) -> Result<(), Self> {
        let mut flat: Vec<Self> = Vec::new();
        for fault in faults {
            let new = if let Self::Several(inner) = fault { inner } else { vec![fault] };
            for one in new {
                if !flat.contains(&one) {
                    flat.push(one);
                }
            }
        }
        match flat.len() {
            0 => Ok(()),
            1 => flat.pop().map_or(Ok(()), Err),
            _ => Err(Self::Several(flat)),
        }
    }

    /// The faults one by one.
    pub fn faults(&self) -> &[Self] {
        if let Self::Several(faults) = self { faults } else { std::slice::from_ref(self) }
    }

    /// The change that takes this fault away, where one is known.
    pub fn cure(&self) -> Option<&Cure> {
        match self {
            Self::Blocked { cure, .. } | Self::Unheld { cure, .. } | Self::Cured { cure, .. } => Some(cure),
            _ => None,
        }
    }
}

impl fmt::Display for PartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Infeasible { part, place, value_mm, limit_mm, field } => {
                write!(f, "{part}: {place}: {value_mm:.3} mm, limit {limit_mm:.3} mm; change {field}")
            }
            Self::Mesh { part, error } => write!(f, "{part}: {error}"),
            Self::Blocked { part, when, angle_deg, shares, cure } => {
                write!(f, "{part}: blocks the view {when} from {angle_deg:.1} degrees: {shares}; {cure}")
            }
            Self::Unheld { part, by, problem, value_mm, limit_mm, cure } => write!(
                f,
                "{part} and {by}: {problem}: {value_mm:.3} mm, limit {limit_mm:.3} mm, {:.3} mm missing; {cure}",
                (limit_mm - value_mm).abs()
            ),
            Self::Several(faults) => {
                for (i, fault) in faults.iter().enumerate() {
                    write!(f, "{}{fault}", if i == 0 { "" } else { "; also: " })?;
                }
                Ok(())
            }
            Self::Broken { part, problem, .. } => write!(f, "{part}: {problem}"),
            Self::Cured { fault, cure } => write!(f, "{fault}; {cure}"),
            Self::Unwritable { path, problem } => write!(f, "{path}: {problem}"),
            Self::View { problem, field } => write!(f, "the camera's view: {problem}; change {field}"),
        }
    }
}

impl std::error::Error for PartError {}

/// How the limit that a value fails is said: at least where the value is too small, at most where it
/// is too large.
fn bound(value_mm: f64, limit_mm: f64) -> &'static str {
    match value_mm.total_cmp(&limit_mm) {
        std::cmp::Ordering::Less => "at least",
        std::cmp::Ordering::Equal => "more than",
        std::cmp::Ordering::Greater => "at most",
    }
}

impl From<PartError> for DesignError {
    fn from(error: PartError) -> Self {
        match error {
            PartError::Infeasible { part, place, value_mm, limit_mm, field } => Self::at(
                field,
                "",
                format!("{part}: {place}: {value_mm:.4} mm"),
                format!("{} {limit_mm:.4} mm", bound(value_mm, limit_mm)),
            ),
            PartError::Blocked { part, when, angle_deg, shares, cure } => Self::at(
                cure.field.clone(),
                "",
                format!("{part}: blocks the camera's view {when} from {angle_deg:.1} degrees: {shares}"),
                "every ray of the image free from the pupil to the sheet, at rest and under every claimed load",
            )
            .with_cure(cure),
            PartError::Unheld { part, by, problem, value_mm, limit_mm, cure } => Self::at(
                cure.field.clone(),
                "",
                format!(
                    "{part} and {by}: {problem}: {value_mm:.3} mm, {:.3} mm missing",
                    (limit_mm - value_mm).abs()
                ),
                format!("{} {limit_mm:.3} mm", bound(value_mm, limit_mm)),
            )
            .with_cure(cure),
            PartError::Several(faults) => {
                let mut all = faults.into_iter().map(Self::from);
                let first =
                    all.next().unwrap_or_else(|| Self::at("platforms", "", "parts that cannot be made", ""));
                first.with_more(all.collect())
            }
            PartError::View { problem, field } => Self::at(
                field,
                "",
                format!("the camera's view: {problem}"),
                "a view that the platform leaves open",
            ),
            PartError::Mesh { part, error } => Self::at(
                "mesh.chord_tolerance_mm",
                "",
                format!("{part}: {error}"),
                "a tolerance that suits the size",
            ),
            PartError::Unwritable { path, problem } => Self::at(
                "mesh.chord_tolerance_mm",
                "",
                format!("{path}: {problem}"),
                "a tolerance that suits the size",
            ),
            PartError::Broken { part, problem, field } => Self::at(
                if field.is_empty() { "platforms" } else { &field },
                "",
                format!("{part}: {problem}"),
                "features that neither touch nor overlap",
            ),
            PartError::Cured { fault, cure } => Self::from(*fault).with_cure(cure),
        }
    }
}

/// A dimension that the process or the assembly does not allow.
pub(super) fn infeasible(part: &str, place: String, value_mm: f64, limit_mm: f64, field: &str) -> PartError {
    PartError::Infeasible { part: part.to_owned(), place, value_mm, limit_mm, field: field.to_owned() }
}
