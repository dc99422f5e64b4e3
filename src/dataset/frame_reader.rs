//! What track, shape and forces say of frames at the design's own size, as a robot has them.

use domecast_design::layout::Layout;
use domecast_design::{Design, DesignError};
use domecast_runtime::shape::{ShapeError, ShapeFromColor, ShapeOptions};
use domecast_runtime::track::{CameraFrame, Reference, TrackOptions, Tracked, Tracker};
use domecast_runtime::traction::{ForceDistribution, SHAPE_CORRELATION_MM};

/// What reads frames at full size, with the constants of the design as it was meant; cloned for each video.
#[derive(Debug, Clone)]
pub struct FrameReader {
    tracker: Tracker,
    shape: ShapeFromColor,
    forces: ForceDistribution,
}

impl FrameReader {
    /// For the sensor that a design means.
    ///
    /// # Errors
    /// A design without dots, lights or elastomer.
    pub fn new(design: &Design) -> Result<Self, DesignError> {
        let constants = domecast_fab::constants::of(design, &Layout::of_design(design)?)?;
        // the frame at rest, which comes first, is what all else is counted from
        let options = TrackOptions { reference: Reference::Frames(1), ..TrackOptions::default() };
        let unfit = |problem: String| {
            DesignError::at("design", "", problem, "a sensor with dots, lights and an elastomer")
        };
        let tracker = Tracker::new(&constants, options).map_err(|error| unfit(error.to_string()))?;
        let shape = ShapeFromColor::new(&constants, &tracker, ShapeOptions::default());
        let forces = ForceDistribution::new(&constants, Some(SHAPE_CORRELATION_MM));
        Ok(Self {
            tracker,
            shape: shape.map_err(|error| unfit(error.to_string()))?,
            forces: forces.map_err(|error| unfit(error.to_string()))?,
        })
    }

    /// What is tracked in the next frame; the first one is at rest.
    pub fn track(&mut self, number: u64, frame: &CameraFrame<'_>) -> Tracked {
        self.tracker.track(number, frame).clone()
    }

    /// Takes the frame at rest for the skin's shape.
    ///
    /// # Errors
    /// Those of [`ShapeFromColor::set_rest`].
    pub fn set_rest(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<(), ShapeError> {
        self.shape.set_rest(frame, tracked)
    }

    /// Radius of the contact by the moments of the pressure on the skin, mm; 0 where nothing is found to touch.
    pub fn radius_mm(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> f64 {
        let map = self.shape.measure(frame, tracked).ok();
        let contact = self.forces.update(tracked, map).contact;
        contact.map_or(0.0, |contact| (contact.area_mm2 / std::f64::consts::PI).sqrt())
    }
}
