//! Friction of a contact taken as one: Mindlin's tangential and torsional springs with Coulomb's limit.
//!
//! R. D. Mindlin, Compliance of elastic bodies in contact, J. Appl. Mech. 16 (1949): k = 8 a G / (2 - nu) sideways,
//! 16/3 G a^3 in torsion, for a disc that sticks; Cattaneo's partial slip softens it before Coulomb's limit,
//! Q = mu P (1 - (1 - 2 k s / (3 mu P))^(3/2)); the largest torque of a Hertzian disc is 3 pi/16 mu P a.

use glam::DVec3;

use crate::elastomer::Elastomer;
use crate::outcome::History;
use domecast_optics::numeric::{Rigid, vector_from_rotation};

/// What friction does to the dome.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drag {
    /// Sideways force on the dome, sensor frame, N.
    pub force_n: DVec3,
    /// Moment about the normal, N*mm.
    pub torsion_nmm: f64,
    /// How far the touched disc is dragged sideways, mm, and turned about the normal, rad.
    pub shift_mm: DVec3,
    pub turn_rad: f64,
    /// Whether the disc as a whole still sticks.
    pub sticks: bool,
}

/// Contact of one disc: where, how large, how hard pressed.
pub(crate) struct Disc {
    pub at_mm: DVec3,
    pub normal: DVec3,
    pub radius_mm: f64,
    pub force_n: f64,
    /// 1 + the object's yield over the dome's.
    pub sharing: f64,
}

/// Moves the springs by what the object moved since the last state, and lets them slip.
pub(crate) fn drag(elastomer: &Elastomer, disc: &Disc, now: &Rigid, before: Option<&History>) -> Drag {
    let shear = elastomer.shear_mpa() / disc.sharing;
    let sideways = 8.0 * disc.radius_mm * shear / (2.0 - elastomer.poisson);
    let torsional = 16.0 / 3.0 * shear * disc.radius_mm.powi(3);
    let max_n = elastomer.friction * disc.force_n;
    let max_nmm = 3.0 * std::f64::consts::PI / 16.0 * max_n * disc.radius_mm;
    let (mut force, mut torsion) = (DVec3::ZERO, 0.0);
    if let Some(history) = before
        && let Some(then) = &history.sensor_from_object
    {
        let moved = now.compose(&then.inverse());
        let step = moved.point(disc.at_mm) - disc.at_mm;
        let turn = vector_from_rotation(&moved.rotation).dot(disc.normal);
        // The old force follows the object's turn.
        force = moved.vector(history.tangential_n) + step * sideways;
        force -= disc.normal * force.dot(disc.normal);
        torsion = history.torsion_nmm + turn * torsional;
    }
    let wanted = force.length();
    let sticks = wanted < max_n && torsion.abs() < max_nmm;
    if wanted > max_n {
        force *= max_n / wanted;
    }
    torsion = torsion.clamp(-max_nmm, max_nmm);
    // Partial slip: the displacement that goes with a force below the limit.
    let share = |part: f64| 1.5 * (1.0 - (1.0 - part.clamp(0.0, 1.0)).powf(2.0 / 3.0));
    let size = force.length();
    let shift_mm = if size > 0.0 && sideways > 0.0 {
        force * (max_n * share(size / max_n) / (sideways * size))
    } else {
        DVec3::ZERO
    };
    let turn_rad = if torsional > 0.0 { torsion / torsional } else { 0.0 };
    Drag { force_n: force, torsion_nmm: torsion, shift_mm, turn_rad, sticks }
}
