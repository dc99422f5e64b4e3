//! The lower platform: a block that holds the camera and carries the springs.

use glam::{DAffine3, DVec3};

use super::measures::{Measures, polar};
use super::{Blueprint, PartError};
use crate::mesh::{Construction, Fit, Piece, Profile, Shape};

pub(super) const NAME: &str = "lower_platform";

pub(super) fn blueprint(m: &Measures) -> Result<Blueprint, PartError> {
    let lower = &m.platforms.lower;
    let (top, bottom, over) = (m.lower_top_z_mm, lower.underside_z_mm, m.overcut_mm);
    let h = 0.5 * m.outer_mm;
    let mut genus = 0;
    let mut c = Construction {
        added: vec![Piece::new(
            "block",
            Shape::cuboid(DVec3::new(-h.x, -h.y, bottom), DVec3::new(h.x, h.y, top)),
        )],
        cut: vec![],
    };

    // The bore follows the camera's own axis, through the whole block.
    let reach = 2.0 * (h.length() + (top - bottom) + m.pupil_mm().length());
    let bore = Shape::cylinder(m.bore_radius_mm(), -reach, reach, Fit::Outside);
    c.cut.push(Piece::new("camera bore", bore).placed(m.sensor_from_camera));
    genus += 1;

    for (i, &azimuth_deg) in lower.clamp.azimuth_deg.iter().enumerate() {
        let along_x =
            DAffine3::from_translation(DVec3::new(m.pupil_mm().x, m.pupil_mm().y, lower.clamp.z_mm))
                * DAffine3::from_rotation_z(azimuth_deg.to_radians())
                * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let hole = Shape::cylinder(0.5 * lower.clamp.hole_diameter_mm, 0.0, reach, Fit::Outside);
        c.cut.push(Piece::new(format!("clamp hole {i}"), hole).placed(along_x));
        genus += 1;
    }

    for (i, axis) in m.spring_axes_mm.iter().enumerate() {
        let pocket = m.magnet_pocket(top, bottom - over, over);
        c.cut.push(Piece::new(format!("magnet pocket {i}"), pocket).at(axis.x, axis.y));
        genus += i64::from(m.pockets.push_out_diameter_mm > 0.0);
    }

    let mounting = &lower.mounting;
    for (i, at) in mounting.at_mm.iter().enumerate() {
        let (hole, head) = (0.5 * mounting.hole_diameter_mm, 0.5 * mounting.counterbore_diameter_mm);
        let profile = if head > hole && mounting.counterbore_depth_mm > 0.0 {
            let step = top - mounting.counterbore_depth_mm;
            Profile::lines(&[(hole, bottom - over), (hole, step), (head, step), (head, top + over)])
        } else {
            Profile::lines(&[(hole, bottom - over), (hole, top + over)])
        };
        let shape = Shape::Turned { profile, fit: Fit::Outside };
        c.cut.push(Piece::new(format!("mounting hole {i}"), shape).at(at[0], at[1]));
        genus += 1;
    }

    if lower.wire_hole_diameter_mm > 0.0 {
        for (i, led) in m.leds.list.iter().enumerate() {
            let at = polar(lower.wire_hole_ring_radius_mm, led.azimuth_deg);
            let hole =
                Shape::cylinder(0.5 * lower.wire_hole_diameter_mm, bottom - over, top + over, Fit::Area);
            c.cut.push(Piece::new(format!("wire hole {i}"), hole).at(at.x, at.y));
            genus += 1;
        }
    }

    let exit = &lower.cable_exit;
    if exit.width_mm > 0.0 && exit.height_mm > 0.0 {
        // Open below and joined to the bore: a notch, no handle.
        let w = 0.5 * exit.width_mm;
        let channel =
            Shape::cuboid(DVec3::new(0.0, -w, bottom - over), DVec3::new(reach, w, bottom + exit.height_mm));
        let turn = DAffine3::from_translation(DVec3::new(m.pupil_mm().x, m.pupil_mm().y, 0.0))
            * DAffine3::from_rotation_z(exit.azimuth_deg.to_radians());
        c.cut.push(Piece::new("cable exit", channel).placed(turn));
    }

    Ok(Blueprint {
        name: NAME,
        summary: "lower platform: camera bore, clamp, magnet pockets, mounting holes, cable exit; printed",
        construction: c,
        genus,
        chord: m.chord,
    })
}
