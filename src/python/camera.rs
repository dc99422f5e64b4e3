//! A camera, or recorded frames that are played as one would give them.

use std::sync::{Arc, Mutex, PoisonError};

use domecast_live::decode::Picture;
use domecast_live::source::{ArrivedFrame, CameraRequest, ControlRequest, open_device};
use domecast_live::{LiveEvent, LiveReader};
use domecast_sim::Image8;
use pyo3::prelude::*;

use crate::error::Fault;
use crate::scene::{LOOK, array_of};
use crate::tracker::PySensor;

/// Frames that wait at most: what is older than that is no longer live.
const MAX_WAITING: usize = 4;
const DEVICES: &str = "a camera such as /dev/video0, or player:FOLDER?rate=60";

/// A device of `domecast live`.
#[pyclass(name = "Camera", module = "domecast", frozen)]
pub(crate) struct PyCamera {
    reader: Mutex<LiveReader>,
    device: String,
}

/// What a wait has come to.
enum Heard {
    Frame(Image8, f64, u64),
    Damaged,
    Nothing,
    End(Option<String>),
}

impl PyCamera {
    fn fault(&self, problem: &str) -> Fault {
        Fault::argument("device", &self.device, problem, DEVICES)
    }

    fn hear(&self) -> Heard {
        let reader = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        match reader.next(LOOK) {
            Some(LiveEvent::Frame(ArrivedFrame { data, time_s, number, .. }, _)) => {
                let Ok(picture) = data.decode() else { return Heard::Damaged };
                // the last one who holds the picture takes it without a copy
                drop(data);
                let Picture { width, height, channels, bytes } = Arc::unwrap_or_clone(picture);
                Heard::Frame(Image8 { width, height, channels, bytes }, time_s, number)
            }
            Some(LiveEvent::Ended(why)) => Heard::End(why),
            // one that is gone is tried again until it is back
            Some(LiveEvent::Unplugged(_) | LiveEvent::Replugged(..)) | None => Heard::Nothing,
        }
    }
}

#[pymethods]
impl PyCamera {
    #[new]
    #[pyo3(signature = (device, sensor, *, rate=30.0, exposure_ms=None, gain=None, white_balance_k=None))]
    fn new(
        py: Python<'_>,
        device: String,
        sensor: &PySensor,
        rate: f64,
        exposure_ms: Option<f64>,
        gain: Option<i32>,
        white_balance_k: Option<i32>,
    ) -> PyResult<Self> {
        if !(0.1..=1000.0).contains(&rate) {
            return Err(Fault::argument("rate", rate, "is no rate", "0.1 to 1000 frames a second").into());
        }
        if exposure_ms.is_some_and(|ms| !(0.1..=10_000.0).contains(&ms)) {
            let value = exposure_ms.unwrap_or_default();
            return Err(Fault::argument("exposure_ms", value, "is no exposure", "0.1 to 10000 ms").into());
        }
        if device == "-" {
            let problem = "standard input is not read from Python";
            return Err(Fault::argument("device", device, problem, DEVICES).into());
        }
        let camera = sensor.constants().camera.clone();
        let size = [camera.width, camera.height];
        let request = CameraRequest {
            size,
            rate_hz: rate,
            controls: ControlRequest { exposure_ms, gain, white_balance_k },
        };
        let opened = py.detach(|| {
            let source = open_device(&device, request)?;
            let wanted = size.map(|side| side as usize);
            if let Some([w, h]) = source.info().size.filter(|own| *own != wanted) {
                let [width, height] = wanted;
                return Err(format!("gives frames of {w} x {h}, the sensor's are {width} x {height}"));
            }
            LiveReader::start(source, MAX_WAITING).map_err(|error| error.to_string())
        });
        match opened {
            Ok(reader) => Ok(Self { reader: Mutex::new(reader), device }),
            Err(problem) => Err(Fault::argument("device", device, &problem, DEVICES).into()),
        }
    }

    fn __iter__(this: Py<Self>) -> Py<Self> {
        this
    }

    /// The next frame, its time and its number; the interpreter is let go while none comes.
    fn __next__(&self, py: Python<'_>) -> PyResult<Option<(Py<PyAny>, f64, u64)>> {
        loop {
            match py.detach(|| self.hear()) {
                Heard::Frame(image, time_s, number) => {
                    return Ok(Some((array_of(py, image)?, time_s, number)));
                }
                Heard::End(None) => return Ok(None),
                Heard::End(Some(why)) => return Err(self.fault(&why).into()),
                Heard::Damaged | Heard::Nothing => py.check_signals()?,
            }
        }
    }

    fn __repr__(&self) -> String {
        format!("<domecast.Camera {}>", self.device)
    }
}
