//! Whether the wrench's deviation holds: sensors drawn from the tolerances, calibrated as a user does, their markers seen
//! with noise and faults; how often is the wrench within one, two and three deviations of the truth?
#![allow(clippy::unwrap_used)]

use std::path::Path;

use domecast_optics::SensorOptics;
use domecast_optics::numeric::{Rigid, SeededRandom, rotation_from_vector};
use domecast_optics::pose::{Marker, PoseOptions, PoseSolver, Sighting, outline_centroid_offset};
use domecast_runtime::calibrate::force::{MotionNoise, Pair, fit as fit_force};
use domecast_runtime::calibrate::optics::{Kind, Observation, fit as fit_optics};
use domecast_runtime::constants::{Constants, matrix_of};
use domecast_runtime::track::{MarkerCentroid, WrenchMeter};
use domecast_springs::{Displacement, Suspension};
use glam::{DVec2, DVec3};
use nalgebra::Matrix6;

const CENTROID_PX: f64 = 0.1;

/// A build's constants with some of its dots.
fn nominal() -> Constants {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/cases/sensors/thumb24.json");
    Constants::load(&path).unwrap()
}

/// A sensor as it may have been built.
struct Built {
    optics: SensorOptics,
    markers: Vec<Marker>,
    dots: Vec<DVec3>,
    /// Each spring by itself.
    springs: Vec<Suspension>,
    at_mm: DVec3,
}

fn three(random: &mut SeededRandom, sd: [f64; 3]) -> DVec3 {
    DVec3::from_array(sd.map(|sd| sd * random.normal()))
}

impl Built {
    fn draw(constants: &Constants, random: &mut SeededRandom) -> Self {
        let tolerances = constants.tolerances.unwrap();
        let mut spec = constants.optics_spec().unwrap();
        spec.sensor_from_camera.translation_mm += three(random, tolerances.pupil_mm);
        spec.sensor_from_camera.rotation *=
            rotation_from_vector(three(random, tolerances.camera_rotation_rad));
        for layer in &mut spec.layers {
            if let Some(thickness) = layer.thickness_mm.as_mut() {
                *thickness += tolerances.layer_thickness_mm * random.normal();
            }
            let step = tolerances.index * random.normal();
            layer.index.iter_mut().for_each(|index| *index += step);
        }
        let optics = SensorOptics::new(&spec).unwrap();
        let mut markers = constants.markers();
        for marker in &mut markers {
            let sd = tolerances.white_marker_mm;
            marker.position_mm += three(random, [sd, sd, 0.0]);
        }
        let dome = *optics.dome();
        let dots = constants.black_dots.iter().map(|dot| {
            dome.onto(DVec3::from_array(dot.surface_mm) + three(random, [tolerances.black_dot_mm; 3]))
        });
        let dots = dots.collect();
        let at = constants.springs.as_ref().unwrap().at_mm;
        Self { optics, markers, dots, springs: springs_of(constants, random), at_mm: DVec3::from_array(at) }
    }

    fn wrench(&self, displacement: &Displacement) -> [f64; 6] {
        let mut sum = [0.0; 6];
        for spring in &self.springs {
            let own = spring.wrench_at(displacement).unwrap().to_array();
            sum.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
        }
        sum
    }

    /// The camera as it stands after it was knocked about by the drift's tolerance.
    fn drift(&mut self, constants: &Constants, random: &mut SeededRandom) {
        let t = constants.tolerances.unwrap();
        let mut spec = self.optics.spec();
        spec.sensor_from_camera.translation_mm += three(random, [t.camera_drift_mm; 3]);
        spec.sensor_from_camera.rotation *= rotation_from_vector(three(random, [t.camera_drift_rad; 3]));
        self.optics = SensorOptics::new(&spec).unwrap();
    }

    fn white(&self, optics: &SensorOptics) -> Vec<DVec2> {
        self.markers.iter().map(|marker| marker.image(optics).unwrap().centroid_px).collect()
    }
}

fn springs_of(constants: &Constants, random: &mut SeededRandom) -> Vec<Suspension> {
    let springs = constants.springs.as_ref().unwrap();
    let (law, t) = (springs.law.as_ref().unwrap(), constants.tolerances.unwrap().springs.unwrap());
    let (wire, moduli) = (t.wire_diameter_mm * random.normal(), 1.0 + t.modulus_part * random.normal());
    let one = |end: &[f64; 3]| {
        let mut own = law.clone();
        own.upper_ends_mm = vec![*end];
        own.weight_n = own.weight_n.map(|v| v / law.upper_ends_mm.len() as f64);
        own.wire_diameter_mm += wire;
        own.outer_diameter_mm += t.outer_diameter_mm * random.normal();
        own.active_coils += t.active_coils * random.normal();
        own.shear_modulus_mpa *= moduli;
        own.elastic_modulus_mpa *= moduli;
        own.suspension(springs.at_mm).unwrap()
    };
    law.upper_ends_mm.iter().map(one).collect()
}

/// Somewhere in the sensor's travel.
fn motion(random: &mut SeededRandom) -> Displacement {
    let mut even = |size: f64| size * (2.0 * random.uniform() - 1.0);
    Displacement {
        translation_mm: DVec3::new(even(0.15), even(0.15), -0.6 + even(0.7)),
        rotation_rad: DVec3::new(even(0.025), even(0.025), even(0.03)),
    }
}

/// Shares within one, two and three deviations, by axis.
#[derive(Default)]
struct Coverage {
    counts: [[f64; 3]; 6],
    draws: f64,
    said: [f64; 6],
    missed: [f64; 6],
}

impl Coverage {
    fn add(&mut self, found: [f64; 6], sd: [f64; 6], truth: [f64; 6]) {
        self.draws += 1.0;
        for axis in 0..6 {
            let z = (found[axis] - truth[axis]).abs() / sd[axis];
            for (k, count) in self.counts[axis].iter_mut().enumerate() {
                *count += f64::from(u8::from(z <= (k + 1) as f64));
            }
            self.said[axis] += sd[axis].powi(2);
            self.missed[axis] += (found[axis] - truth[axis]).powi(2);
        }
    }

    fn check(&self, name: &str) {
        let part = |axis: usize, k: usize| 100.0 * self.counts[axis][k] / self.draws;
        let rms = |squares: &[f64; 6]| squares.map(|v| (v / self.draws).sqrt());
        println!(
            "{name}: {} draws, said {:.4?}, missed {:.4?}",
            self.draws,
            rms(&self.said),
            rms(&self.missed)
        );
        for axis in 0..6 {
            println!("  axis {axis}: {:.1} {:.1} {:.2} %", part(axis, 0), part(axis, 1), part(axis, 2));
        }
        for axis in 0..6 {
            let [one, two, three] = [part(axis, 0), part(axis, 1), part(axis, 2)];
            assert!((60.0..=75.0).contains(&one), "{name} axis {axis}: {one} % within one deviation");
            assert!((93.0..=98.0).contains(&two), "{name} axis {axis}: {two} % within two");
            assert!(three >= 99.0, "{name} axis {axis}: {three} % within three");
        }
    }
}

/// What a frame shows of the markers: each with its own noise, now and then one that is dirty, or hidden.
fn faulty(built: &Built, optics: &SensorOptics, random: &mut SeededRandom) -> Vec<MarkerCentroid> {
    let hidden = if random.uniform() < 0.15 { random.next_u64() as usize % 4 } else { 4 };
    let mut seen = Vec::new();
    for (index, (marker, at)) in built.markers.iter().zip(built.white(optics)).enumerate() {
        let is_dirty = random.uniform() < 0.08;
        let sd_px = if is_dirty { 0.5 } else { 0.03 * (0.5 * random.normal()).exp() };
        let centroid_px = at + DVec2::new(random.normal(), random.normal()) * sd_px;
        if index != hidden {
            seen.push(MarkerCentroid { id: marker.id, centroid_px, sd_px });
        }
    }
    seen
}

fn take_frames(
    coverage: &mut Coverage,
    meter: &mut WrenchMeter,
    built: &Built,
    frames: usize,
    random: &mut SeededRandom,
) {
    for _ in 0..frames {
        let displacement = motion(random);
        let optics = built.optics.at_pose(&displacement.to_pose(built.at_mm)).unwrap();
        let seen = faulty(built, &optics, random);
        let found = meter.measure(&seen, &Rigid::identity()).unwrap();
        let (wrench, sd) = (found.wrench.unwrap(), found.wrench_sd.unwrap());
        coverage.add(wrench.to_array(), sd.to_array(), built.wrench(&displacement));
    }
}

// Nothing is calibrated: what counts is how the sensor was made.
#[test]
fn the_deviation_holds_before_any_calibration() {
    let constants = nominal();
    let (mut random, mut coverage) = (SeededRandom::new(1), Coverage::default());
    let mut meter = WrenchMeter::new(&constants).unwrap();
    for _ in 0..10_000 {
        let built = Built::draw(&constants, &mut random);
        take_frames(&mut coverage, &mut meter, &built, 1, &mut random);
    }
    coverage.check("nominal");
}

/// Centroids of frames at rest and under load, as `calibrate-optics` gets them.
fn optics_table(built: &Built, constants: &Constants, random: &mut SeededRandom) -> Vec<Observation> {
    let mut table = Vec::new();
    for frame in 0..10 {
        let displacement = if frame < 4 { Displacement::default() } else { motion(random) };
        let optics = built.optics.at_pose(&displacement.to_pose(built.at_mm)).unwrap();
        let mut add = |kind, id, at: DVec2| {
            let centroid_px = at + DVec2::new(random.normal(), random.normal()) * CENTROID_PX;
            table.push(Observation { frame, kind, id, centroid_px });
        };
        for (marker, at) in built.markers.iter().zip(built.white(&optics)) {
            add(Kind::White, marker.id as usize, at);
        }
        for (dot, at) in constants.black_dots.iter().zip(&built.dots) {
            let east = DVec3::new(-at.y, at.x, 0.0).normalize();
            let north = optics.dome().normal(*at).cross(east);
            let center = optics.project(*at).unwrap();
            let offset = outline_centroid_offset(center, |cos, sin| {
                let rim = *at + (east * cos + north * sin) * (0.5 * dot.diameter_mm);
                optics.project(optics.dome().onto(rim)).ok()
            });
            add(Kind::Black, dot.id, center + offset.unwrap());
        }
    }
    table
}

/// How the motions of a force table are known.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motions {
    Stated,
    Pixels,
}

/// Readings of a load cell whose noise is `cell` times a usual one's.
fn force_table(
    built: &Built,
    constants: &Constants,
    (motions, cell): (Motions, f64),
    random: &mut SeededRandom,
) -> Vec<Pair> {
    let options = PoseOptions::new(0.5, 10.0);
    let solver = PoseSolver::new(&constants.sensor().unwrap(), &constants.markers(), options).unwrap();
    let mut pairs = Vec::new();
    for _ in 0..150 {
        let displacement = motion(random);
        let wrench = built.wrench(&displacement);
        let (mut seen, mut covariance) = (displacement.to_array(), Matrix6::zeros());
        if motions == Motions::Pixels {
            let optics = built.optics.at_pose(&displacement.to_pose(built.at_mm)).unwrap();
            let sightings: Vec<Sighting> = built
                .markers
                .iter()
                .zip(built.white(&optics))
                .map(|(marker, at)| Sighting {
                    id: marker.id,
                    centroid_px: at + DVec2::new(random.normal(), random.normal()) * CENTROID_PX,
                })
                .collect();
            let found = solver.solve(&sightings).unwrap();
            covariance = found.displacement_covariance(built.at_mm) * (CENTROID_PX / 0.5).powi(2);
            seen = Displacement::of_pose(&found.pose, built.at_mm).to_array();
        }
        let noise = [0.02, 0.02, 0.05, 0.2, 0.2, 0.2].map(|sd| sd * cell);
        let read = std::array::from_fn(|i| Some(wrench[i] + noise[i] * random.normal()));
        pairs.push(Pair { displacement: seen, displacement_covariance: covariance, wrench: read });
    }
    pairs
}

/// The constants after both calibrations, or those that are asked for.
fn calibrated(
    built: &Built,
    constants: &Constants,
    (optics, force): (bool, Option<(Motions, f64)>),
    random: &mut SeededRandom,
) -> Constants {
    let mut made = constants.clone();
    if optics {
        let table = optics_table(built, constants, random);
        made = fit_optics(constants, &table, &constants.tolerances.unwrap(), 4).unwrap().constants;
    }
    if let Some((motions, cell)) = force {
        let pairs = force_table(built, &made, (motions, cell), random);
        let nominal = matrix_of(&made.springs.as_ref().unwrap().stiffness);
        let sizes = [0.02, 0.02, 0.02, 0.002, 0.002, 0.002];
        let found = fit_force(&pairs, &nominal, &sizes, MotionNoise::Stated).unwrap();
        found.write_into(&mut made, &pairs, motions == Motions::Pixels);
    }
    made
}

fn after_calibrations(name: &str, what: (bool, Option<(Motions, f64)>), seed: u64) {
    let nominal = nominal();
    let (mut random, mut coverage) = (SeededRandom::new(seed), Coverage::default());
    for _ in 0..400 {
        let mut built = Built::draw(&nominal, &mut random);
        let constants = calibrated(&built, &nominal, what, &mut random);
        built.drift(&nominal, &mut random);
        let mut meter = WrenchMeter::new(&constants).unwrap();
        take_frames(&mut coverage, &mut meter, &built, 25, &mut random);
    }
    coverage.check(name);
}

#[test]
fn long_the_deviation_holds_after_calibrate_optics() {
    after_calibrations("optics", (true, None), 3);
}

#[test]
fn long_the_deviation_holds_after_both_calibrations() {
    after_calibrations("optics and force", (true, Some((Motions::Stated, 1.0))), 4);
}

#[test]
fn long_the_deviation_holds_after_both_calibrations_by_pixels() {
    after_calibrations("optics and force by pixels", (true, Some((Motions::Pixels, 1.0))), 5);
}
