//! The fit: starts, damped steps, covariance, and the constants that come out.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::mistakes::CentroidMistake;
use super::normal::{OwnBlock, Reduced};
use super::plausibility::{examine_numbers, examine_observations, examine_residuals, near_mistakes};
use super::problem::{Problem, Seen};
use super::types::{Kind, Observation, OpticsFit, OpticsFitError, Parameter};
use crate::constants::{CalibrationPriors, Constants, OpticsUncertainty};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::{Rigid, rotation_from_vector};
use domecast_optics::pose::Sighting;

const MAX_STEPS: u32 = 60;
/// A mistake is taken for one where the squares without it, in deviations, are less by this much: odds of e^12.5.
const CLEARLY: f64 = 25.0;

/// Fits the sensor to the observations; the first `at_rest` frames (one at least) are without load.
///
/// # Errors
/// See [`OpticsFitError`].
pub fn fit(
    constants: &Constants,
    observations: &[Observation],
    priors: &CalibrationPriors,
    at_rest: usize,
) -> Result<OpticsFit, OpticsFitError> {
    let problem = Problem::new(constants, observations, priors, at_rest)?;
    examine_observations(&problem, constants, priors)?;
    let (solution, last) = solve(&problem, priors, observations)?;
    if let Some(name) = better_explained(&problem, constants, priors, last.cost) {
        return Err(OpticsFitError::Suspect(format!("looks like {name}")));
    }
    let x = &solution.x;
    let open = || {
        OpticsFitError::Suspect(
            "the equations are not positive definite: the marks leave a number open".into(),
        )
    };
    let covariance = last.matrix.clone().cholesky().ok_or_else(open)?.inverse();
    examine_residuals(&problem, priors, x, &solution.poses)?;
    let parameters = parameters_of(&problem, constants, x, &covariance);
    examine_numbers(&problem, x, &parameters)?;
    Ok(OpticsFit {
        constants: measured(constants, &problem, x, &covariance)?,
        parameters,
        rms_px: solution.rms_px,
        iterations: solution.iterations,
        poses: problem.frames.iter().copied().zip(solution.poses).collect(),
        outliers: last.outliers,
    })
}

/// The mistake without which the centroids fit clearly better; of those that are too small to show before a fit.
fn better_explained(
    problem: &Problem,
    constants: &Constants,
    priors: &CalibrationPriors,
    cost: f64,
) -> Option<String> {
    let optics = SensorOptics::new(&problem.nominal).ok()?;
    let fitted = |mistake: CentroidMistake| {
        let cured = |seen: &Seen| {
            let mark = *seen.observation;
            let (index, centroid_px) = mistake.taken_back(mark.kind, seen.index, mark.centroid_px)?;
            let id = match mark.kind {
                Kind::White => constants.white_markers.get(index)?.id,
                Kind::Black => constants.black_dots.get(index)?.id,
            };
            Some(Observation { id, centroid_px, ..mark })
        };
        let observations: Vec<Observation> =
            problem.seen.iter().flatten().map(cured).collect::<Option<_>>()?;
        let other = Problem::new(constants, &observations, priors, problem.at_rest).ok()?;
        let (_, last) = solve(&other, priors, &observations).ok()?;
        // In the noise that is there, should it be more than is taken for it.
        let variance = (last.cost / last.count.max(1) as f64).max(1.0);
        (last.cost < cost - CLEARLY * variance).then_some((last.cost, mistake.name))
    };
    let better = near_mistakes(problem, constants, &optics, priors).into_iter().filter_map(fitted);
    better.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
}

/// Every number but the dots', with its deviation before and after.
fn parameters_of(
    problem: &Problem,
    constants: &Constants,
    x: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<Parameter> {
    let (first, count) = (problem.body_numbers(), problem.intrinsics.count());
    let steps = problem.intrinsics.steps(&x[first..first + count]);
    let after = problem.intrinsics.covariance(&covariance.view((first, first), (count, count)).into_owned());
    let before = problem.intrinsics.covariance(&DMatrix::identity(count, count));
    let named = problem.camera_numbers() + 2 * problem.white_markers.len();
    let parameter = |k: usize| {
        let (name, nominal) = problem.name(k, constants);
        let (step, prior, own) = match k.checked_sub(first).filter(|own| *own < count) {
            Some(own) => (steps[own], before[(own, own)], after[(own, own)]),
            None => (x[k], problem.priors[k].powi(2), covariance[(k, k)]),
        };
        let (prior_sd, sd) = (prior.max(0.0).sqrt(), own.max(0.0).sqrt());
        Parameter { name, nominal, value: nominal + step, prior_sd, sd, observed: sd < 0.9 * prior_sd }
    };
    (0..named).map(parameter).collect()
}

/// Numbers and poses, and how they were found.
struct Solution {
    x: Vec<f64>,
    poses: Vec<Rigid>,
    /// Root mean square of the residuals before and after, px.
    rms_px: [f64; 2],
    iterations: u32,
}

fn rms_of(equations: &Reduced) -> f64 {
    (equations.squares / equations.count.max(1) as f64).sqrt()
}

/// Each frame's pose after a step of the numbers, with what the elimination left of it.
fn step_poses(poses: &[Rigid], blocks: &[Option<OwnBlock>], step: &DVector<f64>) -> Vec<Rigid> {
    let moved = |(pose, own): (&Rigid, &Option<OwnBlock>)| match own {
        Some((inverse, coupling, right)) => {
            let m = inverse * (right - coupling.transpose() * step);
            let turn = rotation_from_vector(DVec3::new(m[3], m[4], m[5]));
            Rigid::new(turn, DVec3::new(m[0], m[1], m[2])).compose(pose)
        }
        None => *pose,
    };
    poses.iter().zip(blocks).map(moved).collect()
}

/// Levenberg-Marquardt from nominal numbers, at most [`MAX_STEPS`] steps; the equations without damping come with the
/// solution.
fn solve(
    problem: &Problem,
    priors: &CalibrationPriors,
    observations: &[Observation],
) -> Result<(Solution, Reduced), OpticsFitError> {
    let mut at = Solution {
        x: vec![0.0; problem.numbers()],
        poses: start_poses(problem, priors)?,
        rms_px: [0.0; 2],
        iterations: 0,
    };
    let hidden = || {
        let first = observations.first();
        OpticsFitError::NotVisible {
            kind: first.map_or(Kind::White, |o| o.kind),
            id: first.map_or(0, |o| o.id),
        }
    };
    let mut damping = 1e-6;
    let mut now = problem
        .reduce(&at.x, &at.poses, priors, damping)
        .ok_or_else(|| first_hidden(problem, &at.x, &at.poses).unwrap_or_else(hidden))?;
    at.rms_px[0] = rms_of(&now);
    let mut converged = false;
    while at.iterations < MAX_STEPS && !converged {
        at.iterations += 1;
        let mut damped = now.matrix.clone();
        for k in 0..problem.numbers() {
            damped[(k, k)] *= 1.0 + damping;
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&now.right)) else {
            damping *= 10.0;
            continue;
        };
        let next_x: Vec<f64> = at.x.iter().zip(step.iter()).map(|(a, b)| a + b).collect();
        let next_poses = step_poses(&at.poses, &now.poses, &step);
        match problem.reduce(&next_x, &next_poses, priors, damping * 0.1) {
            Some(next) if next.cost <= now.cost * (1.0 + 1e-12) => {
                converged = now.cost - next.cost <= 1e-7 * (1.0 + now.cost);
                (at.x, at.poses, now) = (next_x, next_poses, next);
                damping = (0.1 * damping).max(1e-12);
            }
            _ if damping < 1e8 => {
                damping *= 10.0;
                // The eliminated blocks carry the damping too.
                if let Some(again) = problem.reduce(&at.x, &at.poses, priors, damping) {
                    now = again;
                }
            }
            _ => converged = true,
        }
    }
    if !converged {
        return Err(OpticsFitError::NotConverged { rms_px: rms_of(&now) });
    }
    let last = problem.reduce(&at.x, &at.poses, priors, 0.0).unwrap_or(now);
    at.rms_px[1] = rms_of(&last);
    Ok((at, last))
}

/// The first mark that the nominal sensor does not see.
fn first_hidden(problem: &Problem, x: &[f64], poses: &[Rigid]) -> Option<OpticsFitError> {
    let rest = SensorOptics::new(&problem.spec(x)).ok()?;
    for (seen, pose) in problem.seen.iter().zip(poses) {
        let optics = rest.at_pose(pose).ok()?;
        for mark in seen {
            if optics.project(problem.place(x, mark)).is_err() {
                return Some(OpticsFitError::NotVisible {
                    kind: mark.observation.kind,
                    id: mark.observation.id,
                });
            }
        }
    }
    None
}

/// Each frame's pose with nominal numbers; the first is rest.
fn start_poses(problem: &Problem, priors: &CalibrationPriors) -> Result<Vec<Rigid>, OpticsFitError> {
    let optics = SensorOptics::new(&problem.nominal).map_err(|e| OpticsFitError::Constants(e.to_string()))?;
    let solver = problem.pose_solver(&optics, priors)?;
    let mut poses = vec![Rigid::identity(); problem.at_rest.min(problem.frames.len())];
    for (frame, seen) in problem.frames.iter().zip(&problem.seen).skip(problem.at_rest) {
        let sightings: Vec<Sighting> = seen
            .iter()
            .filter(|mark| mark.observation.kind == Kind::White)
            .map(|mark| Sighting {
                id: problem.white_markers[mark.index].id,
                centroid_px: mark.observation.centroid_px,
            })
            .collect();
        if sightings.len() < 4 {
            return Err(OpticsFitError::FewMarkers { frame: *frame });
        }
        // A frame whose markers fit badly still has a place near rest to start from.
        poses.push(solver.solve(&sightings).map_or(Rigid::identity(), |found| found.pose));
    }
    Ok(poses)
}

/// What is left open of camera, layers and white markers.
fn uncertainty(constants: &Constants, problem: &Problem, covariance: &DMatrix<f64>) -> OpticsUncertainty {
    let (first, count) = (problem.body_numbers(), problem.intrinsics.count());
    let named = problem.camera_numbers() + 2 * problem.white_markers.len();
    let mut root = DMatrix::identity(named, named);
    if let Some(own) = problem.intrinsics.root() {
        root.view_mut((first, first), (count, count)).copy_from(own);
    }
    let whole = &root * covariance.view((0, 0), (named, named)) * root.transpose();
    let row = |i: usize| (0..named).map(|j| 0.5 * (whole[(i, j)] + whole[(j, i)])).collect();
    OpticsUncertainty {
        parameters: (0..named).map(|k| problem.name(k, constants).0).collect(),
        covariance: (0..named).map(row).collect(),
    }
}

/// The constants with what was fitted.
fn measured(
    constants: &Constants,
    problem: &Problem,
    x: &[f64],
    covariance: &DMatrix<f64>,
) -> Result<Constants, OpticsFitError> {
    let spec = problem.spec(x);
    let optics = SensorOptics::new(&spec).map_err(|e| OpticsFitError::Constants(e.to_string()))?;
    let mut made = constants.clone();
    let (first, count) = (problem.body_numbers(), problem.intrinsics.count());
    if count > 0 {
        made.camera.matrix = spec.lens.matrix;
        made.camera.distortion.clone_from(&spec.lens.distortion);
        made.camera.max_field_angle_rad = optics.lens().max_field_angle_rad();
        let left =
            problem.intrinsics.covariance(&covariance.view((first, first), (count, count)).into_owned());
        let row = |i: usize| (0..count).map(|j| 0.5 * (left[(i, j)] + left[(j, i)])).collect();
        made.camera.intrinsics_covariance = (0..count).map(row).collect();
    }
    made.camera.camera_from_sensor = spec.sensor_from_camera.inverse().to_rows_4x4();
    let first_is_air = made.optics.layers.first().is_some_and(|l| l.name == "air");
    if first_is_air && let Some(air) = made.optics.layers.first_mut() {
        air.thickness_mm = Some(optics.air_gap_mm());
    }
    for (layer, fitted) in made.optics.layers.iter_mut().skip(usize::from(first_is_air)).zip(&spec.layers) {
        layer.thickness_mm = fitted.thickness_mm;
        layer.index = fitted.index[1];
        if layer.index_rgb.is_some() {
            layer.index_rgb = Some(fitted.index);
        }
    }
    for (index, marker) in made.white_markers.iter_mut().enumerate() {
        let fitted = problem.white(x, index);
        marker.position_mm = fitted.position_mm.to_array();
        let hidden = |_| OpticsFitError::NotVisible { kind: Kind::White, id: marker.id };
        marker.image_px = optics.project(fitted.position_mm).map_err(hidden)?.to_array();
    }
    for (index, dot) in made.black_dots.iter_mut().enumerate() {
        let at = problem.black(x, index);
        let hidden = |_| OpticsFitError::NotVisible { kind: Kind::Black, id: dot.id };
        dot.surface_mm = at.to_array();
        dot.normal = (at / at.length()).to_array();
        dot.image_px = optics.project(at).map_err(hidden)?.to_array();
    }
    made.optics_uncertainty = Some(uncertainty(constants, problem, covariance));
    if let Some(open) = made.springs.as_mut().and_then(|springs| springs.uncertainty.as_mut()) {
        // The stiffness was measured through other optics.
        open.through_optics = false;
    }
    made.refit_plain_runtime();
    Ok(made)
}
