//! The paper's runtime, played: undistorted centroids, and solvePnP that knows neither lens nor layers.

use glam::{DVec2, DVec3};
use nalgebra::Vector6;

use super::plain_input::{PlainError, PlainInput};
use domecast_optics::camera::{LensModel, LensSpec};
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{Marker, PoseOptions, PoseSolver, Sighting};
use domecast_optics::{DomeShape, FlatLayer, OpticsSpec, RayLimit, SensorOptics};
use domecast_springs::Displacement;

/// What the runtime sees at one pose.
pub(super) struct Frame {
    /// Centroids in the undistorted frame.
    pub sightings: Vec<Sighting>,
    /// The directions that they stand for, camera frame.
    pub rays: Vec<DVec3>,
}

/// A plain runtime: pinhole, no layers, markers at the positions it is given.
pub struct PlainRuntimeSolver {
    solver: PoseSolver,
}

impl PlainRuntimeSolver {
    /// The runtime that is given these positions of the markers.
    ///
    /// # Errors
    /// Markers or a matrix that no pose can be found with.
    pub fn new(input: &PlainInput, positions_mm: &[DVec3]) -> Result<Self, PlainError> {
        let lens = input.optics.lens().spec();
        let spec = OpticsSpec {
            lens: LensSpec {
                model: LensModel::Pinhole,
                matrix: input.undistorted_matrix,
                distortion: vec![],
                pupil_shift_mm: vec![],
                // All that a plane frame can hold.
                field_of_view_rad: 179_f64.to_radians(),
                ..lens.clone()
            },
            sensor_from_camera: *input.optics.rest_from_camera(),
            layers: vec![FlatLayer { name: "nothing".into(), index: [1.0; 3], thickness_mm: None }],
            // Nothing is above the sheet for it; apparent positions may lie there.
            dome: DomeShape::hemisphere(1e3 * input.optics.dome_radius_mm()),
        };
        let optics = SensorOptics::new(&spec).map_err(PlainError::Optics)?;
        let markers: Vec<Marker> = input
            .markers
            .iter()
            .zip(positions_mm)
            .map(|(marker, position_mm)| Marker { position_mm: *position_mm, diameter_mm: 0.0, ..*marker })
            .collect();
        // The plain runtime has no gate: whatever the residual, it takes the pose.
        let options = PoseOptions { noise_px: 1e3, max_shift_mm: 1e6, max_turn_rad: 10.0 };
        Ok(Self { solver: PoseSolver::new(&optics, &markers, options).map_err(PlainError::Pose)? })
    }

    /// Centroids of the raw frame as the runtime's undistorted one shows them; `None` where the lens has no ray.
    pub fn undistorted(&self, optics: &SensorOptics, raw: &[Sighting]) -> Option<Vec<Sighting>> {
        let [[fx, _, cx], [_, fy, cy], _] = self.solver.optics().lens().spec().matrix;
        let straight = |seen: &Sighting| {
            let ray = optics.lens().unproject(seen.centroid_px).ok().filter(|ray| ray.z > 0.0)?;
            let centroid_px = DVec2::new(fx * ray.x / ray.z + cx, fy * ray.y / ray.z + cy);
            Some(Sighting { id: seen.id, centroid_px })
        };
        raw.iter().map(straight).collect()
    }

    /// `camera_from_sensor` as solvePnP would say.
    ///
    /// # Errors
    /// Fewer than four markers, or none that fit a plane.
    pub fn pose(&self, sightings: &[Sighting]) -> Result<Rigid, PlainError> {
        let found = self.solver.solve(sightings).map_err(PlainError::Pose)?;
        Ok(self.solver.optics().rest_from_camera().inverse().compose(&found.pose))
    }
}

/// Centroids in the undistorted frame and the directions that they stand for, at one pose.
pub(super) fn undistorted(input: &PlainInput, pose: &Rigid) -> Result<Frame, PlainError> {
    let optics = input.optics.at_pose(pose).map_err(PlainError::Optics)?;
    let [[fx, _, cx], [_, fy, cy], _] = input.undistorted_matrix;
    let mut sightings = Vec::with_capacity(input.markers.len());
    let mut rays = Vec::with_capacity(input.markers.len());
    for marker in input.markers {
        let hidden = |limit| PlainError::NotVisible { id: marker.id, limit };
        let image = marker.image(&optics).map_err(hidden)?;
        let ray = optics.lens().unproject(image.centroid_px).map_err(|limit| hidden(limit.into()))?;
        if ray.z <= 0.0 {
            return Err(hidden(RayLimit::BeyondFieldOfView));
        }
        let centroid_px = DVec2::new(fx * ray.x / ray.z + cx, fy * ray.y / ray.z + cy);
        sightings.push(Sighting { id: marker.id, centroid_px });
        rays.push(ray);
    }
    Ok(Frame { sightings, rays })
}

/// Plain PnP at rest and at every load; the latter as displacements relative to the former.
pub(super) fn run(
    input: &PlainInput,
    positions_mm: &[DVec3],
    seen: &[Frame],
    rest: &Frame,
) -> Result<(Rigid, Vec<Vector6<f64>>), PlainError> {
    let plain = PlainRuntimeSolver::new(input, positions_mm)?;
    let rest_pose = plain.pose(&rest.sightings)?;
    let from_rest = rest_pose.inverse();
    let displacement = |frame: &Frame| {
        let relative = from_rest.compose(&plain.pose(&frame.sightings)?);
        Ok(Vector6::from(Displacement::of_pose(&relative, input.at_mm).to_array()))
    };
    Ok((rest_pose, seen.iter().map(displacement).collect::<Result<_, _>>()?))
}
