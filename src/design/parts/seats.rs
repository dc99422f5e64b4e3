//! Has each purchased part a seat? What the dimensions tell, before any part is made. What only the finished meshes
//! tell is in [`super::bearing`].

use glam::{DVec2, DVec3};
use serde_json::json;

use super::error::Cure;
use super::measures::polar;
use super::screws::{THREADS, Thread};
use super::{Measures, PartError, mould};
use crate::spec::sections::{MIN_BEND_DIAMETERS, SpringPlaces};
use crate::spec::{Design, DesignWarning};

/// A set screw may stand this many of its diameters below the face: the tap still cuts there, the key still finds it.
const MAX_SUNK_DIAMETERS: f64 = 3.0;
/// A pocket's floor holds its magnet if its push-out hole takes no more of the magnet's diameter.
const MAX_PUSH_OUT_SHARE: f64 = 0.8;
/// A gap between set screws wider than half a turn by this leaves the camera a way to be pushed, rad.
const HALF_TURN_ROUNDING: f64 = 1e-9;

/// A fault of a seat: what is found, what it should be, and what would do.
pub(super) fn unheld(
    [part, by]: [&str; 2],
    problem: impl Into<String>,
    [value_mm, limit_mm]: [f64; 2],
    cure: Cure,
) -> PartError {
    PartError::Unheld { part: part.into(), by: by.into(), problem: problem.into(), value_mm, limit_mm, cure }
}

/// Every seat whose dimensions contradict each other.
pub(super) fn faults(design: &Design, m: &Measures) -> Vec<PartError> {
    let mut found = Vec::new();
    found.extend(camera_in_block(m));
    set_screws(m, &mut found);
    cable_exit(m, &mut found);
    if !design.is_rigid() {
        magnets_and_springs(design, m, &mut found);
    }
    lights(m, &mut found);
    mounting(m, &mut found);
    mould_pins(m, &mut found);
    found
}

/// What a maker should know of seats that hold.
pub(super) fn notes(m: &Measures) -> Vec<DesignWarning> {
    let mut found = Vec::new();
    found.extend(off_center(m));
    found.extend(cable_bend(m));
    if m.leds.list.is_empty() {
        let message = "no light is listed: nothing lights the dome from within".to_owned();
        found.push(DesignWarning { field: "leds.list".into(), message });
    }
    found
}

/// Lowest and highest point of the camera's axis within its body, mm; its axis is upright enough for heights to do.
fn body_z_mm(m: &Measures) -> [f64; 2] {
    let body = &m.camera_body;
    let at = |along: f64| m.sensor_from_camera.transform_point3(DVec3::Z * along).z;
    let (front, back) = (at(body.front_from_pupil_mm), at(body.front_from_pupil_mm - body.length_mm));
    [front.min(back), front.max(back)]
}

/// The part of the body's height that block and hood stand round, mm: none if the second is below the first.
fn held_z_mm(m: &Measures) -> [f64; 2] {
    let [low, high] = body_z_mm(m);
    let top = m.hood_rim_z_mm().map_or(m.lower_top_z_mm, |rim| rim.max(m.lower_top_z_mm));
    [low.max(m.platforms.lower.underside_z_mm), high.min(top)]
}

/// Least length of the bore round the camera: half its diameter, which keeps its tilt in a bore of a tenth of a
/// millimetre of clearance on 8 mm within 3 degrees.
pub(super) fn min_engaged_mm(m: &Measures) -> f64 {
    (0.5 * m.camera_body.diameter_mm).min(m.camera_body.length_mm)
}

fn camera_in_block(m: &Measures) -> Option<PartError> {
    if m.camera_body.board.is_some() {
        return None;
    }
    let [low, high] = held_z_mm(m);
    let limit = min_engaged_mm(m);
    if high - low >= limit * (1.0 - 1e-9) {
        return None;
    }
    let z = m.pupil_mm().z;
    let [body_low, _] = body_z_mm(m);
    // The way into the block: down from above, or up from below.
    let missing = limit - (high - low);
    let (underside, top) = (m.platforms.lower.underside_z_mm, m.lower_top_z_mm);
    let to = if body_low < underside { z + missing } else { z - missing };
    let problem = if high <= low {
        format!("the body is {:.2} mm off the bore; engaged length", low - high)
    } else {
        "engaged length of the body in its bore".to_owned()
    };
    let cure = if top - underside < limit {
        Cure::length("platforms.lower.underside_z_mm", underside, top.min(high) - limit)
    } else {
        Cure::length("camera.position_mm[2]", z, to)
    };
    Some(unheld(["camera", "lower_platform"], problem, [high - low, limit], cure))
}

/// How far the block's outer face is from the camera's axis in a direction, mm.
fn face_mm(m: &Measures, azimuth_deg: f64) -> f64 {
    let (way, at) = (polar(1.0, azimuth_deg), m.pupil_mm().truncate());
    let half = 0.5 * m.outer_mm;
    let to = |way: f64, at: f64, half: f64| {
        if way.abs() < 1e-12 { f64::INFINITY } else { (half * way.signum() - at) / way }
    };
    to(way.x, at.x, half.x).min(to(way.y, at.y, half.y)).max(0.0)
}

fn set_screws(m: &Measures, found: &mut Vec<PartError>) {
    let clamp = &m.platforms.lower.clamp;
    if clamp.azimuth_deg.is_empty() {
        return;
    }
    let ([body_low, body_high], [low, high]) = (body_z_mm(m), held_z_mm(m));
    let half_hole = 0.5 * clamp.hole_diameter_mm;
    let [near, far] = [body_low + half_hole, body_high - half_hole];
    let off = (near - clamp.z_mm).max(clamp.z_mm - far);
    if off > 1e-9 {
        // In the middle of what the bore holds, or of the body where it holds nothing.
        let high = high.min(m.lower_top_z_mm);
        let to = if high > low { 0.5 * (low + high) } else { 0.5 * (body_low + body_high) };
        let cure = Cure::value("platforms.lower.clamp.z_mm", json!((100.0 * to).round() / 100.0));
        found.push(unheld(
            ["set screws", "camera"],
            format!(
                "their axes pass the body, which reaches from z = {body_low:.2} to {body_high:.2} mm, not within it by a \
                 screw's half width; distance past its end"
            ),
            [off, 0.0],
            cure,
        ));
    }
    let Some(thread) = Thread::tapped_into(clamp.hole_diameter_mm) else {
        let smallest = THREADS[0].tap_mm;
        let cure = Cure::length("platforms.lower.clamp.hole_diameter_mm", clamp.hole_diameter_mm, smallest);
        let problem = "no set screw is as thin as the tapped hole; its diameter";
        found.push(unheld(
            ["set screws", "lower_platform"],
            problem,
            [clamp.hole_diameter_mm, smallest],
            cure,
        ));
        return;
    };
    let hole_mm = |azimuth: f64| face_mm(m, azimuth) - 0.5 * m.camera_body.diameter_mm;
    let longest = clamp.azimuth_deg.iter().map(|&a| hole_mm(a)).fold(0.0, f64::max);
    let reach = |t: &Thread| t.longest_mm() + MAX_SUNK_DIAMETERS * t.nominal_mm;
    if longest > reach(&thread)
        && let Some(wider) = THREADS.iter().find(|t| t.tap_mm > thread.tap_mm && reach(t) >= longest)
    {
        let cure =
            Cure::length("platforms.lower.clamp.hole_diameter_mm", clamp.hole_diameter_mm, wider.tap_mm);
        let problem = format!(
            "from the block's face to the body it is farther than the longest {} set screw ({} mm, sunk by {MAX_SUNK_DIAMETERS} \
             diameters) reaches; way",
            thread.name,
            thread.longest_mm()
        );
        found.push(unheld(["set screws", "camera"], problem, [longest, reach(&thread)], cure));
    }
    let shortest = clamp.azimuth_deg.iter().map(|&a| hole_mm(a)).fold(f64::INFINITY, f64::min);
    let thread_mm = shortest - m.camera_body.bore_clearance_mm;
    if thread_mm < thread.nominal_mm || thread.set_screw_within(shortest).is_none() {
        let missing = 2.0 * (thread.nominal_mm.max(thread.set_mm[0]) - thread_mm.min(shortest));
        let side = m.outer_mm.x.min(m.outer_mm.y) + missing;
        let side = (side * 100.0).ceil() / 100.0;
        let cure = Cure::value("platforms.outer_mm", json!([side, side]));
        found.push(unheld(
            ["set screws", "lower_platform"],
            format!("wall that {} is tapped into", thread.name),
            [thread_mm, thread.nominal_mm],
            cure,
        ));
    }
}

/// The set screws press the body against the bore's far side unless they stand all round it.
fn off_center(m: &Measures) -> Option<DesignWarning> {
    let clamp = &m.platforms.lower.clamp;
    let mut angles: Vec<f64> = clamp.azimuth_deg.iter().map(|a| a.rem_euclid(360.0)).collect();
    angles.sort_by(f64::total_cmp);
    let first = *angles.first()?;
    let next = angles.iter().copied().skip(1).chain(std::iter::once(first + 360.0));
    let gaps = angles.iter().copied().zip(next);
    let (from, to) = gaps.max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)))?;
    if (to - from).to_radians() <= std::f64::consts::PI + HALF_TURN_ROUNDING {
        return None;
    }
    let towards = (0.5 * (from + to)).rem_euclid(360.0);
    let offset = polar(m.camera_body.bore_clearance_mm, towards);
    let flat = |x: f64| if x.abs() < 5e-4 { 0.0 } else { x };
    Some(DesignWarning {
        field: "platforms.lower.clamp.azimuth_deg".into(),
        message: format!(
            "the set screws leave {:.0} degrees free and push the camera off centre, by the bore's clearance of {} mm towards \
             {towards:.0} degrees: ({:.3}, {:.3}) mm; three at 120 degrees do not",
            to - from,
            m.camera_body.bore_clearance_mm,
            flat(offset.x),
            flat(offset.y),
        ),
    })
}

/// The cable fits the channel that is cut for it.
fn cable_exit(m: &Measures, found: &mut Vec<PartError>) {
    let (body, exit) = (&m.camera_body, &m.platforms.lower.cable_exit);
    let cable = body.cable_diameter_mm;
    let wide = body.cable_width_mm.unwrap_or(cable);
    if exit.width_mm <= 0.0 || exit.height_mm <= 0.0 {
        return;
    }
    for (what, value, cable, field) in [
        ("width", exit.width_mm, wide, "platforms.lower.cable_exit.width_mm"),
        ("height", exit.height_mm, cable, "platforms.lower.cable_exit.height_mm"),
    ] {
        if value < cable {
            let problem = format!("{what} of the cable's exit, at least the cable's diameter");
            let cure = Cure::length(field, value, cable);
            found.push(unheld(["cable", "lower_platform"], problem, [value, cable], cure));
        }
    }
    let bore = 2.0 * m.bore_radius_mm();
    if wide > bore && body.board.is_none() {
        let cure = Cure::length("camera_body.cable_diameter_mm", cable, bore);
        found.push(unheld(["cable", "lower_platform"], "diameter, at most the bore's", [wide, bore], cure));
    }
}

/// Between the camera's back and the underside the cable has to turn into its exit; where it cannot, it leaves
/// straight down through the bore, which what the sensor stands on must let it.
fn cable_bend(m: &Measures) -> Option<DesignWarning> {
    let (body, lower) = (&m.camera_body, &m.platforms.lower);
    // A board's cable leaves beside the board, not below the lens.
    if lower.cable_exit.width_mm <= 0.0 || lower.cable_exit.height_mm <= 0.0 || body.board.is_some() {
        return None;
    }
    let bend = body.cable_bend_radius_mm.unwrap_or(MIN_BEND_DIAMETERS * body.cable_diameter_mm);
    // A quarter turn about the inside of the bend, and the cable's own width.
    let needed = bend + 0.5 * body.cable_diameter_mm;
    let [back, _] = body_z_mm(m);
    let room = back - lower.underside_z_mm;
    if room >= needed {
        return None;
    }
    let underside = ((back - needed) * 100.0).floor() / 100.0;
    Some(DesignWarning {
        field: "camera_body.cable_diameter_mm".into(),
        message: format!(
            "the cable cannot turn into its exit: {room:.2} mm below the camera, {needed:.2} mm needed for a bend of {bend:.2} mm \
             radius, {:.2} mm missing; it leaves straight down through the bore, or platforms.lower.underside_z_mm = \
             {underside} gives it room",
            needed - room
        ),
    })
}

/// The cure that moves the springs' axes to a distance from the axis of the sensor.
fn springs_to(design: &Design, i: usize, radius_mm: f64) -> Cure {
    match &design.sections().springs.places {
        SpringPlaces::Ring(ring) => Cure::length("springs.places.ring.radius_mm", ring.radius_mm, radius_mm),
        SpringPlaces::Listed(list) => {
            let at = list.get(i).map_or(DVec2::X, |at| DVec2::from_array(*at));
            let to = at.normalize_or(DVec2::X) * radius_mm;
            let to = to.to_array().map(|x| (x * 100.0).trunc() / 100.0);
            Cure::value(format!("springs.places.listed[{i}]"), json!(to))
        }
    }
}

fn magnets_and_springs(design: &Design, m: &Measures, found: &mut Vec<PartError>) {
    let (push_out, limit) = (m.pockets.push_out_diameter_mm, MAX_PUSH_OUT_SHARE * m.magnets.diameter_mm);
    if push_out > limit {
        let cure = Cure::length("magnet_pockets.push_out_diameter_mm", push_out, limit);
        let problem = "the push-out hole leaves no floor; its diameter, at most";
        found.push(unheld(["magnets", "their pockets"], problem, [push_out, limit], cure));
    }
    // The middle of the wire must stand on the magnet, at both ends.
    let wire_circle = m.spring_outer_mm - m.spring_wire_mm;
    if wire_circle > m.magnets.diameter_mm {
        let cure = Cure::length("magnets.diameter_mm", m.magnets.diameter_mm, wire_circle);
        let problem = "the spring's wire stands beside the magnet, whose diameter is";
        found.push(unheld(["springs", "magnets"], problem, [m.magnets.diameter_mm, wire_circle], cure));
    }
    let (pocket, _) = m.pocket_mm();
    let reach = pocket.max(0.5 * m.spring_outer_mm);
    for (i, axis) in m.spring_axes_mm.iter().enumerate() {
        let wall = (0.5 * m.outer_mm - axis.abs()).min_element() - reach;
        if wall < m.process.min_wall_mm * (1.0 - 1e-9) {
            // Along its own azimuth inwards until both sides are far enough.
            let way = axis.normalize_or(DVec2::X).abs().max(DVec2::splat(1e-12));
            let room = 0.5 * m.outer_mm - DVec2::splat(reach + m.process.min_wall_mm);
            let cure = springs_to(design, i, (room / way).min_element().max(0.0));
            let names = [format!("spring {i}"), "upper_platform and lower_platform".to_owned()];
            found.push(unheld(
                [&names[0], &names[1]],
                "wall beside its seat",
                [wall, m.process.min_wall_mm],
                cure,
            ));
            break;
        }
    }
}

/// A lip before each LED, high enough to keep its package in the pit.
fn lights(m: &Measures, found: &mut Vec<PartError>) {
    /// Share of the package's height that the lip must cover.
    const COVERED: f64 = 0.25;
    let leds = &m.leds;
    if leds.list.is_empty() {
        return;
    }
    let tilt = m.platform_from_led(0);
    let foot = tilt.transform_point3(DVec3::Y * (-0.5 * leds.package_mm[1])).z;
    let (covered, limit) = (leds.lip_top_z_mm - foot, COVERED * leds.package_mm[1]);
    if covered < limit {
        let cure = Cure::length("leds.lip_top_z_mm", leds.lip_top_z_mm, foot + limit);
        let problem = "height of the package behind the lip";
        found.push(unheld(["LEDs", "upper_platform"], problem, [covered, limit], cure));
    }
    let top = tilt.transform_point3(DVec3::Y * (leds.board_offset_mm + 0.5 * leds.board_mm[1])).z;
    let top = top.max(tilt.transform_point3(DVec3::Y * (0.5 * leds.package_mm[1])).z);
    let (gap, limit) = (m.seat_z_mm() - top, m.process.min_gap_mm);
    if gap < limit {
        let cure = Cure::length("leds.center_z_mm", leds.center_z_mm, leds.center_z_mm - (limit - gap));
        let problem = "gap between the boards' top and the sheet";
        found.push(unheld(["LED boards", "acrylic_sheet"], problem, [gap, limit], cure));
    }
}

/// Mounting screws: in the block with a wall round them, and heads that the upper platform keeps clear of.
fn mounting(m: &Measures, found: &mut Vec<PartError>) {
    let mounting = &m.platforms.lower.mounting;
    let wide = 0.5 * mounting.hole_diameter_mm.max(mounting.counterbore_diameter_mm);
    let room = 0.5 * m.outer_mm - DVec2::splat(wide + m.process.min_wall_mm);
    for (i, at) in mounting.at_mm.iter().enumerate() {
        let at = DVec2::from_array(*at);
        let wall = (0.5 * m.outer_mm - at.abs()).min_element() - wide;
        if wall < m.process.min_wall_mm * (1.0 - 1e-9) {
            let to = at.clamp(-room, room).to_array().map(|x| (x * 100.0).trunc() / 100.0);
            let cure = Cure::value(format!("platforms.lower.mounting.at_mm[{i}]"), json!(to));
            let name = format!("mounting screw {i}");
            let values = [wall, m.process.min_wall_mm];
            found.push(unheld([&name, "lower_platform"], "wall beside its hole", values, cure));
        }
    }
}

/// The mould's pins stand on the base beside the cavity, with a wall on both sides of their holes.
fn mould_pins(m: &Measures, found: &mut Vec<PartError>) {
    let pins = &m.mould.pins;
    let wide = 0.5 * pins.diameter_mm + pins.clearance_mm;
    let room = mould::half_side_mm(m) - wide - m.process.min_wall_mm;
    let near = m.mouth_radius_mm() + wide + m.process.min_wall_mm;
    for (i, at) in pins.at_mm.iter().enumerate() {
        let at = DVec2::from_array(*at);
        let wall = (room - at.abs().max_element()).min(at.length() - near) + m.process.min_wall_mm;
        if wall >= m.process.min_wall_mm * (1.0 - 1e-9) {
            continue;
        }
        let corner = DVec2::new(1.0_f64.copysign(at.x), 1.0_f64.copysign(at.y));
        // Where it is, moved into the room; or, where the cavity is too near, in the corner.
        let inside = at.clamp(DVec2::splat(-room), DVec2::splat(room));
        let to = if inside.length() >= near { inside } else { corner * room };
        if to.length() < near {
            let wider = m.mould.wall_mm + (near - to.length());
            let cure = Cure::length("mould.wall_mm", m.mould.wall_mm, wider);
            let problem = "the mould's wall has no room for its pins; wall";
            found.push(unheld(["mould pins", "mould_cavity"], problem, [wall, m.process.min_wall_mm], cure));
            return;
        }
        let to = to.to_array().map(|x| (x * 100.0).trunc() / 100.0);
        let cure = Cure::value(format!("mould.pins.at_mm[{i}]"), json!(to));
        let name = format!("mould pin {i}");
        let values = [wall, m.process.min_wall_mm];
        found.push(unheld([&name, "mould_cavity"], "wall beside its hole", values, cure));
    }
}
