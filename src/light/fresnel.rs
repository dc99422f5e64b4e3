//! What flat interfaces let through and send back (Fresnel's equations; Born and Wolf, Principles of Optics,
//! 1.5.2), for light without polarisation that meets several of them in turn.
//!
//! The two polarisations keep apart from interface to interface, so each is followed to the end and the mean
//! is taken there. Light that goes back and forth inside a layer is left out: between acrylic and silicone it is
//! less than a thousandth.

/// Share of the flux that one interface lets through, for light polarised across and in the plane of
/// incidence. `momentum` is the index times the sine of the angle, the same on both sides.
#[inline]
pub fn transmitted(from_index: f64, to_index: f64, momentum: f64) -> [f64; 2] {
    let cos = |index: f64| 1.0 - (momentum / index) * (momentum / index);
    let (a, b) = (cos(from_index), cos(to_index));
    if a <= 0.0 || b <= 0.0 {
        return [0.0; 2];
    }
    let (a, b) = (a.sqrt(), b.sqrt());
    let four = 4.0 * from_index * to_index * a * b;
    let (across, along) = (from_index * a + to_index * b, to_index * a + from_index * b);
    [four / (across * across), four / (along * along)]
}

/// Share of unpolarised light that gets through all interfaces between media of these indices, in order.
pub fn through(indices: &[f64], momentum: f64) -> f64 {
    0.5 * through_polarised(indices, momentum).iter().sum::<f64>()
}

/// [`through`] for each polarisation.
pub fn through_polarised(indices: &[f64], momentum: f64) -> [f64; 2] {
    indices.windows(2).fold([1.0; 2], |so_far, pair| {
        let [s, p] = transmitted(pair[0], pair[1], momentum);
        [so_far[0] * s, so_far[1] * p]
    })
}

/// Share of unpolarised light that, sent down through media of these indices to the air below, comes back up
/// into the last one: `indices` from the first medium to the sheet's lowest layer, then those it meets on the
/// way up. All of what gets to the underside returns where the momentum is above 1, the air's index.
pub fn returned(down: &[f64], up: &[f64], momentum: f64) -> f64 {
    let lowest = down.last().copied().unwrap_or(1.0);
    let turned = if momentum >= 1.0 { [1.0; 2] } else { transmitted(lowest, 1.0, momentum).map(|t| 1.0 - t) };
    let (first, last) = (through_polarised(down, momentum), through_polarised(up, momentum));
    0.5 * (first[0] * turned[0] * last[0] + first[1] * turned[1] * last[1])
}
