//! From a scene and its plan to frames and their truth.

use std::ops::Range;

use super::SimError;
use super::effect::EffectName;
use super::eye::Eye;
use super::frame::{Frame, Image8};
use super::instant::{Instant, Points, Spot, at_time, count_points};
use super::picture::{Painter, Parts};
use super::pipeline::{PassContext, Pipeline, Stage};
use super::plan::Plan;
use super::scene::Scene;
use super::truth::{DotTruth, EffectTruth, FrameTruth, MarkerTruth, effects_of};
use super::work::Work;

/// How far the drawn outlines of dots may be from the exact ones, grey levels at the edge.
const OUTLINE_GREY: f64 = 0.5;

/// Draws the frames of a scene with the effects of a plan.
pub struct Renderer<'a> {
    scene: &'a Scene,
    pipeline: Pipeline,
    eye: Eye,
    points: Points,
    painter: Option<Painter>,
    effects: Vec<EffectTruth>,
    setup: Work,
}

/// A frame with its truth and the work that it took.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The picture; `None` where the scene wants none.
    pub image: Option<Image8>,
    /// What is true of it.
    pub truth: FrameTruth,
    /// What it took.
    pub work: Work,
}

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
        let solves =
            pipeline.geometry.gap_change || !pipeline.geometry.refraction || !pipeline.geometry.sheet_motion;
        let contrast = (255.0 * scene.file().light.membrane_level).max(1.0);
        let points = Points::new(scene, &eye, solves, OUTLINE_GREY / contrast, &mut setup);
        let painter = match eye.at(&crate::numeric::Rigid::identity())?.optics(eye.reference()) {
            Some(optics) if scene.draws() => Some(Painter::new(scene, optics.lens())),
            _ => None,
        };
        Ok(Self { scene, pipeline, eye, points, painter, effects: effects_of(plan), setup })
    }

    /// What putting the effects together took.
    pub fn setup(&self) -> &Work {
        &self.setup
    }

    /// The sensor at a frame's time.
    ///
    /// # Errors
    /// A load without balance.
    pub fn instant(&self, frame: u32, time_s: f64, work: &mut Work) -> Result<Instant, SimError> {
        at_time(self.scene, &self.eye, self.pipeline.geometry, frame, time_s, work)
    }

    /// Draws a frame and tells its truth.
    ///
    /// # Errors
    /// A frame whose load has no balance, or whose pose cannot be.
    pub fn frame(&self, number: u32) -> Result<Drawn, SimError> {
        let mut work = Work::default();
        let time_s = self.scene.time_s(number);
        let now = self.instant(number, time_s, &mut work)?;
        self.count(&mut work);
        let truth = self.truth(number, &now);
        let image = match &self.painter {
            Some(painter) => Some(self.picture(painter.clone(), number, &now, &mut work)?),
            None => None,
        };
        Ok(Drawn { image, truth, work })
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
                (0..bands)
                    .map(|band| edge(band)..edge(band + 1))
                    .map(|rows| (rows.clone(), row_time(&rows)))
                    .collect()
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

    fn picture(
        &self,
        mut painter: Painter,
        number: u32,
        now: &Instant,
        work: &mut Work,
    ) -> Result<Image8, SimError> {
        let scene = self.scene;
        let parts = Parts { scene, pipeline: &self.pipeline, points: &self.points };
        let (width, height) = scene.image_size();
        let mut frame = Frame::new(width, height, scene.planes());
        let seed = scene.file().seed;
        let bands = self.bands(now.time_s, height);
        let alone = bands.len() == 1 && bands.iter().all(|band| band.times_s.len() == 1);
        let mut part = if alone { None } else { Some(Frame::new(width, height, scene.planes())) };
        for band in &bands {
            let context = PassContext { frame: number, seed, rows: band.rows.clone() };
            for time_s in &band.times_s {
                let elsewhen;
                let instant = if *time_s == now.time_s {
                    now
                } else {
                    let owner = if self.pipeline.timing.exposure.is_some() {
                        EffectName::MotionBlur
                    } else {
                        EffectName::RollingShutter
                    };
                    let mut extra = Work::default();
                    elsewhen = self.instant(number, *time_s, &mut extra)?;
                    self.count(&mut extra);
                    work.add(owner, extra.total());
                    &elsewhen
                };
                let target = part.as_mut().unwrap_or(&mut frame);
                painter.draw(parts, instant, band.rows.clone(), target, work);
                for pass in self.pipeline.passes.iter().filter(|pass| pass.stage() <= Stage::Focus) {
                    pass.run(target, &context, work);
                }
                if let Some(part) = &part {
                    add_rows(&mut frame, part, &band.rows, 1.0 / band.times_s.len() as f32);
                }
            }
        }
        let context = PassContext { frame: number, seed, rows: 0..height };
        for pass in self.pipeline.passes.iter().filter(|pass| pass.stage() > Stage::Focus) {
            pass.run(&mut frame, &context, work);
        }
        let mut image = frame.encode(scene.file().electronics.gamma);
        for pass in &self.pipeline.coded_passes {
            pass.run(&mut image, &context, work);
        }
        Ok(image)
    }

    fn truth(&self, number: u32, now: &Instant) -> FrameTruth {
        let scene = self.scene;
        let reference = self.eye.reference();
        let channels = self.eye.channels();
        let colours = |see: &dyn Fn(usize) -> Option<Spot>| {
            (channels == 3)
                .then(|| std::array::from_fn(|channel| see(channel).map(|s| s.centroid_px.to_array())))
        };
        let dot = |(index, dot): (usize, &super::scene::SceneDot)| {
            let see = |channel| self.points.dot(scene, now, channel, index);
            let spot = see(reference);
            let visible = spot.as_ref().is_some_and(|spot| spot.area_px2 > 0.0);
            DotTruth {
                id: dot.id,
                image_px: spot.as_ref().map(|spot| spot.center_px.to_array()),
                centroid_px: spot.as_ref().filter(|_| visible).map(|spot| spot.centroid_px.to_array()),
                centroid_rgb_px: colours(&see),
                surface_mm: dot.center_mm.to_array(),
                visible,
            }
        };
        let marker = |(index, marker): (usize, &crate::pose::Marker)| {
            let see = |channel| self.points.marker(scene, now, channel, index);
            let spot = see(reference);
            let visible = spot.as_ref().is_some_and(|spot| spot.area_px2 > 0.0);
            MarkerTruth {
                id: marker.id,
                image_px: spot.as_ref().map(|spot| spot.center_px.to_array()),
                centroid_px: spot.as_ref().filter(|_| visible).map(|spot| spot.centroid_px.to_array()),
                centroid_rgb_px: colours(&see),
                visible,
            }
        };
        let held = now.state.held.as_ref();
        FrameTruth {
            frame: number,
            time_s: now.time_s,
            status: held.map_or_else(|| "ok".into(), |held| held.limit.into()),
            note: held.map(|held| {
                format!("{} stops the platform at {:.2} % of the load", held.part, 100.0 * held.carried)
            }),
            pose: now.state.pose.to_rows_4x4(),
            wrench: now.state.wrench.to_array(),
            black_dots: scene.dots().iter().enumerate().map(dot).collect(),
            white_markers: scene.markers().iter().enumerate().map(marker).collect(),
            effects: self.effects.clone(),
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
