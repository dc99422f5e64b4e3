//! Blobs against the marks that are looked for.

use glam::{DMat2, DVec2};

use crate::frames::{Blob, BlobSide, Gray, blobs, centroid, local_levels};

/// Least difference between mark and surroundings, of the full range.
const MIN_CONTRAST: f32 = 0.08;
/// A blob's area over that of the mark may lie between these.
const AREA_RANGE: [f64; 2] = [0.35, 2.5];
/// Least fullness of a mark's blob (see [`Blob::fullness`]).
const MIN_FULLNESS: f64 = 0.8;

/// A mark that is looked for: where it should be, how large, how far from its neighbour.
pub(super) struct Wanted {
    pub id: usize,
    pub at_px: DVec2,
    pub area_px: f64,
    pub spacing_px: f64,
}

/// Area inside a closed outline, px^2.
pub(super) fn area_of(outline: &[DVec2]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    0.5 * outline.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>().abs()
}

/// Marks with their distance to the nearest other one.
pub(super) fn with_spacing(marks: Vec<(usize, DVec2, f64)>) -> Vec<Wanted> {
    let nearest = |at: DVec2| {
        let others = marks.iter().map(|(_, other, _)| other.distance(at)).filter(|d| *d > 0.0);
        others.fold(f64::INFINITY, f64::min)
    };
    marks
        .iter()
        .map(|(id, at_px, area_px)| Wanted {
            id: *id,
            at_px: *at_px,
            area_px: *area_px,
            spacing_px: nearest(*at_px),
        })
        .collect()
}

/// The blobs of a frame, and to which of them each pixel belongs.
pub(super) struct Blobs {
    pub all: Vec<Blob>,
    /// Number of a pixel's blob plus one, by rows; 0 for none.
    owner: Vec<u32>,
    width: usize,
    height: usize,
}

impl Blobs {
    /// Those on one side of the level halfway between the extremes around; over squares that hold the largest mark
    /// and its surroundings.
    pub fn of(smooth: &Gray, side: BlobSide, wanted: &[Wanted]) -> Self {
        let largest = wanted.iter().map(|one| one.area_px).fold(1.0, f64::max);
        // The diameter of a disc of that area, and half of it around.
        let reach = (1.5 * (4.0 * largest / std::f64::consts::PI).sqrt()).ceil() as usize + 2;
        let levels = local_levels(smooth, reach);
        let all = blobs(smooth, side, |i| (levels.contrast[i] >= MIN_CONTRAST).then_some(levels.middle[i]));
        let (width, height) = (smooth.width(), smooth.height());
        let mut owner = vec![0; width * height];
        for (number, blob) in (1..).zip(&all) {
            for [x, y] in &blob.pixels {
                owner[*y as usize * width + *x as usize] = number;
            }
        }
        Self { all, owner, width, height }
    }

    /// Numbers of the blobs within reach of a place that have about the mark's area, are full and whole.
    pub fn near(&self, wanted: &Wanted, at: DVec2, reach: f64) -> impl Iterator<Item = usize> {
        let (reach, area) = (reach * wanted.spacing_px, wanted.area_px);
        let whole = move |blob: &Blob| {
            let [[x0, y0], [x1, y1]] = blob.corners;
            x0 > 0 && y0 > 0 && (x1 as usize) + 1 < self.width && (y1 as usize) + 1 < self.height
        };
        let fits = move |blob: &Blob| {
            let part = blob.area_px() as f64 / area;
            blob.middle_px.distance(at) <= reach
                && (AREA_RANGE[0]..=AREA_RANGE[1]).contains(&part)
                && whole(blob)
                && blob.fullness() >= MIN_FULLNESS
        };
        self.all.iter().enumerate().filter(move |(_, blob)| fits(blob)).map(|(number, _)| number)
    }

    pub fn centroid(&self, frame: &Gray, number: usize) -> Option<DVec2> {
        let own = number as u32 + 1;
        let taken = |x: u32, y: u32| {
            let owner = self.owner[y as usize * self.width + x as usize];
            owner != 0 && owner != own
        };
        Some(centroid(frame, &self.all[number], taken)?.at_px)
    }
}

/// One of each list, in all ways, the first of each first.
pub(super) fn combinations(choices: &[Vec<DVec2>]) -> Vec<Vec<DVec2>> {
    let mut all = vec![Vec::new()];
    for list in choices {
        // Sensors have four markers; with more, the nearest of each is what is tried.
        let list = if all.len() > 256 { &list[..1] } else { list.as_slice() };
        all = all
            .into_iter()
            .flat_map(|head: Vec<DVec2>| list.iter().map(move |at| [head.as_slice(), &[*at]].concat()))
            .collect();
    }
    all
}

/// The affine map that takes the first of each pair nearest to the second (shift, matrix), pairs far off left out;
/// a shift alone where there are few.
pub(super) fn affine(pairs: &[(DVec2, DVec2)]) -> Option<(DVec2, DMat2)> {
    if pairs.is_empty() {
        return None;
    }
    let mut shifts: Vec<[f64; 2]> = pairs.iter().map(|(a, b)| (*b - *a).to_array()).collect();
    let mut middle_of = |axis: usize| {
        shifts.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
        shifts[shifts.len() / 2][axis]
    };
    let shift = DVec2::new(middle_of(0), middle_of(1));
    if pairs.len() < 8 {
        return Some((shift, DMat2::IDENTITY));
    }
    let (mut offset, mut matrix) = (shift, DMat2::IDENTITY);
    for _ in 0..5 {
        let left = |(a, b): &(DVec2, DVec2)| (*b - (matrix * *a + offset)).length();
        let mut sizes: Vec<f64> = pairs.iter().map(left).collect();
        sizes.sort_by(f64::total_cmp);
        let scale = sizes[sizes.len() / 2].max(0.05);
        let mut normal = nalgebra::Matrix3::zeros();
        let (mut right_x, mut right_y) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros());
        for pair in pairs {
            let u = left(pair) / (4.0 * scale);
            let weight = if u < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 };
            let terms = nalgebra::Vector3::new(1.0, pair.0.x, pair.0.y);
            normal += terms * terms.transpose() * weight;
            right_x += terms * (weight * pair.1.x);
            right_y += terms * (weight * pair.1.y);
        }
        let solver = normal.cholesky()?;
        let (x, y) = (solver.solve(&right_x), solver.solve(&right_y));
        offset = DVec2::new(x[0], y[0]);
        matrix = DMat2::from_cols(DVec2::new(x[1], y[1]), DVec2::new(x[2], y[2]));
    }
    (offset.is_finite() && matrix.is_finite()).then_some((offset, matrix))
}
