//! Arrays as NumPy reads them (`numpy.lib.format`, version 1.0).

/// An array of 32-bit floats in C order.
pub(super) fn npy_f32(shape: &[usize], values: &[f32]) -> Vec<u8> {
    const ALIGNED: usize = 64;
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    // a tuple of one has its comma
    let comma = if shape.len() == 1 { "," } else { "" };
    let mut header =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}{comma}), }}", shape.join(", "));
    // magic, version and length come before; the header ends with a line's end where the values may begin
    const BEFORE: usize = 10;
    let padded = (BEFORE + header.len() + 1).next_multiple_of(ALIGNED) - BEFORE;
    header.push_str(&" ".repeat(padded - 1 - header.len()));
    header.push('\n');
    let mut bytes = Vec::with_capacity(BEFORE + padded + 4 * values.len());
    bytes.extend_from_slice(b"\x93NUMPY\x01\x00");
    bytes.extend_from_slice(&(padded as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
