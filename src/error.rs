//! One error for a program that does not care which part of domecast failed.

use std::fmt;

use crate::artwork::RenderError;
use crate::build::BuildError;
use crate::constants::ConstantsError;
use crate::contact::ContactError;
use crate::design::DesignError;
use crate::layout::LayoutError;
use crate::parts::PartError;
use crate::sim::SimError;
use crate::track::TrackError;

/// Anything that can go wrong between a design file and a tracked frame; each variant is the error of one module.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// A design file is at fault.
    Design(DesignError),
    /// The pattern of a design cannot be laid out.
    Layout(LayoutError),
    /// A film cannot be drawn.
    Render(RenderError),
    /// A part cannot be made.
    Part(PartError),
    /// A build failed.
    Build(BuildError),
    /// A constants file cannot be read.
    Constants(ConstantsError),
    /// The constants make no tracker.
    Track(TrackError),
    /// A scene cannot be simulated.
    Sim(SimError),
    /// A contact cannot be solved.
    Contact(ContactError),
    /// A file cannot be read or written.
    Io(std::io::Error),
}

macro_rules! from_each {
    ($($variant:ident($error:ty)),+ $(,)?) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })+

        impl fmt::Display for Error {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $(Self::$variant(error) => error.fmt(f)),+
                }
            }
        }
    };
}

from_each! {
    Design(DesignError),
    Layout(LayoutError),
    Render(RenderError),
    Part(PartError),
    Build(BuildError),
    Constants(ConstantsError),
    Track(TrackError),
    Sim(SimError),
    Contact(ContactError),
    Io(std::io::Error),
}

impl std::error::Error for Error {}
