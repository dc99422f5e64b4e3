//! What is pressed in comes out elsewhere: rubber hardly changes its volume.
//!
//! Where lights leave a ring of the dome dark no slope is read, and with it goes the step by which the untouched skin stands out all
//! round a touch. The volume of the skin says how high that step is.

use glam::Vec3A;

use super::cells::{Cells, View};
use domecast_optics::{DomeShape, SensorOptics};

/// Volume that goes under a touch, over what is pressed in, for each `1 - 2 nu`: domes of the contact's model lose 2.2 to 3.8, which
/// is known to its half.
const LOST: f64 = 3.0;

/// Mean height that the outline of the dome in the picture may feign, mm: cells that see it in part, at a grazing angle.
const OUTLINE_MM: f64 = 0.003;

/// Slope that a dark ring may have, rad.
const DARK_SLOPE: f64 = 0.05;

/// Cells without readings on the way from the rim, in the mean, below which there is no ring.
const MIN_RING: f64 = 1.0;

/// Part of the step that it may differ by from one side to the other: higher beside the touch, lower opposite.
const ROUND_PART: f64 = 1.0 / 3.0;

/// The dome's volume, and the step that the skin of a frame was given to keep it.
#[derive(Debug, Clone)]
pub(super) struct Volume {
    dome: DomeShape,
    /// Volume lost over what is pressed in.
    lost: f64,
    step_sd_mm: f64,
    /// Cells without readings on the way from the rim, in the mean.
    ring: f64,
}

/// Sums over a frame's skin.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    volume_mm3: f64,
    pressed_mm3: f64,
    area_mm2: f64,
    /// Cells without readings on the way from the rim, and cells' sizes, times area.
    away: f64,
    size: f64,
}

/// The area of the dome that a cell shows, along its normal.
#[inline]
fn area_mm2(view: &View, width: usize, cell: usize) -> Vec3A {
    let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
    if !(is_dome(cell) && is_dome(cell + 1) && is_dome(cell + width)) {
        return Vec3A::ZERO;
    }
    let beside = |next: usize| view.surface_mm[next] - view.surface_mm[cell];
    beside(cell + 1).cross(beside(cell + width))
}

impl Sums {
    fn of(cells: &Cells, view: &View, away: &[f32], moved_mm: &[f64]) -> Self {
        let mut sums = Self::default();
        for (row, span) in view.spans.iter().enumerate() {
            for cell in row * cells.width + span.start..row * cells.width + span.end {
                let area = area_mm2(view, cells.width, cell);
                let own = f64::from(area.dot(view.ray[cell]).abs()) * moved_mm[cell];
                let size = f64::from(area.length());
                sums.volume_mm3 += own;
                sums.pressed_mm3 += own.min(0.0);
                sums.area_mm2 += size;
                sums.away += size * f64::from(away[cell].min(1e4));
                sums.size += size * size.sqrt();
            }
        }
        sums
    }
}

impl Volume {
    pub fn new(optics: &SensorOptics, poisson_ratio: Option<f64>) -> Self {
        let lost = LOST * (1.0 - 2.0 * poisson_ratio.unwrap_or(0.5)).max(0.0);
        Self { dome: *optics.dome(), lost, step_sd_mm: 0.0, ring: 0.0 }
    }

    /// Gives the skin behind a dark ring the step that the volume asks for; `away` are the cells without readings on the way
    /// from the rim. Whether it has one.
    pub fn hold(&mut self, cells: &Cells, view: &View, away: &[f32], moved_mm: &mut [f64]) -> bool {
        let sums = Sums::of(cells, view, away, moved_mm);
        let all_mm2 = self.dome.area_mm2();
        (self.step_sd_mm, self.ring) = (0.0, sums.away / sums.area_mm2);
        let is_ring = self.ring >= MIN_RING && self.ring.is_finite();
        if !is_ring {
            return false;
        }
        // Kalman's gain of one unknown. A touch raises the skin around by its volume over the dome's area, and the ring hides no more.
        let bulge_mm = -sums.pressed_mm3 / all_mm2;
        let own_mm = bulge_mm.min(DARK_SLOPE * sums.away * sums.size / sums.area_mm2.powi(2));
        let unseen = (1.0 - sums.area_mm2 / all_mm2).max(0.0);
        let off_mm = OUTLINE_MM.hypot(bulge_mm * (0.5 * self.lost + unseen));
        let gain = own_mm * own_mm / (own_mm * own_mm + off_mm * off_mm);
        let step_mm = gain * (self.lost * sums.pressed_mm3 - sums.volume_mm3) / all_mm2;
        self.step_sd_mm = (off_mm * gain.sqrt()).hypot(ROUND_PART * step_mm);
        for (row, span) in view.spans.iter().enumerate() {
            for cell in row * cells.width + span.start..row * cells.width + span.end {
                // The solve goes on from here in the next frame.
                moved_mm[cell] += step_mm * self.part(away[cell]);
            }
        }
        true
    }

    /// Part of the step at a place with so many cells without readings on the way from the rim.
    #[inline]
    fn part(&self, away: f32) -> f64 {
        (f64::from(away) / self.ring).min(1.0)
    }

    /// Variance that the last frame's step leaves at such a place, mm^2.
    #[inline]
    pub fn variance_mm2(&self, away: f32) -> f32 {
        if self.step_sd_mm > 0.0 { (self.step_sd_mm * self.part(away)).powi(2) as f32 } else { 0.0 }
    }
}
