//! From a scene and its plan to frames and their truth.

use std::ops::Range;
use std::sync::Arc;

use super::SimError;
use super::effect::EffectName;
use super::effects;
use super::eye::Eye;
use super::field::LensField;
use super::frame::{Frame, Image8};
use super::instant::{Instant, count_points, dent_step_mm};
use super::picture::{Painter, Parts};
use super::pipeline::{PassContext, Pipeline, Stage};
use super::plan::Plan;
use super::scene::Scene;
use super::spots::{Points, Spots};
use super::touch::{Between, Stepper, Touch};
use super::truth::{EffectTruth, FrameTruth, Seen, dot_truth, effects_of, marker_truth};
use super::work::Work;
use crate::mechanics::contact::ContactState;
use crate::numeric::Rigid;

/// How far the drawn outlines of dots may be from the exact ones, grey levels at the edge.
const OUTLINE_GREY: f64 = 0.5;

/// Draws the frames of a scene with the effects of a plan.
pub struct Renderer<'a> {
    scene: &'a Scene,
    pipeline: Pipeline,
    eye: Eye,
    points: Points,
    field: Option<LensField>,
    effects: Vec<EffectTruth>,
    /// The most that any image moves from a frame's time to the first or last light that it gathers, px.
    moved_px: f64,
    setup: Work,
}

/// Room that a thread draws in; what it holds before does not matter.
#[derive(Debug, Default)]
pub struct Scratch {
    painter: Painter,
    frame: Option<Frame>,
    part: Option<Frame>,
    bytes: Vec<u8>,
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
    /// What it took.
    pub work: Work,
}

/// The touched dome in a frame, and in the ones before and after it.
#[derive(Debug, Clone)]
pub struct Around {
    /// The frame before, or the frame itself where it is the first.
    pub before: Touch,
    /// The frame.
    pub now: Touch,
    /// The frame after, or the frame itself where it is the last.
    pub after: Touch,
}

/// By band of rows, what was seen at each of its times.
type SeenInBands = Vec<(Range<usize>, Vec<Spots>)>;

/// Rows that are drawn at one set of times.
struct Band {
    rows: Range<usize>,
    times_s: Vec<f64>,
}

impl<'a> Renderer<'a> {
    /// Puts the plan's effects together; tables are made here.
    ///
    /// # Errors
    /// What an effect of the plan cannot be computed for.
    pub fn new(scene: &'a Scene, plan: &Plan) -> Result<Self, SimError> {
        let mut setup = Work::default();
        let pipeline = plan.pipeline(scene, &mut setup)?;
        let eye = Eye::new(scene, pipeline.geometry)?;
        let contrast = (255.0 * scene.file().light.membrane_level).max(1.0);
        let points = Points::new(scene, &pipeline, &eye, OUTLINE_GREY / contrast, &mut setup);
        let (width, height) = scene.image_size();
        let at_rest = eye.at(&Rigid::identity())?;
        let lens = at_rest.optics(eye.reference()).filter(|_| scene.draws()).map(|optics| optics.lens());
        let field = lens.map(|lens| LensField::new(lens, width, height));
        let timing = &pipeline.timing;
        let gathered_s =
            timing.exposure.map_or(0.0, |e| e.exposure_s) + timing.rolling.map_or(0.0, |r| r.readout_s);
        // A dome that is touched or let go moves at once.
        let sudden = if scene.objects().is_empty() { 0.0 } else { 0.25 * height as f64 };
        let moved_px = sudden + 0.5 * gathered_s * effects::speed::fastest_px_per_s(scene).unwrap_or(0.0);
        Ok(Self { scene, pipeline, eye, points, field, effects: effects_of(plan), moved_px, setup })
    }

    /// What putting the effects together took.
    pub fn setup(&self) -> &Work {
        &self.setup
    }

    /// The parts that the effects have installed.
    pub fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    /// Solves the contact of the frames in their order, where contact takes part.
    ///
    /// # Errors
    /// An elastomer that the level cannot work with.
    pub fn stepper(&self) -> Result<Option<Stepper<'a>>, SimError> {
        self.pipeline.contact.map(|level| Stepper::new(self.scene, level)).transpose()
    }

    /// The sensor at a time; `around` is the touched dome about the frame.
    ///
    /// # Errors
    /// A load without balance.
    pub fn instant(
        &self,
        frame: u32,
        time_s: f64,
        around: Option<&Around>,
        work: &mut Work,
    ) -> Result<Instant, SimError> {
        let touch = around.map(|around| around.at((time_s - self.scene.time_s(frame)) * self.rate_hz()));
        let state = match &touch {
            Some(touch) => touch.state(self.scene.suspension().at_mm()),
            None => self.scene.state_at(frame, time_s)?,
        };
        let lit = self.pipeline.shading.is_some() && self.field.is_some();
        let step_mm = lit.then(|| dent_step_mm(self.pipeline.contact));
        Instant::new(self.scene, &self.eye, self.pipeline.geometry, time_s, state, touch, step_mm, work)
    }

    fn rate_hz(&self) -> f64 {
        self.scene.file().frames.rate_hz
    }

    /// Only the centres of dots, then markers, in the reference channel: the fastest answer there is.
    ///
    /// # Errors
    /// As [`Renderer::instant`].
    pub fn centers(&self, frame: u32, around: Option<&Around>) -> Result<Vec<Option<glam::DVec2>>, SimError> {
        let mut work = Work::default();
        let instant = self.instant(frame, self.scene.time_s(frame), around, &mut work)?;
        Ok(self.points.centers(&instant, self.eye.reference()))
    }

    /// Draws a frame and tells its truth. Where contact takes part, the frames up to it are solved first: for
    /// whole sequences [`super::run::run`] keeps what it has solved.
    ///
    /// # Errors
    /// A frame whose load has no balance, or whose pose cannot be.
    pub fn frame(&self, number: u32) -> Result<Drawn, SimError> {
        let mut around = None;
        if let Some(mut stepper) = self.stepper()? {
            let mut work = Work::default();
            let mut touches = Vec::new();
            let last = number.saturating_add(1).min(self.scene.frame_count().saturating_sub(1)).max(number);
            for k in 0..=last {
                touches.push(stepper.next(k, self.scene.time_s(k), &mut work)?);
            }
            around = Around::of(&touches, number as usize);
        }
        self.frame_around(number, around.as_ref(), &mut Scratch::default())
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
        let mut work = Work::default();
        let now = self.instant(number, self.scene.time_s(number), around, &mut work)?;
        self.count(&mut work);
        let spots = self.points.see(self.scene, &now);
        let (image, bands) = match &self.field {
            Some(field) => {
                let (image, bands) = self.picture(field, number, &now, &spots, around, scratch, &mut work)?;
                (Some(image), bands)
            }
            None => (None, Vec::new()),
        };
        let truth = self.truth(number, &now, &spots, &bands);
        let contact = around.and_then(|around| around.now.contact.clone());
        Ok(Drawn { image, truth, contact, work })
    }

    fn count(&self, work: &mut Work) {
        let central = self.scene.optics().lens().is_central();
        count_points(self.pipeline.geometry, self.eye.channels(), central, Points::count(self.scene), work);
    }

    fn bands(&self, time_s: f64, height: usize) -> Vec<Band> {
        let timing = &self.pipeline.timing;
        let rows_at: Vec<(Range<usize>, f64)> = match timing.rolling {
            None => vec![(0..height, time_s)],
            Some(rolling) => {
                let bands = (rolling.bands as usize).clamp(1, height.max(1));
                let edge = |band: usize| band * height / bands;
                let row_time = |rows: &Range<usize>| {
                    let middle = 0.5 * (rows.start + rows.end).saturating_sub(1) as f64;
                    let span = (height.max(2) - 1) as f64;
                    time_s + rolling.readout_s * (middle / span - 0.5)
                };
                let bands = (0..bands).map(|band| edge(band)..edge(band + 1));
                bands.map(|rows| (rows.clone(), row_time(&rows))).collect()
            }
        };
        let times = |at: f64| match timing.exposure {
            None => vec![at],
            Some(exposure) => {
                let count = exposure.samples.max(1);
                let part = |k: u32| (f64::from(k) + 0.5) / f64::from(count) - 0.5;
                (0..count).map(|k| at + exposure.exposure_s * part(k)).collect()
            }
        };
        rows_at.into_iter().map(|(rows, at)| Band { rows, times_s: times(at) }).collect()
    }

    /// The picture, and for each band of rows what was seen at its times; empty where all is at the frame's time.
    #[expect(clippy::too_many_arguments, reason = "one step of frame_around(), taken out to be read")]
    fn picture(
        &self,
        field: &LensField,
        number: u32,
        now: &Instant,
        now_spots: &Spots,
        around: Option<&Around>,
        scratch: &mut Scratch,
        work: &mut Work,
    ) -> Result<(Image8, SeenInBands), SimError> {
        let scene = self.scene;
        let parts = Parts { scene, pipeline: &self.pipeline, points: &self.points, field };
        let (width, height) = scene.image_size();
        let planes = scene.planes();
        let fits = |frame: &Frame| {
            frame.width() == width && frame.height() == height && frame.planes.len() == planes
        };
        let mut frame =
            scratch.frame.take().filter(fits).unwrap_or_else(|| Frame::new(width, height, planes));
        let seed = scene.file().seed;
        let bands = self.bands(now.time_s, height);
        let alone = bands.len() == 1 && bands.iter().all(|band| band.times_s.len() == 1);
        let mut part = None;
        if !alone {
            frame.planes.iter_mut().for_each(|plane| plane.fill(0.0));
            part =
                Some(scratch.part.take().filter(fits).unwrap_or_else(|| Frame::new(width, height, planes)));
        }
        let mut told = Vec::new();
        for band in &bands {
            let context = PassContext { frame: number, seed, rows: band.rows.clone() };
            let mut seen = Vec::new();
            for (sample, time_s) in band.times_s.iter().enumerate() {
                let target = part.as_mut().unwrap_or(&mut frame);
                let mut extra = Work::default();
                let first = sample == 0 && told.is_empty();
                let spent = if first { &mut *work } else { &mut extra };
                if *time_s == now.time_s {
                    scratch.painter.draw(parts, now, now_spots, band.rows.clone(), target, spent);
                    seen.push(now_spots.clone());
                } else {
                    let instant = self.instant(number, *time_s, around, spent)?;
                    self.count(spent);
                    let spots = self.points.see_rows(scene, &instant, (now_spots, self.moved_px), &band.rows);
                    scratch.painter.draw(parts, &instant, &spots, band.rows.clone(), target, spent);
                    seen.push(spots);
                }
                for pass in self.pipeline.passes.iter().filter(|pass| pass.stage() <= Stage::Focus) {
                    pass.run(target, &context, spent);
                }
                // What the first picture does not do, the effects of time do.
                let owner = if sample > 0 { EffectName::MotionBlur } else { EffectName::RollingShutter };
                work.add(owner, extra.total());
                if let Some(part) = &part {
                    add_rows(&mut frame, part, &band.rows, 1.0 / band.times_s.len() as f32);
                }
            }
            if !alone {
                told.push((band.rows.clone(), seen));
            }
        }
        let context = PassContext { frame: number, seed, rows: 0..height };
        for pass in self.pipeline.passes.iter().filter(|pass| pass.stage() > Stage::Focus) {
            pass.run(&mut frame, &context, work);
        }
        let bytes = std::mem::take(&mut scratch.bytes);
        let mut image = frame.encode_into(scene.file().electronics.gamma, bytes);
        for pass in &self.pipeline.coded_passes {
            pass.run(&mut image, &context, work);
        }
        scratch.frame = Some(frame);
        scratch.part = part.or(scratch.part.take());
        Ok((image, told))
    }

    fn truth(
        &self,
        number: u32,
        now: &Instant,
        spots: &Spots,
        bands: &[(Range<usize>, Vec<Spots>)],
    ) -> FrameTruth {
        let scene = self.scene;
        let seen = Seen { now: spots, bands, reference: self.eye.reference() };
        let held = now.state.held.as_ref();
        FrameTruth {
            frame: number,
            time_s: now.time_s,
            status: held.map_or_else(|| "ok".into(), |held| held.limit.into()),
            note: held.map(|held| {
                if held.carried < 1.0 {
                    format!("{} stops the platform at {:.2} % of the load", held.part, 100.0 * held.carried)
                } else {
                    format!("{} does not bear the load as the springs' law says", held.part)
                }
            }),
            pose: now.state.pose.to_rows_4x4(),
            wrench: now.state.wrench.to_array(),
            black_dots: (0..scene.dots().len()).map(|index| dot_truth(scene, index, &seen)).collect(),
            white_markers: (0..scene.markers().len())
                .map(|index| marker_truth(scene, index, &seen))
                .collect(),
            effects: self.effects.clone(),
        }
    }
}

impl Around {
    /// About one frame of a sequence.
    pub fn of(touches: &[Touch], index: usize) -> Option<Self> {
        let now = touches.get(index)?.clone();
        let before = index.checked_sub(1).and_then(|i| touches.get(i)).unwrap_or(&now).clone();
        let after = touches.get(index + 1).unwrap_or(&now).clone();
        Some(Self { before, now, after })
    }

    /// At a time of so many frames after the frame.
    fn at(&self, frames: f64) -> Between {
        if frames < 0.0 {
            let part = (1.0 + frames).clamp(0.0, 1.0);
            Between { from: self.before.clone(), to: self.now.clone(), part }
        } else if frames > 0.0 {
            Between { from: self.now.clone(), to: self.after.clone(), part: frames.clamp(0.0, 1.0) }
        } else {
            Between::at_frame(self.now.clone())
        }
    }
}

fn add_rows(sum: &mut Frame, part: &Frame, rows: &Range<usize>, weight: f32) {
    let width = sum.width();
    for (sum, part) in sum.planes.iter_mut().zip(&part.planes) {
        let range = rows.start * width..rows.end * width;
        if let (Some(sum), Some(part)) = (sum.get_mut(range.clone()), part.get(range)) {
            for (sum, value) in sum.iter_mut().zip(part) {
                *sum += weight * value;
            }
        }
    }
}
