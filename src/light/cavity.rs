//! The room that the upper platform leaves to the light: a union of convex hollows.
//!
//! The platform is made by cutting boxes, cones and cylinders; a straight ray between two points in air meets
//! each of them in one interval at most. It is free if the intervals together cover it. So the shadow is that
//! of the very shapes that are printed, to rounding, without a mesh.

use glam::{DAffine3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Gap between two intervals, as a share of the ray, that is rounding.
const ROUNDING: f64 = 1e-9;

/// By what a hollow's box is wider than it is, mm: a ray along its face still meets it.
const WIDER_MM: f64 = 1e-6;

/// A convex hollow in its own frame, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Convex {
    /// Upright planes between two heights.
    Faces {
        /// Normal and offset of each: inside where `normal . (x, y) <= offset`, mm.
        sides: Vec<([f64; 2], f64)>,
        /// Lower height.
        bottom_mm: f64,
        /// Upper height.
        top_mm: f64,
        /// No corner lies further from the axes.
        reach_mm: [f64; 2],
    },
    /// A frustum about z: radius `radius_mm + slope (z - bottom_mm)`.
    Frustum {
        /// Lower height.
        bottom_mm: f64,
        /// Upper height.
        top_mm: f64,
        /// Radius at the lower height.
        radius_mm: f64,
        /// Growth of the radius with height.
        slope: f64,
    },
}

#[derive(Debug, Clone, PartialEq)]
struct Hollow {
    shape: Convex,
    own_from_part: DAffine3,
    /// Corners of a box around it in the part's frame, mm; a little wider than it is.
    low_mm: DVec3,
    high_mm: DVec3,
}

/// All hollows of a part.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cavities {
    hollows: Vec<Hollow>,
}

impl Cavities {
    /// The hollows of a part: each in a frame of its own, and that frame's pose.
    pub fn new(hollows: impl IntoIterator<Item = (Convex, DAffine3)>) -> Self {
        Self { hollows: hollows.into_iter().map(|(shape, own)| Hollow::new(shape, own)).collect() }
    }

    /// The hollows, each with `own_from_part`.
    pub fn iter(&self) -> impl Iterator<Item = (&Convex, &DAffine3)> {
        self.hollows.iter().map(|hollow| (&hollow.shape, &hollow.own_from_part))
    }

    /// How many convex hollows there are.
    pub fn count(&self) -> usize {
        self.hollows.len()
    }

    /// Those of the hollows that reach into a range of heights: a ray that stays in it meets no others.
    pub fn between(mut self, low_z_mm: f64, high_z_mm: f64) -> Self {
        self.hollows.retain(|hollow| hollow.low_mm.z <= high_z_mm && hollow.high_mm.z >= low_z_mm);
        self
    }

    /// Whether the straight way between two points is free of the part's material.
    ///
    /// For a ray that stays within the part's outer faces; outside them everything counts as material.
    pub fn is_free(&self, from_mm: DVec3, to_mm: DVec3) -> bool {
        self.near(from_mm.min(to_mm), from_mm.max(to_mm)).is_free(from_mm, to_mm)
    }

    /// The hollows that reach into a box: all that rays inside it may meet.
    pub fn near(&self, low_mm: DVec3, high_mm: DVec3) -> NearHollows<'_> {
        let reaches = |hollow: &&Hollow| (low_mm.cmple(hollow.high_mm) & high_mm.cmpge(hollow.low_mm)).all();
        NearHollows(self.hollows.iter().filter(reaches).collect())
    }
}

/// Hollows that the rays of a box may meet; those first that carried the last ray on, for rays beside it mostly meet the same.
#[derive(Debug)]
pub struct NearHollows<'a>(Vec<&'a Hollow>);

impl NearHollows<'_> {
    /// [`Cavities::is_free`] for a ray inside the box.
    pub fn is_free(&mut self, from_mm: DVec3, to_mm: DVec3) -> bool {
        // A hollow that the front lies in carries it on to its far side; where no other hollow does, it is blocked.
        let mut front = 0.0;
        for carried in 0..self.0.len() {
            let front_mm = from_mm.lerp(to_mm, front);
            let next = self.0.iter().enumerate().skip(carried).find_map(|(k, hollow)| {
                let (enter, leave) =
                    hollow.box_holds(front_mm).then(|| hollow.interval(from_mm, to_mm)).flatten()?;
                (enter <= front + ROUNDING && leave > front).then_some((k, leave))
            });
            let Some((k, leave)) = next else { return false };
            front = leave;
            self.0.swap(carried, k);
            if front >= 1.0 - ROUNDING {
                return true;
            }
        }
        false
    }
}

impl Hollow {
    fn new(shape: Convex, own_from_part: DAffine3) -> Self {
        let part_from_own = own_from_part.inverse();
        let (reach, bottom, top) = match &shape {
            Convex::Frustum { bottom_mm: bottom, top_mm: top, radius_mm: radius, slope } => {
                let widest = radius.max(radius + slope * (top - bottom));
                (DVec2::splat(widest), *bottom, *top)
            }
            Convex::Faces { reach_mm: reach, bottom_mm: bottom, top_mm: top, .. } => {
                (DVec2::from_array(*reach), *bottom, *top)
            }
        };
        let (mut low_mm, mut high_mm) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for k in 0..8 {
            let side = |bit: u32, size: f64| if k & bit == 0 { -size } else { size };
            let z = if k & 4 == 0 { bottom } else { top };
            let corner = part_from_own.transform_point3(DVec3::new(side(1, reach.x), side(2, reach.y), z));
            (low_mm, high_mm) = (low_mm.min(corner), high_mm.max(corner));
        }
        Self { shape, own_from_part, low_mm: low_mm - WIDER_MM, high_mm: high_mm + WIDER_MM }
    }

    /// Whether a point lies in the box around it.
    fn box_holds(&self, at_mm: DVec3) -> bool {
        (at_mm.cmple(self.high_mm) & at_mm.cmpge(self.low_mm)).all()
    }

    /// The part of the ray from `from` (0) to `to` (1) that lies inside.
    fn interval(&self, from: DVec3, to: DVec3) -> Option<(f64, f64)> {
        let origin = self.own_from_part.transform_point3(from);
        let way = self.own_from_part.transform_vector3(to - from);
        let mut span = (0.0_f64, 1.0_f64);
        // inside where value + s * slope <= 0; whether anything is left
        let mut keep = |value: f64, slope: f64| {
            if slope > 0.0 {
                span.1 = span.1.min(-value / slope);
            } else if slope < 0.0 {
                span.0 = span.0.max(-value / slope);
            } else if value > 0.0 {
                span.1 = f64::NEG_INFINITY;
            }
            span.0 < span.1
        };
        match &self.shape {
            Convex::Faces { sides, bottom_mm: bottom, top_mm: top, .. } => {
                if !(keep(origin.z - top, way.z) && keep(bottom - origin.z, -way.z)) {
                    return None;
                }
                for (normal, offset) in sides {
                    let normal = DVec2::from_array(*normal);
                    if !keep(normal.dot(origin.truncate()) - offset, normal.dot(way.truncate())) {
                        return None;
                    }
                }
            }
            Convex::Frustum { bottom_mm: bottom, top_mm: top, radius_mm: radius, slope } => {
                if !(keep(origin.z - top, way.z) && keep(bottom - origin.z, -way.z)) {
                    return None;
                }
                let r0 = radius + slope * (origin.z - bottom);
                let r1 = slope * way.z;
                let (p, d) = (origin.truncate(), way.truncate());
                let a = d.length_squared() - r1 * r1;
                let b = p.dot(d) - r0 * r1;
                let c = p.length_squared() - r0 * r0;
                let inside = quadratic_span(a, b, c, |s| r0 + r1 * s >= 0.0, span)?;
                span = inside;
            }
        }
        (span.0 < span.1).then_some(span)
    }
}

/// Where `a s^2 + 2 b s + c <= 0` and the radius is not negative, within a span. The frustum is convex, so it
/// is one interval; the radius excludes the other nappe of its cone.
fn quadratic_span(
    a: f64,
    b: f64,
    c: f64,
    on_this_nappe: impl Fn(f64) -> bool,
    span: (f64, f64),
) -> Option<(f64, f64)> {
    if span.0 >= span.1 {
        return None;
    }
    let inside = |s: f64| (a * s + 2.0 * b) * s + c <= 0.0 && on_this_nappe(s);
    // Roots inside the span cut it; the piece whose middle is inside is the one.
    let mut cuts = [span.0, span.1, span.1, span.1];
    let mut count = 1;
    let root = b * b - a * c;
    if root >= 0.0 {
        let q = -(b + root.sqrt().copysign(b));
        let mut found = [if a == 0.0 { f64::NAN } else { q / a }, if q == 0.0 { f64::NAN } else { c / q }];
        if found[0] > found[1] {
            found.swap(0, 1);
        }
        for s in found {
            if s > span.0 && s < span.1 {
                cuts[count] = s;
                count += 1;
            }
        }
    }
    cuts[count] = span.1;
    let mut result: Option<(f64, f64)> = None;
    for pair in cuts[..=count].windows(2) {
        if inside(0.5 * (pair[0] + pair[1])) {
            result = Some(result.map_or((pair[0], pair[1]), |(low, _)| (low, pair[1])));
        }
    }
    result
}
