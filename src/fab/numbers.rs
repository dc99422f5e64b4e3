//! Numbers as people read them.
//!
//! ```
//! use domecast_fab::numbers::{dimension, duration, percent, significant, typeset};
//!
//! assert_eq!(significant(0.012346), "0.0123");
//! assert_eq!(typeset(-0.012346), "−0.0123");
//! assert_eq!(dimension(12.754), "12.75");
//! assert_eq!(percent(0.5), "50 %");
//! assert_eq!(duration(0.00123), "1.23 ms");
//! ```

/// A number with so many significant digits at most, without zeros at the end; as a power of ten where its decimal
/// exponent is outside `plain`.
fn rounded(value: f64, digits: i32, plain: std::ops::Range<i32>) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i32;
    if !plain.contains(&exponent) {
        return format!("{value:.2e}");
    }
    let decimals = (digits - 1 - exponent).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Three significant digits in ASCII: for terminals, tables and files.
pub fn significant(value: f64) -> String {
    rounded(value, 3, -4..6)
}

/// A result as a page shows it, to three significant digits: a true minus, a dash for what is not finite, 0 for what
/// rounding leaves (below 1e-9).
pub fn typeset(value: f64) -> String {
    on_page(value, 3)
}

/// A size that a part has or that someone measures out, as a page shows it: four significant digits, so that a hundredth of
/// a millimetre is seen.
pub fn dimension(value: f64) -> String {
    on_page(value, 4)
}

fn on_page(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value.abs() < 1e-9 {
        return "0".into();
    }
    rounded(value, digits, -4..6).replace('-', "−")
}

/// A share as percent, as a page shows it.
pub fn percent(share: f64) -> String {
    let hundred = 100.0 * share;
    let decimals = if hundred.abs() >= 1.0 { 10.0 } else { 1000.0 };
    format!("{} %", typeset((hundred * decimals).round() / decimals))
}

/// A time for people.
pub fn duration(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s >= 1.0 => (s, "s"),
        s if s >= 1e-3 => (s * 1e3, "ms"),
        s if s >= 1e-6 => (s * 1e6, "µs"),
        s => (s * 1e9, "ns"),
    };
    format!("{} {unit}", significant(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        let cases = [
            (0.0, "0"),
            (17.0, "17"),
            (1.234567, "1.23"),
            (-0.012346, "−0.0123"),
            (1234.5678, "1235"),
            (100.0, "100"),
            (f64::NAN, "–"),
            (2.5e-7, "2.50e−7"),
        ];
        for (value, wanted) in cases {
            assert_eq!(typeset(value), wanted, "{value}");
        }
        let cases = [
            (1.234567, "1.23"),
            (-0.012346, "-0.0123"),
            (1234.5678, "1235"),
            (2.5e-7, "2.50e-7"),
            (0.0, "0"),
        ];
        for (value, wanted) in cases {
            assert_eq!(significant(value), wanted, "{value}");
        }
    }
}
