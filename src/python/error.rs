//! Every fault of the library as one Python exception, with the fields that the library's own error carries.

use std::path::Path;

use domecast_cli::CallError;
use domecast_design::DesignError;
use domecast_design::layout::LayoutError;
use domecast_fab::artwork::RenderError;
use domecast_fab::build::BuildError;
use domecast_files::WriteError;
use domecast_runtime::constants::ConstantsError;
use domecast_runtime::overlay::OverlayError;
use domecast_runtime::shape::ShapeError;
use domecast_runtime::track::{FrameFault, TrackError};
use domecast_sim::SimError;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use serde_json::{Value, json};

/// Why a call has no result: what the user gave, or domecast itself.
#[derive(Debug)]
pub(crate) enum Fault {
    Input(Box<DesignError>),
    Ours(String),
}

impl Fault {
    /// An argument that is none: its name, what was given, what is wrong with it, what is allowed.
    pub fn argument(name: &str, value: impl std::fmt::Display, problem: &str, allowed: &str) -> Self {
        DesignError::at(name, value, problem, allowed).into()
    }

    /// The same fault in a file, where it names none yet.
    pub fn in_file(self, path: Option<&Path>) -> Self {
        match (self, path) {
            (Self::Input(error), Some(path)) if error.file.is_none() => error.in_file(path).into(),
            (other, _) => other,
        }
    }
}

impl From<DesignError> for Fault {
    fn from(error: DesignError) -> Self {
        Self::Input(Box::new(error))
    }
}

impl From<LayoutError> for Fault {
    fn from(error: LayoutError) -> Self {
        DesignError::from(error).into()
    }
}

impl From<SimError> for Fault {
    fn from(error: SimError) -> Self {
        match error {
            SimError::Input(error) => Self::Input(error),
            SimError::Frame { frame, problem } => {
                DesignError::at("", "", format!("frame {frame}: {problem}"), "a load that the springs carry")
                    .into()
            }
        }
    }
}

impl From<BuildError> for Fault {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Design(error) => Self::Input(error),
            BuildError::Ours(what) => Self::Ours(what),
        }
    }
}

impl From<CallError> for Fault {
    fn from(error: CallError) -> Self {
        match error {
            CallError::Input(error) => Self::Input(error),
            CallError::Internal(what) => Self::Ours(what),
            CallError::Other(problem) => DesignError::at("", "", problem, "").into(),
            other => Self::Ours(format!("{other:?}")),
        }
    }
}

impl From<TrackError> for Fault {
    fn from(error: TrackError) -> Self {
        DesignError::at(error.field, "", error.problem, "constants of a sensor").into()
    }
}

impl From<ShapeError> for Fault {
    fn from(error: ShapeError) -> Self {
        DesignError::at(error.field, "", error.problem, "").with_help(error.cure).into()
    }
}

impl From<ConstantsError> for Fault {
    fn from(error: ConstantsError) -> Self {
        let mut fault = DesignError::at("", "", error.problem, "a constants.json of this release");
        fault.file = error.file;
        fault.into()
    }
}

impl From<FrameFault> for Fault {
    fn from(error: FrameFault) -> Self {
        Self::argument(
            "frame",
            "",
            &error.to_string(),
            "uint8 of shape (height, width, 3) or (height, width)",
        )
    }
}

impl From<WriteError> for Fault {
    fn from(error: WriteError) -> Self {
        DesignError::at("", "", error.to_string(), "").into()
    }
}

impl From<RenderError> for Fault {
    fn from(error: RenderError) -> Self {
        Self::Ours(error.to_string())
    }
}

impl From<OverlayError> for Fault {
    fn from(error: OverlayError) -> Self {
        Self::Ours(error.to_string())
    }
}

impl From<Fault> for PyErr {
    fn from(fault: Fault) -> Self {
        match fault {
            Fault::Input(error) => raised(&error.to_json()),
            Fault::Ours(what) => {
                PyRuntimeError::new_err(format!("a fault in domecast itself, please report it: {what}"))
            }
        }
    }
}

/// The exception that carries these facts.
fn raised(facts: &Value) -> PyErr {
    let facts = match facts {
        Value::Object(_) => facts.clone(),
        other => json!({ "message": other.to_string() }),
    };
    Python::attach(|py| {
        let made = || py.import("domecast._error")?.getattr("of")?.call1((facts.to_string(),));
        made().map_or_else(|error| error, PyErr::from_value)
    })
}
