//! The constants of a sensor, and what follows its marks from frame to frame.

use std::path::PathBuf;
use std::sync::Arc;

use domecast_design::FileKind;
use domecast_runtime::constants::{Constants, ConstantsError};
use domecast_runtime::shape::are_colours_judged;
use domecast_runtime::track::{Channel, Reference, Springs, TrackOptions, Tracker};
use glam::DVec3;
use pyo3::prelude::*;

use crate::error::Fault;
use crate::frame::FrameArray;
use crate::reading::{PyReading, SensorAtRest};

/// A benchmark repeats a frame so often at most: nothing ends it before.
const MAX_REPEATS: u32 = 1000;

/// What a runtime must know of one sensor: the content of a `constants.json`.
#[pyclass(name = "Sensor", module = "domecast", frozen)]
pub(crate) struct PySensor {
    constants: Arc<Constants>,
}

impl PySensor {
    pub fn new(constants: Constants) -> Self {
        Self { constants: Arc::new(constants) }
    }

    pub fn constants(&self) -> Arc<Constants> {
        Arc::clone(&self.constants)
    }
}

/// Reads the text of a constants file; one of another kind is called by its name.
fn read(text: &str) -> Result<Constants, Fault> {
    text.parse().map_err(|error: ConstantsError| {
        let tree = domecast_design::parse_json(text).ok();
        match tree.map(|value| FileKind::Constants.expect(&value)) {
            Some(Err(other)) => other.into(),
            _ => Fault::from(error),
        }
    })
}

#[pymethods]
impl PySensor {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let made = py.detach(|| {
            let text = domecast_design::read_text(&path).map_err(Fault::from)?;
            read(&text).map_err(|fault| fault.in_file(Some(&path)))
        });
        Ok(Self::new(made?))
    }

    #[staticmethod]
    fn from_str(py: Python<'_>, text: &str) -> PyResult<Self> {
        Ok(Self::new(py.detach(|| read(text))?))
    }

    /// The text of the constants file.
    fn json(&self, py: Python<'_>) -> String {
        py.detach(|| self.constants.to_json())
    }

    #[getter]
    fn design(&self) -> &str {
        &self.constants.design
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.constants.camera.width, self.constants.camera.height)
    }

    fn __repr__(&self) -> String {
        let Constants { design, camera, black_dots, white_markers, .. } = &*self.constants;
        format!(
            "<domecast.Sensor {design}: {} x {} px, {} dots, {} markers>",
            camera.width,
            camera.height,
            black_dots.len(),
            white_markers.len()
        )
    }
}

/// Follows a sensor's marks through its frames.
#[pyclass(name = "Tracker", module = "domecast")]
pub(crate) struct PyTracker {
    constants: Arc<Constants>,
    tracker: Tracker,
    about: Arc<SensorAtRest>,
    next: u64,
    /// Whether a frame has shown that its colours stand in the order that its caller says.
    are_colours_checked: bool,
}

impl PyTracker {
    /// A tracker that has seen nothing yet.
    pub fn fresh(&self) -> Tracker {
        let mut fresh = self.tracker.clone();
        fresh.restart();
        fresh
    }
}

fn channel_of(name: &str) -> Result<Channel, Fault> {
    Ok(match name {
        "red" => Channel::Red,
        "green" => Channel::Green,
        "blue" => Channel::Blue,
        "luma" => Channel::Luma,
        other => {
            let allowed = "red, green, blue or luma";
            return Err(Fault::argument("channel", format!("{other:?}"), "is none", allowed));
        }
    })
}

/// A number in a range, or what is wrong with it.
pub(crate) fn within(name: &str, value: Option<f64>, low: f64, high: f64) -> Result<Option<f64>, Fault> {
    match value {
        Some(number) if !(low..=high).contains(&number) => {
            Err(Fault::argument(name, number, "is beyond its range", &format!("{low} to {high}")))
        }
        other => Ok(other),
    }
}

#[pymethods]
impl PyTracker {
    #[new]
    #[pyo3(signature = (
        sensor, *, channel = "luma", reference = None,
        search_every = 30, max_residual_px = 2.0, max_misplaced = 0.5, camera_turned_deg = None, temperature_c = None,
        check_colours = true
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords, each with a default")]
    fn new(
        py: Python<'_>,
        sensor: &PySensor,
        channel: &str,
        reference: Option<u32>,
        search_every: u32,
        max_residual_px: f64,
        max_misplaced: f64,
        camera_turned_deg: Option<f64>,
        temperature_c: Option<f64>,
        check_colours: bool,
    ) -> PyResult<Self> {
        let options = TrackOptions {
            channel: channel_of(channel)?,
            reference: reference.map_or(Reference::Constants, Reference::Frames),
            search_every,
            max_residual_px,
            max_misplaced,
            camera_turned_rad: within("camera_turned_deg", camera_turned_deg, -360.0, 360.0)?
                .map(f64::to_radians),
            temperature_c: within("temperature_c", temperature_c, -100.0, 200.0)?,
        };
        let constants = sensor.constants();
        let tracker = py.detach(|| Tracker::new(&constants, options)).map_err(Fault::from)?;
        let is_turned = camera_turned_deg.is_some_and(|deg| deg != 0.0);
        let about = Arc::new(SensorAtRest {
            optics: tracker.optics().clone(),
            at_mm: tracker.springs().map_or(DVec3::ZERO, Springs::at_mm),
            is_turned,
        });
        Ok(Self { constants, tracker, about, next: 0, are_colours_checked: !check_colours })
    }

    /// Takes the next frame in.
    #[pyo3(signature = (frame, *, rgb, time = None, number = None))]
    fn update(
        &mut self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        rgb: bool,
        time: Option<f64>,
        number: Option<u64>,
    ) -> PyResult<PyReading> {
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        self.begin(time)?;
        let number = number.unwrap_or(self.next);
        self.next = number.saturating_add(1);
        let tracked = py.detach(|| {
            let tracked = self.tracker.track(number, &seen).clone();
            if !self.are_colours_checked {
                let judged = are_colours_judged(&self.constants, &self.tracker, &seen);
                self.are_colours_checked = judged.map_err(|error| {
                    let cure = "say rgb=False for frames with blue first, as OpenCV has them, rgb=True for red first";
                    domecast_design::DesignError::at("frame", "", error.problem, "").with_help(cure)
                })?;
            }
            Ok::<_, Fault>(tracked)
        })?;
        Ok(PyReading::new(tracked, Arc::clone(&self.about)))
    }

    /// How gravity lies in the frames from now on.
    fn set_gravity(&mut self, acceleration_mps2: Option<[f64; 3]>) -> PyResult<()> {
        Ok(self.tracker.set_gravity(acceleration_mps2.map(DVec3::from)).map_err(Fault::from)?)
    }

    /// A frame that could not be had.
    #[pyo3(signature = (*, time = None, number = None))]
    fn skip(&mut self, time: Option<f64>, number: Option<u64>) -> PyResult<PyReading> {
        self.begin(time)?;
        let number = number.unwrap_or(self.next);
        self.next = number.saturating_add(1);
        Ok(PyReading::new(self.tracker.skip(number).clone(), Arc::clone(&self.about)))
    }

    /// Forgets everything but the constants.
    fn restart(&mut self) {
        self.tracker.restart();
        self.next = 0;
    }

    /// Median time of `track` alone on a frame, s: what `update` is measured against.
    #[pyo3(signature = (frame, *, rgb, repeats))]
    fn benchmark(&self, py: Python<'_>, frame: &Bound<'_, PyAny>, rgb: bool, repeats: u32) -> PyResult<f64> {
        if !(1..=MAX_REPEATS).contains(&repeats) {
            let allowed = format!("1 to {MAX_REPEATS}");
            return Err(Fault::argument("repeats", repeats, "is beyond its range", &allowed).into());
        }
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        let mut tracker = self.fresh();
        let mut times: Vec<f64> = py.detach(|| {
            let one = |number: u64| {
                let began = std::time::Instant::now();
                std::hint::black_box(tracker.track(number, &seen));
                began.elapsed().as_secs_f64()
            };
            (0..u64::from(repeats)).map(one).collect()
        });
        times.sort_by(f64::total_cmp);
        Ok(times[times.len() / 2])
    }
}

impl PyTracker {
    /// Says when the next frame was taken.
    fn begin(&mut self, time: Option<f64>) -> Result<(), Fault> {
        let Some(time_s) = time else { return Ok(()) };
        if !time_s.is_finite() {
            return Err(Fault::argument("time", time_s, "is no time", "seconds, finite"));
        }
        self.tracker.stamp(time_s);
        Ok(())
    }
}
