//! How the dots of two sides differ.

use std::collections::BTreeMap;

use serde_json::Value;

use super::difference::DotDifference;
use super::side::{CompareSide, numbers};

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

pub(super) fn dots(a: &CompareSide, b: &CompareSide) -> DotDifference {
    let list = |side: &CompareSide| -> Vec<Value> {
        side.constants.get("black_dots").and_then(Value::as_array).cloned().unwrap_or_default()
    };
    let (left, right) = (list(a), list(b));
    let places = |dots: &[Value]| -> Vec<[f64; 2]> {
        dots.iter().map(|dot| numbers(dot, "image_px").unwrap_or([f64::NAN; 2])).collect()
    };
    let (from, to) = (places(&left), places(&right));
    let (grid_a, grid_b) = (Grid::new(&from), Grid::new(&to));
    let reach = 0.5 * grid_a.spacing().min(grid_b.spacing());
    let mut pairs = Vec::new();
    for (i, &point) in from.iter().enumerate() {
        let Some((j, gap)) = grid_b.nearest(point) else { continue };
        if gap <= reach && grid_a.nearest(to[j]).is_some_and(|(back, _)| back == i) {
            pairs.push((i, j));
        }
    }
    let spread = |gap: &dyn Fn(&Value, &Value) -> Option<f64>| {
        let gaps: Vec<f64> = pairs.iter().filter_map(|&(i, j)| gap(&left[i], &right[j])).collect();
        let largest = gaps.iter().copied().fold(0.0, f64::max);
        (!gaps.is_empty()).then(|| [gaps.iter().sum::<f64>() / gaps.len() as f64, largest])
    };
    DotDifference {
        counts: [left.len(), right.len()],
        paired: pairs.len(),
        image_px: spread(&|p, q| Some(distance::<2>(numbers(p, "image_px")?, numbers(q, "image_px")?))),
        surface_mm: spread(&|p, q| Some(distance::<3>(numbers(p, "surface_mm")?, numbers(q, "surface_mm")?))),
        plate_mm: spread(&|p, q| Some(distance::<2>(numbers(p, "plate_mm")?, numbers(q, "plate_mm")?))),
        diameter_mm: spread(&|p, q| {
            Some((p.get("diameter_mm")?.as_f64()? - q.get("diameter_mm")?.as_f64()?).abs())
        }),
    }
}

/// Points sorted into cells, so that the nearest is found without looking at all of them.
struct Grid<'a> {
    points: &'a [[f64; 2]],
    cells: BTreeMap<(i64, i64), Vec<usize>>,
    side: f64,
}

impl<'a> Grid<'a> {
    fn new(points: &'a [[f64; 2]]) -> Self {
        let finite = || points.iter().filter(|p| p.iter().all(|v| v.is_finite()));
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in finite() {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let area = ((high[0] - low[0]) * (high[1] - low[1])).max(1.0);
        let side = if area.is_finite() { (area / points.len().max(1) as f64).sqrt() } else { 1.0 };
        let mut cells: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
        for (index, p) in points.iter().enumerate().filter(|(_, p)| p.iter().all(|v| v.is_finite())) {
            cells.entry(Self::cell(*p, side)).or_default().push(index);
        }
        Self { points, cells, side }
    }

    fn cell(p: [f64; 2], side: f64) -> (i64, i64) {
        ((p[0] / side).floor() as i64, (p[1] / side).floor() as i64)
    }

    /// About the pitch of the points, px.
    fn spacing(&self) -> f64 {
        self.side
    }

    /// The nearest point within one cell, and its distance.
    fn nearest(&self, p: [f64; 2]) -> Option<(usize, f64)> {
        let (x, y) = Self::cell(p, self.side);
        let around = (x - 1..=x + 1).flat_map(|i| (y - 1..=y + 1).map(move |j| (i, j)));
        around
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .map(|&index| (index, distance(p, self.points[index])))
            .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
    }
}
