//! Where the opening for the camera's view leaves too little beside a seat: how far the seat must go outwards.
//!
//! Walls are measured on the shapes themselves, which tells how thin one is, but not what would do. Here the seats
//! are moved outwards until the opening, taken as circles at each height, is far enough.

use glam::{DVec2, DVec3};
use serde_json::json;

use super::error::Cure;
use super::measures::polar;
use super::seats::unheld;
use super::{Measures, PartError, ViewCone, purchased};
use crate::spec::Design;
use crate::spec::sections::SpringPlaces;

/// Walls are asked to be this much thicker than the limit: the shapes themselves are not quite the circles.
const WALL_FACTOR: f64 = 1.05;

/// Least wall between the opening and points of a seat at a place, mm: sideways, less the opening's slope.
fn wall_mm(view: &ViewCone, beside: DVec2, points_mm: &[DVec3]) -> f64 {
    points_mm.iter().map(|p| view.clearance_mm(p.truncate() - beside, p.z)).fold(f64::INFINITY, f64::min)
}

/// How far outwards a seat must go until its wall is thick enough; 0 if it is.
fn outwards_mm(limit_mm: f64, far_mm: f64, wall_mm: impl Fn(f64) -> f64) -> f64 {
    if wall_mm(0.0) >= limit_mm {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, far_mm);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if wall_mm(middle) < limit_mm { low = middle } else { high = middle }
    }
    high
}

/// The seats that the camera's view cuts into, each with the place that would do. Meant for parts whose walls were
/// found too thin.
pub(super) fn faults(design: &Design, m: &Measures) -> Vec<PartError> {
    let mut found = Vec::new();
    found.extend(springs(design, m));
    found.extend(lights(m));
    found.extend(mounting(m));
    found
}

fn circle(at: DVec2, radius_mm: f64, heights_mm: [f64; 2]) -> Vec<DVec3> {
    (0..48)
        .flat_map(|k| {
            let p = at + radius_mm * DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 48.0);
            heights_mm.map(|z| p.extend(z))
        })
        .collect()
}

/// Spring seats against the openings of both platforms.
fn springs(design: &Design, m: &Measures) -> Option<PartError> {
    let (pocket, depth) = m.pocket_mm();
    let pocket = pocket.max(0.5 * m.spring_outer_mm);
    let limit = m.process.min_wall_mm;
    let (under, top) = (m.platforms.upper.underside_z_mm, m.lower_top_z_mm);
    let pupil = m.pupil_mm().truncate();
    let mut worst: Option<(usize, f64, f64)> = None;
    for (i, axis) in m.spring_axes_mm.iter().enumerate() {
        let way = axis.normalize_or(DVec2::X);
        let wall = |by: f64| {
            let at = *axis + way * by;
            let upper = wall_mm(&m.view, DVec2::ZERO, &circle(at, pocket, [under, under + depth]));
            let lower = m
                .lower_view
                .as_ref()
                .map_or(f64::INFINITY, |view| wall_mm(view, pupil, &circle(at, pocket, [top - depth, top])));
            upper.min(lower)
        };
        if wall(0.0) >= limit * (1.0 - 1e-3) {
            continue;
        }
        let by =
            outwards_mm(WALL_FACTOR * limit, 2.0 * m.outer_mm.max_element() + m.view.max_radius_mm(), wall);
        if worst.is_none_or(|(_, largest, _)| by > largest) {
            worst = Some((i, by, wall(0.0)));
        }
    }
    let (i, by, wall) = worst?;
    let cure = match &design.sections().springs.places {
        SpringPlaces::Ring(ring) => {
            Cure::length("springs.places.ring.radius_mm", ring.radius_mm, ring.radius_mm + by)
        }
        SpringPlaces::Listed(list) => {
            let at = list.get(i).map_or(DVec2::X, |at| DVec2::from_array(*at));
            let to = at + at.normalize_or(DVec2::X) * (by + 0.01);
            let to = to.to_array().map(|x| (x * 100.0).round() / 100.0);
            Cure::value(format!("springs.places.listed[{i}]"), json!(to))
        }
    };
    let name = format!("seat of spring {i}");
    Some(unheld([&name, "the camera's view"], "wall between them", [wall, limit], cure))
}

/// LED pits against the window: the lip between them.
fn lights(m: &Measures) -> Option<PartError> {
    let leds = &m.leds;
    let limit = m.process.min_wall_mm;
    let gap = leds.clearance_mm;
    let half = DVec2::new(leds.board_mm[0].max(leds.package_mm[0]), leds.board_mm[1].max(leds.package_mm[1]))
        * 0.5
        + DVec2::splat(gap);
    let front = leds.diffuser_thickness_mm + gap;
    let mut worst: Option<(usize, f64, f64)> = None;
    for (i, led) in leds.list.iter().enumerate() {
        let to_platform = m.platform_from_led(i);
        let way = polar(1.0, led.azimuth_deg).extend(0.0);
        let wall = |by: f64| {
            let points: Vec<DVec3> = (0..=8)
                .flat_map(|x| (0..=8).map(move |y| (f64::from(x) / 4.0 - 1.0, f64::from(y) / 8.0)))
                .filter_map(|(x, y)| {
                    let low = leds.board_offset_mm - half.y;
                    let at = DVec3::new(x * half.x, low + y * 2.0 * half.y, front);
                    let p = to_platform.transform_point3(at) + way * by;
                    (p.z <= leds.lip_top_z_mm).then_some(p)
                })
                .collect();
            wall_mm(&m.view, DVec2::ZERO, &points)
        };
        if wall(0.0) >= limit * (1.0 - 1e-3) {
            continue;
        }
        let by = outwards_mm(WALL_FACTOR * limit, 2.0 * m.outer_mm.max_element(), wall);
        if worst.is_none_or(|(_, largest, _)| by > largest) {
            worst = Some((i, by, wall(0.0)));
        }
    }
    let (i, by, wall) = worst?;
    let cure = Cure::length("leds.center_radius_mm", leds.center_radius_mm, leds.center_radius_mm + by);
    let name = format!("pit of LED {i}");
    Some(unheld([&name, "the camera's view"], "lip between them", [wall, limit], cure))
}

/// Mounting holes against the opening of the lower platform.
fn mounting(m: &Measures) -> Option<PartError> {
    let view = m.lower_view.as_ref()?;
    let mounting = &m.platforms.lower.mounting;
    let limit = m.process.min_wall_mm;
    let radius = 0.5 * mounting.hole_diameter_mm.max(mounting.counterbore_diameter_mm);
    let top = m.lower_top_z_mm;
    let heads: Vec<[f64; 3]> = purchased::screw_heads(m)
        .iter()
        .filter_map(|head| head.shape.triangulate(&head.name, m.chord).ok()?.bounds())
        .map(|b| [0.5 * b.size_mm().x, b.min_mm.z, b.max_mm.z])
        .collect();
    mounting.at_mm.iter().enumerate().find_map(|(i, at)| {
        let at = DVec2::from_array(*at);
        let way = at.normalize_or(DVec2::X);
        let wall =
            |by: f64| wall_mm(view, m.pupil_mm().truncate(), &circle(at + way * by, radius, [top, top]));
        if wall(0.0) >= limit * (1.0 - 1e-3) {
            return None;
        }
        // The head, which is wider and stands higher, must come out of the view as well.
        let with_head = |by: f64| {
            let head = heads.get(i).map_or(f64::INFINITY, |[wide, floor, high]| {
                wall_mm(view, m.pupil_mm().truncate(), &circle(at + way * by, *wide, [*floor, *high]))
            });
            wall(by).min(head)
        };
        let far = 2.0 * m.outer_mm.max_element() + view.max_radius_mm();
        let by = outwards_mm(WALL_FACTOR * limit, far, with_head);
        let to = (at + way * (by + 0.01)).to_array().map(|x| (x * 100.0).round() / 100.0);
        let cure = Cure::value(format!("platforms.lower.mounting.at_mm[{i}]"), json!(to));
        let name = format!("mounting screw {i}");
        Some(unheld([&name, "the camera's view"], "wall between them", [wall(0.0), limit], cure))
    })
}
