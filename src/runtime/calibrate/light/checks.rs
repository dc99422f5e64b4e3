//! Whether frames can be presses of a ball into this sensor, before anything is fitted to them.

use glam::DVec3;

use super::observed::SeenPress;
use super::types::{LightFitError, place_deg};
use crate::constants::{CalibrationPriors, Constants};
use crate::shape::SeenCell;
use crate::track::{MarkState, Tracked};
use domecast_optics::SensorOptics;

/// Presses that a fit needs, and how many it takes.
pub(super) const MIN_PRESSES: usize = 5;
const MAX_PRESSES: usize = 64;
/// Radii of balls, mm.
const RADII_MM: [f64; 2] = [0.5, 50.0];
/// Part of the dome's cells that may be cut off at full scale.
const MAX_SATURATED: f64 = 0.1;
/// Part by which a channel's exposure may differ from that of the frame at rest, and its deviations.
const MAX_GAIN: f64 = 0.015;
const MAX_GAIN_SDS: f64 = 5.0;
/// Cells of the untouched dome that the exposure is taken from.
const MIN_UNTOUCHED: usize = 200;
/// How far presses must reach from their middle, as an angle about the dome's centre, degrees.
const MIN_SPREAD_DEG: f64 = 12.0;
/// How far from the pole it is of use to press, degrees.
const REACH_DEG: f64 = 50.0;
/// Deviations, by the tolerances, that the middle dot at rest may be off its place: a camera that is farther off can be calibrated in
/// a minute, and the light is fitted along its rays.
const MAX_CAMERA_SDS: f64 = 2.0;
/// How far dots may be off by the picture alone, px, also where the camera is calibrated.
const PICTURE_PX: f64 = 0.5;

/// Radius of the ball.
pub(super) fn radius(radius_mm: f64) -> Result<(), LightFitError> {
    let [low, high] = RADII_MM;
    if (low..=high).contains(&radius_mm) {
        return Ok(());
    }
    let problem = format!("the ball's radius is {radius_mm} mm");
    Err(LightFitError::new(problem, format!("give one from {low} to {high}")))
}

/// Number of presses and radius of the ball.
pub(super) fn input(presses: usize, radius_mm: f64) -> Result<(), LightFitError> {
    radius(radius_mm)?;
    if !(MIN_PRESSES..=MAX_PRESSES).contains(&presses) {
        let cure = format!(
            "give {MIN_PRESSES} to {MAX_PRESSES}: one at the pole, others around it 20 to {REACH_DEG:.0} degrees from it"
        );
        return Err(LightFitError::new(format!("there are {presses} frames of presses"), cure));
    }
    Ok(())
}

/// Whether marks at rest lie where the constants' own optics see them.
pub(super) fn marks_at_rest(
    constants: &Constants,
    optics: &SensorOptics,
    tracked: &Tracked,
) -> Result<(), LightFitError> {
    let status = tracked.status();
    if matches!(status, "turned" | "mirrored") {
        let cure = "give frames as the constants' camera takes them, or calibrate the optics first";
        return Err(LightFitError::in_frame(0, format!("is {status}"), cure));
    }
    let focal_px = constants.camera.matrix[0][0].abs();
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |max, v| max.max(*v));
    // Each of these is off by itself: in quadrature.
    let by_tolerances_px = |open: CalibrationPriors| {
        let [x, y, z, from_mm] = constants.camera.camera_from_sensor[2];
        let depths = constants
            .black_dots
            .iter()
            .map(|dot| DVec3::new(x, y, z).dot(DVec3::from_array(dot.surface_mm)) + from_mm);
        let away_mm = (depths.sum::<f64>() / constants.black_dots.len().max(1) as f64).abs().max(1.0);
        let place_mm = open.black_dot_mm.hypot(largest(&open.pupil_mm));
        (focal_px * place_mm / away_mm).hypot(focal_px * largest(&open.camera_rotation_rad))
    };
    let is_calibrated = constants.calibrations.iter().any(|made| made["kind"] == "optics");
    let camera_px = constants.tolerances.filter(|_| !is_calibrated).map_or(0.0, by_tolerances_px);
    let sd_px = camera_px.hypot(PICTURE_PX);
    let dots = tracked.black_dots.iter().zip(&constants.black_dots);
    let found = dots.filter(|(dot, _)| dot.state == MarkState::Ok);
    let off = |(dot, at): (&crate::track::DotResult, &crate::constants::BlackDot)| {
        Some(dot.image_px?.distance(optics.project(DVec3::from_array(at.surface_mm)).ok()?))
    };
    let mut off: Vec<f64> = found.filter_map(off).collect();
    off.sort_by(f64::total_cmp);
    let count = constants.black_dots.len();
    let cure = "run `domecast calibrate-optics` on frames of the camera as it stands now, and give the constants it writes";
    if 2 * off.len() < count {
        let problem = format!(
            "shows {} of {count} dots where these constants have them ({status}): the camera has moved, or this is another sensor",
            off.len()
        );
        return Err(LightFitError::in_frame(0, problem, cure));
    }
    match off.get(off.len() / 2) {
        Some(median) if *median > MAX_CAMERA_SDS * sd_px => {
            let problem = format!(
                "has its dots {median:.1} px from where these constants have them, {sd_px:.1} px is what they know of that: the \
                 camera has moved, or was never calibrated"
            );
            Err(LightFitError::in_frame(0, problem, cure))
        }
        _ => Ok(()),
    }
}

/// Whether enough of a frame is below full scale.
pub(super) fn saturation(frame: usize, cells: &[SeenCell]) -> Result<(), LightFitError> {
    let part = cells.iter().filter(|cell| !cell.is_known).count() as f64 / cells.len().max(1) as f64;
    if part > MAX_SATURATED {
        let problem = format!("is cut off at full scale on {:.0} % of the dome", 100.0 * part);
        return Err(LightFitError::in_frame(frame, problem, "take all frames at a lower exposure"));
    }
    Ok(())
}

/// Exposure of each channel against the frame at rest, by the untouched part of the dome: medians of the levels' ratios.
pub(super) fn exposure(frame: usize, untouched: &[&SeenCell], stray: f64) -> Result<[f64; 3], LightFitError> {
    let brightest = untouched.iter().map(|cell| cell.at_rest).fold(DVec3::ZERO, DVec3::max);
    let mut gain = [1.0; 3];
    let mut worst = (0.0_f64, 0.0);
    for c in 0..3 {
        let lit = untouched.iter().filter(|cell| cell.is_known && cell.at_rest[c] > 0.2 * brightest[c]);
        let mut ratios: Vec<f64> = lit.map(|cell| (cell.level[c] - stray) / cell.at_rest[c]).collect();
        if ratios.len() < MIN_UNTOUCHED {
            let problem =
                format!("shows {} places of the untouched dome, {MIN_UNTOUCHED} are needed", ratios.len());
            return Err(LightFitError::in_frame(
                frame,
                problem,
                "touch the dome with the ball alone, less deep",
            ));
        }
        ratios.sort_by(f64::total_cmp);
        let at = |part: f64| ratios[((ratios.len() - 1) as f64 * part) as usize];
        gain[c] = at(0.5);
        // The median's deviation is 1.25 times the mean's.
        let sd = 1.25 * 0.741 * (at(0.75) - at(0.25)) / (ratios.len() as f64).sqrt();
        if (gain[c] - 1.0).abs() > worst.0 {
            worst = ((gain[c] - 1.0).abs(), sd);
        }
    }
    if worst.0 > MAX_GAIN.max(MAX_GAIN_SDS * worst.1) {
        let [low, high] = [f64::min, f64::max].map(|of| gain.into_iter().fold(gain[0], of));
        let is_alike = high - low < 0.3 * worst.0;
        let what = if is_alike { "exposure (or gain)" } else { "white balance" };
        let problem = format!(
            "has its untouched part {:.3}, {:.3}, {:.3} times as bright in red, green and blue as the frame at rest: automatic \
             {what} was left on, or the lights have changed",
            gain[0], gain[1], gain[2]
        );
        let cure = "fix exposure, gain and white balance, let the lights warm up, and take all frames again, the one at rest too";
        return Err(LightFitError::in_frame(frame, problem, cure));
    }
    Ok(gain)
}

/// How far directions reach across their middle, along every direction: presses on one line say nothing across it. Degrees.
fn reach_deg(ways: &[DVec3]) -> f64 {
    let middle = ways.iter().sum::<DVec3>().normalize_or(DVec3::Z);
    let (x, y) = middle.any_orthonormal_pair();
    let reach = |k: u32| {
        let across = x * (f64::from(k) * 0.1).cos() + y * (f64::from(k) * 0.1).sin();
        let squares: f64 = ways.iter().map(|way| way.dot(across).asin().powi(2)).sum();
        (squares / ways.len().max(1) as f64).sqrt()
    };
    (0..32).map(reach).fold(f64::INFINITY, f64::min).to_degrees()
}

/// Whether presses lie far enough from each other; else where to press next.
pub(super) fn spread(
    presses: &[SeenPress],
    dome_center_mm: DVec3,
    rim_deg: f64,
) -> Result<(), LightFitError> {
    let ways: Vec<DVec3> =
        presses.iter().map(|press| (press.center_mm - dome_center_mm).normalize_or(DVec3::Z)).collect();
    let reach_deg = reach_deg(&ways);
    if reach_deg >= MIN_SPREAD_DEG {
        return Ok(());
    }
    let [polar, azimuth] = farthest(&ways, press_reach_deg(rim_deg));
    let problem = format!(
        "the presses are too similar: they reach {reach_deg:.0} degrees across the dome, {MIN_SPREAD_DEG:.0} are needed"
    );
    let cure = format!("press also at {polar:.0} degrees from the pole, azimuth {azimuth:.0}");
    Err(LightFitError::new(problem, cure))
}

fn press_reach_deg(rim_deg: f64) -> f64 {
    REACH_DEG.min(0.8 * rim_deg)
}

/// Where to press next, degrees from the pole and about the axis: at the pole first; `None` where the places are enough.
pub(super) fn next_place(taken: &[[f64; 2]], rim_deg: f64) -> Option<[f64; 2]> {
    let way = |[polar, azimuth]: &[f64; 2]| {
        let (polar, azimuth) = (polar.to_radians(), azimuth.to_radians());
        DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
    };
    let ways: Vec<DVec3> = taken.iter().map(way).collect();
    if ways.is_empty() {
        return Some([0.0, 0.0]);
    }
    let is_enough = ways.len() >= MIN_PRESSES && reach_deg(&ways) >= MIN_SPREAD_DEG;
    (!is_enough).then(|| farthest(&ways, press_reach_deg(rim_deg)))
}

/// The place that is farthest from all presses, degrees from the pole and about the axis.
pub(super) fn farthest(ways: &[DVec3], reach_deg: f64) -> [f64; 2] {
    let mut best = (f64::INFINITY, DVec3::Z);
    for ring in 0..=5 {
        for turn in 0..24 {
            let (polar, azimuth) =
                ((reach_deg * f64::from(ring) / 5.0).to_radians(), (15.0 * f64::from(turn)).to_radians());
            let way = DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
            let nearest = ways.iter().map(|other| other.dot(way)).fold(-1.0, f64::max);
            if nearest < best.0 {
                best = (nearest, way);
            }
        }
    }
    place_deg(best.1)
}
