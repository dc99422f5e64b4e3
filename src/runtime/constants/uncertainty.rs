//! What is left open of the constants' own numbers: tolerances before a calibration, covariances after it.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::law::SpringLaw;
use domecast_optics::OpticsSpec;
use domecast_optics::camera::LensSpec;
use domecast_optics::numeric::rotation_from_vector;

/// How far springs as they are bought may be off, each as one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SpringTolerances {
    /// Wire, mm; the springs of a sensor are of one wire.
    pub wire_diameter_mm: f64,
    /// Outside of each coil, mm, each spring by itself.
    pub outer_diameter_mm: f64,
    /// Coils that deform, each spring by itself.
    pub active_coils: f64,
    /// Moduli of the wire, part of them.
    pub modulus_part: f64,
}

impl SpringTolerances {
    /// What they come to for one spring's axial rate `G d^4 / (8 D^3 n)`, part of it.
    pub fn rate_part(&self, law: &SpringLaw) -> f64 {
        let mean_mm = law.outer_diameter_mm - law.wire_diameter_mm;
        // A thicker wire in the same outside makes the mean coil smaller too.
        let wire = self.wire_diameter_mm * (4.0 / law.wire_diameter_mm + 3.0 / mean_mm);
        let coil = 3.0 * self.outer_diameter_mm / mean_mm;
        let count = self.active_coils / law.active_coils;
        wire.hypot(coil).hypot(count).hypot(self.modulus_part)
    }
}

/// How the springs' stiffness follows the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SpringTemperature {
    /// Temperature that the stiffness is of, degrees C.
    pub at_c: f64,
    /// Change of the stiffness by a kelvin, part of it.
    pub modulus_per_k: f64,
    /// Its standard deviation.
    pub modulus_per_k_sd: f64,
}

/// What `calibrate-optics` left open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct OpticsUncertainty {
    /// Names: pupil x, y, z (mm), camera rotation x, y, z (rad), thickness of each flat layer (mm), index of each layer
    /// but air, the camera's own numbers where their covariance is known, then x and y of each white marker (mm).
    pub parameters: Vec<String>,
    /// Their covariance.
    pub covariance: Vec<Vec<f64>>,
}

/// What `calibrate-force` left open of the springs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SpringUncertainty {
    /// Each axis of the wrench that was fitted.
    pub axes: Vec<AxisUncertainty>,
    /// Compression at which the fitted growth ends, mm.
    pub max_compression_mm: f64,
    /// Whether the motions were seen through these constants' own optics: what those show wrong of a motion is in the
    /// stiffness then, and only their zero stays open.
    pub through_optics: bool,
}

/// What is open of one axis of the wrench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AxisUncertainty {
    /// Its name, Fx to Mz.
    pub axis: String,
    /// Covariance of what multiplies tx, ty, tz, rx, ry, rz, and then compression times each of them: 12 x 12.
    pub covariance: Vec<Vec<f64>>,
}

/// How many numbers of pupil, rotation and layers there are.
pub(crate) fn body_numbers(spec: &OpticsSpec) -> usize {
    6 + 2 * spec.layers.len().saturating_sub(1) + 1
}

/// Changes pupil (mm, sensor frame), camera rotation (rad, the camera's axes), thickness of each flat layer (mm) and index
/// of each layer by the numbers of `x`, in this order.
pub(crate) fn shift_body(spec: &mut OpticsSpec, x: &[f64]) {
    let flat = spec.layers.len().saturating_sub(1);
    spec.sensor_from_camera.translation_mm += DVec3::new(x[0], x[1], x[2]);
    spec.sensor_from_camera.rotation *= rotation_from_vector(DVec3::new(x[3], x[4], x[5]));
    for (k, layer) in spec.layers.iter_mut().enumerate() {
        if let Some(thickness) = layer.thickness_mm.as_mut() {
            *thickness = (*thickness + x[6 + k]).max(0.0);
        }
        for index in &mut layer.index {
            *index = (*index + x[6 + flat + k]).max(1.0);
        }
    }
}

/// Changes fx, fy, cx, cy and the coefficients of the distortion.
pub(crate) fn shift_lens(lens: &mut LensSpec, steps: &[f64]) {
    if let [fx, fy, cx, cy, coefficients @ ..] = steps {
        lens.matrix[0][0] += fx;
        lens.matrix[1][1] += fy;
        lens.matrix[0][2] += cx;
        lens.matrix[1][2] += cy;
        for (coefficient, step) in lens.distortion.iter_mut().zip(coefficients) {
            *coefficient += step;
        }
    }
}
