//! Points in, arrays and tables out.

use glam::{DVec2, DVec3};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::Fault;

/// Letters of a name in a table, such as a mark's state.
const NAME_LETTERS: usize = 16;

/// An (N, `K`) array of points: the caller's own where it is contiguous and of 64-bit floats, else a copy.
pub(crate) fn points<'py, const K: usize>(
    given: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<PyReadonlyArray2<'py, f64>> {
    let py = given.py();
    let allowed = format!("an array of shape (N, {K}), 64-bit floats");
    let fault = |problem: &str| Fault::argument(name, "", problem, &allowed);
    let numpy = py.import("numpy")?;
    let no_array = |error: PyErr| fault(&format!("is no array of numbers ({error})"));
    let array = numpy.call_method1("asarray", (given,)).map_err(no_array)?;
    let dtype = array.getattr("dtype")?;
    // complex numbers, texts and dates would be converted, with a part of them lost
    if !matches!(dtype.getattr("kind")?.extract::<String>()?.as_str(), "i" | "u" | "f") {
        return Err(fault(&format!("holds {dtype}")).into());
    }
    let kwargs = PyDict::new(py);
    kwargs.set_item("dtype", "f8")?;
    let array = numpy.call_method("ascontiguousarray", (array,), Some(&kwargs)).map_err(no_array)?;
    let array = array.cast_into::<PyArray2<f64>>().map_err(|_| fault("does not have two dimensions"))?;
    if array.shape()[1] != K {
        return Err(fault(&format!("has {} columns", array.shape()[1])).into());
    }
    array.try_readonly().map_err(|_| fault("is being written to").into())
}

/// Values as an array of rows of `columns`, without a copy.
pub(crate) fn rows<T: numpy::Element>(py: Python<'_>, values: Vec<T>, columns: usize) -> PyResult<Py<PyAny>> {
    let count = values.len() / columns.max(1);
    Ok(PyArray1::from_vec(py, values).reshape([count, columns])?.into_any().unbind())
}

/// Values as a flat array, without a copy.
pub(crate) fn flat<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> Py<PyAny> {
    PyArray1::from_vec(py, values).into_any().unbind()
}

/// Rows of a structured array whose fields `domecast._arrays` names, one value after the other.
#[derive(Default)]
pub(crate) struct Table {
    bytes: Vec<u8>,
}

impl Table {
    pub fn number(&mut self, value: u32) {
        self.bytes.extend(value.to_ne_bytes());
    }

    pub fn name(&mut self, text: &str) {
        let letters = text.chars().chain(std::iter::repeat('\0')).take(NAME_LETTERS);
        letters.for_each(|letter| self.bytes.extend(u32::from(letter).to_ne_bytes()));
    }

    pub fn one(&mut self, value: Option<f64>) {
        self.bytes.extend(value.unwrap_or(f64::NAN).to_ne_bytes());
    }

    pub fn pair(&mut self, value: Option<DVec2>) {
        value.unwrap_or(DVec2::NAN).to_array().iter().for_each(|v| self.one(Some(*v)));
    }

    pub fn triple(&mut self, value: Option<DVec3>) {
        value.unwrap_or(DVec3::NAN).to_array().iter().for_each(|v| self.one(Some(*v)));
    }

    /// The array, in place of the bytes.
    pub fn into_array(self, py: Python<'_>, kind: &str) -> PyResult<Py<PyAny>> {
        let dtype = py.import("domecast._arrays")?.getattr(kind)?;
        Ok(PyArray1::from_vec(py, self.bytes).call_method1("view", (dtype,))?.unbind())
    }
}

/// Names as an array of strings.
pub(crate) fn names<'a>(
    py: Python<'_>,
    names: impl Iterator<Item = &'a str>,
    letters: usize,
) -> PyResult<Py<PyAny>> {
    let codes: Vec<u32> = names
        .flat_map(|name| name.chars().map(u32::from).chain(std::iter::repeat(0)).take(letters))
        .collect();
    Ok(PyArray1::from_vec(py, codes).call_method1("view", (format!("U{letters}"),))?.unbind())
}
