//! A resolved design and its layout.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use domecast_design::Design;
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_fab::artwork::{Films, camera_view, outside_view};
use domecast_fab::{build, constants};
use domecast_files::{OutputRules, StagedFolder};
use domecast_optics::SensorOptics;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::json;

use crate::arrays::Table;
use crate::error::Fault;
use crate::tracker::PySensor;

/// A design as it was resolved from its text: nothing of it changes any more.
#[pyclass(name = "ResolvedDesign", module = "domecast._native", frozen)]
pub(crate) struct PyDesign {
    design: Arc<Design>,
    file: Option<PathBuf>,
}

impl PyDesign {
    pub fn optics(&self) -> SensorOptics {
        self.design.optics().clone()
    }

    pub fn design(&self) -> Arc<Design> {
        Arc::clone(&self.design)
    }

    fn laid_out(&self) -> Result<(LayoutSpec, Layout), Fault> {
        let made = LayoutSpec::of_design(&self.design).and_then(|spec| {
            let layout = Layout::new(&spec)?;
            Ok((spec, layout))
        });
        made.map_err(|error| Fault::from(error).in_file(self.file.as_deref()))
    }

    /// Makes everything and puts it in its place; what it comes to, as JSON.
    fn make(&self, out: &Path, force: bool) -> Result<String, Fault> {
        let inputs: Vec<&Path> = self.file.iter().map(PathBuf::as_path).collect();
        let staged = StagedFolder::new(out, "build", &OutputRules { force, inputs: &inputs })?;
        let made = build::build(&self.design, &mut |_| {})?;
        made.tree.fill(&staged)?;
        let kept = staged.commit()?;
        let facts = json!({
            "out": out.display().to_string(),
            "dots": made.dot_count,
            "headlines": made.headlines,
            "kept": kept.map(|kept| kept.display().to_string()),
            "manifest": made.manifest,
        });
        Ok(facts.to_string())
    }
}

#[pymethods]
impl PyDesign {
    /// Resolves a text; relative paths in it start at `folder`.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: &str, folder: PathBuf, file: Option<PathBuf>) -> PyResult<Self> {
        let resolved = py.detach(|| Design::from_text_with_cures(text, &folder));
        let design = resolved.map_err(|error| Fault::from(error).in_file(file.as_deref()))?;
        Ok(Self { design: Arc::new(design), file })
    }

    /// A design file's text.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<String> {
        Ok(py.detach(|| domecast_design::read_text(&path)).map_err(Fault::from)?)
    }

    #[getter]
    fn name(&self) -> &str {
        self.design.name()
    }

    #[getter]
    fn text(&self) -> &str {
        self.design.text()
    }

    #[getter]
    fn warnings(&self) -> Vec<(String, String)> {
        self.design.warnings().iter().map(|one| (one.field.clone(), one.message.clone())).collect()
    }

    /// The fields that rules gave: field, value as JSON, rule.
    #[getter]
    fn derived(&self) -> Vec<(String, String, String)> {
        let text = |one: &domecast_design::DerivedField| {
            (one.field.to_string(), one.value.to_string(), one.rule.to_string())
        };
        self.design.derived().iter().map(text).collect()
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        let lens = self.design.optics().lens().spec();
        (lens.width, lens.height)
    }

    /// Height of the dome's pole over the sheet, mm.
    #[getter]
    fn pole_mm(&self) -> f64 {
        self.design.optics().dome().pole_mm().z
    }

    fn build(&self, py: Python<'_>, out: PathBuf, force: bool) -> PyResult<String> {
        let made = py.detach(|| self.make(&out, force));
        Ok(made.map_err(|fault| fault.in_file(self.file.as_deref()))?)
    }

    fn layout(&self, py: Python<'_>) -> PyResult<PyLayout> {
        let (spec, layout) = py.detach(|| self.laid_out())?;
        Ok(PyLayout { spec, layout })
    }

    fn sensor(&self, py: Python<'_>) -> PyResult<PySensor> {
        let made = py.detach(|| {
            let (_, layout) = self.laid_out()?;
            constants::of(&self.design, &layout)
                .map_err(|error| Fault::from(error).in_file(self.file.as_deref()))
        });
        Ok(PySensor::new(made?))
    }
}

/// The dots of a design.
#[pyclass(name = "Layout", module = "domecast", frozen)]
pub(crate) struct PyLayout {
    spec: LayoutSpec,
    layout: Layout,
}

impl PyLayout {
    fn camera_view(&self) -> Result<Vec<u8>, Fault> {
        Ok(camera_view(&self.spec, &self.layout)?)
    }
}

#[pymethods]
impl PyLayout {
    fn __len__(&self) -> usize {
        self.layout.dots.len()
    }

    fn __repr__(&self) -> String {
        let Layout { dots, lost, pitch_px, .. } = &self.layout;
        format!("<domecast.Layout: {} dots, {pitch_px:.2} px apart, {} left out>", dots.len(), lost.len())
    }

    #[getter]
    fn pitch_px(&self) -> f64 {
        self.layout.pitch_px
    }

    #[getter]
    fn passes(&self) -> usize {
        self.layout.passes.len()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.layout.warnings.clone()
    }

    #[getter]
    fn dots(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let mut table = Table::default();
        for dot in &self.layout.dots {
            table.number(dot.id);
            table.number(u32::try_from(dot.pass).unwrap_or(u32::MAX));
            table.pair(Some(dot.image_px));
            table.triple(Some(dot.surface_mm));
            table.triple(Some(dot.normal));
            table.pair(Some(dot.plate_mm));
            table.one(Some(dot.diameter_mm));
        }
        table.into_array(py, "LAYOUT_DOT")
    }

    /// The film of a print pass, from 0.
    #[pyo3(signature = (index = 0))]
    fn film_svg(&self, py: Python<'_>, index: usize) -> PyResult<Py<PyBytes>> {
        if index >= self.layout.passes.len() {
            let allowed = format!("0 to {}", self.layout.passes.len().saturating_sub(1));
            return Err(Fault::argument("index", index, "there is no such print pass", &allowed).into());
        }
        let svg = py.detach(|| self.layout.film(index).to_svg()).map_err(Fault::from)?;
        Ok(PyBytes::new(py, &svg).unbind())
    }

    /// The dots as the camera will see them, as PNG.
    fn camera_view_png(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        let made = py.detach(|| self.camera_view())?;
        Ok(PyBytes::new(py, &made).unbind())
    }

    /// The printed dome from above, as PNG.
    fn outside_view_png(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        let made = py.detach(|| outside_view(&self.layout)).map_err(Fault::from)?;
        Ok(PyBytes::new(py, &made).unbind())
    }

    fn _repr_png_(&self, py: Python<'_>) -> PyResult<Py<PyBytes>> {
        self.camera_view_png(py)
    }
}
