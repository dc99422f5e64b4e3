//! A rigid mount: its posts and screws, and what it does without, for the other rules serve springs.

use glam::{DVec2, dvec2};
use serde_json::Value;

use super::board::{self, HEAD_PART, SCREW_HOLE_MM};
use super::geometry::{bore_mm, lower_top_mm, view_mm, wall_mm};
use super::known::{Known, lookup};
use super::rule::{DerivedField, Rule, follows};

/// Sections that only springs need; a rigid mount refuses them where they are given.
const OF_SPRINGS: [&str; 4] = ["springs", "magnets", "magnet_pockets", "white_markers"];

/// Whether the platform stands on posts.
pub(super) fn is_rigid(design: &Value) -> bool {
    lookup(design, "mount.kind").is_some_and(|kind| kind == "rigid")
}

/// The sections of springs that a design with a rigid mount leaves out: rules may use their numbers (heights as if
/// springs stood there), and [`strip`] takes them away again. Empty for springs.
pub(super) fn to_strip(design: &Value) -> Vec<&'static str> {
    if !is_rigid(design) {
        return Vec::new();
    }
    OF_SPRINGS.into_iter().filter(|section| lookup(design, section).is_none()).collect()
}

/// Takes the sections of springs away again.
pub(super) fn strip(design: &mut Value, sections: &[&str], derived: &mut Vec<DerivedField>) {
    if let Value::Object(map) = design {
        sections.iter().for_each(|section| {
            map.shift_remove(*section);
        });
    }
    let of = |field: &str| field.split('.').next().unwrap_or_default().to_owned();
    derived.retain(|field| !sections.contains(&of(field.field).as_str()));
}

/// A value that only a rigid mount has.
fn if_rigid(k: &Known<'_>, value: impl Fn(&Known<'_>) -> f64) -> Option<Value> {
    if k.is_rigid() { k.number(value(k)) } else { None }
}

pub(super) const POSTS: &[Rule] = &[
    follows("mount.height_mm", "3 mm, room for the wires of the lights", |k| if_rigid(k, |_| 3.0)),
    follows("mount.hole_diameter_mm", "for M2", |k| {
        if_rigid(k, |k| k.n("process.min_hole_diameter_mm").max(SCREW_HOLE_MM))
    }),
    follows("mount.post_diameter_mm", "a wall round the screw's hole, at least 1.4 mm", |k| {
        if_rigid(k, |k| k.n("mount.hole_diameter_mm") + 2.0 * wall_mm(k).max(1.4))
    }),
];

pub(super) const POST_PLACES: &[Rule] = &[follows(
    "mount.at_mm",
    "in the corners, 0.2 mm from the sides, or a wall beside the screws' heads",
    |k| {
        if !k.is_rigid() {
            return None;
        }
        let inset = board::post_inset_mm(k);
        let [x, y] = [0, 1].map(|axis| 0.5 * k.at("platforms.outer_mm", axis) - inset);
        k.places(&[[x, y], [-x, y], [-x, -y], [x, -y]])
    },
)];

/// Distance between two mounting holes at least, mm.
const MIN_APART_MM: f64 = 4.0;
/// Step at which places for a hole are looked at, mm.
const STEP_MM: f64 = 0.25;

/// Up to four mounting holes along the sides, as far from each other as they can be, clear of posts, set screws, cable,
/// bore, view and board; `None` where not even two find a place.
pub(super) fn beside_posts(k: &Known<'_>) -> Option<Vec<[f64; 2]>> {
    let heads = k.n("platforms.lower.mounting.counterbore_diameter_mm");
    let hole = 0.5 * k.n("platforms.lower.mounting.hole_diameter_mm").max(heads);
    let (wall, inset) = (wall_mm(k), hole + 2.0 * wall_mm(k));
    let half = 0.5 * dvec2(k.at("platforms.outer_mm", 0), k.at("platforms.outer_mm", 1)) - inset;
    // counterbores keep from the posts themselves too
    let post = if heads > 0.0 { 0.5 * k.n("mount.post_diameter_mm") } else { 0.0 };
    let head = (HEAD_PART * k.n("mount.hole_diameter_mm")).max(post);
    let points = |field: &str| -> Vec<DVec2> {
        let list = k.value(field).and_then(Value::as_array);
        let place = |at: &Value| Some(dvec2(at.get(0)?.as_f64()?, at.get(1)?.as_f64()?));
        list.into_iter().flatten().filter_map(place).collect()
    };
    let posts = points("mount.at_mm");
    let clamps = k.value("platforms.lower.clamp.azimuth_deg").and_then(Value::as_array);
    let screw = 0.5 * k.n("platforms.lower.clamp.hole_diameter_mm");
    let mut rays: Vec<(f64, f64)> =
        clamps.into_iter().flatten().filter_map(|azimuth| Some((azimuth.as_f64()?, screw))).collect();
    rays.push((
        k.n("platforms.lower.cable_exit.azimuth_deg"),
        0.5 * k.n("platforms.lower.cable_exit.width_mm"),
    ));
    let open_mm = bore_mm(k).max(view_mm(k, lower_top_mm(k)));
    let board = board::has_board(k).then(|| board::pocket_mm(k));
    let is_clear = |at: DVec2| {
        let past_ray = |(azimuth_deg, half_mm): &(f64, f64)| {
            let way = DVec2::from_angle(azimuth_deg.to_radians());
            at.dot(way) <= 0.0 || at.perp_dot(way).abs() >= half_mm + hole + wall
        };
        at.length() >= open_mm + hole + wall
            && posts.iter().all(|post| post.distance(at) >= head + hole + wall)
            && rays.iter().all(past_ray)
            && board.is_none_or(|[low, high]| (at - at.clamp(low, high)).length() >= hole + wall)
    };
    let steps = |reach: f64| {
        let count = (reach / STEP_MM).max(0.0).floor().min(1e4) as i32;
        (-count..=count).map(|step| STEP_MM * f64::from(step))
    };
    let mut free: Vec<DVec2> = steps(half.y).flat_map(|y| [dvec2(half.x, y), dvec2(-half.x, y)]).collect();
    free.extend(steps(half.x).flat_map(|x| [dvec2(x, half.y), dvec2(x, -half.y)]));
    free.retain(|at| is_clear(*at));
    let mut chosen: Vec<DVec2> = Vec::new();
    while chosen.len() < 4 {
        let apart = |at: &DVec2| {
            // the first is the farthest out
            let nearest = chosen.iter().map(|other| other.distance(*at)).fold(f64::INFINITY, f64::min);
            if nearest.is_finite() { nearest } else { at.length() }
        };
        let Some(best) = free.iter().copied().max_by(|a, b| apart(a).total_cmp(&apart(b))) else { break };
        if !chosen.is_empty() && apart(&best) < MIN_APART_MM {
            break;
        }
        chosen.push(best);
    }
    (chosen.len() >= 2).then(|| chosen.into_iter().map(|at| at.to_array()).collect())
}
