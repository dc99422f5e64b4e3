//! The first picture of the page: what a tenth of the error costs, setting by setting.

use super::sweep::{Sweep, SweepSample};
use domecast_fab::html::{Html, bars, html};
use domecast_fab::numbers::{duration, significant};

/// What a tenth of the error of what is in use costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tenth<'a> {
    /// What is in use is exact to the rounding of what it is compared with.
    Exact,
    /// The fastest sample that has at most a tenth of the error.
    Costs {
        /// What is in use.
        used: &'a SweepSample,
        /// The better one.
        better: &'a SweepSample,
    },
    /// No sample has it.
    None(&'a SweepSample),
}

impl<'a> Tenth<'a> {
    /// Of a sweep; `None` where nothing is in use.
    pub fn of(sweep: &'a Sweep) -> Option<Self> {
        let used = sweep.in_use.and_then(|index| sweep.samples.get(index))?;
        if used.max_error <= sweep.noise_floor() {
            return Some(Self::Exact);
        }
        let enough = sweep.samples.iter().filter(|sample| sample.max_error <= 0.1 * used.max_error);
        let fastest = enough.min_by(|a, b| a.per_item_s.total_cmp(&b.per_item_s));
        Some(fastest.map_or(Self::None(used), |better| Self::Costs { used, better }))
    }
}

/// The bars, as long as the logarithm of the factor in time.
pub fn chapter(sweeps: &[Sweep]) -> Html {
    let row = |sweep: &Sweep| {
        let error = |sample: &SweepSample| format!("{} {}", significant(sample.max_error), sweep.unit);
        let (length, label) = match Tenth::of(sweep)? {
            Tenth::Exact => (0.0, "nothing to gain: exact to rounding".to_owned()),
            Tenth::None(used) => (0.0, format!("no setting here has it; in use: {}", error(used))),
            Tenth::Costs { used, better } => {
                let factor = better.per_item_s / used.per_item_s;
                let label = format!(
                    "{} times the time: {} to {} per {}, {} to {}",
                    significant(factor),
                    duration(used.per_item_s),
                    duration(better.per_item_s),
                    sweep.item,
                    error(used),
                    error(better)
                );
                (factor.log10().max(0.0), label)
            }
        };
        Some((sweep.title.clone(), length, label))
    };
    let rows: Vec<(String, f64, String)> = sweeps.iter().filter_map(row).collect();
    html!("<h2>What a tenth of the error costs</h2>\n{}", bars(&rows))
}

#[cfg(test)]
mod tests {
    use super::super::clock::RunTime;
    use super::super::sweep::Law;
    use super::*;

    fn sample(max_error: f64, per_item_s: f64) -> SweepSample {
        let time = RunTime {
            median_s: per_item_s,
            lower_quartile_s: per_item_s,
            upper_quartile_s: per_item_s,
            runs: 1,
        };
        SweepSample::of(("", String::new()), 1.0, [max_error].into_iter(), (time, 1), "")
    }

    #[test]
    fn the_fastest_of_those_that_are_ten_times_as_exact_is_named() {
        let samples = [sample(1.0, 1.0), sample(0.1, 30.0), sample(0.05, 20.0), sample(1e-9, 1.0)];
        let sweep = |in_use: usize, floor: f64| Sweep {
            name: "t",
            title: "t".into(),
            setting: "",
            error: "",
            unit: "mm",
            item: "item",
            items: 1,
            reference: String::new(),
            floor,
            law: Law::Falls,
            observed: None,
            samples: samples[..3].iter().cloned().chain((in_use == 3).then(|| samples[3].clone())).collect(),
            in_use: Some(in_use),
            asked: None,
            meets: None,
            conclusion: String::new(),
        };
        let first = sweep(0, 0.0);
        assert_eq!(
            Tenth::of(&first),
            Some(Tenth::Costs { used: &first.samples[0], better: &first.samples[2] })
        );
        let last = sweep(2, 0.0);
        assert_eq!(Tenth::of(&last), Some(Tenth::None(&last.samples[2])));
        assert_eq!(Tenth::of(&sweep(3, 1e-6)), Some(Tenth::Exact));
    }
}
