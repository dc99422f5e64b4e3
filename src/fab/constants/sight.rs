//! Where the white markers go under load: lens, mask, and the platform's opening. As limits for the load envelope,
//! and as the fault of a design that claims a load under which a marker is lost.

use serde_json::json;

pub use domecast_design::parts::markers_of;
use domecast_design::parts::{EdgeRay, MarkerView, Measures, PartError, ViewCone};
use domecast_design::{Design, DesignError};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_springs::{Check, Limit};

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

    /// Whether every marker of the design is visible at a pose; `when` names it: "at rest", "under the load ..".
    ///
    /// # Errors
    /// The marker and the limit that it is past.
    pub fn require(&self, design: &Design, pose: &Rigid, when: &str) -> Result<(), DesignError> {
        let Some(passed) = self.checks(pose).into_iter().find(Check::is_passed) else { return Ok(()) };
        let Check { limit, part, value, bound, unit } = &passed;
        let index = part.rsplit(' ').next().and_then(|id| id.parse::<usize>().ok()).unwrap_or(0);
        let place = markers_of(design).get(index).map_or(glam::DVec3::ZERO, |m| m.position_mm);
        // A point that is not seen at all uses twice what there is.
        let lost = *value >= 2.0 * bound;
        let (problem, what) = match limit {
            Limit::MarkerOutOfLens if lost => {
                let name = unseen_by(design, pose, index);
                (format!("the lens cannot see the marker's edge ({name})"), "the lens")
            }
            Limit::MarkerOutOfLens => (format!("the marker's edge is at {value:.3} {unit}"), "the lens"),
            Limit::MarkerOutOfMask if lost => {
                ("the marker's edge is outside the frame".into(), "runtime.mask_radius_px")
            }
            Limit::MarkerOutOfMask => (
                format!("the marker's edge is {value:.2} {unit} from the mask's centre"),
                "runtime.mask_radius_px",
            ),
            _ => (format!("the marker is behind the window's edge, {value:.3} of the way"), "the window"),
        };
        Err(DesignError::at(
            format!("white_markers.positions_mm[{index}]"),
            json!([place.x, place.y]),
            format!("{when}, {problem}"),
            format!("inside of {what}, at most {bound:.3} {unit}, at rest and under every claimed load"),
        )
        .with_help("move the markers inwards, the camera deeper, stiffen the springs, or claim less load"))
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

/// Name of the optics' limit that hides a marker at a pose.
fn unseen_by(design: &Design, pose: &Rigid, index: usize) -> &'static str {
    let Some(marker) = markers_of(design).get(index).copied() else { return "not_finite" };
    let Ok(placed) = design.optics().at_pose(pose) else { return "unreachable" };
    marker.outline_px(&placed).map_or_else(|limit| limit.as_str(), |_| "beyond_field_of_view")
}
