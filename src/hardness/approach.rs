//! What a frame says of force, approach and contact, and what the frames of a touch together say of 1/E*.

use glam::DVec3;

use crate::press::{Dome, PressRow};

/// What a hemisphere's bonded base holds back, in F / (E* R).
const HEMISPHERE: f64 = 0.37;
/// What a dome's base holds back, in F / (E* R): by the height of the sphere's centre above the base in radii. Fitted to scikit-fem
/// (`tests/cases/golden_held.json`).
pub(crate) fn held(center_z: f64) -> f64 {
    HEMISPHERE
        + if center_z < 0.0 {
            // a cap is thin: towards the infinite layer's 0.57 over its height (Dimitriadis et al., Biophys. J. 82, 2002)
            (-0.72 * center_z - 0.18 * center_z * center_z) / (1.0 + center_z)
        } else {
            // a column yields by itself: 1 / (pi (1 - nu^2)) for each radius of its height
            -0.42 * center_z - 0.11 * center_z / (center_z + 0.25)
        }
}

/// A frame is in contact where its force is above this.
const MIN_FORCE_N: f64 = 0.02;
/// Powers of the force by which a contact's radius grows, before it is read: of a ball, and how far others are from it.
const USUAL_POWER: [f64; 2] = [1.0 / 3.0, 0.15];
/// From a flat end to a cone.
const POWERS: [f64; 2] = [0.0, 0.5];
/// Noise of a contact's radius as it is read, mm: what sets have it with.
const RADIUS_SD_MM: f64 = 0.05;

/// A frame in contact.
pub(crate) struct Pressed {
    force_n: f64,
    depth_mm: f64,
    radius_mm: f64,
}

/// Force, approach and contact's radius of a frame; `None` where nothing touches or a number is missing.
pub(crate) fn pressed(row: &PressRow, dome: &Dome) -> Option<Pressed> {
    let vector = |at: usize| DVec3::new(row[at], row[at + 1], row[at + 2]);
    let (force, moment, shift, turn) = (vector(0), vector(3), vector(6), vector(9));
    let [travel_mm, radius_mm] = [row[12], row[13]];
    let force_n = force.length();
    let known = force_n > MIN_FORCE_N && travel_mm.is_finite() && radius_mm > 0.0;
    if !(known && moment.is_finite() && shift.is_finite() && turn.is_finite()) {
        return None;
    }
    // The force's line: its nearest point to where moments are about, and from there back to the dome.
    let way = force / force_n;
    let near = dome.at_mm - dome.center_mm + force.cross(moment) / (force_n * force_n);
    let behind = near.dot(way);
    let room = behind * behind - near.length_squared() + dome.radius_mm * dome.radius_mm;
    let at_mm = dome.center_mm + near - way * (behind + room.max(0.0).sqrt());
    let platform = shift + turn.cross(at_mm - dome.at_mm);
    // as deep as a half-space would be
    let own = (1.0 - dome.poisson * dome.poisson) / dome.young_mpa;
    let held_mm = held(dome.center_mm.z / dome.radius_mm) * own * force_n / dome.radius_mm;
    Some(Pressed { force_n, depth_mm: travel_mm - platform.dot(way) + held_mm, radius_mm })
}

/// 1/E* and its standard deviation by noise: the slope of the half-spaces' approach over the integral of 1/(2 a) over the force.
pub(crate) fn yields(frames: &[Pressed], travel_sd_mm: f64) -> Option<(f64, f64)> {
    let count = frames.len() as f64;
    if frames.len() < 3 {
        return None;
    }
    let (scale, power) = growth(frames);
    let integral = |frame: &Pressed| frame.force_n.powf(1.0 - power) / ((1.0 - power) * 2.0 * scale);
    let points: Vec<(f64, f64)> = frames.iter().map(|frame| (integral(frame), frame.depth_mm)).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let xx: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let slope = xy / xx;
    let left: f64 = points.iter().map(|p| (p.1 - y - slope * (p.0 - x)).powi(2)).sum();
    // what the line leaves counts where it is more than the noise
    let sd_mm = travel_sd_mm.max((left / (count - 2.0)).sqrt());
    let sd = sd_mm / xx.sqrt();
    (slope.is_finite() && sd.is_finite()).then_some((slope, sd))
}

/// Radius of the contact, `a = scale F^power`, from the radii by the pressure's moments.
fn growth(frames: &[Pressed]) -> (f64, f64) {
    // a radius is read to a part of a millimetre, its logarithm the better the larger it is
    let weight = |frame: &Pressed| (frame.radius_mm / RADIUS_SD_MM).powi(2);
    let all: f64 = frames.iter().map(weight).sum();
    let mean = |of: &dyn Fn(&Pressed) -> f64| frames.iter().map(|f| weight(f) * of(f)).sum::<f64>() / all;
    let (force, radius) = (mean(&|f| f.force_n.ln()), mean(&|f| f.radius_mm.ln()));
    let [usual, sd] = USUAL_POWER;
    let known = 1.0 / (sd * sd);
    let along = all * mean(&|f| (f.force_n.ln() - force) * (f.radius_mm.ln() - radius));
    let square = all * mean(&|f| (f.force_n.ln() - force).powi(2));
    let [low, high] = POWERS;
    let power = ((along + known * usual) / (square + known)).clamp(low, high);
    ((radius - power * force).exp() * (0.6 * (1.0 + 2.0 * power)).sqrt(), power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bases_hold_back_what_scikit_fem_says() {
        let table: serde_json::Value =
            serde_json::from_str(include_str!("../../tests/cases/golden_held.json")).unwrap();
        let of =
            |line: &serde_json::Value| (line["center_z"].as_f64().unwrap(), line["held"].as_f64().unwrap());
        let lines: Vec<(f64, f64)> = table["held"].as_array().unwrap().iter().map(of).collect();
        assert_eq!(lines.len(), 14);
        for (center_z, by_elements) in lines {
            let off = held(center_z) - by_elements;
            // a tenth of F / (E* R) is 2 % of what a touch of a tenth of the radius yields
            assert!(off.abs() < 0.02 + 0.02 * by_elements.abs(), "{center_z}: {off}");
        }
    }
}
