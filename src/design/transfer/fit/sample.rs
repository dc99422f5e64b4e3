//! What a fit is made from.

use glam::{DVec2, DVec3};

/// A mark that was printed and measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Where it stands on the plate, mm.
    pub plate_mm: DVec2,
    /// Where it landed: direction from the dome's centre, in the frame of the print pass; any length but zero.
    pub landed: DVec3,
    /// Which mark it is; equal for the same mark of several prints.
    pub mark: u32,
    /// Which print it belongs to, from 0.
    pub print: usize,
}

/// Where the errors of a measurement are even.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasuredIn {
    /// In the orthographic view from outside.
    View,
    /// In angles on the dome.
    Dome,
}
