//! URDF and MJCF: two bodies, the springs between them, and where the wrench is read. Metres, kilograms, newtons.

use glam::{DMat3, DVec3};

use super::number;
use crate::constants::Constants;
use crate::mesh::TriMesh;

/// Mass, centre of mass and inertia of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub center_m: DVec3,
    /// Inertia about the centre of mass, kg m^2.
    pub inertia_kg_m2: DMat3,
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

impl MassProperties {
    /// A body from its mass, centre (mm) and second moments of mass about the centre, as the integral of
    /// x x^T (kg mm^2).
    fn from_moments(mass_kg: f64, center_mm: DVec3, second_kg_mm2: DMat3) -> Self {
        let trace = second_kg_mm2.x_axis.x + second_kg_mm2.y_axis.y + second_kg_mm2.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - second_kg_mm2;
        Self { mass_kg, center_m: center_mm * 1e-3, inertia_kg_m2: inertia * 1e-6 }
    }

    /// The two as one rigid body.
    pub fn with(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return *self;
        }
        let center_m = (self.center_m * self.mass_kg + other.center_m * other.mass_kg) / mass_kg;
        let moved = |body: &Self| {
            let d = body.center_m - center_m;
            body.inertia_kg_m2
                + (DMat3::from_diagonal(DVec3::splat(d.length_squared())) - outer(d)) * body.mass_kg
        };
        Self { mass_kg, center_m, inertia_kg_m2: moved(self) + moved(other) }
    }

    /// A solid hemisphere on the plane z = 0.
    pub fn hemisphere(radius_mm: f64, density_g_cm3: f64) -> Self {
        let mass_kg = density_g_cm3 * 1e-6 * std::f64::consts::TAU / 3.0 * radius_mm.powi(3);
        let center = 0.375 * radius_mm;
        let side = mass_kg * radius_mm * radius_mm / 5.0;
        let second = DVec3::new(side, side, side - mass_kg * center * center);
        Self::from_moments(mass_kg, DVec3::new(0.0, 0.0, center), DMat3::from_diagonal(second))
    }

    /// A box.
    pub fn cuboid(size_mm: DVec3, center_mm: DVec3, density_g_cm3: f64) -> Self {
        let mass_kg = density_g_cm3 * 1e-6 * size_mm.x * size_mm.y * size_mm.z;
        Self::from_moments(mass_kg, center_mm, DMat3::from_diagonal(size_mm * size_mm * (mass_kg / 12.0)))
    }
}

/// Mass properties of a closed mesh (mm) of one density, by signed tetrahedra about its box's centre: exact for
/// the polyhedron.
pub fn mass_of_mesh(mesh: &TriMesh, density_g_cm3: f64) -> MassProperties {
    let origin = mesh.bounds().map_or(DVec3::ZERO, |b| 0.5 * (b.min_mm + b.max_mm));
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for corners in mesh.iter_mm() {
        let [a, b, c] = corners.map(|v| v - origin);
        let part = a.dot(b.cross(c)) / 6.0;
        volume += part;
        let sum = a + b + c;
        first += sum * (part / 4.0);
        second += (outer(a) + outer(b) + outer(c) + outer(sum)) * (part / 20.0);
    }
    let density = density_g_cm3 * 1e-6;
    if volume <= 0.0 {
        return MassProperties::from_moments(0.0, origin, DMat3::ZERO);
    }
    let center = first / volume;
    let about_center = second - outer(center) * volume;
    MassProperties::from_moments(volume * density, origin + center, about_center * density)
}

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
    /// The platform on the springs; its mass with that of sheet and dome.
    pub upper: BodyPart,
    /// Height of the mounting face in the sensor frame at rest, mm.
    pub mount_z_mm: f64,
}

fn triple(v: DVec3) -> String {
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
    let radius_m = constants.optics.dome_radius_mm * 1e-3;
    let dome = format!(
        "    <visual>\n      <origin xyz=\"0 0 0\" rpy=\"0 0 0\"/>\n      <geometry><sphere \
         radius=\"{r}\"/></geometry>\n    </visual>\n    <collision>\n      <origin xyz=\"0 0 0\" rpy=\"0 0 \
         0\"/>\n      <geometry><sphere radius=\"{r}\"/></geometry>\n    </collision>\n",
        r = number(radius_m)
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
    text += &joint("springs", "base", "sensor", -mount, DVec3::ZERO);
    text += &joint("wrench_point", "sensor", "wrench", at, DVec3::ZERO);
    text += &joint("camera_mount", "base", "camera", camera_at - mount, rpy);
    text + "</robot>\n"
}

/// MJCF: the upper platform on three slides and three hinges through the point that moments are stated about, with
/// the diagonal of the stiffness and near-critical damping; a force and a torque sensor at that point's site.
///
/// In a layout with its springs' middle at that point the diagonal is the stiffness; what another layout couples
/// is left out, which a comment in the file says.
pub fn mjcf(constants: &Constants, robot: &Robot) -> String {
    let mount = DVec3::new(0.0, 0.0, robot.mount_z_mm * 1e-3);
    let (at, stiffness) = constants
        .springs
        .as_ref()
        .map_or((DVec3::ZERO, [[0.0; 6]; 6]), |s| (DVec3::from_array(s.at_mm) * 1e-3, s.stiffness));
    let mut largest = 0.0_f64;
    for (i, row) in stiffness.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let size = (stiffness[i][i] * stiffness[j][j]).abs().sqrt();
            if i != j && size > 0.0 {
                largest = largest.max(value.abs() / size);
            }
        }
    }
    let inertial = |part: &BodyPart, origin: DVec3| {
        let i = part.mass.inertia_kg_m2;
        format!(
            "<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{} {} {} {} {} {}\"/>",
            triple(part.mass.center_m - origin),
            number(part.mass.mass_kg),
            number(i.x_axis.x),
            number(i.y_axis.y),
            number(i.z_axis.z),
            number(i.y_axis.x),
            number(i.z_axis.x),
            number(i.z_axis.y),
        )
    };
    let mut joints = String::new();
    let mass = robot.upper.mass.mass_kg;
    let lever = robot.upper.mass.center_m - at;
    for (index, name) in ["tx", "ty", "tz", "rx", "ry", "rz"].into_iter().enumerate() {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][index % 3];
        // N/mm to N/m; N*mm/rad to N*m/rad.
        let (kind, k, weight) = if index < 3 {
            ("slide", stiffness[index][index] * 1e3, mass)
        } else {
            let own = robot.upper.mass.inertia_kg_m2.col(index - 3)[index - 3];
            let across = lever.length_squared() - lever.dot(axis).powi(2);
            ("hinge", stiffness[index][index] * 1e-3, own + mass * across)
        };
        let damping = 2.0 * (k.max(0.0) * weight.max(0.0)).sqrt();
        joints += &format!(
            "        <joint name=\"{name}\" type=\"{kind}\" pos=\"{}\" axis=\"{}\" stiffness=\"{}\" \
             damping=\"{}\"/>\n",
            triple(at),
            triple(axis),
            number(k),
            number(damping),
        );
    }
    format!(
        "<mujoco model=\"{name}\">\n  <!-- The springs' couplings between axes, up to {largest:.2e} of the \
         diagonal, are left out. -->\n  <compiler angle=\"radian\" meshdir=\".\"/>\n  <option \
         timestep=\"0.0001\" integrator=\"implicitfast\"/>\n  <asset>\n    <mesh name=\"lower\" \
         file=\"{lower_mesh}\" scale=\"0.001 0.001 0.001\"/>\n    <mesh name=\"upper\" file=\"{upper_mesh}\" \
         scale=\"0.001 0.001 0.001\"/>\n  </asset>\n  <worldbody>\n    <body name=\"base\">\n      \
         {lower_inertia}\n      <geom type=\"mesh\" mesh=\"lower\" pos=\"{back}\" contype=\"0\" \
         conaffinity=\"0\" group=\"2\"/>\n      <body name=\"sensor\" pos=\"{back}\">\n{joints}        \
         {upper_inertia}\n        <geom type=\"mesh\" mesh=\"upper\" contype=\"0\" conaffinity=\"0\" \
         group=\"2\"/>\n        <geom name=\"dome\" type=\"sphere\" size=\"{radius}\" group=\"3\"/>\n        \
         <site name=\"wrench\" pos=\"{at}\"/>\n      </body>\n    </body>\n  </worldbody>\n  <sensor>\n    \
         <force name=\"force\" site=\"wrench\"/>\n    <torque name=\"torque\" site=\"wrench\"/>\n    <framepos \
         name=\"position\" objtype=\"site\" objname=\"wrench\"/>\n  </sensor>\n</mujoco>\n",
        name = constants.design,
        lower_mesh = robot.lower.mesh,
        upper_mesh = robot.upper.mesh,
        lower_inertia = inertial(&robot.lower, mount),
        upper_inertia = inertial(&robot.upper, DVec3::ZERO),
        back = triple(-mount),
        radius = number(constants.optics.dome_radius_mm * 1e-3),
        at = triple(at),
    )
}
