//! How the contact of a frame was solved, as the truth says it.

use glam::DVec3;
use serde::Serialize;

use crate::work::FollowedRays;
use domecast_contact::{
    ContactState, Deviation, Pressed, PressedObject, PressedTogether, Status, TouchedNode,
};

/// How far a frame's contact may be from that of a dome at large strain, as measured against the finite-strain level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ContactErrorTruth {
    /// Of the membrane, mm.
    pub displacement_mm: f64,
    /// The same in the image, where it is seen largest, px.
    pub px: f64,
    /// Of the force between dome and object, N.
    pub force_n: f64,
}

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
    /// How far the contact's level may be off here, of several objects all together; null where nothing touches, nor reaches into the
    /// dome between the level's nodes.
    pub estimated_error: Option<ContactErrorTruth>,
    /// What springs and contact are out of balance by, N (moments counted over the springs' reach), on a rigid mount what
    /// a force that is asked for is missed by; null where nothing was solved.
    pub balance_residual_n: Option<f64>,
    /// Contact solves that this took; null where nothing was solved.
    pub solves: Option<u32>,
    /// Area of the contact, mm2: that of an ellipse whose half ellipsoid of pressure has the second moments of this one (exact for
    /// Hertz' contact); several objects' are added. Null where nothing touches, like the next three.
    pub area_mm2: Option<f64>,
    /// Centre of pressure: the mean of the places that bear a load, as the dome is now, by their pressure, sensor frame, mm.
    pub point_mm: Option<[f64; 3]>,
    /// Mean outward normal of the contact by pressure, sensor frame.
    pub normal: Option<[f64; 3]>,
    /// Force that the objects put on the dome, sensor frame, N.
    pub force_n: Option<[f64; 3]>,
    /// Rays of the picture, and those that ended beside the membrane, where it is too steep for the search; only where there
    /// are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rays_beside: Option<FollowedRays>,
    /// Each object's own part, where a scene has several; their wrenches add to the frame's.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<ObjectTruth>,
}

/// One of several objects in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectTruth {
    /// Its name in the scene.
    pub name: String,
    /// As the contact's: its own; `away` where it cannot touch.
    pub status: &'static str,
    /// `rest_from_object`, row-major; null while it is away.
    pub pose: Option<[[f64; 4]; 4]>,
    /// Fx, Fy, Fz, Mx, My, Mz that it puts on the dome, rest frame, about the springs' reference point, N and N*mm.
    pub wrench: [f64; 6],
    /// Middle of its pressure on the undeformed dome, sensor frame, mm; null where it does not touch.
    pub middle_mm: Option<[f64; 3]>,
    /// Radius of a disc of its contact's area, mm.
    pub contact_radius_mm: f64,
    /// Its largest pressure, MPa.
    pub peak_pressure_mpa: f64,
}

impl ContactErrorTruth {
    /// What the states of all objects leave open together; `None` where they touch nothing and miss nothing.
    fn of<'s>(states: impl Iterator<Item = &'s ContactState>, px_per_mm: f64) -> Option<Self> {
        let (mut is_any, mut displacement_mm, mut force_n) = (false, 0.0, 0.0);
        for state in states {
            is_any |= !state.nodes.is_empty() || state.deviation != Deviation::default();
            displacement_mm += state.deviation.displacement_mm;
            force_n += state.deviation.force_n;
        }
        is_any.then_some(Self { displacement_mm, px: displacement_mm * px_per_mm, force_n })
    }
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
            estimated_error: None,
            balance_residual_n: None,
            solves: None,
            area_mm2: None,
            point_mm: None,
            normal: None,
            force_n: None,
            rays_beside: None,
            objects: Vec::new(),
        }
    }

    /// Of a contact in balance with the springs.
    pub(crate) fn of(pressed: &Pressed, px_per_mm: f64) -> Self {
        let state = &pressed.state;
        Self {
            estimated_error: ContactErrorTruth::of(std::iter::once(state), px_per_mm),
            ..Self::of_state(state, pressed.residual_n, pressed.iterations)
        }
    }

    /// Of several contacts in balance with the springs, or those of a slow gel; the objects' own are written where they are
    /// several.
    pub(crate) fn of_several<'n>(
        pressed: &PressedTogether,
        names: impl ExactSizeIterator<Item = &'n str>,
        px_per_mm: f64,
    ) -> Self {
        let several = names.len() > 1;
        let objects = names.zip(&pressed.objects).filter(|_| several);
        let objects = objects.map(|(name, object)| ObjectTruth::of(name, object.as_ref())).collect();
        let states = pressed.objects.iter().flatten().map(|object| &object.state);
        let estimated_error = ContactErrorTruth::of(states, px_per_mm);
        let solved = Self::of_state(&pressed.state, pressed.residual_n, pressed.iterations);
        Self { objects, estimated_error, ..solved }
    }

    fn of_state(state: &ContactState, residual_n: f64, solves: u32) -> Self {
        let (status, note) = match state.status {
            Status::BoundReached => ("not_converged", Some(how_far_off(state))),
            Status::NotApplicable(why) => {
                ("not_applicable", Some(format!("{why}; the geometric level's contact instead")))
            }
            status => (status_name(status), None),
        };
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let loads = || state.nodes.iter().map(|node| (node, node.pressure_mpa * node.area_mm2));
        let load_n: f64 = loads().map(|(_, load_n)| load_n).sum();
        let touches = |value: DVec3| (load_n > 0.0).then(|| value.to_array());
        let mean = |of: &dyn Fn(&TouchedNode) -> DVec3| {
            loads().map(|(node, load_n)| of(node) * load_n).sum::<DVec3>() / load_n
        };
        let area_mm2 = std::f64::consts::PI * state.contact_radius_mm.powi(2);
        Self {
            status,
            note,
            residual_mm: finite(state.residual_mm),
            penetration_mm: finite(state.penetration_mm),
            iterations: Some(state.iterations),
            estimated_error: None,
            balance_residual_n: finite(residual_n),
            solves: Some(solves),
            area_mm2: (load_n > 0.0).then_some(area_mm2),
            point_mm: touches(mean(&|node| node.place_mm)),
            normal: touches(-mean(&|node| node.inward).normalize_or_zero()),
            force_n: touches(state.wrench.force_n),
            rays_beside: None,
            objects: Vec::new(),
        }
    }
}

impl ObjectTruth {
    fn of(name: &str, object: Option<&PressedObject>) -> Self {
        let Some(PressedObject { rest_from_object, state, wrench }) = object else {
            return Self {
                name: name.to_owned(),
                status: "away",
                pose: None,
                wrench: [0.0; 6],
                middle_mm: None,
                contact_radius_mm: 0.0,
                peak_pressure_mpa: 0.0,
            };
        };
        let load: f64 = state.nodes.iter().map(|node| node.pressure_mpa * node.area_mm2).sum();
        let moment = state.nodes.iter().map(|n| n.at_mm * (n.pressure_mpa * n.area_mm2)).sum::<DVec3>();
        Self {
            name: name.to_owned(),
            status: status_name(state.status),
            pose: Some(rest_from_object.to_rows_4x4()),
            wrench: wrench.to_array(),
            middle_mm: (load > 0.0).then(|| (moment / load).to_array()),
            contact_radius_mm: state.contact_radius_mm,
            peak_pressure_mpa: state.peak_pressure_mpa,
        }
    }
}

fn status_name(status: Status) -> &'static str {
    match status {
        Status::Free => "free",
        Status::Solved => "converged",
        Status::BoundReached => "not_converged",
        Status::NotApplicable(_) => "not_applicable",
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
