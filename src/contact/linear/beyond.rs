//! What an elastic object moves beyond its share of the dome's own displacement.
//!
//! About a contact both bodies are half-spaces, so there the object moves as the dome does, by the ratio of their moduli. The dome is
//! bonded to a sheet a radius away, the object is not: it is a half-space whichever dome it bears on (Hertz; K. L. Johnson, Contact
//! Mechanics, 1985, ch. 4). What the dome holds back ([`domecast_elastic::HeldBack`]) the object moves beyond its share, as a whole.

use std::collections::BTreeMap;

use glam::DMat3;

use crate::error::ContactError;
use domecast_elastic::{Compliance, HeldBack};

/// By ring, as far as it was asked for.
#[derive(Default)]
pub(super) struct Beyond(BTreeMap<usize, HeldBack>);

impl Beyond {
    /// At a node, for an object that yields `ratio` times what the dome does: sensor frame, mm/N.
    pub fn at(&mut self, compliance: &Compliance, ratio: f64, number: usize) -> Result<DMat3, ContactError> {
        if ratio == 0.0 {
            return Ok(DMat3::ZERO);
        }
        let grid = &compliance.grid;
        let node = grid.node(number);
        let held = match self.0.get(&node.ring) {
            Some(held) => *held,
            None => *self.0.entry(node.ring).or_insert(compliance.held(node.ring)?),
        };
        let at_mm = grid.dome.point_mm(grid.meridian_rad(node.ring), grid.azimuth(node));
        Ok(held.matrix(grid.dome.normal(at_mm)) * ratio)
    }
}
