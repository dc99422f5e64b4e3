//! Displacement of the dome's surface, by level.

mod pushed_out;
mod sunk;

use std::sync::Arc;

use glam::DVec3;

use crate::finite_strain::Deformed;
use crate::outcome::Extent;
use domecast_elastic::SurfaceField;
pub(crate) use pushed_out::PushedOut;
pub(crate) use sunk::Sunk;

/// A displacement field over the dome.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Field {
    /// Nothing moves.
    Still,
    /// The geometric rule.
    PushedOut(PushedOut),
    /// Hertz' field, carried to the dome.
    Sunk(Sunk),
    /// The finite elements' own.
    Elastic(SurfaceField),
    /// Several, each by its weight.
    Sum(Vec<(f64, Field)>),
    /// The finite elements' at large strain.
    Solid(Arc<Deformed>),
}

impl Field {
    /// Some fields together, each by its weight.
    pub fn sum(parts: &[(f64, &Self)]) -> Self {
        let mut elastic: Vec<(f64, &SurfaceField)> = Vec::new();
        let mut rest: Vec<(f64, Self)> = Vec::new();
        for (weight, part) in parts {
            match part {
                Self::Still => {}
                Self::Elastic(field) => elastic.push((*weight, field)),
                Self::Sum(parts) => {
                    rest.extend(parts.iter().map(|(own, field)| (weight * own, field.clone())))
                }
                other => rest.push((*weight, (*other).clone())),
            }
        }
        // What the elements move is linear in the forces: one field.
        let elastic = SurfaceField::sum(&elastic).filter(|field| !field.forces().is_empty());
        match elastic.map(Self::Elastic) {
            Some(elastic) if rest.is_empty() => elastic,
            None if rest.is_empty() => Self::Still,
            elastic => {
                rest.extend(elastic.map(|field| (1.0, field)));
                Self::Sum(rest)
            }
        }
    }

    /// Makes ready for many points.
    pub fn prepare(&self, points: usize) {
        match self {
            Self::Elastic(field) => field.prepare(points),
            Self::Sum(parts) => parts.iter().for_each(|(_, field)| field.prepare(points)),
            _ => {}
        }
    }

    /// The displacement of a point of the dome.
    pub fn at(&self, at_mm: DVec3) -> DVec3 {
        match self {
            Self::Still => DVec3::ZERO,
            Self::PushedOut(field) => field.at(at_mm),
            Self::Sunk(field) => field.at(at_mm),
            Self::Elastic(field) => field.at(at_mm),
            Self::Sum(parts) => parts.iter().map(|(weight, field)| field.at(at_mm) * *weight).sum(),
            Self::Solid(field) => field.at(at_mm),
        }
    }

    /// Where it differs from zero.
    pub fn extent(&self) -> Extent {
        match self {
            Self::Still => Extent { direction: DVec3::Z, angle_rad: 0.0, beyond_mm: 0.0 },
            Self::PushedOut(field) => {
                Extent { direction: field.axis, angle_rad: field.angle_rad, beyond_mm: 0.0 }
            }
            Self::Sunk(field) => field.extent(),
            Self::Elastic(field) => field.extent(),
            Self::Sum(parts) => parts.iter().map(|(weight, field)| (*weight, field.extent())).fold(
                Self::Still.extent(),
                |sum, (weight, extent)| {
                    cap_of_both(&sum, &Extent { beyond_mm: weight.abs() * extent.beyond_mm, ..extent })
                },
            ),
            Self::Solid(field) => Extent {
                direction: DVec3::Z,
                angle_rad: std::f64::consts::FRAC_PI_2,
                beyond_mm: field.largest_mm(),
            },
        }
    }
}

/// The least cap about the middle of two that holds both.
fn cap_of_both(a: &Extent, b: &Extent) -> Extent {
    let beyond_mm = a.beyond_mm + b.beyond_mm;
    let [first, second] = if a.angle_rad >= b.angle_rad { [a, b] } else { [b, a] };
    let apart = first.direction.dot(second.direction).clamp(-1.0, 1.0).acos();
    if apart + second.angle_rad <= first.angle_rad || second.angle_rad == 0.0 {
        return Extent { beyond_mm, ..*first };
    }
    let angle_rad = (0.5 * (apart + first.angle_rad + second.angle_rad)).min(std::f64::consts::PI);
    // From the first's middle towards the second's.
    let turn = angle_rad - first.angle_rad;
    let across = (second.direction - first.direction * apart.cos()).normalize_or_zero();
    let direction = (first.direction * turn.cos() + across * turn.sin()).normalize_or(first.direction);
    Extent { direction, angle_rad, beyond_mm }
}
