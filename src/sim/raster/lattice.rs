//! The lit membrane in the picture: rays on a lattice, cubics between them, and every pixel's own ray where cubics do not
//! serve.
//!
//! The brightness is known at nodes every 8 px. A cell between four of them is filled by cubics through the sixteen nodes
//! about it, along x and along y, if the estimate of their error is within the tolerance. Else nodes every 4 px divide it in
//! four, each of which is asked the same; of what is left every pixel has its ray followed.
//!
//! The estimate is [`JUMP`] of the largest fourth difference of nodes in a row: as much as cubics can be off where the
//! slope of the brightness jumps, wherever in the cell it does. For a jump of the brightness itself it is a seventh more than
//! needed, for jumps of higher derivatives and smooth brightness six times and more. Where the membrane hides itself, the
//! brightness and its slope jump in the same place, and a fourth difference may lack both: there [`MIDDLE`] of what the cubics
//! are off in the middle of the cell counts as well.

use std::ops::Range;

use glam::Vec4;

use crate::raster::lens_field::{BEFORE, SPACING, lagrange};
use crate::raster::surface::{ShadedSurface, Traced};
use crate::work::Work;

/// Error of the cubic through four even nodes over the larger fourth difference about their middle two, where the slope
/// jumps once: the largest, for a jump in the middle.
const JUMP: f32 = 0.375;
/// Error of cubics over what they are off in the middle of the cell, where brightness and slope jump together and
/// [`JUMP`] of the fourth differences is less: the largest.
const MIDDLE: f32 = 3.0;
/// The sum of the sizes of a cubic's weights between the middle two nodes, at most: by this errors along x grow when they
/// are interpolated along y.
const LEBESGUE: f32 = 1.25;

/// Strides over the lattice of the wide cells and of those that divide them.
const WIDE: usize = 2;
const NARROW: usize = 1;

/// Counted work of a pixel that is interpolated.
const FILL_UNITS: u64 = 4;

/// Weights of four nodes at each pixel of a wide cell.
const WEIGHTS: [[f32; 4]; WIDE * SPACING] = {
    let mut weights = [[0.0; 4]; WIDE * SPACING];
    let mut i = 0;
    while i < WIDE * SPACING {
        let wide = lagrange(i as f64 / (WIDE * SPACING) as f64);
        let mut k = 0;
        while k < 4 {
            weights[i][k] = wide[k] as f32;
            k += 1;
        }
        i += 1;
    }
    weights
};

/// How the pixels of a cell come by their brightness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Source {
    /// Each by its own ray.
    #[default]
    Traced,
    /// By cubics through nodes so many strides apart.
    Cubics(usize),
}

/// Brightness on the lattice of a picture, for channels that share their rays; what it holds from the last picture is room.
#[derive(Debug, Clone, Default)]
pub struct Lattice {
    across: usize,
    /// Red, green and blue; NaN where a node is not known.
    nodes: Vec<Vec4>,
    /// Whether a node's ray was followed.
    asked: Vec<bool>,
    /// Of each node, of the cell right and below of it.
    sources: Vec<Source>,
    traced: Traced,
    row: Vec<Vec4>,
}

/// Lattice row or column of the first node of a pixel's cell.
fn cell(pixel: usize) -> usize {
    pixel / SPACING + BEFORE
}

impl Lattice {
    /// Follows the rays of the nodes that some pixels ask for, by row, and finds out how each cell is filled.
    pub fn prepare(&mut self, surface: &ShadedSurface<'_>, spans: &[Range<usize>], work: &mut Work) {
        let count = surface.rays.node_count();
        self.across = surface.rays.nodes_across();
        self.nodes.clear();
        self.nodes.resize(count, Vec4::NAN);
        self.asked.clear();
        self.asked.resize(count, false);
        self.sources.clear();
        self.sources.resize(count, Source::Traced);
        if surface.tolerance <= 0.0 {
            return;
        }
        let mask = channel_mask(&surface.channels);
        self.traced.start_anew();
        for (k, rows) in spans.chunks(WIDE * SPACING).enumerate() {
            let row = BEFORE + k * WIDE;
            let cells = cells_of(rows);
            for column in cells.clone().step_by(WIDE) {
                self.ask(surface, (column, row), WIDE);
            }
            for column in cells.step_by(WIDE) {
                let is_smooth = self.is_smooth(surface, (column, row), WIDE, mask);
                for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let part = (column + x, row + y);
                    let source = if is_smooth {
                        Source::Cubics(WIDE)
                    } else {
                        self.ask(surface, part, NARROW);
                        if self.is_smooth(surface, part, NARROW, mask) {
                            Source::Cubics(NARROW)
                        } else {
                            Source::Traced
                        }
                    };
                    let at = part.1 * self.across + part.0;
                    self.sources.get_mut(at).into_iter().for_each(|place| *place = source);
                }
            }
        }
        self.traced.count(surface.shading, work);
    }

    /// Follows the rays of the nodes of a cell's stencil that are not known yet.
    fn ask(&mut self, surface: &ShadedSurface<'_>, (column, row): (usize, usize), stride: usize) {
        for line in 0..6 {
            let row = row + line * stride - 2 * stride;
            let y = (row * SPACING).saturating_sub(BEFORE * SPACING);
            for k in 0..6 {
                // The corners play no part.
                if (line == 0 || line == 5) && (k == 0 || k == 5) {
                    continue;
                }
                let at = row * self.across + column + k * stride - 2 * stride;
                if self.asked.get(at) != Some(&false) {
                    continue;
                }
                self.asked[at] = true;
                let level = surface.rays.node(at).and_then(|ray| surface.ray_level(y, ray, &mut self.traced));
                level.into_iter().for_each(|level| self.nodes[at] = level);
            }
        }
    }

    /// Whether cubics serve in the cell right and below of a node.
    fn is_smooth(
        &mut self,
        surface: &ShadedSurface<'_>,
        at: (usize, usize),
        stride: usize,
        mask: Vec4,
    ) -> bool {
        if self.error(at, stride, mask) > surface.tolerance {
            return false;
        }
        let (column, row) = at;
        let pixel = |cell: usize| (cell.saturating_sub(BEFORE) * SPACING) + stride * SPACING / 2;
        let (x, y) = (pixel(column), pixel(row));
        if !surface.may_jump(y) || x >= surface.rays.width() {
            return true;
        }
        let Some(ray) = surface.rays.pixel(x, y) else { return true };
        let Some(shown) = surface.ray_level(y, ray, &mut self.traced) else { return true };
        let columns = [0, 1, 2, 3].map(|k| self.column(column + k * stride, y, stride));
        let off = (cubic(columns, &WEIGHTS[WIDE * SPACING / 2]) - shown).abs();
        (off * mask).max_element() * MIDDLE <= surface.tolerance
    }

    /// Estimate of the error of cubics in the cell right and below of a node; infinite where a node of the stencil is not
    /// known.
    fn error(&self, (column, row): (usize, usize), stride: usize, mask: Vec4) -> f32 {
        let down = self.across * stride;
        let first = row * self.across + column - 2 * (down + stride);
        let Some(stencil) = self.nodes.get(first..first + 5 * (down + stride) + 1) else {
            return f32::INFINITY;
        };
        let fourth = |start: usize, step: usize| {
            let node = |k: usize| stencil[start + k * step];
            ((node(0) + node(4)) - (node(1) + node(3)) * 4.0 + node(2) * 6.0).abs()
        };
        let (mut along_x, mut along_y, mut sum) = (Vec4::ZERO, Vec4::ZERO, Vec4::ZERO);
        for line in 1..5 {
            for k in 0..2 {
                let x = fourth(line * down + k * stride, stride);
                let y = fourth(k * down + line * stride, down);
                (along_x, along_y) = (along_x.max(x), along_y.max(y));
                // The larger of two forgets what is not a number; their sum does not.
                sum += x + y;
            }
        }
        let error = ((along_x * LEBESGUE + along_y) * JUMP * mask).max_element();
        if sum.truncate().is_finite() { error } else { f32::INFINITY }
    }

    /// Brightness of the pixels of a row, red, green and blue; only the channels asked for have a meaning.
    pub fn row(
        &mut self,
        surface: &ShadedSurface<'_>,
        y: usize,
        columns: Range<usize>,
        work: &mut Work,
    ) -> &[Vec4] {
        self.row.clear();
        self.traced.start_anew();
        // Stride and first column of the nodes that were last asked for, and what four of their columns show in the row.
        let mut known = ((0, 0), [Vec4::ZERO; 4]);
        let mut x = columns.start;
        let mut filled = 0;
        while x < columns.end {
            let (of, end) = (cell(x), columns.end.min((x / SPACING + 1) * SPACING));
            match self.sources.get(cell(y) * self.across + of) {
                Some(Source::Cubics(stride)) => {
                    let stride = *stride;
                    let first = of / stride * stride;
                    if known.0 != (stride, first) {
                        known = (
                            (stride, first),
                            [0, 1, 2, 3].map(|k| self.column(first + k * stride, y, stride)),
                        );
                    }
                    let weights = |x: usize| &WEIGHTS[x % (stride * SPACING) * (WIDE / stride)];
                    self.row.extend((x..end).map(|x| cubic(known.1, weights(x))));
                    filled += (end - x) as u64;
                }
                _ => self.row.extend((x..end).map(|x| surface.pixel_level((x, y), &mut self.traced))),
            }
            x = end;
        }
        work.add_base(filled * FILL_UNITS);
        self.traced.count(surface.shading, work);
        &self.row
    }

    /// What the cubic along y through the four nodes above and below a row shows there, one stride left of a column.
    #[inline]
    fn column(&self, column: usize, y: usize, stride: usize) -> Vec4 {
        let row = cell(y) / stride * stride;
        let start = (row - stride) * self.across + column - stride;
        let w = &WEIGHTS[y % (stride * SPACING) * (WIDE / stride)];
        let node = |k: usize| self.nodes.get(start + k * stride * self.across).copied().unwrap_or(Vec4::NAN);
        cubic([0, 1, 2, 3].map(node), w)
    }
}

/// What four nodes in a row show where a cubic through them has these weights.
#[inline]
fn cubic([a, b, c, d]: [Vec4; 4], w: &[f32; 4]) -> Vec4 {
    (a * w[0] + b * w[1]) + (c * w[2] + d * w[3])
}

/// The columns of wide cells, of which every second counts, that some rows of pixels, all of one row of wide cells, ask for.
fn cells_of(spans: &[Range<usize>]) -> Range<usize> {
    let asked = || spans.iter().filter(|span| !span.is_empty());
    let (first, end) = (asked().map(|span| span.start).min(), asked().map(|span| span.end).max());
    match (first, end) {
        (Some(first), Some(end)) => cell(first) / WIDE * WIDE..cell(end - 1) + 1,
        _ => 0..0,
    }
}

/// 1 for the channels that are asked for.
fn channel_mask(channels: &Range<usize>) -> Vec4 {
    let asked = |lane: usize| if channels.contains(&lane) { 1.0 } else { 0.0 };
    Vec4::new(asked(0), asked(1), asked(2), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The larger fourth difference of six nodes about a cell, and how far the cubic through the middle four is off in it.
    fn of_cubic(f: impl Fn(f64) -> f64) -> (f64, impl Fn(f64) -> f64) {
        let nodes: [f64; 6] = std::array::from_fn(|k| f(k as f64 - 2.0));
        let fourth = |k: usize| {
            (nodes[k] - 4.0 * nodes[k + 1] + 6.0 * nodes[k + 2] - 4.0 * nodes[k + 3] + nodes[k + 4]).abs()
        };
        let off = move |t: f64| {
            let cubic: f64 = lagrange(t).iter().zip(&nodes[1..5]).map(|(w, v)| w * v).sum();
            (cubic - f(t)).abs()
        };
        (fourth(0).max(fourth(1)), off)
    }

    /// The constant of the estimate: jumps of the value, the slope, and the next two derivatives, anywhere about a cell.
    #[test]
    fn cubics_are_off_by_no_more_than_the_estimate_where_something_jumps() {
        let mut largest = [0.0_f64; 4];
        for (order, largest) in largest.iter_mut().enumerate() {
            for jump in (-200..=300).map(|k| f64::from(k) / 100.0) {
                let f = |x: f64| if x > jump { (x - jump).powi(order as i32) } else { 0.0 };
                let (difference, off) = of_cubic(f);
                for t in (0..=100).map(|k| f64::from(k) / 100.0) {
                    let off = off(t);
                    assert!(off <= f64::from(JUMP) * difference + 1e-12, "{order} {jump} {t}: {off}");
                    if difference > 1e-9 {
                        *largest = largest.max(off / difference);
                    }
                }
            }
        }
        println!("error over fourth difference by order of the jump: {largest:.3?}");
        assert!((largest[1] - f64::from(JUMP)).abs() < 1e-3);
        assert!(largest[2] < 0.2 * largest[1] && largest[3] < 0.2 * largest[1]);
    }

    /// The same for a jump of the value and of the slope in one place, where the fourth differences of the two may cancel.
    #[test]
    fn the_middle_shows_where_a_jump_and_a_crease_cancel() {
        let mut largest = [0.0_f64; 2];
        for jump in (-200..=300).map(|k| f64::from(k) / 100.0) {
            for turn in (0..360).map(|k| f64::from(k).to_radians()) {
                let f = |x: f64| if x > jump { turn.cos() + turn.sin() * (x - jump) } else { 0.0 };
                let (difference, off) = of_cubic(f);
                let estimate = f64::from(JUMP) * difference;
                let with_middle = estimate.max(f64::from(MIDDLE) * off(0.5));
                for off in (0..=100).map(|k| off(f64::from(k) / 100.0)).filter(|off| *off > 1e-9) {
                    largest = [largest[0].max(off / estimate), largest[1].max(off / with_middle)];
                }
            }
        }
        println!("error over the estimate, without and with the middle: {largest:.3?}");
        assert!(largest[0] > 2.0 && largest[1] < 1.0);
    }
}
