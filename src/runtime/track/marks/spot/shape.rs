//! What a spot looks like beside what a dot would: its size, its sides, its edge, and what no ellipse explains.

use glam::DVec2;

use super::stencil::LANES;
use super::window::SoftWindow;

/// The integral of t (1 - t) across an edge that a Gaussian of one pixel's deviation blurs: 1 / sqrt(pi).
const GREY_BY_EDGE: f64 = 0.564_19;
/// Half of the width of a smoothstep over its standard deviation: the square root of five.
const SMOOTHSTEP: f64 = 2.236_07;
/// Edges from a pixel's own box, to what leaves nothing of a small dot.
const EDGE_PX: std::ops::Range<f64> = 0.3..2.0;
/// Darkness below this, in parts of the spot's, is light that does not come from the ground.
const BRIGHT: f32 = -0.12;

/// What a spot looks like.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpotShape {
    /// Difference of its second moments along and across, over their sum, as a vector of twice the direction's angle.
    pub elongation: DVec2,
    /// Standard deviation of the blur of its edge, px.
    pub edge_px: f64,
    /// What is darker than an ellipse of its own moments, in parts of its area.
    pub over: f64,
    /// What is brighter.
    pub under: f64,
    /// The part of that which is brighter than the ground.
    pub bright: f64,
    /// How one-sided what is dark at the window's rim is, in parts of the circumference: something that is larger than a
    /// dot, of which the window shows a part that looks like one.
    pub one_sided: f64,
    /// Centroid of its odd rows less that of its even ones, px.
    pub odd_rows_px: DVec2,
}

impl SpotShape {
    /// Part of the area that an ellipse leaves unexplained.
    pub fn misfit(&self) -> f64 {
        self.over + self.under
    }
}

/// Area and second moments of a spot about its centroid, and how grey it is.
struct Moments {
    weight: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    grey: f64,
}

fn moments(window: &SoftWindow<'_>, contrast: f64) -> Moments {
    let per = 1.0 / contrast as f32;
    let [mut weights, mut xxs, mut xys, mut yys, mut greys] = [[0.0_f32; LANES]; 5];
    for row in window.rows() {
        for (values, columns) in row.lanes() {
            for k in 0..LANES {
                let dx = columns[k] - row.center_x;
                let value = values[k] * per;
                let weight = row.weight(dx) * value;
                weights[k] += weight;
                xxs[k] += weight * dx * dx;
                xys[k] += weight * dx * row.dy;
                yys[k] += weight * row.dy * row.dy;
                greys[k] += weight * (1.0 - value);
            }
        }
    }
    let sum = |lanes: [f32; LANES]| f64::from(lanes.iter().sum::<f32>());
    let weight = sum(weights);
    Moments { weight, xx: sum(xxs) / weight, xy: sum(xys) / weight, yy: sum(yys) / weight, grey: sum(greys) }
}

/// The shape of a spot in a window on its centroid; `is_first_odd`: whether the window's first row is an odd one of the
/// frame. `None` of what has no moments of a spot's.
pub(super) fn shape_of(window: &SoftWindow<'_>, contrast: f64, is_first_odd: bool) -> Option<SpotShape> {
    let m = moments(window, contrast);
    let sum = m.xx + m.yy;
    let area_px = m.weight;
    if !(area_px > 1.0 && sum > 0.0 && m.xx * m.yy - m.xy * m.xy > 0.0) {
        return None;
    }
    let elongation = DVec2::new(m.xx - m.yy, 2.0 * m.xy) / sum;
    // The ellipse of the spot's area whose moments are these but for a blur alike in all directions.
    let apart = (elongation * sum).length_squared();
    let det = (area_px / (4.0 * std::f64::consts::PI)).powi(2);
    let blur = 0.5 * (sum - (apart + 4.0 * det).sqrt());
    let (xx, yy) = (m.xx - blur, m.yy - blur);
    let radius_px = (area_px / std::f64::consts::PI).sqrt();
    let perimeter_px = 2.0 * std::f64::consts::PI * radius_px;
    let edge_px = m.grey / (GREY_BY_EDGE * perimeter_px);
    // Square of the distance from the middle over the outline's: d C^-1 d / 4.
    let per = 0.25 / det;
    let form = [yy * per, -m.xy * per, xx * per].map(|v| v as f32);
    let half_px = SMOOTHSTEP * edge_px.clamp(EDGE_PX.start, EDGE_PX.end);
    let rest = residuals(window, contrast as f32, form, radius_px as f32, half_px as f32);
    let [over, under, bright, odd_x, odd_y, rim_x, rim_y] = rest;
    let side = if is_first_odd { -1.0 } else { 1.0 };
    let shape = SpotShape {
        elongation,
        edge_px,
        over: over / area_px,
        under: under / area_px,
        bright: bright / area_px,
        one_sided: rim_x.hypot(rim_y) / window.rim_px2(),
        // Each half of the rows has half of the area.
        odd_rows_px: DVec2::new(odd_x, odd_y) * (2.0 * side / area_px),
    };
    let is_finite = shape.misfit().is_finite()
        && shape.one_sided.is_finite()
        && edge_px.is_finite()
        && shape.odd_rows_px.is_finite();
    is_finite.then_some(shape)
}

/// Sums of what is darker than a soft ellipse, brighter, and brighter than the ground, in parts of the contrast; first
/// moments of the window's odd rows less those of its even ones, of what is left beside the ellipse: sharp dots alone put
/// their odd rows up to 0.4 px above or below the even ones, by where they lie on the rows; and first moments of what is dark
/// at the window's rim.
fn residuals(
    window: &SoftWindow<'_>,
    contrast: f32,
    [a, b, c]: [f32; 3],
    radius_px: f32,
    half_px: f32,
) -> [f64; 7] {
    let (per, per_edge) = (1.0 / contrast, 0.5 / half_px);
    let [mut overs, mut unders, mut brights, mut odd_xs, mut odd_ys] = [[0.0_f32; LANES]; 5];
    let [mut rim_xs, mut rim_ys] = [[0.0_f32; LANES]; 2];
    for row in window.rows() {
        let side = if row.index % 2 == 0 { -1.0 } else { 1.0 };
        let (bdy, cdy) = (2.0 * b * row.dy, c * row.dy * row.dy);
        for (values, columns) in row.lanes() {
            for k in 0..LANES {
                let dx = columns[k] - row.center_x;
                let from = (a * dx * dx + bdy * dx + cdy).max(0.0).sqrt();
                let t = (0.5 - (from - 1.0) * radius_px * per_edge).clamp(0.0, 1.0);
                let value = values[k] * per;
                let weight = row.weight(dx);
                let rest = weight * (value - t * t * (3.0 - 2.0 * t));
                overs[k] += rest.max(0.0);
                unders[k] -= rest.min(0.0);
                brights[k] += weight * (BRIGHT - value).max(0.0);
                odd_xs[k] += side * rest * dx;
                odd_ys[k] += side * rest * row.dy;
                let rim = weight * (1.0 - weight) * value;
                rim_xs[k] += rim * dx;
                rim_ys[k] += rim * row.dy;
            }
        }
    }
    [overs, unders, brights, odd_xs, odd_ys, rim_xs, rim_ys].map(|lanes| f64::from(lanes.iter().sum::<f32>()))
}

#[cfg(test)]
mod tests {
    use super::super::meter::{DarkSpot, SpotMeter, SpotOutline};
    use super::*;
    use crate::track::frame::{CameraFrame, Plane};
    use crate::track::options::Channel;

    const CENTER: DVec2 = DVec2::new(20.4, 17.8);
    const RADIUS_PX: f64 = 4.0;

    /// Measures what a picture shows where a round dot should be; each pixel the mean of 8 x 8 samples.
    fn measured(level: impl Fn(DVec2) -> f64) -> DarkSpot {
        let pixel = |i: usize| {
            let corner = DVec2::new((i % 40) as f64, (i / 40) as f64) - 0.5;
            let sample = |k: usize| corner + (DVec2::new((k % 8) as f64, (k / 8) as f64) + 0.5) / 8.0;
            ((0..64).map(|k| level(sample(k))).sum::<f64>() / 64.0).round() as u8
        };
        let bytes: Vec<u8> = (0..40 * 36).map(pixel).collect();
        let frame = CameraFrame::new(40, 36, 1, &bytes).unwrap();
        let area_px = std::f64::consts::PI * RADIUS_PX * RADIUS_PX;
        let spread_px2 = 0.5 * RADIUS_PX * RADIUS_PX;
        let outline = SpotOutline { radius_px: RADIUS_PX, area_px, spread_px2, elongation: DVec2::ZERO };
        let mut meter = SpotMeter::default();
        meter.prepare(RADIUS_PX);
        meter.measure(&Plane::new(&frame, Channel::Luma), CENTER, &outline, 6.0, None).unwrap()
    }

    fn dot(at: DVec2) -> f64 {
        if at.distance(CENTER) < RADIUS_PX { 30.0 } else { 160.0 }
    }

    #[test]
    fn what_is_no_dot_does_not_look_like_one() {
        let clean = measured(dot);
        assert!(clean.at_px.distance(CENTER) < 0.02 && clean.shape.misfit() < 0.08, "{clean:?}");
        assert!(clean.shape.elongation.length() < 0.02 && clean.shape.edge_px < 0.5, "{clean:?}");
        let side = CENTER + DVec2::new(RADIUS_PX, 0.0);
        let dirty = measured(|at| if at.distance(side) < 2.0 { 30.0 } else { dot(at) });
        assert!(
            dirty.shape.misfit() > clean.shape.misfit() + 0.05 || dirty.shape.elongation.x > 0.1,
            "{dirty:?}"
        );
        let double = measured(|at| dot(at).min(dot(at - DVec2::new(3.0, 0.0))));
        assert!(double.shape.elongation.x > 0.2 && double.area_px > 1.3 * clean.area_px, "{double:?}");
        let glare = measured(|at| if at.distance(side) < 2.0 { 250.0 } else { dot(at) });
        assert!(glare.shape.bright > 0.01 && glare.shape.misfit() > 0.2, "{glare:?}");
        // Odd rows of another moment: the dot has moved by a pixel.
        let woven = measured(|at| {
            let is_odd = at.y.round() as i32 % 2 != 0;
            dot(if is_odd { at - DVec2::X } else { at })
        });
        assert!((woven.shape.odd_rows_px.x - 1.0).abs() < 0.1, "{woven:?}");
        assert!(clean.shape.odd_rows_px.length() < 0.05, "{clean:?}");
    }

    #[test]
    fn the_edge_of_a_shadow_under_a_dot_moves_it_by_a_tenth_of_a_pixel() {
        let area_px = std::f64::consts::PI * RADIUS_PX * RADIUS_PX;
        for (place, depth) in [(0.0, 0.6), (2.0, 0.6), (-3.0, 0.5), (1.0, 0.4)] {
            let light =
                |at: DVec2| if (at - CENTER).dot(DVec2::new(0.8, 0.6)) > place { 1.0 - depth } else { 1.0 };
            let spot = measured(|at| dot(at) * light(at));
            let off = spot.at_px.distance(CENTER);
            // What is farther off does not look like the dot: by a quarter too large, or no ellipse.
            let looks_so = spot.shape.misfit() < 0.25 && (spot.area_px / area_px).ln().abs() < 0.25;
            assert!(off < 0.15 || !looks_so, "{place} {depth}: {off} {spot:?}");
        }
    }
}
