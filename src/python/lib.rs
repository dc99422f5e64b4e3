//! domecast for Python: the module `domecast._native`, over which `domecast/*.py` lays what needs no speed.
//!
//! Numbers go in and out as numpy's arrays, the interpreter is let go while anything is computed, and every fault is a
//! `DomecastError` with the field. `domecast/_native.pyi` says what each class takes and gives.
#![allow(unsafe_code)] // pyo3's macros write it; no line of this crate does

mod arrays;
mod camera;
mod command;
mod design;
mod error;
mod forces;
mod frame;
mod hardness;
mod line;
mod live;
mod optics;
mod picture;
mod reading;
mod scene;
mod shape;
mod shape_map;
mod tracker;
mod traction;

use pyo3::prelude::*;

/// The module as Python imports it.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<design::PyDesign>()?;
    module.add_class::<design::PyLayout>()?;
    module.add_class::<optics::PyOptics>()?;
    module.add_class::<tracker::PySensor>()?;
    module.add_class::<tracker::PyTracker>()?;
    module.add_class::<reading::PyReading>()?;
    module.add_class::<shape::PyShape>()?;
    module.add_class::<shape_map::PyShapeMap>()?;
    module.add_class::<traction::PyTraction>()?;
    module.add_class::<forces::PyForces>()?;
    module.add_class::<hardness::PyHardness>()?;
    module.add_class::<hardness::PyContactHardness>()?;
    module.add_class::<hardness::PyHardnessModel>()?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<scene::PyFrames>()?;
    module.add_class::<live::PyLive>()?;
    module.add_class::<camera::PyCamera>()?;
    module.add_function(wrap_pyfunction!(command::main, module)?)?;
    module.add_function(wrap_pyfunction!(command::call, module)?)?;
    module.add_function(wrap_pyfunction!(command::write_text, module)?)?;
    module.add_function(wrap_pyfunction!(picture::png, module)?)?;
    Ok(())
}
