//! The middle of a blob, from its grey pixels.

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

use super::{Blob, Gray};

/// Pixels around a blob that still carry its edge: blur, sharpening and the sampling of a sharp edge reach so far.
const EDGE: i64 = 2;
/// Pixels beyond these that show what lies behind the blob.
const GROUND: i64 = 2;

/// Ground that strays from a plane by more than this part of the mark's contrast is uneven.
const UNEVEN: f64 = 0.08;
/// Pixels where the mark stands out by less than this part of its contrast tell nothing of it.
const LEAST_DEPTH: f64 = 0.3;

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

/// The centroid of what stands out from the ground in a blob's pixels and two more around them, the ground being the
/// plane through the values in the next two, other blobs left out: `taken` says whether the pixel (x, y) belongs to one.
/// Where the ground is no plane (another edge runs beside the mark), pixels count by their value between mark and ground.
/// `None` where the frame's border or other blobs leave too little ground, or nothing stands out.
pub fn centroid(frame: &Gray, blob: &Blob, taken: impl Fn(u32, u32) -> bool) -> Option<Centroid> {
    if blob.pixels.is_empty() {
        return None;
    }
    let [[x0, y0], [x1, y1]] = blob.corners.map(|corner| corner.map(i64::from));
    let (left, top) = (x0 - EDGE - GROUND, y0 - EDGE - GROUND);
    let (width, height) = (x1 + EDGE + GROUND - left + 1, y1 + EDGE + GROUND - top + 1);
    let (cols, rows) = (frame.width() as i64, frame.height() as i64);
    // Distance (in steps to the eight neighbours) from the blob, up to one more than what is used.
    let far = EDGE + GROUND + 1;
    let mut distance = vec![far; (width * height) as usize];
    let index = |x: i64, y: i64| ((y - top) * width + (x - left)) as usize;
    for [x, y] in &blob.pixels {
        let (x, y) = (i64::from(*x), i64::from(*y));
        for dy in -(far - 1)..far {
            for dx in -(far - 1)..far {
                if let Some(slot) = distance.get_mut(index(x + dx, y + dy)) {
                    *slot = (*slot).min(dx.abs().max(dy.abs()));
                }
            }
        }
    }
    let middle = blob.middle_px;
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    let mut ground: Vec<(Vector3<f64>, f64)> = Vec::new();
    let pixels = || {
        (top.max(0)..(top + height).min(rows))
            .flat_map(move |y| (left.max(0)..(left + width).min(cols)).map(move |x| (x, y)))
    };
    let from_middle = |x: i64, y: i64| DVec2::new(x as f64, y as f64) - middle;
    // A neighbour's own edge is no ground either.
    let near_other = |x: i64, y: i64| {
        (-EDGE..=EDGE).any(|dy| {
            (-EDGE..=EDGE).any(|dx| {
                let (x, y) = (x + dx, y + dy);
                (0..cols).contains(&x) && (0..rows).contains(&y) && {
                    let inside = (left..left + width).contains(&x) && (top..top + height).contains(&y);
                    let own = inside && distance[index(x, y)] == 0;
                    !own && taken(x as u32, y as u32)
                }
            })
        })
    };
    for (x, y) in pixels() {
        let steps = distance[index(x, y)];
        if steps > EDGE && steps < far && !near_other(x, y) {
            let d = from_middle(x, y);
            let terms = Vector3::new(1.0, d.x, d.y);
            let value = f64::from(frame.at(x as isize, y as isize));
            normal += terms * terms.transpose();
            right += terms * value;
            ground.push((terms, value));
        }
    }
    if ground.len() < 6 {
        return None;
    }
    let plane = normal.cholesky()?.solve(&right);
    let own = |x: i64, y: i64| f64::from(frame.at(x as isize, y as isize));
    let ground_at = |d: DVec2| plane.dot(&Vector3::new(1.0, d.x, d.y));
    // The mark's own value, from pixels that no edge touches where there are any.
    let inner = |x: i64, y: i64| {
        (-1..=1)
            .all(|dy| (-1..=1).all(|dx| distance.get(index(x + dx, y + dy)).is_none_or(|steps| *steps == 0)))
    };
    let places = || blob.pixels.iter().map(|[x, y]| (i64::from(*x), i64::from(*y)));
    let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let core: Vec<f64> = places().filter(|(x, y)| inner(*x, *y)).map(|(x, y)| own(x, y)).collect();
    let mark = if core.is_empty() {
        mean_of(&places().map(|(x, y)| own(x, y)).collect::<Vec<f64>>())
    } else {
        mean_of(&core)
    };
    let contrast = mark - plane.x;
    // How much of each pixel is covered: a mark of one value on ground that is shaded stands out more on one side.
    let (mut sum, mut moment) = (0.0, DVec2::ZERO);
    for (x, y) in pixels().filter(|(x, y)| distance[index(*x, *y)] <= EDGE) {
        let d = from_middle(x, y);
        let depth = (mark - ground_at(d)) / contrast;
        if depth > LEAST_DEPTH {
            let covered = (own(x, y) - ground_at(d)) / (contrast * depth);
            sum += covered;
            moment += d * covered;
        }
    }
    let rough = ground.iter().map(|(terms, value)| (value - plane.dot(terms)).powi(2)).sum::<f64>();
    let mut area_px = sum;
    let mut from = moment / sum;
    if (rough / ground.len() as f64).sqrt() > UNEVEN * contrast.abs() {
        // An edge beside the mark: count a pixel by where it lies between the mark and the ground next to it in value.
        let side = contrast.signum();
        let nearest = ground.iter().map(|(_, value)| side * value).fold(f64::NEG_INFINITY, f64::max) * side;
        let level = 0.5 * (mark + nearest);
        let (mut sum, mut moment) = (0.0, DVec2::ZERO);
        for (x, y) in pixels().filter(|(x, y)| distance[index(*x, *y)] < EDGE) {
            let weight = ((own(x, y) - level) / (mark - level)).clamp(0.0, 1.0);
            sum += weight;
            moment += from_middle(x, y) * weight;
        }
        (area_px, from) = (sum, moment / sum);
    }
    let at_px = middle + from;
    let sound = at_px.is_finite() && area_px > 0.0 && from.length() < 2.0 + EDGE as f64;
    sound.then_some(Centroid { at_px, area_px, contrast })
}
