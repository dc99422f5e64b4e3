//! The frames of a scene one after the other, in memory: as its file says, or with its objects where a caller puts them.

use crate::contact::between::Around;
use crate::contact::stepper::{Stepper, Touch};
use crate::electronics::pass::Gains;
use crate::error::SimError;
use crate::output::drawn::{Drawn, Scratch};
use crate::output::render::Renderer;
use crate::work::Work;
use domecast_optics::numeric::Rigid;

/// Draws the frames in their order, each as [`crate::output::run`] writes it, until `see` wants no more of them.
///
/// # Errors
/// As [`Renderer::frame`].
pub fn each_frame(
    renderer: &Renderer<'_>,
    see: &mut dyn FnMut(Drawn, &mut Scratch) -> bool,
) -> Result<(), SimError> {
    let scene = renderer.scene;
    let metering = &renderer.pipeline().metering;
    let mut gains = if metering.is_used() { metering.first() } else { Gains::default() };
    let (mut stepper, mut work, mut scratch) = (renderer.stepper()?, Work::default(), Scratch::default());
    // the touched dome, from the frame before the next one on
    let mut touches: Vec<Touch> = Vec::new();
    for number in 0..scene.frame_count() {
        let first = number.saturating_sub(1);
        if let Some(stepper) = &mut stepper {
            touches.drain(..touches.len().min(usize::from(number > 1)));
            for next in first + touches.len() as u32..scene.frame_count().min(number.saturating_add(2)) {
                touches.push(stepper.next(next, scene.time_s(next), &mut work)?);
            }
        }
        let around = Around::of(&touches, (number - first) as usize);
        let exposed = renderer.expose(number, around.as_ref(), &mut scratch)?;
        let next = exposed.meter.as_ref().map_or(gains, |meter| metering.next(gains, meter));
        let drawn = renderer.develop(exposed, &gains, &mut scratch);
        gains = next;
        if !see(drawn, &mut scratch) {
            break;
        }
    }
    Ok(())
}

/// Draws the sensor with the scene's objects where its caller puts them, step by step: friction remembers the way, and each
/// step is a frame at one instant.
pub struct LiveScene<'a> {
    renderer: &'a Renderer<'a>,
    stepper: Option<Stepper<'a>>,
    scratch: Scratch,
    gains: Gains,
    number: u32,
}

impl<'a> LiveScene<'a> {
    /// Before the first step.
    ///
    /// # Errors
    /// As [`Renderer::stepper`].
    pub fn new(renderer: &'a Renderer<'a>) -> Result<Self, SimError> {
        let mut live =
            Self { renderer, stepper: None, scratch: Scratch::default(), gains: Gains::default(), number: 0 };
        live.restart()?;
        Ok(live)
    }

    /// Forgets what touched the dome; the next frame is number 0.
    ///
    /// # Errors
    /// As [`Renderer::stepper`].
    pub fn restart(&mut self) -> Result<(), SimError> {
        let metering = &self.renderer.pipeline().metering;
        self.gains = if metering.is_used() { metering.first() } else { Gains::default() };
        self.stepper = self.renderer.stepper()?;
        self.number = 0;
        Ok(())
    }

    /// Puts the objects at these poses, `rest_from_object`, `None` for one that is away, and draws the frame.
    ///
    /// # Errors
    /// As [`Renderer::frame`]; then the objects are where they were, and another step may follow.
    pub fn step(&mut self, poses: &[Option<Rigid>]) -> Result<Drawn, SimError> {
        let number = self.number;
        let mut touches: Vec<Touch> = Vec::new();
        if let Some(stepper) = &mut self.stepper {
            stepper.place(poses);
            touches.push(stepper.next(number, self.renderer.scene.time_s(number), &mut Work::default())?);
        }
        let around = Around::of(&touches, 0);
        let exposed = self.renderer.expose(number, around.as_ref(), &mut self.scratch)?;
        let metering = &self.renderer.pipeline().metering;
        let next = exposed.meter.as_ref().map_or(self.gains, |meter| metering.next(self.gains, meter));
        let drawn = self.renderer.develop(exposed, &self.gains, &mut self.scratch);
        self.gains = next;
        self.number = number.saturating_add(1);
        Ok(drawn)
    }
}
