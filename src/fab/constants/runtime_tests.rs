use std::path::Path;

use domecast_runtime::constants::{POSE_AXES, WRENCH_AXES, wrench_by_table};

use super::*;
use domecast_design::suspension_of;
use domecast_optics::numeric::{Rigid, SeededRandom};

fn thumb(name: &str) -> Design {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs").join(name);
    domecast_design::Design::load(&path).unwrap()
}

fn springs(design: &Design) -> DesignSprings {
    springs_of(design, MarkerSight::of(design)).unwrap()
}

// What the paper's pipeline gains where a 6x6 can follow: ten times on Fz, Mx, My, nothing lost elsewhere.
#[test]
fn the_plain_runtime_is_nearly_unbiased() {
    let design = thumb("thumb24.json");
    let fit = springs(&design).plain.unwrap();
    for (axis, name) in WRENCH_AXES.iter().enumerate() {
        let (left, naive) = (fit.left.mean_wrench_size[axis], fit.naive.mean_wrench_size[axis]);
        let factor = if (2..5).contains(&axis) { 10.0 } else { 1.0 };
        // Where no refraction biases a row both are the same to rounding.
        assert!(factor * left <= naive * (1.0 + 1e-3), "{name}: {left} against {naive}");
        let (left, naive) = (fit.left.mean_wrench[axis].abs(), fit.naive.mean_wrench[axis].abs());
        assert!(left <= naive.max(1e-4), "{name}: {left} against {naive} with signs");
    }
    // The offset at rest vanishes; the naive one is newtons.
    let off = design.optics().rest_from_camera().compose(&fit.rest_pose);
    assert!(off.translation_mm.length() < 1e-9);
    assert!(fit.naive_at_rest_wrench[2].abs() > 1.0);
}

// The springs' own law is not linear; there the table by compression leaves less than a tenth of the naive error on
// Fz and less than it on every axis.
#[test]
fn the_plain_table_follows_the_springs_own_law() {
    let fit = springs(&thumb("thumb24.json")).plain.unwrap();
    for (axis, name) in WRENCH_AXES.iter().enumerate() {
        let one = fit.left_of_load.mean_wrench_size[axis];
        let table = fit.left_of_load_by_table.mean_wrench_size[axis];
        let naive = fit.naive_of_load.mean_wrench_size[axis];
        let factor = if axis == 2 { 10.0 } else { 1.0 };
        assert!(factor * table <= naive && table <= one, "{name}: {table}, {one} without, against {naive}");
    }
}

#[test]
fn without_refraction_there_is_nothing_to_correct() {
    let design = thumb("thumb24-pinhole.json");
    let fit = springs(&design).plain.unwrap();
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
    let found = resolution_at(design.optics(), &markers, &[0.1; 4], &suspension, &Rigid::identity()).unwrap();
    // About the springs' middle, ten millimetres below the markers, a tilt that is not seen looks like a shift.
    assert_eq!(found.weak_axes, ["Fx", "Fy", "Mx", "My"]);
    // Without the tilt's part, which is that about the markers' own plane, the shift is known better than the depth.
    let alone = found.pose_sd[0] * (1.0 - found.pose_correlation[0][4].powi(2)).sqrt();
    assert!(alone < 0.9 * found.pose_sd[2], "{alone}");
    // Sixteen millimetres wide and ten away: some micrometres and hundredths of a degree.
    assert!(found.pose_sd[2] > 1e-3 && found.pose_sd[2] < 0.01, "{:?}", found.pose_sd);
    assert!(found.pose_sd[5] > 0.005 && found.pose_sd[5] < 0.05);
    assert!(found.pose_correlation[0][4] < -0.5);
    let half = resolution_at(design.optics(), &markers, &[0.05; 4], &suspension, &Rigid::identity()).unwrap();
    assert!((half.wrench_sd[2] / found.wrench_sd[2] - 0.5).abs() < 1e-12);
    let choices = design_choices(design.optics(), &markers, &[0.1; 4], &suspension);
    // A longer focal length resolves more, markers nearer to the middle resolve tilt less.
    let of =
        |name: &str| choices.iter().find(|c| c.change.contains(name)).unwrap().resolution.clone().unwrap();
    assert!(of("markers at 0.6").wrench_sd[3] > found.wrench_sd[3]);
}

#[test]
fn the_table_is_near_the_law() {
    let design = thumb("thumb24.json");
    let suspension = suspension_of(&design).unwrap();
    let springs = springs(&design).constants.unwrap();
    for load in claimed_loads(&design, &suspension, &MarkerSight::of(&design)) {
        let d = domecast_springs::Displacement::of_pose(&load.pose, suspension.at_mm());
        let by_table = wrench_by_table(&springs, &d);
        for (axis, name) in WRENCH_AXES.iter().enumerate() {
            let (miss, allowed) = (by_table[axis] - load.wrench[axis], if axis < 3 { 0.05 } else { 1.0 });
            assert!(miss.abs() < allowed, "{name} {miss} at {:?}", load.wrench);
        }
    }
}

// Every design, at rest and under its claims: the spread under noise is the bound, no pose fails, flips or is doubted.
#[test]
fn noise_leaves_the_bound_on_every_design_and_claim() {
    let mut random = SeededRandom::new(1);
    let mut normal = || random.normal();
    for name in [
        "thumb24.json",
        "thumb24-fisheye.json",
        "thumb24-pinhole.json",
        "thumb24-wide.json",
        "endoscope-r5.json",
        "picam-r20.json",
    ] {
        let design = thumb(name);
        let suspension = suspension_of(&design).unwrap();
        let (markers, at) = (markers_of(&design), suspension.at_mm());
        let options = domecast_optics::pose::PoseOptions::new(0.1, 6.0);
        let solver = domecast_optics::pose::PoseSolver::new(design.optics(), &markers, options).unwrap();
        let mut poses = vec![Rigid::identity()];
        poses.extend(
            domecast_design::claims_of(&design, &suspension).into_iter().map(|c| c.equilibrium.unwrap().pose),
        );
        for pose in poses {
            let placed = design.optics().at_pose(&pose).unwrap();
            let exact: Vec<domecast_optics::pose::Sighting> = markers
                .iter()
                .map(|m| {
                    let centroid_px = m.image(&placed).unwrap().centroid_px;
                    domecast_optics::pose::Sighting { id: m.id, centroid_px }
                })
                .collect();
            let truth = domecast_springs::Displacement::of_pose(&pose, at).to_array();
            let bound =
                resolution_at(design.optics(), &markers, &[0.1; 4], &suspension, &pose).unwrap().pose_sd;
            let (mut squares, count) = ([0.0; 6], 2000);
            for _ in 0..count {
                let mut seen = exact.clone();
                for s in &mut seen {
                    s.centroid_px += glam::DVec2::new(normal(), normal()) * 0.1;
                }
                let found = solver.solve(&seen).unwrap();
                assert!(!found.is_ambiguous());
                let d = domecast_springs::Displacement::of_pose(&found.pose, at).to_array();
                for i in 0..6 {
                    squares[i] += (d[i] - truth[i]).powi(2) / f64::from(count);
                }
            }
            for i in 0..6 {
                let sd = if i < 3 { squares[i].sqrt() } else { squares[i].sqrt().to_degrees() };
                let ratio = sd / bound[i];
                assert!(ratio > 0.93 && ratio < 1.1, "{name} {}: {ratio}", POSE_AXES[i]);
            }
        }
    }
}
