//! Pictures for notebooks.

use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::Fault;
use crate::frame::FrameArray;

/// Bytes as PNG: grey or red, green, blue.
pub(crate) fn png_bytes(
    width: usize,
    height: usize,
    channels: usize,
    bytes: &[u8],
) -> Result<Vec<u8>, Fault> {
    let mut out = Vec::new();
    let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let mut encoder = ::png::Encoder::new(&mut out, size(width), size(height));
    encoder.set_color(if channels == 3 { ::png::ColorType::Rgb } else { ::png::ColorType::Grayscale });
    encoder.set_depth(::png::BitDepth::Eight);
    let write = || -> Result<(), ::png::EncodingError> {
        let mut writer = encoder.write_header()?;
        writer.write_image_data(bytes)?;
        writer.finish()
    };
    write().map_err(|error| Fault::Ours(error.to_string()))?;
    Ok(out)
}

/// A frame as PNG.
#[pyfunction]
#[pyo3(signature = (frame, *, rgb))]
pub(crate) fn png<'py>(
    py: Python<'py>,
    frame: &Bound<'py, PyAny>,
    rgb: bool,
) -> PyResult<Bound<'py, PyBytes>> {
    let array = FrameArray::new(frame, rgb)?;
    let bytes = array.bytes();
    let seen = array.over(&bytes)?;
    let made = py.detach(|| png_bytes(seen.width(), seen.height(), seen.channels(), seen.bytes()))?;
    Ok(PyBytes::new(py, &made))
}
