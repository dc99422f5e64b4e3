//! Numbers of the lit frame: levels of the dome, contrast of the markers.

use glam::DVec2;
use serde::Serialize;

use super::edges::ShadowEdges;
use super::rest::{luma, marker_outlines};
use super::separation::Separation;
use domecast_design::Design;
use domecast_design::sections::ExposureSection;
use domecast_sim::light::RestLight;

/// Full scale of 8 bits.
pub(super) const FULL: f64 = 255.0;
/// Width over which the edge of a marker goes from one level to the other in a sharp image, px: the pixel itself and the
/// lens.
const EDGE_PX: f64 = 2.2;
/// Below this part of direct light a place counts as in shadow: its colour says more of the rest of the dome than of its own
/// slope.
const SHADOW_PART: f64 = 0.2;

/// What the frame of the lit sensor at rest shows; levels are grey values of 0 to 255 before clipping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightReport {
    /// Exposure and gain that the frame is taken with: level (of full scale) of a white surface for each mW/mm^2 on it.
    pub level_per_mw_mm2: f64,
    /// Whether that is the camera's largest, and the frame darker than wanted.
    pub is_exposure_at_limit: bool,
    /// The dome between the dots.
    pub dome: DomeLevels,
    /// Each white marker.
    pub markers: Vec<MarkerLevels>,
    /// Edges of the platform's shadows; `None` where the dots cannot be laid out.
    pub edges: Option<ShadowEdges>,
    /// How well the lights tell normals; `None` where only the levels were asked for.
    pub separation: Option<Separation>,
}

/// Grey levels of the dome between the dots, inside of the mask.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DomeLevels {
    /// Median of the grey level (luma).
    pub median_level: f64,
    /// One place in twenty is darker than this.
    pub percentile_5_level: f64,
    /// One place in twenty is brighter than this.
    pub percentile_95_level: f64,
    /// Share of the places in the shadow of the platform: less than a fifth of their light comes from the lights directly.
    pub shadow_share: f64,
    /// Share of the places at which a colour is cut off at full scale.
    pub saturated_share: f64,
    /// Median of red, green and blue.
    pub median_rgb: [f64; 3],
    /// 5th percentile of red, green and blue.
    pub percentile_5_rgb: [f64; 3],
}

/// A white marker in the lit frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarkerLevels {
    /// Its number.
    pub id: usize,
    /// Its grey level (luma).
    pub level: f64,
    /// By how much it is brighter than the sheet and platform around it.
    pub contrast_levels: f64,
    /// Standard deviation of its centroid in each image axis, from contrast, outline and `exposure.pixel_noise_levels`,
    /// px.
    ///
    /// The least that any estimate can have (Cramer-Rao): an outline of length P whose edges rise by C over w px in pixels
    /// of noise s fixes a shift along x with the information `C^2 / (w s^2)` times the integral of the squared x of its
    /// normal, which is `P / 2` over the two axes' mean.
    pub centroid_sd_px: f64,
}

/// The value below which a part of `sorted` lies; NaN where there is none.
fn percentile(sorted: &[f64], part: f64) -> f64 {
    let index = (part * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

/// Levels of the dome with an exposure; `light` is that for an exposure of 1.
pub(super) fn dome_levels(light: &RestLight, exposure: f64, section: &ExposureSection) -> DomeLevels {
    let rgb: Vec<[f64; 3]> = light
        .dome
        .iter()
        .map(|place| place.level.map(|v| FULL * (exposure * v + section.stray_level)))
        .collect();
    let sorted = |value: &dyn Fn(&[f64; 3]) -> f64| {
        let mut values: Vec<f64> = rgb.iter().map(value).collect();
        values.sort_unstable_by(f64::total_cmp);
        values
    };
    let grey = sorted(&|level| luma(*level));
    let share = |wanted: &dyn Fn(&[f64; 3]) -> bool| {
        rgb.iter().filter(|level| wanted(level)).count() as f64 / rgb.len().max(1) as f64
    };
    let shadowed =
        light.dome.iter().filter(|place| luma(place.direct) < SHADOW_PART * luma(place.level)).count();
    let by_channel = |part: f64| std::array::from_fn(|c| percentile(&sorted(&|level| level[c]), part));
    DomeLevels {
        median_level: percentile(&grey, 0.5),
        percentile_5_level: percentile(&grey, 0.05),
        percentile_95_level: percentile(&grey, 0.95),
        shadow_share: shadowed as f64 / rgb.len().max(1) as f64,
        saturated_share: share(&|level| level.iter().any(|v| *v > FULL)),
        median_rgb: by_channel(0.5),
        percentile_5_rgb: by_channel(0.05),
    }
}

/// Levels of each marker with an exposure; `light` is that for an exposure of 1.
pub(super) fn marker_levels(design: &Design, light: &RestLight, exposure: f64) -> Vec<MarkerLevels> {
    let section = &design.sections().exposure;
    let outlines = marker_outlines(design);
    let marker = |(id, level): (usize, &[f64; 3])| {
        let level = FULL * luma(level.map(|v| (exposure * v + section.stray_level).min(1.0)));
        let contrast_levels = level - FULL * section.surround_level;
        let outline = outlines.get(id).map_or(&[][..], Vec::as_slice);
        MarkerLevels {
            id,
            level,
            contrast_levels,
            centroid_sd_px: centroid_sd_px(outline, contrast_levels, section.pixel_noise_levels),
        }
    };
    light.markers.iter().enumerate().map(marker).collect()
}

/// The bound of [`MarkerLevels::centroid_sd_px`]; no number where nothing stands out.
fn centroid_sd_px(outline: &[DVec2], contrast_levels: f64, noise_levels: f64) -> f64 {
    let next = outline.iter().cycle().skip(1);
    let length_px: f64 = outline.iter().zip(next).map(|(a, b)| a.distance(*b)).sum();
    if contrast_levels <= 0.0 || length_px <= 0.0 {
        return f64::INFINITY;
    }
    noise_levels / contrast_levels * (2.0 * EDGE_PX / length_px).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centroid_is_known_as_well_as_least_squares_on_a_drawn_disc_says() {
        // A disc drawn with edges that rise linearly over the width; Fisher's information summed over pixels.
        let (radius, contrast, noise) = (4.0, 20.0, 1.5);
        let level = |x: f64, y: f64| {
            let outside = x.hypot(y) - radius;
            contrast * (0.5 - outside / EDGE_PX).clamp(0.0, 1.0)
        };
        let mut information = 0.0;
        let step = 0.05;
        for i in -200..=200 {
            for j in -200..=200 {
                let (x, y) = (f64::from(i) * step, f64::from(j) * step);
                let slope = (level(x + 1e-4, y) - level(x - 1e-4, y)) / 2e-4;
                information += (slope / noise).powi(2) * step * step;
            }
        }
        let circle: Vec<DVec2> =
            (0..360).map(|k| radius * DVec2::from_angle(f64::from(k).to_radians())).collect();
        let found = centroid_sd_px(&circle, contrast, noise);
        assert!((found * information.sqrt() - 1.0).abs() < 0.02, "{found} {}", information.sqrt().recip());
    }
}
