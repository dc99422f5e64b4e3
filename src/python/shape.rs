//! The skin's shape from a frame's colours.

use domecast_runtime::shape::{ShapeFromColor, ShapeOptions};
use domecast_runtime::track::Tracker;
use pyo3::prelude::*;

use crate::error::Fault;
use crate::frame::FrameArray;
use crate::reading::PyReading;
use crate::shape_map::PyShapeMap;
use crate::tracker::{PySensor, PyTracker};

/// Reads the skin's shape against a frame of the untouched sensor.
#[pyclass(name = "Shape", module = "domecast")]
pub(crate) struct PyShape {
    shape: ShapeFromColor,
    at_rest: Tracker,
}

#[pymethods]
impl PyShape {
    #[new]
    #[pyo3(signature = (sensor, tracker, *, cell_px = 2, max_passes = 2))]
    fn new(
        py: Python<'_>,
        sensor: &PySensor,
        tracker: &PyTracker,
        cell_px: usize,
        max_passes: usize,
    ) -> PyResult<Self> {
        let options = ShapeOptions { cell_px, max_passes };
        let (constants, at_rest) = (sensor.constants(), tracker.fresh());
        let made = py.detach(|| ShapeFromColor::new(&constants, &at_rest, options)).map_err(Fault::from)?;
        Ok(Self { shape: made, at_rest })
    }

    /// Takes a frame of the untouched sensor.
    #[pyo3(signature = (frame, *, rgb))]
    fn set_rest(&mut self, py: Python<'_>, frame: &Bound<'_, PyAny>, rgb: bool) -> PyResult<()> {
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        let take = || {
            let mut tracker = self.at_rest.clone();
            let tracked = tracker.track(0, &seen).clone();
            self.shape.set_rest(&seen, &tracked).map_err(Fault::from)
        };
        Ok(py.detach(take)?)
    }

    /// Reads a frame's shape, with what the tracker says of the same frame.
    #[pyo3(signature = (frame, reading, *, rgb))]
    fn update(
        &mut self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        reading: &PyReading,
        rgb: bool,
    ) -> PyResult<PyShapeMap> {
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        let map = py.detach(|| self.shape.measure(&seen, reading.tracked()).cloned()).map_err(Fault::from)?;
        Ok(PyShapeMap::new(map))
    }
}
