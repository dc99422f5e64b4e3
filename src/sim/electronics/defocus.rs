//! What is not in focus is blurred: each point of the membrane becomes a small disc in the image.
//!
//! A pupil of diameter `D` focussed at the distance `s0` sees a point at the distance `s` as a disc of the angular
//! diameter `D |1/s - 1/s0|`. Behind the sheet the distance is the reduced one, the sum of each layer's length over
//! its index along the chief ray. The disc is replaced by a Gaussian of the same variance, `diameter^2 / 16` along
//! each axis, made by small steps of diffusion; its width follows the place in the image, at rest. The blur is
//! linear, so it runs once on the averaged picture instead of on each of its parts.

use glam::DVec2;

use crate::effect_name::EffectName;
use crate::electronics::pass::{Pass, PassContext, Stage};
use crate::raster::frame::Frame;
use crate::scene::Scene;
use crate::scene::electronics::FocusSection;
use crate::work::Work;
use domecast_optics::SensorOptics;

/// Pixels between the places at which the width is computed; it is smooth, and linear in between.
const STEP: usize = 16;

/// Variance that one step of diffusion may add, px^2: up to 1/2 every weight is positive and nothing is amplified.
const STEP_VARIANCE: f64 = 0.4;

/// Work of one step for a pixel of a plane, in units of 1 / this.
pub(crate) const PIXELS_PER_UNIT: u64 = 1;

/// Steps of diffusion that make a variance, px^2.
pub(crate) fn steps_for(variance: f64) -> usize {
    ((variance / STEP_VARIANCE).ceil() as usize).clamp(1, 64)
}

/// Variance of the blur along each axis, px^2, at places of a coarse grid over the image.
pub(crate) struct Widths {
    width: usize,
    height: usize,
    columns: usize,
    values: Vec<f64>,
}

impl Widths {
    /// The widths of a focussed lens.
    pub fn of(scene: &Scene, focus: &FocusSection) -> Self {
        let (width, height) = scene.image_size();
        let (columns, rows) = (width / STEP + 2, height / STEP + 2);
        let at = |i: usize| {
            let pixel = DVec2::new(((i % columns) * STEP) as f64, ((i / columns) * STEP) as f64);
            variance(scene.optics(), focus, pixel)
        };
        let mut values: Vec<f64> = (0..columns * rows).map(at).collect();
        // 64 steps is the most that is done: a wider blur is cut there.
        for value in &mut values {
            *value = value.min(64.0 * STEP_VARIANCE);
        }
        Self { width, height, columns, values }
    }

    /// Largest variance, px^2.
    pub fn largest(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// Largest slope, px^2 per px.
    pub fn steepest(&self) -> f64 {
        let along =
            self.values.chunks(self.columns).flat_map(|row| row.windows(2).map(|w| (w[1] - w[0]).abs()));
        let down = self.values.iter().zip(self.values.iter().skip(self.columns)).map(|(a, b)| (a - b).abs());
        std::f64::consts::SQRT_2 * along.chain(down).fold(0.0, f64::max) / STEP as f64
    }

    /// Half of the variance of one step, for every pixel.
    fn plane(&self, steps: usize) -> Vec<f32> {
        let scale = 0.5 / steps as f64;
        let mut out = Vec::with_capacity(self.width * self.height);
        for y in 0..self.height {
            let (row, down) = (y / STEP, (y % STEP) as f64 / STEP as f64);
            for x in 0..self.width {
                let (column, along) = (x / STEP, (x % STEP) as f64 / STEP as f64);
                let at = |dx: usize, dy: usize| self.values[(row + dy) * self.columns + column + dx];
                let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
                let value = mix(mix(at(0, 0), at(1, 0), along), mix(at(0, 1), at(1, 1), along), down);
                out.push((value * scale) as f32);
            }
        }
        out
    }
}

/// Variance of the blur at a pixel: of what it sees of the dome, else of the sheet's top; 0 where the lens shows
/// nothing.
fn variance(optics: &SensorOptics, focus: &FocusSection, pixel: DVec2) -> f64 {
    let ray = |at: DVec2| optics.lens().unproject(at).ok();
    let step = 0.5;
    let (Some(middle), Some(left), Some(right), Some(up), Some(down)) = (
        ray(pixel),
        ray(pixel - DVec2::X * step),
        ray(pixel + DVec2::X * step),
        ray(pixel - DVec2::Y * step),
        ray(pixel + DVec2::Y * step),
    ) else {
        return 0.0;
    };
    let unit = |v: glam::DVec3| v.normalize_or_zero();
    let solid_angle = (unit(right) - unit(left)).cross(unit(down) - unit(up)).length();
    let direction = optics.sensor_from_camera().vector(unit(middle));
    if direction.z <= 1e-3 || solid_angle <= 0.0 {
        return 0.0;
    }
    let sideways = direction.truncate().length();
    let in_dome_mm = optics.trace(pixel).map_or(0.0, |hit| {
        let index = optics.layers().last().map_or(1.0, |layer| layer.index_for(optics.channel()));
        let cos = (1.0 - (sideways / index).powi(2)).sqrt();
        hit.surface_mm.z / cos
    });
    let mut reduced_mm = 0.0;
    for layer in optics.layers() {
        let index = layer.index_for(optics.channel());
        let cos = (1.0 - (sideways / index).powi(2)).max(1e-6).sqrt();
        reduced_mm += layer.thickness_mm.map_or(in_dome_mm, |thickness| thickness / cos) / index;
    }
    let angle = focus.pupil_diameter_mm * (1.0 / reduced_mm - 1.0 / focus.distance_mm).abs();
    let diameter_px = angle / solid_angle.sqrt();
    if diameter_px.is_finite() { diameter_px * diameter_px / 16.0 } else { 0.0 }
}

/// Diffusion by a width that follows the place.
pub(crate) struct Blur {
    half_variance: Vec<f32>,
    steps: usize,
}

impl Blur {
    /// The blur of a focussed lens.
    pub fn of(scene: &Scene, focus: &FocusSection) -> Self {
        let widths = Widths::of(scene, focus);
        let steps = steps_for(widths.largest());
        Self { half_variance: widths.plane(steps), steps }
    }
}

impl Pass for Blur {
    fn effect(&self) -> EffectName {
        EffectName::Defocus
    }

    fn stage(&self) -> Stage {
        // Once on the averaged picture, before the colour filters: effects are applied in order.
        Stage::Mosaic
    }

    fn run(&self, frame: &mut Frame, _context: &PassContext, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        let mut before = vec![0.0_f32; width];
        let mut here = vec![0.0_f32; width];
        for plane in &mut frame.planes {
            for _ in 0..self.steps {
                for (row, half) in plane.chunks_exact_mut(width).zip(self.half_variance.chunks_exact(width)) {
                    here.copy_from_slice(row);
                    diffuse_along(row, &here, half);
                }
                before.copy_from_slice(&plane[..width]);
                for y in 0..height {
                    let below = (y + 1).min(height - 1) * width;
                    here.copy_from_slice(&plane[y * width..(y + 1) * width]);
                    let half = &self.half_variance[y * width..(y + 1) * width];
                    let (upper, lower) = plane.split_at_mut((y + 1) * width);
                    let row = &mut upper[y * width..];
                    // The last row's lower neighbour is itself.
                    let next = if below > y * width { &lower[..width] } else { &here[..] };
                    for (((value, up), down), h) in row.iter_mut().zip(&before).zip(next).zip(half) {
                        *value += h * (up + down - 2.0 * *value);
                    }
                    std::mem::swap(&mut before, &mut here);
                }
            }
        }
        let units = (2 * self.steps * width * height * frame.planes.len()) as u64 / PIXELS_PER_UNIT;
        work.add(EffectName::Defocus, units);
    }
}

/// One step along a row: `row + half (left + right - 2 row)`; the ends have themselves for neighbours.
fn diffuse_along(row: &mut [f32], old: &[f32], half: &[f32]) {
    let last = row.len() - 1;
    if last == 0 {
        return;
    }
    row[0] += half[0] * (old[1] - old[0]);
    row[last] += half[last] * (old[last - 1] - old[last]);
    let inner = row[1..last].iter_mut().zip(old.windows(3)).zip(&half[1..last]);
    for ((value, three), h) in inner {
        *value = three[1] + h * (three[0] + three[2] - 2.0 * three[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blur_has_the_variance_that_is_asked_for_and_moves_nothing() {
        let (width, height) = (61, 51);
        for (variance, steps) in [(0.3, 1), (2.0, 5)] {
            let mut frame = Frame::new(width, height, 1);
            frame.planes[0][25 * width + 30] = 1.0;
            let half = vec![(0.5 * variance / steps as f64) as f32; width * height];
            let pass = Blur { half_variance: half, steps };
            let context = PassContext::default();
            pass.run(&mut frame, &context, &mut Work::default());
            let (mut sum, mut x, mut y, mut xx, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (i, v) in frame.planes[0].iter().enumerate() {
                let (dx, dy, v) = ((i % width) as f64 - 30.0, (i / width) as f64 - 25.0, f64::from(*v));
                assert!(v >= 0.0);
                sum += v;
                x += v * dx;
                y += v * dy;
                xx += v * dx * dx;
                yy += v * dy * dy;
            }
            assert!((sum - 1.0).abs() < 1e-5);
            assert!(x.abs() < 1e-5 && y.abs() < 1e-5);
            assert!((xx - variance).abs() < 1e-4 && (yy - variance).abs() < 1e-4, "{xx} {yy}");
        }
    }

    #[test]
    fn an_even_picture_stays_even_at_the_borders_too() {
        let mut frame = Frame::new(7, 5, 3);
        for plane in &mut frame.planes {
            plane.fill(0.25);
        }
        let pass = Blur { half_variance: vec![0.2; 35], steps: 3 };
        pass.run(&mut frame, &PassContext::default(), &mut Work::default());
        assert!(frame.planes.iter().flatten().all(|v| (v - 0.25).abs() < 1e-6));
    }
}
