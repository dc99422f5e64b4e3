//! What finds the forces on the skin, place by place.

use std::sync::Arc;

use domecast_runtime::traction::{ForceDistribution, PressureMap};
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::error::Fault;
use crate::forces::PyForces;
use crate::reading::PyReading;
use crate::shape_map::PyShapeMap;
use crate::tracker::PySensor;

/// Finds the forces on the skin of one sensor, from frame to frame.
#[pyclass(name = "Traction", module = "domecast")]
pub(crate) struct PyTraction {
    forces: ForceDistribution,
}

/// Pressures and their deviations on the grid of a height map.
type Pressures = (Py<PyAny>, Py<PyAny>);

#[pymethods]
impl PyTraction {
    #[new]
    #[pyo3(signature = (sensor, *, correlation_mm = None))]
    fn new(py: Python<'_>, sensor: &PySensor, correlation_mm: Option<f64>) -> PyResult<Self> {
        if let Some(value) = correlation_mm.filter(|value| !(1e-3..=1e3).contains(value)) {
            let fault = Fault::argument("correlation_mm", value, "is beyond its range", "0.001 to 1000 mm");
            return Err(fault.into());
        }
        let constants = sensor.constants();
        let forces = py.detach(|| ForceDistribution::new(&constants, correlation_mm)).map_err(Fault::from)?;
        Ok(Self { forces })
    }

    /// Takes the reading of a frame of the untouched sensor: its dots lie where that shows them.
    fn set_rest(&mut self, reading: &PyReading) -> PyResult<()> {
        let tracked = reading.tracked();
        if self.forces.set_rest(tracked) {
            return Ok(());
        }
        let (value, allowed) = (tracked.status(), "a reading of this sensor with a pose, untouched");
        Err(Fault::argument("reading", value, "has no pose, or is another sensor's", allowed).into())
    }

    /// The forces in a frame, with its heights where they are measured.
    #[pyo3(signature = (reading, *, shape = None))]
    fn update(
        &mut self,
        py: Python<'_>,
        reading: &PyReading,
        shape: Option<&PyShapeMap>,
    ) -> PyResult<PyForces> {
        let tracked = reading.tracked();
        let forces = py.detach(|| self.forces.update(tracked, shape.map(PyShapeMap::map)).clone());
        Ok(PyForces::new(forces, Arc::clone(tracked)))
    }

    /// The last frame's pressures on the grid of its height map, N/mm2, and their deviations.
    fn pressure(&mut self, py: Python<'_>, shape: &PyShapeMap) -> PyResult<Pressures> {
        let mut found = PressureMap::default();
        py.detach(|| self.forces.draw_pressure(shape.map(), &mut found));
        let width = found.width;
        Ok((rows(py, found.pressure_n_mm2, width)?, rows(py, found.pressure_sd_n_mm2, width)?))
    }
}
