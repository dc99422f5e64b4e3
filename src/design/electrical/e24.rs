//! The values that resistors are sold in.

/// The E24 series, 5 % resistors: two digits of each decade (IEC 60063:2015).
const E24: [f64; 24] = [
    1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0, 3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8,
    7.5, 8.2, 9.1,
];
/// Smallest and largest resistor that every shop has, ohm.
pub const RANGE_OHM: [f64; 2] = [1.0, 1e7];
/// What resistors of the common sizes bear, W.
const RATINGS_W: [f64; 7] = [0.063, 0.1, 0.125, 0.25, 0.5, 1.0, 2.0];
/// Part of its rating that a resistor gets: half, so that it stays cool enough to touch.
const LOADED: f64 = 0.5;

/// The E24 value whose ratio to the ideal one is nearest to 1, ohm; `None` outside of [`RANGE_OHM`].
pub fn nearest_ohm(ideal_ohm: f64) -> Option<f64> {
    let [low, high] = RANGE_OHM;
    if !(low..=high).contains(&ideal_ohm) {
        return None;
    }
    let off = |value: f64| (value / ideal_ohm).ln().abs();
    let decade = ideal_ohm.log10().floor() as i32;
    // the next decade too: 9.6 is nearest to 10
    let values = (decade..=decade + 1).flat_map(|power| E24.map(|digits| in_decade(digits, power)));
    values.reduce(|best, value| if off(value) < off(best) { value } else { best })
}

/// Digits times a power of ten; whole numbers where they are, without the tail of binary fractions.
fn in_decade(digits: f64, power: i32) -> f64 {
    let tenths = (10.0 * digits).round();
    if power >= 1 { tenths * 10f64.powi(power - 1) } else { tenths / 10f64.powi(1 - power) }
}

/// The smallest rating of which `power_w` is half or less, W; `None` where none of the common sizes bears it.
pub fn rating_w(power_w: f64) -> Option<f64> {
    RATINGS_W.into_iter().find(|rating| power_w <= LOADED * rating)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_value_is_within_half_a_step() {
        assert_eq!(nearest_ohm(128.0), Some(130.0));
        assert_eq!(nearest_ohm(9.6), Some(10.0));
        assert_eq!(nearest_ohm(1.0), Some(1.0));
        assert_eq!(nearest_ohm(4700.0), Some(4700.0));
        assert_eq!(nearest_ohm(0.99), None);
        assert_eq!(nearest_ohm(f64::NAN), None);
        let mut ohm = 1.0;
        while ohm < 1e7 {
            let found = nearest_ohm(ohm).unwrap();
            // the widest step of the series is 1.3 to 1.5: its half is 7.5 % in ratio
            assert!((found / ohm).ln().abs() <= 0.5 * (1.5f64 / 1.3).ln() + 1e-12, "{ohm}: {found}");
            ohm *= 1.0037;
        }
    }

    #[test]
    fn a_resistor_bears_twice_what_it_gets() {
        assert_eq!(rating_w(0.05), Some(0.1));
        assert_eq!(rating_w(0.0501), Some(0.125));
        assert_eq!(rating_w(1.01), None);
    }
}
