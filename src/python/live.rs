//! A scene whose objects stand where a simulator of bodies puts them.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

use domecast_optics::numeric::Rigid;
use domecast_sim::run::LiveScene;
use domecast_sim::{Image8, Renderer, Scene};
use pyo3::prelude::*;

use crate::arrays::points;
use crate::error::Fault;
use crate::scene::{LOOK, PyScene, array_of, plan_of};

/// What a step is asked for.
enum Ask {
    Step(Vec<Option<Rigid>>),
    Restart,
}

/// A frame and the line of its truth; none after a restart.
type Answer = Result<Option<(Option<Image8>, String)>, Fault>;

/// A sensor that is touched step by step.
#[pyclass(name = "NativeLive", module = "domecast._native", frozen)]
pub(crate) struct PyLive {
    ways: Mutex<Option<(Sender<Ask>, Receiver<Answer>)>>,
    objects: usize,
}

/// Answers until nobody asks any more. What holds for all steps is made first.
fn serve(
    scene: &Scene,
    everything: bool,
    asks: &Receiver<Ask>,
    answers: &Sender<Answer>,
) -> Result<(), Fault> {
    let plan = plan_of(scene, everything)?;
    let renderer = Renderer::new(scene, &plan)?;
    let mut live = LiveScene::new(&renderer)?;
    for ask in asks {
        let answer = match ask {
            Ask::Restart => live.restart().map(|()| None),
            Ask::Step(poses) => live.step(&poses).map(|drawn| Some((drawn.image, drawn.truth.to_line()))),
        };
        if answers.send(answer.map_err(Fault::from)).is_err() {
            break;
        }
    }
    Ok(())
}

impl PyLive {
    fn ask(&self, py: Python<'_>, ask: Ask) -> PyResult<Option<(Option<Image8>, String)>> {
        let gone = || Fault::Ours("the drawing has ended".into());
        let send = || {
            let ways = self.ways.lock().unwrap_or_else(PoisonError::into_inner);
            ways.as_ref().is_some_and(|(asks, _)| asks.send(ask).is_ok())
        };
        // where nobody takes the question, the reason still waits among the answers
        py.detach(send);
        loop {
            if let Err(interrupt) = py.check_signals() {
                // an answer that comes later would be taken for another question's
                *self.ways.lock().unwrap_or_else(PoisonError::into_inner) = None;
                return Err(interrupt);
            }
            let answer = py.detach(|| {
                let ways = self.ways.lock().unwrap_or_else(PoisonError::into_inner);
                match ways.as_ref().map(|(_, answers)| answers.recv_timeout(LOOK)) {
                    Some(Ok(answer)) => Some(answer),
                    Some(Err(RecvTimeoutError::Timeout)) => None,
                    Some(Err(RecvTimeoutError::Disconnected)) | None => Some(Err(gone())),
                }
            });
            if let Some(answer) = answer {
                return Ok(answer?);
            }
        }
    }
}

#[pymethods]
impl PyLive {
    #[new]
    fn new(scene: &PyScene, everything: bool) -> PyResult<Self> {
        let (asks, to_draw) = channel();
        let (send, answers) = channel();
        let scene: Arc<Scene> = scene.scene();
        let objects = scene.objects().len();
        let draw = move || {
            if let Err(fault) = serve(&scene, everything, &to_draw, &send) {
                // whoever asks first learns of it
                let _ = send.send(Err(fault));
            }
        };
        std::thread::Builder::new()
            .name("domecast live".into())
            .spawn(draw)
            .map_err(|error| Fault::Ours(format!("no thread: {error}")))?;
        Ok(Self { ways: Mutex::new(Some((asks, answers))), objects })
    }

    /// Puts the objects at poses (N, 16), rows of a 4 x 4 `rest_from_object`, mm, NaN for one that is away; the frame, and the
    /// line of its truth.
    fn step(&self, py: Python<'_>, poses: &Bound<'_, PyAny>) -> PyResult<(Option<Py<PyAny>>, String)> {
        let given = points::<16>(poses, "poses")?;
        let rows = given.as_array();
        if rows.nrows() != self.objects {
            let allowed = format!("a row for each of {} objects", self.objects);
            return Err(Fault::argument("poses", rows.nrows(), "has another number of rows", &allowed).into());
        }
        let pose_of = |(index, row): (usize, Vec<f64>)| {
            if row.iter().any(|value| value.is_nan()) {
                return Ok(None);
            }
            let matrix: [[f64; 4]; 4] = std::array::from_fn(|r| std::array::from_fn(|c| row[4 * r + c]));
            Rigid::from_rows_4x4(&matrix).map(Some).map_err(|error| {
                let allowed = "a rotation and a translation in mm, or NaN";
                Fault::argument(&format!("poses[{index}]"), "", &error.to_string(), allowed)
            })
        };
        let numbered = rows.outer_iter().map(|row| row.to_vec()).enumerate();
        let poses = numbered.map(pose_of).collect::<Result<Vec<_>, Fault>>()?;
        match self.ask(py, Ask::Step(poses))? {
            Some((image, line)) => Ok((image.map(|image| array_of(py, image)).transpose()?, line)),
            None => Err(Fault::Ours("a step has no frame".into()).into()),
        }
    }

    /// Forgets what touched the dome.
    fn restart(&self, py: Python<'_>) -> PyResult<()> {
        self.ask(py, Ask::Restart).map(|_| ())
    }
}
