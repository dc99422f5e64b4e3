//! Blobs by place, to be found again near another one.

use glam::DVec2;

use crate::track::marks::DarkBlob;

/// Blobs by place.
#[derive(Debug, Clone, Default)]
pub(super) struct Buckets {
    across: usize,
    down: usize,
    starts: Vec<u32>,
    items: Vec<u32>,
}

const BUCKET_PX: f64 = 16.0;

impl Buckets {
    /// For so many blobs.
    pub fn new(blobs: usize) -> Self {
        let (starts, items) = (Vec::with_capacity(blobs / 4 + 2), Vec::with_capacity(blobs));
        Self { across: 0, down: 0, starts, items }
    }

    pub fn fill(&mut self, blobs: &[DarkBlob], width: f64, height: f64) {
        self.across = (width / BUCKET_PX).ceil().max(1.0) as usize;
        self.down = (height / BUCKET_PX).ceil().max(1.0) as usize;
        self.starts.clear();
        self.starts.resize(self.across * self.down + 1, 0);
        for blob in blobs {
            let cell = self.cell(blob.at_px);
            self.starts[cell + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        self.items.clear();
        self.items.resize(blobs.len(), 0);
        // From the back, each start ends up where it was.
        for (index, blob) in blobs.iter().enumerate().rev() {
            let cell = self.cell(blob.at_px);
            self.starts[cell + 1] -= 1;
            self.items[self.starts[cell + 1] as usize] = index as u32;
        }
        // Now starts[cell + 1] is the start of the cell: shift back.
        for i in 1..self.starts.len() {
            self.starts[i - 1] = self.starts[i];
        }
        if let Some(last) = self.starts.last_mut() {
            *last = blobs.len() as u32;
        }
    }

    fn cell(&self, at: DVec2) -> usize {
        let clamp = |v: f64, end: usize| ((v / BUCKET_PX).max(0.0) as usize).min(end - 1);
        clamp(at.y, self.down) * self.across + clamp(at.x, self.across)
    }

    /// The blobs in the cells around a place.
    pub fn near(&self, at: DVec2, reach_px: f64) -> impl Iterator<Item = usize> + '_ {
        let clamp = |v: f64, end: usize| ((v / BUCKET_PX).max(0.0) as usize).min(end - 1);
        let (x0, x1) = (clamp(at.x - reach_px, self.across), clamp(at.x + reach_px, self.across));
        let (y0, y1) = (clamp(at.y - reach_px, self.down), clamp(at.y + reach_px, self.down));
        (y0..=y1)
            .flat_map(move |y| {
                let row = y * self.across;
                self.starts[row + x0] as usize..self.starts[row + x1 + 1] as usize
            })
            .map(|slot| self.items[slot] as usize)
    }
}
