//! From a scene and its plan to frames and their truth.

use std::ops::Range;
use std::sync::Mutex;

use crate::SimError;
use crate::contact::between::Around;
use crate::contact::level::map_step_mm;
use crate::contact::shape::{Shapes, SkinShape};
use crate::contact::stepper::Stepper;
use crate::effect_name::EffectName;
use crate::effects;
use crate::effects::pipeline::Pipeline;
use crate::electronics::exposure::{METER_UNITS, Meter};
use crate::electronics::pass::{Gains, PassContext, Stage};
use crate::output::drawn::{Drawn, Exposed, Scratch};
use crate::output::timing::{exposure_s, rows_s};
use crate::output::truth::{EffectTruth, FrameTruth, Seen, dot_truth, effects_of, marker_truth};
use crate::plan::Plan;
use crate::raster::edges::EDGE_GREY;
use crate::raster::frame::Frame;
use crate::raster::lens_field::LensField;
use crate::raster::picture::Parts;
use crate::raster::projector::Projector;
use crate::raster::rolled::{Rolled, Slice};
use crate::raster::sensor_state::{SensorState, count_points, units};
use crate::raster::settings::Timing;
use crate::raster::spots::{Points, Spots};
use crate::scene::Scene;
use crate::work::Work;
use domecast_optics::numeric::Rigid;

/// Draws the frames of a scene with the effects of a plan.
pub struct Renderer<'a> {
    pub(super) scene: &'a Scene,
    pub(super) pipeline: Pipeline,
    pub(super) eye: Projector,
    points: Points,
    field: Option<LensField>,
    effects: Vec<EffectTruth>,
    /// The most that any image moves from a frame's time to the first or last light that it gathers, px.
    moved_px: f64,
    setup: Work,
    /// Gains of the first frames, as far as they are known; the others follow them.
    pub(super) gains: Mutex<Vec<Gains>>,
}

impl<'a> Renderer<'a> {
    /// Puts the plan's effects together; tables are made here.
    ///
    /// # Errors
    /// What an effect of the plan cannot be computed for.
    pub fn new(scene: &'a Scene, plan: &Plan) -> Result<Self, SimError> {
        let mut setup = Work::default();
        let pipeline = plan.pipeline(scene, &mut setup)?;
        let eye = Projector::new(scene, pipeline.geometry)?;
        let contrast = (255.0 * scene.file().light.membrane_level).max(1.0);
        let points =
            Points::new(scene, (pipeline.geometry, pipeline.ink), &eye, EDGE_GREY / contrast, &mut setup);
        let (width, height) = scene.image_size();
        let at_rest = eye.at(&Rigid::identity())?;
        let lens = at_rest.optics(eye.reference()).filter(|_| scene.draws()).map(|optics| optics.lens());
        let field = lens.map(|lens| LensField::new(lens, (width, height), pipeline.shading.is_some()));
        let timing = &pipeline.timing;
        let gathered_s =
            timing.exposure.map_or(0.0, |e| e.exposure_s) + timing.rolling.map_or(0.0, |r| r.readout_s);
        let moved_px = 0.5 * gathered_s * effects::speed::fastest_px_per_s(scene).unwrap_or(0.0);
        Ok(Self {
            scene,
            pipeline,
            eye,
            points,
            field,
            effects: effects_of(plan),
            moved_px,
            setup,
            gains: Mutex::default(),
        })
    }

    /// What putting the effects together took.
    pub fn setup(&self) -> &Work {
        &self.setup
    }

    /// The parts that the effects have installed.
    pub fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    /// The points that are followed.
    #[cfg(test)]
    pub(crate) fn points(&self) -> &Points {
        &self.points
    }

    /// Solves the contact of the frames in their order, where contact takes part.
    ///
    /// # Errors
    /// An elastomer that the level cannot work with.
    pub fn stepper(&self) -> Result<Option<Stepper<'a>>, SimError> {
        let Some(level) = self.pipeline.contact else { return Ok(None) };
        Ok(Some(match &self.pipeline.slow_gel {
            Some(gel) => Stepper::slow(self.scene, level, gel)?,
            None => Stepper::new(self.scene, level)?,
        }))
    }

    /// The sensor at a frame's time; `around` is the touched dome about the frame.
    ///
    /// # Errors
    /// A load without balance.
    pub fn instant(
        &self,
        frame: u32,
        around: Option<&Around>,
        work: &mut Work,
    ) -> Result<SensorState, SimError> {
        // Where light is gathered over a time, that very instant is not drawn.
        let step_mm = self.map_step_mm().filter(|_| self.is_at_once());
        let touch = around.map(|around| around.at(0.0));
        let shape = SkinShape::of(touch, *self.scene.optics().dome(), step_mm, work);
        self.instant_of(frame, self.scene.time_s(frame), shape, work)
    }

    /// Distance of the displacement map's nodes; `None` where no light falls on them.
    fn map_step_mm(&self) -> Option<f64> {
        let shaded = self.pipeline.shading.is_some() && self.field.is_some();
        shaded.then(|| map_step_mm(self.pipeline.contact))
    }

    fn instant_of(
        &self,
        frame: u32,
        time_s: f64,
        shape: SkinShape,
        work: &mut Work,
    ) -> Result<SensorState, SimError> {
        let state = match &shape.touch {
            Some(touch) => touch.state(self.scene.reference_mm()),
            None => self.scene.state_at(frame, time_s)?,
        };
        SensorState::new(&self.eye, self.pipeline.geometry, time_s, state, shape, work)
    }

    /// Only the centres of dots, then markers, in the reference channel: the fastest answer there is.
    ///
    /// # Errors
    /// As [`Renderer::instant`].
    pub fn centers(&self, frame: u32, around: Option<&Around>) -> Result<Vec<Option<glam::DVec2>>, SimError> {
        let mut work = Work::default();
        let instant = self.instant(frame, around, &mut work)?;
        Ok(self.points.centers(&instant, self.eye.reference()))
    }

    /// Draws a frame and tells its truth. Where contact takes part, the frames up to it are solved first: for
    /// whole sequences [`crate::output::run`] keeps what it has solved.
    ///
    /// # Errors
    /// A frame whose load has no balance, or whose pose cannot be.
    pub fn frame(&self, number: u32) -> Result<Drawn, SimError> {
        let mut drawn = None;
        self.each_around(number, &mut |k, around| {
            if k == number {
                drawn = Some(self.frame_around(k, around, &mut Scratch::default())?);
            }
            Ok(())
        })?;
        // Each number up to the last one is seen.
        drawn.map_or_else(|| self.frame_around(number, None, &mut Scratch::default()), Ok)
    }

    /// [`Renderer::frame`] with the touched dome about it, in room that is there.
    ///
    /// # Errors
    /// As [`Renderer::frame`].
    pub fn frame_around(
        &self,
        number: u32,
        around: Option<&Around>,
        scratch: &mut Scratch,
    ) -> Result<Drawn, SimError> {
        let exposed = self.expose(number, around, scratch)?;
        Ok(self.develop(exposed, &self.gains(number)?, scratch))
    }

    /// Draws a frame as light falls on the sensor, before gains, noise and code.
    ///
    /// # Errors
    /// As [`Renderer::frame`].
    pub(super) fn expose(
        &self,
        number: u32,
        around: Option<&Around>,
        scratch: &mut Scratch,
    ) -> Result<Exposed, SimError> {
        let mut work = Work::default();
        let now = self.instant(number, around, &mut work)?;
        self.count(&mut work);
        let spots = self.points.see(self.scene, &now);
        let (frame, parts) = match &self.field {
            Some(field) => {
                let (frame, parts) =
                    self.picture(field, number, (&now, &spots), around, scratch, &mut work)?;
                (Some(frame), parts)
            }
            None => (None, Vec::new()),
        };
        let metering = &self.pipeline.metering;
        let meter = frame.as_ref().filter(|_| metering.is_used()).map(|frame| {
            let owner = match metering.exposure {
                Some(_) => EffectName::AutoExposure,
                None => EffectName::WhiteBalance,
            };
            let values = frame.width() * frame.height() * frame.planes.len();
            work.add(owner, values as u64 * METER_UNITS);
            Meter::of(frame)
        });
        let mut truth = self.truth(number, &now, &spots, &parts, around);
        if let Some(contact) = truth.contact.as_mut() {
            contact.rays_beside = Some(work.rays()).filter(|rays| rays.beside > 0);
        }
        let contact = around.and_then(|around| around.now.contact.clone());
        let depth = self.depth(&now, around);
        Ok(Exposed { frame, meter, truth, contact, depth, work })
    }

    fn count(&self, work: &mut Work) {
        let central = self.scene.optics().lens().is_central();
        count_points(self.pipeline.geometry, self.eye.channels(), central, Points::count(self.scene), work);
    }

    /// Whether all light is gathered at the frame's time.
    fn is_at_once(&self) -> bool {
        self.pipeline.timing == Timing::default()
    }

    /// The picture in linear light, and what was seen in each part of the exposure; empty where all is at the frame's time.
    fn picture(
        &self,
        field: &LensField,
        number: u32,
        (now, now_spots): (&SensorState, &Spots),
        around: Option<&Around>,
        scratch: &mut Scratch,
        work: &mut Work,
    ) -> Result<(Frame, Vec<Spots>), SimError> {
        let scene = self.scene;
        let parts = Parts {
            scene,
            dots: self.pipeline.ink.dots,
            shading: self.pipeline.shading.as_deref(),
            tolerance: self.pipeline.fill_tolerance,
            points: &self.points,
            field,
            gloss: self.pipeline.gloss.as_ref(),
            dust: self.pipeline.dust.as_ref(),
        };
        let (width, height) = scene.image_size();
        let planes = scene.planes();
        let fits = |frame: &Frame| {
            frame.width() == width && frame.height() == height && frame.planes.len() == planes
        };
        let mut frame =
            scratch.frame.take().filter(fits).unwrap_or_else(|| Frame::new(width, height, planes));
        let context = PassContext { frame: number, seed: scene.file().seed, ..PassContext::default() };
        let (exposure_s, rows_s) = (exposure_s(&self.pipeline), rows_s(&self.pipeline, height));
        let mut parts_seen = Vec::new();
        if self.is_at_once() {
            let slice = Slice { first: 0, end: height, instant: now };
            scratch.painter.draw(parts, &[slice], now_spots, &mut frame, work);
            self.run_passes(&mut frame, &context, work, |stage| stage <= Stage::Focus);
        } else {
            let mut extra = Work::default();
            let dome = *scene.optics().dome();
            let shapes = around.and_then(|around| {
                Shapes::new(around, &self.points.on_dome_mm(), dome, self.map_step_mm(), &mut extra)
            });
            work.add_all(self.owner_of_time(), &extra);
            let mut part =
                scratch.part.take().filter(fits).unwrap_or_else(|| Frame::new(width, height, planes));
            frame.planes.iter_mut().for_each(|plane| plane.fill(0.0));
            for (sample, after_s) in exposure_s.iter().enumerate() {
                let mut extra = Work::default();
                let spent = if sample == 0 { &mut *work } else { &mut extra };
                let times_s = (now.time_s, *after_s);
                let shapes = (around, shapes.as_ref());
                let instants = self.states_of_rows(number, times_s, &rows_s, shapes, spent)?;
                let slice = |((rows, _), instant): (&(Range<usize>, f64), _)| Slice {
                    first: rows.start,
                    end: rows.end,
                    instant,
                };
                let slices: Vec<Slice<'_>> = rows_s.iter().zip(&instants).map(slice).collect();
                let spots = self.spots_of(&slices, now_spots, spent);
                scratch.painter.draw(parts, &slices, &spots, &mut part, spent);
                self.run_passes(&mut part, &context, spent, |stage| stage <= Stage::Focus);
                // What the first picture does not do, the exposure does.
                work.add_all(EffectName::MotionBlur, &extra);
                add(&mut frame, &part, 1.0 / exposure_s.len() as f32);
                parts_seen.push(spots);
            }
            scratch.part = Some(part);
        }
        Ok((frame, parts_seen))
    }

    /// What is seen in one part of the exposure.
    fn spots_of(&self, slices: &[Slice<'_>], now: &Spots, work: &mut Work) -> Spots {
        if let [only] = slices {
            self.count(work);
            return self.points.see(self.scene, only.instant);
        }
        let (spots, pixels) = Rolled::new(&self.points, slices).see(self.scene, now, self.moved_px);
        work.add(EffectName::RollingShutter, pixels * (units::STRAIGHT + units::BEND));
        spots
    }

    /// The sensor at the middle of each slice of rows, for one part of the exposure: at a time, s, and so long after it.
    fn states_of_rows(
        &self,
        number: u32,
        (now_s, after_s): (f64, f64),
        rows_s: &[(Range<usize>, f64)],
        (around, shapes): (Option<&Around>, Option<&Shapes<'_>>),
        work: &mut Work,
    ) -> Result<Vec<SensorState>, SimError> {
        let mut states = Vec::with_capacity(rows_s.len());
        for (slice, (_, row_s)) in rows_s.iter().enumerate() {
            let mut one = Work::default();
            let frames = (after_s + row_s) * self.scene.file().frames.rate_hz;
            let free = || SkinShape { touch: around.map(|around| around.at(frames)), ..SkinShape::default() };
            let shape = shapes.map_or_else(free, |shapes| shapes.at(frames));
            states.push(self.instant_of(number, now_s + after_s + row_s, shape, &mut one)?);
            match slice {
                0 => work.merge(&one),
                _ => work.add_all(EffectName::RollingShutter, &one),
            }
        }
        Ok(states)
    }

    pub(super) fn run_passes(
        &self,
        frame: &mut Frame,
        context: &PassContext,
        work: &mut Work,
        when: impl Fn(Stage) -> bool,
    ) {
        for pass in self.pipeline.passes.iter().filter(|pass| when(pass.stage())) {
            pass.run(frame, context, work);
        }
    }

    /// The effect for which the dome is known at several times.
    fn owner_of_time(&self) -> EffectName {
        match self.pipeline.timing.rolling {
            Some(_) => EffectName::RollingShutter,
            None => EffectName::MotionBlur,
        }
    }

    fn truth(
        &self,
        number: u32,
        now: &SensorState,
        spots: &Spots,
        parts: &[Spots],
        around: Option<&Around>,
    ) -> FrameTruth {
        let scene = self.scene;
        let seen = Seen { now: spots, parts, reference: self.eye.reference() };
        let held = now.state.held.as_ref();
        FrameTruth {
            frame: number,
            time_s: now.time_s,
            status: held.map_or_else(|| "ok".into(), |held| held.limit.into()),
            note: held.map(|held| held.note()),
            pose: now.state.pose.to_rows_4x4(),
            wrench: now.state.wrench.to_array(),
            contact: around.map(|around| around.now.solved.clone()),
            black_dots: (0..scene.dots().len()).map(|index| dot_truth(scene, index, &seen)).collect(),
            white_markers: (0..scene.markers().len())
                .map(|index| marker_truth(scene, index, &seen))
                .collect(),
            effects: self.effects.clone(),
            exposure: None,
            depth: None,
        }
    }
}

fn add(sum: &mut Frame, part: &Frame, weight: f32) {
    for (sum, part) in sum.planes.iter_mut().zip(&part.planes) {
        for (sum, value) in sum.iter_mut().zip(part) {
            *sum += weight * value;
        }
    }
}
