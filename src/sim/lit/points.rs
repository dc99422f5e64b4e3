//! What single pixels of the lit membrane show: their rays, where these meet the membrane, and the light there.

use glam::{DVec2, Vec3A, Vec4};

use super::motion::{Motion, Source, Square};
use super::{Known, LARGEST, Lit, LitSlice, LitSurface, units};
use crate::dent::Dent;
use crate::effect::EffectName;
use crate::shading::{Moved, SurfaceSample};
use crate::work::Work;
use domecast_optics::SensorOptics;

/// Rays are traced and lit this many at a time.
const BATCH: usize = 512;
/// Squares that reach further than this beyond the lens's field are all outside it, px.
const BEYOND_PX: f64 = 4.0 * LARGEST as f64;
/// What moves by less is not dented, mm.
const STILL_MM: f32 = 1e-6;

impl Lit {
    /// Lights those of some pixels of the square at `corner` that are not known yet, once [`Self::light`] is called; their rays
    /// are told where that may be, else followed.
    pub(super) fn ask(
        &mut self,
        surface: &LitSurface<'_>,
        corner: (usize, usize),
        pixels: impl IntoIterator<Item = (usize, usize)>,
        work: &mut Work,
    ) {
        let (square, rays) = (self.square(corner), self.rays(corner));
        for (x, y) in pixels {
            let at = y * self.width + x;
            if self.known.get(at) != Some(&Known::Nothing) {
                continue;
            }
            let Some(seen) = surface.at(y) else { continue };
            // Where a ray may meet the membrane more than once, the least difference may show another part of it.
            let may_fold = square.source == Source::Exact && seen.dent.is_some_and(Dent::may_fold);
            let told = if rays.are_told && !may_fold {
                work.add_base(units::TOLD_RAY);
                self.told_ray(&rays, (x, y), seen.optics.dome_radius_mm() as f32)
            } else {
                None
            };
            let hit = told.or_else(|| trace((surface, seen), (x, y), work));
            let mut known = Known::Lit;
            match hit {
                Some(hit) => {
                    let asked = Asked { pixel: (x, y), is_kept: self.is_kept((x, y)) };
                    let sample = self.sample((surface, seen), hit, &square, asked, work);
                    self.samples.push(sample);
                    self.places.push((at, 1.0));
                }
                None => {
                    known = Known::Misses;
                    for (hit, weight) in
                        continued(seen.optics, DVec2::new(x as f64, y as f64)).into_iter().flatten()
                    {
                        known = Known::Lit;
                        let asked = Asked { pixel: (x, y), is_kept: false };
                        let sample = self.sample((surface, seen), hit, &square, asked, work);
                        self.samples.push(sample);
                        self.places.push((at, weight));
                    }
                }
            }
            if known == Known::Lit {
                self.levels.get_mut(at).into_iter().for_each(|level| *level = Vec4::ZERO);
            }
            if let Some(place) = self.known.get_mut(at) {
                *place = known;
            }
            if self.samples.len() >= BATCH {
                self.light(surface, work);
            }
        }
    }

    /// Keeps the ray of a node that nothing has asked for.
    pub(super) fn keep_ray(&mut self, surface: &LitSurface<'_>, node: (usize, usize), work: &mut Work) {
        let Some(seen) = surface.at(node.1).filter(|_| node.0 < self.width && node.1 < self.height) else {
            return;
        };
        if let Some(hit) = trace((surface, seen), node, work) {
            let normal = hit.0 * (1.0 / seen.optics.dome_radius_mm() as f32);
            self.keep(node, Motion::default().along(hit, normal));
        }
    }

    /// Keeps ray and motion of a node of a square that a neighbour has been filled in over.
    pub(super) fn keep_motion(
        &mut self,
        surface: &LitSurface<'_>,
        square: &Square,
        node: (usize, usize),
        work: &mut Work,
    ) {
        let is_filled = self.known.get(node.1 * self.width + node.0) == Some(&Known::Lit);
        let Some(seen) = surface.at(node.1).filter(|_| is_filled) else { return };
        if let Some(hit) = trace((surface, seen), node, work) {
            self.sample((surface, seen), hit, square, Asked { pixel: node, is_kept: true }, work);
        }
    }

    /// Lights what was asked for.
    pub(super) fn light(&mut self, surface: &LitSurface<'_>, work: &mut Work) {
        self.shown.clear();
        surface.shading.levels(&self.samples, &mut self.shown, work);
        for ((at, weight), shown) in self.places.iter().zip(&self.shown) {
            if let Some(level) = self.levels.get_mut(*at) {
                *level += *shown * *weight;
            }
        }
        self.samples.clear();
        self.places.clear();
    }

    /// What a ray that meets the undeformed dome shows.
    fn sample(
        &mut self,
        (surface, seen): (&LitSurface<'_>, &LitSlice<'_>),
        (surface_mm, inside): (Vec3A, Vec3A),
        square: &Square,
        asked: Asked,
        work: &mut Work,
    ) -> SurfaceSample {
        let normal = surface_mm * (1.0 / seen.optics.dome_radius_mm() as f32);
        let mut sample =
            SurfaceSample { point_mm: surface_mm, normal, to_camera: -inside, moved: Moved::Not };
        let mut motion = Motion::default();
        if let Some(dent) = seen.dent.filter(|_| square.source != Source::Still) {
            if square.source == Source::Exact {
                work.add(EffectName::Contact, units::DENT);
                if let Some(found) = self.dented(dent, &sample, square, asked.pixel) {
                    (sample.point_mm, sample.normal) = (found.point_mm, found.normal);
                    sample.moved = Moved::Far;
                    if asked.is_kept {
                        motion.shift_mm = found.point_mm - surface_mm;
                        motion.moved_mm = self.moved_mm;
                        motion.tilt = found.normal - normal;
                        let change = surface.shading.change(found.point_mm, found.normal);
                        motion.change = change;
                        sample.moved = Moved::Little(change);
                    }
                }
            } else {
                work.add(EffectName::Contact, units::SMOOTH);
                let is_little = square.source == Source::Little;
                if asked.is_kept {
                    let parts = |node: &Motion| [node.shift_mm, node.tilt, node.change, node.moved_mm];
                    [motion.shift_mm, motion.tilt, motion.change, motion.moved_mm] =
                        self.told(square, asked.pixel, parts);
                } else if is_little {
                    let parts = |node: &Motion| [node.shift_mm, node.change];
                    [motion.shift_mm, motion.change] = self.told(square, asked.pixel, parts);
                } else {
                    let parts = |node: &Motion| [node.shift_mm, node.tilt];
                    [motion.shift_mm, motion.tilt] = self.told(square, asked.pixel, parts);
                }
                sample.point_mm += motion.shift_mm;
                if !is_little {
                    sample.normal = (normal + motion.tilt).normalize_or(normal);
                    if asked.is_kept {
                        // From these nodes smaller squares may learn that the change of the light is smooth.
                        motion.change = surface.shading.change(sample.point_mm, sample.normal);
                    }
                }
                sample.moved =
                    if is_little || asked.is_kept { Moved::Little(motion.change) } else { Moved::Far };
            }
        }
        if asked.is_kept {
            motion.is_whole = true;
            self.keep(asked.pixel, motion.along((surface_mm, inside), normal));
        }
        sample
    }

    /// Where a ray that would meet the undeformed dome meets the membrane; `None` where it stands still.
    fn dented(
        &mut self,
        dent: &Dent,
        still: &SurfaceSample,
        square: &Square,
        pixel: (usize, usize),
    ) -> Option<Found> {
        // Where a ray may meet the membrane more than once, what it shows may not depend on what was asked before.
        let near_mm = if dent.may_fold() {
            Vec3A::ZERO
        } else if square.is_whole {
            self.foretold_mm(square, pixel)
        } else {
            self.moved_mm
        };
        let met = dent.meet(still.point_mm, -still.to_camera, near_mm);
        // Neighbours move alike: the last one's motion is where the next node's search begins.
        self.moved_mm = met.map_or(Vec3A::ZERO, |(_, dented)| dented.displacement_mm);
        let (rest_mm, dented) = met?;
        let has_moved = self.moved_mm.length_squared() > STILL_MM * STILL_MM;
        has_moved.then_some(Found { point_mm: rest_mm + dented.displacement_mm, normal: dented.normal })
    }
}

/// Follows the ray of a pixel all the way: where it meets the undeformed dome, mm, and its unit direction; `None` where it does
/// not.
fn trace(
    (surface, seen): (&LitSurface<'_>, &LitSlice<'_>),
    (x, y): (usize, usize),
    work: &mut Work,
) -> Option<(Vec3A, Vec3A)> {
    work.add_base(units::RAY);
    let hit = match surface.rays.and_then(|rays| rays.at(x, y)) {
        Some(ray) => seen.optics.follow_continued(ray),
        None => seen.optics.trace_continued(DVec2::new(x as f64, y as f64)),
    };
    hit.ok().map(|(place_mm, inside)| (place_mm.as_vec3a(), inside.as_vec3a()))
}

/// A pixel that is asked for.
#[derive(Debug, Clone, Copy)]
struct Asked {
    pixel: (usize, usize),
    /// Whether its ray and motion are kept.
    is_kept: bool,
}

/// A point of the moved membrane.
struct Found {
    point_mm: Vec3A,
    normal: Vec3A,
}

/// Stands in for a pixel without a ray, a little beyond the end of the lens's field: twice the brightness at the end less
/// that as far inside, so that it goes on smoothly. Rays, and the shares of their brightness.
#[cold]
fn continued(optics: &SensorOptics, pixel: DVec2) -> [Option<((Vec3A, Vec3A), f32)>; 2] {
    let [[_, _, cx], [_, _, cy], _] = optics.lens().spec().matrix;
    let center = DVec2::new(cx, cy);
    let away = pixel - center;
    let (radius_px, mut end_px) = (away.length(), optics.lens().max_radius_px());
    if radius_px > end_px + BEYOND_PX {
        return [None; 2];
    }
    let at = |radius: f64| {
        let (place_mm, inside) = optics.trace_continued(center + away * (radius / radius_px)).ok()?;
        Some((place_mm.as_vec3a(), inside.as_vec3a()))
    };
    // The end is known as a circle that holds the field.
    for _ in 0..8 {
        end_px -= 0.25;
        if let (Some(end), Some(inside)) = (at(end_px), at(2.0 * end_px - radius_px)) {
            return [Some((end, 2.0)), Some((inside, -1.0))];
        }
    }
    [None; 2]
}
