//! How hard what is touched is: by contact mechanics and the hand's travel, and by a network.

use std::path::PathBuf;

use domecast_hardness::physics::Hardness;
use domecast_hardness::{ContactHardness, HardnessModel, HardnessReader, ModelError, TrackedRest};
use pyo3::prelude::*;
use serde_json::Value;

use crate::error::Fault;
use crate::forces::PyForces;
use crate::frame::FrameArray;
use crate::reading::PyReading;
use crate::shape_map::PyShapeMap;
use crate::tracker::{PySensor, within};

const UNTOUCHED: &str = "a reading of this sensor with a wrench, untouched";

/// What a frame says of hardness, as `domecast track` writes it.
#[pyclass(name = "Hardness", module = "domecast", frozen)]
pub(crate) struct PyHardness {
    member: Value,
    by_contact: Option<Hardness>,
}

impl PyHardness {
    /// `None` where nothing is said.
    fn new(member: Value, by_contact: Option<Hardness>) -> Option<Self> {
        (!member.is_null()).then_some(Self { member, by_contact })
    }

    fn text(&self, name: &str) -> Option<&str> {
        self.member[name].as_str()
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.member[name].as_f64()
    }
}

#[pymethods]
impl PyHardness {
    #[getter]
    fn status(&self) -> &str {
        self.text("status").unwrap_or_default()
    }

    #[getter]
    fn reason(&self) -> Option<&str> {
        self.text("reason")
    }

    #[getter]
    fn class_name(&self) -> Option<&str> {
        self.text("class")
    }

    #[getter]
    fn probability(&self) -> Option<f64> {
        self.number("probability")
    }

    #[getter]
    fn log10_youngs_modulus_mpa(&self) -> Option<f64> {
        self.number("log10_youngs_modulus_mpa")
    }

    #[getter]
    fn interval_90(&self) -> Option<(f64, f64)> {
        let ends = &self.member["interval_90"];
        ends[0].as_f64().zip(ends[1].as_f64())
    }

    #[getter]
    fn frames(&self) -> Option<u64> {
        self.member["frames"].as_u64()
    }

    /// The member of the line that `domecast track` writes.
    fn json(&self) -> String {
        self.member.to_string()
    }

    fn __repr__(&self) -> String {
        let said = self.class_name().map(str::to_owned);
        let modulus = || self.log10_youngs_modulus_mpa().map(|log| format!("{:.3} MPa", 10.0_f64.powf(log)));
        let said = said.or_else(modulus).map_or_else(String::new, |said| format!(", {said}"));
        format!("<domecast.Hardness {}{said}>", self.status())
    }
}

/// Hardness by contact mechanics, touch by touch.
#[pyclass(name = "ContactHardness", module = "domecast")]
pub(crate) struct PyContactHardness {
    touch: ContactHardness,
}

/// What wrench and dots are counted from.
fn counted_from(reading: &PyReading, must_be_known: bool) -> Result<TrackedRest, Fault> {
    let tracked = reading.tracked();
    let rest = TrackedRest::new(tracked, reading.about().at_mm);
    if must_be_known && !rest.is_known() {
        return Err(Fault::argument("rest", tracked.status(), "has no wrench", UNTOUCHED));
    }
    Ok(rest)
}

#[pymethods]
impl PyContactHardness {
    #[new]
    #[pyo3(signature = (sensor, rest, *, travel_sd_mm = 0.02))]
    fn new(sensor: &PySensor, rest: &PyReading, travel_sd_mm: f64) -> PyResult<Self> {
        let constants = sensor.constants();
        within("travel_sd_mm", Some(travel_sd_mm), 1e-6, 10.0)?;
        if rest.tracked().black_dots.len() != constants.black_dots.len() {
            return Err(Fault::argument("rest", "", "is another sensor's", UNTOUCHED).into());
        }
        let rest = counted_from(rest, constants.springs.is_some())?;
        let touch = ContactHardness::new(&constants, rest, travel_sd_mm).ok_or_else(|| {
            Fault::argument("sensor", &constants.design, "holds no `elastomer`", "constants of a new build")
        })?;
        Ok(Self { touch })
    }

    /// Takes a frame in, with how far the hand has brought sensor and object together.
    #[pyo3(signature = (forces, shape, *, travel_mm))]
    fn update(
        &mut self,
        py: Python<'_>,
        forces: &PyForces,
        shape: &PyShapeMap,
        travel_mm: f64,
    ) -> PyResult<Option<PyHardness>> {
        if !travel_mm.is_finite() {
            return Err(Fault::argument("travel_mm", travel_mm, "is no travel", "mm, finite").into());
        }
        let (tracked, local, skin) = (forces.tracked(), forces.local(), Some(shape.map()));
        let found = py.detach(|| self.touch.update(tracked, local, skin, travel_mm));
        Ok(PyHardness::new(self.touch.to_json(found.as_ref()), found))
    }
}

/// Hardness by a network.
#[pyclass(name = "HardnessModel", module = "domecast")]
pub(crate) struct PyHardnessModel {
    model: HardnessModel,
    file: PathBuf,
}

#[pymethods]
impl PyHardnessModel {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let made = py.detach(|| HardnessReader::load(&path).and_then(HardnessModel::new));
        let fault = |error: ModelError| {
            Fault::argument(&error.at, "", &error.problem, &error.allowed).in_file(Some(&path))
        };
        Ok(Self { model: made.map_err(fault)?, file: path.clone() })
    }

    /// Takes a frame of the untouched sensor, and its reading.
    #[pyo3(signature = (frame, reading, *, rgb))]
    fn set_rest(
        &mut self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        reading: &PyReading,
        rgb: bool,
    ) -> PyResult<()> {
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        if reading.about().is_turned {
            let (problem, allowed) =
                ("is of a turned camera, which no model knows", "a tracker without `camera_turned_deg`");
            return Err(Fault::argument("reading", "", problem, allowed).into());
        }
        let rest = counted_from(reading, true)?;
        if py.detach(|| self.model.set_rest(&seen, rest)) {
            return Ok(());
        }
        Err(Fault::argument("frame", "", "is not whole", "a frame of the untouched sensor").into())
    }

    /// Takes the next frame in, with its reading, and what else is known of it.
    #[pyo3(signature = (frame, reading, *, rgb, shape = None, contact = None))]
    fn update(
        &mut self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        reading: &PyReading,
        rgb: bool,
        shape: Option<&PyShapeMap>,
        contact: Option<&PyHardness>,
    ) -> PyResult<Option<PyHardness>> {
        let array = FrameArray::new(frame, rgb)?;
        let bytes = array.bytes();
        let seen = array.over(&bytes)?;
        if !self.model.has_rest() {
            let allowed = "`set_rest` with a frame of the untouched sensor first";
            return Err(Fault::argument("rest", "", "was not given", allowed).into());
        }
        if let Some(shape) = shape {
            self.model.see_skin(shape.map());
        }
        let by_contact = contact.and_then(|contact| contact.by_contact.as_ref());
        if contact.is_some() && by_contact.is_none() {
            let (problem, allowed) = ("is a model's", "what a `ContactHardness` gives of the same frame");
            return Err(Fault::argument("contact", "", problem, allowed).into());
        }
        let found = py.detach(|| self.model.update(Some(&seen), reading.tracked(), by_contact));
        Ok(PyHardness::new(self.model.to_json(found.as_ref()), None))
    }

    /// Forgets the frames, not the rest.
    fn restart(&mut self) {
        self.model.restart();
    }

    fn __repr__(&self) -> String {
        format!("<domecast.HardnessModel {}>", self.file.display())
    }
}
