//! Constants for the paper's plain runtime: undistort, solvePnP without distortion, wrench linear in the pose.
//!
//! A runtime that knows nothing of refraction sees each marker not where it is but where the rays that reach the
//! camera seem to come from. [`PlainFit`] finds the point that those rays, over the loads that the design claims,
//! pass nearest to (the apparent position), runs plain PnP on it, and fits the linear map A from what plain PnP says
//! to the displacement that is; the effective 6x6 is K A. What is left is reported beside what the true positions and
//! the nominal 6x6 would give, twice: against the linear law K, which is all that a 6x6 can follow, and against the
//! springs' own law, which stiffens as they shorten; there a table of K(compression) A leaves less.

use glam::DVec3;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use super::loads::PosedLoad;
use super::model::{PlainRuntime, StiffnessAt};
use super::plain_input::{PlainError, PlainInput};
use super::plain_pnp::{Frame, PlainRuntimeSolver, run, undistorted};
use super::stiffness::{matrix_of, rows, stiffness_between};
use domecast_optics::numeric::Rigid;
use domecast_springs::Displacement;

/// Errors that are left, by axis, over a set of loads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bias {
    /// Mean of the pose error (tx, ty, tz mm at the reference point; rx, ry, rz degrees), relative to rest.
    pub mean_pose: [f64; 6],
    /// Mean of its size.
    pub mean_pose_size: [f64; 6],
    /// Mean of the wrench error (N, N*mm).
    pub mean_wrench: [f64; 6],
    /// Mean of its size.
    pub mean_wrench_size: [f64; 6],
}

/// What the plain runtime gets.
#[derive(Debug, Clone, PartialEq)]
pub struct PlainFit {
    /// Where each marker appears to be, sensor frame, mm.
    pub apparent_mm: Vec<DVec3>,
    /// The pose (camera from sensor) that plain PnP on the apparent positions finds at rest.
    pub rest_pose: Rigid,
    /// From displacement relative to the rest pose to wrench.
    pub stiffness: Matrix6<f64>,
    /// The same under compression, where the input has a table.
    pub stiffness_at: Vec<StiffnessAt>,
    /// What the one 6x6 leaves over the loads, against the wrench that the given 6x6 means.
    pub left: Bias,
    /// What the true positions and the given 6x6 would leave, relative to their own rest pose, against the same.
    pub naive: Bias,
    /// What the one 6x6 leaves against the loads' own wrenches.
    pub left_of_load: Bias,
    /// What the table leaves against the loads' own wrenches.
    pub left_of_load_by_table: Bias,
    /// What the true positions and the given 6x6 would leave against the loads' own wrenches.
    pub naive_of_load: Bias,
    /// Error at rest of the absolute pose (mm, degrees) and of the wrench that an absolute pose means.
    pub naive_at_rest_pose: [f64; 6],
    /// As a wrench, N and N*mm.
    pub naive_at_rest_wrench: [f64; 6],
}

/// The point nearest to a bundle of lines (origin, unit direction), in the sense of least squares.
fn nearest_point(lines: &[(DVec3, DVec3)]) -> Option<DVec3> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (origin, direction) in lines {
        let d = Vector3::new(direction.x, direction.y, direction.z);
        let across = Matrix3::identity() - d * d.transpose();
        normal += across;
        right += across * Vector3::new(origin.x, origin.y, origin.z);
    }
    let point = normal.cholesky()?.solve(&right);
    Some(DVec3::new(point[0], point[1], point[2]))
}

impl PlainFit {
    /// Fits the constants over the loads (the first use of each marker's rays, then of the poses).
    ///
    /// # Errors
    /// [`PlainError`] for loads under which a marker is not seen, or fewer loads than the fit needs.
    pub fn over(input: &PlainInput, loads: &[PosedLoad]) -> Result<Self, PlainError> {
        let seen: Vec<Frame> =
            loads.iter().map(|load| undistorted(input, &load.pose)).collect::<Result<_, _>>()?;
        let rest = undistorted(input, &Rigid::identity())?;
        let apparent_mm = apparent(input, loads, &seen, &rest)?;
        let truth: Vec<DVec3> = input.markers.iter().map(|m| m.position_mm).collect();
        let moved: Vec<Vector6<f64>> = loads
            .iter()
            .map(|load| Vector6::from(Displacement::of_pose(&load.pose, input.at_mm).to_array()))
            .collect();
        let linear: Vec<Vector6<f64>> = moved.iter().map(|d| input.stiffness * d).collect();
        let own: Vec<Vector6<f64>> = loads.iter().map(|load| Vector6::from(load.wrench)).collect();

        let (naive_rest, naive_found) = run(input, &truth, &seen, &rest)?;
        let (rest_pose, found) = run(input, &apparent_mm, &seen, &rest)?;
        let stiffness = effective(&input.stiffness, &linear, &found)?;
        let stiffness_at = effective_table(input, &stiffness);
        let nominal = |d: &Vector6<f64>| input.stiffness * d;
        let one = |d: &Vector6<f64>| stiffness * d;
        let table = |d: &Vector6<f64>| stiffness_between(&stiffness_at, &stiffness, -d[2]) * d;

        let off = input.optics.rest_from_camera().compose(&naive_rest);
        let off = Displacement::of_pose(&off, input.at_mm).to_array();
        let naive_at_rest_wrench = (input.stiffness * Vector6::from(off)).into();
        Ok(Self {
            apparent_mm,
            rest_pose,
            left: bias(&moved, &linear, &found, one),
            naive: bias(&moved, &linear, &naive_found, nominal),
            left_of_load: bias(&moved, &own, &found, one),
            left_of_load_by_table: bias(&moved, &own, &found, table),
            naive_of_load: bias(&moved, &own, &naive_found, nominal),
            stiffness,
            stiffness_at,
            naive_at_rest_pose: in_degrees(off),
            naive_at_rest_wrench,
        })
    }
}

/// Where the markers' rays seem to come from, then moved as one so that plain PnP is right at rest.
fn apparent(
    input: &PlainInput,
    loads: &[PosedLoad],
    seen: &[Frame],
    rest: &Frame,
) -> Result<Vec<DVec3>, PlainError> {
    let rest_from_camera = input.optics.rest_from_camera();
    let line = |pose: &Rigid, ray: DVec3| {
        let platform_from_camera = pose.inverse().compose(rest_from_camera);
        (platform_from_camera.translation_mm, platform_from_camera.vector(ray))
    };
    let mut points = Vec::with_capacity(input.markers.len());
    for index in 0..input.markers.len() {
        let mut lines = vec![line(&Rigid::identity(), rest.rays[index])];
        lines.extend(loads.iter().zip(seen).map(|(load, frame)| line(&load.pose, frame.rays[index])));
        points.push(nearest_point(&lines).ok_or(PlainError::Undetermined)?);
    }
    settle_at_rest(input, &mut points, rest)?;
    Ok(points)
}

/// Moves all positions as one so that plain PnP is right at rest.
fn settle_at_rest(input: &PlainInput, points: &mut [DVec3], rest: &Frame) -> Result<(), PlainError> {
    for _ in 0..4 {
        let found = PlainRuntimeSolver::new(input, points)?.pose(&rest.sightings)?;
        let off = input.optics.rest_from_camera().compose(&found);
        for point in points.iter_mut() {
            *point = off.point(*point);
        }
    }
    Ok(())
}

/// The 6x6 that takes the displacements to the wrenches, in the sense of least squares; where the loads leave a
/// direction open, the given 6x6 stays, and so does a row of it that is as good as the fitted one.
///
/// The departure from the given 6x6 is held back a little: a millionth of the weight of the data, enough to decide
/// what they do not.
fn effective(
    given: &Matrix6<f64>,
    wrenches: &[Vector6<f64>],
    found: &[Vector6<f64>],
) -> Result<Matrix6<f64>, PlainError> {
    let mut normal = Matrix6::zeros();
    let mut right = Matrix6::zeros();
    for (wrench, d) in wrenches.iter().zip(found) {
        normal += d * d.transpose();
        right += d * (wrench - given * d).transpose();
    }
    // The displacement axes in their own sizes, so that the hold means the same for mm and rad.
    let size = Vector6::from_fn(|i, _| normal[(i, i)].max(1e-12).sqrt());
    let mut scaled = Matrix6::from_fn(|i, j| normal[(i, j)] / (size[i] * size[j]));
    for i in 0..6 {
        scaled[(i, i)] += 1e-6;
    }
    let right = Matrix6::from_fn(|i, j| right[(i, j)] / size[i]);
    let change = scaled.cholesky().ok_or(PlainError::Undetermined)?.solve(&right);
    let change = Matrix6::from_fn(|i, j| change[(i, j)] / size[i]);
    let mut fitted = given + change.transpose();
    for row in 0..6 {
        let size_of = |matrix: &Matrix6<f64>| -> f64 {
            wrenches.iter().zip(found).map(|(w, d)| (matrix.row(row) * d - w.row(row)).x.abs()).sum()
        };
        if size_of(&fitted) > 0.99 * size_of(given) {
            fitted.set_row(row, &given.row(row));
        }
    }
    Ok(fitted)
}

/// K(compression) A with A = K^-1 times the effective 6x6: what brings the table to plain displacements. Empty where
/// K has no inverse.
fn effective_table(input: &PlainInput, effective: &Matrix6<f64>) -> Vec<StiffnessAt> {
    let Some(map) = input.stiffness.lu().solve(effective) else { return Vec::new() };
    let at = |entry: &StiffnessAt| StiffnessAt {
        compression_mm: entry.compression_mm,
        stiffness: rows(&(matrix_of(&entry.stiffness) * map)),
    };
    input.stiffness_at.iter().map(at).collect()
}

fn in_degrees(d: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| if i < 3 { d[i] } else { d[i].to_degrees() })
}

/// Mean errors of the displacements that were found, and of the wrenches that `law` makes of them.
fn bias(
    moved: &[Vector6<f64>],
    wrenches: &[Vector6<f64>],
    found: &[Vector6<f64>],
    law: impl Fn(&Vector6<f64>) -> Vector6<f64>,
) -> Bias {
    let count = found.len().max(1) as f64;
    let mut sums = [[0.0; 6]; 4];
    for ((truth, wrench), d) in moved.iter().zip(wrenches).zip(found) {
        let pose = in_degrees((d - truth).into());
        let wrench = law(d) - wrench;
        for i in 0..6 {
            for (sum, value) in sums.iter_mut().zip([pose[i], pose[i].abs(), wrench[i], wrench[i].abs()]) {
                sum[i] += value / count;
            }
        }
    }
    let [mean_pose, mean_pose_size, mean_wrench, mean_wrench_size] = sums;
    Bias { mean_pose, mean_pose_size, mean_wrench, mean_wrench_size }
}

impl PlainFit {
    /// What goes into the constants.
    pub fn constants(&self) -> PlainRuntime {
        PlainRuntime {
            stiffness: rows(&self.stiffness),
            stiffness_at: self.stiffness_at.clone(),
            rest_pose: self.rest_pose.to_rows_4x4(),
        }
    }
}
