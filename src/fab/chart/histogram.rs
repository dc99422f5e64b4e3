//! How often values occur.

use glam::DVec2;

use super::drawing::{Chart, ChartColor, INK, TextAlign};
use crate::numbers::typeset;

/// Classes of a histogram.
const CLASSES: usize = 24;
const SIZE: DVec2 = DVec2::new(320.0, 150.0);
/// Where the bars stand, px from the top.
const BASE: f64 = 118.0;
/// The highest bar ends so far below the top, px.
const HEADROOM: f64 = 14.0;
const FONT: f64 = 11.0;
const BAR: ChartColor = ChartColor { rgb: [76, 143, 199], class: "fill" };

/// A histogram of the finite values; `None` where there are none.
pub fn histogram(values: &[f64], title: &str, unit: &str) -> Option<Chart> {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let (low, high) = (finite.iter().copied().reduce(f64::min)?, finite.iter().copied().reduce(f64::max)?);
    let mean = finite.iter().sum::<f64>() / finite.len() as f64;
    // at least a twentieth of the mean across, so that equal values do not look scattered
    let span = (1.1 * (high - low)).max(0.1 * mean.abs()).max(f64::MIN_POSITIVE);
    let start = 0.5 * (low + high) - 0.5 * span;
    let mut counts = [0usize; CLASSES];
    for value in &finite {
        let class = ((value - start) / span * CLASSES as f64) as usize;
        counts[class.min(CLASSES - 1)] += 1;
    }
    let max = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    let step = SIZE.x / CLASSES as f64;
    let summary =
        format!("{title}: {} values from {} to {} {unit}", finite.len(), typeset(low), typeset(high));
    let mut chart = Chart::new(&summary, SIZE);
    for (class, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let height = (count as f64 / max * (BASE - HEADROOM)).max(1.0);
        let [from, to] = [class, class + 1].map(|edge| start + span * edge as f64 / CLASSES as f64);
        let corners = [
            DVec2::new(class as f64 * step + 0.5, BASE - height),
            DVec2::new((class + 1) as f64 * step - 0.5, BASE),
        ];
        chart.bar(corners, BAR, format!("{count} from {} to {}", typeset(from), typeset(to)));
    }
    chart.line(&[DVec2::new(0.0, BASE), DVec2::new(SIZE.x, BASE)], INK, 1.0);
    for (at, align) in [(0.0, TextAlign::Start), (0.5, TextAlign::Middle), (1.0, TextAlign::End)] {
        chart.text(DVec2::new(at * SIZE.x, BASE + 15.0), align, FONT, INK, typeset(start + at * span));
    }
    let caption = format!("{title} ({unit})");
    chart.text(DVec2::new(0.5 * SIZE.x, SIZE.y - 2.0), TextAlign::Middle, FONT, INK, caption);
    Some(chart)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_falls_into_a_class() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let chart = histogram(&values, "t", "mm").unwrap().to_html();
        let counted: usize = chart
            .as_str()
            .split("<title>")
            .skip(1)
            .map(|piece| piece.split(' ').next().unwrap().parse::<usize>().unwrap())
            .sum();
        assert_eq!(counted, values.len());
        assert!(histogram(&[], "t", "mm").is_none());
        assert!(histogram(&[f64::NAN], "t", "mm").is_none());
    }

    #[test]
    fn equal_values_make_one_bar() {
        let chart = histogram(&[18.0; 50], "t", "px").unwrap().to_html();
        assert_eq!(chart.as_str().matches("<rect").count(), 1);
    }
}
