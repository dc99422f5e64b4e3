//! The picture of one instant: membrane, dots and markers in linear light.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::coverage::{Coverage, clip_to_image};
use super::effect::EffectName;
use super::frame::Frame;
use super::instant::{Instant, units};
use super::lit::{Lit, LitSurface, PixelBox};
use super::pipeline::Pipeline;
use super::scene::Scene;
use super::shading::Shading;
use super::spots::{Points, Spots};
use super::work::Work;
use crate::camera::Lens;
use crate::optics::SensorOptics;

/// Points at which the dome's rim is projected; a circle of 200 px is then met within 0.06 px, and its
/// polygon is refined by [`RIM_BETWEEN`].
const RIM_AZIMUTHS: usize = 64;

/// Corners between two of them, on a cubic through the neighbours.
const RIM_BETWEEN: usize = 6;

/// The columns of each row that the lens shows: outside there is no light.
#[derive(Debug, Clone)]
pub struct LensField {
    rows: Vec<Range<usize>>,
}

impl LensField {
    /// From the lens; the field is taken to be one piece in each row.
    pub fn new(lens: &Lens, width: usize, height: usize) -> Self {
        let sees = |x: usize, y: usize| lens.unproject(DVec2::new(x as f64, y as f64)).is_ok();
        let [[_, _, cx], _, _] = lens.spec().matrix;
        let middle = (cx.round().max(0.0) as usize).min(width.saturating_sub(1));
        let row = |y: usize| {
            if !sees(middle, y) {
                return 0..0;
            }
            // Nearest to the edge that is still seen, on each side.
            let edge = |mut inside: usize, mut outside: usize| {
                if sees(outside, y) {
                    return outside;
                }
                while inside.abs_diff(outside) > 1 {
                    let half = inside.midpoint(outside);
                    if sees(half, y) { inside = half } else { outside = half }
                }
                inside
            };
            edge(middle, 0)..edge(middle, width - 1) + 1
        };
        Self { rows: (0..height).map(row).collect() }
    }

    /// The columns of a row.
    pub fn row(&self, y: usize) -> Range<usize> {
        self.rows.get(y).cloned().unwrap_or(0..0)
    }
}

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
        let surround = parts.scene.file().light.surround_level as f32;
        let (width, height) = (frame.width(), frame.height());
        for plane in &mut frame.planes {
            for (y, row) in plane.chunks_exact_mut(width).enumerate().skip(rows.start).take(rows.len()) {
                row.fill(0.0);
                if let Some(seen) = row.get_mut(parts.field.row(y)) {
                    seen.fill(surround);
                }
            }
            work.add_base((rows.len() * width) as u64 * units::PIXEL);
        }
        // Channels with rays of their own are drawn one by one, the others together.
        let planes = frame.planes.len();
        let own = instant.eye.channels() == planes;
        for channel in 0..if own { planes } else { 1 } {
            let Some(optics) = instant.eye.optics(channel) else { continue };
            self.coverage.fill(&clip_to_image(&rim_polygon(optics), width, height));
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
        let within = PixelBox { left, top: top.max(rows.start), right, bottom: bottom.min(rows.end) };
        let surface = LitSurface {
            optics,
            dent: instant.dent.as_ref(),
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
            self.three.fill(&surface, (width, height), within, pressed, work);
            blend(&self.three, &self.coverage, parts.field, center, rows, frame, channels.start);
        } else {
            self.one.fill(&surface, (width, height), within, pressed, work);
            blend(&self.one, &self.coverage, parts.field, center, rows, frame, channels.start);
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

/// How far the middle of a square may be from what its corners promise, grey levels: what is left between the
/// nodes, of the third order, is then a fraction of a level.
const SMOOTH_GREY: f64 = 1.0;
/// Level at which the code's slope is taken for that.
const DARK_LEVEL: f64 = 0.05;
/// Room around the pressed part in which the membrane still bends sharply, mm.
const PRESSED_MARGIN_MM: f64 = 0.6;

/// The columns of a row of coverage that the lens shows, and their coverage.
fn inside(field: Range<usize>, x: usize, part: &[f32]) -> (Range<usize>, &[f32]) {
    let start = x.max(field.start).min(x + part.len());
    let end = (x + part.len()).min(field.end).max(start);
    (start..end, part.get(start - x..end - x).unwrap_or(&[]))
}

/// Lays the lit membrane over the ground.
fn blend<const N: usize>(
    lit: &Lit<N>,
    coverage: &Coverage,
    field: &LensField,
    center: DVec2,
    rows: &Range<usize>,
    frame: &mut Frame,
    first: usize,
) {
    let (width, height) = (frame.width(), frame.height());
    for (y, x, part) in coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
        let (seen, part) = inside(field.row(y), x, part);
        for (lane, plane) in frame.planes.iter_mut().skip(first).take(N).enumerate() {
            let Some(values) = plane.get_mut(y * width + seen.start..y * width + seen.end) else { continue };
            for ((value, share), column) in values.iter_mut().zip(part).zip(seen.clone()) {
                if *share > 0.0 {
                    let level = lit.level(column, y, center)[lane];
                    *value += share * (level - *value);
                }
            }
        }
    }
}

/// Box of the pixels that may show a cap of the dome.
fn cap_box(optics: &SensorOptics, middle: DVec3, angle_rad: f64, width: usize, height: usize) -> PixelBox {
    const AZIMUTHS: u32 = 16;
    /// The polygon through the azimuths lies inside the cap's outline, and the dent moves it.
    const MARGIN_PX: f64 = 6.0;
    let side = middle.any_orthonormal_vector();
    let up = middle.cross(side);
    let (sin, cos) = angle_rad.min(std::f64::consts::FRAC_PI_2).sin_cos();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for k in 0..AZIMUTHS {
        let turn = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(AZIMUTHS));
        let mut at = (middle * cos + (side * turn.x + up * turn.y) * sin) * optics.dome_radius_mm();
        at.z = at.z.max(0.0);
        let Ok(pixel) = optics.project_deformed(at) else {
            return PixelBox { left: 0, top: 0, right: width, bottom: height };
        };
        low = low.min(pixel);
        high = high.max(pixel);
    }
    let whole = |value: f64, most: usize| (value.max(0.0) as usize).min(most);
    PixelBox {
        left: whole(low.x - MARGIN_PX, width),
        top: whole(low.y - MARGIN_PX, height),
        right: whole(high.x + MARGIN_PX + 1.0, width),
        bottom: whole(high.y + MARGIN_PX + 1.0, height),
    }
}

/// The dome's rim in the image, px. Where the lens does not see it, the polygon runs outside the lens's field.
fn rim_polygon(optics: &SensorOptics) -> Vec<DVec2> {
    let radius = optics.dome_radius_mm();
    let lens = optics.lens();
    let [[_, _, cx], [_, _, cy], _] = lens.spec().matrix;
    let center = DVec2::new(cx, cy);
    let camera_from_sensor = optics.sensor_from_camera().inverse();
    let place = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / RIM_AZIMUTHS as f64).sin_cos();
        let point = DVec3::new(radius * cos, radius * sin, 0.0);
        optics.project(point).unwrap_or_else(|_| {
            let aside = camera_from_sensor.point(point).truncate().normalize_or_zero();
            center + aside * (1.5 * lens.max_radius_px())
        })
    };
    let coarse: Vec<DVec2> = (0..RIM_AZIMUTHS).map(place).collect();
    let at = |k: usize| coarse[k % RIM_AZIMUTHS];
    let mut polygon = Vec::with_capacity(RIM_AZIMUTHS * RIM_BETWEEN);
    for k in 0..RIM_AZIMUTHS {
        let (a, b, c, d) = (at(k + RIM_AZIMUTHS - 1), at(k), at(k + 1), at(k + 2));
        for step in 0..RIM_BETWEEN {
            let t = step as f64 / RIM_BETWEEN as f64;
            // Lagrange's cubic through the four.
            let (p, q, r) = (t + 1.0, t - 1.0, t - 2.0);
            polygon.push(
                a * (-t * q * r / 6.0)
                    + b * (p * q * r / 2.0)
                    + c * (-p * t * r / 2.0)
                    + d * (p * t * q / 6.0),
            );
        }
    }
    polygon
}
