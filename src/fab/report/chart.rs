//! Plain charts as SVG that follow the page's colours.

use std::fmt::Write as _;

use super::html::{escape, number};

/// Classes of a histogram.
const CLASSES: usize = 24;

/// How often values occur; `None` where there are none.
pub fn histogram(values: &[f64], title: &str, unit: &str) -> Option<String> {
    const WIDTH: f64 = 320.0;
    const HEIGHT: f64 = 150.0;
    const BASE: f64 = 118.0;
    let (low, high) = values
        .iter()
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)));
    if low > high {
        return None;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    // at least a twentieth of the mean across, so that equal values do not look scattered
    let span = (1.1 * (high - low)).max(0.1 * mean.abs()).max(f64::MIN_POSITIVE);
    let start = 0.5 * (low + high) - 0.5 * span;
    let mut counts = [0usize; CLASSES];
    for value in values.iter().filter(|value| value.is_finite()) {
        let class = ((value - start) / span * CLASSES as f64) as usize;
        counts[class.min(CLASSES - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
    let step = WIDTH / CLASSES as f64;
    let mut text = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}: {} values from {} \
         to {} {}\">",
        escape(title),
        values.len(),
        number(low),
        number(high),
        escape(unit)
    );
    for (class, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let height = (count as f64 / most * (BASE - 14.0)).max(1.0);
        let _ = write!(
            text,
            "<rect class=\"fill\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{height:.1}\"><title>{count} \
             from {} to {}</title></rect>",
            class as f64 * step + 0.5,
            BASE - height,
            step - 1.0,
            number(start + span * class as f64 / CLASSES as f64),
            number(start + span * (class + 1) as f64 / CLASSES as f64),
        );
    }
    let _ = write!(text, "<path class=\"axis\" d=\"M0 {BASE}H{WIDTH}\"/>");
    for (at, anchor) in [(0.0, "start"), (0.5, "middle"), (1.0, "end")] {
        let _ = write!(
            text,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>",
            at * WIDTH,
            BASE + 15.0,
            number(start + at * span)
        );
    }
    let _ = write!(
        text,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{} ({})</text></svg>",
        0.5 * WIDTH,
        HEIGHT - 2.0,
        escape(title),
        escape(unit)
    );
    Some(text)
}

/// Bars beside their names, longest possible value 1 unless one is larger.
pub fn bars(rows: &[(String, f64, String)]) -> String {
    let most = rows.iter().map(|row| row.1).filter(|v| v.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    let mut text = String::from("<ul class=\"bars\">");
    for (name, value, label) in rows {
        let width = 100.0 * (value / most).clamp(0.0, 1.0);
        let _ = write!(
            text,
            "<li><span>{}</span><span class=\"bar\" style=\"--w:{width:.1}%\">{}</span></li>",
            escape(name),
            escape(label)
        );
    }
    text + "</ul>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_falls_into_a_class() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let text = histogram(&values, "t", "mm").unwrap();
        let counted: usize = text
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
        let text = histogram(&[18.0; 50], "t", "px").unwrap();
        assert_eq!(text.matches("<rect").count(), 1);
    }
}
