//! Where the white markers go under load, as limits of a load: lens, mask, and the platform's opening.

use crate::design::Design;
use crate::mechanics::{Check, Limit};
use crate::numeric::Rigid;
use crate::optics::SensorOptics;
pub use crate::parts::markers_of;
use crate::parts::{EdgeRay, MarkerView, Measures, PartError, ViewCone};

/// The white markers of a design, and what may hide them.
#[derive(Debug, Clone)]
pub struct MarkerSight {
    view: MarkerView,
    /// The dimensions of the parts, or why there are none.
    measures: Result<Measures, PartError>,
    /// The heights between which the window stands, mm.
    heights_mm: [f64; 2],
}

impl MarkerSight {
    /// From a design; the window is left out of the checks where its shape cannot be computed.
    pub fn of(design: &Design) -> Self {
        Self {
            view: MarkerView::of(design),
            measures: Measures::of(design),
            heights_mm: [design.sections().platforms.upper.underside_z_mm, design.sheet_underside_z_mm()],
        }
    }

    /// The dimensions of the parts, from which the window was taken.
    ///
    /// # Errors
    /// Why there are none.
    pub fn measures(&self) -> Result<&Measures, PartError> {
        self.measures.as_ref().map_err(Clone::clone)
    }

    /// How much of each limit the worst marker uses at a pose. A point that the lens cannot see uses twice what
    /// there is.
    pub fn checks(&self, pose: &Rigid) -> Vec<Check> {
        let mut edge = (0.0, 0);
        let mut checks = self.view.checks(pose, |optics, seen| {
            if let Ok(measures) = &self.measures {
                let used = window_use(optics, seen, &measures.view, self.heights_mm);
                if used > edge.0 {
                    edge = (used, seen.id);
                }
            }
        });
        if self.measures.is_ok() {
            let part = format!("marker {}", edge.1);
            checks.push(Check { limit: Limit::MarkerBehindEdge, part, value: edge.0, bound: 1.0, unit: "1" });
        }
        checks
    }
}

/// Largest part of the window that a ray uses between two heights of the platform.
fn window_use(optics: &SensorOptics, seen: EdgeRay, window: &ViewCone, heights: [f64; 2]) -> f64 {
    let sensor_from_camera = optics.sensor_from_camera();
    let origin = sensor_from_camera.point(glam::DVec3::Z * optics.lens().pupil_shift_mm(seen.angle_rad).0);
    let direction = sensor_from_camera.vector(seen.ray);
    let at = |part: f64| {
        let z = heights[0] + part * (heights[1] - heights[0]);
        let along = (z - origin.z) / direction.z;
        if along > 0.0 { window.used(origin + direction * along) } else { 0.0 }
    };
    [0.0, 0.25, 0.5, 0.75, 1.0].map(at).into_iter().fold(0.0, f64::max)
}
