//! What lets the rays of the image pass where a part stands in them.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::assembly::affine;
use super::error::Cure;
use super::image_rays::{Blocker, CHORD_MM, ImageRays, ends, group_of};
use super::{Measures, Pose};
use crate::spec::Design;
use crate::spec::sections::SpringPlaces;

/// Looks for the change that frees the rays from a kind of part.
pub(super) struct Remedy<'a> {
    pub m: &'a Measures,
    pub design: &'a Design,
    /// The kind of part, and the one of it that blocks first.
    pub group: &'a str,
    pub part: &'a str,
}

/// A position, its rays, and its springs.
pub(super) type Seen<'a> = (&'a Pose, ImageRays, Vec<Blocker>);

impl Remedy<'_> {
    pub(super) fn find(&self, seen: &[Seen<'_>], fixed: &[Blocker]) -> Cure {
        let s = self.design.sections();
        let number = self.part.rsplit(' ').next().and_then(|n| n.parse::<usize>().ok()).unwrap_or(0);
        // Beyond what the meshes say, for the pose changes a little with the change.
        let away = |seen: &[Seen<'_>]| 1.01 * self.needed_mm(seen, fixed) + self.m.chord.tolerance_mm();
        match self.group {
            "spring" | "upper magnet" | "lower magnet" => match &s.springs.places {
                SpringPlaces::Ring(ring) => {
                    let to = ring.radius_mm + away(seen);
                    Cure::length("springs.places.ring.radius_mm", ring.radius_mm, to)
                }
                SpringPlaces::Listed(list) => {
                    let at = list.get(number).map_or(DVec2::ZERO, |at| DVec2::from_array(*at));
                    let to = at + at.normalize_or(DVec2::X) * away(seen);
                    Cure::value(format!("springs.places.listed[{number}]"), outwards(at, to))
                }
            },
            "LED" | "LED board" => {
                let from = s.leds.center_radius_mm;
                Cure::length("leds.center_radius_mm", from, from + away(seen))
            }
            "mounting screw" => {
                let list = &s.platforms.lower.mounting.at_mm;
                let at = list.get(number).map_or(DVec2::ZERO, |at| DVec2::from_array(*at));
                let to = at + at.normalize_or(DVec2::X) * away(seen);
                Cure::value(format!("platforms.lower.mounting.at_mm[{number}]"), outwards(at, to))
            }
            "camera" => {
                let from = s.camera_body.lens_diameter_mm;
                Cure::length("camera_body.lens_diameter_mm", from, self.lens_mm(seen).max(from))
            }
            _ => {
                let from = s.platforms.window_margin_mm;
                Cure::length("platforms.window_margin_mm", from, from + away(seen))
            }
        }
    }

    /// How far outwards all of the group must go until no ray meets it, mm: by bisection.
    fn needed_mm(&self, seen: &[Seen<'_>], fixed: &[Blocker]) -> f64 {
        let is_free = |by_mm: f64| {
            seen.par_iter().all(|(pose, rays, springs)| {
                let rest_from_platform = affine(&pose.rest_from_platform);
                let group = || fixed.iter().chain(springs).filter(|b| group_of(&b.name) == self.group);
                rays.list.iter().all(|ray| {
                    group().all(|blocker| {
                        let (from, to) = ends(blocker, &ray.line, &rest_from_platform);
                        let (from, to) = self.moved(blocker, from, to, by_mm);
                        !blocker.target.is_hit(from, to)
                    })
                })
            })
        };
        let far = 4.0 * self.m.outer_mm.max_element();
        let (mut low, mut high) = (0.0, far);
        if !is_free(high) {
            return far;
        }
        for _ in 0..16 {
            let middle = 0.5 * (low + high);
            if is_free(middle) { high = middle } else { low = middle }
        }
        high
    }

    /// The ray as the part sees it after it went outwards: single parts along their own radius; platforms open by as
    /// much all round, which for a ray is to end so much nearer to the axis.
    fn moved(&self, blocker: &Blocker, from: DVec3, to: DVec3, by_mm: f64) -> (DVec3, DVec3) {
        let number = blocker.name.rsplit(' ').next().and_then(|n| n.parse::<usize>().ok());
        let at = number.and_then(|i| match self.group {
            "LED" | "LED board" => Some(self.m.platform_from_led(i).translation.truncate()),
            "mounting screw" => self.m.platforms.lower.mounting.at_mm.get(i).map(|at| DVec2::from_array(*at)),
            _ => self.m.spring_axes_mm.get(i).copied(),
        });
        match at {
            Some(at) => {
                let shift = (at.normalize_or(DVec2::X) * by_mm).extend(0.0);
                (from - shift, to - shift)
            }
            None => {
                let flat = to.truncate() - from.truncate();
                let shorter = flat.normalize_or_zero() * by_mm.min(flat.length());
                (from, to - shorter.extend(0.0))
            }
        }
    }

    /// Diameter of the front glass that all rays pass, mm.
    fn lens_mm(&self, seen: &[Seen<'_>]) -> f64 {
        let camera_from_sensor = self.m.sensor_from_camera.inverse();
        let front = self.m.camera_body.front_from_pupil_mm;
        let lines =
            seen.iter().flat_map(|(pose, rays, _)| rays.list.iter().map(move |ray| (pose, &ray.line)));
        let radius = lines
            .map(|(pose, line)| {
                let to_camera = camera_from_sensor * affine(&pose.rest_from_platform);
                let (from, to) =
                    (to_camera.transform_point3(line.pupil_mm), to_camera.transform_point3(line.sheet_mm));
                from.lerp(to, ((front - from.z) / (to.z - from.z)).clamp(0.0, 1.0)).truncate().length()
            })
            .fold(0.0, f64::max);
        2.0 * radius + 4.0 * self.m.chord.tolerance_mm().max(CHORD_MM)
    }
}

/// A point rounded to 0.01 mm away from the axis.
fn outwards(from: DVec2, to: DVec2) -> serde_json::Value {
    let round = |from: f64, to: f64| {
        let steps = 100.0 * to;
        (if to >= from { (steps - 1e-6).ceil() } else { (steps + 1e-6).floor() }) / 100.0
    };
    serde_json::json!([round(from.x, to.x), round(from.y, to.y)])
}
