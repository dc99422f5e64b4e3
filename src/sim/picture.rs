//! The picture of one instant, or of rows exposed one after the other: membrane, dots and markers in linear light.

use std::ops::Range;

use glam::DVec2;

use super::coverage::{Coverage, clip, clip_to_image};
use super::effect::EffectName;
use super::field::{LensField, cap_box, inside, rim_polygon};
use super::frame::Frame;
use super::instant::units;
use super::lit::{Lit, LitSlice, LitSurface, PixelBox};
use super::pipeline::Pipeline;
use super::rolled::Slice;
use super::scene::Scene;
use super::shading::Shading;
use super::shapes::Shape;
use super::spots::{Points, Spots};
use super::touch::Between;
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
    spans: Vec<Range<usize>>,
    one: Lit<1>,
    three: Lit<3>,
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
        let surround = parts.scene.file().light.surround_level as f32;
        let (width, height) = (frame.width(), frame.height());
        for plane in &mut frame.planes {
            for (y, row) in plane.chunks_exact_mut(width).enumerate() {
                let seen = parts.field.row(y);
                let (dark, rest) = row.split_at_mut(seen.start.min(width));
                let (seen, beyond) = rest.split_at_mut(seen.len().min(rest.len()));
                dark.fill(0.0);
                seen.fill(surround);
                beyond.fill(0.0);
            }
            work.add_base((height * width) as u64 * units::PIXEL);
        }
        // Channels with rays of their own are drawn one by one, the others together.
        let planes = frame.planes.len();
        let own = slices.first().is_some_and(|slice| slice.instant.eye.channels() == planes);
        self.domes.resize_with(slices.len(), Coverage::default);
        for channel in 0..if own { planes } else { 1 } {
            for (dome, slice) in self.domes.iter_mut().zip(slices) {
                let rim = slice.instant.eye.optics(channel).map(rim_polygon).unwrap_or_default();
                let rim = clip_to_image(&rim, width, height);
                dome.fill(&clip_to_rows(rim, &slice.rows(), height));
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
        let mut pressed: Option<PixelBox> = None;
        let mut seen = Vec::with_capacity(slices.len());
        for (dome, slice) in self.domes.iter().zip(slices) {
            let Some(optics) = slice.instant.eye.optics(channels.start) else { continue };
            let [left, top, right, bottom] = dome.bounds(width, height);
            low = [low[0].min(left), low[1].min(top)];
            high = [high[0].max(right), high[1].max(bottom)];
            dome.spans(width, height, &slice.rows(), &mut self.spans);
            let Shape { touch, dent, .. } = &slice.instant.shape;
            let cap = touch.as_ref().filter(|_| dent.is_some()).and_then(Between::pressed_cap);
            if let Some((middle, angle_rad)) = cap {
                let angle_rad = angle_rad + PRESSED_MARGIN_MM / optics.dome_radius_mm();
                let cap = cap_box(optics, middle, angle_rad, width, height);
                pressed = Some(pressed.map_or(cap, |pressed| pressed.with(&cap)));
            }
            seen.push(LitSlice { end: slice.end, optics, dent: dent.as_ref() });
        }
        for (y, span) in self.spans.iter_mut().enumerate() {
            let shown = parts.field.row(y);
            *span = span.start.max(shown.start)..span.end.min(shown.end);
        }
        let surface = LitSurface {
            slices: &seen,
            shading,
            channel: channels.start,
            tolerance: (SMOOTH_GREY / 255.0 / parts.scene.file().electronics.steepest_code(DARK_LEVEL))
                as f32,
        };
        let at = |k: usize| 0.5 * (low[k].min(high[k]) + high[k]) as f64;
        let center = DVec2::new(at(0), at(1));
        if channels.len() == 3 {
            self.three.fill(&surface, (width, height), &self.spans, pressed, work);
        } else {
            self.one.fill(&surface, (width, height), &self.spans, pressed, work);
        }
        for (dome, slice) in self.domes.iter().zip(slices) {
            let over = (dome, &slice.rows());
            if channels.len() == 3 {
                blend(&mut self.three, over, parts.field, center, frame, channels.start);
            } else {
                blend(&mut self.one, over, parts.field, center, frame, channels.start);
            }
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

/// How far the middle of a square may be from what its corners promise, grey levels: what is left between the
/// nodes, of the third order, is then a fraction of a level.
const SMOOTH_GREY: f64 = 2.0;
/// Level at which the code's slope is taken for that.
const DARK_LEVEL: f64 = 0.05;
/// Room around the pressed part in which the membrane still bends sharply, mm.
const PRESSED_MARGIN_MM: f64 = 0.6;

/// Lays the lit membrane over the ground.
fn blend<const N: usize>(
    lit: &mut Lit<N>,
    (coverage, rows): (&Coverage, &Range<usize>),
    field: &LensField,
    center: DVec2,
    frame: &mut Frame,
    first: usize,
) {
    let (width, height) = (frame.width(), frame.height());
    for (y, x, part) in coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
        let (seen, part) = inside(field.row(y), x, part);
        lit.complete(y, seen.clone(), part, center);
        // A picture has one plane or three.
        for (lane, plane) in frame.planes.iter_mut().skip(first).take(N).enumerate() {
            let Some(values) = plane.get_mut(y * width + seen.start..y * width + seen.end) else { continue };
            for ((value, share), level) in values.iter_mut().zip(part).zip(lit.row(lane, y, seen.clone())) {
                *value += share * (level - *value);
            }
        }
    }
}
