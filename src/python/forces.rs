//! The forces on the skin in a frame, as arrays and as a line.

use std::sync::Arc;

use domecast_runtime::track::Tracked;
use domecast_runtime::traction::{LocalForces, write_json_forces};
use glam::DVec3;
use pyo3::prelude::*;

use crate::arrays::{Table, flat};
use crate::error::Fault;
use crate::line::{LINE_BYTES, fields_of, text_of};
use crate::shape_map::PyShapeMap;

/// A touch as arrays: point, normal, force and its deviations.
type Touch = (Py<PyAny>, Py<PyAny>, Py<PyAny>, Py<PyAny>);

/// The forces on the skin in a frame.
#[pyclass(name = "Forces", module = "domecast", frozen)]
pub(crate) struct PyForces {
    forces: LocalForces,
    tracked: Arc<Tracked>,
}

impl PyForces {
    pub fn new(forces: LocalForces, tracked: Arc<Tracked>) -> Self {
        Self { forces, tracked }
    }

    /// What was tracked in their frame.
    pub fn tracked(&self) -> &Tracked {
        &self.tracked
    }

    pub fn local(&self) -> &LocalForces {
        &self.forces
    }
}

#[pymethods]
impl PyForces {
    #[getter]
    fn status(&self) -> &'static str {
        self.forces.status.as_str()
    }

    #[getter]
    fn rms_px(&self) -> f64 {
        self.forces.rms_px
    }

    #[getter]
    fn compliance_factor(&self) -> f64 {
        self.forces.compliance_factor
    }

    #[getter]
    fn dots(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let mut table = Table::default();
        for dot in &self.forces.dots {
            table.number(dot.id);
            table.triple(Some(dot.surface_mm));
            table.one(Some(dot.depth_sd_mm));
            table.triple(Some(dot.traction_n_mm2));
            table.one(Some(dot.noise_sd_n_mm2));
            table.one(Some(dot.sd_n_mm2));
        }
        table.into_array(py, "TRACTION")
    }

    /// Point of the touch, mm, its outward normal, the force, N, and its deviations; `None` where nothing touches.
    #[getter]
    fn contact(&self, py: Python<'_>) -> Option<Touch> {
        let array = |vector: DVec3| flat(py, vector.to_array().to_vec());
        let touch = self.forces.contact.as_ref()?;
        Some((array(touch.point_mm), array(touch.normal), array(touch.force_n), array(touch.force_sd_n)))
    }

    /// The line that `domecast track --traction` writes of this frame, without its end.
    #[pyo3(signature = (fields = None, *, shape = None))]
    fn json(
        &self,
        py: Python<'_>,
        fields: Option<Vec<String>>,
        shape: Option<&PyShapeMap>,
    ) -> PyResult<String> {
        let fields = fields_of(fields)?;
        let write = || {
            let mut line = Vec::with_capacity(LINE_BYTES);
            write_json_forces(&mut line, &self.tracked, &fields, &self.forces)
                .map_err(|error| Fault::Ours(error.to_string()))?;
            text_of(line, shape.map(|map| domecast_cli::shape_members(map.map(), true)))
        };
        Ok(py.detach(write)?)
    }

    fn __repr__(&self) -> String {
        let touch = self.forces.contact.as_ref().map_or_else(
            || "no touch".to_owned(),
            |touch| format!("{:.3} N at {:.2} mm", touch.force_n.length(), touch.point_mm),
        );
        format!("<domecast.Forces {}: {touch}>", self.status())
    }
}
