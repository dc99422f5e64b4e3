//! Where the white markers go under load: lens, mask, and the platform's opening. As limits for the load envelope,
//! and as the fault of a design that claims a load under which a marker is lost.

use glam::{DVec2, DVec3};
use serde_json::json;

use crate::design::{Design, DesignError};
use crate::mechanics::{Check, Limit};
use crate::numeric::Rigid;
use crate::optics::SensorOptics;
use crate::parts::{Measures, ViewCone};
use crate::pose::Marker;

/// Points of a marker's edge that are followed, every 45 degrees from the one that looks away from the pupil: the
/// one that leaves the lens and the mask first.
const EDGE_POINTS: u32 = 8;
/// What a point that cannot be seen uses of a limit.
const LOST: f64 = 2.0;

/// The white markers of a design, and what may hide them.
#[derive(Debug, Clone)]
pub struct MarkerSight {
    optics: SensorOptics,
    markers: Vec<Marker>,
    undistorted_matrix: [[f64; 3]; 3],
    mask_radius_px: f64,
    /// The window, and the heights between which it stands, mm; `None`: not checked.
    window: Option<(ViewCone, [f64; 2])>,
}

/// The markers of a design, numbered in its order.
pub fn markers_of(design: &Design) -> Vec<Marker> {
    let diameter_mm = design.sections().white_markers.diameter_mm;
    let numbered = (0..).zip(design.white_markers_mm());
    numbered.map(|(id, position_mm)| Marker { id, position_mm, diameter_mm }).collect()
}

/// The largest use of a limit so far, and the marker.
#[derive(Clone, Copy)]
struct Worst {
    value: f64,
    id: u32,
}

impl Worst {
    const NONE: Self = Self { value: 0.0, id: 0 };

    fn keep(&mut self, value: f64, id: u32) {
        if value > self.value {
            *self = Self { value, id };
        }
    }

    fn check(self, limit: Limit, bound: f64, unit: &'static str) -> Check {
        Check { limit, part: format!("marker {}", self.id), value: self.value, bound, unit }
    }
}

impl MarkerSight {
    /// From a design; the window is left out of the checks where its shape cannot be computed.
    pub fn of(design: &Design) -> Self {
        let heights = [design.sections().platforms.upper.underside_z_mm, design.sheet_underside_z_mm()];
        Self {
            optics: design.optics().clone(),
            markers: markers_of(design),
            undistorted_matrix: design.undistorted_matrix(),
            mask_radius_px: design.sections().runtime.mask_radius_px,
            window: Measures::of(design).ok().map(|measures| (measures.view, heights)),
        }
    }

    /// How much of each limit the worst marker uses at a pose. A point that the lens cannot see uses twice what
    /// there is.
    pub fn checks(&self, pose: &Rigid) -> Vec<Check> {
        let far = self.optics.lens().max_field_angle_rad();
        let (mut lens, mut mask, mut edge) = (Worst::NONE, Worst::NONE, Worst::NONE);
        let placed = self.optics.at_pose(pose).ok();
        for marker in &self.markers {
            let id = marker.id;
            let Some(optics) = &placed else {
                lens.keep(LOST * far, id);
                continue;
            };
            let pupil = optics.sensor_from_camera().translation_mm;
            let outward = (marker.position_mm - pupil).truncate().try_normalize().unwrap_or(DVec2::X);
            for k in 0..EDGE_POINTS {
                let turn = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(EDGE_POINTS));
                let step = outward.rotate(turn) * (0.5 * marker.diameter_mm);
                let seen = optics.project(marker.position_mm + step.extend(0.0)).ok();
                let ray = seen.and_then(|pixel| Some((pixel, optics.lens().unproject(pixel).ok()?)));
                let Some((pixel, ray)) = ray else {
                    lens.keep(LOST * far, id);
                    continue;
                };
                let angle = crate::camera::Lens::field_angle_rad(ray);
                lens.keep(angle, id);
                mask.keep(self.mask_px(ray, pixel, optics), id);
                if let Some((cone, heights)) = &self.window {
                    edge.keep(window_use(optics, ray, angle, cone, *heights), id);
                }
            }
        }
        let mut checks = vec![
            lens.check(Limit::MarkerOutOfLens, far, "rad"),
            mask.check(Limit::MarkerOutOfMask, self.mask_radius_px, "px"),
        ];
        if self.window.is_some() {
            checks.push(edge.check(Limit::MarkerBehindEdge, 1.0, "1"));
        }
        checks
    }

    /// Whether every marker is in sight at a pose; `when` says which: "at rest", "under the load ..".
    ///
    /// # Errors
    /// The marker and the limit that it is past.
    pub fn require(&self, pose: &Rigid, when: &str) -> Result<(), DesignError> {
        let Some(passed) = self.checks(pose).into_iter().find(Check::is_passed) else { return Ok(()) };
        let Check { limit, part, value, bound, unit } = &passed;
        let index = part.rsplit(' ').next().and_then(|id| id.parse::<usize>().ok()).unwrap_or(0);
        let place = self.markers.get(index).map_or(DVec3::ZERO, |m| m.position_mm);
        let problem = match limit {
            Limit::MarkerOutOfLens if *value >= LOST * bound => {
                "the lens cannot see the marker's edge".into()
            }
            Limit::MarkerOutOfLens => format!("the marker's edge is at {value:.3} {unit} in the lens"),
            Limit::MarkerOutOfMask if *value >= LOST * bound => {
                "the marker's edge is outside the frame".into()
            }
            Limit::MarkerOutOfMask => {
                format!("the marker's edge is {value:.2} {unit} from the mask's centre")
            }
            _ => format!("the marker is behind the edge of the window, {value:.3} of the way"),
        };
        let bound_name = match limit {
            Limit::MarkerOutOfLens => "max_field_angle",
            Limit::MarkerOutOfMask => "runtime.mask_radius_px",
            _ => "the window",
        };
        let allowed =
            format!("at most {bound_name}, {bound:.3} {unit}, at rest and under every claimed load");
        Err(DesignError::at(
            format!("white_markers.positions_mm[{index}]"),
            json!([place.x, place.y]),
            format!("{when}, {problem}"),
            allowed,
        )
        .with_help("move the markers inwards, the camera deeper, stiffen the springs, or claim less load"))
    }

    /// Distance from the mask's centre in the undistorted frame; twice the mask where that frame ends or the raw
    /// frame does.
    fn mask_px(&self, ray: DVec3, pixel: DVec2, optics: &SensorOptics) -> f64 {
        let spec = optics.lens().spec();
        let (right, bottom) = (f64::from(spec.width) - 0.5, f64::from(spec.height) - 0.5);
        let in_frame = pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x <= right && pixel.y <= bottom;
        if ray.z <= 0.0 || !in_frame {
            return LOST * self.mask_radius_px;
        }
        let [[fx, ..], [_, fy, _], _] = self.undistorted_matrix;
        DVec2::new(fx * ray.x, fy * ray.y).length() / ray.z
    }
}

/// Largest part of the window that a ray uses between two heights of the platform.
fn window_use(optics: &SensorOptics, ray: DVec3, angle: f64, window: &ViewCone, heights: [f64; 2]) -> f64 {
    let sensor_from_camera = optics.sensor_from_camera();
    let origin = sensor_from_camera.point(DVec3::Z * optics.lens().pupil_shift_mm(angle).0);
    let direction = sensor_from_camera.vector(ray);
    let at = |part: f64| {
        let z = heights[0] + part * (heights[1] - heights[0]);
        let along = (z - origin.z) / direction.z;
        if along > 0.0 { window.used(origin + direction * along) } else { 0.0 }
    };
    [0.0, 0.25, 0.5, 0.75, 1.0].map(at).into_iter().fold(0.0, f64::max)
}
