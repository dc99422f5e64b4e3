//! Newton's method for one pose of the object.

use glam::{DMat3, DVec3};

use super::krylov::gmres;
use super::system::{Body, Tangent};
use super::touch::{Anchors, Bearings, Law, Spot};
use crate::object::Placed;
use domecast_elastic::Factors;

/// Newton's steps of one pose.
const MAX_STEPS: usize = 24;
/// Steps in a row that may leave the residual larger than it ever was.
const MAX_WITHOUT_GAIN: usize = 8;
/// Halvings of one step.
const MAX_HALVINGS: u32 = 5;
/// Residual that counts as none, as a part of the forces between object and dome.
const TOLERANCE: f64 = 1e-9;
/// What may be left of the residual by a step under sliding friction: the linear system is solved in steps of its own, and a
/// Newton step leaves more than this but for the last ones.
const STEP: f64 = 1e-4;
/// No step closes a gap by more than this part of the radius.
const LONGEST: f64 = 0.15;
/// Growth of the residual that a whole step may have: points that come to touch bear at once.
const MAX_GROWTH: f64 = 3.0;
/// Steps without gain from which on none may grow: points that stick and slide in turn would do so for ever.
const PATIENCE: usize = 2;
/// First spring on every node, over shear modulus by radius, where the tangent alone is not positive definite; four times as stiff each time
/// that it is not enough, and how often.
const SHIFT: f64 = 1e-3;
const SHIFTS: u32 = 5;

/// Body, surface and law of one contact.
pub(crate) struct Problem<'a> {
    pub body: &'a Body,
    pub spots: &'a [Spot],
    pub law: Law,
}

/// A solved pose.
#[derive(Debug)]
pub(crate) struct Solved {
    pub displaced_mm: Vec<DVec3>,
    pub bearings: Bearings,
    /// By Newton's step: the residual as a part of the contact's forces.
    pub residuals: Vec<f64>,
    /// The most that the last step moved a node, mm.
    pub moved_mm: f64,
    /// Force of the base on the dome, N.
    pub base_n: DVec3,
}

/// Where the body is, and what is out of balance there.
struct Trial {
    displaced_mm: Vec<DVec3>,
    forces_n: Vec<DVec3>,
    bearings: Bearings,
    size_n: f64,
    base_n: DVec3,
}

impl Problem<'_> {
    /// Takes out the base's forces, and says what is left.
    fn trial(&self, displaced_mm: Vec<DVec3>, mut forces_n: Vec<DVec3>, bearings: Bearings) -> Trial {
        bearings.add_forces(&self.body.mesh, self.spots, &mut forces_n);
        let mut base_n = DVec3::ZERO;
        for (force, is_base) in forces_n.iter_mut().zip(&self.body.mesh.is_base) {
            if *is_base {
                base_n += *force;
                *force = DVec3::ZERO;
            }
        }
        let size_n = forces_n.iter().map(|force| force.length_squared()).sum::<f64>().sqrt();
        Trial { displaced_mm, forces_n, bearings, size_n, base_n }
    }

    /// Balance from a start; `None` if it is not found within the bounds.
    pub fn solve(&self, placed: &Placed, anchors: &Anchors, start_mm: Vec<DVec3>) -> Option<Solved> {
        let bear = |u: &[DVec3]| self.law.bear(&self.body.mesh, self.spots, u, placed, anchors);
        let (forces, mut tangent) = self.body.linearised(&start_mm)?;
        let bearings = bear(&start_mm);
        let mut now = self.trial(start_mm, forces, bearings);
        let (mut residuals, mut moved_mm) = (Vec::new(), 0.0);
        let (mut best_n, mut without_gain) = (f64::INFINITY, 0);
        for _ in 0..MAX_STEPS {
            let scale_n: f64 = now.bearings.of.iter().flatten().map(|b| b.force_n.length()).sum();
            residuals.push(now.size_n / scale_n.max(f64::MIN_POSITIVE));
            if now.size_n <= TOLERANCE * scale_n {
                let Trial { displaced_mm, bearings, base_n, .. } = now;
                return Some(Solved { displaced_mm, bearings, residuals, moved_mm, base_n });
            }
            if now.size_n < best_n {
                (best_n, without_gain) = (now.size_n, 0);
            } else {
                without_gain += 1;
                if without_gain > MAX_WITHOUT_GAIN {
                    return None;
                }
            }
            let step = self.step(&now, &mut tangent)?;
            let longest = step.iter().map(|u| u.length()).fold(0.0, f64::max);
            let closes_mm = self.law.sharing * longest;
            let mut part =
                (LONGEST * self.body.mesh.grading.radius_mm / closes_mm.max(f64::MIN_POSITIVE)).min(1.0);
            let mut found: Option<(f64, f64)> = None;
            let allowed_n = if without_gain < PATIENCE {
                MAX_GROWTH * now.size_n.max(scale_n * 1e-3)
            } else {
                now.size_n
            };
            for _ in 0..MAX_HALVINGS {
                let moved: Vec<DVec3> =
                    now.displaced_mm.iter().zip(&step).map(|(u, s)| *u + *s * part).collect();
                if let Some(forces) = self.body.forces_n(&moved) {
                    let bearings = bear(&moved);
                    let size_n = self.trial(moved, forces, bearings).size_n;
                    if size_n.is_finite() && found.is_none_or(|(_, smallest_n)| size_n < smallest_n) {
                        found = Some((part, size_n));
                    }
                    if size_n < allowed_n {
                        break;
                    }
                }
                part *= 0.5;
            }
            let (part, _) = found?;
            moved_mm = longest * part;
            let moved: Vec<DVec3> = now.displaced_mm.iter().zip(&step).map(|(u, s)| *u + *s * part).collect();
            let (forces, next) = self.body.linearised(&moved)?;
            tangent = next;
            let bearings = bear(&moved);
            now = self.trial(moved, forces, bearings);
        }
        None
    }

    /// Factors of the tangent, or of one with as stiff a spring on each node as it needs: the step is then shorter.
    fn factored(&self, tangent: &mut Tangent) -> Option<Factors> {
        let Body { mesh, material, .. } = self.body;
        let mut spring = SHIFT * material.shear_mpa * mesh.grading.radius_mm;
        for _ in 0..SHIFTS {
            if let Some(factors) = self.body.factor(tangent) {
                return Some(factors);
            }
            for node in (0..mesh.is_base.len()).filter(|node| !mesh.is_base[*node]) {
                let node = node as u32;
                self.body.add(tangent, node, node, &DMat3::from_diagonal(DVec3::splat(spring)));
            }
            spring *= 4.0;
        }
        self.body.factor(tangent)
    }

    /// Newton's step.
    fn step(&self, now: &Trial, tangent: &mut Tangent) -> Option<Vec<DVec3>> {
        let mesh = &self.body.mesh;
        let blocks = now.bearings.blocks(mesh, self.spots);
        for (nodes, even, _) in &blocks {
            for a in 0..9 {
                for b in 0..9 {
                    if nodes[a] >= nodes[b] {
                        self.body.add(tangent, nodes[a], nodes[b], &even[9 * a + b]);
                    }
                }
            }
        }
        self.body.hold_base(tangent);
        let factors = self.factored(tangent)?;
        let mut rhs: Vec<f64> = now.forces_n.iter().flat_map(|force| (-*force).to_array()).collect();
        if now.bearings.is_even {
            self.body.solve(&factors, &mut rhs);
        } else {
            // Sliding friction makes the tangent unsymmetric: its symmetric part goes before.
            let times = |x: &[f64]| {
                let mut y = self.body.times(tangent, x);
                for (nodes, _, odd) in &blocks {
                    for a in (0..9).filter(|a| !mesh.is_base[nodes[*a] as usize]) {
                        for b in (0..9).filter(|b| !mesh.is_base[nodes[*b] as usize]) {
                            let from = 3 * nodes[b] as usize;
                            let of = odd[9 * a + b] * DVec3::new(x[from], x[from + 1], x[from + 2]);
                            let to = 3 * nodes[a] as usize;
                            y[to..to + 3].iter_mut().zip(of.to_array()).for_each(|(y, v)| *y += v);
                        }
                    }
                }
                y
            };
            rhs = gmres(times, |x| self.body.solve(&factors, x), &rhs, STEP)?;
        }
        rhs.iter()
            .all(|value| value.is_finite())
            .then(|| rhs.chunks_exact(3).map(|u| DVec3::new(u[0], u[1], u[2])).collect())
    }
}
