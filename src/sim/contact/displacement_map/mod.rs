//! The deformed membrane as a smooth table: displacement and normal of any point, in some tens of nanoseconds.
//!
//! The chart is Lambert's equal-area map about the middle of the touched region: `p = R (1 - s/2) e + k (x t1 + y t2)`
//! with `s = (x^2 + y^2) / R^2`, `k = sqrt(1 - s/4)`; it is smooth over the whole dome. Between the nodes the
//! displacement is a cubic spline in each direction, whose second derivative is continuous: the normals have neither
//! steps nor kinks of the table's making.
//!
//! About the pressed part the nodes lie close; where the rest of the dome moves as well, it does so smoothly, and a wide
//! chart with fewer nodes serves.

mod chart;
mod face;

use glam::{DVec3, Vec2, Vec3A};

use self::chart::{Chart, Moved};
use self::face::Face;
use crate::contact::between::Between;
use domecast_contact::Extent;
use domecast_optics::DomeShape;

/// Displacements of less than this bend nothing that a picture shows, mm.
const STILL_MM: f64 = 1e-4;

/// Distance of the wide chart's nodes, mm, and as a part of that of the close one's, where that is more: then they are as far
/// apart as the finite elements, between which slopes jump that a finer table would only copy.
const WIDE_STEP_MM: f64 = 0.6;
const WIDER: f64 = 2.0;

/// Slope of the displacement from which on the membrane may fold over a slanting ray.
const FOLDING: f32 = 0.4;

/// A point further off its ray than this is not where the ray meets the membrane, mm.
pub const MAX_OFF_RAY_MM: f32 = 2e-3;

/// How far beyond the pressed part the nodes lie close, mm.
const CLOSE_MARGIN_MM: f64 = 1.5;

/// Tables of the displaced membrane.
#[derive(Debug, Clone)]
pub struct DisplacementMap {
    face: Face,
    close: Option<Chart>,
    wide: Option<Chart>,
}

/// A point of the deformed membrane.
#[derive(Debug, Clone, Copy)]
pub struct Displaced {
    /// Its displacement, mm.
    pub displacement_mm: Vec3A,
    /// Outward unit normal of the deformed membrane there.
    pub normal: Vec3A,
    /// Its distance from the ray that was followed, mm; 0 where the search for their intersection ended.
    pub off_ray_mm: f32,
}

/// Where the nodes of the tables lie: one for all the times that are to be mixed.
#[derive(Debug, Clone)]
pub struct MapLayout {
    face: Face,
    close: Option<Chart>,
    wide: Chart,
}

impl MapLayout {
    /// For domes that move in `extents` and bear loads in a cap (direction of its middle, half its angle), with nodes
    /// no further apart than `step_mm` about that cap where their number allows; `None` where nothing moves.
    pub fn new(
        extents: &[Extent],
        pressed: Option<(DVec3, f64)>,
        dome: DomeShape,
        step_mm: f64,
    ) -> Option<Self> {
        let middle = extents.iter().map(|e| e.direction).sum::<DVec3>().normalize_or_zero();
        // Each extent, seen from the common middle.
        let angle_of =
            |e: &Extent| e.angle_rad + middle.dot(e.direction.normalize_or(middle)).clamp(-1.0, 1.0).acos();
        let angle = extents.iter().map(angle_of).fold(0.0, f64::max);
        if middle == DVec3::ZERO || angle.is_nan() || angle <= 0.0 {
            return None;
        }
        // Where the rest of the dome moves as well, the chart reaches the farthest point of the rim.
        let whole = |middle: DVec3| middle.z.clamp(-1.0, 1.0).acos() + dome.meridian_end_rad();
        let far = extents.iter().any(|e| e.beyond_mm > STILL_MM);
        let angle = if far { whole(middle) } else { angle.min(whole(middle)) };
        let pressed = pressed
            .map(|(at, half)| (at, (half + CLOSE_MARGIN_MM / dome.radius_mm()).min(whole(at))))
            .filter(|(_, half)| *half < 0.7 * angle);
        let chart = |middle, angle, step_mm| Chart::new(dome, middle, angle, step_mm);
        let face = Face::new(dome);
        Some(match pressed {
            Some((at, half)) => Self {
                face,
                close: Some(chart(at, half, step_mm)),
                wide: chart(middle, angle, (WIDER * step_mm).max(WIDE_STEP_MM)),
            },
            None => Self { face, close: None, wide: chart(middle, angle, step_mm) },
        })
    }

    /// The tables of a dome; zero where it does not move.
    pub fn map(&self, between: &Between) -> DisplacementMap {
        let wide = self.wide.filled(between, None);
        DisplacementMap {
            face: self.face,
            close: self.close.as_ref().map(|chart| chart.filled(between, Some(&wide))),
            wide: Some(wide),
        }
    }
}

impl DisplacementMap {
    /// The tables of a touched dome, with nodes no further apart than `step_mm` about the pressed part where their
    /// number allows; `None` where nothing moves. The second value is the number of nodes.
    pub fn new(between: &Between, dome: DomeShape, step_mm: f64) -> Option<(Self, u64)> {
        let layout = MapLayout::new(&between.extents(), between.pressed_cap(dome), dome, step_mm)?;
        let map = layout.map(between);
        let nodes = map.node_count();
        Some((map, nodes))
    }

    /// Nodes of the tables.
    pub fn node_count(&self) -> u64 {
        self.close.iter().chain(&self.wide).map(Chart::node_count).sum()
    }

    /// The tables a part of the way from these to others of the same layout.
    pub fn towards(&self, to: &Self, part: f64) -> Self {
        let mix = |a: &Option<Chart>, b: &Option<Chart>| match (a, b) {
            (Some(a), Some(b)) => Some(a.towards(b, part as f32)),
            _ => None,
        };
        Self { face: self.face, close: mix(&self.close, &to.close), wide: mix(&self.wide, &to.wide) }
    }

    /// Whether the membrane is so steep somewhere that a ray may meet it more than once: then what a search finds depends
    /// on where it begins.
    pub fn may_fold(&self) -> bool {
        self.close.iter().chain(&self.wide).any(|chart| chart.steepest() > FOLDING)
    }

    /// The place of a chart that serves a point of the undeformed dome best.
    fn near(&self, rest_mm: Vec3A) -> Option<(&Chart, Vec2, Moved)> {
        [&self.close, &self.wide].into_iter().flatten().find_map(|chart| {
            let place = chart.place(rest_mm);
            Some((chart, place, chart.at(place)?))
        })
    }

    /// Area of the deformed membrane over that of the undeformed dome at one of its points; 1 where nothing moves.
    pub fn area_ratio(&self, rest_mm: Vec3A) -> f32 {
        let Some((chart, place, moved)) = self.near(rest_mm) else { return 1.0 };
        let [along_x, along_y] = chart.tangents(place);
        let ratio = moved.along_x.cross(moved.along_y).length() / along_x.cross(along_y).length();
        if ratio.is_finite() { ratio } else { 1.0 }
    }

    /// Where a ray that meets the undeformed dome at `rest_mm` along the unit direction `inside` meets the deformed
    /// one: the undeformed place of that point, and how it moved. `None` where the membrane does not move. `near_mm` is how
    /// a point nearby moved, or zero: there the search begins.
    ///
    /// Newton's method on the chart: the ray meets the tangent plane of the moved membrane, and the way there along the
    /// plane is the next step. A step that does not shrink gives way to the plain one, the point of the face on the
    /// ray moved back by the displacement, which does as long as the membrane does not fold. Where neither ends, the last
    /// tries begin at the nearest place so far and take of Newton's step what brings the membrane nearer to the ray.
    pub fn meet(&self, rest_mm: Vec3A, inside: Vec3A, near_mm: Vec3A) -> Option<(Vec3A, Displaced)> {
        let mut place =
            if near_mm == Vec3A::ZERO { rest_mm } else { self.face.meet_back(rest_mm, inside, near_mm) };
        let mut last = f32::INFINITY;
        let mut nearest: Option<Nearest<'_>> = None;
        for step in 1..=MAX_STEPS + MAX_DAMPED_STEPS {
            let (chart, at, moved) = self.near(place)?;
            let normal = moved.along_x.cross(moved.along_y);
            let surface = place + moved.displacement_mm;
            let along = (surface - rest_mm).dot(normal) / inside.dot(normal);
            let miss = rest_mm + inside * along - surface;
            let miss2 = miss.length_squared();
            let per = normal.length_squared().recip();
            let on_plane =
                Vec2::new(miss.cross(moved.along_y).dot(normal), moved.along_x.cross(miss).dot(normal)) * per;
            let normal = normal.try_normalize().unwrap_or(place.normalize_or(Vec3A::Z));
            if miss2 < NEAR_MM * NEAR_MM {
                // So near that the tangent plane is the membrane: the point on it, and where that was.
                let place = chart.point_near(at + on_plane);
                let displacement_mm = surface + miss - place;
                return Some((place, Displaced { displacement_mm, normal, off_ray_mm: 0.0 }));
            }
            let off2 = (surface - rest_mm).reject_from_normalized(inside).length_squared();
            let here = Nearest {
                chart,
                at,
                on_plane: on_plane.clamp_length_max(FARTHEST_MM),
                off2,
                part: 1.0,
                met: (
                    place,
                    Displaced { displacement_mm: moved.displacement_mm, normal, off_ray_mm: off2.sqrt() },
                ),
            };
            // What is not a number is no nearer.
            let is_nearer = on_plane.is_finite() && nearest.is_none_or(|best| off2 < best.off2);
            nearest = if is_nearer {
                Some(here)
            } else {
                nearest.map(|best| Nearest { part: 0.5 * best.part, ..best })
            };
            place = if step >= MAX_STEPS {
                nearest?.next()
            } else if miss2 < 0.25 * last && miss2 < FARTHEST_MM * FARTHEST_MM {
                chart.point_near(at + on_plane)
            } else {
                self.face.meet_back(rest_mm, inside, moved.displacement_mm)
            };
            last = miss2;
        }
        nearest.map(|best| best.met)
    }
}

/// The place nearest to a ray that a search has seen, and how it goes on from there.
#[derive(Clone, Copy)]
struct Nearest<'a> {
    chart: &'a Chart,
    at: Vec2,
    /// Newton's step.
    on_plane: Vec2,
    /// Square of the distance from the ray, mm2.
    off2: f32,
    /// The part of the step that is tried next.
    part: f32,
    met: (Vec3A, Displaced),
}

impl Nearest<'_> {
    fn next(&self) -> Vec3A {
        self.chart.point_near(self.at + self.on_plane * self.part)
    }
}

/// Repetitions of [`DisplacementMap::meet`]; a slope of 0.5 leaves a thousandth after ten.
const MAX_STEPS: u32 = 10;
/// More of them, damped, where those do not end.
const MAX_DAMPED_STEPS: u32 = 24;
/// A step no longer than this is the last, mm: over it a membrane turns by a thousandth of a radian where it is sharpest, which
/// is tenths of a grey level.
const NEAR_MM: f32 = 4e-4;
/// A step longer than this is none of Newton's, mm.
const FARTHEST_MM: f32 = 1.0;
