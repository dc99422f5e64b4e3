//! The numbers beside a frame that hardness is read from, by their names in data sets and models.

use std::ops::Range;

use glam::DVec2;

/// Columns of the readings.
pub const COLUMNS: [&str; 19] = [
    "time_s",
    "fx_n",
    "fy_n",
    "fz_n",
    "mx_nmm",
    "my_nmm",
    "mz_nmm",
    "tx_mm",
    "ty_mm",
    "tz_mm",
    "rx_rad",
    "ry_rad",
    "rz_rad",
    "robot_travel_mm",
    "dots_mean_px",
    "dots_radial_px",
    "dots_divergence",
    "contact_radius_mm",
    "dots_found",
];

/// Those of wrench and platform.
pub const RIGID_COLUMNS: Range<usize> = 1..13;
/// Those that say how the dots moved.
pub const DOT_COLUMNS: Range<usize> = 14..17;
/// Those that contact mechanics needs, in the order of a [`PressRow`](crate::physics::PressRow): wrench, platform, travel, radius of the contact.
pub const PRESS_COLUMNS: [usize; 14] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 17];

/// Spread of the weight about the contact's centre in which the divergence is fitted, part of the picture's height.
const NEAR_PART: f64 = 0.12;

/// Where a dot would be on the undeformed dome, and how far from there it is seen, px at the design's size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenDot {
    /// On the undeformed dome.
    pub at_px: DVec2,
    /// What the skin's shape moves it by.
    pub moved_px: DVec2,
}

/// Mean motion of the dots (px), its mean part away from the contact's centre (px), its divergence there, and the part of the dots
/// that is found. The centre is the mean of the dots' places weighted by the squares of their motions.
pub fn dots_features(seen: &[Option<SeenDot>], height_px: f64) -> [f64; 4] {
    let found: Vec<&SeenDot> = seen.iter().flatten().collect();
    let count = found.len().max(1) as f64;
    let square = |dot: &SeenDot| dot.moved_px.length_squared();
    let weight: f64 = found.iter().map(|dot| square(dot)).sum();
    if weight <= 0.0 {
        return [0.0, 0.0, 0.0, found.len() as f64 / seen.len().max(1) as f64];
    }
    let center = found.iter().map(|dot| dot.at_px * square(dot)).sum::<DVec2>() / weight;
    let mean = found.iter().map(|dot| dot.moved_px.length()).sum::<f64>() / count;
    let out = |dot: &SeenDot| (dot.at_px - center).normalize_or_zero().dot(dot.moved_px);
    let radial = found.iter().map(|dot| out(dot)).sum::<f64>() / count;
    let near_px = NEAR_PART * height_px;
    let (mut along, mut squares) = (0.0, 0.0);
    for dot in &found {
        let from = dot.at_px - center;
        let near = (-0.5 * from.length_squared() / (near_px * near_px)).exp();
        along += near * from.dot(dot.moved_px);
        squares += near * from.length_squared();
    }
    let divergence = if squares > 0.0 { 2.0 * along / squares } else { 0.0 };
    [mean, radial, divergence, found.len() as f64 / seen.len().max(1) as f64]
}
