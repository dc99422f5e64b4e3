//! What the sensor will see: frames and their truth, one after the other.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use domecast_design::{FileKind, from_value, parse_json};
use domecast_fab::constants;
use domecast_sim::run::each_frame;
use domecast_sim::scene::SceneFile;
use domecast_sim::{Image8, Plan, Renderer, Scene};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyStopIteration;
use pyo3::prelude::*;

use crate::design::PyDesign;
use crate::error::Fault;
use crate::tracker::PySensor;

/// Frames that are drawn ahead of the one that is looked at.
const AHEAD: usize = 1;
/// How often a call that waits for a frame looks whether the user wants it to end.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// What happens to a sensor, resolved.
#[pyclass(name = "NativeScene", module = "domecast._native", frozen)]
pub(crate) struct PyScene {
    scene: Arc<Scene>,
}

/// The plan of a scene.
pub(crate) fn plan_of(scene: &Scene, everything: bool) -> Result<Plan, Fault> {
    Ok(if everything { Plan::everything(scene) } else { Plan::of(scene) }?)
}

#[pymethods]
impl PyScene {
    /// Reads a scene file, with other numbers of frames and seeds than it says where they are given.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, frames: Option<u32>, seed: Option<u64>) -> PyResult<Self> {
        let made = py.detach(|| {
            let mut scene = Scene::load(&path)?;
            scene.override_run(frames, seed)?;
            Ok::<_, Fault>(scene)
        });
        let scene = made.map_err(|fault: Fault| fault.in_file(Some(&path)))?;
        Ok(Self { scene: Arc::new(scene) })
    }

    /// Resolves a scene's text, for a design that is there already where one is given; relative paths start at `folder`.
    #[staticmethod]
    fn from_text(
        py: Python<'_>,
        text: &str,
        folder: PathBuf,
        design: Option<&PyDesign>,
        frames: Option<u32>,
        seed: Option<u64>,
    ) -> PyResult<Self> {
        let made = py.detach(|| {
            let mut scene = match design {
                None => Scene::from_text(text, &folder)?,
                Some(design) => {
                    let value = parse_json(text)?;
                    FileKind::Scene.expect(&value)?;
                    let file: SceneFile = from_value(&value)?;
                    Scene::new(file, &folder, (*design.design()).clone())?
                }
            };
            scene.override_run(frames, seed)?;
            Ok::<_, Fault>(scene)
        });
        Ok(Self { scene: Arc::new(made?) })
    }

    #[getter]
    fn name(&self) -> &str {
        self.scene.name()
    }

    #[getter]
    fn frame_count(&self) -> u32 {
        self.scene.frame_count()
    }

    /// Width and height of a frame, px.
    #[getter]
    fn size(&self) -> (usize, usize) {
        self.scene.image_size()
    }

    /// The plan of effects, as JSON.
    fn plan(&self, py: Python<'_>, everything: bool) -> PyResult<String> {
        let text = py.detach(|| {
            let plan = plan_of(&self.scene, everything)?;
            Ok::<_, Fault>(serde_json::to_string(&plan).unwrap_or_default())
        });
        Ok(text?)
    }

    /// The constants of the scene's sensor.
    fn sensor(&self, py: Python<'_>) -> PyResult<PySensor> {
        let scene = &self.scene;
        let made = py.detach(|| constants::of(scene.design(), scene.layout())).map_err(Fault::from)?;
        Ok(PySensor::new(made))
    }

    /// The frames in their order.
    fn frames(&self, everything: bool) -> PyResult<PyFrames> {
        let (send, receive) = sync_channel(AHEAD);
        let scene = Arc::clone(&self.scene);
        let draw = move || {
            let drawn = plan_of(&scene, everything).and_then(|plan| {
                let renderer = Renderer::new(&scene, &plan)?;
                // a receiver that is gone wants no more frames
                each_frame(&renderer, &mut |drawn, _| {
                    send.send(Next::Frame(drawn.image, drawn.truth.to_line())).is_ok()
                })?;
                Ok(())
            });
            let _ = send.send(drawn.map_or_else(Next::Fault, |()| Next::End));
        };
        std::thread::Builder::new()
            .name("domecast frames".into())
            .spawn(draw)
            .map_err(|error| Fault::Ours(format!("no thread: {error}")))?;
        Ok(PyFrames { frames: Mutex::new(Some(receive)) })
    }
}

impl PyScene {
    pub fn scene(&self) -> Arc<Scene> {
        Arc::clone(&self.scene)
    }
}

/// A picture as an array in place of its bytes: (height, width, 3), or (height, width) of grey.
pub(crate) fn array_of(py: Python<'_>, image: Image8) -> PyResult<Py<PyAny>> {
    let bytes = PyArray1::from_vec(py, image.bytes);
    let frame = match image.channels {
        1 => bytes.reshape([image.height, image.width])?.into_any(),
        channels => bytes.reshape([image.height, image.width, channels])?.into_any(),
    };
    Ok(frame.unbind())
}

/// What comes after the last frame.
enum Next {
    Frame(Option<Image8>, String),
    Fault(Fault),
    End,
}

/// Frames on their way from the thread that draws them.
#[pyclass(name = "NativeFrames", module = "domecast._native", frozen)]
pub(crate) struct PyFrames {
    frames: Mutex<Option<Receiver<Next>>>,
}

impl PyFrames {
    /// Waits for the next frame for a while; `None` where none has come yet.
    fn wait(&self) -> Option<Next> {
        let mut frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(receive) = frames.as_ref() else { return Some(Next::End) };
        let next = match receive.recv_timeout(LOOK) {
            Err(RecvTimeoutError::Timeout) => return None,
            Err(RecvTimeoutError::Disconnected) => Next::Fault(Fault::Ours("a frame was not drawn".into())),
            Ok(next) => next,
        };
        if !matches!(next, Next::Frame(..)) {
            *frames = None;
        }
        Some(next)
    }
}

#[pymethods]
impl PyFrames {
    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    /// The next frame (height, width, colours) and the line of its truth.
    fn __next__(&self, py: Python<'_>) -> PyResult<(Option<Py<PyAny>>, String)> {
        let next = loop {
            py.check_signals()?;
            if let Some(next) = py.detach(|| self.wait()) {
                break next;
            }
        };
        match next {
            Next::End => Err(PyStopIteration::new_err(())),
            Next::Fault(fault) => Err(fault.into()),
            Next::Frame(None, line) => Ok((None, line)),
            Next::Frame(Some(image), line) => Ok((Some(array_of(py, image)?), line)),
        }
    }
}
