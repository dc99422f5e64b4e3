//! The upper platform: it carries sheet, dome and LEDs, and moves with them.

use glam::{DAffine3, DMat3, DVec3};

use super::measures::{Measures, polar};
use super::{Blueprint, PartError};
use crate::mesh::{Construction, Fit, Piece, Profile, Shape};

pub(super) const NAME: &str = "upper_platform";

/// The light channel is this much wider than the pit on each side: their side
/// faces are then clearly apart, not almost in one plane.
const CHANNEL_STEP_MM: f64 = 0.1;

pub(super) fn blueprint(m: &Measures) -> Result<Blueprint, PartError> {
    let upper = &m.platforms.upper;
    let (bottom, seat, over) = (upper.underside_z_mm, m.seat_z_mm(), m.overcut_mm);
    let top = m.upper_top_z_mm();
    if bottom >= seat {
        return Err(PartError::Infeasible {
            part: NAME,
            place: "underside below the sheet's seat by".into(),
            value_mm: seat - bottom,
            limit_mm: m.process.min_wall_mm,
            field: "platforms.upper.underside_z_mm".into(),
        });
    }
    let h = 0.5 * m.outer_mm;
    let mut genus = 0;
    let mut c = Construction {
        added: vec![Piece::new(
            "plate",
            Shape::cuboid(DVec3::new(-h.x, -h.y, bottom), DVec3::new(h.x, h.y, top)),
        )],
        cut: vec![],
    };

    let recess = 0.5 * m.sheet_size_mm + glam::DVec2::splat(m.sheet.clearance_mm);
    if upper.rim_height_mm > 0.0 {
        let pocket =
            Shape::cuboid(DVec3::new(-recess.x, -recess.y, seat), DVec3::new(recess.x, recess.y, top + over));
        c.cut.push(Piece::new("sheet recess", pocket));
    }

    let window = m.view.profile(bottom, seat, top, over);
    let opening = window.max_radius_mm();
    if opening >= recess.min_element() {
        return Err(PartError::Infeasible {
            part: NAME,
            place: "radius of the window at the seat, at most the recess's half width".into(),
            value_mm: opening,
            limit_mm: recess.min_element(),
            field: "sheet.size_mm".into(),
        });
    }
    c.cut.push(Piece::new("window", Shape::Turned { profile: window, fit: Fit::Outside }));
    genus += 1;

    for (i, axis) in m.spring_axes_mm.iter().enumerate() {
        let pocket = m.magnet_pocket(bottom, top + over, over);
        c.cut.push(Piece::new(format!("magnet pocket {i}"), pocket).at(axis.x, axis.y));
        // The push-out hole leads up into window, recess or rim: open above.
        genus += i64::from(m.pockets.push_out_diameter_mm > 0.0);
    }

    for i in 0..m.leds.list.len() {
        genus += led_seat(m, i, &mut c);
    }

    Ok(Blueprint {
        name: NAME,
        summary: "upper platform: sheet seat, window, LED seats, magnet pockets; printed",
        construction: c,
        genus,
        chord: m.chord,
    })
}

/// Cuts pit, light channel and wire hole of one LED; returns the handles that
/// they add.
fn led_seat(m: &Measures, i: usize, c: &mut Construction) -> i64 {
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
    c.cut.push(Piece::new(format!("LED pit {i}"), pit).placed(platform_from_led));
    if let Some(notch) = rim_notch(m, &platform_from_led, half_width, back, i) {
        c.cut.push(notch);
    }

    // From the window over the lip into the pit, open above.
    let azimuth = DAffine3::from_rotation_z(leds.list[i].azimuth_deg.to_radians());
    let lip = leds.lip_top_z_mm;
    let inside_window = 0.25 * m.view.radius_mm(lip);
    let half_channel = half_width + CHANNEL_STEP_MM;
    let channel = Shape::cuboid(
        DVec3::new(inside_window, -half_channel, lip),
        DVec3::new(leds.center_radius_mm, half_channel, top + over),
    );
    c.cut.push(Piece::new(format!("light channel {i}"), channel).placed(azimuth));

    if leds.wire_hole_diameter_mm <= 0.0 {
        return 0;
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
    c.cut.push(Piece::new(format!("LED wire hole {i}"), hole).at(foot.x, foot.y));
    1
}

/// Where the pit would leave less of the rim than can be printed, the rim is
/// opened over the board instead, from the seat upwards.
fn rim_notch(
    m: &Measures,
    platform_from_led: &DAffine3,
    half_width_mm: f64,
    back_mm: f64,
    i: usize,
) -> Option<Piece> {
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
    let half = half_width_mm + CHANNEL_STEP_MM;
    let box_out = Shape::cuboid(
        DVec3::new(m.leds.center_radius_mm, -half, seat),
        DVec3::new(2.0 * m.outer_mm.length(), half, top + over),
    );
    let turn = DAffine3::from_rotation_z(m.leds.list.get(i)?.azimuth_deg.to_radians());
    Some(Piece::new(format!("rim notch {i}"), box_out).placed(turn))
}

/// Pose of LED `i`: origin at the centre of its emitting face, x across the
/// board, y up the board, z out of the emitting face.
pub(super) fn platform_from_led(m: &Measures, i: usize) -> DAffine3 {
    let leds = &m.leds;
    let azimuth_deg = leds.list.get(i).map_or(0.0, |led| led.azimuth_deg);
    let (sin, cos) = leds.tilt_deg.to_radians().sin_cos();
    let outward = polar(1.0, azimuth_deg).extend(0.0);
    // The board leans outwards with its top, so that the face looks up.
    let y = DVec3::Z * sin + outward * cos;
    let z = -outward * sin + DVec3::Z * cos;
    let center = (outward * leds.center_radius_mm).with_z(leds.center_z_mm);
    DAffine3 { matrix3: DMat3::from_cols(y.cross(z), y, z), translation: center }
}
