//! The camera's own numbers, as far as the calibration of the camera left them open.

use nalgebra::{DMatrix, DVector};

use crate::constants::{CameraConstants, shift_lens};
use domecast_optics::camera::LensSpec;
use domecast_optics::numeric::symmetric_eigen;

/// fx, fy, cx, cy and the coefficients of the distortion, as independent numbers of deviation one: the columns of a root
/// of their covariance. None where no covariance is known: then they hold as they are.
pub(super) struct Intrinsics {
    root: Option<DMatrix<f64>>,
}

const NAMES: [&str; 4] = ["camera.fx", "camera.fy", "camera.cx", "camera.cy"];

impl Intrinsics {
    pub fn new(camera: &CameraConstants) -> Result<Self, String> {
        let rows = &camera.intrinsics_covariance;
        if rows.is_empty() {
            return Ok(Self { root: None });
        }
        let count = 4 + camera.distortion.len();
        let fault = |what: &str| Err(format!("camera.intrinsics_covariance {what}"));
        if rows.len() != count || rows.iter().any(|row| row.len() != count) {
            return fault(&format!(
                "is not {count} x {count}: fx, fy, cx, cy and each coefficient of the distortion"
            ));
        }
        if rows.iter().flatten().any(|v| !(v.is_finite() && v.abs() < 1e12)) {
            return fault("has numbers that are not finite");
        }
        let matrix = DMatrix::from_fn(count, count, |i, j| rows[i][j]);
        let size = |i: usize, j: usize| (matrix[(i, i)].abs() * matrix[(j, j)].abs()).sqrt();
        let is_even =
            |i: usize, j: usize| (matrix[(i, j)] - matrix[(j, i)]).abs() <= 1e-6 * size(i, j) + 1e-300;
        if (0..count).any(|i| matrix[(i, i)] < 0.0 || (0..i).any(|j| !is_even(i, j))) {
            return fault("is not symmetric with a diagonal of variances");
        }
        // In units of each number's own deviation, so that pixels and coefficients are alike.
        let sd: Vec<f64> = (0..count).map(|i| matrix[(i, i)].sqrt()).collect();
        let unit = |i: usize, j: usize| if size(i, j) > 0.0 { matrix[(i, j)] / (sd[i] * sd[j]) } else { 0.0 };
        let eigen = symmetric_eigen(DMatrix::from_fn(count, count, |i, j| 0.5 * (unit(i, j) + unit(j, i))));
        let Some(eigen) = eigen.filter(|eigen| eigen.eigenvalues.min() >= -1e-6) else {
            return fault("is not positive definite");
        };
        let root = DMatrix::from_fn(count, count, |i, k| {
            sd[i] * eigen.eigenvectors[(i, k)] * eigen.eigenvalues[k].max(0.0).sqrt()
        });
        Ok(Self { root: Some(root) })
    }

    /// How many numbers they are.
    pub fn count(&self) -> usize {
        self.root.as_ref().map_or(0, DMatrix::nrows)
    }

    /// What the independent numbers change of fx, fy, cx, cy and the coefficients.
    pub fn steps(&self, x: &[f64]) -> Vec<f64> {
        self.root
            .as_ref()
            .map_or_else(Vec::new, |root| (root * DVector::from_column_slice(x)).as_slice().to_vec())
    }

    pub fn apply(&self, x: &[f64], lens: &mut LensSpec) {
        shift_lens(lens, &self.steps(x));
    }

    /// What takes the independent numbers to the numbers themselves.
    pub fn root(&self) -> Option<&DMatrix<f64>> {
        self.root.as_ref()
    }

    /// Covariance of the numbers themselves from that of the independent ones; the prior's of a unit matrix.
    pub fn covariance(&self, of_independent: &DMatrix<f64>) -> DMatrix<f64> {
        self.root
            .as_ref()
            .map_or_else(|| DMatrix::zeros(0, 0), |root| root * of_independent * root.transpose())
    }

    /// Sum of the deviations of focal length and centre, px.
    pub fn focal_and_center_sd_px(&self) -> f64 {
        let sd = |root: &DMatrix<f64>| (0..4).map(|i| root.row(i).norm()).fold(0.0, f64::max);
        2.0 * self.root.as_ref().map_or(0.0, sd)
    }

    pub fn name(&self, number: usize, nominal: &LensSpec) -> (String, f64) {
        let matrix = &nominal.matrix;
        let values = [matrix[0][0], matrix[1][1], matrix[0][2], matrix[1][2]];
        match (NAMES.get(number), values.get(number)) {
            (Some(name), Some(value)) => ((*name).into(), *value),
            _ => {
                let k = number - NAMES.len();
                (format!("camera.distortion[{k}]"), nominal.distortion.get(k).copied().unwrap_or(0.0))
            }
        }
    }
}
