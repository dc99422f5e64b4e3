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

/// The enum of errors, with `From` and `Display` of each.
macro_rules! errors {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $variant:ident($error:ty),)+ }) => {
        $(#[$about])*
        #[derive(Debug)]
        #[non_exhaustive]
        pub enum $name {
            $($(#[$doc])* $variant($error),)+
        }

        $(impl From<$error> for $name {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })+

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $(Self::$variant(error) => error.fmt(f)),+
                }
            }
        }
    };
}

errors! {
    /// Anything that can go wrong between a design file and a tracked frame; each variant is the error of one module.
    Error {
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
}

impl std::error::Error for Error {}
