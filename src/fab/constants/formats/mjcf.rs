//! MJCF: two bodies, the springs between them, and where the wrench is read. Metres, kilograms, newtons.

use glam::DVec3;
use nalgebra::Matrix6;

use super::number::number;
use super::robot::{BodyPart, DOME_MESH, Robot, triple};
use domecast_runtime::constants::{Constants, matrix_of};

/// Names of the joints, in the order of a displacement.
const JOINTS: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];

/// MJCF: the upper platform on three slides and three hinges through the point that moments are stated about, with
/// the whole 6x6 and near-critical damping; a force and a torque sensor at that point's site.
///
/// MuJoCo's joints carry a diagonal only. The 6x6 is written as L D L^T: each column of L as a fixed tendon, a weighted
/// sum of the joints, with its D as stiffness. A matrix that is not symmetric (a measured one) is made so, and one that
/// is not positive definite keeps its diagonal alone; a comment in the file says which. The law at rest is
/// what MuJoCo gets: it has no springs that stiffen sideways as they shorten.
pub fn mjcf(constants: &Constants, robot: &Robot) -> String {
    let mount = DVec3::new(0.0, 0.0, robot.mount_z_mm * 1e-3);
    let (at, stiffness) = constants
        .springs
        .as_ref()
        .map_or((DVec3::ZERO, [[0.0; 6]; 6]), |s| (DVec3::from_array(s.at_mm) * 1e-3, s.stiffness));
    let (springs, mut note) = springs_of(&matrix_of(&stiffness));
    if constants.springs.is_none() {
        note = "a rigid mount: the platform has no joint".into();
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
    let si = in_si(&matrix_of(&stiffness));
    for (index, name) in JOINTS.into_iter().enumerate() {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][index % 3];
        let (kind, weight) = if index < 3 {
            ("slide", mass)
        } else {
            let own = robot.upper.mass.inertia_kg_m2.col(index - 3)[index - 3];
            let across = lever.length_squared() - lever.dot(axis).powi(2);
            ("hinge", own + mass * across)
        };
        let damping = 2.0 * (si[(index, index)].max(0.0) * weight.max(0.0)).sqrt();
        let stiffness = match &springs {
            Springs::Joints(diagonal) => format!(" stiffness=\"{}\"", number(diagonal[index])),
            Springs::Tendons(_) => String::new(),
        };
        joints += &format!(
            "        <joint name=\"{name}\" type=\"{kind}\" pos=\"{}\" axis=\"{}\"{stiffness} damping=\"{}\"/>\n",
            triple(at),
            triple(axis),
            number(damping),
        );
    }
    if constants.springs.is_none() {
        joints.clear();
    }
    let tendons = tendons(&springs);
    let (dome_mesh, dome_geometry) = dome_of(constants);
    format!(
        "<mujoco model=\"{name}\">\n  <!-- {note} -->\n  <compiler angle=\"radian\" meshdir=\".\"/>\n  <option \
         timestep=\"0.0001\" integrator=\"implicitfast\"/>\n  <asset>\n    <mesh name=\"lower\" \
         file=\"{lower_mesh}\" scale=\"0.001 0.001 0.001\"/>\n    <mesh name=\"upper\" file=\"{upper_mesh}\" \
         scale=\"0.001 0.001 0.001\"/>\n{dome_mesh}  </asset>\n  <worldbody>\n    <body name=\"base\">\n      \
         {lower_inertia}\n      <geom type=\"mesh\" mesh=\"lower\" pos=\"{back}\" contype=\"0\" \
         conaffinity=\"0\" group=\"2\"/>\n      <body name=\"sensor\" pos=\"{back}\">\n{joints}        \
         {upper_inertia}\n        <geom type=\"mesh\" mesh=\"upper\" contype=\"0\" conaffinity=\"0\" \
         group=\"2\"/>\n        <geom name=\"dome\" {dome} group=\"3\"/>\n        \
         <site name=\"wrench\" pos=\"{at}\"/>\n      </body>\n    </body>\n  </worldbody>\n{tendons}  <sensor>\n    \
         <force name=\"force\" site=\"wrench\"/>\n    <torque name=\"torque\" site=\"wrench\"/>\n    <framepos \
         name=\"position\" objtype=\"site\" objname=\"wrench\"/>\n  </sensor>\n</mujoco>\n",
        name = constants.design,
        lower_mesh = robot.lower.mesh,
        upper_mesh = robot.upper.mesh,
        lower_inertia = inertial(&robot.lower, mount),
        upper_inertia = inertial(&robot.upper, DVec3::ZERO),
        back = triple(-mount),
        dome = dome_geometry,
        at = triple(at),
    )
}

/// The dome's asset, and what its geom says: a sphere for a hemisphere, else a mesh.
fn dome_of(constants: &Constants) -> (String, String) {
    let shape = constants.optics.dome();
    if shape.is_hemisphere() {
        return (String::new(), format!("type=\"sphere\" size=\"{}\"", number(shape.radius_mm() * 1e-3)));
    }
    let mesh = format!("    <mesh name=\"dome\" file=\"{DOME_MESH}\" scale=\"0.001 0.001 0.001\"/>\n");
    (mesh, "type=\"mesh\" mesh=\"dome\"".to_owned())
}

/// The fixed tendons that carry the 6x6.
fn tendons(springs: &Springs) -> String {
    let mut tendons = String::new();
    if let Springs::Tendons(columns) = springs {
        tendons += "  <tendon>\n";
        for (index, (stiffness, coefficients)) in columns.iter().enumerate() {
            tendons += &format!(
                "    <fixed name=\"spring_{}\" stiffness=\"{}\" springlength=\"0\">\n",
                JOINTS[index],
                number(*stiffness)
            );
            for (joint, coefficient) in JOINTS.iter().zip(coefficients) {
                if *coefficient != 0.0 {
                    tendons +=
                        &format!("      <joint joint=\"{joint}\" coef=\"{}\"/>\n", number(*coefficient));
                }
            }
            tendons += "    </fixed>\n";
        }
        tendons += "  </tendon>\n";
    }
    tendons
}

/// How MuJoCo gets the stiffness.
enum Springs {
    /// By each joint: there is nothing beside the diagonal.
    Joints([f64; 6]),
    /// By tendons: stiffness and the joints' coefficients.
    Tendons(Vec<(f64, [f64; 6])>),
}

/// N/mm, N and N*mm to N/m, N and N*m.
fn in_si(stiffness: &Matrix6<f64>) -> Matrix6<f64> {
    let scale = |i: usize| if i < 3 { 1e3 } else { 1.0 };
    Matrix6::from_fn(|i, j| stiffness[(i, j)] * scale(i) * scale(j) * 1e-3)
}

/// The 6x6 for MuJoCo, and a sentence on what became of it.
fn springs_of(stiffness: &Matrix6<f64>) -> (Springs, String) {
    let symmetric = 0.5 * (stiffness + stiffness.transpose());
    let size =
        |i: usize, j: usize| (stiffness[(i, i)] * stiffness[(j, j)]).abs().sqrt().max(f64::MIN_POSITIVE);
    let relative = |m: &Matrix6<f64>| {
        let mut largest = 0.0_f64;
        for i in 0..6 {
            for j in (0..6).filter(|j| *j != i) {
                largest = largest.max(m[(i, j)].abs() / size(i, j));
            }
        }
        largest
    };
    let (coupled, skew) = (relative(&symmetric), relative(&(stiffness - symmetric)));
    let si = in_si(&symmetric);
    let diagonal: [f64; 6] = std::array::from_fn(|i| si[(i, i)].max(0.0));
    let left_out = if skew > 1e-9 {
        format!(" What is not symmetric in it, up to {skew:.1e} of the diagonal, is left out.")
    } else {
        String::new()
    };
    if coupled <= 1e-12 {
        return (
            Springs::Joints(diagonal),
            format!("The joints carry the 6x6, which is diagonal.{left_out}"),
        );
    }
    match ldl(&si) {
        Some(columns) => {
            (Springs::Tendons(columns), format!("The tendons carry the whole 6x6 at rest.{left_out}"))
        }
        None => {
            let note = format!(
                "The joints carry the diagonal of the 6x6; its couplings, up to {coupled:.1e} of it, are left out, as \
                 it is not positive definite.{left_out}"
            );
            (Springs::Joints(diagonal), note)
        }
    }
}

/// K = sum of d l l^T, with d above zero; `None` where K is not positive definite.
fn ldl(stiffness: &Matrix6<f64>) -> Option<Vec<(f64, [f64; 6])>> {
    let factor = stiffness.cholesky()?.l();
    let column = |j: usize| {
        let pivot = factor[(j, j)];
        let column: [f64; 6] = std::array::from_fn(|i| {
            let value = factor[(i, j)] / pivot;
            // Rounding is no coupling.
            let size = (stiffness[(i, i)] / stiffness[(j, j)]).sqrt();
            if i < j || value.abs() <= 1e-12 * size { 0.0 } else { value }
        });
        (pivot * pivot, column)
    };
    let all: Vec<(f64, [f64; 6])> = (0..6).map(column).collect();
    let finite = all.iter().flat_map(|(d, l)| l.iter().chain([d])).all(|v| v.is_finite());
    finite.then_some(all)
}
