//! Whether a table can be this sensor's, and what it looks like if not.
//!
//! The springs' geometry predicts each reading; a good table follows the predictions with a slope near one, since a wire
//! or a coil that is off changes it by tens of per cent. Where it does not, each mistake of a list is taken back: the one
//! after which all axes follow is named. Two at a time are tried last.

use super::reference::SpringReference;
use super::rows::implausible_rows;
use super::statistics::{Following, spread};
use super::transformations::{Mistake, lever, mistakes, orders};
use super::types::{ForceError, Pair};
use crate::constants::{SpringConstants, WRENCH_AXES};

/// A slope off the geometry's by more than this factor is not this sensor's.
pub(super) const MAX_FACTOR: f64 = 2.5;
/// After a mistake is taken back, slopes must be within this factor for it to be the cause.
const MAX_NAMED_FACTOR: f64 = 1.8;
/// An axis that uses this part of its capacity moves.
const MIN_LOADED: f64 = 0.1;
/// A shift of the moments' point is named from here on, mm.
const MIN_LEVER_MM: f64 = 3.0;
/// Scatter of the springs' stiffness about their geometry, as a logarithm: what wire, coil and material do.
const GEOMETRY_SD: f64 = 0.4;
/// What an axis that does not follow counts.
const MISS: f64 = 25.0;
/// A table that follows the geometry had a mistake where the scatter without it is less than this part.
const CLEARLY: f64 = 0.4;
/// Rows that a hypothesis is judged by.
const MAX_ROWS: usize = 400;
/// Below this part of the travel a table hardly says anything: of two explanations the one with more is likelier.
const USUAL_USE: f64 = 0.3;

/// How one reading of the table stands to the geometry.
#[derive(Debug, Clone)]
pub(super) struct AxisJudgement {
    pub axis: usize,
    pub following: Option<Following>,
    /// Range of the predictions.
    pub expected_range: f64,
}

impl AxisJudgement {
    fn is_within(&self, factor: f64) -> bool {
        self.following.is_some_and(|f| f.is_clear() && f.slope > 0.0 && f.slope.ln().abs() <= factor.ln())
    }

    fn is_good(&self) -> bool {
        self.is_within(MAX_FACTOR)
    }
}

/// How a table stands to the geometry.
#[derive(Debug, Clone)]
pub(super) struct Judgement {
    /// Axes of the wrench whose predictions range far enough to say anything.
    pub axes: Vec<AxisJudgement>,
    /// Whether its values are such as the sensor can show.
    is_in_reach: bool,
    /// The smaller the better.
    score: f64,
}

impl Judgement {
    pub fn of(pairs: &[Pair], reference: &SpringReference, sizes: &[f64; 6]) -> Self {
        let predictions: Vec<[f64; 6]> =
            pairs.iter().map(|pair| reference.wrench(&pair.displacement)).collect();
        let judge = |axis: usize| {
            let readings: Vec<Option<f64>> = pairs.iter().map(|pair| pair.wrench[axis]).collect();
            let both = readings.iter().zip(&predictions).filter(|(reading, _)| reading.is_some());
            let predicted: Vec<f64> = both.map(|(_, p)| p[axis]).collect();
            let expected_range = spread(&predicted);
            if predicted.len() < 8 {
                return None;
            }
            let min_range = reference.min_range(axis, sizes);
            if expected_range < min_range {
                // Loads without a motion that goes with them.
                let read: Vec<f64> = readings.iter().flatten().copied().collect();
                let is_loaded = spread(&read) > (MIN_LOADED * reference.capacity[axis]).max(5.0 * min_range);
                return is_loaded.then_some(AxisJudgement { axis, following: None, expected_range });
            }
            let all: Vec<f64> = predictions.iter().map(|p| p[axis]).collect();
            Some(AxisJudgement { axis, following: Following::of(&readings, &all), expected_range })
        };
        let axes: Vec<AxisJudgement> = (0..6).filter_map(judge).collect();
        let is_in_reach = reference.holds_nearly_all(pairs);
        let part = |axis: &AxisJudgement| match axis.following {
            Some(f) if f.is_clear() && f.slope > 0.0 => {
                ((f.slope.ln() / GEOMETRY_SD).powi(2) + (f.scatter / f.slope).powi(2)).min(MISS)
            }
            _ => MISS,
        };
        let sum: f64 = axes.iter().map(part).sum();
        let used = reference.largest_use(pairs).max(1e-9);
        let idle = (USUAL_USE / used).ln().max(0.0);
        let score = sum / axes.len().max(1) as f64 + idle * idle + if is_in_reach { 0.0 } else { MISS };
        Self { axes, is_in_reach, score }
    }

    /// How the readings of these axes scatter about what they follow, in all; 1 for each that follows nothing.
    fn scatter(&self, axes: &[usize]) -> f64 {
        let part = |axis: &AxisJudgement| {
            axis.following.filter(Following::is_clear).map_or(1.0, |f| (f.scatter / f.slope.abs()).min(1.0))
        };
        self.axes.iter().filter(|axis| axes.contains(&axis.axis)).map(part).sum()
    }

    fn is_explained(&self) -> bool {
        self.is_in_reach && !self.axes.is_empty() && self.axes.iter().all(|a| a.is_within(MAX_NAMED_FACTOR))
    }
}

/// Rows that stand for all, in their order.
fn some_of(pairs: &[Pair]) -> Vec<Pair> {
    pairs.iter().step_by(pairs.len().div_ceil(MAX_ROWS).max(1)).copied().collect()
}

/// The mistake after which a table is best, of those after which it is good.
fn best_of<'a>(
    pairs: &[Pair],
    reference: &SpringReference,
    sizes: &[f64; 6],
    min_axes: usize,
    all: impl Iterator<Item = (&'a Mistake, Option<&'a Mistake>)>,
) -> Option<(f64, String)> {
    let judged = all.filter_map(|(first, second)| {
        let mut table = first.taken_back(pairs);
        if let Some(second) = second {
            table = second.taken_back(&table);
        }
        let judgement = Judgement::of(&table, reference, sizes);
        // What shrinks a table until nothing can be judged explains nothing.
        (judgement.is_explained() && judgement.axes.len() >= min_axes).then_some((
            judgement.score,
            first,
            second,
        ))
    });
    let (score, first, second) = judged.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let name = match second {
        Some(second) => format!("{}, and also {}", first.name, second.name),
        None => first.name.clone(),
    };
    Some((score, name))
}

/// How far the point of the moments is off in z, mm: least squares of Mx and My by their predictions and by Fy and Fx.
fn lever_mm(pairs: &[Pair], reference: &SpringReference) -> Option<f64> {
    let (mut pp, mut pf, mut ff, mut py, mut fy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for pair in pairs {
        let predicted = reference.wrench(&pair.displacement);
        for (moment, force, sign) in [(3, 1, -1.0), (4, 0, 1.0)] {
            let (y, f) = (pair.wrench[moment]?, sign * pair.wrench[force]?);
            let p = predicted[moment];
            (pp, pf, ff, py, fy) = (pp + p * p, pf + p * f, ff + f * f, py + p * y, fy + f * y);
        }
    }
    let height_mm = (pp * fy - pf * py) / (pp * ff - pf * pf);
    (height_mm.is_finite() && height_mm.abs() > MIN_LEVER_MM).then_some(height_mm)
}

/// What a table that is not good looks like.
fn named(pairs: &[Pair], reference: &SpringReference, sizes: &[f64; 6], now: &Judgement) -> Option<String> {
    let mut mistakes = mistakes();
    mistakes.extend(lever_mm(pairs, reference).map(lever));
    let few = some_of(pairs);
    let min_axes = now.axes.len().saturating_sub(1).max(1);
    let single = best_of(&few, reference, sizes, min_axes, mistakes.iter().map(|m| (m, None)));
    let mixed = mixed_units(pairs, reference, sizes, now, false);
    if let (Some((score, _)), Some((other, name))) = (&single, &mixed)
        && *other < 0.8 * score
    {
        return Some(name.clone());
    }
    let order = || {
        let orders = orders();
        best_of(pairs, reference, sizes, min_axes, orders.iter().map(|m| (m, None)))
    };
    let double = || {
        let both = mistakes.iter().enumerate().flat_map(|(index, first)| {
            let others = mistakes.iter().skip(index + 1).filter(move |other| first.goes_with(other));
            others.filter(move |_| first.is_unit).map(move |other| (first, Some(other)))
        });
        best_of(&few, reference, sizes, min_axes, both)
    };
    single.or(mixed).or_else(order).or_else(double).map(|(_, name)| name)
}

/// What the axes at fault show, where no mistake of the list explains them.
fn axes_at_fault(pairs: &[Pair], now: &Judgement) -> String {
    let bad: Vec<&AxisJudgement> = now.axes.iter().filter(|axis| !axis.is_good()).collect();
    let is_lost = |axis: &&&AxisJudgement| !axis.following.is_some_and(|f| f.is_clear());
    let lost = bad.iter().filter(is_lost).count();
    let names = |axes: &[&AxisJudgement]| {
        axes.iter().map(|axis| WRENCH_AXES[axis.axis]).collect::<Vec<_>>().join(", ")
    };
    let constant = bad.iter().find(|axis| {
        let values: Vec<f64> = pairs.iter().filter_map(|pair| pair.wrench[axis.axis]).collect();
        spread(&values) < 1e-3 * axis.expected_range
    });
    if let Some(axis) = constant {
        return format!(
            "{} does not vary, though the displacements call for a range of {:.3}: leave the cells of an axis \
             without a sensor empty",
            WRENCH_AXES[axis.axis], axis.expected_range
        );
    }
    if lost > 0 && lost == now.axes.len() {
        return "looks like unpaired rows: no reading goes with the displacement of its row, nor with that of \
                another one nearby"
            .into();
    }
    if lost > 0 {
        let lost: Vec<&AxisJudgement> = bad.iter().filter(is_lost).copied().collect();
        return format!("{} do not go with the displacements, though other axes do", names(&lost));
    }
    let worst = bad.iter().max_by(|a, b| {
        let size = |axis: &AxisJudgement| axis.following.map_or(0.0, |f| f.slope.abs().max(1e-12).ln().abs());
        size(a).total_cmp(&size(b))
    });
    let far = worst.map_or((0, 0.0), |axis| (axis.axis, axis.following.map_or(0.0, |f| f.slope)));
    format!(
        "{} is {:.3} times what the springs' geometry says; allowed is a factor of {MAX_FACTOR} either way: another \
         sensor's constants, or other springs than the design's",
        WRENCH_AXES[far.0], far.1
    )
}

/// Asks whether a table can be this sensor's before it is fitted; `lines`: the line of each row in its file; `sizes` as
/// for [`super::fit`].
///
/// # Errors
/// [`ForceError::Suspect`] with what the table looks like: a mistake by its name where one explains it.
pub fn examine_pairs(
    pairs: &[Pair],
    springs: &SpringConstants,
    sizes: &[f64; 6],
    lines: &[usize],
) -> Result<(), ForceError> {
    let suspect = |what: String| Err(ForceError::Suspect(what));
    let reference = SpringReference::new(springs);
    if let Some(what) = implausible_rows(pairs, lines) {
        return suspect(what);
    }
    let now = Judgement::of(pairs, &reference, sizes);
    let is_good = now.is_in_reach && now.axes.iter().all(AxisJudgement::is_good);
    if !is_good && let Some(name) = named(pairs, &reference, sizes, &now) {
        return suspect(format!("looks like {name}"));
    }
    if let Some(what) = reference.beyond(pairs, lines) {
        return suspect(what);
    }
    if !is_good {
        return suspect(axes_at_fault(pairs, &now));
    }
    let other_order = || clearly_shifted(pairs, &reference, sizes, &now);
    mixed_units(pairs, &reference, sizes, &now, true)
        .or_else(other_order)
        .map_or(Ok(()), |(_, name)| suspect(format!("looks like {name}")))
}

/// Rows that go together some rows off much more closely than as they stand: motions that are slow follow the geometry even so.
fn clearly_shifted(
    pairs: &[Pair],
    reference: &SpringReference,
    sizes: &[f64; 6],
    now: &Judgement,
) -> Option<(f64, String)> {
    let all = [0, 1, 2, 3, 4, 5];
    let max_scatter = CLEARLY * now.scatter(&all);
    let judged = orders().into_iter().filter_map(|mistake| {
        let judgement = Judgement::of(&mistake.taken_back(pairs), reference, sizes);
        let scatter = judgement.scatter(&all);
        let is_whole = judgement.axes.len() == now.axes.len();
        (is_whole && judgement.is_explained() && scatter < max_scatter).then_some((scatter, mistake.name))
    });
    judged.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A unit that only some of the rows have, in words: taking it back row by row leaves much less.
fn mixed_units(
    pairs: &[Pair],
    reference: &SpringReference,
    sizes: &[f64; 6],
    now: &Judgement,
    is_good: bool,
) -> Option<(f64, String)> {
    let scale = |axis: usize| now.axes.iter().find(|a| a.axis == axis).map(|a| a.expected_range);
    let mut best: Option<(f64, String)> = None;
    for mistake in mistakes().iter().filter(|mistake| mistake.is_unit) {
        let axes = mistake.axes();
        // How far a row is from its predictions, in parts of the ranges; wild readings count once.
        let miss = |pair: &Pair| {
            let predicted = reference.wrench(&pair.displacement);
            let part =
                |axis: usize| Some(((pair.wrench[axis]? - predicted[axis]).abs() / scale(axis)?).min(1.0));
            axes.iter().filter_map(|axis| part(*axis)).sum::<f64>()
        };
        let before: Vec<f64> = pairs.iter().map(miss).collect();
        let cured = mistake.taken_back(pairs);
        let better = |row: usize| miss(&cured[row]) < 0.5 * before[row] && before[row] > 0.1;
        let which: Vec<usize> = (0..pairs.len()).filter(|row| better(*row)).collect();
        if 10 * which.len() < pairs.len() || 10 * which.len() > 9 * pairs.len() {
            continue;
        }
        let mut mixed = pairs.to_vec();
        which.iter().for_each(|row| mixed[*row] = cured[*row]);
        let judgement = Judgement::of(&mixed, reference, sizes);
        let is_clear = !is_good || judgement.scatter(&axes) < CLEARLY * now.scatter(&axes);
        let is_best = best.as_ref().is_none_or(|(lowest, _)| judgement.score < *lowest);
        if is_clear && judgement.is_explained() && is_best {
            let name = format!("{} of {} rows in another unit: {}", which.len(), pairs.len(), mistake.name);
            best = Some((judgement.score, name));
        }
    }
    best
}
