//! Lights, sheet, and the two platforms.

use serde_json::{Value, json};

use glam::DVec2;

use super::board::{self, has_board};
use super::geometry::{
    back_mm, bend_mm, bore_mm, depth_mm, dome, lower_top_mm, lowest_mm, pocket_mm, rim_mm, sheet_mm, tilt,
    travel_mm, view_mm, wall_mm,
};
use super::known::{Known, down, up};
use super::mount::beside_posts;
use super::room::{HOLE_IN_RECESS_MM, half_mm, ring, ring_count, spring_count, springs_reach_mm};
use super::rule::{Rule, fixed, follows};

pub(super) const LIGHTS: &[Rule] = &[
    fixed("platforms.window_margin_mm", "0.1", "the printing accuracy"),
    follows("sheet.clearance_mm", "a sliding fit, one and a half of the process's smallest gap", |k| {
        k.number((1.5 * k.n("process.min_gap_mm")).max(0.1))
    }),
    fixed("sheet.kerf_mm", "0.15", "usual for a laser in acrylic"),
    fixed(
        "leds.list",
        "[{\"color\": \"red\", \"azimuth_deg\": 0}, {\"color\": \"green\", \"azimuth_deg\": 120}, \
         {\"color\": \"blue\", \"azimuth_deg\": 240}]",
        "one of each colour, 120 degrees apart, as photometric stereo wants",
    ),
    follows(
        "leds.radiant_flux_mw",
        "as much for each area of the dome, 20 (R / 10) (height / 10) mW of each colour",
        |k| {
            let each = super::known::tidy(20.0 * (0.1 * k.n("dome.radius_mm") * (0.1 * dome(k).height_mm())));
            Some(json!({ "r": each, "g": each, "b": each }))
        },
    ),
    fixed("leds.lobe_exponent", "1", "flat emitters without a lens follow Lambert's law"),
    follows(
        "leds.diffuser",
        "matt coloured tape, where the tape's thickness is left out too; else none",
        |k| {
            let tape = json!({ "lambert_fraction": 0.6, "lobe_width_deg": 30, "transmittance": 0.6 });
            (!k.has("leds.diffuser_thickness_mm")).then_some(tape)
        },
    ),
    fixed("leds.diffuser_thickness_mm", "0.1", "one layer of tape"),
    fixed("leds.through_platform", "0", "pits and window are painted black"),
    fixed("leds.tilt_deg", "85", "nearly square to the axis, a little up"),
    fixed("leds.package_mm", "[2.0, 2.0]", "a small ceramic package"),
    fixed("leds.package_height_mm", "1.2", "a small ceramic package"),
    follows("leds.emitter_mm", "half of the package's smaller side", |k| {
        k.number(0.5 * k.at("leds.package_mm", 0).min(k.at("leds.package_mm", 1)))
    }),
    follows(
        "leds.board_mm",
        "0.44 of the rim's radius wide, from the package and 0.4 mm to 4.4 mm; as high as the package",
        |k| {
            let package = k.at("leds.package_mm", 0);
            k.numbers(&[(0.44 * rim_mm(k)).min(4.4).max(package + 0.4), k.at("leds.package_mm", 1)])
        },
    ),
    fixed("leds.board_thickness_mm", "0.8", "a thin board"),
    follows("leds.clearance_mm", "the process's smallest gap", |k| k.number(k.n("process.min_gap_mm"))),
    fixed("leds.board_offset_mm", "0", "the light in the middle of its board"),
    follows("leds.wire_hole_diameter_mm", "the smallest hole, at least 0.8 mm", |k| {
        k.number(k.n("process.min_hole_diameter_mm").max(0.8))
    }),
];

pub(super) const HEIGHTS: &[Rule] = &[
    follows(
        "leds.center_z_mm",
        "half a board, its gap and 1.1 mm of free way for the light below the sheet",
        |k| {
            let board = k.at("leds.board_mm", 1).max(k.at("leds.package_mm", 1));
            k.number(-(sheet_mm(k) + 1.1 + 0.5 * board + k.n("leds.clearance_mm")))
        },
    ),
    follows(
        "platforms.upper.underside_z_mm",
        "a wall and 0.2 mm below the boards, and a wall over the magnets' pockets",
        underside,
    ),
    follows("platforms.upper.rim_height_mm", "flush with the sheet", |k| k.number(sheet_mm(k))),
];

pub(super) const LIGHT_PLACES: &[Rule] = &[
    follows(
        "leds.center_radius_mm",
        "outside the camera's view of dome and markers, with a lip of one wall between",
        light_radius,
    ),
    follows(
        "leds.lip_top_z_mm",
        "on the line from the light's upper edge to the far edge of the camera's front at full travel, or over the hood's rim",
        lip,
    ),
    follows(
        "sheet.size_mm",
        "the dome and a bonded edge of 0.8 mm, 2 (R + 0.8), and over markers, lights and the springs' push-out holes",
        sheet_size,
    ),
    follows("sheet.corner_radius_mm", "0.5 mm, so that no corner chips", |k| {
        k.number(f64::min(0.5, 0.1 * k.at("sheet.size_mm", 0)))
    }),
];

pub(super) const OUTLINE: &[Rule] = &[follows(
    "platforms.outer_mm",
    "square; sheet and rim, boards, springs, and mounting holes in the corners, each with its wall; round a camera's \
         board a wall, and holes and posts beside it",
    |k| {
        let half = half_mm(k, springs_reach_mm(k) + pocket_mm(k) + wall_mm(k));
        let sides = if has_board(k) { board::half_mm(k, half) } else { DVec2::splat(half) };
        k.numbers(&[2.0 * sides.x, 2.0 * sides.y])
    },
)];

pub(super) const LOWER: &[Rule] = &[
    follows(
        "platforms.lower.clamp.hole_diameter_mm",
        "for tapping the thinnest of M2 to M6 of which a set screw, sunk by three diameters, reaches the body; where \
         three such holes leave no wall at the bore, of two that stand nearer to the sides' middles",
        tapped,
    ),
    follows("platforms.lower.cable_exit.width_mm", "the cable and 0.7 mm", |k| {
        k.number(board::cable_mm(k) + board::EXIT_MM)
    }),
    follows(
        "platforms.lower.cable_exit.height_mm",
        "the cable and what a bend of its own diameter takes, 1.6 of the diameter",
        |k| k.number(up(1.6 * k.n("camera_body.cable_diameter_mm"), 0.1)),
    ),
    follows(
        "platforms.lower.cable_exit.azimuth_deg",
        "where the board says that its cable leaves; else below the second spring, clear of screws and wires",
        |k| k.number(board::cable_deg(k).unwrap_or_else(|| spring_azimuth_deg(k, 1))),
    ),
    follows(
        "platforms.lower.underside_z_mm",
        "room for the cable to bend into its channel below the camera's back, as far as a given envelope has it, and room for \
         the set screws over the channel",
        bottom,
    ),
    follows(
        "platforms.lower.clamp.azimuth_deg",
        "three, 120 degrees apart, so that they do not push the camera off the axis; two that face each other where the \
         bore leaves no wall between three; between springs and wires",
        clamps,
    ),
    follows(
        "platforms.lower.clamp.z_mm",
        "in the middle of what the bore holds of the body, a wall over the cable's channel and below the top",
        clamp_height,
    ),
    follows("platforms.lower.mounting.hole_diameter_mm", "for M2", |k| {
        k.number(k.n("process.min_hole_diameter_mm").max(2.2))
    }),
    follows(
        "platforms.lower.mounting.counterbore_depth_mm",
        "none; between short posts what the screws' heads are too high by, with 0.3 mm",
        |k| k.number(counterbore_mm(k)),
    ),
    follows(
        "platforms.lower.mounting.counterbore_diameter_mm",
        "none, or twice the holes for the heads",
        |k| {
            let heads = 2.0 * k.n("platforms.lower.mounting.hole_diameter_mm");
            k.number(if k.n("platforms.lower.mounting.counterbore_depth_mm") > 0.0 { heads } else { 0.0 })
        },
    ),
    follows(
        "platforms.lower.mounting.at_mm",
        "in the corners, the hole's radius and two walls from the sides; on a rigid mount, whose posts stand there, up to \
         four along the sides, clear of posts, set screws and cable",
        mounting,
    ),
    follows(
        "platforms.lower.wire_hole_diameter_mm",
        "for two thin wires, or the smallest hole; none over a camera's board or between posts: there the wires leave \
         between the platforms",
        |k| {
            let hole = k.n("process.min_hole_diameter_mm").max(1.5);
            k.number(if has_board(k) || k.is_rigid() { 0.0 } else { hole })
        },
    ),
    follows("platforms.lower.wire_hole_ring_radius_mm", "a wall and 0.45 mm from the nearest side", |k| {
        let half = 0.5 * k.at("platforms.outer_mm", 0).min(k.at("platforms.outer_mm", 1));
        let hole = 0.5 * k.n("platforms.lower.wire_hole_diameter_mm");
        k.number(half - k.n("process.min_wall_mm") - 0.45 - hole)
    }),
    follows("envelope.size_mm", "what the sensor takes, rounded up to a tenth", |k| {
        let bottom = k.n("platforms.lower.underside_z_mm").min(back_mm(k));
        let height = dome(k).height_mm() + k.n("elastomer.membrane_thickness_mm") - bottom;
        k.numbers(&[
            up(k.at("platforms.outer_mm", 0), 0.1),
            up(k.at("platforms.outer_mm", 1), 0.1),
            up(height, 0.1),
        ])
    }),
];

fn sheet_size(k: &Known<'_>) -> Option<Value> {
    let markers = k.value("white_markers.positions_mm").and_then(Value::as_array);
    let farthest = markers
        .into_iter()
        .flatten()
        .filter_map(Value::as_array)
        .flatten()
        .filter_map(Value::as_f64)
        .fold(0.0, |widest: f64, side| widest.max(side.abs()));
    let markers = farthest + 0.5 * k.n("white_markers.diameter_mm") + 0.2;
    // what opens into the recess opens wholly: an edge half-way over a hole leaves a sliver
    let gap = k.n("sheet.clearance_mm");
    let lights = k.n("leds.center_radius_mm") + 0.25 - gap;
    let springs = if k.has("springs.places") { springs_reach_mm(k) } else { ring(k, ring_count(k)).1 };
    let holes = springs + 0.5 * k.n("magnet_pockets.push_out_diameter_mm") + HOLE_IN_RECESS_MM - gap;
    let half = (rim_mm(k) + 0.8).max(markers).max(lights).max(holes);
    let side = up(2.0 * half, 0.1);
    k.numbers(&[side, side])
}

fn underside(k: &Known<'_>) -> Option<Value> {
    let (sin, cos) = tilt(k);
    let board = k.at("leds.board_mm", 1).max(k.at("leds.package_mm", 1));
    let deep = k.n("leds.package_height_mm") + k.n("leds.board_thickness_mm");
    // a board that leans dips with its front edge
    let foot = (0.5 * board + k.n("leds.clearance_mm")) * sin + 0.1 * cos * deep;
    let boards =
        k.n("leds.center_z_mm") + k.n("leds.board_offset_mm") - foot - k.n("process.min_wall_mm") - 0.2;
    let pockets = k.n("magnets.thickness_mm") + k.n("magnet_pockets.depth_clearance_mm") + wall_mm(k);
    // the posts' screws end a wall below the sheet
    let screws = if k.is_rigid() { 2.0 * k.n("mount.hole_diameter_mm") + wall_mm(k) } else { 0.0 };
    k.number(down(boards.min(-(sheet_mm(k) + pockets.max(screws))), 0.1))
}

fn light_radius(k: &Known<'_>) -> Option<Value> {
    let (_, cos) = tilt(k);
    let top = k.n("leds.center_z_mm") + 0.5 * k.n("leds.emitter_mm");
    let front = k.n("leds.diffuser_thickness_mm") + k.n("leds.clearance_mm");
    let lean = cos * 0.5 * k.at("leds.board_mm", 1);
    k.number(up(view_mm(k, top) + wall_mm(k) + front + lean, 0.05))
}

fn lip(k: &Known<'_>) -> Option<Value> {
    let radius = k.n("leds.center_radius_mm");
    let top = k.n("leds.center_z_mm") + 0.5 * k.n("leds.emitter_mm");
    let lens = 0.5 * k.n("camera_body.lens_diameter_mm") + 1.0;
    // the platform comes down on the camera, at most until the sheet's gap closes
    let front = k.n("camera_body.front_from_pupil_mm") - depth_mm(k) + travel_mm(k);
    let inner = view_mm(k, top).min(radius - 0.2);
    let mut slope = (top - front).max(0.0) / (radius + lens);
    if k.has("platforms.lower.hood") {
        // of the flattest way over the near rim of the hood into the lens; flatter ones need no lip
        let rise = k.n("platforms.lower.hood.rim_from_pupil_mm") - k.n("camera_body.front_from_pupil_mm");
        slope = slope.max(rise / (bore_mm(k) + lens));
    }
    let line = top - slope * (radius - inner);
    // and a quarter of the package behind it, which keeps the light's foot dark
    let covers = k.n("leds.center_z_mm") - 0.25 * k.at("leds.package_mm", 1) + 0.02;
    k.number(up((line + 0.05).max(covers), 0.01).min(top))
}

/// Tapped hole, and the longest common set screw with three diameters, mm.
const REACHES_MM: [(f64, f64); 6] =
    [(1.6, 16.0), (2.05, 19.5), (2.5, 25.0), (3.3, 32.0), (4.2, 40.0), (5.0, 48.0)];
/// One of three screws stands at most so far off a side's middle, degrees.
const OFF_SIDE_OF_THREE_DEG: f64 = 35.0;
/// Two stand nearer to it.
const OFF_SIDE_OF_TWO_DEG: f64 = 20.0;

/// A set screw's way from the block's face to the body at most, mm.
fn screw_way_mm(k: &Known<'_>, off_side_deg: f64) -> f64 {
    let half = 0.5 * k.at("platforms.outer_mm", 0).max(k.at("platforms.outer_mm", 1));
    half / off_side_deg.to_radians().cos() - 0.5 * k.n("camera_body.diameter_mm")
}

/// Whether three holes of a diameter leave walls between them where they meet the bore, and their screws reach.
fn three_fit(k: &Known<'_>, hole_mm: f64) -> bool {
    let share = 0.5 * hole_mm / bore_mm(k).max(1e-3);
    let between_rad = 120f64.to_radians() - 2.0 * share.min(1.0).asin();
    let wall = 2.0 * bore_mm(k) * (0.5 * between_rad).sin();
    let way = screw_way_mm(k, OFF_SIDE_OF_THREE_DEG);
    let reaches = REACHES_MM.iter().any(|(hole, reach)| *hole <= hole_mm + 0.3 && way <= *reach);
    share < 1.0 && wall >= 1.05 * k.n("process.min_wall_mm") && (reaches || hole_mm > 5.0)
}

fn tapped(k: &Known<'_>) -> Option<Value> {
    let thinnest = |off_side_deg: f64| {
        let way = screw_way_mm(k, off_side_deg);
        let found = REACHES_MM.into_iter().find(|(_, reach)| way <= *reach).map_or(5.0, |(hole, _)| hole);
        found.max(k.n("process.min_hole_diameter_mm"))
    };
    let of_three = thinnest(OFF_SIDE_OF_THREE_DEG);
    k.number(if three_fit(k, of_three) { of_three } else { thinnest(OFF_SIDE_OF_TWO_DEG) })
}

/// Azimuth of a spring, degrees.
fn spring_azimuth_deg(k: &Known<'_>, index: usize) -> f64 {
    if k.has("springs.places.ring.first_azimuth_deg") {
        let step = 360.0 / spring_count(k).max(1) as f64;
        return (k.n("springs.places.ring.first_azimuth_deg") + step * index as f64).rem_euclid(360.0);
    }
    let place = k.value("springs.places.listed").and_then(|list| list.get(index));
    let at = |axis: usize| place.and_then(|place| place.get(axis)?.as_f64()).unwrap_or(0.0);
    at(1).atan2(at(0)).to_degrees().rem_euclid(360.0)
}

/// Room below a board for the heads of its screws, mm.
const MIN_HEAD_MM: f64 = 3.0;

fn bottom(k: &Known<'_>) -> Option<Value> {
    let channel = k.n("platforms.lower.cable_exit.height_mm");
    let screws = channel + k.n("platforms.lower.clamp.hole_diameter_mm") + 2.0 * (wall_mm(k) + 0.2);
    let mut body = (back_mm(k) - channel.max(bend_mm(k))).max(lowest_mm(k)).min(back_mm(k) - channel);
    if k.has("camera_body.board") {
        let parts = k.n("camera_body.board.components_height_mm").max(MIN_HEAD_MM);
        body = back_mm(k) - k.n("camera_body.board.thickness_mm") - parts.max(channel);
    }
    k.number(down(body.min(lower_top_mm(k) - screws), 0.1))
}

fn clamps(k: &Known<'_>) -> Option<Value> {
    if k.has("camera_body.board") {
        return Some(Value::Array(Vec::new()));
    }
    // half-way between a light's wires and the next spring for three springs, between two springs for six
    let busy: Vec<f64> = (0..spring_count(k))
        .map(|index| spring_azimuth_deg(k, index))
        .chain(led_azimuths(k))
        .chain([k.n("platforms.lower.cable_exit.azimuth_deg")])
        .chain([45.0, 135.0, 225.0, 315.0])
        .collect();
    let count = if three_fit(k, k.n("platforms.lower.clamp.hole_diameter_mm")) { 3 } else { 2 };
    let step = 360.0 / f64::from(count);
    let room = |first: f64| {
        let of = |azimuth: f64| {
            busy.iter()
                .map(|other| {
                    let turn = (azimuth - other).rem_euclid(360.0);
                    turn.min(360.0 - turn)
                })
                .fold(180.0, f64::min)
        };
        (0..count).map(|i| of(first + step * f64::from(i))).fold(180.0, f64::min)
    };
    let off_side = |first: f64| (first + 45.0).rem_euclid(90.0) - 45.0;
    let near_side = |first: &f64| count == 3 || off_side(*first).abs() <= OFF_SIDE_OF_TWO_DEG;
    let turns = (0..).map(|i| 5.0 * f64::from(i)).take_while(|first| *first < step);
    let best = turns.filter(near_side).fold((0.0, -1.0), |best, first| {
        if room(first) > best.1 + 1e-9 { (first, room(first)) } else { best }
    });
    k.numbers(&(0..count).map(|i| best.0 + step * f64::from(i)).collect::<Vec<_>>())
}

fn led_azimuths(k: &Known<'_>) -> Vec<f64> {
    let list = k.value("leds.list").and_then(Value::as_array);
    list.into_iter().flatten().filter_map(|led| led.get("azimuth_deg")?.as_f64()).collect()
}

fn clamp_height(k: &Known<'_>) -> Option<Value> {
    let hole = 0.5 * k.n("platforms.lower.clamp.hole_diameter_mm");
    let over =
        k.n("platforms.lower.underside_z_mm") + k.n("platforms.lower.cable_exit.height_mm") + wall_mm(k);
    let low = (over + hole + 0.1).max(back_mm(k) + hole);
    let front = k.n("camera_body.front_from_pupil_mm") - depth_mm(k);
    let pockets = k.n("magnets.thickness_mm") + k.n("magnet_pockets.depth_clearance_mm");
    let top = lower_top_mm(k) - wall_mm(k) - hole;
    let high = top.min(front - hole);
    // below the pockets where there is room
    let high = if high - pockets > low { high - pockets } else { high };
    k.number(super::known::tidy(0.5 * (low + high.max(low))))
}

/// How deep screws' heads have to be sunk under an upper platform that stands close above, mm.
fn counterbore_mm(k: &Known<'_>) -> f64 {
    if !k.is_rigid() {
        return 0.0;
    }
    // a head is as high as its screw is thick
    up((k.n("platforms.lower.mounting.hole_diameter_mm") + 0.3 - k.n("mount.height_mm")).max(0.0), 0.05)
}

fn mounting(k: &Known<'_>) -> Option<Value> {
    if k.is_rigid()
        && let Some(places) = beside_posts(k)
    {
        return k.places(&places);
    }
    let from_side = 0.5 * k.n("platforms.lower.mounting.hole_diameter_mm") + 2.0 * wall_mm(k);
    let x = 0.5 * k.at("platforms.outer_mm", 0) - from_side;
    let y = 0.5 * k.at("platforms.outer_mm", 1) - from_side;
    k.places(&[[x, y], [-x, y], [-x, -y], [x, -y]])
}
