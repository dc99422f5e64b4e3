//! What the sensor can resolve: centroid noise through the Jacobian of the refracting projection.

use glam::DVec3;
use nalgebra::{DMatrix, Matrix6, Vector6};
use serde::Serialize;

use super::sight::markers_of;
use domecast_design::Design;
use domecast_design::settings::SAFETY;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::{Rigid, symmetric_eigen};
use domecast_optics::pose::{Marker, displacement_from_motion};
use domecast_runtime::constants::WRENCH_AXES;
use domecast_springs::{Displacement, Suspension};

/// Bounds on what one frame resolves (Cramer-Rao: no unbiased estimate from the centroids does better).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Resolution {
    /// Standard deviation of the displacement: mm and degrees.
    pub pose_sd: [f64; 6],
    /// Standard deviation of the wrench: N and N*mm.
    pub wrench_sd: [f64; 6],
    /// Correlation of the displacement's errors.
    pub pose_correlation: [[f64; 6]; 6],
    /// Correlation of the wrench's errors.
    pub wrench_correlation: [[f64; 6]; 6],
    /// Condition number of the map from displacement (mm, and rad times the lever) to pixels.
    pub condition: f64,
    /// The lever that made rad comparable with mm: the markers' distance from their middle, mm.
    pub lever_mm: f64,
    /// The force axes and then the moment axes with the largest standard deviation, ties within a hundredth included.
    ///
    /// They depend on the point that wrenches are stated about. About the springs' middle, below the markers, an
    /// error of the tilt swings that point sideways, so Fx and Fy are weak with Mx and My; about the markers' own plane
    /// the force along the camera's axis, Fz, is the weakest.
    pub weak_axes: Vec<&'static str>,
}

/// The bound at a pose; `noise_px` is the standard deviation of each marker's centroid in an image axis. `None` where a
/// marker is not seen, has no noise, or the pixels leave a direction open.
pub fn resolution_at(
    optics: &SensorOptics,
    markers: &[Marker],
    noise_px: &[f64],
    suspension: &Suspension,
    pose: &Rigid,
) -> Option<Resolution> {
    let at_mm = suspension.at_mm();
    let placed = optics.at_pose(pose).ok()?;
    let mut normal = Matrix6::zeros();
    for (index, marker) in markers.iter().enumerate() {
        let (_, motion) = marker.centroid_with_motion(&placed).ok()?;
        normal += motion.transpose() * motion / noise_px.get(index)?.powi(2);
    }
    let transfer = displacement_from_motion(pose, at_mm);
    let covariance = transfer * normal.cholesky()?.inverse() * transfer.transpose();
    let displacement = Displacement::of_pose(pose, at_mm);
    let stiffness = suspension.tangent_at(&displacement).ok()?;
    let of_wrench = stiffness * covariance * stiffness.transpose();
    let middle = markers.iter().map(|m| m.position_mm).sum::<DVec3>() / markers.len().max(1) as f64;
    let square = markers.iter().map(|m| m.position_mm.distance_squared(middle)).sum::<f64>();
    let lever_mm = (square / markers.len().max(1) as f64).sqrt();
    let scale = Vector6::from_fn(|i, _| if i < 3 { 1.0 } else { 1.0 / lever_mm });
    let back = transfer.try_inverse()?;
    let by_displacement = back.transpose() * normal * back;
    let scaled = DMatrix::from_fn(6, 6, |i, j| by_displacement[(i, j)] * scale[i] * scale[j]);
    let values = symmetric_eigen(scaled)?.eigenvalues;
    let condition = (values.max() / values.min()).sqrt();
    let sd = |m: &Matrix6<f64>| -> [f64; 6] { std::array::from_fn(|i| m[(i, i)].max(0.0).sqrt()) };
    let wrench_sd = sd(&of_wrench);
    let weakest = |from: usize| {
        let max = wrench_sd[from..from + 3].iter().copied().fold(0.0, f64::max);
        (from..from + 3).filter(move |axis| wrench_sd[*axis] >= 0.99 * max).map(|axis| WRENCH_AXES[axis])
    };
    let pose_sd = sd(&covariance);
    let finite = condition.is_finite() && wrench_sd.iter().all(|v| v.is_finite());
    finite.then(|| Resolution {
        pose_sd: std::array::from_fn(|i| if i < 3 { pose_sd[i] } else { pose_sd[i].to_degrees() }),
        wrench_sd,
        pose_correlation: correlation(&covariance),
        wrench_correlation: correlation(&of_wrench),
        condition,
        lever_mm,
        weak_axes: weakest(0).chain(weakest(3)).collect(),
    })
}

fn correlation(covariance: &Matrix6<f64>) -> [[f64; 6]; 6] {
    let size = |i: usize| covariance[(i, i)].max(0.0).sqrt();
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let both = size(i) * size(j);
            if both > 0.0 { covariance[(i, j)] / both } else { f64::from(u8::from(i == j)) }
        })
    })
}

/// One change of the design, and what it would do at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignChoice {
    /// What is changed, in words.
    pub change: String,
    /// What could then be resolved; left out where a marker would not be seen any more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
}

/// The effect of each choice of the design on what it resolves at rest: marker radius, air gap, focal length.
pub fn design_choices(
    optics: &SensorOptics,
    markers: &[Marker],
    noise_px: &[f64],
    suspension: &Suspension,
) -> Vec<DesignChoice> {
    let rest = Rigid::identity();
    let try_with = |change: String, optics: Option<SensorOptics>, markers: &[Marker]| {
        let resolution = optics.and_then(|o| resolution_at(&o, markers, noise_px, suspension, &rest));
        DesignChoice { change, resolution }
    };
    let mut all = vec![try_with("as designed".into(), Some(optics.clone()), markers)];
    for factor in [0.6, 0.8, 0.9, 1.1] {
        let moved: Vec<Marker> = markers
            .iter()
            .map(|m| Marker {
                position_mm: DVec3::new(m.position_mm.x * factor, m.position_mm.y * factor, m.position_mm.z),
                ..*m
            })
            .collect();
        all.push(try_with(
            format!("white markers at {factor} of their radius"),
            Some(optics.clone()),
            &moved,
        ));
    }
    let spec = optics.spec();
    for step_mm in [-2.0, -1.0, 1.0, 2.0] {
        let mut changed = spec.clone();
        changed.sensor_from_camera.translation_mm.z -= step_mm;
        let word = if step_mm > 0.0 { "longer" } else { "shorter" };
        let change = format!("air gap {} mm {word}", f64::abs(step_mm));
        all.push(try_with(change, SensorOptics::new(&changed).ok(), markers));
    }
    for factor in [0.8, 0.9, 1.1, 1.25] {
        let mut changed = spec.clone();
        for row in &mut changed.lens.matrix[..2] {
            for entry in &mut row[..2] {
                *entry *= factor;
            }
        }
        let change = format!("focal length at {factor} of its value");
        all.push(try_with(change, SensorOptics::new(&changed).ok(), markers));
    }
    all
}

/// Frames whose mean gives a force to the design's `accuracy.force_n`, with the settings' safety, at rest and at every
/// pose; `None` where nothing is asked or a marker is not seen.
///
/// The noise of frames is independent: the spread of a mean falls with the root of their number. What the constants
/// are off by does not.
pub fn frames_to_average(
    design: &Design,
    noise_px: &[f64],
    suspension: &Suspension,
    poses: &[Rigid],
) -> Option<u32> {
    let force_n = design.sections().accuracy.as_ref()?.force_n;
    let markers = markers_of(design);
    let one_n = |pose: &Rigid| {
        let found = resolution_at(design.optics(), &markers, noise_px, suspension, pose)?;
        Some(found.wrench_sd[..3].iter().map(|sd| sd * sd).sum::<f64>().sqrt())
    };
    let rest = one_n(&Rigid::identity())?;
    let worst_n = poses.iter().filter_map(one_n).fold(rest, f64::max);
    Some((SAFETY * worst_n / force_n).powi(2).ceil().clamp(1.0, f64::from(u32::MAX)) as u32)
}
