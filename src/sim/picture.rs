//! The picture of one instant, or of rows exposed one after the other: membrane, dots and markers in linear light.

use std::ops::Range;

use glam::{DVec2, Mat4};

use super::coverage::{Coverage, LEAST_SHARE, clip, clip_to_image};
use super::effect::EffectName;
use super::field::{LensField, inside, rim_polygon};
use super::frame::Frame;
use super::instant::units;
use super::lit::{Lit, LitSlice, LitSurface};
use super::pipeline::Pipeline;
use super::rolled::Slice;
use super::scene::Scene;
use super::shading::Shading;
use super::spots::{Points, Spots};
use super::work::Work;

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
    /// The dome's by slice.
    domes: Vec<Coverage>,
    /// Rows whose surround is laid with the membrane.
    later: Vec<bool>,
    spans: Vec<Range<usize>>,
    lit: Lit,
}

impl Painter {
    /// Draws the sensor as slices of rows see it, over what is there; the slices hold all rows.
    pub fn draw(
        &mut self,
        parts: Parts<'_>,
        slices: &[Slice<'_>],
        spots: &Spots,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        self.ground(parts, slices, frame, work);
        if parts.pipeline.ink.dots {
            self.dots(parts, spots, frame, work);
        }
        self.markers(parts, spots, frame, work);
    }

    /// Surround and membrane.
    fn ground(&mut self, parts: Parts<'_>, slices: &[Slice<'_>], frame: &mut Frame, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        // Channels with rays of their own are drawn one by one, the others together.
        let planes = frame.planes.len();
        let own = slices.first().is_some_and(|slice| slice.instant.eye.channels() == planes);
        // Under a membrane that is drawn at once a row's surround is laid when its turn comes: it is at hand then.
        let at_once = parts.pipeline.shading.is_some() && !own;
        self.later.clear();
        self.later.resize(height, false);
        self.domes.resize_with(slices.len(), Coverage::default);
        if at_once {
            self.find_domes(slices, 0, (width, height));
            for (dome, slice) in self.domes.iter().zip(slices) {
                for (y, ..) in dome.rows(width, height).filter(|(y, ..)| slice.rows().contains(y)) {
                    self.later.get_mut(y).into_iter().for_each(|later| *later = true);
                }
            }
        }
        let surround = Surround::of(parts);
        for plane in &mut frame.planes {
            let rows = plane.chunks_exact_mut(width).zip(&self.later).enumerate();
            for (y, (row, _)) in rows.filter(|(_, (_, later))| !**later) {
                surround.lay(y, row, 0..width);
            }
            work.add_base((height * width) as u64 * units::PIXEL);
        }
        for channel in 0..if own { planes } else { 1 } {
            if !at_once {
                self.find_domes(slices, channel, (width, height));
            }
            let together = if own { channel..channel + 1 } else { 0..planes };
            let mut extra = Work::default();
            let spent = if channel == 0 { &mut *work } else { &mut extra };
            match &parts.pipeline.shading {
                None => self.flat(parts, slices, frame, together, spent),
                Some(shading) => self.lit(parts, slices, shading.as_ref(), frame, together, spent),
            }
            work.add(EffectName::Dispersion, extra.total());
        }
    }

    /// The domes' coverage by slice, in a channel.
    fn find_domes(&mut self, slices: &[Slice<'_>], channel: usize, (width, height): (usize, usize)) {
        for (dome, slice) in self.domes.iter_mut().zip(slices) {
            let rim = slice.instant.eye.optics(channel).map(rim_polygon).unwrap_or_default();
            let rim = clip_to_image(&rim, width, height);
            dome.fill(&clip_to_rows(rim, &slice.rows(), height));
        }
    }

    fn flat(
        &mut self,
        parts: Parts<'_>,
        slices: &[Slice<'_>],
        frame: &mut Frame,
        channels: Range<usize>,
        work: &mut Work,
    ) {
        let (width, height) = (frame.width(), frame.height());
        let light = &parts.scene.file().light;
        let rise = (light.membrane_level - light.surround_level) as f32;
        for (dome, slice) in self.domes.iter().zip(slices) {
            for plane in frame.planes.iter_mut().skip(channels.start).take(channels.len()) {
                for (y, x, part) in dome.rows(width, height).filter(|(y, ..)| slice.rows().contains(y)) {
                    let (seen, part) = inside(parts.field.row(y), x, part);
                    let Some(values) = plane.get_mut(y * width + seen.start..y * width + seen.end) else {
                        continue;
                    };
                    for (value, share) in values.iter_mut().zip(part) {
                        *value += share * rise;
                    }
                }
                work.add_base(dome.area() as u64 * units::PIXEL);
            }
        }
    }

    fn lit(
        &mut self,
        parts: Parts<'_>,
        slices: &[Slice<'_>],
        shading: &dyn Shading,
        frame: &mut Frame,
        channels: Range<usize>,
        work: &mut Work,
    ) {
        let (width, height) = (frame.width(), frame.height());
        self.spans.clear();
        self.spans.resize(height, 0..0);
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        let mut seen = Vec::with_capacity(slices.len());
        for (dome, slice) in self.domes.iter().zip(slices) {
            let Some(optics) = slice.instant.eye.optics(channels.start) else { continue };
            let [left, top, right, bottom] = dome.bounds(width, height);
            low = [low[0].min(left), low[1].min(top)];
            high = [high[0].max(right), high[1].max(bottom)];
            dome.spans(width, height, &slice.rows(), &mut self.spans);
            seen.push(LitSlice { end: slice.end, optics, dent: slice.instant.shape.dent.as_ref() });
        }
        for (y, span) in self.spans.iter_mut().enumerate() {
            let shown = parts.field.row(y);
            *span = span.start.max(shown.start)..span.end.min(shown.end);
        }
        let surface = LitSurface {
            slices: &seen,
            rays: Some(parts.field.rays()),
            shading,
            channels: channels.clone(),
            tolerance: parts.pipeline.fill_tolerance,
        };
        let at = |k: usize| 0.5 * (low[k].min(high[k]) + high[k]) as f64;
        let center = DVec2::new(at(0), at(1));
        let surround = (channels.len() == 3).then(|| Surround::of(parts));
        let domes = &self.domes;
        let over = Over { field: parts.field, surround, center, channels: channels.clone() };
        self.lit.fill(&surface, (width, height), &self.spans, work, |lit, rows| {
            for (dome, slice) in domes.iter().zip(slices) {
                let of_slice = slice.rows();
                for y in rows.start.max(of_slice.start)..rows.end.min(of_slice.end) {
                    over.blend(lit, dome, y, frame);
                }
            }
        });
        for dome in &self.domes {
            work.add_base(dome.area() as u64 * units::PIXEL * channels.len() as u64);
        }
    }

    fn dots(&mut self, parts: Parts<'_>, spots: &Spots, frame: &mut Frame, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        let taken = 1.0 - parts.scene.file().ink.reflectance as f32;
        let channels = spots.channels();
        for index in 0..parts.scene.dots().len() {
            let rings = parts.points.rings(index);
            for (channel, plane) in frame.planes.iter_mut().enumerate() {
                if channel < channels {
                    let Some(spot) = spots.dot(index, channel) else {
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
                for (y, x, part) in self.coverage.rows(width, height) {
                    let start = y * width + x;
                    let Some(row) = plane.get_mut(start..start + part.len()) else { continue };
                    for (value, share) in row.iter_mut().zip(part) {
                        *value *= 1.0 - share * taken;
                    }
                }
            }
        }
    }

    fn markers(&mut self, parts: Parts<'_>, spots: &Spots, frame: &mut Frame, work: &mut Work) {
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
                    let Some(spot) = spots.marker(index, channel) else {
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
                for (y, x, part) in self.coverage.rows(width, height) {
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

/// How the lit membrane is laid over the ground.
struct Over<'a> {
    field: &'a LensField,
    /// What is laid beside the membrane in the same rows, where that is still to be done.
    surround: Option<Surround<'a>>,
    /// Of the dome in the picture, px.
    center: DVec2,
    channels: Range<usize>,
}

impl Over<'_> {
    /// Lays a row.
    fn blend(&self, lit: &mut Lit, coverage: &Coverage, y: usize, frame: &mut Frame) {
        let width = frame.width();
        let Some((x, part)) = coverage.row(y, width) else { return };
        let (seen, part) = inside(self.field.row(y), x, part);
        lit.complete(y, seen.clone(), part, self.center);
        let whole = whole_of(part);
        let (left, right) = (seen.start + whole.start, seen.start + whole.end);
        let levels = lit.row(y, seen.clone());
        // A picture has one plane or three.
        for (lane, plane) in
            frame.planes.iter_mut().enumerate().take(self.channels.end).skip(self.channels.start)
        {
            let Some(row) = plane.get_mut(y * width..(y + 1) * width) else { continue };
            if let Some(surround) = self.surround {
                surround.lay(y, row, 0..left);
                surround.lay(y, row, right..width);
            }
            let Some(values) = row.get_mut(seen.clone()) else { continue };
            for columns in [0..whole.start, whole.end..part.len()] {
                let (Some(values), Some(part), Some(levels)) =
                    (values.get_mut(columns.clone()), part.get(columns.clone()), levels.get(columns))
                else {
                    continue;
                };
                for ((value, share), level) in values.iter_mut().zip(part).zip(levels) {
                    *value += share * (level[lane] - *value);
                }
            }
        }
        let Some(levels) = levels.get(whole) else { return };
        let channels = self.channels.clone();
        let rows = frame.planes.get_mut(channels.clone()).unwrap_or_default().iter_mut();
        let mut rows = rows.filter_map(|plane| plane.get_mut(y * width + left..y * width + right));
        match (rows.next(), rows.next(), rows.next()) {
            (Some(red), Some(green), Some(blue)) => {
                let (fours, last) = levels.as_chunks::<4>();
                let (red, last_red) = red.as_chunks_mut::<4>();
                let (green, last_green) = green.as_chunks_mut::<4>();
                let (blue, last_blue) = blue.as_chunks_mut::<4>();
                for (((red, green), blue), four) in red.iter_mut().zip(green).zip(blue).zip(fours) {
                    let [a, b, c, d] = *four;
                    let planes = Mat4::from_cols(a, b, c, d).transpose();
                    *red = planes.x_axis.to_array();
                    *green = planes.y_axis.to_array();
                    *blue = planes.z_axis.to_array();
                }
                let last = last_red.iter_mut().zip(last_green).zip(last_blue).zip(last);
                for (((red, green), blue), level) in last {
                    (*red, *green, *blue) = (level.x, level.y, level.z);
                }
            }
            (Some(one), ..) => {
                one.iter_mut().zip(levels).for_each(|(value, level)| *value = level[channels.start]);
            }
            _ => {}
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
