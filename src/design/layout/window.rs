//! The window in the upper platform, as far as a design fixes it, and how near the dots' sight lines come to it.
//!
//! The platform is opened as far as the camera's view of the dome's rim needs, at every position of the springs,
//! and `platforms.window_margin_mm` more. The light on its way from a dot to the pupil crosses the rim's circle on
//! the sheet, so that a platform made like that hides no dot; the gaps here say by how much. That the parts leave
//! this opening free is checked where they are made.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::window::Window;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! assert!(Window::of_design(&design, [design.optics()].into_iter()).is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::spec::Design;
use domecast_optics::SensorOptics;
use domecast_optics::camera::Lens;

/// Azimuths at which the dome's rim is sampled.
const DIRECTIONS: u32 = 72;
/// Heights at which the opening is taken. Between them it is bounded by chords, which lie outside: the hull of
/// straight lines narrows the faster the nearer it is to the pupil.
const HEIGHTS: u32 = 9;

/// The opening, in the platform's frame: a radius at each of some heights, from the underside to the sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// (height, radius), mm.
    edge_mm: Vec<(f64, f64)>,
}

/// A straight line of sight in air, in the platform's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ViewRay {
    pupil_mm: DVec3,
    direction: DVec3,
}

impl ViewRay {
    /// The line that a pixel sees along; `None` if the lens has none or it does not lead up.
    fn of_pixel(optics: &SensorOptics, pixel: DVec2) -> Option<Self> {
        let ray = optics.lens().unproject(pixel).ok()?;
        let (shift_mm, _) = optics.lens().pupil_shift_mm(Lens::field_angle_rad(ray));
        let camera = optics.sensor_from_camera();
        let direction = camera.vector(ray);
        let pupil_mm = camera.point(DVec3::Z * shift_mm);
        (direction.z > 0.0).then_some(Self { pupil_mm, direction })
    }

    /// Distance from the axis at a height; zero below the pupil, where nothing can be hidden.
    fn off_axis_mm(&self, height_mm: f64) -> f64 {
        let along = ((height_mm - self.pupil_mm.z) / self.direction.z).max(0.0);
        (self.pupil_mm + self.direction * along).truncate().length()
    }
}

impl Window {
    /// The opening that a design asks for. `positions` are the optics at the positions of the springs that count.
    /// `None` if the lens sees the rim at none of them: then the window is unknown.
    pub fn of_design<'a>(design: &Design, positions: impl Iterator<Item = &'a SensorOptics>) -> Option<Self> {
        let platforms = &design.sections().platforms;
        let (low_mm, high_mm) = (platforms.upper.underside_z_mm, design.sheet_underside_z_mm());
        let rim: Vec<ViewRay> = positions
            .flat_map(|optics| {
                (0..DIRECTIONS).filter_map(move |k| {
                    let azimuth_rad = TAU * f64::from(k) / f64::from(DIRECTIONS);
                    let point = optics.dome().point_mm(optics.dome().meridian_end_rad(), azimuth_rad);
                    ViewRay::of_pixel(optics, optics.project(point).ok()?)
                })
            })
            .collect();
        if rim.is_empty() || high_mm <= low_mm {
            return None;
        }
        let step_mm = (high_mm - low_mm) / f64::from(HEIGHTS - 1);
        let bare = |height_mm: f64| rim.iter().map(|line| line.off_axis_mm(height_mm)).fold(0.0, f64::max);
        let edge_mm = (0..HEIGHTS)
            .map(|i| {
                let height_mm = low_mm + step_mm * f64::from(i);
                // The margin is kept across the edge's own slope, which makes it longer sideways.
                let slope = (bare(height_mm + 0.5 * step_mm) - bare(height_mm - 0.5 * step_mm)) / step_mm;
                (height_mm, bare(height_mm) + platforms.window_margin_mm * slope.hypot(1.0))
            })
            .collect();
        Some(Self { edge_mm })
    }

    /// Narrowest gap, sideways, between the window's edge and the line that a pixel sees along, mm; negative where
    /// the edge stands before it. `None` if the pixel sees along no line.
    pub(super) fn gap_mm(&self, optics: &SensorOptics, pixel: DVec2) -> Option<f64> {
        let line = ViewRay::of_pixel(optics, pixel)?;
        let gaps = self.edge_mm.iter().map(|(height_mm, radius_mm)| radius_mm - line.off_axis_mm(*height_mm));
        Some(gaps.fold(f64::INFINITY, f64::min))
    }
}
