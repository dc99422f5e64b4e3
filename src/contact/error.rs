//! What can be wrong with a contact problem before it is solved.

use std::fmt;

use domecast_elastic::FactorError;
use domecast_springs::MechanicsError;

/// Why there is no contact state.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactError {
    /// A size or constant has no meaning.
    Dimension {
        /// Which one, as a path: `sphere.radius_mm`, `elastomer.poisson`.
        field: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A pose or load is NaN or infinite, or a pose is no rigid motion.
    BadPose(String),
    /// The mesh has no triangle.
    EmptyMesh,
    /// Edges of the mesh that belong to one triangle only: it is open.
    OpenMesh {
        /// How many.
        edges: usize,
    },
    /// Edges with more than two triangles or of opposite winding, or points where the surface touches itself.
    NotManifold {
        /// What was found.
        problem: String,
    },
    /// The mesh is wound inwards: its volume is not positive.
    InsideOut {
        /// The volume, mm3.
        volume_mm3: f64,
    },
    /// The object reaches below the dome's base plane, into the sheet.
    InsideSheet {
        /// How far, mm.
        depth_mm: f64,
    },
    /// The object is pressed deeper than the level's model says anything about.
    TooDeep {
        /// How far the undeformed dome reaches into the object, mm.
        depth_mm: f64,
        /// How far it may, mm.
        limit_mm: f64,
    },
    /// The force is not reached before the object meets the sheet or lies deeper than the level's model goes.
    ForceTooLarge {
        /// The force that was asked for, N.
        force_n: f64,
        /// The most that was found, N.
        reached_n: f64,
    },
    /// The object is so thin that it passes between the places where the level's surface can be touched.
    Unseen {
        /// How far it reaches into the undeformed dome, mm.
        depth_mm: f64,
        /// Distance of the level's nodes, mm.
        spacing_mm: f64,
    },
    /// Another contact is so near that a level which takes contacts one by one would be wrong about this one.
    TooNear {
        /// What the others move the dome under the object, less their mean shift, mm.
        moved_mm: f64,
        /// How deep the object lies in the dome, mm.
        depth_mm: f64,
    },
    /// Two objects lie in each other.
    ObjectsMeet {
        /// Their numbers.
        objects: [usize; 2],
        /// How deep at least, mm.
        depth_mm: f64,
    },
    /// One of several objects, by its number, is at fault.
    OfObject {
        /// Its number.
        object: usize,
        /// What is wrong.
        error: Box<Self>,
    },
    /// A level that a slow gel cannot be computed with.
    NoSlowGel {
        /// The level's name.
        level: &'static str,
    },
    /// A level that knows hemispheres only, and a dome of another shape.
    HemisphereOnly {
        /// The level's name.
        level: &'static str,
        /// What the dome is.
        kind: &'static str,
    },
    /// Newton's method ended on the way, though its steps were halved.
    NotConverged {
        /// How far the undeformed dome reaches into the object at its pose, mm.
        depth_mm: f64,
        /// The part of the way that was solved.
        reached: f64,
    },
    /// The springs have no force at the pose that was asked for.
    Springs(MechanicsError),
    /// The stiffness matrix has no factors: the elastomer's constants make it singular.
    Factorisation(FactorError),
    /// More nodes than the level's memory allows.
    TooFine {
        /// The element size that was asked for, mm.
        element_mm: f64,
        /// The smallest allowed, mm.
        min_mm: f64,
    },
}

impl fmt::Display for ContactError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dimension { field, value, allowed } => write!(f, "{field} is {value}, must be {allowed}"),
            Self::BadPose(why) => write!(f, "the pose is unusable: {why}"),
            Self::EmptyMesh => write!(f, "the mesh has no triangle"),
            Self::OpenMesh { edges } => {
                write!(f, "the mesh is open: {edges} edges belong to one triangle only")
            }
            Self::NotManifold { problem } => write!(f, "the mesh bounds no solid: {problem}"),
            Self::InsideOut { volume_mm3 } => {
                write!(f, "the mesh is inside out: its volume is {volume_mm3} mm3")
            }
            Self::InsideSheet { depth_mm } => {
                write!(f, "the object reaches {depth_mm:.3} mm below the dome's base, into the sheet")
            }
            Self::TooDeep { depth_mm, limit_mm } => {
                write!(
                    f,
                    "the object lies {depth_mm:.3} mm inside the dome, at most {limit_mm:.3} is modelled"
                )
            }
            Self::ForceTooLarge { force_n, reached_n } => write!(
                f,
                "{force_n:.3} N are not reached before the object meets the sheet or the end of the model, at most \
                 {reached_n:.3} N"
            ),
            Self::Unseen { depth_mm, spacing_mm } => write!(
                f,
                "the object reaches {depth_mm:.3} mm into the dome between the surface's nodes, which are {spacing_mm:.3} mm apart"
            ),
            Self::TooNear { moved_mm, depth_mm } => write!(
                f,
                "the other contacts move the dome under the object unevenly, by {moved_mm:.4} mm where it lies {depth_mm:.4} mm \
                 deep, and the level takes contacts one by one"
            ),
            Self::ObjectsMeet { objects: [a, b], depth_mm } => {
                write!(f, "objects {a} and {b} lie at least {depth_mm:.4} mm in each other")
            }
            Self::OfObject { object, error } => write!(f, "object {object}: {error}"),
            Self::NoSlowGel { level } => {
                write!(f, "a slow gel is computed by the linear level only, not by the {level} one")
            }
            Self::HemisphereOnly { level, kind } => {
                write!(
                    f,
                    "the dome is {kind}, and the {level} level computes hemispheres only: take the linear one"
                )
            }
            Self::NotConverged { depth_mm, reached } => write!(
                f,
                "the contact {depth_mm:.3} mm deep does not converge: {:.1} % of the way to it was solved",
                100.0 * reached
            ),
            Self::Springs(error) => write!(f, "{error}"),
            Self::Factorisation(why) => write!(f, "{why}"),
            Self::TooFine { element_mm, min_mm } => {
                write!(f, "elements of {element_mm} mm are too many, at least {min_mm:.3} mm is allowed")
            }
        }
    }
}

impl std::error::Error for ContactError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Springs(error) => Some(error),
            _ => None,
        }
    }
}

impl From<MechanicsError> for ContactError {
    fn from(error: MechanicsError) -> Self {
        Self::Springs(error)
    }
}

/// A finite number above zero, at most 1e6.
pub(crate) fn positive(field: &'static str, value: f64) -> Result<f64, ContactError> {
    if value > 0.0 && value <= 1e6 {
        Ok(value)
    } else {
        Err(ContactError::Dimension { field, value, allowed: "more than 0, at most 1e6" })
    }
}

impl From<FactorError> for ContactError {
    fn from(error: FactorError) -> Self {
        Self::Factorisation(error)
    }
}
