//! Connected sets of pixels.

use glam::DVec2;

use super::Gray;

/// Which side of the level a blob lies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlobSide {
    /// Brighter than the level.
    Bright,
    /// Darker.
    Dark,
}

/// Pixels that touch each other, corners included.
#[derive(Debug, Clone, PartialEq)]
pub struct Blob {
    /// Its pixels (x, y), by rows from the top.
    pub pixels: Vec<[u32; 2]>,
    /// Mean of its pixels' places: good to some tenths of a pixel.
    pub middle_px: DVec2,
    /// Smallest and largest x and y.
    pub corners: [[u32; 2]; 2],
}

impl Blob {
    /// Number of its pixels.
    pub fn area_px(&self) -> usize {
        self.pixels.len()
    }

    /// Whether it touches the frame's border, where a mark may be cut off.
    pub fn touches_border(&self, frame: &Gray) -> bool {
        let [[x0, y0], [x1, y1]] = self.corners;
        x0 == 0 || y0 == 0 || x1 as usize + 1 >= frame.width() || y1 as usize + 1 >= frame.height()
    }

    /// Its area over that of the ellipse with its second moments: 1 for a disc seen obliquely, less for what is
    /// ragged, hollow or bent.
    pub fn fullness(&self) -> f64 {
        let n = self.pixels.len() as f64;
        // A pixel is a square, not a point: it has a twelfth of its own.
        let (mut xx, mut xy, mut yy) = (n / 12.0, 0.0, n / 12.0);
        for [x, y] in &self.pixels {
            let d = DVec2::new(f64::from(*x), f64::from(*y)) - self.middle_px;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        let ellipse = 4.0 * std::f64::consts::PI * ((xx * yy - xy * xy).max(0.0)).sqrt() / n;
        if ellipse > 0.0 { n / ellipse } else { 0.0 }
    }
}

/// The blobs of a frame on one side of a level; `level` gives it for the pixel of a number (counted by rows), `None`
/// where there is nothing to find. In the order of their first pixels.
pub fn blobs(frame: &Gray, side: BlobSide, level: impl Fn(usize) -> Option<f32>) -> Vec<Blob> {
    let (width, height) = (frame.width(), frame.height());
    let mut open: Vec<bool> = frame
        .values()
        .iter()
        .enumerate()
        .map(|(i, value)| match (level(i), side) {
            (Some(level), BlobSide::Bright) => *value > level,
            (Some(level), BlobSide::Dark) => *value < level,
            (None, _) => false,
        })
        .collect();
    let mut found = Vec::new();
    let mut stack = Vec::new();
    for start in 0..open.len() {
        if !open[start] {
            continue;
        }
        open[start] = false;
        stack.push(start);
        let mut pixels = Vec::new();
        while let Some(at) = stack.pop() {
            let (x, y) = (at % width, at / width);
            pixels.push([x as u32, y as u32]);
            for near_y in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                for near_x in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                    let near = near_y * width + near_x;
                    if open[near] {
                        open[near] = false;
                        stack.push(near);
                    }
                }
            }
        }
        found.push(blob_of(pixels));
    }
    found
}

fn blob_of(mut pixels: Vec<[u32; 2]>) -> Blob {
    pixels.sort_unstable_by_key(|[x, y]| (*y, *x));
    let mut corners = [[u32::MAX; 2], [0; 2]];
    let mut sum = DVec2::ZERO;
    for [x, y] in &pixels {
        corners =
            [[corners[0][0].min(*x), corners[0][1].min(*y)], [corners[1][0].max(*x), corners[1][1].max(*y)]];
        sum += DVec2::new(f64::from(*x), f64::from(*y));
    }
    let middle_px = sum / pixels.len().max(1) as f64;
    Blob { pixels, middle_px, corners }
}
