//! Constants for the paper's plain runtime: undistort, solvePnP without distortion, wrench linear in the pose.
//!
//! A runtime that knows nothing of refraction sees each marker not where it is but where the rays that reach the
//! camera seem to come from. [`PlainFit`] finds the point that those rays, over the loads that the design claims,
//! pass nearest to (the apparent position), runs plain PnP on it, and fits the 6x6 that takes what plain PnP says
//! to the wrench. What is left is reported beside what the true positions and the nominal 6x6 would give.

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use serde::{Deserialize, Serialize};

use crate::camera::{LensSpec, Model};
use crate::mechanics::Displacement;
use crate::numeric::Rigid;
use crate::optics::{Layer, Limit, OpticsError, OpticsSpec, SensorOptics};
use crate::pose::{Marker, PoseError, PoseOptions, PoseSolver, Sighting};

/// A pose of the platform (`rest_from_platform`) and the wrench that holds it there, about the reference point
/// (N, N*mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedLoad {
    /// The pose.
    pub pose: Rigid,
    /// (Fx, Fy, Fz, Mx, My, Mz).
    pub wrench: [f64; 6],
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq)]
pub enum PlainError {
    /// A marker cannot be seen at one of the loads.
    NotVisible {
        /// The marker.
        id: u32,
        /// The limit that it is past.
        limit: Limit,
    },
    /// A load's pose puts the camera into the sheet.
    Optics(OpticsError),
    /// Plain PnP found no pose.
    Pose(PoseError),
    /// The loads do not span what is fitted.
    Undetermined,
}

impl std::fmt::Display for PlainError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotVisible { id, limit } => {
                write!(f, "white marker {id} is not seen under a claimed load ({limit})")
            }
            Self::Optics(error) => error.fmt(f),
            Self::Pose(error) => error.fmt(f),
            Self::Undetermined => write!(f, "the loads do not span what is fitted"),
        }
    }
}

impl std::error::Error for PlainError {}

/// The sensor as the plain runtime's constants are made for it.
#[derive(Debug, Clone, Copy)]
pub struct PlainInput<'a> {
    /// Lens, layers and dome at rest.
    pub optics: &'a SensorOptics,
    /// The white markers as they are.
    pub markers: &'a [Marker],
    /// Camera matrix of the undistorted frame.
    pub undistorted_matrix: [[f64; 3]; 3],
    /// Point that stiffness and moments are stated about, rest frame, mm.
    pub at_mm: DVec3,
    /// The 6x6 at rest that a geometry or a calibration gives.
    pub stiffness: Matrix6<f64>,
}

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
    /// What these constants leave over the loads.
    pub left: Bias,
    /// What the true positions and the given 6x6 would leave, relative to their own rest pose.
    pub naive: Bias,
    /// Error at rest of the absolute pose (mm, degrees) and of the wrench that an absolute pose means.
    pub naive_at_rest_pose: [f64; 6],
    /// As a wrench, N and N*mm.
    pub naive_at_rest_wrench: [f64; 6],
}

/// A plain runtime: pinhole, no layers, markers at the positions it is given.
struct Plain {
    solver: PoseSolver,
}

impl Plain {
    fn new(input: &PlainInput, positions_mm: &[DVec3]) -> Result<Self, PlainError> {
        let lens = input.optics.lens().spec();
        let spec = OpticsSpec {
            lens: LensSpec {
                model: Model::Pinhole,
                matrix: input.undistorted_matrix,
                distortion: vec![],
                pupil_shift_mm: vec![],
                // All that a plane frame can hold.
                field_of_view_rad: 179_f64.to_radians(),
                ..lens.clone()
            },
            sensor_from_camera: *input.optics.rest_from_camera(),
            layers: vec![Layer { name: "nothing".into(), index: [1.0; 3], thickness_mm: None }],
            // Nothing is above the sheet for it; apparent positions may lie there.
            dome_radius_mm: 1e3 * input.optics.dome_radius_mm(),
        };
        let optics = SensorOptics::new(&spec).map_err(PlainError::Optics)?;
        let markers: Vec<Marker> = input
            .markers
            .iter()
            .zip(positions_mm)
            .map(|(marker, position_mm)| Marker { position_mm: *position_mm, diameter_mm: 0.0, ..*marker })
            .collect();
        // The plain runtime has no gate: whatever the residual, it takes the pose.
        let options = PoseOptions { noise_px: 1e3, most_shift_mm: 1e6, most_turn_rad: 10.0 };
        Ok(Self { solver: PoseSolver::new(&optics, &markers, options).map_err(PlainError::Pose)? })
    }

    /// `camera_from_sensor` as solvePnP would say.
    fn pose(&self, sightings: &[Sighting]) -> Result<Rigid, PlainError> {
        let found = self.solver.solve(sightings).map_err(PlainError::Pose)?;
        Ok(self.solver.optics().rest_from_camera().inverse().compose(&found.pose))
    }
}

/// Centroids in the undistorted frame and the directions that they stand for, at one pose.
fn undistorted(input: &PlainInput, pose: &Rigid) -> Result<(Vec<Sighting>, Vec<DVec3>), PlainError> {
    let optics = input.optics.at_pose(pose).map_err(PlainError::Optics)?;
    let [[fx, _, cx], [_, fy, cy], _] = input.undistorted_matrix;
    let mut sightings = Vec::with_capacity(input.markers.len());
    let mut rays = Vec::with_capacity(input.markers.len());
    for marker in input.markers {
        let hidden = |limit| PlainError::NotVisible { id: marker.id, limit };
        let image = marker.image(&optics).map_err(hidden)?;
        let ray = optics.lens().unproject(image.centroid_px).map_err(|limit| hidden(limit.into()))?;
        if ray.z <= 0.0 {
            return Err(hidden(Limit::BeyondFieldOfView));
        }
        let centroid_px = DVec2::new(fx * ray.x / ray.z + cx, fy * ray.y / ray.z + cy);
        sightings.push(Sighting { id: marker.id, centroid_px });
        rays.push(ray);
    }
    Ok((sightings, rays))
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
        let seen: Vec<(Vec<Sighting>, Vec<DVec3>)> =
            loads.iter().map(|load| undistorted(input, &load.pose)).collect::<Result<_, _>>()?;
        let rest = undistorted(input, &Rigid::identity())?;
        let apparent_mm = apparent(input, loads, &seen, &rest)?;
        let truth: Vec<DVec3> = input.markers.iter().map(|m| m.position_mm).collect();
        let (naive_rest, naive_found) = run(input, &truth, &seen, &rest)?;
        let naive = bias(input, loads, &naive_found, &input.stiffness);
        let (rest_pose, found) = run(input, &apparent_mm, &seen, &rest)?;
        let stiffness = effective(input, loads, &found)?;
        let left = bias(input, loads, &found, &stiffness);
        let off = input.optics.rest_from_camera().compose(&naive_rest);
        let off = Displacement::of_pose(&off, input.at_mm).to_array();
        let naive_at_rest_wrench = (input.stiffness * Vector6::from(off)).into();
        Ok(Self {
            apparent_mm,
            rest_pose,
            stiffness,
            left,
            naive,
            naive_at_rest_pose: in_degrees(off),
            naive_at_rest_wrench,
        })
    }
}

/// Where the markers' rays seem to come from, then moved as one so that plain PnP is right at rest.
fn apparent(
    input: &PlainInput,
    loads: &[PosedLoad],
    seen: &[(Vec<Sighting>, Vec<DVec3>)],
    rest: &(Vec<Sighting>, Vec<DVec3>),
) -> Result<Vec<DVec3>, PlainError> {
    let rest_from_camera = input.optics.rest_from_camera();
    let line = |pose: &Rigid, ray: DVec3| {
        let platform_from_camera = pose.inverse().compose(rest_from_camera);
        (platform_from_camera.translation_mm, platform_from_camera.vector(ray))
    };
    let mut points = Vec::with_capacity(input.markers.len());
    for index in 0..input.markers.len() {
        let mut lines = vec![line(&Rigid::identity(), rest.1[index])];
        lines.extend(loads.iter().zip(seen).map(|(load, (_, rays))| line(&load.pose, rays[index])));
        points.push(nearest_point(&lines).ok_or(PlainError::Undetermined)?);
    }
    settle_at_rest(input, &mut points, rest)?;
    Ok(points)
}

/// Moves all positions as one so that plain PnP is right at rest.
fn settle_at_rest(
    input: &PlainInput,
    points: &mut [DVec3],
    rest: &(Vec<Sighting>, Vec<DVec3>),
) -> Result<(), PlainError> {
    for _ in 0..4 {
        let found = Plain::new(input, points)?.pose(&rest.0)?;
        let off = input.optics.rest_from_camera().compose(&found);
        for point in points.iter_mut() {
            *point = off.point(*point);
        }
    }
    Ok(())
}

/// Plain PnP at rest and at every load; the latter as displacements relative to the former.
fn run(
    input: &PlainInput,
    positions_mm: &[DVec3],
    seen: &[(Vec<Sighting>, Vec<DVec3>)],
    rest: &(Vec<Sighting>, Vec<DVec3>),
) -> Result<(Rigid, Vec<[f64; 6]>), PlainError> {
    let plain = Plain::new(input, positions_mm)?;
    let rest_pose = plain.pose(&rest.0)?;
    let from_rest = rest_pose.inverse();
    let displacement = |(sightings, _): &(Vec<Sighting>, Vec<DVec3>)| {
        let relative = from_rest.compose(&plain.pose(sightings)?);
        Ok(Displacement::of_pose(&relative, input.at_mm).to_array())
    };
    Ok((rest_pose, seen.iter().map(displacement).collect::<Result<_, _>>()?))
}

/// The 6x6 that takes the displacements to the wrenches, in the sense of least squares; where the loads leave a
/// direction open, the given 6x6 stays.
///
/// Each wrench axis is weighed by its own spread, and the departure from the given 6x6 is held back a little: a
/// millionth of the weight of the data, enough to decide what they do not.
fn effective(
    input: &PlainInput,
    loads: &[PosedLoad],
    found: &[[f64; 6]],
) -> Result<Matrix6<f64>, PlainError> {
    let mut normal = Matrix6::zeros();
    let mut right = Matrix6::zeros();
    for (load, d) in loads.iter().zip(found) {
        let d = Vector6::from(*d);
        let miss = Vector6::from(load.wrench) - input.stiffness * d;
        normal += d * d.transpose();
        right += d * miss.transpose();
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
    Ok(input.stiffness + change.transpose())
}

fn in_degrees(d: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| if i < 3 { d[i] } else { d[i].to_degrees() })
}

/// Mean errors of poses and wrenches over the loads.
fn bias(input: &PlainInput, loads: &[PosedLoad], found: &[[f64; 6]], stiffness: &Matrix6<f64>) -> Bias {
    let count = loads.len().max(1) as f64;
    let mut sums = [[0.0; 6]; 4];
    for (load, d) in loads.iter().zip(found) {
        let truth = Displacement::of_pose(&load.pose, input.at_mm).to_array();
        let pose = in_degrees(std::array::from_fn(|i| d[i] - truth[i]));
        let wrench = stiffness * Vector6::from(*d) - Vector6::from(load.wrench);
        for i in 0..6 {
            for (sum, value) in sums.iter_mut().zip([pose[i], pose[i].abs(), wrench[i], wrench[i].abs()]) {
                sum[i] += value / count;
            }
        }
    }
    let [mean_pose, mean_pose_size, mean_wrench, mean_wrench_size] = sums;
    Bias { mean_pose, mean_pose_size, mean_wrench, mean_wrench_size }
}

/// Loads that fill the claims: each claimed wrench at a third, two thirds and in whole, turned about the axis by
/// quarter turns, and each half and half with every other; each with the pose that `pose_of` finds for it.
/// Loads without a pose are left out.
pub fn loads_over(claims: &[[f64; 6]], mut pose_of: impl FnMut([f64; 6]) -> Option<Rigid>) -> Vec<PosedLoad> {
    let turned = |w: [f64; 6], quarter: u32| {
        let turn = DMat3::from_rotation_z(f64::from(quarter) * std::f64::consts::FRAC_PI_2);
        let f = turn * DVec3::new(w[0], w[1], w[2]);
        let m = turn * DVec3::new(w[3], w[4], w[5]);
        [f.x, f.y, f.z, m.x, m.y, m.z]
    };
    let mut wrenches: Vec<[f64; 6]> = Vec::new();
    for (i, claim) in claims.iter().enumerate() {
        for quarter in 0..4 {
            let whole = turned(*claim, quarter);
            for part in [1.0 / 3.0, 2.0 / 3.0, 1.0] {
                wrenches.push(whole.map(|v| v * part));
            }
            // Twists have a sign that no turn about the axis changes.
            wrenches.push(std::array::from_fn(|k| if k == 5 { -whole[k] } else { whole[k] }));
            for other in &claims[..i] {
                wrenches.push(std::array::from_fn(|k| 0.5 * (whole[k] + other[k])));
            }
        }
    }
    let mut loads: Vec<PosedLoad> = Vec::with_capacity(wrenches.len());
    for wrench in wrenches {
        if loads.iter().any(|load| load.wrench == wrench) {
            continue;
        }
        if let Some(pose) = pose_of(wrench) {
            loads.push(PosedLoad { pose, wrench });
        }
    }
    loads
}
