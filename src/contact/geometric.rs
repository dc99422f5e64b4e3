//! The geometric level: what lies inside the object is pushed out of it.
//!
//! A point of the dome inside the object moves along the dome's own inward normal until it lies on the object's
//! surface; every other point stays. The force is that of an elastic foundation, p = K d for a push-out d, with
//! K = (4 sqrt 2 / 3 pi) E* / a, a the radius of a disc of the touched area, measured as 4/3 (int d)^2 / int d^2 so
//! that it changes smoothly: then a ball gets Hertz' force exactly (its push-out is a paraboloid of radius
//! sqrt(2 Re d)), a cone Sneddon's to 5 %, a flat punch its own to 19 %.

use std::sync::LazyLock;

use glam::DVec3;

use super::solid::Solid;
use super::state::TouchedNode;
use domecast_optics::numeric::Rigid;

/// The foundation's constant, 4 sqrt 2 / (3 pi): see the module.
pub(super) const FOUNDATION: f64 = 4.0 * std::f64::consts::SQRT_2 / (3.0 * std::f64::consts::PI);

/// Steps of a walk to the surface.
const MOST_STEPS: usize = 64;

/// An object at its place, seen from the dome.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    pub solid: Solid,
    sensor_from_object: Rigid,
    object_from_sensor: Rigid,
}

impl Placed {
    pub fn new(solid: Solid, sensor_from_object: Rigid) -> Self {
        Self { solid, sensor_from_object, object_from_sensor: sensor_from_object.inverse() }
    }

    /// Puts the object to another pose.
    pub fn move_to(&mut self, sensor_from_object: Rigid) {
        self.sensor_from_object = sensor_from_object;
        self.object_from_sensor = sensor_from_object.inverse();
    }

    pub fn sensor_from_object(&self) -> Rigid {
        self.sensor_from_object
    }

    pub fn object_from_sensor(&self) -> Rigid {
        self.object_from_sensor
    }

    /// Centre and radius, if the object is a ball.
    pub fn ball(&self) -> Option<(DVec3, f64)> {
        self.solid.is_ball().then(|| {
            let (center, radius_mm) = self.solid.bounding_sphere();
            (self.sensor_from_object.point(center), radius_mm)
        })
    }

    /// Signed distance and outward direction, sensor frame.
    pub fn distance(&self, at_mm: DVec3) -> (f64, DVec3) {
        let found = self.solid.distance(self.object_from_sensor.point(at_mm));
        (found.value_mm, self.sensor_from_object.vector(found.outward))
    }

    /// Where a walk from inside the object along a direction leaves it: the way walked (mm), and the object's
    /// outward direction there; `None` if it does not within `most_mm`. Zero for a point outside.
    ///
    /// Newton's steps along the way; where the surface turns away, the distance itself is a safe step, since no
    /// point of the surface is nearer than that.
    pub fn walk_out(&self, from_mm: DVec3, along: DVec3, most_mm: f64) -> Option<(f64, DVec3)> {
        self.walk_on(self.distance(from_mm), from_mm, along, most_mm)
    }

    /// [`Self::walk_out`] from where the distance is known.
    fn walk_on(
        &self,
        (mut value, mut outward): (f64, DVec3),
        from_mm: DVec3,
        along: DVec3,
        most_mm: f64,
    ) -> Option<(f64, DVec3)> {
        if value >= 0.0 {
            return Some((0.0, outward));
        }
        if let Some((center, radius_mm)) = self.ball() {
            let from_center = from_mm - center;
            let b = from_center.dot(along);
            let way = (b * b + radius_mm * radius_mm - from_center.length_squared()).max(0.0).sqrt() - b;
            let outward = (from_center + along * way) / radius_mm;
            return (way <= most_mm).then_some((way, outward));
        }
        let tiny = 1e-10 * most_mm;
        let (mut inside, mut way) = (0.0, 0.0_f64);
        for _ in 0..MOST_STEPS {
            let slope = outward.dot(along);
            let step = if value < 0.0 {
                inside = f64::max(inside, way);
                -value / slope.clamp(0.25, 1.0)
            } else if slope > 0.25 {
                -value / slope
            } else {
                -value
            };
            let next = (way + step).max(0.5 * (inside + way));
            way = next;
            if way > most_mm {
                return None;
            }
            (value, outward) = self.distance(from_mm + along * way);
            if value.abs() <= tiny {
                return Some((way, outward));
            }
        }
        // A crease met at a grazing angle: the point is as near as the last steps brought it.
        (value.abs() <= 1e-4 * most_mm).then_some((way, outward))
    }
}

/// Displacement of one point of the dome under the rule.
pub(super) fn pushed_out(placed: &Placed, dome_radius_mm: f64, at_mm: DVec3) -> DVec3 {
    let inward = -at_mm.normalize_or_zero();
    placed.walk_out(at_mm, inward, dome_radius_mm).map_or(DVec3::ZERO, |(way, _)| inward * way)
}

/// The touched region, sampled.
#[derive(Debug, Clone, Default)]
pub(super) struct Overlap {
    /// Deepest point of the undeformed dome, and the signed distance there.
    pub deepest_mm: DVec3,
    pub distance_mm: f64,
    /// Samples inside the object: place, area, push-out, the object's outward direction.
    pub samples: Vec<(DVec3, f64, f64, DVec3)>,
    /// Touched area by the push-out's moments, mm2.
    pub area_mm2: f64,
    /// Half angle of the cap about the deepest point that holds the samples, rad.
    pub angle_rad: f64,
    /// Distances asked for.
    pub queries: usize,
    /// Whether every sample found its way out.
    pub all_out: bool,
}

/// Scattered directions over the hemisphere (a golden-angle spiral), for the first look.
fn first_looks() -> impl Iterator<Item = DVec3> {
    static SPIRAL: LazyLock<Vec<DVec3>> = LazyLock::new(|| {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let place = |i: usize| {
            let z = 1.0 - (i as f64 + 0.5) / FIRST_LOOK as f64;
            let (sine, cosine) = (golden * i as f64).sin_cos();
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * cosine, r * sine, z)
        };
        (0..FIRST_LOOK).map(place).collect()
    });
    SPIRAL.iter().copied()
}

const FIRST_LOOK: usize = 400;

/// Distance of the first looks, rad: side of a look's share of the hemisphere.
fn look_spacing() -> f64 {
    (std::f64::consts::TAU / FIRST_LOOK as f64).sqrt()
}
const RINGS: usize = 24;
const SPOKES: usize = 48;
const STARTS: usize = 3;
/// Distances that one search may ask for; a search takes some two hundred, one along an edge of the object more.
const MOST_QUERIES: usize = 1_500;
/// Turn of the searched directions from step to step, rad: the golden angle, so that one of them soon lies along an
/// edge on which the others only creep.
const SEARCH_TURN: f64 = 2.399_963_229_728_653;

/// Two directions that complete a unit vector to a right-handed frame.
pub(super) fn frame_of(normal: DVec3) -> (DVec3, DVec3) {
    normal.any_orthonormal_pair()
}

/// Deepest point of the dome in the object: first look, then a pattern search from the best looks.
pub(super) fn deepest(placed: &Placed, radius: f64) -> (DVec3, f64, usize) {
    let (center, reach) = placed.solid.bounding_sphere();
    let center = placed.sensor_from_object.point(center);
    let nearest_possible = center.length() - reach - radius;
    let towards = {
        let d = center.normalize_or(DVec3::Z);
        DVec3::new(d.x, d.y, d.z.max(0.0)).normalize_or(DVec3::Z)
    };
    let mut queries = 1;
    if nearest_possible > 0.0 {
        return (towards * radius, nearest_possible, queries);
    }
    if placed.solid.is_ball() {
        return (towards * radius, placed.distance(towards * radius).0, queries);
    }
    // The deepest place lies within a look's own room of one of them, and no distance changes by more than the way.
    let room = radius * look_spacing();
    let mut best = placed.distance(towards * radius).0;
    let mut looks = vec![(best, towards)];
    for direction in first_looks() {
        let at = direction * radius;
        if at.distance(center) - reach < best + room {
            let value = placed.distance(at).0;
            best = best.min(value);
            looks.push((value, direction));
            queries += 1;
        }
    }
    looks.retain(|look| look.0 <= best + room);
    looks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts: Vec<(f64, DVec3)> = Vec::new();
    for look in looks {
        if starts.len() < STARTS && starts.iter().all(|other| other.1.dot(look.1) < 0.97) {
            starts.push(look);
        }
    }
    let mut best = (f64::INFINITY, DVec3::Z);
    for start in starts {
        let (value, direction, asked) = descend(placed, radius, start, 0.08);
        queries += asked;
        if value < best.0 {
            best = (value, direction);
        }
    }
    (best.1 * radius, best.0, queries)
}

/// The deepest point near another one.
pub(super) fn deepest_from(placed: &Placed, radius: f64, near_mm: DVec3) -> (DVec3, f64, usize) {
    let start = (placed.distance(near_mm).0, near_mm / radius);
    let (value, direction, queries) = descend(placed, radius, start, 0.02);
    (direction * radius, value, queries + 1)
}

/// Pattern search on the dome: distance, direction, distances asked for.
fn descend(
    placed: &Placed,
    radius: f64,
    (mut value, mut direction): (f64, DVec3),
    mut step: f64,
) -> (f64, DVec3, usize) {
    let mut queries = 0;
    while step > 1e-7 && queries < MOST_QUERIES {
        let (u, v) = frame_of(direction);
        let (sine, cosine) = (SEARCH_TURN * (queries / 4) as f64).sin_cos();
        let (u, v) = (u * cosine + v * sine, v * cosine - u * sine);
        let tries = [u, v, -u, -v].map(|way| {
            let mut d = direction + way * step;
            d.z = d.z.max(0.0);
            let d = d.normalize_or(direction);
            (placed.distance(d * radius).0, d)
        });
        queries += 4;
        let found = tries.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        match found {
            Some((lower, d)) if lower < value => (value, direction) = (lower, d),
            _ => step *= 0.5,
        }
    }
    (value, direction, queries)
}

/// Samples the part of the dome that lies inside the object.
pub(super) fn overlap(placed: &Placed, radius: f64) -> Overlap {
    let (deepest_mm, distance_mm, queries) = deepest(placed, radius);
    let mut found = Overlap { deepest_mm, distance_mm, queries, all_out: true, ..Default::default() };
    if distance_mm >= 0.0 {
        return found;
    }
    if placed.solid.is_mesh() {
        found.deepest_mm = pressed_middle(placed, radius);
        found.queries += FIRST_LOOK;
    }
    let axis = found.deepest_mm / radius;
    let (u, v) = frame_of(axis);
    let azimuths: [(f64, f64); SPOKES] =
        std::array::from_fn(|k| ((k as f64 + 0.5) * std::f64::consts::TAU / SPOKES as f64).sin_cos());
    let spokes = azimuths.map(|(sine, cosine)| u * cosine + v * sine);
    // The cap that holds every touched look, then the same cap looked at closely.
    let (center, reach) = placed.solid.bounding_sphere();
    let center = placed.sensor_from_object().point(center);
    let coarse = first_looks()
        .filter(|d| (*d * radius).distance(center) < reach && placed.distance(*d * radius).0 < 0.0)
        .chain([deepest_mm / radius])
        .map(|d| d.dot(axis))
        .fold(1.0, f64::min)
        .clamp(-1.0, 1.0)
        .acos()
        + 1.5 * look_spacing();
    let touched = |angle: f64| {
        let (sine, cosine) = angle.sin_cos();
        spokes.iter().step_by(2).any(|spoke| {
            let d = axis * cosine + *spoke * sine;
            d.z >= 0.0 && placed.distance(d * radius).0 < 0.0
        })
    };
    let rings = (1..=RINGS).rev().find(|ring| touched(coarse * *ring as f64 / RINGS as f64)).unwrap_or(0);
    // The edge by bisection, so that the samples move smoothly with the object.
    let (mut low, mut high) =
        (coarse * rings as f64 / RINGS as f64, coarse * (rings + 1) as f64 / RINGS as f64);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if touched(middle) { low = middle } else { high = middle }
    }
    let cap = (1.02 * high).min(std::f64::consts::PI);
    found.queries += FIRST_LOOK + (RINGS + 30) * (SPOKES / 2);
    let (mut first, mut second) = (0.0, 0.0);
    for ring in 0..RINGS {
        // Rings of equal width; each sample stands for its exact share of the sphere.
        let (low, high) = (cap * ring as f64 / RINGS as f64, cap * (ring + 1) as f64 / RINGS as f64);
        let area = radius * radius * (low.cos() - high.cos()) * std::f64::consts::TAU / SPOKES as f64;
        let (sine, cosine) = (0.5 * (low + high)).sin_cos();
        for spoke in &spokes {
            let direction = axis * cosine + *spoke * sine;
            if direction.z < 0.0 {
                continue;
            }
            let at = direction * radius;
            found.queries += 1;
            let here = placed.distance(at);
            let inside_mm = -here.0;
            if inside_mm <= 0.0 {
                continue;
            }
            found.queries += 4;
            match placed.walk_on(here, at, -direction, radius) {
                Some((way, outward)) => {
                    let way = way.min(STEEPEST * inside_mm);
                    found.samples.push((at, area, way, outward));
                    first += way * area;
                    second += way * way * area;
                    found.angle_rad = high;
                }
                None => found.all_out = false,
            }
        }
    }
    if second > 0.0 {
        found.area_mm2 = 4.0 / 3.0 * first * first / second;
    }
    if placed.solid.is_mesh() {
        found.distance_mm = -found.samples.iter().map(|(_, _, way, _)| *way).fold(0.0, f64::max);
    }
    found
}

/// What presses on a sample is at most this often its distance from the object's surface. A face that is met head on
/// never comes near that; beside a steep wall, where a sample would enter the object at its whole depth, the
/// pressure rises over a quarter of the depth instead: forces then have no steps in the object's pose, on which no
/// search for a balance could end.
const STEEPEST: f64 = 4.0;

/// Middle of what is pressed by a body with edges. Its deepest point may jump from edge to edge with the least turn, and
/// the samples about it would with it; this one moves smoothly: the looks' mean, the deeper ones
/// counted more.
fn pressed_middle(placed: &Placed, radius: f64) -> DVec3 {
    /// Depth over which a look loses its weight, as a part of the radius.
    const SOFTNESS: f64 = 0.02;
    let looks: Vec<(f64, DVec3)> =
        first_looks().map(|d| (placed.distance(d * radius).0 / (SOFTNESS * radius), d)).collect();
    let least = looks.iter().map(|look| look.0).fold(f64::INFINITY, f64::min);
    let mean: DVec3 = looks.iter().map(|(value, d)| *d * (least - value).exp()).sum();
    mean.normalize_or(DVec3::Z) * radius
}

/// Pressures on the samples for a foundation of the modulus `k_mpa_per_mm`.
pub(super) fn nodes_of(overlap: &Overlap, k_mpa_per_mm: f64) -> Vec<TouchedNode> {
    overlap
        .samples
        .iter()
        .map(|&(at_mm, area_mm2, way, outward)| {
            let pressure_mpa = k_mpa_per_mm * way;
            // Across a side wall the way out is not along the object's normal; the push still is.
            let force_n = outward * (pressure_mpa * area_mm2);
            TouchedNode { at_mm, area_mm2, force_n, pressure_mpa, sticks: false }
        })
        .collect()
}
