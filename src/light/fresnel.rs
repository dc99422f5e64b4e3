//! What flat interfaces let through and send back (Fresnel's equations; Born and Wolf, Principles of Optics,
//! 1.5.2), for light without polarisation that meets several of them in turn.
//!
//! The two polarisations keep apart from interface to interface, so each is followed to the end and the mean
//! is taken there. Of light that goes straight through, what goes back and forth inside a layer first is left out: between acrylic and
//! silicone it is less than a thousandth. Of light along the sheet, of which the dome throws much on itself, it is a tenth and more.

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

/// Share of unpolarised light that, sent down through media of these indices to the air below, comes back into the first one: all that
/// does not leave into the air at last, however often it goes back and forth between the faces. Lossless layers without interference
/// have `(1 - T) / T = sum of (1 - t) / t` over their faces for each polarisation (G. Stokes, Proc. R. Soc. 11, 1862: a pile of plates).
pub fn returned(indices: &[f64], momentum: f64) -> f64 {
    if momentum >= 1.0 {
        return 1.0;
    }
    let mut ratio = [0.0; 2];
    let faces = indices.windows(2).map(|pair| (pair[0], pair[1]));
    for (from, to) in faces.chain(indices.last().map(|lowest| (*lowest, 1.0))) {
        for (ratio, passed) in ratio.iter_mut().zip(transmitted(from, to, momentum)) {
            *ratio += (1.0 - passed) / passed.max(f64::MIN_POSITIVE);
        }
    }
    0.5 * ratio.iter().map(|ratio| ratio / (1.0 + ratio)).sum::<f64>()
}

/// Share of unpolarised light that, sent down through media of these indices to the air below, comes back up into the last of them.
pub fn turned(indices: &[f64], momentum: f64) -> f64 {
    let lowest = indices.last().copied().unwrap_or(1.0);
    let turned = if momentum >= 1.0 { [1.0; 2] } else { transmitted(lowest, 1.0, momentum).map(|t| 1.0 - t) };
    let passed = through_polarised(indices, momentum);
    0.5 * (passed[0] * turned[0] + passed[1] * turned[1])
}
