//! The skin of some frames on a grid that is fixed to the dome.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::thinned::Thinned;
use domecast_optics::numeric::Rigid;
use domecast_optics::{DomeShape, SensorOptics};
use domecast_runtime::overlay::depth_range_mm;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::Tracked;

/// Frames at most that the skin is shown of.
const MAX_SKINS: usize = 60;
/// Rings of the grid from pole to rim, and places on each.
pub(super) const RINGS: usize = 64;
pub(super) const AROUND: usize = 128;
/// Heights are whole numbers of this, mm.
pub(super) const HEIGHT_UNIT_MM: f64 = 0.001;
/// The height of a place that is not seen.
pub(super) const UNSEEN: i16 = i16::MIN;
/// Steps from a place of the dome at rest to the pixel that sees it as it is: heights are small beside the dome.
const STEPS: usize = 4;

/// The skin of one frame; the pole, then ring by ring.
#[derive(Debug, Clone)]
pub(super) struct SkinFrame {
    pub frame: u64,
    /// Depth of the contact, mm; 0 where nothing touches.
    pub depth_mm: f64,
    /// Distance from the dome at rest, in units of [`HEIGHT_UNIT_MM`].
    pub heights: Vec<i16>,
    pub is_touched: Vec<bool>,
}

/// The skins that are kept.
#[derive(Debug)]
pub(super) struct Skins {
    rest: SensorOptics,
    /// Places of the grid on the dome at rest, mm, and their outward normals.
    pub places: Vec<(DVec3, DVec3)>,
    pub frames: Thinned<SkinFrame>,
}

impl Skins {
    pub fn new(rest: &SensorOptics) -> Self {
        let dome = *rest.dome();
        let place = |ring: usize, step: usize| {
            let meridian_rad = dome.meridian_end_rad() * ring as f64 / RINGS as f64;
            let at_mm = dome.point_mm(meridian_rad, TAU * step as f64 / AROUND as f64);
            (at_mm, dome.normal(at_mm))
        };
        let rings = (1..=RINGS).flat_map(|ring| (0..AROUND).map(move |step| (ring, step)));
        let places = std::iter::once((0, 0)).chain(rings).map(|(ring, step)| place(ring, step)).collect();
        Self { rest: rest.clone(), places, frames: Thinned::new(MAX_SKINS) }
    }

    /// Takes a frame in which the shape was found.
    pub fn add(&mut self, tracked: &Tracked, map: &ShapeMap) {
        if map.status.is_none() {
            return;
        }
        // A rigid mount has no pose: its platform is at rest.
        let pose = tracked.pose.unwrap_or_else(Rigid::identity);
        let Ok(optics) = self.rest.at_pose(&pose) else { return };
        let places = &self.places;
        self.frames.offer(|| {
            let seen = |(at_mm, normal): &(DVec3, DVec3)| height_at(map, &optics, *at_mm, *normal);
            let found: Vec<Option<(f64, bool)>> = places.iter().map(seen).collect();
            let whole =
                |height_mm: f64| (height_mm / HEIGHT_UNIT_MM).round().clamp(-32_767.0, 32_767.0) as i16;
            SkinFrame {
                frame: tracked.frame,
                depth_mm: map.contact.as_ref().map_or(0.0, |touch| touch.depth_mm),
                heights: found.iter().map(|place| place.map_or(UNSEEN, |place| whole(place.0))).collect(),
                is_touched: found.iter().map(|place| place.is_some_and(|place| place.1)).collect(),
            }
        });
    }

    /// The end of the colours' scale, the same for all frames, mm.
    pub fn range_mm(&self) -> f64 {
        depth_range_mm(self.frames.kept().iter().map(|frame| frame.depth_mm).fold(0.0, f64::max))
    }

    pub fn dome(&self) -> &DomeShape {
        self.rest.dome()
    }

    /// The deepest of the kept frames.
    pub fn deepest(&self) -> Option<&SkinFrame> {
        // the first of equals
        self.frames.kept().iter().rev().max_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm))
    }
}

/// The triangles of the grid, counter-clockwise from outside.
pub(super) fn triangles() -> Vec<[u32; 3]> {
    let node = |ring: usize, step: usize| match ring {
        0 => 0,
        _ => (1 + (ring - 1) * AROUND + step % AROUND) as u32,
    };
    let mut all = Vec::with_capacity(2 * RINGS * AROUND);
    for ring in 0..RINGS {
        for step in 0..AROUND {
            let [a, b] = [node(ring, step), node(ring, step + 1)];
            let [c, d] = [node(ring + 1, step), node(ring + 1, step + 1)];
            all.push([a, c, d]);
            if ring > 0 {
                all.push([a, d, b]);
            }
        }
    }
    all
}

/// Height of the skin along the normal of a place of the dome, mm, and whether it is touched there.
fn height_at(map: &ShapeMap, optics: &SensorOptics, at_mm: DVec3, normal: DVec3) -> Option<(f64, bool)> {
    let mut height_mm = 0.0;
    let mut is_touched = false;
    for _ in 0..STEPS {
        let pixel = optics.project_deformed(at_mm + normal * height_mm).ok()?;
        (height_mm, is_touched) = between_pixels(map, pixel)?;
    }
    Some((height_mm, is_touched))
}

/// Linear between the four pixels around; `None` where one of them knows nothing.
fn between_pixels(map: &ShapeMap, pixel: DVec2) -> Option<(f64, bool)> {
    let size = DVec2::new(map.width as f64, map.height as f64) - 1.0;
    if !(pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < size.x && pixel.y < size.y) {
        return None;
    }
    let (x, y) = (pixel.x as usize, pixel.y as usize);
    let part = pixel.fract();
    let (mut height_mm, mut touched) = (0.0, 0.0);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share =
            (if dx == 0 { 1.0 - part.x } else { part.x }) * (if dy == 0 { 1.0 - part.y } else { part.y });
        let at = (y + dy) * map.width + x + dx;
        height_mm += share * f64::from(*map.height_mm.get(at)?);
        touched += if *map.is_touched.get(at)? { share } else { 0.0 };
    }
    height_mm.is_finite().then_some((height_mm, touched > 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_is_closed_but_for_its_rim() {
        let mut edges = std::collections::HashMap::new();
        for [a, b, c] in triangles() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                assert!(edges.insert((from, to), ()).is_none(), "an edge twice the same way");
            }
        }
        let rim = edges.keys().filter(|(from, to)| !edges.contains_key(&(*to, *from))).count();
        assert_eq!(rim, AROUND);
    }
}
