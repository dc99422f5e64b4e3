//! What is read alike from every form, and what is refused; files that fail stand in `tests/cases/calibrations`.
use super::*;
use proptest::prelude::*;

fn parse(text: &str) -> Result<Calibration, DesignError> {
    Calibration::parse(text, &CalibrationHints::default())
}

const YAML: &str = "%YAML:1.0
---
calibration_time: \"Tue 03 Mar 2026\"
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3e+02, 0., 320., 0., 531.,
       2.41e2, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.5e-01, 8.0000000000000002e-02, 1e-3, -.5e-3, 0. ]
";
const XML: &str = "<?xml version=\"1.0\"?>
<opencv_storage>
<calibration_time>\"Tue 03 Mar 2026\"</calibration_time>
<image_width>640</image_width>
<image_height>480</image_height>
<camera_matrix type_id=\"opencv-matrix\">
  <rows>3</rows><cols>3</cols><dt>d</dt>
  <data>
    5.3e+02 0. 320. 0. 531.
    241. 0. 0. 1.</data></camera_matrix>
<distortion_coefficients type_id=\"opencv-matrix\">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>-0.25 8.0000000000000002e-02 1e-3 -5e-4 0.</data></distortion_coefficients>
</opencv_storage>
";
const JSON: &str = r#"{
    "image_width": 640, "image_height": 480,
    "camera_matrix": { "type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d",
        "data": [ 530.0, 0.0, 320.0, 0.0, 531.0, 241.0, 0.0, 0.0, 1.0 ] },
    "distortion_coefficients": { "type_id": "opencv-matrix", "rows": 5, "cols": 1, "dt": "d",
        "data": [ -0.25, 0.08, 0.001, -0.0005, 0.0 ] }
}"#;
const ROS: &str = "image_width: 640
image_height: 480
camera_name: finger
camera_matrix: {rows: 3, cols: 3, data: [530, 0, 320, 0, 531, 241, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.25, 0.08, 0.001, -0.0005, 0]}
";
const ECHO: &str = "header:\n  seq: 1\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob
D: [-0.25, 0.08, 0.001, -0.0005, 0.0]\nK: [530.0, 0.0, 320.0, 0.0, 531.0, 241.0, 0.0, 0.0, 1.0]\n";
const KALIBR: &str = "cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [-0.25, 0.08, 0.001, -0.0005]
  distortion_model: radtan
  intrinsics: [530.0, 531.0, 320.0, 241.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
";

#[test]
fn every_form_is_the_same_camera() {
    for text in [YAML, XML, JSON, ROS, ECHO, KALIBR] {
        let read = parse(text).unwrap_or_else(|fault| panic!("{fault}\n{text}"));
        assert_eq!((read.width, read.height, read.model), (640, 480, LensModel::BrownConrady));
        assert_eq!(read.matrix, [[530.0, 0.0, 320.0], [0.0, 531.0, 241.0], [0.0, 0.0, 1.0]]);
        assert_eq!(read.distortion, [-0.25, 0.08, 0.001, -0.0005, 0.0]);
        assert!(read.warnings().is_empty());
    }
    assert_eq!(parse(KALIBR).unwrap().camera, "cam0");
}

#[test]
fn a_camera_is_chosen_by_name_only() {
    let two = format!("{KALIBR}{}", KALIBR.replace("cam0", "cam1").replace("530", "400"));
    let fault = parse(&two).unwrap_err().to_string();
    assert!(fault.contains("cam0 or cam1") && fault.contains("calibration_camera"), "{fault}");
    let hints = CalibrationHints { camera: Some("cam1".into()), ..Default::default() };
    assert_eq!(Calibration::parse(&two, &hints).unwrap().matrix[0][0], 400.0);
    let hints = CalibrationHints { camera: Some("cam7".into()), ..Default::default() };
    assert!(Calibration::parse(&two, &hints).unwrap_err().to_string().contains("cam0 or cam1"));
}

#[test]
fn four_coefficients_are_asked_for() {
    let four = YAML.replace("rows: 5", "rows: 4").replace(", 0. ]\n", " ]\n");
    assert!(parse(&four).unwrap_err().to_string().contains("kannala_brandt"));
    for model in [LensModel::BrownConrady, LensModel::KannalaBrandt] {
        let hints = CalibrationHints { model: Some(model), ..Default::default() };
        assert_eq!(Calibration::parse(&four, &hints).unwrap().model, model);
    }
    let stated = four + "fisheye_model: 1\n";
    assert_eq!(parse(&stated).unwrap().model, LensModel::KannalaBrandt);
}

#[test]
fn what_cannot_be_meant_is_named() {
    let cases = [
        ("530, 0, 320", "2.8, 0, 320", "is it in mm?"),
        ("530, 0, 320", "-530, 0, 320", "positive"),
        ("530, 0, 320", "530, 0.5, 320", "skew"),
        ("530, 0, 320", "530, 0, 640", "another resolution"),
        ("530, 0, 320", "530, 0, .nan", "camera_matrix[2]"),
        ("image_width: 640\n", "", "image_width"),
        ("image_width: 640", "image_width: 640.5", "image_width"),
        ("plumb_bob", "thin_prism_fisheye", "rational_polynomial"),
        ("plumb_bob", "rational_polynomial", "8, 12 or 14"),
        ("cols: 5", "cols: 8", "as many numbers"),
        ("camera_matrix", "matrix", "this is no calibration"),
        ("camera_name: finger", "image_width: 640", "twice"),
        ("camera_name: finger", "camera_name: *finger", "YAML"),
        ("[-0.25", "[[[-0.25", "YAML"),
    ];
    for (from, to, says) in cases {
        let fault = parse(&ROS.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(fault.contains(says), "{from} -> {to}: {fault}");
    }
    for model in ["omni", "ds", "eucm"] {
        let fault = parse(&KALIBR.replace("pinhole", model)).unwrap_err().to_string();
        assert!(fault.contains(model) && fault.contains("cam0.camera_model"), "{fault}");
    }
    let hints = CalibrationHints { width: Some(1280), ..Default::default() };
    assert!(Calibration::parse(ROS, &hints).unwrap_err().to_string().contains("1280"));
    let aside = parse(&ROS.replace("0, 320", "0, 250")).unwrap();
    assert!(aside.warnings()[0].contains("cx is 250 px"), "{:?}", aside.warnings());
}

#[test]
fn no_depth_breaks_the_reader() {
    for deep in ["[".repeat(200_000), "{a: ".repeat(100_000), "- ".repeat(100_000), "{\"a\":".repeat(100_000)]
    {
        assert!(parse(&deep).is_err());
    }
    assert!(parse(&format!("<opencv_storage>{}", "<a>".repeat(100_000))).is_err());
    assert!(parse(&format!("<opencv_storage>{}</opencv_storage>", "<a/>".repeat(1000))).is_err());
}

proptest! {
    // Cut anywhere, with a letter changed: an answer, never a panic, and never another camera's numbers.
    #[test]
    fn broken_texts_are_answered(which in 0..6usize, at in 0.0..1.0f64, with in "[-\\[\\]{}:<>\"a-z0-9.\n ]{0,3}") {
        let text = [YAML, XML, JSON, ROS, ECHO, KALIBR][which];
        let place = (at * text.len() as f64) as usize;
        let _ = parse(&text[..place]);
        let mut changed = text.to_owned();
        changed.replace_range(place..(place + 1).min(text.len()), &with);
        if let Ok(read) = parse(&changed) {
            prop_assert!(read.matrix.as_flattened().iter().chain(&read.distortion).all(|v| v.is_finite()));
        }
    }
}
