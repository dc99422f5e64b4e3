//! Print passes: one from straight above, or the fewest tilted ones that reach every dot.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DMat3;

/// One print pass: a stroke of the pad from one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintPass {
    /// Angle between the dome's axis and the stroke, rad.
    pub tilt_rad: f64,
    /// Azimuth towards which the stroke's contact moves from the pole, rad from +x.
    pub azimuth_rad: f64,
    /// Turns a direction of the sensor frame into the pass's frame, whose +z is the stroke reversed. Zero tilt
    /// is the identity; else the meridian towards the pass stays where it is.
    pub pass_from_sensor: DMat3,
}

impl PrintPass {
    /// The pass whose pad comes down along the normal at this polar angle and azimuth.
    pub fn new(tilt_rad: f64, azimuth_rad: f64) -> Self {
        let turn = DMat3::from_rotation_z(azimuth_rad);
        let pass_from_sensor = turn * DMat3::from_rotation_y(-tilt_rad) * turn.transpose();
        Self { tilt_rad, azimuth_rad, pass_from_sensor }
    }
}

/// Most sectors: more films than any shop would print.
const MAX_SECTORS: u32 = 12;

/// Halvings in the search for the tilt.
const HALVINGS: u32 = 60;

/// The passes for dots whose centres lie up to `polar_rad` from the pole, where each pass reaches centres up to
/// `reach_rad` from its stroke: a centre, and sectors around it, as few as cover everything.
///
/// The sectors stand at equal azimuths, the first at +x. Halfway between two of them, a sector must meet the
/// centre's reach and the outermost dots; along that meridian the distance to the sector's axis is largest at
/// the ends, so that two distances decide. The tilt is the one that makes them equal. Where no number of
/// sectors within `max_tilt_rad` covers everything, the most sectors at the steepest tilt are given: the
/// layout then names the dots that are left.
pub(super) fn split(polar_rad: f64, reach_rad: f64, max_tilt_rad: f64) -> Vec<PrintPass> {
    let centre = PrintPass::new(0.0, 0.0);
    if polar_rad <= reach_rad || reach_rad <= 0.0 {
        return vec![centre];
    }
    let steepest = max_tilt_rad.clamp(0.0, FRAC_PI_2);
    let (count, tilt_rad) = (2..=MAX_SECTORS)
        .map(|count| (count, best_tilt_rad(polar_rad, reach_rad, count).min(steepest)))
        .find(|(count, tilt)| furthest_rad(*tilt, polar_rad, reach_rad, *count) <= reach_rad)
        .unwrap_or((MAX_SECTORS, best_tilt_rad(polar_rad, reach_rad, MAX_SECTORS).min(steepest)));
    let sectors = (0..count).map(|k| PrintPass::new(tilt_rad, TAU * f64::from(k) / f64::from(count)));
    std::iter::once(centre).chain(sectors).collect()
}

/// Distance from a sector's axis to the point halfway to the next sector at a polar angle.
fn distance_rad(tilt_rad: f64, polar_rad: f64, count: u32) -> f64 {
    let across = (PI / f64::from(count)).cos();
    (tilt_rad.cos() * polar_rad.cos() + tilt_rad.sin() * polar_rad.sin() * across).clamp(-1.0, 1.0).acos()
}

fn furthest_rad(tilt_rad: f64, polar_rad: f64, reach_rad: f64, count: u32) -> f64 {
    distance_rad(tilt_rad, polar_rad, count).max(distance_rad(tilt_rad, reach_rad, count))
}

/// The tilt at which the outermost dots and the edge of the centre's reach are equally far.
fn best_tilt_rad(polar_rad: f64, reach_rad: f64, count: u32) -> f64 {
    let excess = |tilt: f64| distance_rad(tilt, polar_rad, count) - distance_rad(tilt, reach_rad, count);
    // Upright, the outer dots are further; lying, the inner ones are.
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    if excess(high) > 0.0 {
        return high;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    high
}
