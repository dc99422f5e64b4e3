//! The finite-strain level: neo-Hookean finite elements about the object's place.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::overlap::overlap;
use crate::elastomer::{Elastomer, Indenter};
use crate::error::ContactError;
use crate::field::Field;
use crate::finite_strain::{Deformed, Grading, Law, Tried, Way, taken};
use crate::object::Placed;
use crate::outcome::{Status, TouchedNode};
use crate::state::ContactState;
use domecast_elastic::Compliance;
use domecast_optics::numeric::Rigid;
use domecast_springs::Wrench;

/// Deepest push-out that is modelled, as a part of the radius: proven against an independent solution to a quarter.
const DEEPEST: f64 = 0.4;
/// Pressure by depth, over the modulus of object and dome together by radius: an object then lies some 1e-4 R inside the dome.
const PENALTY: f64 = 6000.0;
/// What the base may bear more or less than the object, as a part of the contact's force.
const BALANCE: f64 = 1e-6;
/// What the object moves beyond its share is known to this part of the radius, in so many rounds at most.
const CONVERGED: f64 = 1e-9;
const MAX_ROUNDS: u32 = 16;
/// Half angles of the fine patch, rad.
const PATCH_RAD: [f64; 2] = [0.3, 0.75];
/// The patch over the angle of what overlaps: Hertz' contact has 0.7 of that.
const PATCH_BY_OVERLAP: f64 = 1.1;

/// The contact at a pose; `held` says what a soft object moves beyond its share. See [`crate::Level::FiniteStrain`]. What was found at a place near by, from the same frame before, makes it shorter.
pub(crate) fn finite_strain(
    (elastomer, held): (&Elastomer, &Compliance),
    across: usize,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    before: Option<&ContactState>,
    tried: Option<Tried<'_>>,
) -> Result<ContactState, ContactError> {
    let radius_mm = elastomer.dome_radius_mm;
    let mut placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
    let found = overlap(&placed, radius_mm);
    let depth_mm = -found.distance_mm;
    if depth_mm > DEEPEST * radius_mm {
        return Err(ContactError::TooDeep { depth_mm, limit_mm: DEEPEST * radius_mm });
    }
    if depth_mm <= 0.0 {
        return Ok(ContactState {
            work: 30.0 * found.queries as f64,
            ..ContactState::free(sensor_from_object)
        });
    }
    let middle = found.deepest_mm / radius_mm;
    let then = before.and_then(|state| state.history.body.as_ref().zip(state.history.sensor_from_object));
    let (deformed, from) = match then {
        Some((deformed, pose)) => (Deformed::clone(deformed), pose),
        None => {
            let patch_rad = (PATCH_BY_OVERLAP * found.angle_rad).clamp(PATCH_RAD[0], PATCH_RAD[1]);
            let grading = Grading { radius_mm, middle, patch_rad, across };
            let mut from = *sensor_from_object;
            from.translation_mm += middle * depth_mm;
            let known = tried.and_then(|tried| tried.deformed.rested(&grading));
            (known.map_or_else(|| Deformed::new(elastomer, grading), Ok)?, from)
        }
    };
    let sharing = 1.0 + indenter.yield_ratio(elastomer);
    let law = Law {
        penalty: PENALTY * elastomer.young_mpa / (radius_mm * sharing),
        friction: elastomer.friction,
        curved_mm: 2.0 * radius_mm / PENALTY,
        sharing,
    };
    let mut tried = tried.filter(|tried| Arc::ptr_eq(&tried.deformed.body, &deformed.body));
    let near_mm = tried.map(|tried| tried.deformed.beyond_mm);
    let mut rounds = Rounds::new(near_mm.unwrap_or(deformed.beyond_mm));
    let beyond = if sharing > 1.0 {
        let grading = &deformed.body.mesh.grading;
        let along = grading.middle.z.clamp(-1.0, 1.0).acos() / held.grid.dome.meridian_end_rad();
        let ring = (along * held.grid.elements as f64).round() as usize;
        held.held(ring)?.matrix(grading.middle) * (sharing - 1.0)
    } else {
        DMat3::ZERO
    };
    let mut last: Deformed;
    loop {
        let mut to = *sensor_from_object;
        to.translation_mm -= rounds.at_mm;
        placed.move_to(to);
        let mut way = taken(deformed.clone(), &law, &placed, &from, depth_mm, tried)?;
        way.deformed.beyond_mm = rounds.at_mm;
        let bearings = way.solved.iter().flat_map(|solved| solved.bearings.of.iter().flatten());
        let force_n: DVec3 = bearings.map(|bearing| bearing.force_n).sum();
        let is_converged = rounds.take(beyond * force_n) <= CONVERGED * radius_mm;
        if is_converged || rounds.count == MAX_ROUNDS {
            let mut state = state_of(way, &law, &placed, 30.0 * found.queries as f64);
            if !is_converged {
                state.status = Status::BoundReached;
            }
            return Ok(state);
        }
        last = way.deformed;
        tried = Some(Tried { deformed: &last, shares_way: true });
    }
}

/// What the object moves beyond its share, until its force keeps it there: Broyden's method on three numbers.
struct Rounds {
    at_mm: DVec3,
    inverse: DMat3,
    /// Step and miss of the time before.
    before: Option<(DVec3, DVec3)>,
    count: u32,
}

impl Rounds {
    fn new(at_mm: DVec3) -> Self {
        Self { at_mm, inverse: DMat3::IDENTITY, before: None, count: 0 }
    }

    /// Takes in where the force at this place would bring it; the miss, mm.
    fn take(&mut self, there_mm: DVec3) -> f64 {
        let miss = there_mm - self.at_mm;
        if let Some((step, was)) = self.before {
            let change = self.inverse * (was - miss);
            let scale = step.dot(change);
            if scale.abs() > f64::MIN_POSITIVE {
                let row = self.inverse.transpose() * step;
                let left = step - change;
                self.inverse += DMat3::from_cols(left * row.x, left * row.y, left * row.z) * (1.0 / scale);
            }
        }
        let step = self.inverse * miss;
        self.before = Some((step, miss));
        self.at_mm += step;
        self.count += 1;
        miss.length()
    }
}

fn state_of(way: Way, law: &Law, placed: &Placed, queries: f64) -> ContactState {
    let mut state = ContactState::free(&placed.sensor_from_object());
    state.iterations = way.iterations;
    state.work = queries + f64::from(way.iterations) * way.deformed.body.factor_work();
    let Some(solved) = way.solved else { return state };
    let mut wrench = Wrench::default();
    let (mut first, mut second) = (0.0, 0.0);
    for (bearing, spot) in solved.bearings.of.iter().zip(way.deformed.spots.iter()) {
        let Some(bearing) = bearing else { continue };
        wrench.force_n += bearing.force_n;
        wrench.moment_nmm += bearing.place_mm.cross(bearing.force_n);
        let pressure_mpa = -law.penalty * bearing.gap_mm;
        first += pressure_mpa * spot.area_mm2;
        second += pressure_mpa * pressure_mpa * spot.area_mm2;
        state.peak_pressure_mpa = state.peak_pressure_mpa.max(pressure_mpa);
        state.nodes.push(TouchedNode {
            at_mm: spot.at_mm.normalize_or_zero() * way.deformed.body.mesh.grading.radius_mm,
            area_mm2: spot.area_mm2,
            force_n: bearing.force_n,
            pressure_mpa,
            place_mm: bearing.place_mm,
            inward: bearing.normal,
            sticks: bearing.sticks,
        });
    }
    if second > 0.0 {
        // Exact for Hertz' half ellipsoid.
        state.contact_radius_mm = (9.0 / 8.0 * first * first / second / std::f64::consts::PI).sqrt();
        let is_balanced = (wrench.force_n + solved.base_n).length() <= BALANCE * wrench.force_n.length();
        state.status = if is_balanced { Status::Solved } else { Status::BoundReached };
    }
    state.wrench = wrench;
    state.penetration_mm = solved.bearings.penetration_mm();
    state.residual_mm = solved.moved_mm;
    let deformed = Arc::new(way.deformed);
    state.field = Field::Solid(Arc::clone(&deformed));
    state.history.body = Some(deformed);
    state
}
