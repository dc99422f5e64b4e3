//! How the contact of a frame was solved, as the truth says it.

use serde::Serialize;

use domecast_contact::{ContactState, Pressed, Status};

/// How the contact of a frame was solved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactTruth {
    /// `free` (nothing touches), `converged`, `not_converged` (all numbers of the frame are those of the last iteration), or
    /// `not_applicable` (the level's formulas do not cover it: the geometric level's contact instead).
    pub status: &'static str,
    /// What the status means, where it is `not_converged` or `not_applicable`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// What the last iteration still moved, mm; null where nothing was solved.
    pub residual_mm: Option<f64>,
    /// How deep a node of the deformed dome still lies in the object, mm; null where nothing was solved.
    pub penetration_mm: Option<f64>,
    /// Iterations of the last contact solve; null where nothing was solved.
    pub iterations: Option<u32>,
    /// What springs and contact are out of balance by, N (moments counted over the springs' reach), on a rigid mount what
    /// a force that is asked for is missed by; null where nothing was solved.
    pub balance_residual_n: Option<f64>,
    /// Contact solves that this took; null where nothing was solved.
    pub solves: Option<u32>,
}

impl ContactTruth {
    /// No object is near: there was nothing to solve.
    pub(crate) fn away() -> Self {
        Self {
            status: "free",
            note: None,
            residual_mm: None,
            penetration_mm: None,
            iterations: None,
            balance_residual_n: None,
            solves: None,
        }
    }

    /// Of a contact in balance with the springs.
    pub(crate) fn of(pressed: &Pressed) -> Self {
        let state = &pressed.state;
        let (status, note) = match state.status {
            Status::Free => ("free", None),
            Status::Solved => ("converged", None),
            Status::BoundReached => ("not_converged", Some(how_far_off(state))),
            Status::NotApplicable(why) => {
                ("not_applicable", Some(format!("{why}; the geometric level's contact instead")))
            }
        };
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        Self {
            status,
            note,
            residual_mm: finite(state.residual_mm),
            penetration_mm: finite(state.penetration_mm),
            iterations: Some(state.iterations),
            balance_residual_n: finite(pressed.residual_n),
            solves: Some(pressed.iterations),
        }
    }
}

/// What a contact that did not converge was left with.
fn how_far_off(state: &ContactState) -> String {
    let moved = match state.residual_mm {
        residual_mm if residual_mm.is_finite() => format!("nodes still moved by {residual_mm:.1e} mm"),
        _ => "no step could be taken".into(),
    };
    format!(
        "after {} iterations {moved} and one lay {:.1e} mm inside the object",
        state.iterations, state.penetration_mm
    )
}
