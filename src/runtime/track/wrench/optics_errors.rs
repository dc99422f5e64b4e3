//! What camera, layers and white markers that are not quite as the constants say do to the pose.
//!
//! A number that is off by `e` moves the markers' images by `P e`, and the pose that fits them by
//! `(J^T J)^-1 J^T P e`, `J` their motion with the platform. A camera that stands elsewhere is a platform that moved the
//! other way. All of it stays the same from frame to frame, as far as the platform does.

use glam::DVec3;
use nalgebra::{DMatrix, Matrix2x6, Matrix6, Vector2, Vector6};

use crate::constants::{CalibrationPriors, Constants, body_numbers, shift_body, shift_lens};
use crate::track::error::TrackError;
use crate::track::pose::MarkerSighting;
use domecast_optics::numeric::{Rigid, symmetric_eigen};
use domecast_optics::{OpticsSpec, PixelMotion, SensorOptics};

/// A number is stepped by this part of its deviation: curvature and rounding are far below.
const STEP_PART: f64 = 0.05;
/// Camera position and rotation: they need no steps.
const CAMERA_NUMBERS: usize = 6;

/// The sensor with one number a step off.
#[derive(Debug, Clone)]
struct Shifted {
    number: usize,
    step: f64,
    optics: SensorOptics,
}

/// Errors of the pose by the numbers that the optics are made of.
#[derive(Debug, Clone)]
pub(super) struct OpticsErrors {
    /// From independent numbers of deviation one to the numbers themselves.
    root: DMatrix<f64>,
    shifted: Vec<Shifted>,
    /// Numbers of the white markers' places begin here; the markers in their order.
    first_marker: usize,
    markers: Vec<u32>,
    by_number: Vec<Vector6<f64>>,
    columns: Vec<Vector6<f64>>,
}

impl OpticsErrors {
    /// By the calibration's covariance, or by the tolerances; `None` where the constants state neither.
    ///
    /// # Errors
    /// [`TrackError`] for a covariance of another size, or one that is none.
    pub fn new(constants: &Constants, rest: &SensorOptics) -> Result<Option<Self>, TrackError> {
        let spec = rest.spec();
        let Some(covariance) = covariance_of(constants, &spec)? else { return Ok(None) };
        let count = covariance.nrows();
        let root = root_of(&covariance).ok_or_else(|| {
            TrackError::at("optics_uncertainty.covariance", "is not finite or not positive definite")
        })?;
        let first_marker = count - 2 * constants.white_markers.len();
        let mut shifted = Vec::new();
        for number in CAMERA_NUMBERS..first_marker {
            let step = STEP_PART * covariance[(number, number)].max(0.0).sqrt();
            if step <= 0.0 {
                continue;
            }
            // A step that makes no sensor (an index below one) is no step.
            if let Ok(optics) = rest.rebuilt(&stepped(&spec, number, step)) {
                shifted.push(Shifted { number, step, optics });
            }
        }
        Ok(Some(Self {
            columns: vec![Vector6::zeros(); root.ncols()],
            root,
            shifted,
            first_marker,
            markers: constants.white_markers.iter().map(|m| m.id as u32).collect(),
            by_number: vec![Vector6::zeros(); count],
        }))
    }

    /// Motion (mm, rad about the rest frame's origin) of the pose by each independent number of deviation one; `optics`
    /// stand at the pose; `None` where a marker cannot be seen, or three do not determine the pose.
    pub fn at_pose(
        &mut self,
        optics: &SensorOptics,
        pose: &Rigid,
        seen: &[MarkerSighting],
    ) -> Option<&[Vector6<f64>]> {
        let mut normal = Matrix6::zeros();
        for one in seen.iter().filter(|one| one.pull.is_none()) {
            let by_pose = optics.project_with_motion(one.marker.position_mm).ok()?.by_pose;
            normal += by_pose.transpose() * by_pose;
        }
        let inverse = normal.cholesky().map(|normal| normal.inverse());
        self.by_number.fill(Vector6::zeros());
        let camera = optics.rest_from_camera();
        // The optics' own camera stands still: the constants' at rest.
        for axis in 0..3 {
            let turn = camera.rotation.col(axis);
            self.by_number[axis][axis] = -1.0;
            self.by_number[3 + axis] = -joined(camera.translation_mm.cross(turn), turn);
        }
        for shifted in &mut self.shifted {
            shifted.optics.move_to(pose).ok()?;
        }
        for one in seen {
            let at = one.marker.position_mm;
            let PixelMotion { pixel, by_pose, by_point } = optics.project_with_motion(at).ok()?;
            let pull: Matrix2x6<f64> = match one.pull {
                Some(pull) => pull.transpose(),
                None => by_pose * inverse?,
            };
            for Shifted { number, step, optics } in &self.shifted {
                let moved = (optics.project(at).ok()? - pixel) / *step;
                self.by_number[*number] += pull.transpose() * Vector2::new(moved.x, moved.y);
            }
            if one.is_dot {
                // What its own place is off by is in the covariance of the picture.
                continue;
            }
            let index = self.markers.iter().position(|id| *id == one.marker.id)?;
            for axis in 0..2 {
                let number = self.first_marker + 2 * index + axis;
                self.by_number[number] += pull.transpose() * by_point.column(axis);
            }
        }
        for (column, to) in self.columns.iter_mut().enumerate() {
            *to = Vector6::zeros();
            for (number, motion) in self.by_number.iter().enumerate() {
                *to += motion * self.root[(number, column)];
            }
        }
        self.columns.iter().all(|c| c.iter().all(|v| v.is_finite())).then_some(self.columns.as_slice())
    }
}

fn joined(v: DVec3, w: DVec3) -> Vector6<f64> {
    Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

/// The nominal sensor with one number off.
fn stepped(spec: &OpticsSpec, number: usize, step: f64) -> OpticsSpec {
    let (body, lens) = (body_numbers(spec), 4 + spec.lens.distortion.len());
    let mut made = spec.clone();
    let mut steps = vec![0.0; body + lens];
    if let Some(to) = steps.get_mut(number) {
        *to = step;
    }
    shift_body(&mut made, &steps[..body]);
    shift_lens(&mut made.lens, &steps[body..]);
    made
}

/// Covariance of all numbers, the camera's drift since the calibration on top.
fn covariance_of(constants: &Constants, spec: &OpticsSpec) -> Result<Option<DMatrix<f64>>, TrackError> {
    let (body, markers) = (body_numbers(spec), constants.white_markers.len());
    let own = constants.camera.intrinsics_covariance.len();
    if own != 0 && own != 4 + constants.camera.distortion.len() {
        return Err(TrackError::at(
            "camera.intrinsics_covariance",
            "is not of fx, fy, cx, cy and the distortion",
        ));
    }
    let count = body + own + 2 * markers;
    if let Some(open) = &constants.optics_uncertainty {
        let rows = &open.covariance;
        if rows.len() != count || rows.iter().any(|row| row.len() != count) {
            let problem = format!("is not {count} x {count}, as these layers, markers and intrinsics need");
            return Err(TrackError::at("optics_uncertainty.covariance", problem));
        }
        let mut covariance = DMatrix::from_fn(count, count, |i, j| rows[i][j]);
        if let Some(t) = &constants.tolerances {
            for axis in 0..3 {
                covariance[(axis, axis)] += t.camera_drift_mm.powi(2);
                covariance[(3 + axis, 3 + axis)] += t.camera_drift_rad.powi(2);
            }
        }
        return Ok(Some(covariance));
    }
    let Some(tolerances) = &constants.tolerances else { return Ok(None) };
    let mut covariance = DMatrix::zeros(count, count);
    for (number, sd) in nominal_deviations(tolerances, body, own, markers).into_iter().enumerate() {
        covariance[(number, number)] = sd * sd;
    }
    for (i, row) in constants.camera.intrinsics_covariance.iter().enumerate() {
        if row.len() != own {
            return Err(TrackError::at("camera.intrinsics_covariance", "is not square"));
        }
        for (j, value) in row.iter().enumerate() {
            covariance[(body + i, body + j)] = *value;
        }
    }
    Ok(Some(covariance))
}

fn nominal_deviations(t: &CalibrationPriors, body: usize, own: usize, markers: usize) -> Vec<f64> {
    let flat = (body - CAMERA_NUMBERS - 1) / 2;
    let mut sds = Vec::with_capacity(body + own + 2 * markers);
    sds.extend(t.pupil_mm);
    sds.extend(t.camera_rotation_rad);
    sds.extend(std::iter::repeat_n(t.layer_thickness_mm, flat));
    sds.extend(std::iter::repeat_n(t.index, flat + 1));
    sds.extend(std::iter::repeat_n(0.0, own));
    sds.extend(std::iter::repeat_n(t.white_marker_mm, 2 * markers));
    sds
}

/// A root of a covariance, in columns, those of no size left out; `None` where it is none.
pub(super) fn root_of(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let count = covariance.nrows();
    let sd: Vec<f64> = (0..count).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect();
    if covariance.iter().any(|v| !(v.is_finite() && v.abs() < 1e12)) {
        return None;
    }
    // In units of each number's own deviation, so that lengths and angles are alike.
    let unit = |i: usize, j: usize| {
        let size = sd[i] * sd[j];
        if size > 0.0 { 0.5 * (covariance[(i, j)] + covariance[(j, i)]) / size } else { 0.0 }
    };
    let eigen = symmetric_eigen(DMatrix::from_fn(count, count, unit))?;
    if eigen.eigenvalues.iter().any(|v| *v < -1e-6) {
        return None;
    }
    let kept: Vec<usize> = (0..count).filter(|k| eigen.eigenvalues[*k] > 1e-12).collect();
    Some(DMatrix::from_fn(count, kept.len(), |i, k| {
        sd[i] * eigen.eigenvectors[(i, kept[k])] * eigen.eigenvalues[kept[k]].sqrt()
    }))
}
