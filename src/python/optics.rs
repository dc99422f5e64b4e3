//! Pixels to points on the dome and back.

use domecast_cli::{projected, traced};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use glam::{DVec2, DVec3};
use pyo3::prelude::*;

use crate::arrays::{names, points, rows};
use crate::design::PyDesign;
use crate::error::Fault;

/// Letters of the longest status.
const STATUS_LETTERS: usize = 32;

/// Lens, layers and dome of a sensor.
#[pyclass(name = "NativeOptics", module = "domecast._native", frozen)]
pub(crate) struct PyOptics {
    optics: SensorOptics,
}

#[pymethods]
impl PyOptics {
    #[new]
    fn new(design: &PyDesign) -> Self {
        Self { optics: design.optics() }
    }

    /// The same with the platform at a pose: a 4 x 4 `rest_from_platform`, mm.
    fn at_pose(&self, pose: &Bound<'_, PyAny>) -> PyResult<Self> {
        let fault = |problem: &str| {
            let allowed = "a rotation and a translation in mm: rows of four numbers, the last 0, 0, 0, 1";
            Fault::argument("pose", "", problem, allowed)
        };
        let matrix = points::<4>(pose, "pose")?;
        let numbers: Vec<f64> = matrix.as_array().iter().copied().collect();
        if numbers.len() != 16 {
            return Err(fault("has another number of rows than four").into());
        }
        let rows: [[f64; 4]; 4] = std::array::from_fn(|r| std::array::from_fn(|c| numbers[4 * r + c]));
        let pose = Rigid::from_rows_4x4(&rows).map_err(|error| fault(&error.to_string()))?;
        let optics = self.optics.at_pose(&pose).map_err(|error| fault(&error.to_string()))?;
        Ok(Self { optics })
    }

    /// What pixels see on the dome: points, mm, NaN where there is none, and a status each.
    fn trace(&self, py: Python<'_>, uv: &Bound<'_, PyAny>) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
        let given = points::<2>(uv, "uv")?;
        let pixels = given.as_array();
        let found = py.detach(|| {
            let one = |row: [f64; 2]| match traced(&self.optics, DVec2::from_array(row)) {
                Ok((hit, _)) => (hit.surface_mm, "ok"),
                Err(unseen) => (DVec3::NAN, unseen.status),
            };
            pixels.outer_iter().map(|row| one([row[0], row[1]])).collect::<Vec<_>>()
        });
        let statuses = names(py, found.iter().map(|(_, status)| *status), STATUS_LETTERS)?;
        Ok((rows(py, found.iter().flat_map(|(at, _)| at.to_array()).collect(), 3)?, statuses))
    }

    /// The pixels that show points of the dome: pixels, NaN where there is none, and a status each.
    fn project(&self, py: Python<'_>, xyz: &Bound<'_, PyAny>) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
        let given = points::<3>(xyz, "xyz")?;
        let places = given.as_array();
        let found = py.detach(|| {
            let one = |row: [f64; 3]| match projected(&self.optics, DVec3::from_array(row)) {
                Ok((pixel, _)) => (pixel, "ok"),
                Err(unseen) => (DVec2::NAN, unseen.status),
            };
            places.outer_iter().map(|row| one([row[0], row[1], row[2]])).collect::<Vec<_>>()
        });
        let statuses = names(py, found.iter().map(|(_, status)| *status), STATUS_LETTERS)?;
        Ok((rows(py, found.iter().flat_map(|(at, _)| at.to_array()).collect(), 2)?, statuses))
    }
}
