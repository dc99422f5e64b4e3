//! Dust and scratches before the sensor: flat things that take light on its way into the pupil.
//!
//! A point that is sharp at the distance `s0` sends a cone of light into the pupil of diameter `D`. Where it passes a face
//! at the distance `s` from the pupil the cone is `D |1 - s / s0|` wide. What a thing on that face takes of a pixel's
//! light is the part of the cone that it covers, an area that a disc and its outline share. The pixel itself widens
//! the cone: a disc of the radius `p / sqrt(3)`, `p` being the pixel's width on the face, has a square pixel's variance.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::effect_name::EffectName;
use crate::raster::frame::Frame;
use crate::raster::lens_field::LensField;
use crate::raster::overlap::disc_overlap;
use crate::raster::rolled::Slice;
use crate::work::Work;
use domecast_optics::SensorOptics;
use domecast_optics::camera::Lens;

/// Counted work of a pixel near a thing, and for each of its corners.
pub(crate) const PIXEL_UNITS: u64 = 60;
pub(crate) const CORNER_UNITS: u64 = 12;

/// Points along each side of the box in which a thing is looked for.
const SIDE_POINTS: usize = 8;

/// Pixels around the image of that box: between its points it is curved.
const AROUND_PX: f64 = 2.0;

/// The face that carries a thing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Face {
    /// The sheet's underside, at a height of the sensor frame, mm.
    Sheet(f64),
    /// A plane across the camera's axis, so far before the pupil, mm.
    Lens(f64),
}

/// A thing on a face.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Thing {
    pub face: Face,
    /// Its outline on the face, mm.
    pub outline_mm: Vec<DVec2>,
    /// Both ends of its middle line; a speck's are one.
    pub axis_mm: [DVec2; 2],
    /// No point of it is farther from that line, mm.
    pub reach_mm: f64,
    /// Part of the light that it takes where it covers the whole cone.
    pub opacity: f64,
    /// Level that it shows instead.
    pub level: f64,
}

/// All things, and the camera's focus.
#[derive(Debug, Clone, Default)]
pub struct Specks {
    pub(crate) things: Vec<Thing>,
    /// Diameter of the pupil and distance at which it is sharp, mm; a pupil of 0 is sharp everywhere.
    pub(crate) pupil_mm: f64,
    pub(crate) sharp_mm: f64,
}

/// A face as the camera sees it at one time.
#[derive(Clone, Copy)]
pub(crate) struct FaceView<'a> {
    pub optics: &'a SensorOptics,
    pub face: Face,
}

impl FaceView<'_> {
    /// Where a pixel's ray meets the face, mm, and how far from the pupil.
    pub fn meet(&self, pixel: DVec2) -> Option<(DVec2, f64)> {
        let lens = self.optics.lens();
        let ray = lens.unproject(pixel).ok()?.normalize_or_zero();
        match self.face {
            Face::Lens(distance_mm) => {
                let far = distance_mm / ray.z;
                (ray.z > 1e-3).then(|| ((ray * far).truncate(), far))
            }
            Face::Sheet(z_mm) => {
                let camera = self.optics.sensor_from_camera();
                let shift_mm = lens.pupil_shift_mm(Lens::field_angle_rad(ray)).0;
                let (pupil, way) = (camera.point(DVec3::Z * shift_mm), camera.vector(ray));
                let far = (z_mm - pupil.z) / way.z;
                (way.z > 1e-3 && far > 0.0).then(|| ((pupil + way * far).truncate(), far))
            }
        }
    }

    /// The pixel that sees a place of the face.
    pub fn pixel(&self, place_mm: DVec2) -> Option<DVec2> {
        let lens = self.optics.lens();
        let ray = match self.face {
            Face::Lens(distance_mm) => place_mm.extend(distance_mm),
            Face::Sheet(z_mm) => {
                let camera = self.optics.sensor_from_camera();
                let ray = camera.inverse().point(place_mm.extend(z_mm));
                // The pupil's shift changes the angle hardly at all: one step more than none.
                let shift_mm = lens.pupil_shift_mm(Lens::field_angle_rad(ray)).0;
                ray - DVec3::Z * shift_mm
            }
        };
        lens.project(ray).ok()
    }

    /// Width of a pixel on the face about a place, mm.
    pub fn pixel_mm(&self, pixel: DVec2) -> Option<f64> {
        let at = |dx: f64, dy: f64| self.meet(pixel + DVec2::new(dx, dy)).map(|(place, _)| place);
        let along = at(0.5, 0.0)? - at(-0.5, 0.0)?;
        let down = at(0.0, 0.5)? - at(0.0, -0.5)?;
        Some(along.perp_dot(down).abs().sqrt())
    }
}

impl Specks {
    /// Radius of the cone of a pixel that is `pixel_mm` wide there, at a distance from the pupil, mm.
    pub(crate) fn cone_mm(&self, far_mm: f64, pixel_mm: f64) -> f64 {
        let cone_mm = 0.5 * self.pupil_mm * (1.0 - far_mm / self.sharp_mm).abs();
        (cone_mm * cone_mm + pixel_mm * pixel_mm / 3.0).sqrt()
    }

    /// Lays the things over a picture, of which slices of rows are seen at times of their own.
    pub(crate) fn lay(&self, slices: &[Slice<'_>], field: &LensField, frame: &mut Frame, work: &mut Work) {
        let (width, height) = (frame.width(), frame.height());
        for thing in &self.things {
            for slice in slices {
                let Some(optics) = slice.instant.eye.optics(0) else { continue };
                let view = FaceView { optics, face: thing.face };
                let Some((columns, rows, pixel_mm)) = self.pixels(thing, &view, (width, height)) else {
                    continue;
                };
                let rows = rows.start.max(slice.first)..rows.end.min(slice.end);
                for y in rows {
                    let seen = field.row(y);
                    let columns = columns.start.max(seen.start)..columns.end.min(seen.end);
                    let effort = PIXEL_UNITS + CORNER_UNITS * thing.outline_mm.len() as u64;
                    work.add(EffectName::Dust, columns.len() as u64 * effort);
                    for x in columns {
                        let share = self.taken(thing, &view, DVec2::new(x as f64, y as f64), pixel_mm);
                        if share <= 0.0 {
                            continue;
                        }
                        let (share, level) = (share as f32, thing.level as f32);
                        for value in frame.planes.iter_mut().filter_map(|plane| plane.get_mut(y * width + x))
                        {
                            *value += share * (level - *value);
                        }
                    }
                }
            }
        }
    }

    /// The part of a pixel's light that a thing takes.
    pub(crate) fn taken(&self, thing: &Thing, view: &FaceView<'_>, pixel: DVec2, pixel_mm: f64) -> f64 {
        let Some((place_mm, far_mm)) = view.meet(pixel) else { return 0.0 };
        let radius_mm = self.cone_mm(far_mm, pixel_mm);
        let disc = std::f64::consts::PI * radius_mm * radius_mm;
        let share = thing.opacity * disc_overlap(&thing.outline_mm, place_mm, radius_mm) / disc;
        // What rounding leaves of a thing that is elsewhere is nothing.
        if share > 1e-9 { share.min(thing.opacity) } else { 0.0 }
    }

    /// The columns and rows that a thing may reach, and a pixel's width on its face, mm; `None` where it is not seen.
    fn pixels(
        &self,
        thing: &Thing,
        view: &FaceView<'_>,
        (width, height): (usize, usize),
    ) -> Option<(Range<usize>, Range<usize>, f64)> {
        let (low, high) = thing.extent_mm();
        let middle = view.pixel(0.5 * (low + high))?;
        let pixel_mm = view.pixel_mm(middle)?;
        let (_, far_mm) = view.meet(middle)?;
        // The cone is wider towards the picture's edges, by less than this for things that are seen as one.
        let grown = 1.5 * self.cone_mm(far_mm, pixel_mm)
            + 0.25 * self.pupil_mm * (high - low).length() / self.sharp_mm;
        let (low, high) = (low - grown, high + grown);
        let mut seen_low = DVec2::INFINITY;
        let mut seen_high = DVec2::NEG_INFINITY;
        for k in 0..=SIDE_POINTS {
            let part = k as f64 / SIDE_POINTS as f64;
            let (x, y) = (low.x + (high.x - low.x) * part, low.y + (high.y - low.y) * part);
            for place in
                [DVec2::new(x, low.y), DVec2::new(x, high.y), DVec2::new(low.x, y), DVec2::new(high.x, y)]
            {
                // Where the lens ends, what is seen of the thing may be anywhere.
                let Some(pixel) = view.pixel(place) else { return Some((0..width, 0..height, pixel_mm)) };
                seen_low = seen_low.min(pixel);
                seen_high = seen_high.max(pixel);
            }
        }
        let clear = |value: f64, end: usize| value.clamp(0.0, end as f64) as usize;
        let (low, high) = ((seen_low - AROUND_PX).floor(), (seen_high + AROUND_PX).ceil() + 1.0);
        let columns = clear(low.x, width)..clear(high.x, width);
        let rows = clear(low.y, height)..clear(high.y, height);
        (!columns.is_empty() && !rows.is_empty()).then_some((columns, rows, pixel_mm))
    }

    /// Work of laying the things over a picture seen so, counted as [`Specks::lay`] does but for the lens's edge.
    pub(crate) fn predicted_units(&self, optics: &SensorOptics, size: (usize, usize)) -> u64 {
        let of = |thing: &Thing| {
            let view = FaceView { optics, face: thing.face };
            let (columns, rows, _) = self.pixels(thing, &view, size)?;
            let effort = PIXEL_UNITS + CORNER_UNITS * thing.outline_mm.len() as u64;
            Some((columns.len() * rows.len()) as u64 * effort)
        };
        self.things.iter().filter_map(of).sum()
    }
}

impl Thing {
    /// Lowest and highest place of its outline, mm.
    pub fn extent_mm(&self) -> (DVec2, DVec2) {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        self.outline_mm.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)))
    }

    /// How far its middle line is from another's, mm.
    pub fn apart_mm(&self, other: &Self) -> f64 {
        let to_line = |p: DVec2, [a, b]: [DVec2; 2]| {
            let along = b - a;
            let part = (p - a).dot(along) / along.length_squared();
            let part = if part > 0.0 { part.min(1.0) } else { 0.0 };
            p.distance(a + along * part)
        };
        let ([a, b], [c, d]) = (self.axis_mm, other.axis_mm);
        let side = |p: DVec2, [from, to]: [DVec2; 2]| (to - from).perp_dot(p - from);
        let crosses = side(a, [c, d]) * side(b, [c, d]) < 0.0 && side(c, [a, b]) * side(d, [a, b]) < 0.0;
        let ends = [to_line(a, [c, d]), to_line(b, [c, d]), to_line(c, [a, b]), to_line(d, [a, b])];
        if crosses { 0.0 } else { ends.into_iter().fold(f64::INFINITY, f64::min) }
    }
}
