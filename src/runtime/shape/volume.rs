//! What is pressed in comes out elsewhere: rubber hardly changes its volume.
//!
//! Heights add up from the bonded rim, and there the camera looks along the skin and lights leave crescents or a ring of it dark: the step
//! by which the untouched skin stands out all round a touch is read in part or not at all. The volume of the skin says how high it is.

use glam::Vec3A;

use super::cells::{Cells, View};
use domecast_optics::{DomeShape, SensorOptics};

/// Volume that goes under a touch, over what is pressed in, for each `1 - 2 nu`: domes of the contact's model lose 2.2 to 3.8, which
/// is known to its half.
const LOST: f64 = 3.0;

/// Height over the sheet, part of the dome's radius, by which the step of a bonded skin has risen to three quarters, as a hyperbolic tangent:
/// presses on bonded domes of the contact's model, far from the touch.
const RISE: f64 = 0.2;

/// By how much the volume of a linear skin is off, part of what is pressed in, for a touch as deep as the radius: 0.3 under balls, 1.1 under a
/// nut a twelfth of the radius deep.
const SECOND_ORDER: f64 = 0.5;

/// Slope that the skin may have where it is not read between rim and light, rad.
const HIDDEN_SLOPE: f64 = 0.05;

/// Part of the step that it may differ by from one side to the other: higher beside the touch, lower opposite.
const ROUND_PART: f64 = 1.0 / 3.0;

/// Cosine of the ray and the skin's normal that is not taken for less.
const MIN_COSINE: f32 = 0.05;

/// The dome's volume, and the step that the skin of a frame was given to keep it.
#[derive(Debug, Clone)]
pub(super) struct Volume {
    dome: DomeShape,
    /// Volume lost over what is pressed in.
    lost: f64,
    step_sd_mm: f64,
}

/// Sums over a frame's skin.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    volume_mm3: f64,
    pressed_mm3: f64,
    area_mm2: f64,
    /// Volume of a step of 1 mm.
    step_mm2: f64,
    /// Size of what is not read on the way from the rim, times area.
    hidden_mm3: f64,
    deepest_mm: f64,
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

impl Volume {
    pub fn new(optics: &SensorOptics, poisson_ratio: Option<f64>) -> Self {
        let lost = LOST * (1.0 - 2.0 * poisson_ratio.unwrap_or(0.5)).max(0.0);
        Self { dome: *optics.dome(), lost, step_sd_mm: 0.0 }
    }

    fn sums(&self, cells: &Cells, view: &View, away: &[f32], moved_mm: &[f64]) -> Sums {
        let mut sums = Sums::default();
        for (row, span) in view.spans.iter().enumerate() {
            for cell in row * cells.width + span.start..row * cells.width + span.end {
                let area = area_mm2(view, cells.width, cell);
                let own = f64::from(area.dot(view.ray[cell]).abs()) * moved_mm[cell];
                let size = f64::from(area.length());
                sums.volume_mm3 += own;
                sums.pressed_mm3 += own.min(0.0);
                sums.area_mm2 += size;
                sums.step_mm2 += size * self.part(view.surface_mm[cell].z);
                // The outline itself is not read.
                sums.hidden_mm3 += size * size.sqrt() * f64::from(1.0 + away[cell].min(1e4));
                sums.deepest_mm = sums.deepest_mm.max(-moved_mm[cell]);
            }
        }
        sums
    }

    /// Gives the skin the step inside of its rim that the volume asks for; `away` are the cells without readings on the way from the rim.
    /// Whether it could.
    pub fn hold(&mut self, cells: &Cells, view: &View, away: &[f32], moved_mm: &mut [f64]) -> bool {
        let sums = self.sums(cells, view, away, moved_mm);
        self.step_sd_mm = 0.0;
        if !(sums.step_mm2 > 0.0 && sums.volume_mm3.is_finite()) {
            return false;
        }
        // Kalman's gain of one unknown. A touch raises the skin around by its volume over the dome's area.
        let bulge_mm = -sums.pressed_mm3 / sums.step_mm2;
        let unseen = (1.0 - sums.area_mm2 / self.dome.area_mm2()).max(0.0);
        let off_mm =
            bulge_mm * (0.5 * self.lost + unseen + SECOND_ORDER * sums.deepest_mm / self.dome.radius_mm());
        let own_mm = HIDDEN_SLOPE * sums.hidden_mm3 / sums.area_mm2;
        let gain = own_mm * own_mm / (own_mm * own_mm + off_mm * off_mm);
        let step_mm = gain * (self.lost * sums.pressed_mm3 - sums.volume_mm3) / sums.step_mm2;
        self.step_sd_mm = (off_mm * gain.sqrt()).hypot(ROUND_PART * step_mm);
        for (row, span) in view.spans.iter().enumerate() {
            for column in span.clone() {
                let cell = row * cells.width + column;
                let cosine = view.ray[cell].dot(view.normal[cell]).max(MIN_COSINE);
                // The solve goes on from here in the next frame.
                moved_mm[cell] += step_mm * self.part(view.surface_mm[cell].z) / f64::from(cosine);
            }
        }
        true
    }

    /// Part of the step at a height over the sheet.
    #[inline]
    fn part(&self, z_mm: f32) -> f64 {
        (f64::from(z_mm) / (RISE * self.dome.radius_mm())).tanh()
    }

    /// Variance that the last frame's step leaves at such a height, mm^2.
    #[inline]
    pub fn variance_mm2(&self, z_mm: f32) -> f32 {
        (self.step_sd_mm * self.part(z_mm)).powi(2) as f32
    }
}
