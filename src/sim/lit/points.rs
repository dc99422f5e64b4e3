//! What single pixels of the lit membrane show: their rays, where these meet the membrane, and the light there.

use glam::{DVec2, DVec3, Vec3A};

use super::motion::{Motion, Source};
use super::{Known, LARGEST, Lit, LitSlice, LitSurface, units};
use crate::optics::SensorOptics;
use crate::sim::effect::EffectName;
use crate::sim::shading::{Moved, SurfaceSample};
use crate::sim::work::Work;

/// Rays are traced and lit this many at a time.
const BATCH: usize = 512;
/// Squares that reach further than this beyond the lens's field are all outside it, px.
const BEYOND_PX: f64 = 4.0 * LARGEST as f64;
/// What moves by less is not dented, mm.
const STILL_MM: f64 = 1e-6;

impl<const N: usize> Lit<N> {
    /// Traces and lights those of some pixels of a square that are not known yet; the square lies in the largest one
    /// at `corner`.
    pub(super) fn ask(
        &mut self,
        surface: &LitSurface<'_>,
        corner: (usize, usize),
        pixels: impl IntoIterator<Item = (usize, usize)>,
        work: &mut Work,
    ) {
        for (x, y) in pixels {
            let at = y * self.width + x;
            if self.known.get(at) != Some(&Known::Nothing) {
                continue;
            }
            let Some(seen) = surface.at(y) else { continue };
            let ray = surface.rays.and_then(|rays| rays.at(x, y));
            let pixel = DVec2::new(x as f64, y as f64);
            let hit = match ray {
                Some(ray) => seen.optics.follow_continued(ray),
                None => seen.optics.trace_continued(pixel),
            };
            let rays = match hit {
                Ok(hit) => [Some((hit, 1.0)), None],
                Err(_) => continued(seen.optics, pixel),
            };
            let mut known = Known::Misses;
            for ((surface_mm, inside), weight) in rays.into_iter().flatten() {
                self.places.push((at, weight));
                let sample = self.sample((surface, seen), (surface_mm, inside), corner, (x, y), work);
                known = Known::Lit;
                self.samples.push(sample);
            }
            if known == Known::Misses {
                // The rim is bonded, and what is beyond it does not move.
                if let Some(motion) = self.kept_at((x, y)).and_then(|at| self.motions.get_mut(at)) {
                    *motion = Motion::default();
                }
            } else {
                self.levels.iter_mut().filter_map(|levels| levels.get_mut(at)).for_each(|level| *level = 0.0);
            }
            if let Some(place) = self.known.get_mut(at) {
                *place = known;
            }
            if self.samples.len() >= BATCH {
                self.light(surface, work);
            }
        }
    }

    /// Lights what was traced.
    pub(super) fn light(&mut self, surface: &LitSurface<'_>, work: &mut Work) {
        self.answers.clear();
        self.answers.resize(self.samples.len(), [0.0; 3]);
        surface.shading.levels(&self.samples, &mut self.answers, work);
        work.add_base(self.samples.len() as u64 * units::RAY);
        for ((at, weight), answer) in self.places.iter().zip(&self.answers) {
            for (lane, levels) in self.levels.iter_mut().enumerate() {
                if let Some(level) = levels.get_mut(*at) {
                    *level += weight * answer[(surface.channel + lane).min(2)];
                }
            }
        }
        self.samples.clear();
        self.places.clear();
    }

    /// What a ray that meets the undeformed dome shows.
    fn sample(
        &mut self,
        (surface, seen): (&LitSurface<'_>, &LitSlice<'_>),
        (surface_mm, inside): (DVec3, DVec3),
        corner: (usize, usize),
        (x, y): (usize, usize),
        work: &mut Work,
    ) -> SurfaceSample {
        let per_radius = 1.0 / seen.optics.dome_radius_mm();
        let still = SurfaceSample {
            point_mm: surface_mm,
            normal: surface_mm * per_radius,
            to_camera: -inside,
            moved: Moved::Not,
        };
        let kept = self.kept_at((x, y));
        if let Some(motion) = kept.and_then(|at| self.motions.get_mut(at)) {
            let cosine = inside.dot(still.normal).abs();
            *motion = Motion {
                place_mm: surface_mm.as_vec3a(),
                slant: ((1.0 - cosine * cosine).max(0.0).sqrt() / cosine.max(1e-3)) as f32,
                ..Motion::default()
            };
        }
        let Some(dent) = seen.dent else { return still };
        match self.source(corner) {
            Source::Still => return still,
            source @ (Source::Smooth | Source::Little) => {
                work.add(EffectName::Contact, units::SMOOTH);
                let motion = self.motion(corner, (x - corner.0, y - corner.1));
                let little = source == Source::Little;
                return SurfaceSample {
                    point_mm: surface_mm + motion.shift_mm.as_dvec3(),
                    normal: (still.normal + motion.tilt.as_dvec3()).normalize_or(still.normal),
                    moved: if little { Moved::Little(motion.change.to_array()) } else { Moved::Far },
                    ..still
                };
            }
            Source::Exact => {}
        }
        work.add(EffectName::Contact, units::DENT);
        // Where a ray may meet the membrane more than once, what it shows may not depend on what was asked before.
        let near_mm = match kept {
            _ if dent.may_fold() => DVec3::ZERO,
            None if self.is_whole(corner) => self.foretold_mm(corner, (x, y)),
            _ => self.moved_mm,
        };
        let Some((rest_mm, dented)) = dent.meet(surface_mm, inside, near_mm) else {
            self.moved_mm = DVec3::ZERO;
            return still;
        };
        // Neighbours move alike: the last one's motion is where the next node's search begins.
        self.moved_mm = dented.displacement_mm;
        if self.moved_mm.length_squared() <= STILL_MM * STILL_MM {
            return still;
        }
        let point_mm = rest_mm + dented.displacement_mm;
        if let Some(motion) = kept.and_then(|at| self.motions.get_mut(at)) {
            motion.shift_mm = (point_mm - surface_mm).as_vec3a();
            motion.moved_mm = self.moved_mm.as_vec3a();
            motion.tilt = (dented.normal - still.normal).as_vec3a();
            let change = surface.shading.change(point_mm, dented.normal);
            motion.change = Vec3A::from_array(change);
            return SurfaceSample { point_mm, moved: Moved::Little(change), ..still };
        }
        SurfaceSample { point_mm, normal: dented.normal, to_camera: -inside, moved: Moved::Far }
    }
}

/// Stands in for a pixel without a ray, a little beyond the end of the lens's field: twice the brightness at the end less
/// that as far inside, so that it goes on smoothly. Rays, and the shares of their brightness.
#[cold]
fn continued(optics: &SensorOptics, pixel: DVec2) -> [Option<((DVec3, DVec3), f32)>; 2] {
    let [[_, _, cx], [_, _, cy], _] = optics.lens().spec().matrix;
    let center = DVec2::new(cx, cy);
    let away = pixel - center;
    let (radius_px, mut end_px) = (away.length(), optics.lens().max_radius_px());
    if radius_px > end_px + BEYOND_PX {
        return [None; 2];
    }
    let at = |radius: f64| optics.trace_continued(center + away * (radius / radius_px)).ok();
    // The end is known as a circle that holds the field.
    for _ in 0..8 {
        end_px -= 0.25;
        if let (Some(end), Some(inside)) = (at(end_px), at(2.0 * end_px - radius_px)) {
            return [Some((end, 2.0)), Some((inside, -1.0))];
        }
    }
    [None; 2]
}
