//! Axes: from values to px, and where the ticks are.

/// A mark on an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// The value.
    pub value: f64,
    /// Where it lies, px.
    pub px: f64,
    /// What stands beside it; empty where labels would be too dense.
    pub label: String,
}

/// A linear or logarithmic axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    is_log: bool,
    px: [f64; 2],
}

/// Labels on a logarithmic axis at most.
const MAX_DECADES_LABELLED: usize = 9;
/// Steps of a linear axis at most.
const MAX_STEPS: f64 = 8.0;

impl Axis {
    /// A linear axis from `low` to `high`, which lie at `px`.
    pub fn linear(low: f64, high: f64, px: [f64; 2]) -> Self {
        Self { low, high, is_log: false, px }
    }

    /// A logarithmic axis of whole decades around all values that have a logarithm; `None` where none has.
    pub fn decades(values: &[f64], px: [f64; 2]) -> Option<Self> {
        let logs = || values.iter().filter(|v| v.is_finite() && **v > 0.0).map(|v| v.log10());
        let (low, high) = (logs().reduce(f64::min)?.floor(), logs().reduce(f64::max)?.ceil());
        Some(Self { low, high: high.max(low + 1.0), is_log: true, px })
    }

    /// Where a value lies, px. On a logarithmic axis it must be above zero.
    pub fn px(&self, value: f64) -> f64 {
        let value = if self.is_log { value.log10() } else { value };
        self.px[0] + (value - self.low) / (self.high - self.low) * (self.px[1] - self.px[0])
    }

    /// Each decade of a logarithmic axis; multiples of 1, 2 or 5 times a power of ten inside a linear one.
    pub fn ticks(&self) -> Vec<Tick> {
        let tick = |value: f64, label: String| Tick { value, px: self.px(value), label };
        if self.is_log {
            let (low, high) = (self.low as i32, self.high as i32);
            let every = ((high - low) as usize).div_ceil(MAX_DECADES_LABELLED).max(1);
            let label = |index: usize, decade: i32| {
                if index.is_multiple_of(every) { format!("1e{decade}") } else { String::new() }
            };
            return (low..=high)
                .enumerate()
                .map(|(index, decade)| tick(10_f64.powi(decade), label(index, decade)))
                .collect();
        }
        let span = self.high - self.low;
        if !(span.is_finite() && span > 0.0) {
            return Vec::new();
        }
        let rough = 10_f64.powf((span / 5.0).log10().floor());
        let step = [1.0, 2.0, 5.0].into_iter().map(|m| m * rough).find(|step| span / step <= MAX_STEPS);
        let step = step.unwrap_or(10.0 * rough);
        // the ends carry no tick: an axis reaches beyond its values
        let inside = |value: &f64| *value > self.low && *value < self.high;
        let (first, last) = ((self.low / step).floor() as i64, (self.high / step).ceil() as i64);
        (first..=last)
            .map(|k| k as f64 * step)
            .filter(inside)
            .map(|value| tick(value, format!("{}", (value * 1e6).round() / 1e6)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_inside_and_are_few() {
        for span in [0.003, 0.7, 1.0, 9.9, 123.0, 7e5] {
            let axis = Axis::linear(-0.3 * span, 0.7 * span, [0.0, 100.0]);
            let ticks = axis.ticks();
            assert!((2..=9).contains(&ticks.len()), "{span}: {ticks:?}");
            assert!(ticks.iter().all(|t| (0.0..=100.0).contains(&t.px) && !t.label.is_empty()));
        }
        let axis = Axis::decades(&[3e-9, 2e4], [0.0, 140.0]).unwrap();
        let ticks = axis.ticks();
        assert_eq!(ticks.len(), 15);
        assert_eq!(ticks.iter().filter(|t| !t.label.is_empty()).count(), 8);
        assert!((axis.px(1e-9)).abs() < 1e-9 && (axis.px(1e5) - 140.0).abs() < 1e-9);
        assert!(Axis::decades(&[0.0, -1.0, f64::NAN], [0.0, 1.0]).is_none());
        assert!(Axis::linear(1.0, 1.0, [0.0, 1.0]).ticks().is_empty());
    }
}
