//! Colours for numbers.

/// Colours from low to high, evenly spaced: viridis at its quarters (S. van der Walt, N. Smith, matplotlib), which grows
/// evenly in lightness, so that it can be read without colours.
pub const VIRIDIS: [[u8; 3]; 5] = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/// The colour of a share of the scale: 0 and less (and what is no number) is its low end, 1 and more its high one.
pub fn viridis(share: f64) -> [u8; 3] {
    let share = if share.is_nan() { 0.0 } else { share };
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let low = (place as usize).min(VIRIDIS.len() - 2);
    let part = place - low as f64;
    std::array::from_fn(|c| {
        let [from, to] = [VIRIDIS[low][c], VIRIDIS[low + 1][c]].map(f64::from);
        (from + part * (to - from)).round() as u8
    })
}

/// The end of a scale of depths from 0 that holds `deepest_mm`: 1, 2 or 5 times a power of ten, at least 0.1 mm, so that noise
/// alone does not fill it, and at most 500 mm.
pub fn depth_range_mm(deepest_mm: f64) -> f64 {
    let ends = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0];
    // What is no number is not deeper than anything.
    ends.into_iter().find(|end| deepest_mm.is_nan() || deepest_mm <= *end).unwrap_or(500.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_holds_what_is_drawn() {
        for (deepest_mm, wanted) in
            [(f64::NAN, 0.1), (-1.0, 0.1), (0.1, 0.1), (0.11, 0.2), (0.43, 0.5), (9e9, 500.0)]
        {
            assert_eq!(depth_range_mm(deepest_mm), wanted, "{deepest_mm}");
        }
        assert_eq!(viridis(f64::NAN), viridis(0.0));
        assert_eq!([viridis(-1.0), viridis(2.0)], [VIRIDIS[0], VIRIDIS[4]]);
        let gray =
            |rgb: [u8; 3]| 0.3 * f64::from(rgb[0]) + 0.59 * f64::from(rgb[1]) + 0.11 * f64::from(rgb[2]);
        assert!(
            (1..100).all(|k| gray(viridis(f64::from(k) / 100.0)) > gray(viridis(f64::from(k - 1) / 100.0)))
        );
    }
}
