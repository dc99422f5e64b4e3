//! Is each purchased part held by what was made? Rays against the finished meshes: the bore round the camera, the rim
//! under the sheet, the pit behind each LED's board, the floor under each magnet, and the way of a screwdriver.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde_json::json;

use super::assembly::{Body, affine};
use super::error::Cure;
use super::measures::polar;
use super::screws::{THREADS, Thread};
use super::seats::{min_engaged_mm, unheld};
use super::{Assembly, Measures, PartError, purchased};
use domecast_mesh::RayTarget;

/// Heights along the camera's body at which its bore is felt for, and directions at each.
const HEIGHTS: u32 = 64;
const AROUND: u32 = 24;
/// Share of the directions in which the bore must stand at a height that counts as engaged.
const ROUND_SHARE: f64 = 2.0 / 3.0;
/// Points along each side of the sheet's border.
const BORDER: u32 = 100;
/// Share of the border that must lie on the seat, of all of it and of each side.
const MIN_SUPPORTED: f64 = 0.6;
const MIN_SUPPORTED_SIDE: f64 = 0.3;
/// Share of a magnet's floor and of a board's back that must be backed.
const MIN_BACKED: f64 = 0.5;
/// The border bears this far inside the sheet's edge, mm, or a tenth of its shorter side.
const INSET_MM: f64 = 0.3;

/// Every part that nothing holds.
pub(super) fn faults(m: &Measures, assembly: &Assembly) -> Vec<PartError> {
    let target = |name: &str| {
        assembly.items.iter().find(|item| item.name == name).map(|item| RayTarget::new(&item.mesh))
    };
    let (Some(upper), Some(lower)) = (target("upper_platform"), target("lower_platform")) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    found.extend(bore(m, &lower));
    found.extend(border(m, &upper));
    found.extend(magnets(m, &upper, &lower));
    boards(m, &upper, &mut found);
    set_screw_access(m, assembly, &mut found);
    mounting_heads(m, &upper, &mut found);
    found
}

/// A little more than meshes and seats are off, mm.
fn skin_mm(m: &Measures) -> f64 {
    2.0 * m.chord.tolerance_mm() + 0.01
}

/// Length of the bore that stands round the camera's body.
fn bore(m: &Measures, lower: &RayTarget) -> Option<PartError> {
    let body = &m.camera_body;
    if body.board.is_some() {
        return None;
    }
    let reach = m.bore_radius_mm() + skin_mm(m);
    let engaged = (0..HEIGHTS)
        .filter(|&h| {
            let along = body.front_from_pupil_mm - body.length_mm * (f64::from(h) + 0.5) / f64::from(HEIGHTS);
            let round = (0..AROUND)
                .filter(|&k| {
                    let way = DVec2::from_angle(TAU * (f64::from(k) + 0.5) / f64::from(AROUND)) * reach;
                    let to_sensor = |p: DVec2| m.sensor_from_camera.transform_point3(p.extend(along));
                    let wall = to_sensor(way);
                    lower.is_hit(to_sensor(DVec2::ZERO), wall) || is_set_screw(m, wall)
                })
                .count();
            round as f64 >= ROUND_SHARE * f64::from(AROUND)
        })
        .count();
    let length = body.length_mm * engaged as f64 / f64::from(HEIGHTS);
    let limit = min_engaged_mm(m);
    // One height of the search is not known.
    if length + body.length_mm / f64::from(HEIGHTS) >= limit {
        return None;
    }
    let z = m.pupil_mm().z;
    let cure = Cure::length("camera.position_mm[2]", z, z - (limit - length));
    let problem = "length of the bore that stands round the body";
    Some(unheld(["camera", "lower_platform"], problem, [length, limit], cure))
}

/// Whether a set screw stands where the bore's wall would be.
fn is_set_screw(m: &Measures, at_mm: DVec3) -> bool {
    let clamp = &m.platforms.lower.clamp;
    let from_axis = at_mm - m.pupil_mm().with_z(clamp.z_mm);
    clamp.azimuth_deg.iter().any(|&azimuth| {
        let way = polar(1.0, azimuth).extend(0.0);
        let along = from_axis.dot(way);
        along > 0.0 && (from_axis - way * along).length() <= 0.5 * clamp.hole_diameter_mm + skin_mm(m)
    })
}

/// How much of the sheet's border lies on its seat.
fn border(m: &Measures, upper: &RayTarget) -> Option<PartError> {
    let half = 0.5 * m.sheet_size_mm;
    let inset = INSET_MM.min(0.1 * half.min_element());
    let (skin, seat) = (skin_mm(m), m.seat_z_mm());
    let lies = |at: DVec2| upper.is_hit(at.extend(seat + skin), at.extend(seat - skin));
    let side = |k: u32| {
        let supported = (0..BORDER).filter(|&i| {
            let t = (2.0 * (f64::from(i) + 0.5) / f64::from(BORDER) - 1.0)
                * (1.0 - 0.5 * inset / half.min_element());
            let at = match k {
                0 => DVec2::new(half.x - inset, t * half.y),
                1 => DVec2::new(t * half.x, half.y - inset),
                2 => DVec2::new(inset - half.x, t * half.y),
                _ => DVec2::new(t * half.x, inset - half.y),
            };
            lies(at)
        });
        supported.count() as f64 / f64::from(BORDER)
    };
    let shares = [0, 1, 2, 3].map(side);
    let (all, worst_side) = (shares.iter().sum::<f64>() / 4.0, shares.iter().copied().fold(1.0, f64::min));
    if all >= MIN_SUPPORTED && worst_side >= MIN_SUPPORTED_SIDE {
        return None;
    }
    let needed = 2.0 * (m.view.half_extent_mm() + DVec2::splat(m.process.min_wall_mm));
    let to = needed.max(m.sheet_size_mm).max(DVec2::splat(m.sheet_size_mm.max_element() * 1.02));
    let cure = Cure::value("sheet.size_mm", json!(to.to_array().map(|x| (100.0 * x).ceil() / 100.0)));
    let problem = format!(
        "{:.0} % of its border lies on the seat, {:.0} % of the worst side, at least {:.0} % and {:.0} %; its length",
        100.0 * all,
        100.0 * worst_side,
        100.0 * MIN_SUPPORTED,
        100.0 * MIN_SUPPORTED_SIDE
    );
    let border = 4.0 * (half.x + half.y);
    Some(unheld(["acrylic_sheet", "upper_platform"], problem, [all * border, MIN_SUPPORTED * border], cure))
}

/// A floor behind each magnet, and a pocket as deep as it is thick.
fn magnets(m: &Measures, upper: &RayTarget, lower: &RayTarget) -> Option<PartError> {
    let (_, depth) = m.pocket_mm();
    let ring = 0.25 * (m.pockets.push_out_diameter_mm.max(0.0) + m.magnets.diameter_mm);
    let (skin, thick) = (skin_mm(m), m.magnets.thickness_mm);
    let faces = [
        ("upper magnet", upper, m.platforms.upper.underside_z_mm, 1.0),
        ("lower magnet", lower, m.lower_top_z_mm, -1.0),
    ];
    for (i, axis) in m.spring_axes_mm.iter().enumerate() {
        for (name, target, face, into) in faces {
            let backed = (0..AROUND).filter(|&k| {
                let at = *axis + DVec2::from_angle(TAU * f64::from(k) / f64::from(AROUND)) * ring;
                let from = at.extend(face - into * skin);
                let to = at.extend(face + into * (depth + skin));
                let first = target.first_hit(from, to).map(|(share, _)| share * (depth + 2.0 * skin) - skin);
                first.is_some_and(|found| found >= thick - skin)
            });
            let share = backed.count() as f64 / f64::from(AROUND);
            if share < MIN_BACKED {
                let names = [format!("{name} {i}"), format!("{name}'s pocket")];
                let from = m.pockets.push_out_diameter_mm;
                let cure =
                    Cure::length("magnet_pockets.push_out_diameter_mm", from, 0.5 * m.magnets.diameter_mm);
                let problem =
                    format!("{:.0} % of the pocket's floor stand behind it; ring of floor", 100.0 * share);
                let full = m.magnets.diameter_mm - from;
                return Some(unheld(
                    [&names[0], &names[1]],
                    problem,
                    [share * full, MIN_BACKED * full],
                    cure,
                ));
            }
        }
    }
    None
}

/// A wall behind each LED's board and a lip before its package.
fn boards(m: &Measures, upper: &RayTarget, found: &mut Vec<PartError>) {
    const GRID: u32 = 7;
    let leds = &m.leds;
    let back = leds.package_height_mm + leds.board_thickness_mm;
    let skin = skin_mm(m);
    for i in 0..leds.list.len() {
        let to_platform = m.platform_from_led(i);
        let place = |p: DVec3| to_platform.transform_point3(p);
        let cells = (0..GRID).flat_map(|x| (0..GRID).map(move |y| (x, y)));
        let backed = cells
            .filter(|&(x, y)| {
                let across = |k: u32, size: f64| size * ((f64::from(k) + 0.5) / f64::from(GRID) - 0.5);
                let at = DVec2::new(
                    across(x, leds.board_mm[0]),
                    leds.board_offset_mm + across(y, leds.board_mm[1]),
                );
                upper.is_hit(place(at.extend(-back)), place(at.extend(-back - leds.clearance_mm - skin)))
            })
            .count();
        let share = backed as f64 / f64::from(GRID * GRID);
        if share < MIN_BACKED {
            let missing = (MIN_BACKED - share) * leds.board_mm[1];
            let cure = Cure::length("leds.center_z_mm", leds.center_z_mm, leds.center_z_mm - missing);
            let names = [format!("LED board {i}"), "upper_platform".to_owned()];
            let problem = "height of the board with the pit's wall behind it";
            let values = [share * leds.board_mm[1], MIN_BACKED * leds.board_mm[1]];
            found.push(unheld([&names[0], &names[1]], problem, values, cure));
            break;
        }
        // The lip: something before the package's foot.
        let foot = DVec3::new(0.0, -0.45 * leds.package_mm[1], 0.0);
        let front = leds.diffuser_thickness_mm + leds.clearance_mm;
        let far = front + m.process.min_wall_mm + skin;
        if !upper.is_hit(place(foot), place(foot + DVec3::Z * far)) {
            let needed = behind_lip_mm(m, leds.lip_top_z_mm).max(leds.center_radius_mm + 0.05);
            let cure = Cure::length("leds.center_radius_mm", leds.center_radius_mm, needed);
            let names = [format!("LED {i}"), "upper_platform".to_owned()];
            let problem = "no lip stands before the package's foot: distance of its face from the axis";
            found.push(unheld([&names[0], &names[1]], problem, [leds.center_radius_mm, needed], cure));
            break;
        }
    }
}

/// Distance from the axis at which an LED's face has a lip of a height before it, mm.
pub(super) fn behind_lip_mm(m: &Measures, lip_top_z_mm: f64) -> f64 {
    let front = m.leds.diffuser_thickness_mm + m.leds.clearance_mm;
    m.view.radius_mm(lip_top_z_mm).max(super::hood::room_mm(m)) + m.process.min_wall_mm + front
}

/// A straight way for the driver from outside to each set screw.
fn set_screw_access(m: &Measures, assembly: &Assembly, found: &mut Vec<PartError>) {
    let clamp = &m.platforms.lower.clamp;
    let targets: Vec<(&str, RayTarget)> = assembly
        .items
        .iter()
        .filter(|item| item.body != Body::Spring && item.name != "camera")
        .map(|item| (item.name.as_str(), RayTarget::new(&item.mesh)))
        .collect();
    let at = m.pupil_mm().with_z(clamp.z_mm);
    for (i, &azimuth) in clamp.azimuth_deg.iter().enumerate() {
        let way = polar(1.0, azimuth).extend(0.0);
        let side = way.cross(DVec3::Z);
        let far = 2.0 * m.outer_mm.length();
        let blocked = (0..9).find_map(|k| {
            // The axis, and a circle well within the hole.
            let off = 0.35 * clamp.hole_diameter_mm * f64::from(u32::from(k > 0));
            let turn = DVec2::from_angle(TAU * f64::from(k) / 8.0) * off;
            let from = at + way * (m.bore_radius_mm() + skin_mm(m)) + side * turn.x + DVec3::Z * turn.y;
            targets.iter().find(|(_, target)| target.is_hit(from, from + way * far)).map(|(name, _)| *name)
        });
        if let Some(name) = blocked {
            let names = [format!("set screw {i}"), name.to_owned()];
            // Turned by what the obstacle is wide as seen from the bore.
            let to = azimuth + 15.0;
            let cure = Cure::value(format!("platforms.lower.clamp.azimuth_deg[{i}]"), json!(to));
            let problem = "the part stands in the driver's straight way; free width";
            found.push(unheld([&names[0], &names[1]], problem, [0.0, 0.7 * clamp.hole_diameter_mm], cure));
        }
    }
}

/// The heads of the mounting screws stay clear of the upper platform under every claimed load.
fn mounting_heads(m: &Measures, upper: &RayTarget, found: &mut Vec<PartError>) {
    let mut worst: Option<(usize, f64, &str)> = None;
    for (i, head) in purchased::screw_heads(m).iter().enumerate() {
        let Some(bounds) = head.shape.triangulate(&head.name, m.chord).ok().and_then(|mesh| mesh.bounds())
        else {
            continue;
        };
        let (floor, top) = (bounds.min_mm.z, bounds.max_mm.z);
        let radius = 0.5 * bounds.size_mm().x;
        for pose in m.poses.iter().filter(|pose| pose.is_claimed) {
            let platform_from_rest = affine(&pose.rest_from_platform).inverse();
            for k in 0..AROUND {
                let edge = DVec2::from_angle(TAU * f64::from(k) / f64::from(AROUND)) * radius;
                let at = head.part_from_shape.transform_point3(edge.extend(0.0)).truncate();
                let [from, to] = [floor, top].map(|z| platform_from_rest.transform_point3(at.extend(z)));
                if let Some((share, _)) = upper.first_hit(from, to) {
                    let deep = (1.0 - share) * (top - floor);
                    if worst.is_none_or(|(_, deepest, _)| deep > deepest) {
                        worst = Some((i, deep, pose.name.as_str()));
                    }
                }
            }
        }
    }
    if let Some((i, deep, when)) = worst {
        let names = [format!("mounting screw {i}"), "upper_platform".to_owned()];
        let cure = lower_head(m, deep).unwrap_or_else(|| deeper_head(m, deep));
        let problem = format!("the screw's head meets the platform {when}; gap");
        found.push(unheld([&names[0], &names[1]], problem, [-deep, 0.0], cure));
    }
}

/// Room that a cured screw's head has above it, mm.
const HEAD_ROOM_MM: f64 = 0.05;

/// A thinner screw, whose head is lower: it takes no room beside the hole, as a counterbore does.
fn lower_head(m: &Measures, missing_mm: f64) -> Option<Cure> {
    let mounting = &m.platforms.lower.mounting;
    if purchased::sunk_mm(m) > 0.0 {
        return None;
    }
    let now = Thread::through(mounting.hole_diameter_mm)?;
    let is_enough = |t: &&Thread| t.nominal_mm + missing_mm + HEAD_ROOM_MM <= now.nominal_mm;
    let thinner = THREADS.iter().rev().find(is_enough)?;
    let hole_mm = thinner.clearance_mm.max(m.process.min_hole_diameter_mm);
    (Thread::through(hole_mm)?.nominal_mm <= thinner.nominal_mm).then(|| {
        Cure::length("platforms.lower.mounting.hole_diameter_mm", mounting.hole_diameter_mm, hole_mm)
    })
}

/// A counterbore that the head goes into, so much deeper than what there is.
fn deeper_head(m: &Measures, missing_mm: f64) -> Cure {
    let mounting = &m.platforms.lower.mounting;
    let head_mm = Thread::through(mounting.hole_diameter_mm).map_or(0.0, |t| t.head_mm);
    Cure::value(
        "platforms.lower.mounting",
        json!({
            "at_mm": mounting.at_mm,
            "hole_diameter_mm": mounting.hole_diameter_mm,
            "counterbore_diameter_mm": mounting.counterbore_diameter_mm.max(head_mm + 0.2),
            "counterbore_depth_mm": (100.0 * (purchased::sunk_mm(m) + missing_mm + HEAD_ROOM_MM)).ceil() / 100.0,
        }),
    )
}
