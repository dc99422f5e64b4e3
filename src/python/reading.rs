//! What a frame says of the sensor.

use std::sync::Arc;

use domecast_optics::SensorOptics;
use domecast_runtime::overlay::{OverlayLayers, depth_range_mm, overlay_png};
use domecast_runtime::track::{CameraFrame, Tracked, write_json_fields};
use domecast_springs::{Displacement, Wrench};
use glam::DVec3;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Table, flat, rows};
use crate::error::Fault;
use crate::forces::PyForces;
use crate::frame::FrameArray;
use crate::line::{LINE_BYTES, fields_of, text_of};
use crate::shape_map::PyShapeMap;

/// A sensor's optics at rest, and the point that displacements and moments are stated about.
pub(crate) struct SensorAtRest {
    pub optics: SensorOptics,
    pub at_mm: DVec3,
    /// Whether the tracker has been given that the picture is turned against the constants.
    pub is_turned: bool,
}

/// The result of one frame.
#[pyclass(name = "Reading", module = "domecast", frozen)]
pub(crate) struct PyReading {
    tracked: Arc<Tracked>,
    about: Arc<SensorAtRest>,
}

impl PyReading {
    pub fn new(tracked: Tracked, about: Arc<SensorAtRest>) -> Self {
        Self { tracked: Arc::new(tracked), about }
    }

    pub fn tracked(&self) -> &Arc<Tracked> {
        &self.tracked
    }

    pub fn about(&self) -> &SensorAtRest {
        &self.about
    }

    /// The picture over a frame, with further layers where they are given.
    fn draw(
        &self,
        frame: &CameraFrame<'_>,
        magnify: f64,
        shape: Option<&PyShapeMap>,
        forces: Option<&PyForces>,
    ) -> Result<Vec<u8>, Fault> {
        let dots = forces.map_or(&[][..], |forces| &forces.local().dots);
        let tractions: Vec<_> = dots.iter().map(|dot| (dot.surface_mm, dot.traction_n_mm2)).collect();
        let depth_mm = |map: &PyShapeMap| map.map().contact.as_ref().map_or(0.0, |touch| touch.depth_mm);
        let skin = shape.map(|map| (map.map(), depth_range_mm(depth_mm(map))));
        let layers = OverlayLayers { magnify, tractions: &tractions, skin };
        Ok(overlay_png(frame, &self.tracked, &self.about.optics, &layers)?)
    }

    /// The picture over dark ground.
    fn draw_alone(&self) -> Result<Vec<u8>, Fault> {
        const GROUND: u8 = 40;
        let lens = self.about.optics.lens().spec();
        let (width, height) = (lens.width as usize, lens.height as usize);
        let bytes = vec![GROUND; width * height];
        self.draw(&CameraFrame::new(width, height, 1, &bytes)?, 1.0, None, None)
    }
}

fn six(py: Python<'_>, values: Option<[f64; 6]>) -> Option<Py<PyAny>> {
    values.map(|values| flat(py, values.to_vec()))
}

#[pymethods]
impl PyReading {
    #[getter]
    fn frame(&self) -> u64 {
        self.tracked.frame
    }

    #[getter]
    fn time(&self) -> Option<f64> {
        self.tracked.time_s
    }

    #[getter]
    fn status(&self) -> &'static str {
        self.tracked.status()
    }

    #[getter]
    fn problems(&self) -> Vec<&'static str> {
        self.tracked.problems.iter().map(|problem| problem.as_str()).collect()
    }

    #[getter]
    fn wrench(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        six(py, self.tracked.wrench.map(Wrench::to_array))
    }

    #[getter]
    fn wrench_sd(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        six(py, self.tracked.wrench_sd.map(Wrench::to_array))
    }

    #[getter]
    fn wrench_sd_random(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        six(py, self.tracked.wrench_sd_random.map(Wrench::to_array))
    }

    #[getter]
    fn pose(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let values = self.tracked.pose.map(|pose| pose.to_rows_4x4().concat());
        values.map(|values| rows(py, values, 4)).transpose()
    }

    #[getter]
    fn displacement(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        six(py, self.tracked.pose.map(|pose| Displacement::of_pose(&pose, self.about.at_mm).to_array()))
    }

    #[getter]
    fn pose_sd(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        six(py, self.tracked.pose_sd.map(Displacement::to_array))
    }

    #[getter]
    fn pose_rms_px(&self) -> Option<f64> {
        self.tracked.pose_rms_px
    }

    #[getter]
    fn dots(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let mut table = Table::default();
        for dot in &self.tracked.black_dots {
            table.number(dot.id);
            table.name(dot.state.as_str());
            table.pair(dot.image_px);
            table.pair(dot.centroid_px);
            table.one(dot.sd_px);
            table.pair(dot.undeformed_px);
            table.pair(dot.motion_px);
            table.triple(dot.displacement_mm);
            table.one(dot.displacement_sd_random_mm);
            table.triple(dot.ray);
        }
        table.into_array(py, "DOT")
    }

    #[getter]
    fn markers(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let mut table = Table::default();
        for marker in &self.tracked.white_markers {
            table.number(marker.id);
            table.name(marker.state.as_str());
            table.pair(marker.image_px);
            table.pair(marker.centroid_px);
            table.one(marker.sd_px);
            table.pair(marker.residual_px);
        }
        table.into_array(py, "MARKER")
    }

    #[getter]
    fn false_dots(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let places = || self.tracked.false_dots.iter().flat_map(|at| at.to_array()).collect();
        self.tracked.searched.then(|| rows(py, places(), 2)).transpose()
    }

    /// The line that `domecast track` writes of this frame, without its end.
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
            write_json_fields(&mut line, &self.tracked, &fields)
                .map_err(|error| Fault::Ours(error.to_string()))?;
            text_of(line, shape.map(|map| domecast_cli::shape_members(map.map(), false)))
        };
        Ok(py.detach(write)?)
    }

    /// The reading drawn over its frame, as PNG.
    #[pyo3(signature = (frame, *, rgb, magnify = 1.0, shape = None, forces = None))]
    fn overlay_png(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        rgb: bool,
        magnify: f64,
        shape: Option<&PyShapeMap>,
        forces: Option<&PyForces>,
    ) -> PyResult<Py<PyBytes>> {
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        let made = py.detach(|| self.draw(&seen, magnify, shape, forces))?;
        Ok(PyBytes::new(py, &made).unbind())
    }

    fn _repr_png_(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        let made = py.detach(|| self.draw_alone())?;
        Ok(PyBytes::new(py, &made).unbind())
    }

    fn __repr__(&self) -> String {
        let force =
            self.tracked.wrench.zip(self.tracked.wrench_sd).map_or_else(String::new, |(w, sd)| {
                format!(", Fz {:.3} +- {:.3} N", w.force_n.z, sd.force_n.z)
            });
        format!("<domecast.Reading {}: {}{force}>", self.tracked.frame, self.tracked.status())
    }
}
