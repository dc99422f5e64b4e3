//! The platform's pose from the white markers.

use glam::DVec3;

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::{Rigid, rotation_from_vector};
use domecast_optics::pose::{Marker, PoseOptions, PoseSolver, Sighting};
use domecast_runtime::constants::{Constants, PlainInput, PlainRuntimeSolver, matrix_of};

/// Poses that are tried: shifts, presses, tilts and twists of a loaded sensor.
const POSES: u32 = 64;
/// Farthest that the platform can be from rest, mm.
const REACH_MM: f64 = 10.0;

/// One pose and what is seen of it.
struct Seen {
    pose: Rigid,
    raw: Vec<Sighting>,
}

/// The sweep of solvers; `None` where the constants hold no springs or a marker is never seen.
pub fn sweep(constants: &Constants, asked_n: Option<f64>, time_limit: TimeLimit) -> Option<Sweep> {
    let optics = constants.sensor().ok()?;
    let markers = constants.markers();
    let springs = constants.springs.as_ref()?;
    let at_mm = DVec3::from_array(springs.at_mm);
    let stiffness = matrix_of(&springs.stiffness);
    let seen: Vec<Seen> = (0..POSES).filter_map(|k| see(&optics, &markers, &pose_of(k))).collect();
    let rest = see(&optics, &markers, &Rigid::identity())?;
    if seen.is_empty() {
        return None;
    }
    let input = PlainInput {
        optics: &optics,
        markers: &markers,
        undistorted_matrix: constants.camera.undistorted_matrix,
        at_mm,
        stiffness,
        stiffness_at: &[],
    };
    let painted: Vec<DVec3> = markers.iter().map(|marker| marker.position_mm).collect();
    let apparent: Option<Vec<DVec3>> = constants
        .white_markers
        .iter()
        .map(|marker| marker.apparent_position_mm.map(DVec3::from_array))
        .collect();
    // the largest error on an axis of force, of one pose against another
    let force_off = |found: &Rigid, truth: &Rigid| {
        let d = |pose: &Rigid| {
            nalgebra::Vector6::from(domecast_springs::Displacement::of_pose(pose, at_mm).to_array())
        };
        let off = stiffness * (d(found) - d(truth));
        (0..3).map(|axis| off[axis].abs()).fold(0.0, f64::max)
    };
    let mut samples = Vec::new();
    let mut add = |method: &'static str, label: &str, solve: &dyn Fn(&Seen) -> Option<Rigid>| {
        let off = seen.iter().map(|one| solve(one).map_or(f64::NAN, |pose| force_off(&pose, &one.pose)));
        let time = time(time_limit, || seen.iter().filter(|one| solve(one).is_some()).count());
        samples.push(SweepSample::of(
            (method, label.to_owned()),
            0.0,
            off,
            (time, seen.len()),
            "poses not found",
        ));
    };
    let mut plain = |method: &'static str, label: &str, positions: &[DVec3]| -> Option<()> {
        let solver = PlainRuntimeSolver::new(&input, positions).ok()?;
        let undistort = |one: &Seen| solver.undistorted(&optics, &one.raw);
        let from_rest = solver.pose(&undistort(&rest)?).ok()?.inverse();
        add(method, label, &|one| Some(from_rest.compose(&solver.pose(&undistort(one)?).ok()?)));
        Some(())
    };
    plain("painted", "undistort and solvePnP, markers as painted", &painted)?;
    if let Some(apparent) = &apparent {
        plain("apparent", "undistort and solvePnP, apparent markers", apparent)?;
    }
    let solver = PoseSolver::new(&optics, &markers, PoseOptions::new(1e-3, REACH_MM)).ok()?;
    add("closed form", "closed form, refraction on the axis only", &|one| solver.start(&one.raw).ok());
    add("refined", "refined with refraction and discs", &|one| Some(solver.solve(&one.raw).ok()?.pose));
    for (index, sample) in samples.iter_mut().enumerate() {
        sample.setting = index as f64 + 1.0;
    }
    Some(sweep_of(samples, seen.len(), asked_n))
}

/// The sweep of its samples.
fn sweep_of(samples: Vec<SweepSample>, items: usize, asked_n: Option<f64>) -> Sweep {
    let in_use = samples.len() - 1;
    Sweep {
        name: "pose",
        title: "Pose and force from the white markers".into(),
        setting: "solver",
        error: "largest error on an axis of force by the nominal 6x6, centroids without noise",
        unit: "N",
        item: "pose",
        items,
        reference: "the poses that the centroids were made from".into(),
        floor: 1e-12,
        law: Law::Falls,
        observed: None,
        samples,
        in_use: Some(in_use),
        asked: asked_n,
        meets: None,
        conclusion:
            "Refraction costs microseconds; leaving it out costs what no calibration of the 6x6 brings back \
                   entirely."
                .into(),
    }
    .finish()
}

/// Poses spread evenly over what a loaded sensor does: a low-discrepancy sequence (Roberts' R6).
fn pose_of(k: u32) -> Rigid {
    // root of x^7 = x + 1
    const PHI: f64 = 1.112_775_684_278_705_5;
    let at = |axis: i32| (0.5 + f64::from(k + 1) * PHI.powi(-axis)).fract() - 0.5;
    let shift = DVec3::new(0.6 * at(1), 0.6 * at(2), -0.6 + 0.8 * at(3));
    let turn = DVec3::new(0.07 * at(4), 0.07 * at(5), 0.1 * at(6));
    Rigid::new(rotation_from_vector(turn), shift)
}

fn see(optics: &SensorOptics, markers: &[Marker], pose: &Rigid) -> Option<Seen> {
    Some(Seen { pose: *pose, raw: sightings(optics, markers, pose)? })
}

/// Where a camera sees the markers' centroids at a pose; `None` where one is not seen.
pub(super) fn sightings(optics: &SensorOptics, markers: &[Marker], pose: &Rigid) -> Option<Vec<Sighting>> {
    let placed = optics.at_pose(pose).ok()?;
    let seen = |marker: &Marker| {
        Some(Sighting { id: marker.id, centroid_px: marker.image(&placed).ok()?.centroid_px })
    };
    markers.iter().map(seen).collect()
}
