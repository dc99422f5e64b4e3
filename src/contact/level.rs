//! How closely a contact is modelled.

use crate::elastomer::Elastomer;
use crate::error::{ContactError, positive};

/// How closely a contact is modelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Level {
    /// The surface is pushed out of the object.
    Geometric,
    /// Hertz and kin.
    ClosedForm,
    /// Neo-Hookean finite elements of second order at large strain, laid out about where the object touches.
    FiniteStrain {
        /// Elements across the fine patch, 4 to 16.
        across: usize,
    },
    /// Linear finite elements.
    Linear {
        /// Length of an element on the dome's surface, mm.
        element_mm: f64,
    },
}

impl Level {
    /// The linear level at the element size that resolves a fingertip contact in some ten milliseconds: R/20. At R/10 a
    /// balance takes one.
    pub fn default_linear(elastomer: &Elastomer) -> Self {
        Self::Linear { element_mm: 0.05 * elastomer.dome_radius_mm }
    }

    /// Its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Geometric => "geometric",
            Self::ClosedForm => "closed_form",
            Self::Linear { .. } => "linear",
            Self::FiniteStrain { .. } => "finite_strain",
        }
    }
}

/// Elements along the meridian for a length: 4 times a power of two, no element longer than asked for.
pub(crate) fn elements_of(elastomer: &Elastomer, element_mm: f64) -> Result<usize, ContactError> {
    let element_mm = positive("level.element_mm", element_mm)?;
    let arc_mm = elastomer.dome().meridian_end_rad() * elastomer.dome_radius_mm;
    let mut elements = 8;
    // A millionth of slack for lengths that were computed from a count.
    while arc_mm / elements as f64 > element_mm * (1.0 + 1e-6) {
        elements *= 2;
        if elements > MAX_ELEMENTS {
            let min_mm = arc_mm / MAX_ELEMENTS as f64;
            return Err(ContactError::TooFine { element_mm, min_mm });
        }
    }
    Ok(elements)
}

/// Elements along the meridian that memory allows: the tables grow with their cube.
pub(crate) const MAX_ELEMENTS: usize = 64;

/// Deepest push-out that is modelled, as a part of [`Elastomer::depth_scale_mm`]: beyond, an object would near the sheet.
pub(crate) const DEEPEST: f64 = 0.8;
