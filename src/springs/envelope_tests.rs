use glam::DVec3;

use super::tests::{close, platform};
use super::*;
use domecast_optics::numeric::{Rigid, rotation_from_vector};

// 1 N sideways, 20 mm above the springs' middle, four coils: 20 / (3 k r^2) is 3.87 degrees, the springs' own
// bending takes a twentieth off; the springs nearest to the push stand at r cos 30, so their tension is 20 cos 30 / (3 r), less that twentieth.
#[test]
fn a_sideways_push_tilts_the_platform() {
    let suspension = platform(4.0, false);
    let push = Wrench::of_load(DVec3::X, DVec3::ZERO, DVec3::new(0.0, 0.0, 12.5), suspension.at_mm());
    close(push.moment_nmm.y, 20.0, 1e-12);
    let limits = Limits { grip_force_n: Some(0.8), ..Limits::default() };
    let case = try_load(&suspension, &limits, &push);
    let balance = case.equilibrium.clone().unwrap();
    close(balance.displacement.rotation_rad.y.to_degrees(), 3.8, 0.12);
    let tension = case.springs.iter().map(|s| -s.axial_n).fold(f64::MIN, f64::max);
    close(tension, 0.565, 0.01);
    assert_eq!(case.checks[0].limit, Limit::SpringLeavesMagnet);
}

#[test]
fn a_load_beyond_the_springs_is_named() {
    let suspension = platform(3.0, false);
    let limits = Limits { grip_force_n: Some(0.8), ..Limits::default() };
    let press = |n: f64| {
        let load = Wrench::of_load(
            DVec3::new(0.0, 0.0, -n),
            DVec3::ZERO,
            DVec3::new(0.0, 0.0, 10.0),
            suspension.at_mm(),
        );
        try_load(&suspension, &limits, &load)
    };
    assert_eq!(press(17.0).passed().count(), 0, "{:?}", press(17.0).checks);
    let bound = press(30.0);
    assert_eq!(bound.passed().next().unwrap().limit, Limit::WireOverStressed);
    assert!(bound.passed().any(|c| c.limit == Limit::CoilBind));
    let huge = press(1e6);
    assert_eq!(huge.checks[0].limit, Limit::PlatformTips);
    assert!(matches!(huge.equilibrium, Err(MechanicsError::NotCarried { .. })));
    let nan = try_load(&suspension, &limits, &Wrench::from_array([f64::NAN; 6]));
    assert_eq!(nan.equilibrium, Err(MechanicsError::NotFinite));
    assert!(nan.passed().next().is_some());
}

#[test]
fn stops_count_tilt() {
    let disc = Stop {
        name: "sheet".into(),
        limit: Limit::CameraGapCloses,
        shape: StopShape::Disc { center_mm: DVec3::new(0.0, 0.0, -1.0), radius_mm: 4.0 },
        floor_z_mm: -2.0,
    };
    let limits = Limits { grip_force_n: None, stops: vec![disc] };
    let suspension = platform(3.0, false);
    let tilted = Displacement::of_pose(
        &Rigid::new(rotation_from_vector(DVec3::new(0.0, 0.1, 0.0)), DVec3::new(0.0, 0.0, -0.4)),
        suspension.at_mm(),
    );
    let (_, checks) = checks_at(&suspension, &limits, &tilted).unwrap();
    let gap = checks.iter().find(|c| c.limit == Limit::CameraGapCloses).unwrap();
    close(gap.value, 0.4 - (1.0 - 0.1_f64.cos()) + 4.0 * 0.1_f64.sin(), 1e-12);
    close(gap.bound, 1.0, 1e-12);
}

#[test]
fn the_envelope_ends_at_what_is_known() {
    let suspension = platform(4.0, false);
    let limits = Limits { grip_force_n: Some(0.8), ..Limits::default() };
    let nothing = |_: &Rigid| Vec::new();
    let directions =
        standard_directions(suspension.at_mm(), &domecast_optics::DomeShape::hemisphere(10.0), 4);
    let press = reach(&suspension, &limits, &nothing, &directions[0]);
    // Six springs of four coils bind at 20.1 N; the wire bears 838 MPa at 17 N, so 1180 at 23.9.
    close(press.factor, 20.12, 0.02);
    assert_eq!(press.ended_by.unwrap().limit, Limit::CoilBind);
    let pull = reach(&suspension, &limits, &nothing, &directions[1]);
    close(pull.factor, 6.0 * 0.8, 2e-4);
    assert_eq!(pull.ended_by.unwrap().limit, Limit::SpringLeavesMagnet);
    // A check from outside ends a load too.
    let below = |pose: &Rigid| {
        vec![Check {
            limit: Limit::MarkerOutOfMask,
            part: "marker 0".into(),
            value: -pose.translation_mm.z,
            bound: 1.0,
            unit: "px",
        }]
    };
    let press = reach(&suspension, &limits, &below, &directions[0]);
    close(press.factor, 6.0 * suspension.spec().spring.axial_n_per_mm(), 2e-4);
    assert_eq!(press.ended_by.unwrap().limit, Limit::MarkerOutOfMask);
    let found = choices(suspension.spec(), &limits, &nothing, &directions[0].wrench.scaled(17.0));
    let fit: Vec<f64> = found
        .iter()
        .filter(|c| c.spring.wire_diameter_mm == 0.3 && !c.worst.is_passed())
        .map(|c| c.spring.active_coils)
        .collect();
    assert_eq!(fit, [2.0, 3.0, 4.0]);
}
