//! From frames to places: marks masked, poses tracked, a first estimate of each ball.

use glam::DVec3;

use super::checks;
use super::observed::{CapPlace, SeenPress, depth_on_ball, touch_radius_mm};
use super::types::LightFitError;
use crate::constants::Constants;
use crate::shape::{SeenCell, ShapeFromColor, ShapeMap, ShapeOptions};
use crate::track::{CameraFrame, TrackOptions, Tracked, Tracker};

/// Pixels along a cell: as a shape's, so that little of a cap between two dots is lost.
const CELL_PX: usize = 2;
/// Part of the touch's radius in which the skin surely lies on the ball.
const SAFE_PART: f64 = 0.7;
/// Radii of the touch beyond which the skin counts as untouched.
const FAR_PARTS: f64 = 3.5;
/// Cells of a cap that are fitted: more add time and little else.
const MAX_CAP_CELLS: usize = 80;
/// Cells of a cap below which it says too little.
const MIN_CAP_CELLS: usize = 8;
/// Deviation of the first estimate along the dome's normal, mm: that of a shape read with lights that are off.
const DEPTH_SD_MM: f64 = 0.03;

/// What reads frames: a tracker and a shape with the light as it is known.
pub(super) struct Bench {
    tracker: Tracker,
    pub shape: ShapeFromColor,
    /// Level of stray light that frames are read with.
    pub stray: f64,
}

impl Bench {
    pub fn new(constants: &Constants) -> Result<Self, LightFitError> {
        let fault = |e: &dyn std::fmt::Display| {
            LightFitError::new(e.to_string(), "give constants written by `domecast build`")
        };
        let tracker = Tracker::new(constants, TrackOptions::default()).map_err(|e| fault(&e))?;
        let of = ShapeOptions { cell_px: CELL_PX, max_passes: 3 };
        let shape =
            ShapeFromColor::new(constants, &tracker, of).map_err(|e| LightFitError::of_shape(None, &e))?;
        let stray = constants.light.as_ref().map_or(0.0, |light| light.stray);
        Ok(Self { tracker, shape, stray })
    }

    pub fn optics(&self) -> &domecast_optics::SensorOptics {
        self.tracker.optics()
    }

    /// Deviation of a cell's level by noise, full scale 1, by the last frame.
    pub fn noise(&self) -> DVec3 {
        self.shape.pixel_noise() / CELL_PX as f64
    }

    /// What the tracker says of a frame by itself.
    pub fn track(&self, frame: &CameraFrame<'_>) -> Tracked {
        self.tracker.clone().track(0, frame).clone()
    }

    /// Takes the frame at rest; its bare cells.
    pub fn rest(
        &mut self,
        frame: &CameraFrame<'_>,
        tracked: &Tracked,
    ) -> Result<Vec<SeenCell>, LightFitError> {
        self.shape.set_rest(frame, tracked).map_err(|e| LightFitError::of_shape(Some(0), &e))?;
        Ok(self.shape.seen_cells())
    }

    /// The press of a frame and its cap, as press number `press`.
    pub fn press(
        &self,
        (number, press): (usize, usize),
        frame: &CameraFrame<'_>,
        radius_mm: f64,
    ) -> Result<(SeenPress, Vec<CapPlace>), LightFitError> {
        let tracked = self.track(frame);
        let mut shape = self.shape.clone();
        let in_frame = |e| LightFitError::of_shape(Some(number), &e);
        shape.measure(frame, &tracked).map_err(in_frame)?;
        let cells = shape.seen_cells();
        checks::saturation(number, &cells)?;
        let dome = self.optics().dome();
        let (dome_center_mm, dome_mm) = (dome.center_mm(), dome.radius_mm());
        let Some(center_mm) = ball_center(shape.map(), radius_mm, dome_mm) else {
            // Under another exposure or white balance no touch is seen either.
            checks::exposure(number, &cells.iter().collect::<Vec<_>>(), self.stray)?;
            let problem = match tracked.status() {
                "ok" => "shows no touch beside the frame at rest".to_owned(),
                status => format!("shows no touch (the tracker says {status})"),
            };
            let cure = "leave it out, press the ball some 0.3 mm deep, or take the frame at rest again, if that is touched";
            return Err(LightFitError::in_frame(number, problem, cure));
        };
        let touch_mm = touch_radius_mm(center_mm, radius_mm, dome_center_mm, dome_mm);
        let out = (center_mm - dome_center_mm).normalize_or(DVec3::Z);
        let aside = |at: DVec3| (at - dome_center_mm).cross(out).length();
        let is_far = |cell: &&SeenCell| aside(cell.point_mm) > FAR_PARTS * touch_mm;
        let untouched: Vec<&SeenCell> = cells.iter().filter(is_far).collect();
        let gain = checks::exposure(number, &untouched, self.stray)?;
        let on_ball = |cell: &SeenCell| {
            let depth_mm = depth_on_ball(cell.point_mm, cell.ray, center_mm, radius_mm)?;
            let at = cell.point_mm + cell.ray * depth_mm;
            let is_inside =
                aside(at) < SAFE_PART * touch_mm && depth_mm < 0.0 && (at - dome_center_mm).dot(out) > 0.0;
            (is_inside && cell.is_known).then_some(())
        };
        let cap: Vec<&SeenCell> = cells.iter().filter(|cell| on_ball(cell).is_some()).collect();
        if cap.len() < MIN_CAP_CELLS {
            let problem = format!(
                "shows {} places of {CELL_PX} x {CELL_PX} px well inside of the touch, {MIN_CAP_CELLS} are needed",
                cap.len()
            );
            return Err(LightFitError::in_frame(number, problem, "press deeper or with a larger ball"));
        }
        let place = |cell: &&SeenCell| CapPlace {
            press,
            channels: cell.channels,
            level: cell.level / DVec3::from_array(gain),
            at_rest: cell.at_rest,
        };
        let step = cap.len().div_ceil(MAX_CAP_CELLS);
        let caps = cap.iter().step_by(step).map(place).collect();
        Ok((SeenPress { frame: number, center_mm, depth_sd_mm: DEPTH_SD_MM, gain }, caps))
    }
}

/// The centre of the ball that lies on the skin where it is pressed deepest: `p + R n` of its middle.
fn ball_center(map: &ShapeMap, radius_mm: f64, dome_mm: f64) -> Option<DVec3> {
    let contact = map.contact.as_ref()?;
    let touch_mm = (contact.depth_mm / (1.0 / radius_mm + 1.0 / dome_mm)).sqrt();
    let skin = map.surface();
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for (point, normal) in skin.points_mm.iter().zip(&skin.normals) {
        let point = point.as_dvec3();
        if point.distance(contact.deepest_mm) < 0.7 * touch_mm {
            sum += point + normal.as_dvec3() * radius_mm;
            count += 1.0;
        }
    }
    let center_mm = sum / count;
    (count > 0.0 && center_mm.is_finite()).then_some(center_mm)
}
