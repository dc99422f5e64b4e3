//! How many sensors a Monte Carlo has to draw.

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_design::layout::tolerances::drawn_shifts_px;
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_design::sections::TolerancesSection;
use domecast_fab::numbers::significant;

/// Sensors of the sweep, and of its reference: a hundred times the longest sample.
const COUNTS: [u32; 5] = [4, 8, 16, 32, 64];
const REFERENCE: u32 = 6400;
const QUICK_REFERENCE: u32 = 1600;

/// The sweep of sample counts; `None` where too few sensors see all dots.
pub fn sweep(
    spec: &LayoutSpec,
    layout: &Layout,
    tolerances: &TolerancesSection,
    in_use: u32,
    asked_px: Option<f64>,
    time_limit: TimeLimit,
    quick: bool,
) -> Option<Sweep> {
    let total = if quick { QUICK_REFERENCE } else { REFERENCE };
    let shifts: Vec<f64> = drawn_shifts_px(spec, layout, tolerances, total).into_iter().flatten().collect();
    if shifts.len() < total as usize / 2 {
        return None;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let truth = mean(&shifts);
    let sd = (shifts.iter().map(|s| (s - truth).powi(2)).sum::<f64>() / (shifts.len() - 1) as f64).sqrt();
    let mut counts: Vec<u32> = COUNTS.into_iter().filter(|n| 100 * n <= total).collect();
    let beyond = !counts.contains(&in_use);
    if beyond {
        counts.push(in_use);
        counts.sort_unstable();
    }
    let mut samples = Vec::new();
    for &count in &counts {
        let batches: Vec<f64> =
            shifts.chunks_exact(count as usize).map(|batch| (mean(batch) - truth).abs()).collect();
        // too few batches give no estimate: then by the law that the others follow
        let by_law = sd / f64::from(count).sqrt();
        let seen = batches.len() >= 20;
        let rms = (batches.iter().map(|e| e * e).sum::<f64>() / batches.len().max(1) as f64).sqrt();
        let max = batches.iter().copied().fold(0.0, f64::max);
        let timing = time(time_limit, || drawn_shifts_px(spec, layout, tolerances, count).len());
        samples.push(SweepSample {
            method: "",
            label: format!("{count} sensors"),
            setting: f64::from(count),
            max_error: if seen { max } else { 3.0 * by_law },
            rms_error: if seen { rms } else { by_law },
            time: timing,
            per_item_s: timing.median_s,
            notes: vec![(
                if seen { "batches".into() } else { "batches (too few: by sd/sqrt(n))".into() },
                batches.len() as f64,
            )],
            dominated: false,
        });
    }
    let in_use = counts.iter().position(|count| *count == in_use);
    Some(
        Sweep {
            name: "chance",
            title: "Sensors drawn within the tolerances".into(),
            setting: "sensors drawn",
            error: "error of the dots' mean shift, over batches of that many",
            unit: "px",
            item: "estimate",
            items: 1,
            reference: format!("the mean of {} sensors, {} px", shifts.len(), significant(truth)),
            floor: 0.0,
            law: Law::Power { exponent: -0.5 },
            observed: None,
            samples,
            in_use,
            asked: asked_px,
            meets: None,
            conclusion: format!(
                "One sensor's mean shift varies by {} px; four times the sensors halve the doubt.",
                significant(sd)
            ),
        }
        .finish(),
    )
}
