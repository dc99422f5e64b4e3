//! The constants in the forms that other programs read: OpenCV, ROS, Kalibr, URDF and MJCF.
//!
//! One writer a form; each sees only finished values. What a form cannot say is refused with the reason, never
//! bent until it fits.
//!
//! ```
//! use domecast_fab::constants::{self, formats};
//! use std::str::FromStr;
//!
//! let design = domecast_design::Design::from_str(include_str!("../../../../designs/thumb24-fisheye.json"))?;
//! let constants = constants::of(&design, &design.layout()?)?;
//! assert!(formats::camera_info_yaml(&constants).contains("distortion_model: equidistant"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod files;
mod kalibr;
mod mjcf;
mod number;
mod opencv;
mod robot;
mod ros;

pub use super::mass::{MassProperties, mass_of_mesh};
pub use files::{FormatFiles, format_files};
pub use kalibr::kalibr_yaml;
pub use mjcf::mjcf;
pub use opencv::opencv_yaml;
pub use robot::{BodyPart, Robot, urdf};
pub use ros::camera_info_yaml;

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::{DMat3, DVec3};

    use super::*;
    use crate::constants;
    use domecast_design::calibration::{CalibrationHints, CameraCalibration};
    use domecast_design::layout::Layout;
    use domecast_mesh::TriMesh;
    use domecast_optics::DomeShape;
    use domecast_runtime::constants::Constants;

    fn of(name: &str) -> Constants {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs").join(name);
        let design = domecast_design::Design::load(&path).unwrap();
        constants::of(&design, &Layout::of_design(&design).unwrap()).unwrap()
    }

    /// A mesh of triangles from the OBJ of a dome.
    fn mesh_of(obj: &str) -> TriMesh {
        let mut mesh = TriMesh::default();
        for line in obj.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            let number = |k: usize| words[k].parse::<f64>().unwrap();
            let corner = |k: usize| words[k].parse::<u32>().unwrap() - 1;
            match words[0] {
                "v" => mesh.vertices_mm.push(DVec3::new(number(1), number(2), number(3))),
                "f" => {
                    for k in 2..words.len() - 1 {
                        mesh.triangles.push([corner(1), corner(k), corner(k + 1)]);
                    }
                }
                _ => {}
            }
        }
        mesh
    }

    #[test]
    fn domes_weigh_what_their_meshes_do() {
        for dome in [
            DomeShape::cap(11.5, 60_f64.to_radians()),
            DomeShape::cap(20.0, 20_f64.to_radians()),
            DomeShape::hemisphere(10.0),
            DomeShape::on_cylinder(6.0, 5.0),
        ] {
            // The mesh's corners lie on the face: it is smaller by the chords, a part of (pi / 64)^2 and (end / 16)^2.
            let (exact, found) =
                (MassProperties::dome(&dome, 1.1), mass_of_mesh(&mesh_of(&robot::dome_obj(&dome)), 1.1));
            assert!((found.mass_kg / exact.mass_kg - 0.995).abs() < 0.006, "{dome:?} {found:?} {exact:?}");
            assert!((found.center_m - exact.center_m).length() < 5e-5, "{dome:?} {found:?} {exact:?}");
            for k in 0..3 {
                let (a, b) = (found.inertia_kg_m2.col(k)[k], exact.inertia_kg_m2.col(k)[k]);
                assert!((a / b - 0.99).abs() < 0.012, "{dome:?} {k}: {a} {b}");
            }
        }
    }

    #[test]
    fn constants_carry_the_dome_and_those_of_old_mean_a_hemisphere() {
        let cap = of("digit-rigid.json");
        assert!(cap.optics.dome().center_z_mm() < 0.0);
        let text = serde_json::to_string(&cap).unwrap();
        let back: Constants = serde_json::from_str(&text).unwrap();
        assert_eq!(back.optics.dome(), cap.optics.dome());
        let whole = serde_json::to_string(&of("thumb24.json")).unwrap();
        assert!(!whole.contains("dome_center_z_mm"));
        assert!(serde_json::from_str::<Constants>(&whole).unwrap().optics.dome().is_hemisphere());
        for dot in &cap.black_dots {
            let pixel = cap.sensor().unwrap().project(DVec3::from_array(dot.surface_mm)).unwrap();
            assert!((pixel - glam::DVec2::from_array(dot.image_px)).length() < 1e-9);
        }
    }

    #[test]
    fn kalibr_refuses_what_it_cannot_say() {
        let reason = kalibr_yaml(&of("thumb24.json")).unwrap_err();
        assert!(reason.contains("k3 = -0.01156"), "{reason}");
        assert!(kalibr_yaml(&of("thumb24-fisheye.json")).unwrap().contains("equidistant"));
        assert!(kalibr_yaml(&of("thumb24-pinhole.json")).unwrap().contains("distortion_model: none"));
    }

    #[test]
    fn ros_names_the_model() {
        assert!(camera_info_yaml(&of("thumb24.json")).contains("distortion_model: plumb_bob"));
        assert!(camera_info_yaml(&of("thumb24-fisheye.json")).contains("distortion_model: equidistant"));
        let mut eight = of("thumb24.json");
        eight.camera.distortion.extend([0.1, 0.2, 0.3]);
        assert!(camera_info_yaml(&eight).contains("rational_polynomial"));
    }

    // What the files say of the camera is all that they say, whichever the lens, to the last digit.
    #[test]
    fn our_own_files_read_back_to_the_same_bytes() {
        let mut all = [
            "thumb24.json",
            "thumb24-fisheye.json",
            "thumb24-pinhole.json",
            "thumb24-wide.json",
            "endoscope-r5.json",
            "picam-r20.json",
            "digit-rigid.json",
        ]
        .map(of)
        .to_vec();
        for count in [8, 12, 14] {
            let mut more = of("thumb24.json");
            let rest = (5..count).map(|i| 0.1 / 3.0_f64.powi(i));
            more.camera.distortion.extend(rest);
            all.push(more);
        }
        let mut radtan = of("thumb24.json");
        radtan.camera.distortion[4] = 0.0;
        all.push(radtan);
        let mut looked = 0;
        for constants in &all {
            let written =
                [Ok(opencv_yaml(constants)), Ok(camera_info_yaml(constants)), kalibr_yaml(constants)];
            let write = [opencv_yaml, camera_info_yaml, |c: &Constants| kalibr_yaml(c).unwrap()];
            for (text, write) in written.into_iter().zip(write) {
                let Ok(text) = text else { continue };
                let read = CameraCalibration::parse(&text, &CalibrationHints::default()).unwrap();
                assert_eq!(read.matrix, constants.camera.matrix);
                let mut again = constants.clone();
                again.camera.model = read.model.as_str().into();
                (again.camera.width, again.camera.height) = (read.width, read.height);
                (again.camera.matrix, again.camera.distortion) = (read.matrix, read.distortion);
                assert_eq!(write(&again), text);
                looked += 1;
            }
        }
        assert_eq!(looked, 2 * 11 + 6);
    }

    // A box from twelve triangles against the closed form, off its own centre.
    #[test]
    fn the_mass_of_a_box() {
        let size = DVec3::new(2.0, 3.0, 5.0);
        let at = DVec3::new(7.0, -4.0, 1.0);
        let corner = |i: u32| {
            at + size
                * DVec3::new(f64::from(i & 1) - 0.5, f64::from((i >> 1) & 1) - 0.5, f64::from(i >> 2) - 0.5)
        };
        let triangles = vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ];
        let mesh = TriMesh { vertices_mm: (0..8).map(corner).collect(), triangles };
        let found = mass_of_mesh(&mesh, 1.2);
        let exact = MassProperties::cuboid(size, at, 1.2);
        assert!((found.mass_kg / exact.mass_kg - 1.0).abs() < 1e-12);
        assert!((found.center_m - exact.center_m).length() < 1e-15);
        let miss = found.inertia_kg_m2 - exact.inertia_kg_m2;
        assert!(miss.to_cols_array().iter().all(|v| v.abs() < 1e-12 * exact.inertia_kg_m2.x_axis.x));
        // Two halves of a body make the whole.
        let half = DVec3::new(1.0, 3.0, 5.0);
        let side = |s: f64| MassProperties::cuboid(half, at + DVec3::X * s, 1.2);
        let whole = side(0.5).with(&side(-0.5));
        let miss: DMat3 = whole.inertia_kg_m2 - exact.inertia_kg_m2;
        assert!(miss.to_cols_array().iter().all(|v| v.abs() < 1e-12 * exact.inertia_kg_m2.x_axis.x));
    }
}
