//! A pattern in the image, before anything is known of lens and dome.
//!
//! Points are offsets from the pattern's centre, px of the frame in which the pattern is even.
//!
//! # Example
//! ```
//! use domecast_design::layout::boundary::Boundary;
//! use domecast_design::layout::pattern::Pattern;
//! use domecast_design::sections::{CentredOn, PatternKind};
//!
//! let pattern = Pattern {
//!     kind: PatternKind::Hexagonal,
//!     pitch_px: 10.0,
//!     centred_on: CentredOn::Dot,
//!     rotation_rad: 0.0,
//!     wanted: None,
//! };
//! let places = pattern.places(&Boundary::new(|_| 11.0)).map_err(|_| "no dot fits")?;
//! assert_eq!(places.len(), 7);
//! # Ok::<(), &str>(())
//! ```

use std::f64::consts::PI;

use glam::DVec2;

use crate::spec::sections::{CentredOn, PatternKind};

/// A pattern without its edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pattern {
    /// Lattice, rings or fill.
    pub kind: PatternKind,
    /// Distance of neighbours, px.
    pub pitch_px: f64,
    /// What lies at the centre.
    pub centred_on: CentredOn,
    /// Turn of the pattern from image x towards image y, rad.
    pub rotation_rad: f64,
    /// The number of dots that is wanted, if the pitch was solved for one. A fill and rings give up surplus
    /// dots to meet it; a lattice is what its pitch makes it.
    pub wanted: Option<usize>,
}

/// A pattern that cannot be laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PatternError {
    /// The pitch leads to more places than can be laid out.
    TooMany {
        /// Places that the pitch leads to, roughly.
        about: f64,
        /// The bound.
        max: usize,
    },
    /// No dot fits between the centre and the edge.
    Empty,
}

impl Pattern {
    /// The two steps of the lattice (unit pitch) and the lattice coordinates of the centre.
    pub(super) fn cell(&self) -> (DVec2, DVec2, DVec2) {
        let along = DVec2::from_angle(self.rotation_rad);
        let square = matches!(self.kind, PatternKind::Square);
        let up = DVec2::from_angle(self.rotation_rad + if square { PI / 2.0 } else { PI / 3.0 });
        // A gap is the middle of a square cell, or half-way between two dots of a hexagonal lattice: about the middle
        // of a triangle the lattice is not the same upside down, and its first row would not match its last. A fill
        // starts from triangles, it is relaxed anyway.
        let centre = match self.centred_on {
            CentredOn::Dot => DVec2::ZERO,
            CentredOn::Gap if square => DVec2::splat(0.5),
            CentredOn::Gap if matches!(self.kind, PatternKind::Hexagonal) => DVec2::new(0.5, 0.0),
            CentredOn::Gap => DVec2::splat(1.0 / 3.0),
        };
        (along, up, centre)
    }

    /// Lattice places within `radius` pitches of the centre, unit pitch.
    pub(super) fn unit_lattice(&self, radius: f64) -> Vec<DVec2> {
        let (along, up, centre) = self.cell();
        // Rows are at least sin 60 deg apart; a row's places then reach as far as the circle does.
        let rows = (radius / (PI / 3.0).sin()).ceil() as i64 + 1;
        let mut places = Vec::new();
        for j in -rows..=rows {
            let row = up * (j as f64 - centre.y);
            let middle = -row.dot(along) + centre.x;
            let half = (radius * radius - row.perp_dot(along).powi(2)).max(0.0).sqrt();
            for i in (middle - half).floor() as i64..=(middle + half).ceil() as i64 {
                places.push(row + along * (i as f64 - centre.x));
            }
        }
        places
    }
}
