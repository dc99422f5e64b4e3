//! Light that the membrane throws on itself.
//!
//! The membrane is Lambertian, so its exitance `B` (mW/mm^2) tells all. Two ways lead from one point of the
//! dome to another:
//!
//! * straight through the silicone. In a sphere of radius `R` a Lambertian patch gives every other point the
//!   same irradiance, `B dA / (4 pi R^2)`: the cosines at both ends cancel the distance. So all of it together
//!   is one number, the dome's flux over `4 pi R^2`;
//! * down to the sheet's underside and back up, by Fresnel's reflection or, beyond the critical angle, total
//!   reflection: the underside is a mirror whose strength depends on the angle. What comes back outside the
//!   dome's foot is guided away in the sheet and lost.
//!
//! A cylinder under the hemisphere is no part of that sphere: with one, every pair of patches has its own straight way,
//! `cos cos' dA / (pi d^2)`; the dome is convex, so nothing stands between.
//!
//! The balance `B = albedo (E + K B)` is solved on rings of patches; the mirror's part depends on the azimuth
//! between two patches only, so one ring of it serves all. Its series falls at least as fast as the albedo.

use glam::{DMat3, DVec3};

use super::dome_map::DomeFace;
use super::fresnel;
use domecast_optics::{DomeShape, SensorOptics};

/// Rings of equal area from rim to pole, and patches in each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rings {
    /// Rings.
    pub rings: usize,
    /// Patches in a ring.
    pub patches: usize,
    /// The face that they share.
    pub face: DomeFace,
}

impl Rings {
    /// Enough for 0.3 % of the light that comes back from the sheet (tested against twice as many).
    pub const USUAL: Self = Self { rings: 16, patches: 40, face: DomeFace::HEMISPHERE };

    /// As many over another face.
    pub fn usual(face: DomeFace) -> Self {
        Self { face, ..Self::USUAL }
    }

    fn cos(&self, ring: usize) -> f64 {
        self.face.level((ring as f64 + 0.5) / self.rings as f64)
    }

    /// Place of a patch's middle.
    pub fn place(&self, ring: usize, patch: usize) -> DVec3 {
        let z = self.cos(ring);
        let azimuth = std::f64::consts::TAU * (patch as f64 + 0.5) / self.patches as f64;
        self.face.place(azimuth, z)
    }

    /// How many patches in all; patch `p` of ring `r` is number `r * patches + p`.
    pub fn count(&self) -> usize {
        self.rings * self.patches
    }

    fn mirror_len(&self) -> usize {
        self.rings * self.count()
    }

    /// Numbers of [`DomeRoom::numbers`].
    pub fn numbers_len(&self) -> usize {
        4 * self.mirror_len()
    }
}

/// The dome as a room that lights itself, for one colour.
#[derive(Debug, Clone)]
pub struct DomeRoom {
    rings: Rings,
    dome: DomeShape,
    /// Share of an exitance of one that all patches together give each other straight, over the sphere.
    straight: f64,
    /// `mirror[(to * rings + from) * patches + shift]`: irradiance at ring `to` for an exitance of one of the
    /// patch of ring `from` that is `shift` patches further round.
    mirror: Vec<f64>,
    /// The same by the straight way too, as vector irradiance at the ring's first patch.
    vectors: Vec<DVec3>,
}

/// The balance of light in the dome.
#[derive(Debug, Clone, PartialEq)]
pub struct Balance {
    /// Irradiance of every patch by the membrane's own light, mW/mm^2.
    pub indirect: Vec<f64>,
    /// Exitance of every patch, mW/mm^2.
    pub exitance: Vec<f64>,
    /// Rounds of the series that were summed.
    pub rounds: u32,
    /// Largest change of an irradiance in the last round, mW/mm^2.
    pub residual: f64,
}

/// Bound on the rounds: at the largest albedo, 0.99, the series falls to 1e-9 in 2100.
const MAX_ROUNDS: u32 = 4000;

/// Change at which the series ends, of the largest irradiance.
const ROUNDS_END: f64 = 1e-9;

/// What the underside sends back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Underside {
    /// By Fresnel's equations and total reflection.
    Fresnel,
    /// Nothing: only the straight way counts.
    Dark,
    /// Everything, with no loss at the dome's foot: for tests against closed forms.
    Perfect,
}

impl DomeRoom {
    /// Computes how the underside mirrors the dome.
    pub fn new(optics: &SensorOptics, rings: Rings, underside: Underside) -> Self {
        let dome = *optics.dome();
        let mut mirror = vec![0.0; rings.mirror_len()];
        let mut vectors = straight_vectors(rings, &dome);
        if rings.face.has_wall() {
            for (at, value) in mirror.iter_mut().enumerate() {
                let target = rings.place(at / (rings.rings * rings.patches), 0);
                *value = vectors[at].dot(rings.face.normal(target)).max(0.0);
            }
        }
        if underside != Underside::Dark {
            for to in 0..rings.rings {
                let target = rings.place(to, 0);
                let (at_mm, normal) = (on_dome(&dome, target), rings.face.normal(target));
                for from in 0..rings.rings {
                    let mut near = 0.0;
                    for shift in 0..rings.patches {
                        let source = rings.place(from, shift);
                        let (one, tangent) = mirrored(optics, source, at_mm, underside, near);
                        near = tangent;
                        let (at, value) = (
                            (to * rings.rings + from) * rings.patches + shift,
                            one * patch_mm2(rings, &dome),
                        );
                        mirror[at] += value.dot(normal).max(0.0);
                        // What comes from beyond the skin's own plane does not reach it.
                        vectors[at] += if value.dot(normal) > 0.0 { value } else { DVec3::ZERO };
                    }
                }
            }
        }
        Self { rings, dome, straight: straight(rings, &dome), mirror, vectors }
    }

    /// The same of what was computed before: [`DomeRoom::numbers`] of the same dome and rings.
    pub fn of(optics: &SensorOptics, rings: Rings, numbers: &[f64]) -> Self {
        let dome = *optics.dome();
        let (mirror, vectors) = numbers.split_at(rings.mirror_len().min(numbers.len()));
        let vectors = vectors.as_chunks::<3>().0.iter().map(|xyz| DVec3::from_array(*xyz)).collect();
        Self { rings, dome, straight: straight(rings, &dome), mirror: mirror.to_vec(), vectors }
    }

    /// What patches give each other over the underside, and straight where the face has a wall: for each ring, each ring that gives,
    /// and each turn between two patches, the irradiance for an exitance of one; then so the vectors of all light.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        self.mirror.iter().copied().chain(self.vectors.iter().flat_map(|vector| vector.to_array()))
    }

    /// The patches.
    pub fn rings(&self) -> Rings {
        self.rings
    }

    /// Area of every patch, mm^2.
    pub fn patch_mm2(&self) -> f64 {
        patch_mm2(self.rings, &self.dome)
    }

    /// Irradiance of every patch by the exitance of all.
    pub fn irradiance(&self, exitance: &[f64]) -> Vec<f64> {
        let Rings { rings, patches, .. } = self.rings;
        let straight = self.straight * exitance.iter().sum::<f64>() / (2 * self.rings.count()) as f64;
        let mut out = vec![straight; self.rings.count()];
        for (to, row) in out.chunks_mut(patches).enumerate() {
            for (from, light) in exitance.chunks(patches).enumerate() {
                let at = (to * rings + from) * patches;
                let kernel = &self.mirror[at..at + patches];
                for (p, sum) in row.iter_mut().enumerate() {
                    // patch q is (q - p) further round
                    let (tail, head) = light.split_at(p);
                    let ahead: f64 = head.iter().zip(kernel).map(|(b, k)| b * k).sum();
                    let behind: f64 = tail.iter().zip(&kernel[patches - p..]).map(|(b, k)| b * k).sum();
                    *sum += ahead + behind;
                }
            }
        }
        out
    }

    /// Vector irradiance of every patch by the exitance of all: its product with the outward normal is the irradiance, also of skin that
    /// is tilted a little (light from the edge of what it sees counts nothing yet).
    pub fn vector_irradiance(&self, exitance: &[f64]) -> Vec<DVec3> {
        let Rings { rings, patches, .. } = self.rings;
        let at = |i: usize| {
            let (to, patch) = (i / patches, i % patches);
            let kernels = self.vectors[to * rings * patches..].chunks(patches).zip(exitance.chunks(patches));
            let sum: DVec3 = kernels
                .flat_map(|(kernel, light)| light.iter().cycle().skip(patch).zip(kernel))
                .map(|(light, vector)| *vector * *light)
                .sum();
            DMat3::from_rotation_z(std::f64::consts::TAU * patch as f64 / patches as f64) * sum
        };
        (0..self.rings.count()).map(at).collect()
    }

    /// The balance for the direct irradiance of every patch and one albedo (0 to below 1).
    pub fn solve(&self, direct: &[f64], albedo: f64) -> Balance {
        let largest = direct.iter().copied().fold(0.0, f64::max);
        let mut indirect = vec![0.0; self.rings.count()];
        let mut exitance: Vec<f64> = direct.iter().map(|e| albedo * e).collect();
        let (mut rounds, mut residual) = (0, 0.0);
        while rounds < MAX_ROUNDS {
            let next = self.irradiance(&exitance);
            residual = next.iter().zip(&indirect).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            indirect = next;
            for ((b, e), i) in exitance.iter_mut().zip(direct).zip(&indirect) {
                *b = albedo * (e + i);
            }
            rounds += 1;
            if residual <= ROUNDS_END * largest {
                break;
            }
        }
        Balance { indirect, exitance, rounds, residual }
    }

    /// Irradiance that the membrane gives a point of the sheet's top beside the dome, from below, by way of the
    /// underside.
    pub fn beside(&self, optics: &SensorOptics, exitance: &[f64], point_mm: DVec3) -> f64 {
        let mut near = 0.0;
        let mut sum = 0.0;
        for ring in 0..self.rings.rings {
            for patch in 0..self.rings.patches {
                let source = self.rings.place(ring, patch);
                let (value, tangent) = mirrored(optics, source, point_mm, Underside::Fresnel, near);
                near = tangent;
                sum += value.z.max(0.0) * exitance[ring * self.rings.patches + patch];
            }
        }
        sum * self.patch_mm2()
    }
}

fn patch_mm2(rings: Rings, dome: &DomeShape) -> f64 {
    dome.area_mm2() / rings.count() as f64
}

/// The point of a place of the face.
fn on_dome(dome: &DomeShape, place: DVec3) -> DVec3 {
    dome.center_mm() + place * dome.radius_mm()
}

/// Share of an exitance of one that all patches together give each other straight, over the sphere: a wall's ways are in the mirror's list.
fn straight(rings: Rings, dome: &DomeShape) -> f64 {
    if rings.face.has_wall() { 0.0 } else { dome.height_mm() / dome.radius_mm() }
}

/// Vector irradiance by the straight ways between patches. A patch is taken at several places: next to it the kernel is bounded, but
/// not smooth.
fn straight_vectors(rings: Rings, dome: &DomeShape) -> Vec<DVec3> {
    let own_mm2 = patch_mm2(rings, dome) / f64::from(SUB * SUB);
    let step = std::f64::consts::TAU / rings.patches as f64;
    let of = |at: usize| {
        let (to, from, shift) =
            (at / (rings.rings * rings.patches), at / rings.patches % rings.rings, at % rings.patches);
        let target = rings.place(to, 0);
        let (target_mm, normal) = (on_dome(dome, target), rings.face.normal(target));
        let mut sum = DVec3::ZERO;
        for (i, j) in (0..SUB).flat_map(|i| (0..SUB).map(move |j| (i, j))) {
            let [up, around] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(SUB));
            let level = rings.face.level((from as f64 + up) / rings.rings as f64);
            let source = rings.face.place(step * (shift as f64 + around), level);
            let way = target_mm - on_dome(dome, source);
            let square = way.length_squared();
            if square > 1e-12 * dome.radius_mm() * dome.radius_mm() && normal.dot(way) > 0.0 {
                let leaving = (-rings.face.normal(source).dot(way)).max(0.0);
                sum += way * (own_mm2 * leaving / (std::f64::consts::PI * square * square));
            }
        }
        sum
    };
    (0..rings.mirror_len()).map(of).collect()
}

/// Places along each side of a patch.
const SUB: u32 = 4;

/// Vector irradiance at a point by way of the underside, for an exitance of one and an area of 1 mm^2 at the dome's
/// place `source`; and the tangent of the way.
fn mirrored(
    optics: &SensorOptics,
    source: DVec3,
    point_mm: DVec3,
    underside: Underside,
    near: f64,
) -> (DVec3, f64) {
    let dome = optics.dome();
    let (radius, source_mm) = (dome.rim_radius_mm(), on_dome(dome, source));
    let Ok(tube) = optics.mirrored_tube(source_mm, point_mm, near) else { return (DVec3::ZERO, near) };
    let leaving = (-DomeFace::of(dome).normal(source).dot(tube.leaving)).max(0.0);
    let value = tube.arriving * (leaving * tube.sr_per_mm2 / std::f64::consts::PI);
    if underside == Underside::Perfect {
        return (value, tube.tangent);
    }
    // Where it crosses the sheet's top, down and (for a point of the dome) up.
    let foot = |end: DVec3, along: DVec3| (end - along * (end.z / along.z)).truncate().length() <= radius;
    let up = point_mm.z <= 0.0 || foot(point_mm, tube.arriving);
    if !(up && foot(source_mm, tube.leaving)) {
        return (DVec3::ZERO, tube.tangent);
    }
    let channel = optics.channel();
    // From the dome down, without the air that stands first.
    let down: Vec<f64> = optics.layers().iter().skip(1).rev().map(|l| l.index_for(channel)).collect();
    // Beside the dome it has come to the sheet's top.
    let share = if point_mm.z > 0.0 { fresnel::returned } else { fresnel::turned };
    (value * share(&down, tube.snell_invariant), tube.tangent)
}
