//! From a pose with its covariance to displacement and wrench with their deviations.

use glam::DVec3;
use nalgebra::Matrix6;

use super::springs::Springs;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::displacement_from_motion;
use domecast_springs::{Displacement, Wrench};

/// Displacement and wrench of one frame, about the springs' reference point, or the origin without springs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::track) struct WrenchEstimate {
    /// Standard deviations of the displacement, mm and rad.
    pub displacement_sd: Option<Displacement>,
    /// What the world puts on dome and platform, N and N*mm.
    pub wrench: Option<Wrench>,
    /// Its standard deviations.
    pub wrench_sd: Option<Wrench>,
    /// Whether the pose is one that the springs cannot have.
    pub is_beyond_springs: bool,
}

impl WrenchEstimate {
    /// At a pose; `covariance`: of a small motion after it (mm, rad about the rest frame's origin).
    pub fn at_pose(
        springs: Option<&Springs>,
        pose: &Rigid,
        covariance: &Matrix6<f64>,
        variance_factor: f64,
    ) -> Self {
        let at_mm = springs.map_or(DVec3::ZERO, Springs::at_mm);
        let transfer = displacement_from_motion(pose, at_mm);
        let covariance = transfer * covariance * transfer.transpose() * variance_factor;
        let mut estimate = Self {
            displacement_sd: deviations(&covariance).map(Displacement::from_array),
            ..Self::default()
        };
        let Some(springs) = springs else { return estimate };
        estimate.is_beyond_springs = !springs.can_stand(pose);
        match springs.wrench(&Displacement::of_pose(pose, at_mm)) {
            Some((wrench, tangent)) => {
                estimate.wrench = Some(wrench);
                let covariance = tangent * covariance * tangent.transpose();
                estimate.wrench_sd = deviations(&covariance).map(Wrench::from_array);
            }
            None => estimate.is_beyond_springs = true,
        }
        estimate
    }
}

/// Square roots of the diagonal; `None` where a variance is not finite.
fn deviations(covariance: &Matrix6<f64>) -> Option<[f64; 6]> {
    let variances = covariance.diagonal();
    // Rounding may leave a variance of zero below it.
    let sd = |i: usize| variances[i].max(0.0).sqrt();
    variances.iter().all(|v| v.is_finite()).then(|| std::array::from_fn(sd))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::{SpringConstants, StiffnessAt};

    fn springs() -> Springs {
        let stiffness = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 2.0 } else { 0.0 }));
        let constants = SpringConstants {
            stiffness,
            at_mm: [0.0; 3],
            source: "nominal".into(),
            stiffness_at: vec![StiffnessAt { compression_mm: 0.0, stiffness }],
            law: None,
            offset: None,
            plain_runtime: None,
        };
        Springs::new(&constants).unwrap()
    }

    #[test]
    fn a_shift_becomes_a_force_and_its_deviation_is_carried_along() {
        let pose = Rigid::new(glam::DMat3::IDENTITY, DVec3::new(0.0, 0.0, -0.5));
        let covariance = Matrix6::identity() * 1e-4;
        let found = WrenchEstimate::at_pose(Some(&springs()), &pose, &covariance, 4.0);
        assert!(!found.is_beyond_springs);
        assert_eq!(found.wrench.unwrap().to_array(), [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]);
        // The motion is stated about the origin, which the platform's shift does not turn.
        let sd = found.displacement_sd.unwrap();
        assert!((sd.translation_mm.z - 0.02).abs() < 1e-12, "{sd:?}");
        assert!((found.wrench_sd.unwrap().force_n.z - 0.04).abs() < 1e-12);
    }

    #[test]
    fn without_springs_there_is_no_wrench_and_no_number_that_is_not_finite() {
        let found = WrenchEstimate::at_pose(None, &Rigid::identity(), &(Matrix6::identity() * f64::NAN), 1.0);
        assert_eq!(found, WrenchEstimate::default());
    }
}
