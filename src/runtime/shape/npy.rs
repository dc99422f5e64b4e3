//! NumPy's array files, version 1.0 (numpy.lib.format): little-endian, C order.

/// The file of an array of 32-bit floats. `values` has as many as the product of `shape`.
pub fn npy_f32(shape: &[usize], values: impl Iterator<Item = f32>) -> Vec<u8> {
    let mut out = header("<f4", shape);
    out.reserve(4 * shape.iter().product::<usize>());
    values.for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
    out
}

/// The file of an array of bytes.
pub fn npy_u8(shape: &[usize], values: &[u8]) -> Vec<u8> {
    let mut out = header("|u1", shape);
    out.extend_from_slice(values);
    out
}

fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let sides: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", sides.trim_end());
    // Magic, version and length are ten bytes; all of it is padded to 64 and ends with a line.
    let length = (10 + text.len() + 1).div_ceil(64) * 64 - 10;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(length as u16).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
    out.resize(10 + length - 1, b' ');
    out.push(b'\n');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_numpys() {
        let file = npy_u8(&[2, 3], &[1, 2, 3, 4, 5, 6]);
        assert_eq!(file.len(), 128 + 6);
        assert!(file.starts_with(
            b"\x93NUMPY\x01\x00\x76\x00{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3,), }"
        ));
        assert_eq!(file[127], b'\n');
        assert_eq!(npy_f32(&[1], [1.0].into_iter())[128..], 1.0_f32.to_le_bytes());
    }
}
