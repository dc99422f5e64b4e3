//! The picture of one instant: membrane, dots and markers in linear light.

use std::ops::Range;

use glam::DVec2;

use super::coverage::{Coverage, LEAST_SHARE, clip, clip_to_image};
use super::effect::EffectName;
use super::field::{LensField, cap_box, inside, rim_polygon};
use super::frame::Frame;
use super::instant::{Instant, units};
use super::lit::{Lit, LitSurface};
use super::pipeline::Pipeline;
use super::scene::Scene;
use super::shading::Shading;
use super::spots::{Points, Spots};
use super::work::Work;
use crate::optics::SensorOptics;

/// What a picture is made from.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// What the used effects have installed.
    pub pipeline: &'a Pipeline,
    /// The followed points.
    pub points: &'a Points,
    /// The columns that the lens shows.
    pub field: &'a LensField,
}

/// Draws instants of a scene; what it keeps is room to work in.
#[derive(Debug, Clone, Default)]
pub struct Painter {
    coverage: Coverage,
    spans: Vec<Range<usize>>,
    one: Lit<1>,
    three: Lit<3>,
}

impl Painter {
    /// Draws some rows of an instant over what is there.
    pub fn draw(
        &mut self,
        parts: Parts<'_>,
        instant: &Instant,
        spots: &Spots,
        rows: Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        self.ground(parts, instant, &rows, frame, work);
        if parts.pipeline.ink.dots {
            self.dots(parts, spots, &rows, frame, work);
        }
        self.markers(parts, spots, &rows, frame, work);
    }

    /// Surround and membrane.
    fn ground(
        &mut self,
        parts: Parts<'_>,
        instant: &Instant,
        rows: &Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        let (width, height) = (frame.width(), frame.height());
        // Channels with rays of their own are drawn one by one, the others together.
        let planes = frame.planes.len();
        let own = instant.eye.channels() == planes;
        // Under a membrane that is drawn at once a row's surround is laid when its turn comes: it is at hand then.
        let at_once = parts.pipeline.shading.is_some() && !own;
        let later = if at_once { self.rim_rows(instant, rows, (width, height)) } else { 0..0 };
        let surround = Surround::of(parts);
        for plane in &mut frame.planes {
            let lines = plane.chunks_exact_mut(width).enumerate().skip(rows.start).take(rows.len());
            lines.filter(|(y, _)| !later.contains(y)).for_each(|(y, row)| surround.lay(y, row, 0..width));
            work.add_base((rows.len() * width) as u64 * units::PIXEL);
        }
        for channel in 0..if own { planes } else { 1 } {
            let Some(optics) = instant.eye.optics(channel) else { continue };
            if !at_once {
                let rim = clip_to_image(&rim_polygon(optics), width, height);
                self.coverage.fill(&clip_to_rows(rim, rows, height));
            }
            let together = if own { channel..channel + 1 } else { 0..planes };
            let mut extra = Work::default();
            let spent = if channel == 0 { &mut *work } else { &mut extra };
            match &parts.pipeline.shading {
                None => self.flat(parts, rows, frame, together, spent),
                Some(shading) => {
                    self.lit(parts, instant, optics, shading.as_ref(), rows, frame, together, spent)
                }
            }
            work.add(EffectName::Dispersion, extra.total());
        }
    }

    /// The rows that the rim's outline meets in the first channel; the coverage is then the rim's.
    fn rim_rows(
        &mut self,
        instant: &Instant,
        rows: &Range<usize>,
        (width, height): (usize, usize),
    ) -> Range<usize> {
        let Some(optics) = instant.eye.optics(0) else { return 0..0 };
        let rim = clip_to_image(&rim_polygon(optics), width, height);
        self.coverage.fill(&clip_to_rows(rim, rows, height));
        let mut met = self.coverage.rows(width, height).map(|(y, ..)| y);
        let first = met.next();
        first.map_or(0..0, |first| first..met.last().unwrap_or(first) + 1)
    }

    fn flat(
        &mut self,
        parts: Parts<'_>,
        rows: &Range<usize>,
        frame: &mut Frame,
        channels: Range<usize>,
        work: &mut Work,
    ) {
        let (width, height) = (frame.width(), frame.height());
        let light = &parts.scene.file().light;
        let rise = (light.membrane_level - light.surround_level) as f32;
        for plane in frame.planes.iter_mut().skip(channels.start).take(channels.len()) {
            for (y, x, part) in self.coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
                let (seen, part) = inside(parts.field.row(y), x, part);
                let Some(values) = plane.get_mut(y * width + seen.start..y * width + seen.end) else {
                    continue;
                };
                for (value, share) in values.iter_mut().zip(part) {
                    *value += share * rise;
                }
            }
            work.add_base(self.coverage.area() as u64 * units::PIXEL);
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one step of ground(), taken out to be read")]
    fn lit(
        &mut self,
        parts: Parts<'_>,
        instant: &Instant,
        optics: &SensorOptics,
        shading: &dyn Shading,
        rows: &Range<usize>,
        frame: &mut Frame,
        channels: Range<usize>,
        work: &mut Work,
    ) {
        let (width, height) = (frame.width(), frame.height());
        let [left, top, right, bottom] = self.coverage.bounds(width, height);
        self.coverage.spans(width, height, &mut self.spans);
        for (y, span) in self.spans.iter_mut().enumerate() {
            let seen = parts.field.row(y);
            *span = if rows.contains(&y) { span.start.max(seen.start)..span.end.min(seen.end) } else { 0..0 };
        }
        let surface = LitSurface {
            optics,
            dent: instant.dent.as_ref(),
            rays: Some(parts.field.rays()),
            shading,
            channel: channels.start,
            tolerance: (SMOOTH_GREY / 255.0 / parts.scene.file().electronics.steepest_code(DARK_LEVEL))
                as f32,
        };
        let pressed = instant.touch.as_ref().filter(|_| instant.dent.is_some()).and_then(|touch| {
            let (middle, angle_rad) = touch.pressed_cap()?;
            Some(cap_box(
                optics,
                middle,
                angle_rad + PRESSED_MARGIN_MM / optics.dome_radius_mm(),
                width,
                height,
            ))
        });
        let center = DVec2::new((left + right) as f64, (top + bottom) as f64) * 0.5;
        if channels.len() == 3 {
            self.three.fill(&surface, (width, height), &self.spans, pressed, work);
            let surround = (instant.eye.channels() != frame.planes.len()).then(|| Surround::of(parts));
            blend(&mut self.three, &self.coverage, (parts.field, surround), center, rows, frame, 0);
        } else {
            self.one.fill(&surface, (width, height), &self.spans, pressed, work);
            blend(&mut self.one, &self.coverage, (parts.field, None), center, rows, frame, channels.start);
        }
        work.add_base(self.coverage.area() as u64 * units::PIXEL * channels.len() as u64);
    }

    fn dots(
        &mut self,
        parts: Parts<'_>,
        spots: &Spots,
        rows: &Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        let (width, height) = (frame.width(), frame.height());
        let taken = 1.0 - parts.scene.file().ink.reflectance as f32;
        let channels = spots.channels();
        for index in 0..parts.scene.dots().len() {
            let rings = parts.points.rings(index);
            for (channel, plane) in frame.planes.iter_mut().enumerate() {
                if channel < channels {
                    let Some(spot) = spots.dot(index, channel).filter(|spot| spot.meets(rows)) else {
                        self.coverage.fill(&[]);
                        continue;
                    };
                    self.coverage.fill_rings(&spot.polygon, spot.center_px, rings);
                    let outline = spot.polygon.len() as u64 * units::CORNER;
                    let effort = outline + self.coverage.area() as u64 * units::PIXEL;
                    let owner = if channel == 0 { EffectName::Dots } else { EffectName::Dispersion };
                    work.add(owner, effort);
                    work.add(EffectName::InkEdge, (rings.len() as u64 - 1) * outline);
                }
                for (y, x, part) in self.coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
                    let start = y * width + x;
                    let Some(row) = plane.get_mut(start..start + part.len()) else { continue };
                    for (value, share) in row.iter_mut().zip(part) {
                        *value *= 1.0 - share * taken;
                    }
                }
            }
        }
    }

    fn markers(
        &mut self,
        parts: Parts<'_>,
        spots: &Spots,
        rows: &Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        let Parts { scene, pipeline, .. } = parts;
        let (width, height) = (frame.width(), frame.height());
        let flat = [scene.file().light.marker_level as f32; 3];
        for (index, marker) in scene.markers().iter().enumerate() {
            let level = match &pipeline.shading {
                Some(shading) => shading.marker_level(scene, marker.position_mm),
                None => flat,
            };
            for (channel, plane) in frame.planes.iter_mut().enumerate() {
                if channel < spots.channels() {
                    let Some(spot) = spots.marker(index, channel).filter(|spot| spot.meets(rows)) else {
                        self.coverage.fill(&[]);
                        continue;
                    };
                    self.coverage.fill(&spot.polygon);
                    work.add_base(
                        spot.polygon.len() as u64 * units::CORNER
                            + self.coverage.area() as u64 * units::PIXEL,
                    );
                }
                let level = level[channel.min(2)];
                for (y, x, part) in self.coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
                    let (seen, part) = inside(parts.field.row(y), x, part);
                    let Some(row) = plane.get_mut(y * width + seen.start..y * width + seen.end) else {
                        continue;
                    };
                    for (value, share) in row.iter_mut().zip(part) {
                        *value += share * (level - *value);
                    }
                }
            }
        }
    }
}

/// The part of a polygon in some rows of a picture.
fn clip_to_rows(polygon: Vec<DVec2>, rows: &Range<usize>, height: usize) -> Vec<DVec2> {
    if *rows == (0..height) {
        return polygon;
    }
    let kept = clip(&polygon, -DVec2::Y, 0.5 - rows.start as f64);
    clip(&kept, DVec2::Y, rows.end as f64 - 0.5)
}

/// How far the middle of a square may be from what its corners promise, grey levels: what is left between the
/// nodes, of the third order, is then a fraction of a level.
const SMOOTH_GREY: f64 = 2.0;
/// Level at which the code's slope is taken for that.
const DARK_LEVEL: f64 = 0.05;
/// Room around the pressed part in which the membrane still bends sharply, mm.
const PRESSED_MARGIN_MM: f64 = 0.6;

/// What is beside the sensor.
#[derive(Clone, Copy)]
struct Surround<'a> {
    field: &'a LensField,
    level: f32,
}

impl<'a> Surround<'a> {
    fn of(parts: Parts<'a>) -> Self {
        Self { field: parts.field, level: parts.scene.file().light.surround_level as f32 }
    }

    /// Columns of a row without sensor: dark where the lens shows nothing.
    fn lay(&self, y: usize, row: &mut [f32], columns: Range<usize>) {
        let seen = self.field.row(y);
        let mut fill = |from: usize, to: usize, level: f32| {
            let place = from.max(columns.start)..to.min(columns.end);
            row.get_mut(place).into_iter().for_each(|part| part.fill(level));
        };
        fill(0, seen.start, 0.0);
        fill(seen.start, seen.end, self.level);
        fill(seen.end, usize::MAX, 0.0);
    }
}

/// Lays the lit membrane over the ground.
fn blend<const N: usize>(
    lit: &mut Lit<N>,
    coverage: &Coverage,
    (field, surround): (&LensField, Option<Surround<'_>>),
    center: DVec2,
    rows: &Range<usize>,
    frame: &mut Frame,
    first: usize,
) {
    let (width, height) = (frame.width(), frame.height());
    for (y, x, part) in coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
        let (seen, part) = inside(field.row(y), x, part);
        lit.complete(y, seen.clone(), part, center);
        let whole = whole_of(part);
        let (left, right) = (seen.start + whole.start, seen.start + whole.end);
        // A picture has one plane or three.
        for (lane, plane) in frame.planes.iter_mut().skip(first).take(N).enumerate() {
            let Some(row) = plane.get_mut(y * width..(y + 1) * width) else { continue };
            if let Some(surround) = surround {
                surround.lay(y, row, 0..left);
                surround.lay(y, row, right..width);
            }
            let Some(values) = row.get_mut(seen.clone()) else { continue };
            let levels = lit.row(lane, y, seen.clone());
            let edge = |values: &mut [f32], columns: Range<usize>| {
                let (Some(values), Some(part), Some(levels)) =
                    (values.get_mut(columns.clone()), part.get(columns.clone()), levels.get(columns))
                else {
                    return;
                };
                for ((value, share), level) in values.iter_mut().zip(part).zip(levels) {
                    *value += share * (level - *value);
                }
            };
            edge(values, 0..whole.start);
            edge(values, whole.end..part.len());
            if let (Some(values), Some(levels)) = (values.get_mut(whole.clone()), levels.get(whole.clone())) {
                values.copy_from_slice(levels);
            }
        }
    }
}

/// The columns between a row's edges, where all is membrane; empty where there are none.
fn whole_of(shares: &[f32]) -> Range<usize> {
    let is_whole = |share: &f32| *share > 1.0 - LEAST_SHARE;
    let first = shares.iter().position(is_whole).unwrap_or(0);
    let last = shares.iter().rposition(is_whole).map_or(first, |last| last + 1);
    // A count, and no look for the first that is not: machines count several at once.
    let lacking = shares.get(first..last).unwrap_or_default();
    let lacking: u32 = lacking.iter().map(|share| u32::from(!is_whole(share))).sum();
    if lacking == 0 { first..last } else { 0..0 }
}
