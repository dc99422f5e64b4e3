//! The lower platform: a block that holds the camera and carries the springs.

use glam::{DAffine3, DVec3};

use super::board::BoardSeat;
use super::measures::{Measures, polar};
use super::{Blueprint, Feature, PartError};
use super::{hood, mount};
use domecast_mesh::{Fit, Profile, Shape};

/// A bore is crossed by what leads into it; push-out holes may end in the cable's channel or the board's pocket.
const MAY_MEET: &[(&str, &str)] = &[
    ("camera bore", "clamp hole"),
    ("camera bore", "cable exit"),
    ("push-out hole", "cable exit"),
    ("camera bore", "view cone"),
    ("camera bore", "marker view"),
    ("view cone", "marker view"),
    ("marker view", "marker view"),
    ("board pocket", "camera bore"),
    ("board pocket", "board recess"),
    ("board pocket", "board screw hole"),
    ("board pocket", "cable exit"),
    ("board pocket", "push-out hole"),
    ("board recess", "board recess"),
    ("board recess", "camera bore"),
    ("board recess", "cable exit"),
    ("board recess", "push-out hole"),
    ("board recess", "view cone"),
    ("board recess", "marker view"),
];

pub(super) fn blueprint(m: &Measures) -> Result<Blueprint, PartError> {
    let lower = &m.platforms.lower;
    let (top, bottom, over) = (m.lower_top_z_mm, lower.underside_z_mm, m.overcut_mm);
    let h = 0.5 * m.outer_mm;
    let mut b = Blueprint::new(
        "lower_platform",
        if m.mount.is_rigid() {
            "lower platform: camera seat, posts, mounting holes, cable exit; printed"
        } else {
            "lower platform: camera bore, clamp, magnet pockets, mounting holes, cable exit; printed"
        },
        m.chord,
    );
    b.may_meet = MAY_MEET;
    if top <= bottom {
        return Err(b.infeasible(
            "height",
            top - bottom,
            m.process.min_wall_mm,
            "platforms.lower.underside_z_mm",
        ));
    }
    b.added.push(Feature::new(
        "block",
        "platforms.outer_mm",
        Shape::cuboid(DVec3::new(-h.x, -h.y, bottom), DVec3::new(h.x, h.y, top)),
    ));

    hood::add(m, &mut b)?;

    // The bore follows the camera's own axis, through the whole block.
    let reach = 2.0 * (h.length() + (top - bottom) + m.pupil_mm().length());
    let bore = Shape::cylinder(m.bore_radius_mm(), -reach, reach, Fit::Outside);
    b.cut.push(
        Feature::new("camera bore", "camera_body.bore_clearance_mm", bore).placed(m.sensor_from_camera),
    );
    b.genus += 1;

    if let Some(seat) = BoardSeat::of(m) {
        seat.cut(m, reach, &mut b);
    }
    view_opening(m, &mut b);

    let clamp = &lower.clamp;
    for (i, &azimuth_deg) in clamp.azimuth_deg.iter().enumerate() {
        let outwards = DAffine3::from_translation(m.pupil_mm().with_z(clamp.z_mm))
            * DAffine3::from_rotation_z(azimuth_deg.to_radians())
            * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
        // From inside the bore, but not so far in that two of them meet there.
        let hole =
            Shape::cylinder(0.5 * clamp.hole_diameter_mm, 0.5 * m.bore_radius_mm(), reach, Fit::Outside);
        let feature = Feature::new("clamp hole", "platforms.lower.clamp", hole);
        b.cut.push(feature.numbered(i).placed(outwards));
        b.genus += 1;
    }

    m.cut_magnet_pockets(&mut b, top, bottom - over);
    mount::lower(m, &mut b);

    mounting_holes(m, &mut b)?;
    if lower.wire_hole_diameter_mm > 0.0 {
        for (i, led) in m.leds.list.iter().enumerate() {
            let at = polar(lower.wire_hole_ring_radius_mm, led.azimuth_deg);
            let hole =
                Shape::cylinder(0.5 * lower.wire_hole_diameter_mm, bottom - over, top + over, Fit::Area);
            let feature = Feature::new("wire hole", "platforms.lower.wire_hole_ring_radius_mm", hole);
            b.cut.push(feature.numbered(i).at(at.x, at.y));
            b.genus += 1;
        }
    }

    cable_exit(m, reach, &mut b)?;
    Ok(b)
}

/// Cuts what the camera must see through the block, where the bore is too narrow for it.
fn view_opening(m: &Measures, b: &mut Blueprint) {
    let Some(view) = &m.lower_view else { return };
    let (top, over) = (m.lower_top_z_mm, m.overcut_mm);
    // About the pupil, from the camera's front to beyond the top; below the front the bore is open anyway.
    let to_pupil = DAffine3::from_translation(m.pupil_mm().with_z(0.0));
    let below = 1e-3 * (top - m.platforms.lower.underside_z_mm);
    let field = "camera.position_mm[2]";
    b.cut.push(Feature::new("view cone", field, view.cone(below, top + over)).placed(to_pupil));
    for (i, (shape, placed)) in view.beams(below, top + over).into_iter().enumerate() {
        b.cut.push(Feature::new("marker view", field, shape).numbered(i).placed(to_pupil * placed));
    }
}

/// Cuts the mounting holes with their counterbores.
fn mounting_holes(m: &Measures, b: &mut Blueprint) -> Result<(), PartError> {
    let (top, bottom, over) = (m.lower_top_z_mm, m.platforms.lower.underside_z_mm, m.overcut_mm);
    let mounting = &m.platforms.lower.mounting;
    for (i, at) in mounting.at_mm.iter().enumerate() {
        let (hole, head) = (0.5 * mounting.hole_diameter_mm, 0.5 * mounting.counterbore_diameter_mm);
        let profile = if head > hole && mounting.counterbore_depth_mm > 0.0 {
            let step = top - mounting.counterbore_depth_mm;
            if step <= bottom {
                return Err(b.infeasible(
                    format!("floor under counterbore {i}"),
                    step - bottom,
                    m.process.min_wall_mm,
                    "platforms.lower.mounting.counterbore_depth_mm",
                ));
            }
            Profile::lines(&[(hole, bottom - over), (hole, step), (head, step), (head, top + over)])
        } else {
            Profile::lines(&[(hole, bottom - over), (hole, top + over)])
        };
        let shape = Shape::Turned { profile, fit: Fit::Outside };
        let feature = Feature::new("mounting hole", "platforms.lower.mounting", shape);
        b.cut.push(feature.numbered(i).at(at[0], at[1]));
        b.genus += 1;
    }
    Ok(())
}

/// Cuts the channel of the cable, from the bore to beyond the block (`reach` mm).
fn cable_exit(m: &Measures, reach: f64, b: &mut Blueprint) -> Result<(), PartError> {
    let (top, bottom, over) = (m.lower_top_z_mm, m.platforms.lower.underside_z_mm, m.overcut_mm);
    let exit = &m.platforms.lower.cable_exit;
    if exit.width_mm > 0.0 && exit.height_mm > 0.0 {
        let roof = top - bottom - exit.height_mm;
        if roof <= 0.0 || roof < m.process.min_wall_mm {
            let field = "platforms.lower.cable_exit.height_mm";
            return Err(b.infeasible("roof over the cable exit", roof, m.process.min_wall_mm, field));
        }
        // Open below and joined to the bore: a notch, no hole through the part.
        let w = 0.5 * exit.width_mm;
        let channel =
            Shape::cuboid(DVec3::new(0.0, -w, bottom - over), DVec3::new(reach, w, bottom + exit.height_mm));
        let turn = DAffine3::from_translation(m.pupil_mm().with_z(0.0))
            * DAffine3::from_rotation_z(exit.azimuth_deg.to_radians());
        b.cut.push(Feature::new("cable exit", "platforms.lower.cable_exit", channel).placed(turn));
    }
    Ok(())
}
