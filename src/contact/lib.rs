//! An object against the dome: pressure, friction, displacement of the membrane, in four levels.
//!
//! | level | what it is | where it ends |
//! |---|---|---|
//! | [`Level::Geometric`] | what lies inside the object is pushed out of it; force of an elastic foundation | any shape; nothing outside the object moves |
//! | [`Level::ClosedForm`] | Hertz' ellipse, Sneddon's cone, Mindlin's friction, with the bonded base's correction | smooth faces and apices, contacts well inside the face and the dome |
//! | [`Level::Linear`] | linear elasticity of the whole dome bonded to the sheet, its loads turned with the surface that bears them, unilateral contact with Coulomb friction on the object's true surface; where that is finer than the elements, on its faces as they come down | small strain: without edges 5 % of the force at a quarter of the radius deep; walls of half an element and more |
//! | [`Level::FiniteStrain`] | the nearly incompressible neo-Hookean dome under the object's true surface, with friction: what the others are measured against | 0.4 of the radius deep; some seconds a pose |
//!
//! Every state says how far it may be off ([`ContactState::deviation`]).
//!
//! Everything is in the *sensor* frame: origin at the centre of the dome's base, +z through the pole; lengths mm,
//! forces N, moduli and pressures MPa. A contact wrench is what the object puts on the dome, about the base's
//! centre.
//!
//! ```
//! use domecast_contact::{Contact, ContactSolid, Elastomer, Indenter, Level};
//! use domecast_optics::numeric::Rigid;
//! use glam::DVec3;
//!
//! let dome = Elastomer { dome_radius_mm: 10.0, center_z_mm: 0.0, young_mpa: 0.56, poisson: 0.49, friction: 0.5 };
//! let contact = Contact::new(dome, Level::ClosedForm)?;
//! let ball = Indenter::rigid(ContactSolid::sphere(5.0)?);
//! // the ball's centre, half a millimetre lower than where it first touches the pole
//! let mut sensor_from_ball = Rigid::identity();
//! sensor_from_ball.translation_mm = DVec3::new(0.0, 0.0, 14.5);
//! let state = contact.solve(&ball, &sensor_from_ball, None)?;
//! assert!(state.wrench.force_n.z < 0.0, "it pushes down");
//! # Ok::<(), domecast_contact::ContactError>(())
//! ```

mod beside;
mod contact;
mod deviation;
mod elastomer;
mod equilibrium;
mod error;
mod estimate;
mod field;
mod finite_strain;
mod gel;
mod half_space;
mod level;
mod levels;
mod linear;
mod missed;
mod object;
mod on_pole;
mod outcome;
mod state;
mod traction;

pub use beside::Beside;
pub use contact::Contact;
pub use elastomer::{Elastomer, Indenter};
pub use equilibrium::{PressStatus, Pressed, PressedObject, PressedTogether, Push};
pub use error::ContactError;
pub use estimate::{Estimate, estimate, max_force_n};
pub use gel::{GelMemory, Relaxation, RelaxationTerm};
pub use level::Level;
pub use object::{ContactSolid, Distance};
pub use on_pole::OnPole;
pub use outcome::{Deviation, Extent, Status, TouchedNode};
pub use state::ContactState;

#[cfg(test)]
mod tests;
