//! The two bodies of the robot formats, and URDF. Metres, kilograms, newtons.

use glam::{DMat3, DVec3};

use super::number::number;
use crate::constants::mass::MassProperties;
use domecast_optics::DomeShape;
use domecast_runtime::constants::Constants;

/// A body's mesh file, as seen from the folder of the constants, in the sensor frame at rest, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyPart {
    /// Name of the body.
    pub name: String,
    /// Path of its mesh.
    pub mesh: String,
    /// Its mass properties, in the sensor frame at rest.
    pub mass: MassProperties,
}

/// What the robot formats need besides the constants.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// The platform that is mounted.
    pub lower: BodyPart,
    /// The platform on the springs; its mass with that of sheet, dome and magnets.
    pub upper: BodyPart,
    /// Height of the mounting face in the sensor frame at rest, mm.
    pub mount_z_mm: f64,
}

/// The mesh of a dome that is no hemisphere, beside the robot's file.
pub(super) const DOME_MESH: &str = "dome.obj";

/// A dome as a closed mesh in Wavefront OBJ, mm: a cap has no primitive in the robot formats. Its corners lie on the face.
pub(super) fn dome_obj(dome: &DomeShape) -> String {
    const AROUND: u32 = 64;
    const UP: u32 = 16;
    let mut text = String::from("# the dome, sensor frame, mm\n");
    let mut corner = |p: DVec3| text += &format!("v {}\n", triple(p));
    for ring in 0..UP {
        let meridian = dome.meridian_end_rad() * (1.0 - f64::from(ring) / f64::from(UP));
        for k in 0..AROUND {
            let azimuth = std::f64::consts::TAU * f64::from(k) / f64::from(AROUND);
            let at = dome.point_mm(meridian, azimuth);
            corner(if ring == 0 { at.with_z(0.0) } else { at });
        }
    }
    corner(dome.pole_mm());
    corner(DVec3::ZERO);
    let (pole, middle) = (UP * AROUND + 1, UP * AROUND + 2);
    for k in 0..AROUND {
        let (a, b) = (k + 1, (k + 1) % AROUND + 1);
        text += &format!("f {middle} {b} {a}\n");
        for ring in 0..UP - 1 {
            let (low, high) = (ring * AROUND, (ring + 1) * AROUND);
            text += &format!("f {} {} {} {}\n", low + a, low + b, high + b, high + a);
        }
        let top = (UP - 1) * AROUND;
        text += &format!("f {} {} {pole}\n", top + a, top + b);
    }
    text
}

/// Three numbers with spaces between them.
pub(super) fn triple(v: DVec3) -> String {
    format!("{} {} {}", number(v.x), number(v.y), number(v.z))
}

fn urdf_link(part: &BodyPart, origin_m: DVec3, dome: &str) -> String {
    let i = part.mass.inertia_kg_m2;
    let place = triple(-origin_m);
    let mesh = format!("<geometry><mesh filename=\"{}\" scale=\"0.001 0.001 0.001\"/></geometry>", part.mesh);
    format!(
        "  <link name=\"{}\">\n    <inertial>\n      <origin xyz=\"{}\" rpy=\"0 0 0\"/>\n      <mass \
         value=\"{}\"/>\n      <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" \
         izz=\"{}\"/>\n    </inertial>\n    <visual>\n      <origin xyz=\"{place}\" rpy=\"0 0 0\"/>\n      \
         {mesh}\n    </visual>\n{dome}    <collision>\n      <origin xyz=\"{place}\" rpy=\"0 0 0\"/>\n      \
         {mesh}\n    </collision>\n  </link>\n",
        part.name,
        triple(part.mass.center_m - origin_m),
        number(part.mass.mass_kg),
        number(i.x_axis.x),
        number(i.y_axis.x),
        number(i.z_axis.x),
        number(i.y_axis.y),
        number(i.z_axis.y),
        number(i.z_axis.z),
    )
}

/// URDF: `base` (its origin on the mounting face) carries the lower platform, `sensor` (the sensor frame at rest)
/// the upper one with sheet and dome, joined by a fixed joint: URDF has no springs. `wrench` is the point that
/// forces are stated about, `camera` the camera's frame.
pub fn urdf(constants: &Constants, robot: &Robot) -> String {
    let mount = DVec3::new(0.0, 0.0, robot.mount_z_mm * 1e-3);
    let shape = constants.optics.dome();
    let geometry = if shape.is_hemisphere() {
        format!("<sphere radius=\"{}\"/>", number(shape.radius_mm() * 1e-3))
    } else {
        format!("<mesh filename=\"{DOME_MESH}\" scale=\"0.001 0.001 0.001\"/>")
    };
    let dome = format!(
        "    <visual>\n      <origin xyz=\"0 0 0\" rpy=\"0 0 0\"/>\n      <geometry>{geometry}</geometry>\n    \
         </visual>\n    <collision>\n      <origin xyz=\"0 0 0\" rpy=\"0 0 0\"/>\n      \
         <geometry>{geometry}</geometry>\n    </collision>\n"
    );
    let joint = |name: &str, parent: &str, child: &str, at: DVec3, rpy: DVec3| {
        format!(
            "  <joint name=\"{name}\" type=\"fixed\">\n    <parent link=\"{parent}\"/>\n    <child \
             link=\"{child}\"/>\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>\n",
            triple(at),
            triple(rpy)
        )
    };
    let at = constants.springs.as_ref().map_or(DVec3::ZERO, |s| DVec3::from_array(s.at_mm) * 1e-3);
    // camera_from_sensor is the inverse of the camera's place.
    let m = constants.camera.camera_from_sensor;
    let rotation = DMat3::from_cols(
        DVec3::new(m[0][0], m[0][1], m[0][2]),
        DVec3::new(m[1][0], m[1][1], m[1][2]),
        DVec3::new(m[2][0], m[2][1], m[2][2]),
    );
    let camera_at = -(rotation * DVec3::new(m[0][3], m[1][3], m[2][3])) * 1e-3;
    let rpy = {
        let r = |row: usize, col: usize| rotation.col(col)[row];
        DVec3::new(r(2, 1).atan2(r(2, 2)), (-r(2, 0)).clamp(-1.0, 1.0).asin(), r(1, 0).atan2(r(0, 0)))
    };
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", constants.design);
    let named = |part: &BodyPart, name: &str| BodyPart { name: name.into(), ..part.clone() };
    text += &urdf_link(&named(&robot.lower, "base"), mount, "");
    text += &urdf_link(&named(&robot.upper, "sensor"), DVec3::ZERO, &dome);
    text += "  <link name=\"wrench\"/>\n  <link name=\"camera\"/>\n";
    let between = if constants.springs.is_some() { "springs" } else { "posts" };
    text += &joint(between, "base", "sensor", -mount, DVec3::ZERO);
    text += &joint("wrench_point", "sensor", "wrench", at, DVec3::ZERO);
    text += &joint("camera_mount", "base", "camera", camera_at - mount, rpy);
    text + "</robot>\n"
}
