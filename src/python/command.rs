//! The command line, as a program and as functions.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use domecast_files::{OutputRules, StagedFile};
use pyo3::prelude::*;

use crate::error::Fault;

/// Runs the program on `arguments`, its name first; returns the exit code. It takes over the process's signals.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| domecast_cli::run_with(&arguments))
}

/// Runs a command; returns its result as JSON, and notes on the caller's files.
#[pyfunction]
pub(crate) fn call(py: Python<'_>, arguments: Vec<OsString>) -> PyResult<(String, Vec<String>)> {
    let called = py.detach(|| domecast_cli::call(&arguments).map_err(Fault::from))?;
    Ok((called.result.to_string(), called.notes))
}

/// Writes a file whole or not at all, and never over anyone's work; returns where what stood there is kept.
#[pyfunction]
#[pyo3(signature = (path, text, *, inputs, force))]
pub(crate) fn write_text(
    py: Python<'_>,
    path: PathBuf,
    text: &str,
    inputs: Vec<PathBuf>,
    force: bool,
) -> PyResult<Option<PathBuf>> {
    let write = || -> Result<Option<PathBuf>, Fault> {
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let mut file = StagedFile::new(&path, "python", &OutputRules { force, inputs: &inputs })?;
        file.write(text.as_bytes())?;
        Ok(file.commit()?)
    };
    Ok(py.detach(write)?)
}
