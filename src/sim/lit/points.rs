//! What single pixels of the lit membrane show: their rays, where these meet the membrane, and the light there.

use glam::{DVec2, DVec3, Vec3A};

use super::{Known, LARGEST, Lit, LitSlice, LitSurface, units};
use crate::optics::SensorOptics;
use crate::sim::effect::EffectName;
use crate::sim::shading::{Moved, SurfaceSample};
use crate::sim::work::Work;

/// Rays are traced and lit this many at a time.
const BATCH: usize = 512;
/// Squares that reach further than this beyond the lens's field are all outside it, px.
const BEYOND_PX: f64 = 2.0 * LARGEST as f64;
/// What moves by less is not dented, mm.
const STILL_MM: f64 = 1e-6;
/// Distance of the pixels of which the membrane's motion is kept, px: the nodes of the largest squares.
const KEPT_STEP: usize = LARGEST / 2;

/// The motion is smooth over a square where no normal in the middle is further than this from what those on both sides
/// say, rad; the change of the light, where it is nearer than this part of the tolerance. What parabolas leave is a
/// fraction of that.
const SMOOTH_RAD: f32 = 5e-3;
const LITTLE: f32 = 0.4;
/// Nearer to the base than this part of the radius, rays graze the dome: what they show bends more than the light does.
const GRAZING: f64 = 0.2;

/// Where the light's change is not smooth in itself, its own bend is counted as so many of the resting light's.
const ALSO: f32 = 1.5;

/// How the light may bend over a square.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// Bound on what the surface through the nodes leaves, full scales.
    pub most: f32,
    /// Whether all of it lies well inside the rim, and the bound is the whole truth there.
    pub is_inside: bool,
}

/// How the membrane moved where a ray met it undeformed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// The point of the undeformed dome on the ray, mm.
    place_mm: Vec3A,
    /// From the undeformed point on the ray to the deformed one, mm.
    shift_mm: Vec3A,
    /// Change of the unit normal.
    tilt: Vec3A,
    /// Change of the light, full scales.
    change: Vec3A,
}

/// How the pixels of a largest square come by their place on the membrane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Source {
    /// Each ray is followed to the deformed membrane.
    #[default]
    Exact,
    /// No part of the square moves.
    Still,
    /// The motion is smooth: the parabolas through the nine nodes tell it.
    Smooth,
    /// So is the change of the light.
    Little,
}

/// Weights of a square's three nodes at each of its columns or rows.
const WEIGHTS: [[f32; 3]; LARGEST + 1] = {
    let mut weights = [[0.0; 3]; LARGEST + 1];
    let mut i = 0;
    while i <= LARGEST {
        let t = i as f32 / KEPT_STEP as f32;
        weights[i] = [0.5 * (t - 1.0) * (t - 2.0), t * (2.0 - t), 0.5 * t * (t - 1.0)];
        i += 1;
    }
    weights
};

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
            let ray = surface.rays.filter(|_| surface.tolerance > 0.0).and_then(|rays| rays.at(x, y));
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
                known = if sample.moved == Moved::Not { Known::Still } else { Known::Moved };
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
            *motion = Motion { place_mm: surface_mm.as_vec3a(), ..Motion::default() };
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
        let Some((rest_mm, dented)) = dent.meet(surface_mm, inside, self.moved_mm) else {
            self.moved_mm = DVec3::ZERO;
            return still;
        };
        // Neighbours move alike: the last one's motion is where the next one's search begins.
        self.moved_mm = dented.displacement_mm;
        if self.moved_mm.length_squared() <= STILL_MM * STILL_MM {
            return still;
        }
        let point_mm = rest_mm + dented.displacement_mm;
        if let Some(motion) = kept.and_then(|at| self.motions.get_mut(at)) {
            motion.shift_mm = (point_mm - surface_mm).as_vec3a();
            motion.tilt = (dented.normal - still.normal).as_vec3a();
            let change = surface.shading.change(point_mm, dented.normal);
            motion.change = Vec3A::from_array(change);
            return SurfaceSample { point_mm, moved: Moved::Little(change), ..still };
        }
        SurfaceSample { point_mm, normal: dented.normal, to_camera: -inside, moved: Moved::Far }
    }

    fn kept_at(&self, (x, y): (usize, usize)) -> Option<usize> {
        (x.is_multiple_of(KEPT_STEP) && y.is_multiple_of(KEPT_STEP))
            .then(|| y / KEPT_STEP * self.kept_across() + x / KEPT_STEP)
    }

    fn kept_across(&self) -> usize {
        self.width.div_ceil(KEPT_STEP)
    }

    /// Room for the motions of a picture; of the last one, nothing is left that could tell on this one's bytes.
    pub(super) fn lay_out_motions(&mut self) {
        self.moved_mm = DVec3::ZERO;
        self.motions.clear();
        let count = self.kept_across() * self.height.div_ceil(KEPT_STEP);
        self.motions.resize(count, Motion::default());
        self.sources.clear();
        self.sources.resize((self.width / LARGEST) * (self.height / LARGEST), Source::Exact);
    }

    fn source(&self, (x, y): (usize, usize)) -> Source {
        let at = y / LARGEST * (self.width / LARGEST) + x / LARGEST;
        self.sources.get(at).copied().unwrap_or_default()
    }

    /// Decides how the pixels of a largest square, of which the nine nodes are known, come by their places.
    pub(super) fn settle_source(&mut self, (x, y): (usize, usize), pressed: bool, tolerance: f32) {
        if pressed {
            return;
        }
        let known = |i: usize| {
            let at = (y + i / 3 * KEPT_STEP) * self.width + x + i % 3 * KEPT_STEP;
            self.known.get(at).copied().unwrap_or(Known::Misses)
        };
        let count = |of: Known| (0..9).filter(|i| known(*i) == of).count();
        let source = if count(Known::Moved) == 0 {
            Source::Still
        } else if self.bends_mildly((x, y), |motion| motion.tilt, SMOOTH_RAD) {
            let little = self.bends_mildly((x, y), |motion| motion.change, LITTLE * tolerance);
            if little { Source::Little } else { Source::Smooth }
        } else {
            return;
        };
        let at = y / LARGEST * (self.width / LARGEST) + x / LARGEST;
        if let Some(place) = self.sources.get_mut(at) {
            *place = source;
        }
    }

    fn kept(&self, (x, y): (usize, usize)) -> Motion {
        let at = y / KEPT_STEP * self.kept_across() + x / KEPT_STEP;
        self.motions.get(at).copied().unwrap_or_default()
    }

    /// Whether a part of the motion in the middles is what the straight lines through their neighbours say, within some
    /// room.
    fn bends_mildly(&self, (x, y): (usize, usize), part: impl Fn(Motion) -> Vec3A, room: f32) -> bool {
        let at = |i: usize, j: usize| part(self.kept((x + i * KEPT_STEP, y + j * KEPT_STEP)));
        let mild = |a: Vec3A, b: Vec3A, c: Vec3A| (0.5 * (a + c) - b).abs().max_element() <= room;
        (0..3).all(|k| mild(at(k, 0), at(k, 1), at(k, 2)) && mild(at(0, k), at(1, k), at(2, k)))
            && mild(at(0, 0), at(1, 1), at(2, 2))
            && mild(at(2, 0), at(1, 1), at(0, 2))
    }

    /// How far the light may be from the surface through the nodes of a part of a largest square, where it is that of
    /// the undeformed membrane or little else; full scales. `None` where nothing is known of it.
    pub(super) fn bend(&self, surface: &LitSurface<'_>, (x, y): (usize, usize), side: usize) -> Option<Bend> {
        let largest = (x / LARGEST * LARGEST, y / LARGEST * LARGEST);
        let source = self.source(largest);
        if source == Source::Exact {
            return None;
        }
        let (dx, dy) = (x - largest.0, y - largest.1);
        let corners = [(dx, dy), (dx + side, dy), (dx, dy + side), (dx + side, dy + side)];
        let places = corners.map(|at| self.motion(largest, at).place_mm.as_dvec3());
        let per_radius = 1.0 / surface.at(y)?.optics.dome_radius_mm();
        let places = places.map(|place| place * per_radius);
        // Nodes without a ray have no place.
        let lit = (0..9).all(|i| {
            self.kept((largest.0 + i % 3 * KEPT_STEP, largest.1 + i / 3 * KEPT_STEP)).place_mm != Vec3A::ZERO
        });
        let is_inside = lit && source != Source::Smooth && places.iter().all(|place| place.z > GRAZING);
        let most = surface.shading.bend(&places) * if source == Source::Smooth { ALSO } else { 1.0 };
        Some(Bend { most, is_inside })
    }

    /// The motion at a place of a largest square, by the parabolas through its nine nodes.
    fn motion(&self, (x, y): (usize, usize), (dx, dy): (usize, usize)) -> Motion {
        let (wx, wy) = (WEIGHTS[dx.min(LARGEST)], WEIGHTS[dy.min(LARGEST)]);
        let mut sum = Motion::default();
        for (j, wy) in wy.iter().enumerate() {
            for (i, wx) in wx.iter().enumerate() {
                let node = self.kept((x + i * KEPT_STEP, y + j * KEPT_STEP));
                sum.place_mm += node.place_mm * (wx * wy);
                sum.shift_mm += node.shift_mm * (wx * wy);
                sum.tilt += node.tilt * (wx * wy);
                sum.change += node.change * (wx * wy);
            }
        }
        sum
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
