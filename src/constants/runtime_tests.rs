use std::path::Path;

use super::*;
use crate::mechanics::suspension_of;
use crate::numeric::Rigid;

fn thumb(name: &str) -> Design {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs").join(name);
    crate::design::load(&path).unwrap()
}

// The optics' part of the bias: springs that are linear, so that a 6x6 can be right.
#[test]
fn the_plain_runtime_is_nearly_unbiased() {
    let design = thumb("thumb24.json");
    let suspension = suspension_of(&design).unwrap();
    let stiffness = suspension.stiffness().unwrap();
    let mut loads = claimed_loads(&design, &suspension, &crate::constants::MarkerSight::of(&design));
    for load in &mut loads {
        let d = crate::mechanics::Displacement::of_pose(&load.pose, suspension.at_mm()).to_array();
        load.wrench = (stiffness * nalgebra::Vector6::from(d)).into();
    }
    let input = PlainInput {
        optics: design.optics(),
        markers: &markers_of(&design),
        undistorted_matrix: design.undistorted_matrix(),
        at_mm: suspension.at_mm(),
        stiffness,
    };
    let fit = PlainFit::over(&input, &loads).unwrap();
    println!("LINEAR {:#?} {:#?}", fit.left, fit.naive);
    for (axis, name) in WRENCH_AXES.iter().enumerate() {
        let (left, naive) = (fit.left.mean_wrench_size[axis], fit.naive.mean_wrench_size[axis]);
        let factor = if (2..5).contains(&axis) { 10.0 } else { 1.0 };
        // Below a thousandth of a newton(-millimetre) neither is worse.
        assert!(factor * left <= naive.max(1e-3), "{name}: {left} against {naive}");
    }
    // The offset at rest vanishes; the naive one is newtons.
    let off = design.optics().rest_from_camera().compose(&fit.rest_pose);
    assert!(off.translation_mm.length() < 1e-9);
    assert!(fit.naive_at_rest_wrench[2].abs() > 1.0);
}

// With the springs' own law, which is not linear, less can be gained, but nothing is lost.
#[test]
fn the_plain_runtime_gains_under_the_real_law() {
    let fit = springs_of(&thumb("thumb24.json")).unwrap().plain.unwrap();
    println!("REAL {:#?} {:#?}", fit.left, fit.naive);
    for axis in [0, 1, 2, 3, 4] {
        let (left, naive) = (fit.left.mean_wrench_size[axis], fit.naive.mean_wrench_size[axis]);
        let factor = if axis == 2 { 8.0 } else { 1.0 };
        assert!(factor * left <= naive, "{}: {left} against {naive}", WRENCH_AXES[axis]);
    }
}

#[test]
fn without_refraction_there_is_nothing_to_correct() {
    let design = thumb("thumb24-pinhole.json");
    let fit = springs_of(&design).unwrap().plain.unwrap();
    for (apparent, marker) in fit.apparent_mm.iter().zip(markers_of(&design)) {
        // What is left is the disc's own: its centroid is not its centre's image.
        assert!(apparent.distance(marker.position_mm) < 0.01, "{apparent}");
    }
}

#[test]
fn the_bound_names_the_weak_axes() {
    let design = thumb("thumb24.json");
    let suspension = suspension_of(&design).unwrap();
    let markers = markers_of(&design);
    let found = resolution_at(design.optics(), &markers, 0.1, &suspension, &Rigid::identity()).unwrap();
    println!("{found:#?}");
    // About the springs' middle, ten millimetres below the markers, a tilt that is not seen looks like a shift.
    assert!(["Fx", "Fy"].contains(&found.weak_axes[0]) && ["Mx", "My"].contains(&found.weak_axes[1]));
    // Sixteen millimetres wide and ten away: some micrometres and hundredths of a degree.
    assert!(found.pose_sd[2] > 1e-3 && found.pose_sd[2] < 0.01, "{:?}", found.pose_sd);
    assert!(found.pose_sd[5] > 0.005 && found.pose_sd[5] < 0.05);
    assert!(found.pose_correlation[0][4] < -0.5);
    let half = resolution_at(design.optics(), &markers, 0.05, &suspension, &Rigid::identity()).unwrap();
    assert!((half.wrench_sd[2] / found.wrench_sd[2] - 0.5).abs() < 1e-12);
    let choices = design_choices(design.optics(), &markers, 0.1, &suspension);
    // A longer focal length tells more, markers nearer to the middle less about tilt.
    let of =
        |name: &str| choices.iter().find(|c| c.change.contains(name)).unwrap().resolution.clone().unwrap();
    assert!(of("markers at 0.6").wrench_sd[3] > found.wrench_sd[3]);
}

#[test]
fn the_table_is_near_the_law() {
    let design = thumb("thumb24.json");
    let suspension = suspension_of(&design).unwrap();
    let springs = springs_of(&design).unwrap().constants;
    for load in claimed_loads(&design, &suspension, &crate::constants::MarkerSight::of(&design)) {
        let d = crate::mechanics::Displacement::of_pose(&load.pose, suspension.at_mm());
        let by_table = wrench_by_table(&springs, &d);
        for (axis, name) in WRENCH_AXES.iter().enumerate() {
            let (miss, allowed) = (by_table[axis] - load.wrench[axis], if axis < 3 { 0.05 } else { 1.0 });
            assert!(miss.abs() < allowed, "{name} {miss} at {:?}", load.wrench);
        }
    }
}
