//! What other crates make of the same pixels, for `scripts/compare_opencv.py --crates`.
//!
//! `compare_crates CRATE IN.json OUT.json`: IN holds a list of lenses with pixels, OUT gets a list of
//! `{name, rays}`, a ray being null where the crate gives none or nothing finite.

use apex_camera_models::{CameraModel, DistortionModel, KannalaBrandtCamera, PinholeParams, RadTanCamera};
use cam_geom::IntrinsicParameters;
use serde::{Deserialize, Serialize};

#[derive(Deserialize)]
struct Case {
    name: String,
    model: String,
    matrix: [[f64; 3]; 3],
    distortion: Vec<f64>,
    pixels: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct Answer {
    name: String,
    rays: Vec<Option<[f64; 3]>>,
}

fn unit(ray: [f64; 3]) -> Option<[f64; 3]> {
    let length = ray.iter().map(|v| v * v).sum::<f64>().sqrt();
    let ray = ray.map(|v| v / length);
    ray.iter().all(|v| v.is_finite()).then_some(ray)
}

fn opencv_ros_camera(case: &Case) -> Vec<Option<[f64; 3]>> {
    let ("brown_conrady", &[k1, k2, p1, p2, k3]) = (case.model.as_str(), case.distortion.as_slice()) else {
        return vec![None; case.pixels.len()];
    };
    let [[fx, _, cx], [_, fy, cy], _] = case.matrix;
    let distortion =
        opencv_ros_camera::Distortion::from_opencv_vec(nalgebra_of_ros::Vector5::new(k1, k2, p1, p2, k3));
    let camera =
        opencv_ros_camera::RosOpenCvIntrinsics::from_params_with_distortion(fx, 0.0, fy, cx, cy, distortion);
    let ray = |&[u, v]: &[f64; 2]| {
        let rays = camera.pixel_to_camera(&cam_geom::Pixels::new(nalgebra_of_ros::RowVector2::new(u, v)));
        let d = rays.directions();
        unit([d[(0, 0)], d[(0, 1)], d[(0, 2)]])
    };
    case.pixels.iter().map(ray).collect()
}

fn unproject_all(camera: &impl CameraModel, pixels: &[[f64; 2]]) -> Vec<Option<[f64; 3]>> {
    let ray = |&[u, v]: &[f64; 2]| {
        let ray = camera.unproject(&nalgebra_of_apex::Vector2::new(u, v)).ok()?;
        unit([ray[0], ray[1], ray[2]])
    };
    pixels.iter().map(ray).collect()
}

fn apex_camera_models(case: &Case) -> Vec<Option<[f64; 3]>> {
    let [[fx, _, cx], [_, fy, cy], _] = case.matrix;
    let pinhole = PinholeParams::new(fx, fy, cx, cy).expect("a usable matrix");
    match (case.model.as_str(), case.distortion.as_slice()) {
        ("brown_conrady", &[k1, k2, p1, p2, k3]) => {
            let distortion = DistortionModel::BrownConrady { k1, k2, p1, p2, k3 };
            let camera = RadTanCamera::new(pinhole, distortion).expect("usable coefficients");
            unproject_all(&camera, &case.pixels)
        }
        ("kannala_brandt", &[k1, k2, k3, k4]) => {
            let distortion = DistortionModel::KannalaBrandt { k1, k2, k3, k4 };
            let camera = KannalaBrandtCamera::new(pinhole, distortion).expect("usable coefficients");
            unproject_all(&camera, &case.pixels)
        }
        _ => vec![None; case.pixels.len()],
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, input, output] = arguments.as_slice() else {
        eprintln!("usage: compare_crates opencv-ros-camera|apex-camera-models IN.json OUT.json");
        std::process::exit(2);
    };
    let rays = match name.as_str() {
        "opencv-ros-camera" => opencv_ros_camera,
        "apex-camera-models" => apex_camera_models,
        other => panic!("no crate named {other}"),
    };
    let text = std::fs::read_to_string(input).expect("the input file");
    let cases: Vec<Case> = serde_json::from_str(&text).expect("a list of cases");
    let answers: Vec<Answer> =
        cases.iter().map(|case| Answer { name: case.name.clone(), rays: rays(case) }).collect();
    std::fs::write(output, serde_json::to_string(&answers).expect("finite numbers")).expect("the output file");
}
