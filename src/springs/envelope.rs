//! The load envelope: how far each load can be driven, and what ends it.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

use super::limits::{Check, Limit, Limits, LoadCase, try_load};
use super::load::Wrench;
use super::spec::SpringSpec;
use super::spring::Spring;
use super::suspension::{Suspension, SuspensionSpec};
use domecast_optics::DomeShape;
use domecast_optics::numeric::Rigid;

/// A load that is driven up from zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// A word for it.
    pub name: String,
    /// The load at factor 1, about the suspension's reference point.
    pub wrench: Wrench,
}

/// How far a direction goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    /// The direction.
    pub direction: Direction,
    /// The factor at which the first limit is met, to a hundred-thousandth; at most the search's end.
    pub factor: f64,
    /// What ends it; `None` where nothing did before the search's end.
    pub ended_by: Option<Check>,
    /// The load case at that factor.
    pub case: LoadCase,
}

/// Factor at which a search stops if nothing has ended the load.
pub const LARGEST_FACTOR: f64 = 64.0;
/// How sharply the end of a load is found, as a part of it.
const TOLERANCE: f64 = 1e-5;

/// Limits that are not of the springs: what the camera sees at a pose, most used first or in any order.
pub type MoreChecks<'a> = &'a dyn Fn(&Rigid) -> Vec<Check>;

/// A load case with every check.
pub fn try_all(suspension: &Suspension, limits: &Limits, more: MoreChecks, wrench: &Wrench) -> LoadCase {
    let mut case = try_load(suspension, limits, wrench);
    if let Ok(balance) = &case.equilibrium {
        let seen = more(&balance.pose);
        case.extend(seen);
    }
    case
}

/// Drives one load up until the first limit is met: growing from an eighth by sixty per cent at a time, then closing
/// in by the secant of the most used limit, held inside the bracket and helped by bisection (at most 40 steps).
///
/// The part of each limit that is used need not grow with the load; what is found is the first limit met at the
/// resolution of that growth.
pub fn reach(suspension: &Suspension, limits: &Limits, more: MoreChecks, direction: &Direction) -> Reach {
    let at = |factor: f64| try_all(suspension, limits, more, &direction.wrench.scaled(factor));
    // How far past the limits a case is; without a balance there is no measure of it.
    let past = |case: &LoadCase| match &case.equilibrium {
        Ok(_) => case.checks.iter().map(Check::used).fold(0.0, f64::max) - 1.0,
        Err(_) => f64::INFINITY,
    };
    let passed = |case: &LoadCase| case.equilibrium.is_err() || case.passed().next().is_some();
    let (mut low, mut low_past, mut high) = (0.0, -1.0, 0.125);
    let mut under = None;
    let mut over = at(high);
    while !passed(&over) && high < LARGEST_FACTOR {
        (low, low_past, under) = (high, past(&over), Some(over));
        // Steps of sixty per cent: limits that are met and left again within one are not seen.
        high *= 1.6;
        over = at(high);
    }
    if !passed(&over) {
        return Reach { direction: direction.clone(), factor: high, ended_by: None, case: over };
    }
    let mut high_past = past(&over);
    let mut before = high - low;
    for step in 0..40 {
        let width = high - low;
        if width <= TOLERANCE * high {
            break;
        }
        // The secant's guess, a little inside the bracket: where it hits, the next one closes the bracket.
        let inside = 0.4 * TOLERANCE * high;
        let secant = low - low_past * width / (high_past - low_past);
        let slow = step % 3 == 2 && width > 0.5 * before;
        // Far past a limit (a gap of zero counts as without end) the secant tells nothing.
        let factor = if slow || !(secant.is_finite() && high_past < 1.0) {
            0.5 * (low + high)
        } else {
            secant.clamp(low + inside, high - inside)
        };
        if step % 3 == 2 {
            before = width;
        }
        let case = at(factor);
        if passed(&case) {
            (high, high_past, over) = (factor, past(&case), case);
        } else {
            (low, low_past, under) = (factor, past(&case), Some(case));
        }
    }
    let ended_by = over.passed().next().cloned().or_else(|| over.checks.first().cloned());
    let case = under.unwrap_or_else(|| at(low));
    Reach { direction: direction.clone(), factor: low, ended_by, case }
}

/// The directions of a load table: presses and pulls on the pole, a push at `azimuths` around it, presses off
/// centre, tilts and twists, one newton or newton-millimetre each, where they act on the dome. On a cap that ends before
/// 45 degrees the presses off centre act on its rim, along its normal there.
pub fn standard_directions(at_mm: DVec3, dome: &DomeShape, azimuths: u32) -> Vec<Direction> {
    let pole = dome.pole_mm();
    let load = |name: String, force, moment, point| Direction {
        name,
        wrench: Wrench::of_load(force, moment, point, at_mm),
    };
    let mut all = vec![
        load("press".into(), -DVec3::Z, DVec3::ZERO, pole),
        load("pull".into(), DVec3::Z, DVec3::ZERO, pole),
        load("twist".into(), DVec3::ZERO, DVec3::Z, pole),
    ];
    for i in 0..azimuths {
        let angle = f64::from(i) * std::f64::consts::TAU / f64::from(azimuths.max(1));
        let along = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let degrees = angle.to_degrees().round();
        all.push(load(format!("push at the pole, {degrees} deg"), along, DVec3::ZERO, pole));
        let normal = (along + DVec3::Z).normalize();
        let end = dome.sphere_end_rad();
        let normal = if end < FRAC_PI_4 { along * end.sin() + DVec3::Z * end.cos() } else { normal };
        all.push(load(
            format!("press at 45 deg, {degrees} deg"),
            -normal,
            DVec3::ZERO,
            dome.center_mm() + normal * dome.radius_mm(),
        ));
        all.push(load(format!("tilt about {degrees} deg"), DVec3::ZERO, along, pole));
    }
    all
}

/// The border of what can be pressed and pushed at once: for each of `count` mixes of a push (along `azimuth_rad`,
/// at the pole, `pole_z_mm` high) and a press, how far it goes, from pure pull over pure push to pure press. Points (push N, press N).
pub fn push_press_border(
    suspension: &Suspension,
    limits: &Limits,
    more: MoreChecks,
    pole_z_mm: f64,
    azimuth_rad: f64,
    count: u32,
) -> Vec<([f64; 2], Option<Limit>)> {
    let along = DVec3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
    let pole = DVec3::new(0.0, 0.0, pole_z_mm);
    let mix = |i: u32| {
        // From pull (-90 degrees) to press (+90 degrees), the push scaled so that both ends are seen.
        let angle = std::f64::consts::PI * (f64::from(i) / f64::from(count.max(2) - 1) - 0.5);
        let force = along * (0.2 * angle.cos()) - DVec3::Z * angle.sin();
        let wrench = Wrench::of_load(force, DVec3::ZERO, pole, suspension.at_mm());
        let reach = reach(suspension, limits, more, &Direction { name: String::new(), wrench });
        let point = [0.2 * angle.cos() * reach.factor, angle.sin() * reach.factor];
        (point, reach.ended_by.map(|check| check.limit))
    };
    (0..count).map(mix).collect()
}

/// A spring that could stand in the design's place, and what it makes of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The spring.
    pub spring: SpringSpec,
    /// Stiffness along the axis of all springs together, N/mm.
    pub axial_n_per_mm: f64,
    /// The limit that the load uses up most, if the springs carry it at all.
    pub worst: Check,
}

/// Springs of other coil counts and wires (half to twice, in trade steps) and what the most used limit is under a
/// load, for those that could be made; the design's own count and wire among them.
pub fn choices(spec: &SuspensionSpec, limits: &Limits, more: MoreChecks, wrench: &Wrench) -> Vec<Choice> {
    let own = *spec.spring.spec();
    let mut found = Vec::new();
    for wire in [0.2, 0.25, 0.3, 0.35, 0.4, 0.5] {
        let wire_diameter_mm =
            if (wire - own.wire_diameter_mm).abs() < 1e-6 { own.wire_diameter_mm } else { wire };
        if !(0.5..=2.0).contains(&(wire_diameter_mm / own.wire_diameter_mm)) {
            continue;
        }
        for coils in 2..=8_u32 {
            let tried = SpringSpec { wire_diameter_mm, active_coils: f64::from(coils), ..own };
            let made = Spring::new(tried)
                .and_then(|spring| Suspension::new(SuspensionSpec { spring, ..spec.clone() }));
            let Ok(suspension) = made else { continue };
            let case = try_all(&suspension, limits, more, wrench);
            if let Some(worst) = case.checks.first() {
                let count = suspension.spec().upper_ends_mm.len() as f64;
                let axial_n_per_mm = count * suspension.spec().spring.axial_n_per_mm();
                found.push(Choice { spring: tried, axial_n_per_mm, worst: worst.clone() });
            }
        }
    }
    found
}
