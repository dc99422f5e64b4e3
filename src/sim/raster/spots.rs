//! Where dots and markers appear: centres, outlines as drawn, centroids.

use glam::{DVec2, DVec3};

use crate::effect_name::EffectName;
use crate::light::random_field::PLACE_UNITS;
use crate::raster::coverage::{area_moment, clip, clip_to_image};
use crate::raster::outline::RimFit;
use crate::raster::printed::printed_dots;
use crate::raster::projector::{Apparent, Projector};
use crate::raster::sensor_state::{SensorState, units};
use crate::raster::settings::{Geometry, Ink};
use crate::scene::{RIM_POINTS, Scene, SceneDot};
use crate::work::Work;

/// A centre and its outline.
pub(crate) type Followed<T> = [T; RIM_POINTS + 1];

/// Rings of the ink's soft edge, each with an equal share of the ink.
const EDGE_RINGS: u32 = 6;

/// The fixed points whose images are followed: each dot's, then each marker's centre and outline.
#[derive(Debug, Clone)]
pub struct Points {
    fit: RimFit,
    items: Vec<Followed<DVec3>>,
    dots: usize,
    /// By channel, then item: apparent places at rest. Empty where the bend is solved in each frame.
    apparent: Vec<Vec<Followed<Option<Apparent>>>>,
    /// Scales of the nested outlines that make up the soft edge, by dot; one outline, of scale 1, without it.
    rings: Vec<Vec<f64>>,
    /// Reflectance of the ink by dot; empty where all are alike.
    inks: Vec<f32>,
}

/// The image of a dot or marker in one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Image of its centre, px.
    pub center_px: DVec2,
    /// Its outline, px; it may reach beyond the picture.
    pub polygon: Vec<DVec2>,
    /// Area inside the picture, px^2.
    pub area_px2: f64,
    /// Centroid of what is inside the picture.
    pub centroid_px: DVec2,
}

impl Spot {
    /// Its first and last row, px.
    pub fn rows(&self) -> (f64, f64) {
        let rows = self.polygon.iter().map(|p| p.y);
        rows.fold((self.center_px.y, self.center_px.y), |(low, high), y| (low.min(y), high.max(y)))
    }
}

/// All images of an instant: by item (dots, then markers), then channel.
#[derive(Debug, Clone, Default)]
pub struct Spots {
    channels: usize,
    dots: usize,
    spots: Vec<Option<Spot>>,
    /// Centres of the dots on the deformed dome, sensor frame, mm.
    pub surface_mm: Vec<DVec3>,
}

impl Spots {
    /// The image of a dot.
    pub fn dot(&self, index: usize, channel: usize) -> Option<&Spot> {
        self.spots.get(index * self.channels + channel)?.as_ref()
    }

    /// The image of a marker.
    pub fn marker(&self, index: usize, channel: usize) -> Option<&Spot> {
        self.dot(self.dots + index, channel)
    }

    /// Channels that have images of their own.
    pub fn channels(&self) -> usize {
        self.channels
    }
}

impl Points {
    /// The points of a scene; where the geometry does not solve the bend in each frame, the apparent places are
    /// found here, once.
    pub fn new(
        scene: &Scene,
        (geometry, ink): (Geometry, Ink),
        eye: &Projector,
        edge_tolerance_px: f64,
        work: &mut Work,
    ) -> Self {
        let with_center = |center: DVec3, rim: [DVec3; RIM_POINTS]| -> Followed<DVec3> {
            std::array::from_fn(|k| k.checked_sub(1).map_or(center, |k| rim[k]))
        };
        let printed = if ink.uneven { printed_dots(scene) } else { Vec::new() };
        work.add(EffectName::UnevenInk, printed.len() as u64 * PLACE_UNITS);
        let dot_points = |(index, dot): (usize, &SceneDot)| {
            let scale = printed.get(index).map_or(1.0, |printed| printed.scale);
            let rim = dot.rim_mm.map(|place| scaled_on_dome(dot.center_mm, place, scale));
            with_center(dot.center_mm, rim)
        };
        let mut items: Vec<_> = scene.dots().iter().enumerate().map(dot_points).collect();
        for marker in scene.markers() {
            let rim = std::array::from_fn(|k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / RIM_POINTS as f64).sin_cos();
                marker.position_mm + DVec3::new(cos, sin, 0.0) * (0.5 * marker.diameter_mm)
            });
            items.push(with_center(marker.position_mm, rim));
        }
        let widths = scene.layout().dots.iter().map(|dot| 0.5 * dot.image_outline.widths().1);
        let mut apparent = Vec::new();
        if !geometry.solves() {
            for channel in 0..eye.channels() {
                apparent
                    .push(items.iter().map(|points| points.map(|p| eye.apparent(channel, p).ok())).collect());
            }
            let count = items.len() * (RIM_POINTS + 1) * eye.channels();
            work.add(EffectName::Refraction, count as u64 * units::BEND);
        }
        let edge_mm = scene.file().ink.edge_mm;
        let rings = scene.layout().dots.iter().enumerate().map(|(index, dot)| {
            if !ink.soft_edge {
                return vec![1.0];
            }
            // The ink's edge is as wide on a smaller dot.
            let scale = printed.get(index).map_or(1.0, |printed| printed.scale);
            let half = (edge_mm / (dot.diameter_mm * scale)).min(1.0);
            let ring = |k: u32| 1.0 + half * ((f64::from(k) + 0.5) * 2.0 / f64::from(EDGE_RINGS) - 1.0);
            (0..EDGE_RINGS).map(ring).collect()
        });
        Self {
            fit: RimFit::new(widths.fold(1.0, f64::max), edge_tolerance_px),
            dots: scene.dots().len(),
            rings: rings.collect(),
            inks: printed.iter().map(|printed| printed.reflectance as f32).collect(),
            items,
            apparent,
        }
    }

    /// Number of followed points.
    pub fn count(scene: &Scene) -> u64 {
        ((scene.dots().len() + scene.markers().len()) * (RIM_POINTS + 1)) as u64
    }

    /// Reflectance of a dot's ink, where dots differ.
    pub fn ink(&self, dot: usize) -> Option<f32> {
        self.inks.get(dot).copied()
    }

    /// Scales of a dot's nested outlines, each with an equal share of its ink.
    pub fn rings(&self, dot: usize) -> &[f64] {
        self.rings.get(dot).map_or(&[1.0], Vec::as_slice)
    }

    /// All images at an instant.
    pub fn see(&self, scene: &Scene, instant: &SensorState) -> Spots {
        let moved = self.moved(instant);
        let items = moved.as_ref().unwrap_or(&self.items);
        let deformed = moved.is_some();
        let surface_mm = items.iter().take(self.dots).map(|points| points[0]).collect();
        self.gather(scene, instant.eye.channels(), surface_mm, &mut |item, channel, k| {
            self.pixel(instant, channel, item, items.get(item)?, k, deformed)
        })
    }

    /// Images made of the pixels of followed points, which `pixel` tells by item, channel and number of the point.
    pub(crate) fn gather(
        &self,
        scene: &Scene,
        channels: usize,
        surface_mm: Vec<DVec3>,
        pixel: &mut dyn FnMut(usize, usize, usize) -> Option<DVec2>,
    ) -> Spots {
        let mut spots = Vec::with_capacity(self.items.len() * channels);
        for item in 0..self.items.len() {
            for channel in 0..channels {
                spots.push(self.spot(scene, item, &mut |k| pixel(item, channel, k)));
            }
        }
        Spots { channels, dots: self.dots, spots, surface_mm }
    }

    /// Only the images of the centres, in the reference channel.
    pub fn centers(&self, instant: &SensorState, reference: usize) -> Vec<Option<DVec2>> {
        let moved = self.moved(instant);
        let items = moved.as_ref().unwrap_or(&self.items);
        let see = |(item, points)| self.pixel(instant, reference, item, points, 0, moved.is_some());
        items.iter().enumerate().map(see).collect()
    }

    /// The followed points of the dots on the undeformed dome, mm.
    pub fn on_dome_mm(&self) -> Vec<DVec3> {
        self.items.iter().take(self.dots).flatten().copied().collect()
    }

    /// The followed points at rest.
    pub(crate) fn items(&self) -> &[Followed<DVec3>] {
        &self.items
    }

    /// The points on the deformed dome; `None` where it is not. Markers stay on the sheet.
    pub(crate) fn moved(&self, instant: &SensorState) -> Option<Vec<Followed<DVec3>>> {
        let between = instant.shape.touch.as_ref().filter(|between| between.is_deformed())?;
        let worked_out;
        let displaced = match &instant.shape.displaced_mm {
            Some(known) => known,
            None => {
                worked_out = between.displacements_mm(&self.on_dome_mm());
                &worked_out
            }
        };
        let mut items = self.items.clone();
        for (point, u) in items.iter_mut().flatten().zip(displaced) {
            *point += *u;
        }
        Some(items)
    }

    /// The pixel of a followed point, 0 the centre.
    pub(crate) fn pixel(
        &self,
        instant: &SensorState,
        channel: usize,
        item: usize,
        points: &Followed<DVec3>,
        k: usize,
        deformed: bool,
    ) -> Option<DVec2> {
        match self.apparent.get(channel).and_then(|items| items.get(item)) {
            Some(apparent) => instant.eye.project_apparent(channel, &apparent[k]?).ok(),
            None if deformed && item < self.dots => instant.eye.project_deformed(channel, points[k]).ok(),
            None => instant.eye.project(channel, points[k]).ok(),
        }
    }

    fn spot(
        &self,
        scene: &Scene,
        item: usize,
        pixel: &mut dyn FnMut(usize) -> Option<DVec2>,
    ) -> Option<Spot> {
        let center_px = pixel(0)?;
        let mut rim = [DVec2::ZERO; RIM_POINTS];
        let mut seen = 0;
        for (k, place) in rim.iter_mut().enumerate() {
            // At the end of the lens's domain only a part of the outline is seen: what is not stays at the centre.
            *place = center_px;
            if let Some(pixel) = pixel(k + 1) {
                *place = pixel;
                seen += 1;
            }
        }
        let mut polygon = Vec::new();
        if seen == RIM_POINTS {
            self.fit.polygon(&rim, &mut polygon);
        } else {
            polygon.extend(rim);
        }
        if let Some((left, angle)) = scene.dots().get(item).and_then(|dot| dot.cut) {
            polygon = cut_off(&rim, center_px, &polygon, left, angle);
        }
        let size = scene.image_size();
        let (mut area, mut moment) = (0.0, DVec2::ZERO);
        let rings: &[f64] = if item < self.dots { self.rings(item) } else { &[1.0] };
        for scale in rings {
            let (one, first) = if *scale == 1.0 {
                seen_area(&polygon, size)
            } else {
                let ring: Vec<DVec2> =
                    polygon.iter().map(|p| center_px + (*p - center_px) * *scale).collect();
                seen_area(&ring, size)
            };
            area += one / rings.len() as f64;
            moment += first / rings.len() as f64;
        }
        let centroid_px = if area > 1e-9 { moment / area } else { center_px };
        Some(Spot { center_px, polygon, area_px2: area, centroid_px })
    }
}

/// A point of a dot's outline where the dot is larger by a factor.
fn scaled_on_dome(center_mm: DVec3, place_mm: DVec3, scale: f64) -> DVec3 {
    if scale == 1.0 {
        return place_mm;
    }
    (center_mm + (place_mm - center_mm) * scale).normalize_or_zero() * place_mm.length()
}

/// Area of a polygon inside a picture, positive, and its first moment.
fn seen_area(polygon: &[DVec2], (width, height): (usize, usize)) -> (f64, DVec2) {
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    let inside = |p: &DVec2| p.x >= -0.5 && p.y >= -0.5 && p.x <= right && p.y <= bottom;
    let (area, moment) = if polygon.iter().all(inside) {
        area_moment(polygon)
    } else {
        area_moment(&clip_to_image(polygon, width, height))
    };
    if area < 0.0 { (-area, -moment) } else { (area, moment) }
}

/// What a straight cut leaves of a dot: `left` of its width along the direction of the outline's angle.
fn cut_off(rim: &[DVec2; RIM_POINTS], center: DVec2, polygon: &[DVec2], left: f64, angle: f64) -> Vec<DVec2> {
    if left >= 1.0 {
        return polygon.to_vec();
    }
    if left <= 0.0 {
        return Vec::new();
    }
    // The outline's angle turns with the dot: the first point and the one a quarter further span it.
    let (sin, cos) = angle.sin_cos();
    let across = ((rim[0] - rim[RIM_POINTS / 2]) * cos
        + (rim[RIM_POINTS / 4] - rim[3 * RIM_POINTS / 4]) * sin)
        .normalize_or_zero();
    let reach = polygon.iter().map(|p| across.dot(*p - center));
    let (low, high) = reach.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)));
    clip(polygon, across, across.dot(center) + low + left * (high - low))
}
