//! Whether centroids can be this sensor's, before the fit and after it.

use std::collections::HashSet;

use glam::DVec2;

use super::mistakes::{CentroidMistake, centroid_mistakes, order_in_words, orders};
use super::problem::{Problem, Seen};
use super::types::{Kind, OpticsFitError, Parameter};
use crate::constants::{CalibrationPriors, Constants};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::Sighting;

/// A mark at rest is so many times farther from its nominal place than tolerances take it: it is another one.
const FAR: f64 = 3.0;
/// Part of the marks that a mistake that was taken back may leave far.
const MAX_LEFT: f64 = 0.02;
/// A mark may be found so far outside of the image, px: half of one may be seen.
const OUTSIDE_PX: f64 = 2.0;
/// Marks may scatter about the fit by this many times the noise of their centroids.
const MAX_NOISE: f64 = 2.5;
/// Part of the marks beyond three deviations.
const MAX_OUTLIERS: f64 = 0.1;
/// A single mark so many deviations from all others is another one.
const MAX_MISS: f64 = 60.0;
/// Fitted numbers may be off by so many prior deviations; of the dots' many numbers some are farther by chance.
const MAX_SDS: f64 = 4.0;
const MAX_DOT_SDS: f64 = 6.0;

fn suspect<T>(what: String) -> Result<T, OpticsFitError> {
    Err(OpticsFitError::Suspect(what))
}

fn word(kind: Kind) -> &'static str {
    if kind == Kind::White { "white marker" } else { "black dot" }
}

fn in_words(seen: &Seen) -> String {
    let mark = seen.observation;
    format!("frame {}: {} {}", mark.frame, word(mark.kind), mark.id)
}

/// Where nominal numbers put the marks at rest.
struct RestPlaces {
    white: Vec<Option<DVec2>>,
    black: Vec<Option<DVec2>>,
}

impl RestPlaces {
    fn new(problem: &Problem, optics: &SensorOptics) -> Self {
        let white = problem.white_markers.iter().map(|m| optics.project(m.position_mm).ok()).collect();
        let black = problem.black_dots.iter().map(|dot| optics.project(dot.at_mm).ok()).collect();
        Self { white, black }
    }

    /// How far a centroid is from its mark's place; far for what has none.
    fn miss_px(&self, kind: Kind, index: usize, at_px: DVec2) -> f64 {
        let places = if kind == Kind::White { &self.white } else { &self.black };
        let place = places.get(index).copied().flatten();
        place.map(|place| place.distance(at_px)).filter(|miss| miss.is_finite()).unwrap_or(f64::INFINITY)
    }
}

/// How far marks are from where they belong: the mean, far ones counted as just so far, and the part of far ones; of
/// the worse kind.
fn distance(misses: &[(Kind, f64)], far_px: f64) -> (f64, f64) {
    let of = |kind: Kind| {
        let own: Vec<f64> = misses.iter().filter(|miss| miss.0 == kind).map(|miss| miss.1).collect();
        let n = own.len().max(1) as f64;
        let mean = own.iter().map(|v| v.min(2.0 * far_px)).sum::<f64>() / n;
        (mean, own.iter().filter(|v| **v > far_px).count() as f64 / n)
    };
    let (white, black) = (of(Kind::White), of(Kind::Black));
    (white.0.max(black.0), white.1.max(black.1))
}

/// Asks whether centroids can be this sensor's at all.
///
/// # Errors
/// [`OpticsFitError::Suspect`] with the mistake that they look like, or the first mark that is at fault.
pub(super) fn examine_observations(
    problem: &Problem,
    constants: &Constants,
    priors: &CalibrationPriors,
) -> Result<(), OpticsFitError> {
    for seen in &problem.seen {
        let mut known = HashSet::new();
        if let Some(twice) = seen.iter().find(|s| !known.insert((s.observation.kind == Kind::White, s.index)))
        {
            return suspect(format!("{} stands there twice", in_words(twice)));
        }
    }
    let optics =
        SensorOptics::new(&problem.nominal).map_err(|error| OpticsFitError::Constants(error.to_string()))?;
    let places = RestPlaces::new(problem, &optics);
    let far_px = FAR * problem.slack_px(priors);
    let at_rest: Vec<&Seen> = problem.seen.iter().take(problem.at_rest).flatten().collect();
    let miss = |s: &&Seen| places.miss_px(s.observation.kind, s.index, s.observation.centroid_px);
    let misses: Vec<(Kind, f64)> = at_rest.iter().map(|s| (s.observation.kind, miss(s))).collect();
    let (mean_px, far_part) = distance(&misses, far_px);
    if far_part > 0.0 {
        let rated = rate_mistakes(problem, constants, &optics, &places, far_px).into_iter();
        // A dot whose number is one off at the end of the list has no place.
        let better = rated.filter(|(_, left_px, left)| {
            *left <= MAX_LEFT.max(0.5 * far_part).min(0.25) && *left_px < 0.6 * mean_px
        });
        if let Some((mistake, ..)) = better.min_by(|a, b| a.1.total_cmp(&b.1)) {
            return suspect(format!("looks like {}", mistake.name));
        }
    }
    outside(problem)?;
    if far_part > 0.5 {
        return suspect(format!(
            "the marks at rest lie {mean_px:.0} px and more from where these constants put them, tolerances take them \
             {:.0} px: another sensor's constants, or frames that are not raw",
            far_px / FAR
        ));
    }
    if let Some((mark, miss)) = at_rest.iter().map(|s| (s, miss(s))).find(|(_, miss)| *miss > far_px) {
        return suspect(format!(
            "{} lies {miss:.0} px from its place at rest, tolerances take it {:.0} px: another mark's number, a wrong \
             blob, or a frame that is not at rest",
            in_words(mark),
            far_px / FAR
        ));
    }
    swapped_later(problem, &optics, priors)
}

/// Each known mistake, with the mean distance of the marks at rest and the part of far ones that are left without it.
fn rate_mistakes<'a>(
    problem: &Problem,
    constants: &'a Constants,
    optics: &'a SensorOptics,
    places: &RestPlaces,
    far_px: f64,
) -> Vec<(CentroidMistake<'a>, f64, f64)> {
    let rate = |mistake: CentroidMistake<'a>| {
        let cured = |s: &Seen| {
            let mark = s.observation;
            let there = mistake.taken_back(mark.kind, s.index, mark.centroid_px);
            let miss = |(index, at_px)| places.miss_px(mark.kind, index, at_px);
            (mark.kind, there.map_or(f64::INFINITY, miss))
        };
        let misses: Vec<_> = problem.seen.iter().take(problem.at_rest).flatten().map(cured).collect();
        let (left_px, left) = distance(&misses, far_px);
        (mistake, left_px, left)
    };
    centroid_mistakes(constants, optics).into_iter().map(rate).collect()
}

/// The mistakes that leave the marks at rest as near to their places as tolerances take them: only a fit tells whether
/// one was made.
pub(super) fn near_mistakes<'a>(
    problem: &Problem,
    constants: &'a Constants,
    optics: &'a SensorOptics,
    priors: &CalibrationPriors,
) -> Vec<CentroidMistake<'a>> {
    let places = RestPlaces::new(problem, optics);
    let rated = rate_mistakes(problem, constants, optics, &places, FAR * problem.slack_px(priors));
    rated.into_iter().filter(|(_, _, left)| *left <= MAX_LEFT).map(|(mistake, ..)| mistake).collect()
}

/// Marks outside of the image.
fn outside(problem: &Problem) -> Result<(), OpticsFitError> {
    let (width, height) = (f64::from(problem.nominal.lens.width), f64::from(problem.nominal.lens.height));
    let is_outside = |s: &&Seen| {
        let p = s.observation.centroid_px;
        let inside = |v: f64, end: f64| v >= -0.5 - OUTSIDE_PX && v <= end - 0.5 + OUTSIDE_PX;
        !(inside(p.x, width) && inside(p.y, height))
    };
    match problem.seen.iter().flatten().find(is_outside) {
        Some(s) => suspect(format!(
            "{} at ({:.4e}, {:.4e}) is beyond the sensor, whose frames are {width} x {height} px",
            in_words(s),
            s.observation.centroid_px.x,
            s.observation.centroid_px.y
        )),
        None => Ok(()),
    }
}

/// White markers that change their numbers in a frame under load.
fn swapped_later(
    problem: &Problem,
    optics: &SensorOptics,
    priors: &CalibrationPriors,
) -> Result<(), OpticsFitError> {
    let solver = problem.pose_solver(optics, priors)?;
    let ids: Vec<usize> = problem.white_markers.iter().map(|m| m.id as usize).collect();
    if ids.len() > 5 {
        return Ok(());
    }
    for (frame, seen) in problem.frames.iter().zip(&problem.seen).skip(problem.at_rest) {
        let white_seen: Vec<&Seen> = seen.iter().filter(|s| s.observation.kind == Kind::White).collect();
        let rms_px = |order: &[usize]| {
            let sighting = |s: &&Seen| Sighting {
                id: problem.white_markers[order[s.index]].id,
                centroid_px: s.observation.centroid_px,
            };
            let sightings: Vec<Sighting> = white_seen.iter().map(sighting).collect();
            solver.solve(&sightings).map_or(f64::INFINITY, |found| found.rms_px)
        };
        let all = orders(ids.len());
        let own = all.first().map_or(0.0, |order| rms_px(order));
        if own < FAR * problem.slack_px(priors) || white_seen.len() < ids.len() {
            continue;
        }
        let rated = all.iter().skip(1).map(|order| (rms_px(order), order));
        if let Some((rms, order)) = rated.min_by(|a, b| a.0.total_cmp(&b.0))
            && rms < problem.slack_px(priors)
            && let Some(words) = order_in_words(order, &ids)
        {
            return suspect(format!("looks like {words} in frame {frame}"));
        }
    }
    Ok(())
}

/// Asks whether what the fit leaves is the noise of centroids.
///
/// # Errors
/// [`OpticsFitError::Suspect`] with the kind, or the mark, that does not fit.
pub(super) fn examine_residuals(
    problem: &Problem,
    priors: &CalibrationPriors,
    x: &[f64],
    poses: &[Rigid],
) -> Result<(), OpticsFitError> {
    let rest =
        SensorOptics::new(&problem.spec(x)).map_err(|error| OpticsFitError::Constants(error.to_string()))?;
    let mut left: Vec<(f64, &Seen)> = Vec::new();
    for (seen, pose) in problem.seen.iter().zip(poses) {
        let optics = rest.at_pose(pose).map_err(|error| OpticsFitError::Constants(error.to_string()))?;
        for mark in seen {
            let at = optics.project(problem.place(x, mark)).ok();
            let there = at.and_then(|center| Some(center + problem.offset(x, mark, &optics, center)?));
            let miss = there.map_or(f64::INFINITY, |at| at.distance(mark.observation.centroid_px));
            left.push((miss / problem.noise(priors, mark.observation.kind).max(1e-9), mark));
        }
    }
    for kind in [Kind::White, Kind::Black] {
        let mut own: Vec<f64> = left.iter().filter(|l| l.1.observation.kind == kind).map(|l| l.0).collect();
        own.sort_by(f64::total_cmp);
        // The median length of two normal numbers is 1.177 deviations.
        let sds = own.get(own.len() / 2).map_or(0.0, |median| median / 1.177_4);
        let far = own.iter().filter(|sds| **sds > 4.0).count();
        let noise_px = problem.noise(priors, kind);
        if sds > MAX_NOISE {
            return suspect(format!(
                "the {}s scatter by {:.3} px about the fit, beyond the noise of {noise_px} px: another sensor's \
                 constants, frames that are not at rest, or a camera that is not calibrated",
                word(kind),
                sds * noise_px
            ));
        }
        if own.len() >= 8 && far as f64 > MAX_OUTLIERS * own.len() as f64 {
            return suspect(format!(
                "{far} of {} {}s lie beyond four deviations of the fit: a frame that is not at rest, or wrong blobs",
                own.len(),
                word(kind)
            ));
        }
    }
    let worst = left.iter().max_by(|a, b| a.0.total_cmp(&b.0));
    match worst {
        Some((sds, mark)) if *sds > MAX_MISS => suspect(format!(
            "{} lies {:.1} px from where all others put it: another mark's number, or a wrong blob",
            in_words(mark),
            sds * problem.noise(priors, mark.observation.kind)
        )),
        _ => Ok(()),
    }
}

/// Asks whether the fitted numbers are such as the tolerances allow.
///
/// # Errors
/// [`OpticsFitError::Suspect`] with the number that is farthest off.
pub(super) fn examine_numbers(
    problem: &Problem,
    x: &[f64],
    parameters: &[Parameter],
) -> Result<(), OpticsFitError> {
    let off = |p: &Parameter| (p.value - p.nominal).abs() / p.prior_sd.max(1e-12);
    let worst = parameters.iter().max_by(|a, b| off(a).total_cmp(&off(b)));
    if let Some(p) = worst.filter(|p| off(p) > MAX_SDS) {
        return suspect(format!(
            "{} would be {:.5} where the constants say {:.5}: {:.1} prior deviations of {:.5} off, allowed are \
             {MAX_SDS}; another sensor's constants, a frame that is not at rest, or a tolerance that is too small",
            p.name,
            p.value,
            p.nominal,
            off(p),
            p.prior_sd
        ));
    }
    let dots = problem.black_number(0)..problem.numbers();
    let worst = dots.map(|k| (x[k].abs() / problem.priors[k], k)).max_by(|a, b| a.0.total_cmp(&b.0));
    match worst {
        Some((sds, k)) if sds > MAX_DOT_SDS => suspect(format!(
            "the black dot at place {} of the list would be {:.3} mm from its place, {sds:.1} prior deviations: \
             another dot's number, or a print that is off by more than its tolerance",
            (k - problem.black_number(0)) / 2,
            x[k].abs()
        )),
        _ => Ok(()),
    }
}
