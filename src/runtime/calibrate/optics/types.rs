//! What goes into the fit and what comes out of it.

use glam::DVec2;
use serde::Serialize;

use crate::constants::Constants;
use domecast_optics::numeric::Rigid;

/// The two kinds of marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A disc on the sheet.
    White,
    /// A dot on the dome.
    Black,
}

/// A centroid in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Number of the frame; the lowest is the one at rest.
    pub frame: usize,
    /// Kind of mark.
    pub kind: Kind,
    /// Number of the mark.
    pub id: usize,
    /// Centroid in the raw image, px.
    pub centroid_px: DVec2,
}

/// One fitted number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Name: `pupil.z`, `layers[1].index`, `white_markers[2].x`, ..
    pub name: String,
    /// Nominal value, in the unit of the name's field (mm, rad, 1).
    pub nominal: f64,
    /// Fitted value.
    pub value: f64,
    /// Standard deviation before (the tolerance).
    pub prior_sd: f64,
    /// Standard deviation after.
    pub sd: f64,
    /// Whether the frames said more of it than the tolerance does (less than nine tenths of it are left).
    pub observed: bool,
}

/// A fitted sensor.
#[derive(Debug, Clone)]
pub struct OpticsFit {
    /// The constants with measured numbers in place of nominal ones.
    pub constants: Constants,
    /// Every fitted number but the dots'.
    pub parameters: Vec<Parameter>,
    /// Root mean square of the residuals before and after, px.
    pub rms_px: [f64; 2],
    /// Steps taken.
    pub iterations: u32,
    /// Poses of the frames (`rest_from_platform`), by rising number.
    pub poses: Vec<(usize, Rigid)>,
    /// Observations that were counted less because they lie beyond three standard deviations.
    pub outliers: usize,
}

/// Why nothing can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub enum OpticsFitError {
    /// The constants describe no sensor.
    Constants(String),
    /// An observation names a mark that the constants do not have.
    UnknownMark {
        /// Kind of mark.
        kind: Kind,
        /// Its number.
        id: usize,
    },
    /// There are no observations, or none at rest.
    Empty,
    /// A frame shows fewer than four white markers, so that its pose is open.
    FewMarkers {
        /// The frame.
        frame: usize,
    },
    /// A mark is not seen by the nominal sensor near its centroid.
    NotVisible {
        /// Kind of mark.
        kind: Kind,
        /// Its number.
        id: usize,
    },
    /// The marks cannot be this sensor's: what they look like, in words.
    Suspect(String),
    /// The fit did not converge in the allowed steps.
    NotConverged {
        /// What was left, px.
        rms_px: f64,
    },
}

impl std::fmt::Display for OpticsFitError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let word = |kind: &Kind| if *kind == Kind::White { "white marker" } else { "black dot" };
        match self {
            Self::Constants(what) | Self::Suspect(what) => f.write_str(what),
            Self::UnknownMark { kind, id } => write!(f, "the constants have no {} {id}", word(kind)),
            Self::Empty => write!(f, "there are no observations"),
            Self::FewMarkers { frame } => {
                write!(f, "frame {frame} shows fewer than four white markers: its pose is open")
            }
            Self::NotVisible { kind, id } => {
                write!(f, "the nominal sensor cannot see {} {id} where it was found", word(kind))
            }
            Self::NotConverged { rms_px } => {
                write!(f, "the fit did not converge; {rms_px:.3} px rms are left")
            }
        }
    }
}

impl std::error::Error for OpticsFitError {}
