//! The fit in its order: the frame at rest alone, the presses with what it says, then all together.

use glam::DVec3;
use serde_json::json;

use super::checks;
use super::equations::{Problem, Values};
use super::frames::Bench;
use super::measured::measured_light;
use super::model::LightModel;
use super::observed::{Observed, SeenPress, rest_places};
use super::physics::Physics;
use super::scatter::{FIRST_LENGTHS, Scatter};
use super::solve::{Open, Solved, Start, scatter, solve};
use super::types::{BallPress, LightFit, LightFitError, LightFitOptions, place_deg};
use super::verdict;
use crate::constants::{Constants, LightConstants};
use crate::shape::SeenCell;
use crate::track::{CameraFrame, Tracked};

/// By how many times the errors at rest are taken to be larger first: with small ones at once, lights that are far from nominal end in
/// a light that is none.
const ROUGH: f64 = 4.0;
/// Deviation of the radius' logarithm where the ball's is taken for true, and where it is left free.
const KNOWN_RADIUS: f64 = 1e-5;
const FREE_RADIUS: f64 = 0.5;

/// Fits the light of a sensor to a frame at rest and presses of one ball.
///
/// # Errors
/// [`LightFitError`]: frames that cannot be this sensor's, or from which its light cannot be found.
pub fn fit(
    constants: &Constants,
    rest: &CameraFrame<'_>,
    presses: &[CameraFrame<'_>],
    options: &LightFitOptions,
) -> Result<LightFit, LightFitError> {
    checks::input(presses.len(), options.ball_radius_mm)?;
    let mut bench = Bench::new(constants)?;
    let Some(nominal) = &constants.light else {
        return Err(LightFitError::new(
            "these constants have no light",
            "build the design again with this release",
        ));
    };
    let tracked = bench.track(rest);
    checks::marks_at_rest(constants, bench.optics(), &tracked)?;
    let cells = bench.rest(rest, &tracked)?;
    checks::saturation(0, &cells)?;
    let model = LightModel::new(nominal);
    let fault = |problem: String| LightFitError::new(problem, "give constants written by `domecast build`");
    let physics = Physics::new(bench.optics(), nominal).map_err(fault)?;
    let still = Observed { rest: rest_places(&cells), noise: bench.noise(), ..Observed::default() };
    let dome_mm = physics.dome().1;
    let problem = Problem {
        model: &model,
        physics: &physics,
        seen: &still,
        radius_mm: options.ball_radius_mm,
        radius_sd: KNOWN_RADIUS,
        start_gain: start_gain(&cells, nominal.stray),
        start_stray: nominal.stray,
        scatter: FIRST_LENGTHS.map(|part| Scatter::first(part * dome_mm)),
        is_rough: false,
    };
    let values = Values { numbers: vec![0.0; model.count()], centers: Vec::new(), radius: 0.0 };
    let rough = solve(&problem.rougher(ROUGH), Start { values, lit: None, slopes: None }, Open::All)?;
    let steps = rough.steps;
    let at_rest = solve(&problem, Start { lit: None, ..rough.go_on() }, Open::All)?;
    let steps = steps + at_rest.steps;
    verdict::lights(&model, &at_rest.values.numbers)?;
    let first = model.physical_light(&at_rest.values.numbers);
    let seen = see_presses(constants, &first, (rest, &tracked), presses, options, still.clone())?;
    let mut start = Start { slopes: None, ..at_rest.go_on() };
    start.values.centers = vec![DVec3::ZERO; seen.presses.len()];
    let problem = Problem { seen: &seen, start_stray: first.stray, ..problem };
    together(constants, problem, start, steps)
}

/// Looks at one press before a fit: where it lies, from the pole and about the axis, degrees.
///
/// # Errors
/// [`LightFitError`]: a frame that cannot be a press of this ball, by its number (0 at rest, 1 the press).
pub fn examine_press(
    constants: &Constants,
    rest: &CameraFrame<'_>,
    press: &CameraFrame<'_>,
    options: &LightFitOptions,
) -> Result<[f64; 2], LightFitError> {
    checks::radius(options.ball_radius_mm)?;
    let mut bench = Bench::new(constants)?;
    let tracked = bench.track(rest);
    bench.rest(rest, &tracked)?;
    let (found, _) = bench.press((1, 0), press, options.ball_radius_mm)?;
    Ok(place_deg(found.center_mm - bench.optics().dome().center_mm()))
}

/// Where to press next, from the pole and about the axis, degrees, given the places of those that were taken; `None` once they are
/// enough and far enough from each other.
///
/// # Errors
/// [`LightFitError`]: constants of no sensor.
pub fn next_press(constants: &Constants, taken: &[[f64; 2]]) -> Result<Option<[f64; 2]>, LightFitError> {
    let fault = |problem: String| LightFitError::new(problem, "give constants written by `domecast build`");
    let rim_deg = constants.sensor().map_err(fault)?.dome().meridian_end_rad().to_degrees();
    Ok(checks::next_place(taken, rim_deg))
}

/// The presses as the light of the frame at rest shows them, beside the places of that.
fn see_presses(
    constants: &Constants,
    light: &LightConstants,
    (rest, tracked): (&CameraFrame<'_>, &Tracked),
    presses: &[CameraFrame<'_>],
    options: &LightFitOptions,
    mut seen: Observed,
) -> Result<Observed, LightFitError> {
    let mut known = Bench::new(&with_light(constants, light.clone()))?;
    let cells = known.rest(rest, tracked)?;
    let dome = known.optics().dome();
    let (center_mm, rim_deg) = (dome.center_mm(), dome.meridian_end_rad().to_degrees());
    verdict::touched_at_rest(&cells, center_mm, light.stray)?;
    for (press, frame) in presses.iter().enumerate() {
        let (found, caps) = known.press((press + 1, press), frame, options.ball_radius_mm)?;
        seen.presses.push(found);
        seen.caps.extend(caps);
    }
    checks::spread(&seen.presses, center_mm, rim_deg)?;
    Ok(seen)
}

/// The fit of all frames together.
fn together(
    constants: &Constants,
    mut problem: Problem<'_>,
    start: Start,
    steps: u32,
) -> Result<LightFit, LightFitError> {
    // With the radius free first: presses of another ball must not be bent to fit this one.
    let balls = solve(&problem, start, Open::Balls)?;
    problem.radius_sd = FREE_RADIUS;
    let steps = steps + balls.steps;
    let first = solve(&problem, Start { slopes: None, ..balls.go_on() }, Open::All)?;
    problem.scatter = scatter(&problem, &first).unwrap_or(problem.scatter);
    // Again with the errors that these frames have: the radius' deviation is theirs.
    let (steps, rms_before) = (steps + first.steps, first.rms[0]);
    let free = solve(&problem, first.go_on(), Open::All)?;
    let last = problem.unknowns() - 1;
    let radius = [free.values.radius, FREE_RADIUS * free.covariance[(last, last)].max(0.0).sqrt()];
    verdict::radius(problem.radius_mm, radius)?;
    problem.radius_sd = KNOWN_RADIUS;
    let steps = steps + free.steps;
    let mut start = free.go_on();
    let free_radius = std::mem::take(&mut start.values.radius);
    let solved = solve(&problem, start, Open::All)?;
    verdict::lights(problem.model, &solved.values.numbers)?;
    let rms = [rms_before, solved.rms[1]];
    Ok(result(constants, &problem, &solved, rms, free_radius, steps + solved.steps))
}

fn with_light(constants: &Constants, light: LightConstants) -> Constants {
    Constants { light: Some(light), ..constants.clone() }
}

/// Level for each mW/mm^2 that goes the camera's way, by the middle of all cells.
fn start_gain(cells: &[SeenCell], stray: f64) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|c| {
        let known = cells.iter().filter(|cell| cell.is_known && cell.passed[c] * cell.still[c] > 0.0);
        let mut all: Vec<f64> =
            known.map(|cell| (cell.level[c] - stray) / (cell.passed[c] * cell.still[c])).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(1.0).max(1e-12)
    }))
}

/// What came out, and the constants with it.
fn result(
    constants: &Constants,
    problem: &Problem<'_>,
    solved: &Solved,
    rms: [[f64; 2]; 2],
    radius: f64,
    iterations: u32,
) -> LightFit {
    let parameters = verdict::parameters(problem.model, solved);
    let pairs = verdict::pairs(problem.model, solved);
    let presses = pressed(problem, solved);
    let mut constants = with_light(constants, measured_light(problem.model, solved));
    let levels = |kind: usize| rms.map(|rms| 255.0 * rms[kind]);
    let given_mm = problem.radius_mm;
    let radius_mm = given_mm * radius.exp();
    let scatter = problem.scatter.map(|scatter| {
        json!({
            "common_part": scatter.common, "own_part": scatter.own, "length_mm": scatter.length_mm, "noise_factor": scatter.noise,
        })
    });
    constants.calibrations.push(json!({
        "kind": "light",
        "frames": presses.len() + 1,
        "ball_radius_mm": given_mm,
        "rms_levels": levels(1),
        "rest_rms_levels": levels(0),
        "radius_by_presses_mm": radius_mm,
        "level_per_mw_mm2": problem.start_gain.to_array(),
        "scatter_at_rest": scatter[0],
        "scatter_under_ball": scatter[1],
        "parameters": parameters,
        "not_distinguished": pairs,
    }));
    LightFit {
        constants,
        parameters,
        pairs,
        presses,
        rms_levels: levels(1),
        rest_rms_levels: levels(0),
        radius_mm,
        iterations,
    }
}

fn pressed(problem: &Problem<'_>, solved: &Solved) -> Vec<BallPress> {
    let centers_mm = problem.centers_mm(&solved.values);
    let first = problem.seen.rest.len();
    let one = |(i, press): (usize, &SeenPress)| {
        let own = problem.seen.caps.iter().enumerate().filter(|(_, cap)| cap.press == i);
        let squares: Vec<f64> =
            own.map(|(k, _)| solved.off.rows(3 * (first + k), 3).norm_squared() / 3.0).collect();
        let sds = problem.center_sds(i);
        let at = problem.model.count() + 3 * i;
        let sd = |k: usize| sds[k] * solved.covariance[(at + k, at + k)].max(0.0).sqrt();
        BallPress {
            frame: press.frame,
            center_mm: centers_mm[i].to_array(),
            center_sd_mm: [sd(0), sd(1), sd(2)],
            place_deg: place_deg(centers_mm[i] - problem.physics.dome().0),
            cells: squares.len(),
            rms_levels: 255.0 * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
            gain: press.gain,
        }
    };
    problem.seen.presses.iter().enumerate().map(one).collect()
}
