//! The platform's pose from the white markers, from a pose nearby, without allocating.
//!
//! `pose` finds poses from nothing and says whether a second one fits; from frame to frame the last pose is a start,
//! and a few steps of the same least squares on raw pixels do.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix6, Vector6};

use domecast_optics::SensorOptics;
use domecast_optics::numeric::{Rigid, rotation_from_vector};
use domecast_optics::pose::Marker;

const MAX_STEPS: u32 = 24;
/// The step after which a pose counts as found, mm (a turn counts by what it moves at ten millimetres).
const CONVERGED_MM: f64 = 1e-6;

/// A marker's centroid in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::track) struct MarkerSighting {
    pub marker: Marker,
    pub centroid_px: DVec2,
    /// Its standard deviation on each axis, px, and the share of it that changes from frame to frame.
    pub sd_px: f64,
    pub random_sd_px: f64,
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

struct Normal {
    chi2: f64,
    matrix: Matrix6<f64>,
    /// The same with each row weighed by its variance.
    noisy: Matrix6<f64>,
    random: Matrix6<f64>,
    right: Vector6<f64>,
}

fn normal_at(optics: &mut SensorOptics, seen: &[MarkerSighting], pose: &Rigid) -> Option<Normal> {
    optics.move_to(pose).ok()?;
    let zeros = Matrix6::zeros();
    let mut normal =
        Normal { chi2: 0.0, matrix: zeros, noisy: zeros, random: zeros, right: Vector6::zeros() };
    for one in seen {
        let (centroid, motion) = one.marker.centroid_with_motion(optics).ok()?;
        let left = one.centroid_px - centroid;
        for axis in 0..2 {
            let row: Vector6<f64> = motion.row(axis).transpose();
            let square = row * row.transpose();
            normal.chi2 += left[axis] * left[axis];
            normal.matrix += square;
            normal.noisy += square * (one.sd_px * one.sd_px);
            normal.random += square * (one.random_sd_px * one.random_sd_px);
            normal.right += row * left[axis];
        }
    }
    normal.chi2.is_finite().then_some(normal)
}

/// Levenberg-Marquardt from a start, at most [`MAX_STEPS`] steps; `None` where three markers are not seen, a marker
/// is past what the camera sees, or the steps do not converge. The optics are left at the pose that is given.
pub(in crate::track) fn refine(
    optics: &mut SensorOptics,
    seen: &[MarkerSighting],
    start: &Rigid,
) -> Option<RefinedPose> {
    if seen.len() < 3 {
        return None;
    }
    let mut pose = *start;
    let mut now = normal_at(optics, seen, &pose)?;
    let mut damping = 0.0;
    let mut converged = false;
    for _ in 0..MAX_STEPS {
        let mut damped = now.matrix;
        for i in 0..6 {
            damped[(i, i)] *= 1.0 + damping;
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&now.right)) else {
            damping = f64::max(10.0 * damping, 1e-6);
            continue;
        };
        let (v, w) = (DVec3::new(step[0], step[1], step[2]), DVec3::new(step[3], step[4], step[5]));
        let size = v.length().max(10.0 * w.length());
        if !size.is_finite() {
            return None;
        }
        // Far steps are cut: a turn of half a radian, a shift of three millimetres.
        let cut = (3.0 / v.length().max(6.0 * w.length())).min(1.0);
        let next = Rigid::new(rotation_from_vector(w * cut), v * cut).compose(&pose).orthonormalized();
        match normal_at(optics, seen, &next) {
            Some(n) if n.chi2 <= now.chi2 || size <= 1e-9 => {
                (pose, now) = (next, n);
                damping = if damping > 1e-9 { 0.1 * damping } else { 0.0 };
                if size <= CONVERGED_MM {
                    converged = true;
                    break;
                }
            }
            // At the floor of rounding no step goes down.
            _ if size <= 10.0 * CONVERGED_MM => {
                converged = true;
                break;
            }
            _ => damping = f64::max(10.0 * damping, 1e-4),
        }
    }
    if !converged || optics.move_to(&pose).is_err() {
        return None;
    }
    let inverse = now.matrix.cholesky()?.inverse();
    let rms_px = (now.chi2 / (2.0 * seen.len() as f64)).sqrt();
    let [covariance, random] = [now.noisy, now.random].map(|noise| inverse * noise * inverse);
    Some(RefinedPose { pose, rms_px, covariance, random })
}

#[cfg(test)]
pub(in crate::track) mod tests {
    use super::*;
    use domecast_optics::camera::{LensModel, LensSpec};
    use domecast_optics::{FlatLayer, OpticsSpec};
    use glam::DMat3;

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
        let sightings = markers.map(|marker| MarkerSighting {
            marker,
            centroid_px: marker.image(&moved).unwrap().centroid_px,
            sd_px: 0.05,
            random_sd_px: 0.01,
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
