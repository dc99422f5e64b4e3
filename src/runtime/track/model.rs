//! What the constants say, made ready to be looked for.

use glam::{DVec2, DVec3};

use super::error::TrackError;
use super::frame::MOST_PIXELS;
use super::image::spot::{MOST_RADIUS_PX, Shape};
use super::mask::Mask;
use super::springs::Springs;
use crate::constants::{BlackDot, Constants};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{Marker, PoseOptions, PoseSolver, outline_centroid_offset};
use domecast_springs::Displacement;

/// Dots that constants may have.
pub const MOST_DOTS: usize = 20_000;
/// Residuals of the pose as many times what the constants' own tolerances mean are another sensor's.
const FOREIGN: f64 = 3.0;
/// Residuals (px) that nothing is said of: what light and lens do to a marker's edge.
const ANYONES_RMS_PX: f64 = 0.15;
/// Noise of a centroid where the constants say nothing of it, px.
const CENTROID_PX: f64 = 0.1;
/// Two poses both fit where they do so within this rms, px.
const AMBIGUOUS_RMS_PX: f64 = 1.0;
/// Farthest that the platform can be from rest where the constants do not say, mm.
const MOST_SHIFT_MM: f64 = 5.0;

/// A dot of the constants.
#[derive(Debug, Clone)]
pub(super) struct DotModel {
    pub id: u32,
    /// Its centre on the undeformed dome, sensor frame, mm.
    pub surface_mm: DVec3,
    /// Half of its diameter, mm.
    radius_mm: f64,
    /// Its image at rest.
    pub shape: Shape,
    /// Numbers of its neighbours in the list of dots.
    pub neighbors: Vec<usize>,
    /// Distance to the nearest neighbour in the image at rest, px.
    pub spacing_px: f64,
}

/// The sensor that is looked for.
#[derive(Debug, Clone)]
pub(super) struct SensorModel {
    pub optics: SensorOptics,
    pub dots: Vec<DotModel>,
    pub markers: Vec<Marker>,
    /// Where each marker's centroid is at rest, px.
    pub markers_px: Vec<DVec2>,
    /// How far from there it can be, px.
    pub markers_reach_px: Vec<f64>,
    /// Farthest that the platform can be pressed, mm.
    pub deepest_mm: f64,
    pub solver: PoseSolver,
    /// Rms of the markers' residuals above which the constants are not those of the camera, px.
    pub foreign_rms_px: f64,
    pub mask: Mask,
    pub springs: Option<Springs>,
}

/// Area, largest radius and spread of an outline of eight points about its centroid.
fn shape_of(center: DVec2, outline: &[DVec2; 8]) -> Shape {
    let (mut area, mut spread, mut radius) = (0.0, 0.0, 0.0_f64);
    for (i, p) in outline.iter().enumerate() {
        let (a, b) = (*p - center, outline[(i + 1) % 8] - center);
        let swept = 0.5 * a.perp_dot(b);
        area += swept;
        // Second moment of the triangle (0, a, b) about its corner: area (a.a + a.b + b.b) / 6.
        spread += swept * (a.dot(a) + a.dot(b) + b.dot(b)) / 6.0;
        radius = radius.max(a.length());
    }
    // An octagon in a circle has 0.9003 of its area and 0.854 of its mean square distance.
    let octagon = 0.900_316;
    let (area_px, spread_px2) = (area.abs() / octagon, (spread / area).abs() / 0.853_6);
    Shape { radius_px: radius, area_px, spread_px2 }
}

impl DotModel {
    /// Centroid of its image less the image of its centre, at the pose of the optics; with its outline's shape.
    pub fn look(&self, optics: &SensorOptics, center_px: DVec2) -> Option<(DVec2, Shape)> {
        let at = self.surface_mm;
        let east = DVec3::new(-at.y, at.x, 0.0).try_normalize().unwrap_or(DVec3::X);
        let north = at.cross(east).normalize_or_zero();
        let radius = optics.dome_radius_mm();
        let mut outline = [DVec2::ZERO; 8];
        let mut next = 0;
        let offset = outline_centroid_offset(center_px, |cos, sin| {
            let there = at + (east * cos + north * sin) * self.radius_mm;
            let pixel = optics.project(there * (radius / there.length())).ok()?;
            outline[next] = pixel;
            next += 1;
            Some(pixel)
        })?;
        Some((offset, shape_of(center_px + offset, &outline)))
    }
}

impl SensorModel {
    pub fn new(constants: &Constants, most_residual_px: f64) -> Result<Self, TrackError> {
        let camera = &constants.camera;
        let pixels = (camera.width as usize).checked_mul(camera.height as usize);
        if pixels.is_none_or(|n| n == 0 || n > MOST_PIXELS) {
            let problem = format!("{} x {} is no frame", camera.width, camera.height);
            return Err(TrackError::at("camera.width", problem));
        }
        let fault = |problem: String| TrackError::at("camera, optics:", problem);
        let optics = constants.sensor().map_err(fault)?;
        let mask = &constants.mask;
        let matrix = camera.undistorted_matrix.as_flattened();
        if !(mask.center_px.iter().chain(matrix).all(|v| v.is_finite()) && mask.radius_px > 0.0) {
            return Err(TrackError::at("mask", "is no circle in the undistorted frame"));
        }
        let springs = constants.springs.as_ref().map(Springs::new).transpose()?;
        let deepest =
            constants.springs.as_ref().and_then(|s| s.stiffness_at.last()).map(|e| e.compression_mm);
        let most_shift_mm = deepest.map_or(MOST_SHIFT_MM, |d| d.clamp(0.5, 100.0) + 2.0);
        let markers = constants.markers();
        // Eight residuals less six of the pose: the solver's gate lets 1.84 times its noise pass as rms.
        let options = PoseOptions::new(most_residual_px.min(AMBIGUOUS_RMS_PX) / 1.84, most_shift_mm);
        let solver = PoseSolver::new(&optics, &markers, options)
            .map_err(|error| TrackError::at("white_markers", format!("are not usable: {error}")))?;
        let dots = dots_of(constants, &optics)?;
        let at_mm = springs.as_ref().map_or(DVec3::ZERO, Springs::at_mm);
        let deepest_mm = deepest.unwrap_or(3.0).clamp(0.0, 100.0);
        let (markers_px, markers_reach_px) = reach_of(&optics, &markers, at_mm, deepest_mm)?;
        let mask = Mask::new(optics.lens(), camera, mask);
        let foreign_rms_px = foreign_rms_of(constants, &optics, &markers);
        Ok(Self {
            optics,
            dots,
            markers,
            markers_px,
            markers_reach_px,
            deepest_mm,
            solver,
            foreign_rms_px,
            mask,
            springs,
        })
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
    (FOREIGN * sd_px * ((n - 6.0).max(1.0) / n).sqrt()).max(ANYONES_RMS_PX)
}

fn dots_of(constants: &Constants, optics: &SensorOptics) -> Result<Vec<DotModel>, TrackError> {
    let given = &constants.black_dots;
    let fault = |index: usize, part: &str, problem: String| {
        Err(TrackError::at(format!("black_dots[{index}]{part}"), problem))
    };
    if given.len() > MOST_DOTS {
        return Err(TrackError::at("black_dots", format!("are more than {MOST_DOTS}")));
    }
    let mut by_id: Vec<(usize, usize)> = given.iter().enumerate().map(|(i, d)| (d.id, i)).collect();
    by_id.sort_unstable();
    let mut dots: Vec<DotModel> = Vec::with_capacity(given.len());
    for (index, dot) in given.iter().enumerate() {
        let surface_mm = DVec3::from_array(dot.surface_mm);
        let radius_mm = 0.5 * dot.diameter_mm;
        if by_id.windows(2).any(|w| w[0].0 == w[1].0 && w[0].0 == dot.id) || dot.id > u32::MAX as usize {
            return fault(index, ".id", format!("{} is taken, or too large", dot.id));
        }
        if !(radius_mm > 0.0 && radius_mm < optics.dome_radius_mm()) {
            return fault(index, ".diameter_mm", format!("{} is no dot's", dot.diameter_mm));
        }
        let Ok(center_px) = optics.project(surface_mm) else {
            return fault(index, ".surface_mm", "is not seen at rest through these lens and layers".into());
        };
        let mut model = DotModel {
            id: dot.id as u32,
            surface_mm,
            radius_mm,
            shape: Shape::default(),
            neighbors: neighbors_of(dot, index, &by_id)?,
            spacing_px: f64::INFINITY,
        };
        match model.look(optics, center_px) {
            Some((_, shape)) if shape.radius_px > 0.0 && shape.radius_px <= MOST_RADIUS_PX => {
                model.shape = shape
            }
            _ => {
                let problem =
                    format!("makes an image that is not seen whole or wider than {MOST_RADIUS_PX} px");
                return fault(index, ".diameter_mm", problem);
            }
        }
        dots.push(model);
    }
    let places: Vec<DVec2> =
        dots.iter().map(|d| optics.project(d.surface_mm).unwrap_or(DVec2::ZERO)).collect();
    for index in 0..dots.len() {
        let near = dots[index].neighbors.iter().map(|n| places[*n].distance(places[index]));
        let nearest = near.fold(f64::INFINITY, f64::min);
        // A dot alone may be looked for as far as a few of its radii.
        let alone = 6.0 * dots[index].shape.radius_px;
        dots[index].spacing_px = if nearest.is_finite() { nearest.max(1.0) } else { alone };
    }
    Ok(dots)
}

fn neighbors_of(dot: &BlackDot, index: usize, by_id: &[(usize, usize)]) -> Result<Vec<usize>, TrackError> {
    let find = |id: &usize| by_id.binary_search_by_key(id, |(id, _)| *id).ok().map(|at| by_id[at].1);
    let mut found = Vec::with_capacity(dot.neighbors.len());
    for id in &dot.neighbors {
        match find(id) {
            Some(other) if other != index => found.push(other),
            _ => {
                let field = format!("black_dots[{index}].neighbors");
                return Err(TrackError::at(field, format!("names dot {id}, which is not another dot")));
            }
        }
    }
    Ok(found)
}

/// Where the markers are at rest, and how far from there the platform's reach takes them: pressed to the end of the
/// springs' table, shifted by 1.5 mm, tilted by 8 degrees, twisted by 12.
fn reach_of(
    optics: &SensorOptics,
    markers: &[Marker],
    at_mm: DVec3,
    deepest_mm: f64,
) -> Result<(Vec<DVec2>, Vec<f64>), TrackError> {
    let mut places = Vec::with_capacity(markers.len());
    for (index, marker) in markers.iter().enumerate() {
        match marker.image(optics) {
            Ok(image) => places.push(image.centroid_px),
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
    for down in [-1.0, 0.0, deepest_mm] {
        for turn in 0..8 {
            let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_4).sin_cos();
            for (shift, tilt, twist) in
                [(1.5, 0.0, 0.2), (0.0, 0.14, -0.2), (0.0, 0.0, 0.2), (1.0, 0.1, -0.2)]
            {
                let displacement = Displacement {
                    translation_mm: DVec3::new(shift * cos, shift * sin, -down),
                    rotation_rad: DVec3::new(-tilt * sin, tilt * cos, twist),
                };
                let pose: Rigid = displacement.to_pose(at_mm);
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
        *reach = (*reach + 6.0).min(0.48 * nearest);
    }
    Ok((places, reach))
}
