//! How far a level's answer may be from the finite-strain level's, from the answer itself.
//!
//! What a level leaves out has causes that its answer shows ([`Cause`]): the strain under the object, the contact's size against
//! the dome's and the elements' against the contact's, edges within the contact, an object that gives way, friction that pulls
//! sideways or holds what would slip. A deviation is a sum of shares of them: of the contact's force, and of the approach of
//! Hertz' contact that bears it, 3 F / (4 a E*) (K. L. Johnson, Contact Mechanics, 1985, eq. 4.22 and 4.23; Mindlin's tangential
//! one, eq. 7.42, is as long for the same force to within 2 % at a Poisson's ratio of 0.49, 6 % at 0.45). The shares are those of
//! the smallest mean of estimate over deviation (mean solution of 300 linear programs that weigh the contacts at random) for which
//! no contact is said to be off by less than 0.64 (force) or 0.75 (displacement) times its deviation, by the linear level 0.78 and
//! 0.85: on domes of 10 mm in tests/cases/golden_neo_hookean.json, and where tests/cases/contact_reference.json says `fitted`. The
//! other domes and contacts, and tests/cases/golden_domes.json, test them. What is smaller than the elements is no share of what the
//! nodes answer, which may be nothing: see [`missed`].

use glam::DVec3;

use crate::elastomer::{Elastomer, Indenter};
use crate::level::{Level, MAX_ELEMENTS, elements_of};
use crate::missed::missed;
use crate::object::{Feature, Placed, feature_at};
use crate::outcome::{Deviation, Status, TouchedNode};
use crate::state::ContactState;
use domecast_optics::numeric::Rigid;

/// Why an answer is off.
#[derive(Debug, Clone, Copy)]
enum Cause {
    /// There is a contact.
    Touch,
    /// Mean pressure over the plane-strain modulus of both bodies, F / (pi a^2 E*): 4 a / (3 pi R) under a ball (Hertz; R of
    /// both), the depth over the radius under a punch.
    Strain,
    /// Its square.
    LargeStrain,
    /// Its square, where friction holds what would slip.
    Held,
    /// The contact's radius over the dome's.
    Wide,
    /// An element over the contact's radius, squared: elements of the second order; beyond one for the whole contact there is no order.
    Coarse,
    /// 1 where the contact reaches the end of the face that touches, 0 where the face goes on for a third of the contact's radius.
    Edge,
    /// Edges are rounded off by a part of an element.
    CoarseEdge,
    /// Edges by strain.
    StrainedEdge,
    /// Edges between faces that come down at an angle to the dome: 1 - cosine, the mean by pressure. A node is on one side of them.
    Flank,
    /// Walls, hollows and edges wherever they are.
    Mesh,
    /// Those, on few elements.
    CoarseMesh,
    /// Friction's part of the force.
    Sideways,
    /// The object's part of the approach of both.
    Soft,
    /// The object's approach over the dome's.
    Yield,
    /// That, by strain.
    StrainedYield,
}

/// By cause: parts of the force, and of the approach.
struct Shares {
    force: &'static [(Cause, f64)],
    displacement: &'static [(Cause, f64)],
}

const GEOMETRIC: Shares = Shares {
    force: &[
        (Cause::Touch, 0.058),
        (Cause::Held, 0.51),
        (Cause::Edge, 0.031),
        (Cause::StrainedEdge, 0.29),
        (Cause::Flank, 1.6),
        (Cause::Mesh, 1.1),
        (Cause::Sideways, 0.34),
        (Cause::Soft, 0.12),
    ],
    displacement: &[
        (Cause::Touch, 0.28),
        (Cause::Strain, 0.33),
        (Cause::StrainedEdge, 0.41),
        (Cause::Flank, 0.68),
        (Cause::Mesh, 0.75),
        (Cause::Sideways, 0.34),
        (Cause::Yield, 0.85),
    ],
};
const CLOSED_FORM: Shares = Shares {
    force: &[
        (Cause::Touch, 0.05),
        (Cause::LargeStrain, 0.11),
        (Cause::Wide, 0.084),
        (Cause::Sideways, 0.34),
        (Cause::Soft, 0.059),
    ],
    displacement: &[
        (Cause::Touch, 0.035),
        (Cause::Wide, 0.4),
        (Cause::Sideways, 0.86),
        (Cause::StrainedYield, 0.22),
    ],
};
const LINEAR: Shares = Shares {
    force: &[
        (Cause::Touch, 0.025),
        (Cause::Held, 0.96),
        (Cause::LargeStrain, 0.04),
        (Cause::Coarse, 0.19),
        (Cause::CoarseEdge, 0.33),
        (Cause::Flank, 1.8),
        (Cause::Mesh, 0.44),
        (Cause::CoarseMesh, 1.4),
        (Cause::Sideways, 0.28),
    ],
    displacement: &[
        (Cause::Touch, 0.017),
        (Cause::Strain, 0.072),
        (Cause::Coarse, 0.42),
        (Cause::StrainedEdge, 0.46),
        (Cause::Mesh, 0.89),
        (Cause::Sideways, 0.49),
        (Cause::StrainedYield, 0.33),
    ],
};
/// Of 6 elements across, against scikit-fem.
const FINITE_STRAIN: Shares = Shares {
    force: &[
        (Cause::Touch, 0.008),
        (Cause::Strain, 0.02),
        (Cause::Wide, 0.03),
        (Cause::StrainedEdge, 0.01),
        (Cause::Mesh, 0.02),
    ],
    displacement: &[
        (Cause::Touch, 0.015),
        (Cause::Strain, 0.02),
        (Cause::StrainedEdge, 0.01),
        (Cause::Mesh, 0.02),
    ],
};

/// From this coefficient of friction on, most of a contact sticks.
const HOLDS: f64 = 0.25;
/// The end of a face counts from this far on, and fully from that far on, in radii of the contact.
const EDGES: [f64; 2] = [1.3, 0.9];

/// What an answer shows of the causes.
struct Found {
    strain: f64,
    /// How much of what would slip friction holds.
    held: f64,
    wide: f64,
    /// An element over the contact's radius; no more than 1 counts.
    coarse: f64,
    /// How far the face that touches goes on, in radii of the contact.
    room: f64,
    /// 1 - cosine between pressure and the dome's normal, the mean by pressure.
    angled: f64,
    is_mesh: bool,
    sideways: f64,
    yields: f64,
}

impl Found {
    fn of(&self, cause: Cause) -> f64 {
        let edge = ((EDGES[0] - self.room) / (EDGES[0] - EDGES[1])).clamp(0.0, 1.0);
        let mesh = f64::from(u8::from(self.is_mesh));
        match cause {
            Cause::Touch => 1.0,
            Cause::Strain => self.strain,
            Cause::LargeStrain => self.strain * self.strain,
            Cause::Held => self.held * self.strain * self.strain,
            Cause::Wide => self.wide,
            Cause::Coarse => self.coarse * self.coarse.min(1.0),
            Cause::Edge => edge,
            Cause::CoarseEdge => edge * self.coarse.min(1.0),
            Cause::StrainedEdge => edge * self.strain,
            Cause::Flank => edge * self.angled,
            Cause::Mesh => mesh,
            Cause::CoarseMesh => mesh * self.coarse.min(1.0),
            Cause::Sideways => self.sideways,
            Cause::Soft => self.yields / (1.0 + self.yields),
            Cause::Yield => self.yields,
            Cause::StrainedYield => self.yields * self.strain,
        }
    }

    fn share(&self, shares: &[(Cause, f64)]) -> f64 {
        shares.iter().map(|(cause, share)| share * self.of(*cause)).sum()
    }
}

/// The deviation of a state that a level answered for a pose.
pub(crate) fn deviation(
    level: Level,
    elastomer: &Elastomer,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    state: &ContactState,
) -> Deviation {
    let (force_n, radius_mm) = (state.wrench.force_n.length(), state.contact_radius_mm);
    let load: Vec<f64> = state.nodes.iter().map(|node| node.pressure_mpa * node.area_mm2).collect();
    let load_n: f64 = load.iter().sum();
    let element_mm = match level {
        Level::Linear { element_mm } => {
            let elements = elements_of(elastomer, element_mm).unwrap_or(MAX_ELEMENTS);
            elastomer.dome().meridian_end_rad() * elastomer.dome_radius_mm / elements as f64
        }
        _ => 0.0,
    };
    let missed = missed(elastomer, indenter, sensor_from_object, element_mm, (force_n, radius_mm));
    if radius_mm.is_nan() || radius_mm <= 0.0 || force_n <= 0.0 || load_n <= 0.0 {
        return missed;
    }
    let dome = elastomer.dome();
    let mean = |of: &dyn Fn(&TouchedNode) -> DVec3| -> DVec3 {
        state.nodes.iter().zip(&load).map(|(node, load)| of(node) * *load).sum::<DVec3>() / load_n
    };
    let (middle_mm, inward) = (dome.nearest_mm(mean(&|node| node.at_mm)), mean(&|node| node.inward));
    let along = state.wrench.force_n.dot(inward.normalize_or_zero());
    let cosine: f64 = state
        .nodes
        .iter()
        .zip(&load)
        .map(|(node, load)| -load * node.inward.dot(dome.normal(node.at_mm)))
        .sum();
    let modulus_mpa = elastomer.plane_strain_mpa();
    let approach_mm = 0.75 * force_n / (radius_mm * modulus_mpa);
    let yields = indenter.yield_ratio(elastomer);
    let strain = force_n * (1.0 + yields) / (std::f64::consts::PI * radius_mm * radius_mm * modulus_mpa);
    let shares = match level {
        // The closed form's stand-in is the geometric level.
        Level::ClosedForm if matches!(state.status, Status::NotApplicable(_)) => GEOMETRIC,
        Level::Geometric => GEOMETRIC,
        Level::ClosedForm => CLOSED_FORM,
        Level::Linear { .. } => LINEAR,
        Level::FiniteStrain { .. } => FINITE_STRAIN,
    };
    let found = Found {
        strain,
        held: (elastomer.friction / HOLDS).min(1.0),
        wide: radius_mm / elastomer.depth_scale_mm(),
        coarse: element_mm / radius_mm,
        room: room_mm(indenter, sensor_from_object, middle_mm) / radius_mm,
        angled: 1.0 - cosine / load_n,
        is_mesh: indenter.solid.is_mesh(),
        sideways: (force_n * force_n - along * along).max(0.0).sqrt() / force_n,
        yields,
    };
    Deviation {
        displacement_mm: missed.displacement_mm.max(approach_mm * found.share(shares.displacement)),
        force_n: missed.force_n.max(force_n * found.share(shares.force)),
    }
}

/// How far the face goes on about a place, mm; infinite under a ball, and under a mesh, which counts as one.
fn room_mm(indenter: &Indenter, sensor_from_object: &Rigid, at_mm: DVec3) -> f64 {
    if indenter.solid.is_ball() || indenter.solid.is_mesh() {
        return f64::INFINITY;
    }
    let placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
    match feature_at(&placed, at_mm) {
        Ok(Feature::Smooth { room_mm, .. }) => room_mm.max(0.0),
        // A tip, or an edge.
        Ok(Feature::Apex { .. }) | Err(_) => 0.0,
    }
}
