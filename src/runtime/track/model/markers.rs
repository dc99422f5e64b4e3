//! The white markers of the constants, made ready to be looked for.

use glam::{DVec2, DVec3};

use crate::constants::Constants;
use crate::track::error::TrackError;
use crate::track::marks::{MAX_HALF_PX, MarkerView};
use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;
use domecast_springs::Displacement;

/// Rms of the pose's residuals as many times what the constants' own tolerances mean is another sensor's.
const FOREIGN_FACTOR: f64 = 3.0;
/// Smaller residuals (px) raise no doubt: light and lens do as much to a marker's edge.
const MIN_FOREIGN_RMS_PX: f64 = 0.15;
/// Noise of a centroid where the constants do not give it, px.
const CENTROID_PX: f64 = 0.1;
/// What noise adds to a marker's reach, px.
const MARGIN_PX: f64 = 6.0;

/// The white markers, where they are at rest, and how far from there they can be.
#[derive(Debug, Clone)]
pub(in crate::track) struct MarkerModels {
    /// In the order of the constants.
    pub all: Vec<Marker>,
    /// Where each one's centroid is at rest, px.
    pub rest_px: Vec<DVec2>,
    /// How far from there it can be, px.
    pub reach_px: Vec<f64>,
    /// Rms of the pose's residuals above which the constants are not those of the camera, px.
    pub foreign_rms_px: f64,
}

impl MarkerModels {
    /// From the constants; `at_mm`: the point that the platform turns about, `max_press_mm`: how deep it goes.
    pub fn new(
        constants: &Constants,
        optics: &SensorOptics,
        at_mm: DVec3,
        max_press_mm: f64,
    ) -> Result<Self, TrackError> {
        let all = constants.markers();
        let (rest_px, reach_px) = reach_of(optics, &all, at_mm, max_press_mm)?;
        let foreign_rms_px = foreign_rms_of(constants, optics, &all);
        Ok(Self { all, rest_px, reach_px, foreign_rms_px })
    }
}

/// How far residuals may be by what the constants say of themselves: nominal markers are off by their tolerance, measured
/// ones by the noise of a centroid only.
fn foreign_rms_of(constants: &Constants, optics: &SensorOptics, markers: &[Marker]) -> f64 {
    let is_measured = constants.calibrations.iter().any(|c| c["kind"] == "optics");
    let usable = |v: f64| if v.is_finite() { v.clamp(0.0, 1e3) } else { 0.0 };
    let (mut centroid_px, mut marker_mm) = (CENTROID_PX, 0.0);
    if let Some(tolerances) = &constants.tolerances {
        centroid_px = usable(tolerances.white_centroid_px);
        marker_mm = if is_measured { 0.0 } else { usable(tolerances.white_marker_mm) };
    }
    let px_by_mm = markers.iter().filter_map(|marker| {
        let by_point = optics.project_with_motion(marker.position_mm).ok()?.by_point;
        Some((0.5 * by_point.columns(0, 2).norm_squared()).sqrt())
    });
    let sd_px = centroid_px.hypot(marker_mm * px_by_mm.fold(0.0, f64::max));
    // Of 2 n residuals the pose takes six.
    let n = 2.0 * markers.len() as f64;
    (FOREIGN_FACTOR * sd_px * ((n - 6.0).max(1.0) / n).sqrt()).max(MIN_FOREIGN_RMS_PX)
}

/// Where the markers are at rest, and how far from there the platform's reach takes them: pressed to the end of the
/// springs' table, shifted by 1.5 mm, tilted by 8 degrees, twisted by 12.
fn reach_of(
    optics: &SensorOptics,
    markers: &[Marker],
    at_mm: DVec3,
    max_press_mm: f64,
) -> Result<(Vec<DVec2>, Vec<f64>), TrackError> {
    let mut places = Vec::with_capacity(markers.len());
    for (index, marker) in markers.iter().enumerate() {
        match marker.image(optics) {
            Ok(image) => {
                if MarkerView::new(optics, marker).is_none() {
                    let problem = format!("makes an image wider than {} px", 2 * MAX_HALF_PX);
                    return Err(TrackError::at(format!("white_markers[{index}].diameter_mm"), problem));
                }
                places.push(image.centroid_px);
            }
            Err(limit) => {
                return Err(TrackError::at(
                    format!("white_markers[{index}]"),
                    format!("is not seen at rest ({limit})"),
                ));
            }
        }
    }
    let mut reach = vec![0.0_f64; markers.len()];
    let mut moved = optics.clone();
    for down in [-1.0, 0.0, max_press_mm] {
        for turn in 0..8 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_4).sin_cos();
            for (shift, tilt, twist) in
                [(1.5, 0.0, 0.2), (0.0, 0.14, -0.2), (0.0, 0.0, 0.2), (1.0, 0.1, -0.2)]
            {
                let displacement = Displacement {
                    translation_mm: DVec3::new(shift * cos, shift * sin, -down),
                    rotation_rad: DVec3::new(-tilt * sin, tilt * cos, twist),
                };
                let pose = displacement.to_pose(at_mm);
                if moved.move_to(&pose).is_err() {
                    continue;
                }
                for ((marker, rest), reach) in markers.iter().zip(&places).zip(&mut reach) {
                    if let Ok(image) = marker.image(&moved) {
                        *reach = reach.max(image.centroid_px.distance(*rest));
                    }
                }
            }
        }
    }
    for (index, reach) in reach.iter_mut().enumerate() {
        let others = places.iter().enumerate().filter(|(other, _)| *other != index);
        let nearest = others.map(|(_, p)| p.distance(places[index])).fold(f64::INFINITY, f64::min);
        // Beyond half way a marker could be taken for another one.
        *reach = (*reach + MARGIN_PX).min(0.48 * nearest);
    }
    Ok((places, reach))
}
