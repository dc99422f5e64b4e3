//! All the forms of the constants, as files beside `constants.json`.

use super::kalibr::kalibr_yaml;

use super::mjcf::mjcf;
use super::opencv::opencv_yaml;
use super::robot::{BodyPart, DOME_MESH, Robot, dome_obj, urdf};
use super::ros::camera_info_yaml;
use crate::constants::mass::{MassProperties, mass_of_mesh};
use crate::constants::moving::moving_body;
use domecast_design::Design;
use domecast_design::parts::Part;
use domecast_runtime::constants::Constants;

/// Files of a build's `constants/` folder besides `constants.json`, and why others are left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FormatFiles {
    /// Path in the build's tree, and content.
    pub files: Vec<(String, String)>,
    /// What could not be written, and why: one sentence a file.
    pub left_out: Vec<String>,
}

/// Writes every form that can describe this sensor. The robot forms need the two platforms among `parts`.
pub fn format_files(design: &Design, constants: &Constants, parts: &[Part]) -> FormatFiles {
    let mut made = FormatFiles::default();
    let mut add = |name: &str, text: String| made.files.push((format!("constants/{name}"), text));
    add("opencv.yaml", opencv_yaml(constants));
    add("camera_info.yaml", camera_info_yaml(constants));
    match kalibr_yaml(constants) {
        Ok(text) => add("kalibr.yaml", text),
        Err(reason) => made.left_out.push(format!("constants/kalibr.yaml: {reason}")),
    }
    match robot_of(design, parts) {
        Some(robot) => {
            made.files.push(("constants/sensor.urdf".into(), urdf(constants, &robot)));
            made.files.push(("constants/sensor.xml".into(), mjcf(constants, &robot)));
            let dome = constants.optics.dome();
            if !dome.is_hemisphere() {
                made.files.push((format!("constants/{DOME_MESH}"), dome_obj(&dome)));
            }
        }
        None => made.left_out.push("constants/sensor.urdf: the platforms are not among the parts".into()),
    }
    made
}

/// The two bodies of a design, of the densities that it gives; springs, the lower magnets, lights and wires are not counted.
fn robot_of(design: &Design, parts: &[Part]) -> Option<Robot> {
    let named = |name: &str| parts.iter().find(|part| part.name == name);
    let (upper, lower) = (named("upper_platform")?, named("lower_platform")?);
    let sections = design.sections();
    let body = |part: &Part, mass: MassProperties| BodyPart {
        name: part.name.clone(),
        mesh: format!("../parts/{}.stl", part.name),
        mass,
    };
    Some(Robot {
        lower: body(lower, mass_of_mesh(&lower.mesh, sections.process.density_g_per_cm3)),
        upper: body(upper, moving_body(design, &upper.mesh)),
        mount_z_mm: sections.platforms.lower.underside_z_mm,
    })
}
