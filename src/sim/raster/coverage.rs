//! How much of each pixel a polygon covers, exactly.

use std::ops::Range;

use glam::DVec2;

/// Coverage of the pixels of a box by a polygon, 0 to 1.
#[derive(Debug, Default, Clone)]
pub struct Coverage {
    left: i64,
    top: i64,
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// Less of a share is rounding: what the running sum leaves behind a polygon.
pub const MIN_SHARE: f32 = 1e-4;

/// No polygon covers a wider box; a larger one is clipped first.
const LARGEST_BOX_PX: f64 = 20_000.0;

impl Coverage {
    /// Fills in a simple polygon, of either sense; its points are px, pixel centres whole numbers.
    ///
    /// Each edge adds the area between itself and the box's right side to the pixels that it crosses, with the
    /// sign of its direction; a running sum along each row then gives the covered area of every pixel, without
    /// any sampling. A polygon that is not finite, empty or wider than 20000 px covers nothing.
    pub fn fill(&mut self, polygon: &[DVec2]) {
        self.fill_rings(polygon, DVec2::ZERO, &[1.0]);
    }

    /// The mean coverage by copies of a polygon that are scaled about a centre.
    pub fn fill_rings(&mut self, polygon: &[DVec2], center: DVec2, scales: &[f64]) {
        self.values.clear();
        (self.width, self.height) = (0, 0);
        let largest = scales.iter().copied().fold(0.0, f64::max);
        let mut low = DVec2::INFINITY;
        let mut high = DVec2::NEG_INFINITY;
        for point in polygon {
            if !point.is_finite() {
                return;
            }
            low = low.min(*point);
            high = high.max(*point);
        }
        if scales != [1.0] {
            // The largest copy; it holds the others where the centre lies inside.
            low = (center + (low - center) * largest).min(low);
            high = (center + (high - center) * largest).max(high);
        }
        if polygon.len() < 3
            || largest <= 0.0
            || (high - low).max_element() > LARGEST_BOX_PX
            || low.abs().max_element() > 1e9
        {
            return;
        }
        // Pixel i covers i - 0.5 to i + 0.5.
        let origin = (low + 0.5).floor();
        let far = (high + 0.5).floor();
        (self.left, self.top) = (origin.x as i64, origin.y as i64);
        self.width = (far.x - origin.x) as usize + 1;
        self.height = (far.y - origin.y) as usize + 1;
        // One more column takes what an edge in the last one leaves for its right neighbour.
        let stride = self.width + 1;
        self.values.resize(stride * self.height, 0.0);
        let Some(last) = polygon.last() else { return };
        let share = 1.0 / scales.len() as f64;
        for scale in scales {
            let local = |point: DVec2| {
                let placed = if *scale == 1.0 { point } else { center + (point - center) * *scale };
                placed + 0.5 - origin
            };
            let mut from = local(*last);
            for point in polygon {
                let to = local(*point);
                add_edge(&mut self.values, stride, from, to, share);
                from = to;
            }
        }
        for row in self.values.chunks_exact_mut(stride) {
            let mut sum = 0.0_f32;
            let mut add_up = |values: &mut [f32]| {
                for value in values {
                    sum += *value;
                    *value = sum.abs().min(1.0);
                }
                sum.abs().min(1.0)
            };
            let (wide, last) = row.as_chunks_mut::<16>();
            let mut so_far = 0.0;
            for values in wide {
                // Most of a wide polygon's pixels are crossed by no edge: the sum does not wait for each of them.
                if values.iter().fold(0, |any, value| any | value.to_bits()) == 0 {
                    *values = [so_far; 16];
                } else {
                    so_far = add_up(values);
                }
            }
            add_up(last);
        }
    }

    /// Rows of the box inside a picture: the picture's row and first column, and the coverage from there.
    pub fn rows(&self, width: usize, height: usize) -> impl Iterator<Item = (usize, usize, &[f32])> {
        let [_, top, _, bottom] = self.bounds(width, height);
        (top..bottom).filter_map(move |y| self.row(y, width).map(|(x, part)| (y, x, part)))
    }

    /// The same of one row of a picture; `None` where the box has none.
    pub fn row(&self, y: usize, width: usize) -> Option<(usize, &[f32])> {
        let stride = self.width + 1;
        let index = usize::try_from(y as i64 - self.top).ok().filter(|index| *index < self.height)?;
        let row = self.values.get(index * stride..(index + 1) * stride)?;
        let skip = usize::try_from(-self.left).unwrap_or(0).min(self.width);
        let x = usize::try_from(self.left).unwrap_or(0);
        let count = (self.width - skip).min(width.saturating_sub(x));
        let part = row.get(skip..skip + count).filter(|part| !part.is_empty())?;
        Some((x, part))
    }

    /// The box's columns and rows inside a picture, ends excluded.
    pub fn bounds(&self, width: usize, height: usize) -> [usize; 4] {
        let clamp = |value: i64, max: usize| usize::try_from(value).unwrap_or(0).min(max);
        [
            clamp(self.left, width),
            clamp(self.top, height),
            clamp(self.left + self.width as i64, width),
            clamp(self.top + self.height as i64, height),
        ]
    }

    /// Writes for some rows of a picture the columns between the first and last pixel with a share worth the name; rows
    /// that the box does not reach are left alone.
    pub fn spans(&self, width: usize, height: usize, rows: &Range<usize>, spans: &mut [Range<usize>]) {
        for (y, x, part) in self.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
            let first = part.iter().position(|share| *share > MIN_SHARE);
            let last = part.iter().rposition(|share| *share > MIN_SHARE);
            if let (Some(first), Some(last), Some(span)) = (first, last, spans.get_mut(y)) {
                *span = x + first..x + last + 1;
            }
        }
    }

    /// Pixels of the box.
    pub fn area(&self) -> usize {
        self.width * self.height
    }
}

/// Adds an edge to the accumulation: for each row that it crosses, its height there, split between the pixels by
/// the area to its right.
fn add_edge(values: &mut [f32], stride: usize, from: DVec2, to: DVec2, share: f64) {
    let (low, high) = (from.min(to), from.max(to));
    let (first_row, column) = (floor(low.y), floor(low.x));
    if high.y <= (first_row + 1) as f64 && high.x <= (column + 1) as f64 {
        // Most edges of small polygons lie in one pixel: the part right of the edge's middle is covered.
        let (height, middle) = (share * (to.y - from.y), 0.5 * (from.x + to.x) - column as f64);
        let start = first_row * stride + column;
        if let Some([here, right]) = values.get_mut(start..start + 2) {
            *here += (height * (1.0 - middle)) as f32;
            *right += (height * middle) as f32;
        }
        return;
    }
    if from.y == to.y {
        return;
    }
    let (sign, a, b) = if from.y < to.y { (share, from, to) } else { (-share, to, from) };
    let per_row = (b.x - a.x) / (b.y - a.y);
    let mut row_number = first_row;
    let (mut x, mut y) = (a.x, a.y);
    while y < b.y {
        let Some(row) = values.get_mut(row_number * stride..(row_number + 1) * stride) else { break };
        row_number += 1;
        let end = b.y.min(row_number as f64);
        let next_x = if end == b.y { b.x } else { a.x + per_row * (end - a.y) };
        add_piece(row, sign * (end - y), x, next_x);
        (x, y) = (next_x, end);
    }
}

/// The floor of a place in the box. Places are not negative, and fewer than short whole numbers are, which machines make at
/// once.
#[inline]
fn floor(place: f64) -> usize {
    place as i32 as usize
}

/// Adds the part of an edge inside one row: signed height `dy`, between two columns.
fn add_piece(row: &mut [f32], dy: f64, x0: f64, x1: f64) {
    let (low, high) = if x0 < x1 { (x0, x1) } else { (x1, x0) };
    let start = floor(low);
    let first = start as f64;
    if high <= first + 1.0 {
        // Inside one pixel: the part right of the edge's middle is covered.
        let middle = 0.5 * (low + high) - first;
        add(row, start, dy * (1.0 - middle));
        add(row, start + 1, dy * middle);
        return;
    }
    // Over several pixels: the covered area of each is an integral of the edge's share of the row so far.
    let per_px = dy / (high - low);
    let share = |to: f64| per_px * (to - low);
    // Area right of the edge within pixel i, summed: the integral of the height over the pixel.
    let mut done = 0.0;
    let mut pixel = start;
    let mut from = low;
    while from < high {
        let end = high.min((pixel + 1) as f64);
        let height = share(end) - share(from);
        // Part of the pixel right of this piece's middle.
        let middle = 0.5 * (from + end) - pixel as f64;
        let covered = height * (1.0 - middle);
        add(row, pixel, covered + done);
        done = height - covered;
        from = end;
        pixel += 1;
    }
    add(row, pixel, done);
}

fn add(row: &mut [f32], index: usize, value: f64) {
    if let Some(place) = row.get_mut(index) {
        *place += value as f32;
    }
}

/// Area (signed) and first moment of a polygon.
pub fn area_moment(polygon: &[DVec2]) -> (f64, DVec2) {
    let Some(origin) = polygon.first().copied() else { return (0.0, DVec2::ZERO) };
    let mut area = 0.0;
    let mut moment = DVec2::ZERO;
    let mut from = polygon.last().map_or(DVec2::ZERO, |p| *p - origin);
    for point in polygon {
        let to = *point - origin;
        let cross = from.perp_dot(to);
        area += 0.5 * cross;
        moment += (from + to) * (cross / 6.0);
        from = to;
    }
    (area, moment + origin * area)
}

/// The part of a polygon where `normal . p <= offset` (Sutherland and Hodgman); right for convex polygons, and
/// for others where the cut leaves one piece.
pub fn clip(polygon: &[DVec2], normal: DVec2, offset: f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 2);
    let Some(mut from) = polygon.last().copied() else { return kept };
    let mut from_out = normal.dot(from) - offset;
    for to in polygon.iter().copied() {
        let to_out = normal.dot(to) - offset;
        if (from_out > 0.0) != (to_out > 0.0) {
            kept.push(from + (to - from) * (from_out / (from_out - to_out)));
        }
        if to_out <= 0.0 {
            kept.push(to);
        }
        (from, from_out) = (to, to_out);
    }
    kept
}

/// The part of a polygon inside a picture's raster.
pub fn clip_to_image(polygon: &[DVec2], width: usize, height: usize) -> Vec<DVec2> {
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    let inside = |p: &DVec2| p.x >= -0.5 && p.y >= -0.5 && p.x <= right && p.y <= bottom;
    if polygon.iter().all(inside) {
        return polygon.to_vec();
    }
    let mut kept = clip(polygon, -DVec2::X, 0.5);
    kept = clip(&kept, -DVec2::Y, 0.5);
    kept = clip(&kept, DVec2::X, right);
    clip(&kept, DVec2::Y, bottom)
}
