//! What comes of drawing a frame, and the room that it takes.

use std::sync::Arc;

use crate::electronics::deviation::CodingDeviation;
use crate::electronics::exposure::Meter;
use crate::output::depth::DepthMaps;
use crate::output::truth::FrameTruth;
use crate::raster::frame::{Frame, Image8};
use crate::raster::picture::Painter;
use crate::work::Work;
use domecast_contact::ContactState;

/// Room that a thread draws in; what it holds before does not matter.
#[derive(Debug, Default)]
pub struct Scratch {
    pub(super) painter: Painter,
    pub(super) frame: Option<Frame>,
    pub(super) part: Option<Frame>,
    pub(super) bytes: Vec<u8>,
}

impl Scratch {
    /// Takes back a picture that is not needed any more: the next one is coded in its place.
    pub fn give_back(&mut self, image: Image8) {
        self.bytes = image.bytes;
    }
}

/// A frame with its truth and the work that it took.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The picture; `None` where the scene wants none.
    pub image: Option<Image8>,
    /// What is true of it.
    pub truth: FrameTruth,
    /// What touches the dome.
    pub contact: Option<Arc<ContactState>>,
    /// What each pixel sees, where the scene wants it.
    pub depth: Option<DepthMaps>,
    /// What the camera's lossy code made of the picture; `None` without one.
    pub coding: Option<CodingDeviation>,
    /// What it took.
    pub work: Work,
}

/// A frame as the light has drawn it, before gains and code.
#[derive(Debug, Clone)]
pub(super) struct Exposed {
    /// The picture in linear light; `None` where the scene wants none.
    pub frame: Option<Frame>,
    /// How bright it is, where gains follow it.
    pub meter: Option<Meter>,
    /// What is true of it so far.
    pub truth: FrameTruth,
    /// What touches the dome.
    pub contact: Option<Arc<ContactState>>,
    /// What each pixel sees, where the scene wants it.
    pub depth: Option<DepthMaps>,
    /// What it took so far.
    pub work: Work,
}
