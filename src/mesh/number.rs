//! Numbers as the text formats write them.
//!
//! One writer for every file of text: STEP, DXF and SVG take their digits from here, so that a length of zero is
//! never "-0" and the same design gives the same bytes.

/// At most `places` digits after the point, without trailing zeros and without an exponent: for lengths whose last
/// digits mean nothing.
///
/// ```
/// use domecast_mesh::number::rounded;
/// assert_eq!(rounded(12.3400001, 6), "12.34");
/// assert_eq!(rounded(-1e-9, 6), "0");
/// ```
pub fn rounded(x: f64, places: i32) -> String {
    let scale = 10f64.powi(places);
    // The sum turns -0.0 into 0.0.
    format!("{}", (x * scale).round() / scale + 0.0)
}

/// As [`rounded`], always with a point, which some readers need to see a real number.
///
/// ```
/// assert_eq!(domecast_mesh::number::rounded_real(-8.0, 9), "-8.0");
/// ```
pub fn rounded_real(x: f64, places: i32) -> String {
    let text = rounded(x, places);
    if text.contains('.') { text } else { text + ".0" }
}

/// The shortest digits that read back as the same number, as STEP wants a real: always with a point, an exponent
/// with a capital.
///
/// ```
/// use domecast_mesh::number::step_real;
/// assert_eq!(step_real(0.1), "0.1");
/// assert_eq!(step_real(1e-17), "1.E-17");
/// ```
pub fn step_real(x: f64) -> String {
    let text = format!("{:?}", x + 0.0).replace('e', "E");
    if text.contains('.') {
        text
    } else if let Some((mantissa, exponent)) = text.split_once('E') {
        format!("{mantissa}.E{exponent}")
    } else {
        format!("{text}.")
    }
}
