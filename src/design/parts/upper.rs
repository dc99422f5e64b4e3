//! The upper platform: it carries sheet, dome and LEDs, and moves with them.

use glam::{DAffine3, DVec3};

use super::measures::Measures;
use super::pits::{CHANNEL_STEP, channel_end_mm};
use super::{Blueprint, Feature, PartError};
use super::{hood, mount};
use domecast_mesh::{Fit, Profile, Shape};

/// Cuts that may run into each other.
const OPEN_TO_EACH_OTHER: [(&str, &str); 31] = [
    ("sheet recess", "window"),
    ("sheet recess", "push-out hole"),
    ("sheet recess", "LED pit"),
    ("sheet recess", "light channel"),
    ("sheet recess", "rim notch"),
    ("sheet recess", "marker window"),
    ("window", "marker window"),
    ("marker window", "marker window"),
    ("marker window", "push-out hole"),
    ("marker window", "LED pit"),
    ("marker window", "light channel"),
    ("window", "push-out hole"),
    ("window", "LED pit"),
    ("window", "light channel"),
    ("window", "rim notch"),
    ("LED pit", "light channel"),
    ("LED pit", "rim notch"),
    ("LED pit", "LED wire hole"),
    ("light channel", "rim notch"),
    ("light channel", "light channel"),
    ("light well", "sheet recess"),
    ("light well", "window"),
    ("light well", "marker window"),
    ("light well", "LED pit"),
    ("light well", "light channel"),
    ("light well", "push-out hole"),
    ("light well", "rim notch"),
    ("hood room", "window"),
    ("hood room", "marker window"),
    ("hood room", "light channel"),
    ("hood room", "light well"),
];

pub(super) fn blueprint(m: &Measures) -> Result<Blueprint, PartError> {
    let upper = &m.platforms.upper;
    let (bottom, seat, over) = (upper.underside_z_mm, m.seat_z_mm(), m.overcut_mm);
    let top = m.upper_top_z_mm();
    let mut b = Blueprint::new(
        "upper_platform",
        if m.mount.is_rigid() {
            "upper platform: sheet seat, window, LED seats, screw holes; printed"
        } else {
            "upper platform: sheet seat, window, LED seats, magnet pockets; printed"
        },
        m.chord,
    );
    // All of it is open to the recess above; pockets and wire holes must keep
    // their distance. Lip and rim are left to the check of wall thickness.
    b.may_meet = &OPEN_TO_EACH_OTHER;
    if bottom >= seat {
        let field = "platforms.upper.underside_z_mm";
        return Err(b.infeasible(
            "plate under the sheet's seat",
            seat - bottom,
            m.process.min_wall_mm,
            field,
        ));
    }
    let h = 0.5 * m.outer_mm;
    let plate = Shape::cuboid(DVec3::new(-h.x, -h.y, bottom), DVec3::new(h.x, h.y, top));
    b.added.push(Feature::new("plate", "platforms.outer_mm", plate));

    let recess = 0.5 * m.sheet_size_mm + glam::DVec2::splat(m.sheet.clearance_mm);
    let wall = (h - recess).min_element();
    if upper.rim_height_mm > 0.0 {
        if wall < m.process.min_wall_mm {
            return Err(b.infeasible("rim round the sheet", wall, m.process.min_wall_mm, "sheet.size_mm"));
        }
        let pocket =
            Shape::cuboid(DVec3::new(-recess.x, -recess.y, seat), DVec3::new(recess.x, recess.y, top + over));
        b.cut.push(Feature::new("sheet recess", "sheet.size_mm", pocket));
    }

    let need = m.view.half_extent_mm();
    let within = if upper.rim_height_mm > 0.0 { recess } else { h };
    if need.cmpge(within).any() {
        return Err(b.infeasible(
            "half width of the window where it meets the sheet, less than the recess's",
            need.max_element(),
            within.min_element(),
            "sheet.size_mm",
        ));
    }
    let cone = Feature::new("window", "platforms.window_margin_mm", m.view.cone(over, top + over));
    b.cut.push(cone);
    for (i, (shape, placed)) in m.view.beams(over, top + over).into_iter().enumerate() {
        let beam = Feature::new("marker window", "platforms.window_margin_mm", shape);
        b.cut.push(beam.numbered(i).placed(placed));
    }
    b.genus += 1;
    hood::make_room(m, &mut b);

    // Their push-out holes lead up into window, recess or rim: open above.
    m.cut_magnet_pockets(&mut b, bottom, top + over);
    mount::upper(m, &mut b);
    if let Some(radius) = m.leds.well_radius_mm.filter(|_| !m.leds.list.is_empty()) {
        let well = Shape::cylinder(radius, m.leds.lip_top_z_mm, top + over, Fit::Outside);
        b.cut.push(Feature::new("light well", "leds.well_radius_mm", well));
    }
    for i in 0..m.leds.list.len() {
        led_seat(m, i, &mut b);
    }
    Ok(b)
}

/// Cuts pit, light channel and wire hole of one LED.
fn led_seat(m: &Measures, i: usize, b: &mut Blueprint) {
    let leds = &m.leds;
    let (top, over) = (m.upper_top_z_mm(), m.overcut_mm);
    let platform_from_led = m.platform_from_led(i);
    let gap = leds.clearance_mm;

    // In the LED's frame: x across, y up the board, z out of the emitting
    // face, whose centre is the origin. The board is behind.
    let half_width = 0.5 * leds.board_mm[0].max(leds.package_mm[0]) + gap;
    let half_height = 0.5 * leds.board_mm[1].max(leds.package_mm[1]) + gap;
    let back = leds.package_height_mm + leds.board_thickness_mm + gap;
    let front = leds.diffuser_thickness_mm + gap;
    // Up along the board until it is out of the platform everywhere.
    let up = platform_from_led.matrix3.y_axis.z.max(0.1);
    let lean = platform_from_led.matrix3.z_axis.z.abs() * (back + front);
    let out = (top + over - leds.center_z_mm + lean) / up;
    let pit = Shape::cuboid(
        DVec3::new(-half_width, leds.board_offset_mm - half_height, -back),
        DVec3::new(half_width, out, front),
    );
    b.cut.push(Feature::new("LED pit", "leds.center_radius_mm", pit).numbered(i).placed(platform_from_led));
    if let Some(notch) = rim_notch(m, &platform_from_led, half_width, back, i) {
        b.cut.push(notch);
    }

    // From the window over the lip into the pit, open above.
    let azimuth = DAffine3::from_rotation_z(leds.list[i].azimuth_deg.to_radians());
    let lip = leds.lip_top_z_mm;
    let inside_window = 0.25 * m.view.radius_mm(lip);
    let half_channel = half_width * (1.0 + CHANNEL_STEP);
    let end = channel_end_mm(m);
    let channel = Shape::cuboid(
        DVec3::new(inside_window, -half_channel, lip),
        DVec3::new(end, half_channel, top + over),
    );
    b.cut.push(Feature::new("light channel", "leds.lip_top_z_mm", channel).numbered(i).placed(azimuth));

    if leds.wire_hole_diameter_mm <= 0.0 {
        return;
    }
    // Under the board's foot: behind the emitting face, so that no light goes
    // down it.
    let foot = platform_from_led.transform_point3(DVec3::new(
        0.0,
        leds.board_offset_mm - 0.5 * leds.board_mm[1],
        -(leds.package_height_mm + 0.5 * leds.board_thickness_mm),
    ));
    let hole = Shape::Turned {
        profile: Profile::lines(&[
            (0.5 * leds.wire_hole_diameter_mm, m.platforms.upper.underside_z_mm - over),
            (0.5 * leds.wire_hole_diameter_mm, foot.z + 0.25 * leds.board_mm[1]),
        ]),
        fit: Fit::Area,
    };
    b.cut.push(
        Feature::new("LED wire hole", "leds.wire_hole_diameter_mm", hole).numbered(i).at(foot.x, foot.y),
    );
    b.genus += 1;
}

/// Where the pit would leave less of the rim than can be printed, the rim is
/// opened over the board instead, from the seat upwards.
fn rim_notch(
    m: &Measures,
    platform_from_led: &DAffine3,
    half_width_mm: f64,
    back_mm: f64,
    i: usize,
) -> Option<Feature> {
    if m.platforms.upper.rim_height_mm <= 0.0 {
        return None;
    }
    let (top, seat, over) = (m.upper_top_z_mm(), m.seat_z_mm(), m.overcut_mm);
    // The pit's back edge at the height of the rim's top.
    let across = platform_from_led.matrix3.x_axis;
    let back = platform_from_led.transform_point3(DVec3::NEG_Z * back_mm);
    let up = platform_from_led.matrix3.y_axis;
    let edge = back + up * ((top - back.z) / up.z.max(0.1));
    let half_outer = 0.5 * m.outer_mm;
    let corners = [-1.0, 1.0].map(|side| (edge + across * (side * half_width_mm)).truncate());
    let wall = corners.iter().map(|p| (half_outer - p.abs()).min_element()).fold(f64::INFINITY, f64::min);
    if wall >= m.process.min_wall_mm {
        return None;
    }
    let half = half_width_mm * (1.0 + CHANNEL_STEP);
    let box_out = Shape::cuboid(
        DVec3::new(m.leds.center_radius_mm, -half, seat),
        DVec3::new(2.0 * m.outer_mm.length(), half, top + over),
    );
    let turn = DAffine3::from_rotation_z(m.leds.list.get(i)?.azimuth_deg.to_radians());
    Some(Feature::new("rim notch", "leds.center_radius_mm", box_out).numbered(i).placed(turn))
}
