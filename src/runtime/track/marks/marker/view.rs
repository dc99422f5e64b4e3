//! How a marker's surroundings map to the image.

use glam::{DMat2, DVec2};

use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;

/// Pixels that far outside of the outline are part of the fit: the ground around.
pub(super) const GROUND_PX: f64 = 2.6;
/// Largest half of a window, px: that of a marker as wide as a fifth of a 1080 line frame is high.
pub(in crate::track) const MAX_HALF_PX: i32 = 112;

/// How a marker's surroundings map to the image, to first order, at one pose.
#[derive(Debug, Clone, Copy)]
pub(in crate::track) struct MarkerView {
    /// Millimetres on the sheet by pixels.
    pub(super) mm_by_px: DMat2,
    pub(super) place_mm: DVec2,
    pub(super) radius_mm: f64,
    pub(super) rim_mm: f64,
    pub(super) half_px: i32,
    /// Eight places outside of the outline, a fifth larger than it is, from its middle, whole pixels.
    pub(super) around_px: [[i32; 2]; 8],
}

impl MarkerView {
    /// At the pose of the optics; `None` where the marker is not seen, or wider than what is looked at.
    pub fn new(optics: &SensorOptics, marker: &Marker) -> Option<Self> {
        let motion = optics.project_with_motion(marker.position_mm).ok()?;
        let m = motion.by_point;
        let px_by_mm = DMat2::from_cols_array(&[m[(0, 0)], m[(1, 0)], m[(0, 1)], m[(1, 1)]]);
        let radius_mm = 0.5 * marker.diameter_mm;
        let mm_by_px = px_by_mm.inverse();
        // A point has no picture of its own: a pixel stands for it.
        let radius_mm = radius_mm.max(0.5 / px_by_mm.determinant().abs().sqrt().max(1e-9));
        // How far the outline goes along columns and along rows.
        let rows = px_by_mm.transpose();
        let reach = radius_mm * rows.x_axis.length().max(rows.y_axis.length());
        let half = (reach + GROUND_PX + 1.0).ceil();
        let usable = mm_by_px.is_finite() && half.is_finite() && half <= f64::from(MAX_HALF_PX);
        usable.then_some(Self {
            mm_by_px,
            place_mm: marker.position_mm.truncate(),
            radius_mm,
            rim_mm: optics.dome().rim_radius_mm(),
            half_px: half as i32,
            around_px: std::array::from_fn(|k| {
                let (sin, cos) = (k as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
                let edge = px_by_mm * (DVec2::new(cos, sin) * radius_mm);
                let out = edge * (1.2 + 1.6 / edge.length().max(0.5));
                [out.x.round() as i32, out.y.round() as i32]
            }),
        })
    }
}
