//! The skin's shape as arrays and as a picture.

use domecast_runtime::overlay::{depth_range_mm, viridis};
use domecast_runtime::shape::ShapeMap;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::rows;
use crate::error::Fault;
use crate::picture::png_bytes;

/// The skin as a frame shows it, a value for each raw pixel.
#[pyclass(name = "ShapeMap", module = "domecast", frozen)]
pub(crate) struct PyShapeMap {
    map: ShapeMap,
}

impl PyShapeMap {
    pub fn new(map: ShapeMap) -> Self {
        Self { map }
    }

    pub fn map(&self) -> &ShapeMap {
        &self.map
    }

    fn grid<T: numpy::Element>(&self, py: Python<'_>, values: Vec<T>) -> PyResult<Py<PyAny>> {
        rows(py, values, self.map.width)
    }

    /// The depth in colours over dark ground, what touches lighter.
    fn draw(&self) -> Result<Vec<u8>, Fault> {
        const GROUND: [u8; 3] = [40; 3];
        let deepest_mm = self.map.contact.as_ref().map_or(0.0, |touch| touch.depth_mm);
        let range_mm = depth_range_mm(deepest_mm);
        let color = |height_mm: &f32| match f64::from(-height_mm) / range_mm {
            share if share.is_nan() => GROUND,
            share => viridis(share.clamp(0.0, 1.0)),
        };
        let bytes: Vec<u8> = self.map.height_mm.iter().flat_map(color).collect();
        png_bytes(self.map.width, self.map.height, 3, &bytes)
    }
}

#[pymethods]
impl PyShapeMap {
    #[getter]
    fn status(&self) -> &'static str {
        self.map.status_name()
    }

    #[getter]
    fn height_mm(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.grid(py, self.map.height_mm.clone())
    }

    #[getter]
    fn height_sd_mm(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.grid(py, self.map.height_sd_mm.clone())
    }

    #[getter]
    fn touched(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.grid(py, self.map.is_touched.clone())
    }

    #[getter]
    fn normal(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let values: Vec<f32> = self.map.normal.iter().flat_map(|normal| normal.to_array()).collect();
        let shape = [self.map.height, self.map.width, 3];
        Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any().unbind())
    }

    /// `contact` and `shape` as members of the line of `domecast track --shape`, an object.
    #[getter]
    fn members(&self, py: Python<'_>) -> String {
        py.detach(|| format!("{{{}}}", domecast_cli::shape_members(&self.map, false)))
    }

    /// The skin as triangles: points, mm, normals, corners.
    fn surface(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
        let found = py.detach(|| self.map.surface());
        let flat = |points: &[_]| -> Vec<f32> {
            points.iter().flat_map(|point: &glam::Vec3| point.to_array()).collect()
        };
        Ok((
            rows(py, flat(&found.points_mm), 3)?,
            rows(py, flat(&found.normals), 3)?,
            rows(py, found.triangles.concat(), 3)?,
        ))
    }

    fn _repr_png_(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        let made = py.detach(|| self.draw())?;
        Ok(PyBytes::new(py, &made).unbind())
    }

    fn __repr__(&self) -> String {
        let depth = self
            .map
            .contact
            .as_ref()
            .map_or_else(String::new, |touch| format!(", {:.3} mm deep", touch.depth_mm));
        format!("<domecast.ShapeMap {} x {}: {}{depth}>", self.map.width, self.map.height, self.status())
    }
}
