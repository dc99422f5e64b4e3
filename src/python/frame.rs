//! A camera's frame as Python has it.

use std::borrow::Cow;

use domecast_runtime::track::CameraFrame;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::error::Fault;

const ALLOWED: &str = "a numpy array of uint8, shape (height, width, 3), or (height, width) of grey";

/// A frame of the caller's: its own bytes where they lie row by row in the order red, green, blue, else a copy.
pub(crate) struct FrameArray<'py> {
    array: PyReadonlyArrayDyn<'py, u8>,
    copy: Option<Vec<u8>>,
    /// Height, width, channels.
    shape: [usize; 3],
}

impl<'py> FrameArray<'py> {
    /// Takes a frame whose colours stand as `is_rgb` says: red first, or blue first as OpenCV has them.
    pub fn new(given: &Bound<'py, PyAny>, is_rgb: bool) -> PyResult<Self> {
        let fault = |value: String, problem: &str| Fault::argument("frame", value, problem, ALLOWED);
        let Ok(array) = given.cast::<PyArrayDyn<u8>>() else {
            let dtype = given.getattr("dtype").and_then(|dtype| Ok(dtype.str()?.to_string()));
            let kind = dtype.unwrap_or_else(|_| given.get_type().to_string());
            return Err(fault(kind, "is no frame").into());
        };
        let shape = match *array.shape() {
            [height, width] | [height, width, 1] => [height, width, 1],
            [height, width, 3] => [height, width, 3],
            ref other => return Err(fault(format!("{other:?}"), "has another shape").into()),
        };
        let array =
            array.try_readonly().map_err(|_| fault(String::new(), "is being written to by another call"))?;
        let mut copy = (!array.is_c_contiguous()).then(|| array.as_array().iter().copied().collect());
        if shape[2] == 3 && !is_rgb {
            let mut bytes: Vec<u8> = match copy {
                Some(bytes) => bytes,
                None => array.as_slice().map_err(|_| fault(String::new(), "is not contiguous"))?.to_vec(),
            };
            bytes.chunks_exact_mut(3).for_each(|pixel| pixel.swap(0, 2));
            copy = Some(bytes);
        }
        Ok(Self { array, copy, shape })
    }

    /// Its bytes, for the library.
    pub fn bytes(&self) -> Cow<'_, [u8]> {
        match (&self.copy, self.array.as_slice()) {
            (Some(copy), _) => Cow::Borrowed(copy),
            (None, Ok(own)) => Cow::Borrowed(own),
            // not contiguous after all
            (None, Err(_)) => Cow::Owned(self.array.as_array().iter().copied().collect()),
        }
    }

    /// The frame over its bytes.
    pub fn over<'a>(&self, bytes: &'a [u8]) -> Result<CameraFrame<'a>, Fault> {
        let [height, width, channels] = self.shape;
        Ok(CameraFrame::new(width, height, channels, bytes)?)
    }
}
