//! The fit in its order: the frame at rest alone, the presses with what it says, then all together.

use glam::DVec3;
use serde_json::json;

use super::checks;
use super::equations::{Problem, Values};
use super::frames::Bench;
use super::measured::measured_light;
use super::model::LightModel;
use super::observed::{Observed, still_places};
use super::physics::Physics;
use super::solve::{Solved, rms_of, solve};
use super::types::{BallPress, LightFit, LightFitError, LightFitOptions, place_deg};
use super::verdict;
use crate::constants::{Constants, LightConstants};
use crate::shape::SeenCell;
use crate::track::CameraFrame;

/// By how much levels may be off beside noise before the fit says how much it is, a part; least that it then says.
const FIRST_PARTS: [f64; 2] = [0.01, 0.01];
const MIN_PART: f64 = 0.002;
/// Deviation of the radius' logarithm where the ball's is taken for true, and where it is left free.
const KNOWN_RADIUS: f64 = 1e-5;
const FREE_RADIUS: f64 = 0.5;

/// Fits the light of a sensor to a frame at rest and presses of one ball.
///
/// # Errors
/// [`LightFitError`]: frames that cannot be this sensor's, or from which its light cannot be told.
pub fn fit(
    constants: &Constants,
    rest: &CameraFrame<'_>,
    presses: &[CameraFrame<'_>],
    options: &LightFitOptions,
) -> Result<LightFit, LightFitError> {
    checks::input(presses.len(), options.ball_radius_mm)?;
    let mut bench = Bench::new(constants, options)?;
    let Some(nominal) = &constants.light else {
        return Err(LightFitError::new(
            "these constants have no light",
            "build the design again with this release",
        ));
    };
    let tracked = bench.track(rest);
    checks::marks_at_rest(constants, &tracked)?;
    let cells = bench.rest(rest, &tracked)?;
    checks::saturation(0, &cells)?;
    let model = LightModel::new(nominal);
    let fault = |problem: String| LightFitError::new(problem, "give constants written by `domecast build`");
    let physics = Physics::new(bench.optics(), nominal).map_err(fault)?;
    let mut seen = Observed {
        still: still_places(&cells, |cell| cell.is_known),
        noise: bench.noise(),
        parts: FIRST_PARTS,
        ..Observed::default()
    };
    let gain = start_gain(&cells, nominal.stray);
    let mut values = Values { numbers: vec![0.0; model.count()], centers: Vec::new(), radius: 0.0 };
    let start = |values: Values, seen: &Observed, (sd, stray): (f64, f64)| {
        let problem = Problem {
            model: &model,
            physics: &physics,
            seen,
            radius_mm: options.ball_radius_mm,
            radius_sd: sd,
            start_gain: gain,
            start_stray: stray,
        };
        solve(&problem, values).map(|solved| (rms_of(&problem, &solved.residuals), solved))
    };
    let (_, at_rest) = start(values, &seen, (KNOWN_RADIUS, nominal.stray))?;
    verdict::lights(&model, &at_rest.values.numbers)?;
    let first = model.light(&at_rest.values.numbers);
    let mut known = Bench::new(&with_light(constants, first.clone()), options)?;
    let cells = known.rest(rest, &tracked)?;
    verdict::touched_at_rest(&cells, physics.dome().0, first.stray)?;
    for (press, frame) in presses.iter().enumerate() {
        let (found, caps) = known.press((press + 1, press), frame, options.ball_radius_mm)?;
        seen.presses.push(found);
        seen.caps.extend(caps);
    }
    let rim_deg = known.optics().dome().meridian_end_rad().to_degrees();
    checks::spread(&seen.presses, physics.dome().0, rim_deg)?;
    values = Values {
        numbers: at_rest.values.numbers,
        centers: vec![DVec3::ZERO; seen.presses.len()],
        radius: 0.0,
    };
    let (_, once) = start(values, &seen, (KNOWN_RADIUS, first.stray))?;
    seen.parts = parts_left(&seen, &once);
    let (rms, solved) = start(once.values.clone(), &seen, (KNOWN_RADIUS, first.stray))?;
    let free = start(solved.values.clone(), &seen, (FREE_RADIUS, first.stray))?.1;
    let last = free.values.centers.len() * 3 + model.count();
    let radius = [free.values.radius, FREE_RADIUS * free.covariance[(last, last)].max(0.0).sqrt()];
    verdict::radius(options.ball_radius_mm, radius)?;
    verdict::lights(&model, &solved.values.numbers)?;
    let fit = Fitted {
        constants,
        model: &model,
        physics: &physics,
        seen: &seen,
        options,
        gain,
        stray: first.stray,
    };
    Ok(fit.result(&solved, [once.rms[0][1], rms[1]], radius, at_rest.steps + once.steps + solved.steps))
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

/// By how much levels are off beside noise, a part, as the residuals say.
fn parts_left(seen: &Observed, solved: &Solved) -> [f64; 2] {
    let first = seen.still.len();
    let level = |i: usize| match i.checked_sub(first) {
        None => seen.still[i].level,
        Some(cap) => seen.caps[cap].level,
    };
    [(0, first), (first, first + seen.caps.len())].map(|(from, to)| {
        let mut parts: Vec<f64> = Vec::new();
        for i in from..to {
            let whole = level(i) + DVec3::splat(level(i).max_element());
            for c in 0..3 {
                if solved.residuals.sd[i][c] < 1e3 {
                    let square = solved.residuals.off[i][c].powi(2) - seen.noise * seen.noise;
                    parts.push(square / (whole[c] * whole[c]).max(1e-12));
                }
            }
        }
        let mean = parts.iter().sum::<f64>() / parts.len().max(1) as f64;
        mean.max(MIN_PART * MIN_PART).sqrt()
    })
}

/// What the result is made of.
struct Fitted<'a> {
    constants: &'a Constants,
    model: &'a LightModel,
    physics: &'a Physics,
    seen: &'a Observed,
    options: &'a LightFitOptions,
    gain: DVec3,
    stray: f64,
}

impl Fitted<'_> {
    fn result(&self, solved: &Solved, rms: [f64; 2], radius: [f64; 2], iterations: u32) -> LightFit {
        let parameters = verdict::parameters(self.model, solved);
        let pairs = verdict::pairs(self.model, solved);
        let presses = self.presses(solved);
        let mut constants = with_light(self.constants, measured_light(self.model, solved));
        let rms_levels = rms.map(|rms| 255.0 * rms);
        let given_mm = self.options.ball_radius_mm;
        let radius_mm = [given_mm * radius[0].exp(), given_mm * radius[0].exp() * radius[1]];
        constants.calibrations.push(json!({
            "kind": "light",
            "frames": presses.len() + 1,
            "ball_radius_mm": given_mm,
            "rms_levels": rms_levels,
            "radius_by_presses_mm": radius_mm,
            "level_per_mw_mm2": self.gain.to_array(),
            "parameters": parameters,
            "not_told_apart": pairs,
        }));
        LightFit { constants, parameters, pairs, presses, rms_levels, radius_mm, iterations }
    }

    fn presses(&self, solved: &Solved) -> Vec<BallPress> {
        let problem = Problem {
            model: self.model,
            physics: self.physics,
            seen: self.seen,
            radius_mm: self.options.ball_radius_mm,
            radius_sd: KNOWN_RADIUS,
            start_gain: self.gain,
            start_stray: self.stray,
        };
        let centers_mm = problem.centers_mm(&solved.values);
        let first = self.seen.still.len();
        let one = |(i, press): (usize, &super::observed::SeenPress)| {
            let own = self.seen.caps.iter().enumerate().filter(|(_, cap)| cap.press == i);
            let squares: Vec<f64> =
                own.map(|(k, _)| solved.residuals.off[first + k].length_squared() / 3.0).collect();
            let sds = problem.center_sds(i);
            let at = self.model.count() + 3 * i;
            let sd = |k: usize| sds[k] * solved.covariance[(at + k, at + k)].max(0.0).sqrt();
            BallPress {
                frame: press.frame,
                center_mm: centers_mm[i].to_array(),
                center_sd_mm: [sd(0), sd(1), sd(2)],
                place_deg: place_deg(centers_mm[i] - self.physics.dome().0),
                cells: squares.len(),
                rms_levels: 255.0 * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
                gain: press.gain,
            }
        };
        self.seen.presses.iter().enumerate().map(one).collect()
    }
}
