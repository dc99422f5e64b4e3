//! What the colours of a cell say of the skin there.

use glam::Vec3A;
use rayon::prelude::*;

use super::estimator::ShapeFromColor;
use super::fill::Weighted;
use super::normals::{self, CellReading, FILLED_SD_RAD};
use super::rows::{MIN_ROWS, share};

/// Step along the ray over which the readings' turn is taken, mm, and what each channel is known to there: a hundredth.
const TURN_STEP_MM: f32 = 0.2;
const TURN_PRECISION: f32 = 1e4;

/// Variance of a reading's tilt, rad^2, from which on there is no light to read by: the skin is taken to be as
/// at rest there.
const MAX_SPREAD: f32 = 0.03;

/// By how much a level may be off beside noise, of itself and of the brightest channel beside it: the constants' light, a part
/// of a hundred, and what a camera's JPEG makes of colours.
const LEVEL_ERROR: f32 = 0.005;

/// A channel that is known so well, a part of itself, is bright.
const BRIGHT_SD: f32 = 0.02;

/// Squares of what is left over, in deviations, up to which a reading counts in full, and from which on not at all.
const GOOD_MISFIT: f32 = 6.0;
const BAD_MISFIT: f32 = 30.0;

impl ShapeFromColor {
    /// How readings turn with depth, on the undeformed dome: with it the light need not be taken again and again.
    pub(super) fn turn(&mut self) {
        let (light, view) = (&self.light, &self.view);
        self.turns.take(&self.cells, view, |cell| {
            let (at, ray, out) = (view.surface_mm[cell], view.ray[cell], view.normal[cell]);
            let here = light.at(at);
            let irradiance = here.base + here.along(out);
            let precision = irradiance.max(Vec3A::splat(1e-12)).powf(-2.0) * TURN_PRECISION;
            let deeper = light.at(at - ray * TURN_STEP_MM);
            let along = out.any_orthonormal_vector();
            let reading = normals::read(&deeper, irradiance, precision, Vec3A::ZERO, out, along)?;
            Some((out - reading.normal) / TURN_STEP_MM)
        });
        let rows = self.turn_per_mm.par_chunks_mut(self.cells.width).zip(&view.spans).enumerate();
        rows.with_min_len(share(MIN_ROWS)).for_each(|(row, (turns, span))| {
            span.clone().for_each(|column| turns[column] = self.turns.at(column, row));
        });
    }

    /// Reads a cell's normal, one step from that of the skin as it is known.
    #[inline]
    pub(super) fn read_cell(&self, cell: usize) -> CellReading {
        let nothing = CellReading::default();
        let (view, width) = (&self.view, self.cells.width);
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        if !is_dome(cell) || self.covered[cell] {
            return nothing;
        }
        // Where a channel is cut off there is light, so that the skin is not taken to be as at rest but as around.
        let is_cut_off = self.levels[cell].is_known.min_element() <= 0.0;
        let light = self.light.at(self.points_mm[cell]);
        let (irradiance, precision, noise) = self.irradiance(cell, light.direct);
        // So it is where all colours are well seen and say nothing of slopes, as halfway between two lights of one colour.
        let is_bright = (irradiance * irradiance * precision).min_element() * BRIGHT_SD.powi(2) > 1.0;
        let unlit = if is_cut_off || is_bright {
            nothing
        } else {
            CellReading { tilt: Weighted::new(Vec3A::ZERO, 1.0), ..nothing }
        };
        let point = |cell: usize| self.points_mm[cell];
        let at = point(cell);
        let between = |before: usize, after: usize| match (is_dome(before), is_dome(after)) {
            (true, true) => Some(point(after) - point(before)),
            (false, true) => Some(point(after) - at),
            (true, false) => Some(at - point(before)),
            (false, false) => None,
        };
        let right = between(cell.wrapping_sub(1), cell + 1);
        let below = between(cell.wrapping_sub(width), cell + width);
        let (Some(right), Some(below)) = (right, below) else { return nothing };
        let (out, ray) = (view.normal[cell], view.ray[cell]);
        let guess = right.cross(below).normalize_or(out);
        let guess = if guess.dot(ray) < 0.0 { -guess } else { guess };
        let Some(reading) = normals::read(&light, irradiance, precision, noise, guess, right) else {
            return unlit;
        };
        let [xx, _, yy] = reading.covariance;
        if reading.misfit > BAD_MISFIT {
            return nothing;
        }
        if 0.5 * (xx + yy) > MAX_SPREAD {
            return unlit;
        }
        let good = (GOOD_MISFIT / reading.misfit.max(GOOD_MISFIT)).min(1.0);
        let [t1, t2] = normals::tangents(guess, right);
        let turn = glam::Vec2::new(below.dot(t1), below.dot(t2)).normalize_or_zero();
        let down =
            |[xx, xy, yy]: [f32; 3]| turn.x * turn.x * xx + 2.0 * turn.x * turn.y * xy + turn.y * turn.y * yy;
        // What the reading and its surroundings say together.
        let filled = FILLED_SD_RAD * FILLED_SD_RAD;
        let weight = good * filled / (good * filled + 0.5 * (xx + yy));
        CellReading {
            tilt: Weighted::new(reading.normal - out, weight),
            spread: [xx, down(reading.covariance)].map(|v| v * filled / (v + good * filled)),
            noise: [reading.noise[0], down(reading.noise)].map(|v| v / good),
            is_read: true,
        }
    }

    /// Irradiance of a cell, of which so much comes straight from the lights where the skin is at rest, by the picture, one over its variance, and the variance that noise alone has, by channel.
    #[inline]
    fn irradiance(&self, cell: usize, direct: Vec3A) -> (Vec3A, Vec3A, Vec3A) {
        let variance = self.noise * self.noise / (self.cells.px * self.cells.px) as f32;
        let (view, level) = (&self.view, &self.levels[cell]);
        let gain = self.light.passed(view.ray[cell].z) * self.gain[cell];
        let known_gain = gain.max(Vec3A::splat(1e-12));
        let irradiance = (level.light - Vec3A::splat(self.light.stray)) / known_gain;
        // Where noise would be cut off at black its mean is not the light; what the dome throws on itself alone says little of slopes.
        let is_lit = Vec3A::select((gain * direct).cmpgt(2.0 * self.noise), Vec3A::ONE, Vec3A::ZERO);
        let off = (level.light + Vec3A::splat(level.light.max_element())) * LEVEL_ERROR;
        let precision = gain * gain * level.is_known * is_lit / (off * off + variance);
        (irradiance, precision, variance / (known_gain * known_gain))
    }
}
