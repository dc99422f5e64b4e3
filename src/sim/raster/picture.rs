//! The picture of one instant, or of rows exposed one after the other: membrane, dots and markers in linear light.

use std::ops::Range;

use glam::DVec2;

use crate::effect_name::EffectName;
use crate::light::gloss::Gloss;
use crate::light::shading::Shading;
use crate::raster::coverage::{Coverage, clip, clip_to_image};
use crate::raster::frame::Frame;
use crate::raster::glints;
use crate::raster::lattice::Lattice;
use crate::raster::lens_field::{LensField, inside, rim_polygon};
use crate::raster::rolled::Slice;
use crate::raster::sensor_state::units;
use crate::raster::specks::Specks;
use crate::raster::spots::{Points, Spots};
use crate::raster::surface::{ShadedSlice, ShadedSurface};
use crate::scene::Scene;
use crate::work::Work;

/// What a picture is made from.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Whether dots are drawn.
    pub dots: bool,
    /// The brightness of the membrane; `None`: evenly lit.
    pub shading: Option<&'a dyn Shading>,
    /// How far interpolated pixels of a lit membrane may be off, full scales.
    pub tolerance: f32,
    /// The followed points.
    pub points: &'a Points,
    /// The columns that the lens shows.
    pub field: &'a LensField,
    /// The lights mirrored in the sheet.
    pub gloss: Option<&'a Gloss>,
    /// Dust before the sensor.
    pub dust: Option<&'a Specks>,
}

/// Draws instants of a scene; what it keeps is room to work in.
#[derive(Debug, Clone, Default)]
pub struct Painter {
    coverage: Coverage,
    /// The dome's by slice.
    domes: Vec<Coverage>,
    spans: Vec<Range<usize>>,
    lattice: Lattice,
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
        if parts.dots {
            self.dots(parts, spots, frame, work);
        }
        self.markers(parts, spots, frame, work);
        if let Some(gloss) = parts.gloss {
            glints::lay(gloss, slices, frame, &mut self.coverage, work);
        }
        if let Some(dust) = parts.dust {
            dust.lay(slices, parts.field, frame, work);
        }
    }

    /// Surround and membrane.
    fn ground(&mut self, parts: Parts<'_>, slices: &[Slice<'_>], frame: &mut Frame, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        // Channels with rays of their own are drawn one by one, the others together.
        let planes = frame.planes.len();
        let own = slices.first().is_some_and(|slice| slice.instant.eye.channels() == planes);
        let surround = Surround::of(parts);
        for plane in &mut frame.planes {
            for (y, row) in plane.chunks_exact_mut(width).enumerate() {
                surround.lay(y, row);
            }
            work.add_base((height * width) as u64 * units::PIXEL);
        }
        self.domes.resize_with(slices.len(), Coverage::default);
        for channel in 0..if own { planes } else { 1 } {
            self.find_domes(slices, channel, (width, height));
            let together = if own { channel..channel + 1 } else { 0..planes };
            let mut extra = Work::default();
            let spent = if channel == 0 { &mut *work } else { &mut extra };
            match parts.shading {
                None => self.flat(parts, slices, frame, together, spent),
                Some(shading) => self.shaded(parts, slices, shading, frame, together, spent),
            }
            work.add_all(EffectName::Dispersion, &extra);
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

    fn shaded(
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
            seen.push(ShadedSlice { end: slice.end, optics, map: slice.instant.shape.map.as_ref() });
        }
        for (y, span) in self.spans.iter_mut().enumerate() {
            let shown = parts.field.row(y);
            *span = span.start.max(shown.start)..span.end.min(shown.end);
        }
        let Some(rays) = parts.field.rays() else { return };
        let at = |k: usize| 0.5 * (low[k].min(high[k]) + high[k]) as f64;
        let surface = ShadedSurface {
            slices: &seen,
            rays,
            shading,
            channels: channels.clone(),
            center: DVec2::new(at(0), at(1)),
            tolerance: parts.tolerance,
        };
        self.lattice.prepare(&surface, &self.spans, work);
        for (dome, slice) in self.domes.iter().zip(slices) {
            for (y, x, part) in dome.rows(width, height).filter(|(y, ..)| slice.rows().contains(y)) {
                let span = self.spans.get(y).cloned().unwrap_or(0..0);
                let part = part.get(span.start.saturating_sub(x)..).unwrap_or_default();
                let levels = self.lattice.row(&surface, y, span.clone(), work);
                for (lane, plane) in frame.planes.iter_mut().enumerate().filter(|(k, _)| channels.contains(k))
                {
                    let Some(row) = plane.get_mut(y * width + span.start..y * width + span.end) else {
                        continue;
                    };
                    for ((value, share), level) in row.iter_mut().zip(part).zip(levels) {
                        *value += share * (level[lane] - *value);
                    }
                }
            }
        }
        for dome in &self.domes {
            work.add_base(dome.area() as u64 * units::PIXEL * channels.len() as u64);
        }
    }

    fn dots(&mut self, parts: Parts<'_>, spots: &Spots, frame: &mut Frame, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        let even = parts.scene.file().ink.reflectance as f32;
        let channels = spots.channels();
        for index in 0..parts.scene.dots().len() {
            let rings = parts.points.rings(index);
            let taken = 1.0 - parts.points.ink(index).unwrap_or(even);
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
        let Parts { scene, shading, .. } = parts;
        let (width, height) = (frame.width(), frame.height());
        let flat = [scene.file().light.marker_level as f32; 3];
        for (index, marker) in scene.markers().iter().enumerate() {
            let level = match shading {
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

    /// A row without sensor: dark where the lens shows nothing.
    fn lay(&self, y: usize, row: &mut [f32]) {
        let seen = self.field.row(y);
        row.fill(0.0);
        row.get_mut(seen).into_iter().for_each(|part| part.fill(self.level));
    }
}
