//! How far a level's answer may be from the finite-strain level's, from the answer itself.
//!
//! What a level leaves out grows with the strain under the object, with the contact's size against the dome's and, where there
//! are elements, with their size against the contact's. All three follow from its force F and the radius a of its contact:
//! the mean pressure over the plane-strain modulus, F / (pi a^2 E*), which is 2 a / (3 pi R) under a ball (Hertz) and the
//! depth over the radius under a punch; a / R; and h / a. The linear level's loads turn with the surface, which leaves a force
//! off by the square of the strain; its elements are of the second order; and under friction, which holds what would slip,
//! it is softer than large strain. The displacement is taken over the approach of Hertz' contact,
//! 3 F / (4 a E*). The constants are the least
//! that hold the deviations found on domes of 10 mm in tests/cases/golden_neo_hookean.json, and by even seeds in
//! tests/cases/contact_reference.json, with a margin of a seventh; the other domes and the odd seeds test them.

use crate::elastomer::{Elastomer, Indenter};
use crate::level::{Level, MAX_ELEMENTS, elements_of};
use crate::outcome::{Deviation, Status};
use crate::state::ContactState;

/// What a deviation is made of: parts of the force, and of the approach; each without a condition (of the linear level: under
/// friction), by strain, by a / R, and by h / a.
struct Shares {
    force: [f64; 4],
    displacement: [f64; 4],
    /// How much more the part by strain is under an object with edges.
    edges: f64,
    /// How much more force and displacement are off under a mesh: walls, hollows and edges wherever they are.
    mesh: [f64; 2],
}

const GEOMETRIC: Shares = Shares {
    force: [0.02, 0.3, 0.06, 0.0],
    displacement: [0.3, 0.25, 0.0, 0.0],
    edges: 2.3,
    mesh: [12.0, 5.0],
};
const CLOSED_FORM: Shares = Shares {
    force: [0.01, 0.2, 0.2, 0.0],
    displacement: [0.09, 0.0, 0.21, 0.0],
    edges: 1.0,
    mesh: [1.0, 1.0],
};
/// The squares of strain (in the force) and of h / a count.
const LINEAR: Shares = Shares {
    force: [0.6, 0.15, 0.05, 0.28],
    displacement: [0.1, 0.06, 0.05, 0.42],
    edges: 2.6,
    mesh: [7.0, 7.0],
};
/// From this coefficient of friction on, most of a contact sticks.
const HOLDS: f64 = 0.25;
/// Of 6 elements across, against scikit-fem.
const FINITE_STRAIN: Shares = Shares {
    force: [0.008, 0.02, 0.03, 0.0],
    displacement: [0.015, 0.02, 0.0, 0.0],
    edges: 1.5,
    mesh: [2.0, 2.0],
};

impl Shares {
    fn of(shares: [f64; 4], by: [f64; 4]) -> f64 {
        shares.iter().zip(by).map(|(share, by)| share * by).sum()
    }
}

/// The deviation of a state that a level answered.
pub(crate) fn deviation(
    level: Level,
    elastomer: &Elastomer,
    indenter: &Indenter,
    state: &ContactState,
) -> Deviation {
    let (force_n, radius_mm) = (state.wrench.force_n.length(), state.contact_radius_mm);
    if state.nodes.is_empty() || radius_mm.is_nan() || radius_mm <= 0.0 {
        return Deviation::default();
    }
    let modulus_mpa = elastomer.plane_strain_mpa();
    let strain = force_n / (std::f64::consts::PI * radius_mm * radius_mm * modulus_mpa);
    let approach_mm = 0.75 * force_n / (radius_mm * modulus_mpa);
    // The closed form's stand-in is the geometric level.
    let is_geometric = level == Level::Geometric || matches!(state.status, Status::NotApplicable(_));
    let (shares, element_mm) = match level {
        _ if is_geometric => (GEOMETRIC, 0.0),
        Level::Geometric => (GEOMETRIC, 0.0),
        Level::ClosedForm => (CLOSED_FORM, 0.0),
        Level::Linear { element_mm } => {
            let elements = elements_of(elastomer, element_mm).unwrap_or(MAX_ELEMENTS);
            (LINEAR, elastomer.dome().meridian_end_rad() * elastomer.dome_radius_mm / elements as f64)
        }
        Level::FiniteStrain { .. } => (FINITE_STRAIN, 0.0),
    };
    let edges = if indenter.solid.is_ball() { 1.0 } else { shares.edges };
    let mesh = if indenter.solid.is_mesh() { shares.mesh } else { [1.0; 2] };
    let (wide, coarse) = (radius_mm / elastomer.depth_scale_mm(), element_mm / radius_mm);
    let by = if let Level::Linear { .. } = level {
        let held = strain * (elastomer.friction / HOLDS).min(1.0);
        // Beyond an element for the whole contact there is no order.
        let coarse = edges * coarse * coarse.min(1.0);
        [[strain * held, (strain * edges).powi(2), wide, coarse], [held, strain * edges, wide, coarse]]
    } else {
        [[1.0, strain * edges, wide, coarse]; 2]
    };
    // The geometric rule gives the dome the way of a soft object, too.
    let too_far = if is_geometric { indenter.yield_ratio(elastomer) } else { 0.0 };
    let displacement = mesh[1] * Shares::of(shares.displacement, by[1]) + too_far;
    Deviation {
        displacement_mm: approach_mm * displacement,
        force_n: force_n * mesh[0] * Shares::of(shares.force, by[0]),
    }
}
