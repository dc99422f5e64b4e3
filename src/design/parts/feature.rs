//! A shape with its meaning: what it is called, and which design field moves it.

use domecast_mesh::{Chord, Construction, Piece, Shape};

use super::PartError;

/// One piece of a part, with what a message about it has to say.
#[derive(Debug, Clone)]
pub(crate) struct Feature {
    /// The shape in its place; its name carries a number where there are
    /// several of a kind.
    pub piece: Piece,
    /// What kind of thing it is: "magnet pocket".
    pub kind: &'static str,
    /// The design field that decides it.
    pub field: &'static str,
}

impl Feature {
    pub(crate) fn new(kind: &'static str, field: &'static str, shape: Shape) -> Self {
        Self { piece: Piece::new(kind, shape), kind, field }
    }

    /// One of several of its kind.
    pub(crate) fn numbered(mut self, i: usize) -> Self {
        self.piece.name = format!("{} {i}", self.kind);
        self
    }

    pub(crate) fn at(mut self, x_mm: f64, y_mm: f64) -> Self {
        self.piece = self.piece.at(x_mm, y_mm);
        self
    }

    pub(crate) fn placed(mut self, part_from_shape: glam::DAffine3) -> Self {
        self.piece = self.piece.placed(part_from_shape);
        self
    }

    pub(crate) fn with_chord(mut self, chord: Chord) -> Self {
        self.piece = self.piece.with_chord(chord);
        self
    }
}

/// A part before it is meshed.
pub(crate) struct Blueprint {
    /// Name of the part and of its files.
    pub name: String,
    /// One line on what it is.
    pub summary: &'static str,
    /// Material.
    pub added: Vec<Feature>,
    /// What is taken away.
    pub cut: Vec<Feature>,
    /// Kinds of cuts that are meant to run into each other.
    pub may_meet: &'static [(&'static str, &'static str)],
    /// Number of holes through the part.
    pub genus: i64,
    /// Whether there may be more holes through the part than that, which the mesh then tells.
    pub genus_is_min: bool,
    /// Tolerance of ordinary faces.
    pub chord: Chord,
    /// Whether it is printed, so that the process limits hold for it.
    pub printed: bool,
}

impl Blueprint {
    pub(crate) fn new(name: impl Into<String>, summary: &'static str, chord: Chord) -> Self {
        Self {
            name: name.into(),
            summary,
            added: Vec::new(),
            cut: Vec::new(),
            may_meet: &[],
            genus: 0,
            genus_is_min: false,
            chord,
            printed: true,
        }
    }

    /// The exact shapes alone.
    pub(crate) fn construction(&self) -> Construction {
        let pieces = |features: &[Feature]| features.iter().map(|f| f.piece.clone()).collect();
        Construction { added: pieces(&self.added), cut: pieces(&self.cut) }
    }

    /// An error about a length that is below what it has to be.
    pub(crate) fn infeasible(
        &self,
        place: impl Into<String>,
        value_mm: f64,
        limit_mm: f64,
        field: impl Into<String>,
    ) -> PartError {
        PartError::Infeasible {
            part: self.name.clone(),
            place: place.into(),
            value_mm,
            limit_mm,
            field: field.into(),
        }
    }
}
