//! The picture of one instant: membrane, dots and markers in linear light.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::coverage::{Coverage, clip_to_image};
use super::effect::EffectName;
use super::frame::Frame;
use super::instant::{Instant, Points, units};
use super::pipeline::Pipeline;
use super::scene::Scene;
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
}

/// Draws instants of a scene.
#[derive(Debug, Clone)]
pub struct Painter {
    field: LensField,
    coverage: Coverage,
}

impl Painter {
    /// A painter for pictures of the scene's size through a lens.
    pub fn new(scene: &Scene, lens: &Lens) -> Self {
        let (width, height) = scene.image_size();
        Self { field: LensField::new(lens, width, height), coverage: Coverage::default() }
    }

    /// Draws some rows of an instant over what is there.
    pub fn draw(
        &mut self,
        parts: Parts<'_>,
        instant: &Instant,
        rows: Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        self.ground(parts.scene, instant, &rows, frame, work);
        if parts.pipeline.ink.dots {
            self.dots(parts, instant, &rows, frame, work);
        }
        self.markers(parts, instant, &rows, frame, work);
    }

    /// Surround and membrane.
    fn ground(
        &mut self,
        scene: &Scene,
        instant: &Instant,
        rows: &Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        let light = &scene.file().light;
        let (surround, membrane) = (light.surround_level as f32, light.membrane_level as f32);
        let (width, height) = (frame.width(), frame.height());
        let channels = instant.eye.channels();
        for (channel, plane) in frame.planes.iter_mut().enumerate() {
            for (y, row) in plane.chunks_exact_mut(width).enumerate().skip(rows.start).take(rows.len()) {
                row.fill(0.0);
                if let Some(seen) = row.get_mut(self.field.row(y)) {
                    seen.fill(surround);
                }
            }
            // Colours with the same rays have the same rim.
            if channel < channels || channel == 0 {
                let Some(optics) = instant.eye.optics(channel) else { continue };
                self.coverage.fill(&clip_to_image(&rim_polygon(optics), width, height));
            }
            for (y, x, part) in self.coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
                let field = self.field.row(y);
                let Some(row) = plane.get_mut(y * width..(y + 1) * width) else { continue };
                for (place, share) in row.iter_mut().enumerate().skip(x).zip(part) {
                    let (column, value) = place;
                    if field.contains(&column) {
                        *value += share * (membrane - surround);
                    }
                }
            }
            work.add_base((rows.len() * width) as u64 * units::PIXEL);
        }
    }

    fn dots(
        &mut self,
        parts: Parts<'_>,
        instant: &Instant,
        rows: &Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        let Parts { scene, points, .. } = parts;
        let (width, height) = (frame.width(), frame.height());
        let taken = 1.0 - scene.file().ink.reflectance as f32;
        let channels = instant.eye.channels();
        for index in 0..scene.dots().len() {
            for (channel, plane) in frame.planes.iter_mut().enumerate() {
                if channel < channels {
                    self.coverage.fill(&[]);
                    if let Some(spot) = points.dot(scene, instant, channel, index) {
                        self.coverage.fill(&spot.polygon);
                        let effort = spot.polygon.len() as u64 * units::CORNER
                            + self.coverage.area() as u64 * units::PIXEL;
                        let owner = if channel == 0 { EffectName::Dots } else { EffectName::Dispersion };
                        work.add(owner, effort);
                    }
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
        instant: &Instant,
        rows: &Range<usize>,
        frame: &mut Frame,
        work: &mut Work,
    ) {
        let Parts { scene, pipeline, points } = parts;
        let (width, height) = (frame.width(), frame.height());
        let channels = instant.eye.channels();
        let flat = [scene.file().light.marker_level as f32; 3];
        for (index, marker) in scene.markers().iter().enumerate() {
            let level = match &pipeline.shading {
                Some(shading) => shading.marker_level(scene, marker.position_mm),
                None => flat,
            };
            for (channel, plane) in frame.planes.iter_mut().enumerate() {
                if channel < channels {
                    self.coverage.fill(&[]);
                    if let Some(spot) = points.marker(scene, instant, channel, index) {
                        self.coverage.fill(&spot.polygon);
                        work.add_base(
                            spot.polygon.len() as u64 * units::CORNER
                                + self.coverage.area() as u64 * units::PIXEL,
                        );
                    }
                }
                let level = level[channel.min(2)];
                for (y, x, part) in self.coverage.rows(width, height).filter(|(y, ..)| rows.contains(y)) {
                    let start = y * width + x;
                    let Some(row) = plane.get_mut(start..start + part.len()) else { continue };
                    for (value, share) in row.iter_mut().zip(part) {
                        *value += share * (level - *value);
                    }
                }
            }
        }
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
