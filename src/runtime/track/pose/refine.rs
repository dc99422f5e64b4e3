//! The platform's pose from the white markers, from a pose nearby, without allocating.
//!
//! `pose` finds poses from nothing and says whether a second one fits; from frame to frame the last pose is a start,
//! and a few steps of the same least squares on raw pixels do.

use glam::DVec2;
use nalgebra::{Matrix6, Matrix6x2, Vector6};

use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{Marker, refine_pose};

/// A marker's centroid in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::track) struct MarkerSighting {
    pub marker: Marker,
    pub centroid_px: DVec2,
    /// Its standard deviation on each axis, px, and the share of it that changes from frame to frame.
    pub sd_px: f64,
    pub random_sd_px: f64,
    /// Motion (mm, rad about the rest frame's origin) of the pose by its centroid's, px, where the pose is not the least-squares one of
    /// markers alone.
    pub pull: Option<Matrix6x2<f64>>,
    /// Whether it is a black dot, a point on the dome.
    pub is_dot: bool,
}

impl MarkerSighting {
    /// Of a white marker.
    pub fn new(marker: Marker, centroid_px: DVec2, [sd_px, random_sd_px]: [f64; 2]) -> Self {
        Self { marker, centroid_px, sd_px, random_sd_px, pull: None, is_dot: false }
    }
}

/// A pose that fits the markers.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::track) struct RefinedPose {
    /// `rest_from_platform`.
    pub pose: Rigid,
    /// Root mean square of the residuals on each axis, px.
    pub rms_px: f64,
    /// Covariance of a small motion after the pose (mm, rad about the rest frame's origin), from the centroids' own
    /// standard deviations.
    pub covariance: Matrix6<f64>,
    /// The same from what changes from frame to frame.
    pub random: Matrix6<f64>,
}

/// The pose from one nearby, by the least squares of [`refine_pose`], with what the centroids' deviations leave open of it;
/// `None` where that finds none. The optics are left at the pose that is given.
pub(in crate::track) fn refine(
    optics: &mut SensorOptics,
    seen: &[MarkerSighting],
    start: &Rigid,
) -> Option<RefinedPose> {
    let pose = refine_pose(optics, seen.iter().map(|one| (one.marker, one.centroid_px)), start)?;
    optics.move_to(&pose).ok()?;
    let mut chi2 = 0.0;
    let (mut matrix, mut noisy, mut random) = (Matrix6::zeros(), Matrix6::zeros(), Matrix6::zeros());
    for one in seen {
        let (centroid, motion) = one.marker.centroid_with_motion(optics).ok()?;
        chi2 += (one.centroid_px - centroid).length_squared();
        for axis in 0..2 {
            let row: Vector6<f64> = motion.row(axis).transpose();
            let square = row * row.transpose();
            matrix += square;
            noisy += square * (one.sd_px * one.sd_px);
            random += square * (one.random_sd_px * one.random_sd_px);
        }
    }
    let inverse = matrix.cholesky()?.inverse();
    let rms_px = (chi2 / (2.0 * seen.len() as f64)).sqrt();
    let [covariance, random] = [noisy, random].map(|noise| inverse * noise * inverse);
    Some(RefinedPose { pose, rms_px, covariance, random })
}

#[cfg(test)]
pub(in crate::track) mod tests {
    use super::*;
    use domecast_optics::camera::{LensModel, LensSpec};
    use domecast_optics::{FlatLayer, OpticsSpec};
    use glam::{DMat3, DVec3};

    /// A pinhole 10 mm below a sheet of 1 mm and a dome of 10 mm.
    pub fn pinhole_sensor() -> SensorOptics {
        let spec = OpticsSpec {
            lens: LensSpec {
                model: LensModel::Pinhole,
                width: 640,
                height: 480,
                matrix: [[230.0, 0.0, 319.5], [0.0, 230.0, 239.5], [0.0, 0.0, 1.0]],
                distortion: vec![],
                field_of_view_rad: 2.5,
                pupil_shift_mm: vec![],
            },
            sensor_from_camera: Rigid::from_translation(DVec3::new(0.0, 0.0, -10.0)),
            layers: vec![
                FlatLayer { name: "acrylic".into(), index: [1.49; 3], thickness_mm: Some(1.0) },
                FlatLayer { name: "silicone".into(), index: [1.41; 3], thickness_mm: None },
            ],
            dome: domecast_optics::DomeShape::hemisphere(10.0),
        };
        SensorOptics::new(&spec).unwrap()
    }

    fn sensor() -> (SensorOptics, [Marker; 4]) {
        let corners = [(11.0, 10.0), (-11.0, 10.0), (-11.0, -10.0), (11.0, -9.0)];
        let marker = |id: usize| Marker {
            id: id as u32,
            position_mm: DVec3::new(corners[id].0, corners[id].1, 0.0),
            diameter_mm: 1.0,
        };
        (pinhole_sensor(), std::array::from_fn(marker))
    }

    #[test]
    fn sightings_of_a_pose_give_it_back_with_its_covariance() {
        let (mut optics, markers) = sensor();
        let pose = Rigid::new(DMat3::from_rotation_x(0.05), DVec3::new(0.1, 0.0, -1.0));
        let moved = optics.at_pose(&pose).unwrap();
        let sightings = markers.map(|marker| {
            MarkerSighting::new(marker, marker.image(&moved).unwrap().centroid_px, [0.05, 0.01])
        });
        let found = refine(&mut optics, &sightings, &Rigid::identity()).unwrap();
        assert!(found.rms_px < 1e-6, "{}", found.rms_px);
        assert!(found.pose.translation_mm.distance(pose.translation_mm) < 1e-6);
        let variances = found.covariance.diagonal();
        assert!(variances.iter().all(|v| *v > 0.0 && v.sqrt() < 0.05), "{variances}");
        let part = (found.random - found.covariance * 0.04).norm() / found.covariance.norm();
        assert!(part < 1e-9, "{part}");
        assert_eq!(refine(&mut optics, &sightings[..2], &Rigid::identity()), None);
    }
}
