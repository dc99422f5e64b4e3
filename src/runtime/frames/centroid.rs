//! The middle of a blob, from its grey pixels.

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

use super::blobs::Blob;
use super::gray::Gray;

/// Pixels around a blob that still carry its edge: blur, sharpening and the sampling of a sharp edge reach so far.
const EDGE: i64 = 2;
/// Pixels beyond these that show what lies behind the blob.
const GROUND: i64 = 2;

/// Ground that strays from a plane by more than this part of the mark's contrast is uneven.
const MAX_ROUGHNESS: f64 = 0.08;
/// Pixels where the mark stands out by less than this part of its contrast do not count.
const MIN_DEPTH: f64 = 0.3;
/// Fewest pixels that a plane of the ground is fitted through.
const MIN_GROUND_PIXELS: usize = 6;

/// A blob's middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centroid {
    /// Where it is, px.
    pub at_px: DVec2,
    /// Area that the grey values mean, px^2: edge pixels count by how much of them is covered.
    pub area_px: f64,
    /// Mean difference from the ground inside of the blob; negative for dark ones.
    pub contrast: f64,
}

/// The pixels around a blob, and how far each is from it.
struct Surroundings<'a> {
    frame: &'a Gray,
    blob: &'a Blob,
    left: i64,
    top: i64,
    width: i64,
    height: i64,
    /// Steps to the eight neighbours from the blob, up to [`FAR`].
    distance: Vec<i64>,
}

/// One step more than what is used.
const FAR: i64 = EDGE + GROUND + 1;

impl<'a> Surroundings<'a> {
    fn new(frame: &'a Gray, blob: &'a Blob) -> Self {
        let [[x0, y0], [x1, y1]] = blob.corners.map(|corner| corner.map(i64::from));
        let (left, top) = (x0 - EDGE - GROUND, y0 - EDGE - GROUND);
        let (width, height) = (x1 + EDGE + GROUND - left + 1, y1 + EDGE + GROUND - top + 1);
        let distance = vec![FAR; (width * height) as usize];
        let mut made = Self { frame, blob, left, top, width, height, distance };
        for [x, y] in &blob.pixels {
            let (x, y) = (i64::from(*x), i64::from(*y));
            for dy in -(FAR - 1)..FAR {
                for dx in -(FAR - 1)..FAR {
                    let index = made.index(x + dx, y + dy);
                    if let Some(slot) = made.distance.get_mut(index) {
                        *slot = (*slot).min(dx.abs().max(dy.abs()));
                    }
                }
            }
        }
        made
    }

    fn index(&self, x: i64, y: i64) -> usize {
        ((y - self.top) * self.width + (x - self.left)) as usize
    }

    fn distance(&self, x: i64, y: i64) -> i64 {
        self.distance[self.index(x, y)]
    }

    fn size(&self) -> (i64, i64) {
        (self.frame.width() as i64, self.frame.height() as i64)
    }

    /// All pixels that lie in the frame.
    fn pixels(&self) -> impl Iterator<Item = (i64, i64)> {
        let (cols, rows) = self.size();
        let columns = self.left.max(0)..(self.left + self.width).min(cols);
        (self.top.max(0)..(self.top + self.height).min(rows))
            .flat_map(move |y| columns.clone().map(move |x| (x, y)))
    }

    fn value(&self, x: i64, y: i64) -> f64 {
        f64::from(self.frame.at(x as isize, y as isize))
    }

    fn offset_px(&self, x: i64, y: i64) -> DVec2 {
        DVec2::new(x as f64, y as f64) - self.blob.middle_px
    }

    /// Whether another blob is so near that its edge may reach here.
    fn is_near_other(&self, x: i64, y: i64, taken: impl Fn(u32, u32) -> bool) -> bool {
        let (cols, rows) = self.size();
        let (columns, lines) = (self.left..self.left + self.width, self.top..self.top + self.height);
        (-EDGE..=EDGE).any(|dy| {
            (-EDGE..=EDGE).any(|dx| {
                let (x, y) = (x + dx, y + dy);
                (0..cols).contains(&x) && (0..rows).contains(&y) && {
                    let inside = columns.contains(&x) && lines.contains(&y);
                    let own = inside && self.distance(x, y) == 0;
                    !own && taken(x as u32, y as u32)
                }
            })
        })
    }

    /// The mark's own value, from pixels that no edge touches where there are any.
    fn mark(&self) -> f64 {
        let is_own = |x: i64, y: i64| self.distance.get(self.index(x, y)).is_none_or(|steps| *steps == 0);
        let inner = |x: i64, y: i64| (-1..=1).all(|dy| (-1..=1).all(|dx| is_own(x + dx, y + dy)));
        let places = || self.blob.pixels.iter().map(|[x, y]| (i64::from(*x), i64::from(*y)));
        let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let value = |(x, y): (i64, i64)| self.value(x, y);
        let core: Vec<f64> = places().filter(|(x, y)| inner(*x, *y)).map(value).collect();
        if core.is_empty() { mean_of(&places().map(value).collect::<Vec<f64>>()) } else { mean_of(&core) }
    }

    /// Sum and first moment about the blob's middle of the pixels' weights up to some steps from the blob.
    fn moments(&self, reach: i64, weight: impl Fn(i64, i64) -> Option<f64>) -> (f64, DVec2) {
        let (mut sum, mut moment) = (0.0, DVec2::ZERO);
        for (x, y) in self.pixels().filter(|(x, y)| self.distance(*x, *y) <= reach) {
            if let Some(weight) = weight(x, y) {
                sum += weight;
                moment += self.offset_px(x, y) * weight;
            }
        }
        (sum, moment)
    }
}

/// The plane through ground pixels (value at the blob's middle, slopes), and the pixels.
struct GroundPlane {
    plane: Vector3<f64>,
    pixels: Vec<(Vector3<f64>, f64)>,
}

impl GroundPlane {
    /// `None` where the frame's border or other blobs leave too little ground.
    fn new(around: &Surroundings<'_>, taken: impl Fn(u32, u32) -> bool) -> Option<Self> {
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        let mut pixels = Vec::new();
        for (x, y) in around.pixels() {
            let steps = around.distance(x, y);
            // A neighbour's own edge is no ground either.
            if steps > EDGE && steps < FAR && !around.is_near_other(x, y, &taken) {
                let d = around.offset_px(x, y);
                let terms = Vector3::new(1.0, d.x, d.y);
                let value = around.value(x, y);
                normal += terms * terms.transpose();
                right += terms * value;
                pixels.push((terms, value));
            }
        }
        if pixels.len() < MIN_GROUND_PIXELS {
            return None;
        }
        let plane = normal.cholesky()?.solve(&right);
        Some(Self { plane, pixels })
    }

    fn at(&self, d: DVec2) -> f64 {
        self.plane.dot(&Vector3::new(1.0, d.x, d.y))
    }

    /// Root mean square of the pixels about the plane.
    fn roughness(&self) -> f64 {
        let squares = self.pixels.iter().map(|(terms, value)| (value - self.plane.dot(terms)).powi(2));
        (squares.sum::<f64>() / self.pixels.len() as f64).sqrt()
    }
}

/// The centroid of what stands out from the ground in a blob's pixels and two more around them, the ground being the
/// plane through the values in the next two, other blobs left out: `taken` says whether the pixel (x, y) belongs to one.
/// Where the ground is no plane (another edge runs beside the mark), pixels count by their value between mark and ground.
/// `None` where the frame's border or other blobs leave too little ground, or nothing stands out.
pub fn centroid(frame: &Gray, blob: &Blob, taken: impl Fn(u32, u32) -> bool) -> Option<Centroid> {
    if blob.pixels.is_empty() {
        return None;
    }
    let around = Surroundings::new(frame, blob);
    let ground = GroundPlane::new(&around, taken)?;
    let mark = around.mark();
    let contrast = mark - ground.plane.x;
    let (area_px, moment) = if ground.roughness() > MAX_ROUGHNESS * contrast.abs() {
        // An edge beside the mark: count a pixel by where it lies between the mark and the ground next to it in value.
        let side = contrast.signum();
        let values = ground.pixels.iter().map(|(_, value)| side * value);
        let nearest = values.fold(f64::NEG_INFINITY, f64::max) * side;
        let level = 0.5 * (mark + nearest);
        around.moments(EDGE - 1, |x, y| Some(((around.value(x, y) - level) / (mark - level)).clamp(0.0, 1.0)))
    } else {
        // How much of each pixel is covered: a mark of one value on ground that is shaded stands out more on one side.
        around.moments(EDGE, |x, y| {
            let here = ground.at(around.offset_px(x, y));
            let depth = (mark - here) / contrast;
            (depth > MIN_DEPTH).then(|| (around.value(x, y) - here) / (contrast * depth))
        })
    };
    let from = moment / area_px;
    let at_px = blob.middle_px + from;
    let sound = at_px.is_finite() && area_px > 0.0 && from.length() < 2.0 + EDGE as f64;
    sound.then_some(Centroid { at_px, area_px, contrast })
}
