//! Arrays and surfaces as other programs read them.

/// NumPy's file of 32-bit floats (`numpy.lib.format`, version 1.0): little-endian, C order. `values` has as many as the product
/// of `shape`.
pub fn npy_f32(shape: &[usize], values: impl Iterator<Item = f32>) -> Vec<u8> {
    let mut out = npy_header("<f4", shape);
    out.reserve(4 * shape.iter().product::<usize>());
    values.for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
    out
}

/// NumPy's file of bytes.
pub fn npy_u8(shape: &[usize], values: impl Iterator<Item = u8>) -> Vec<u8> {
    let mut out = npy_header("|u1", shape);
    out.extend(values);
    out
}

fn npy_header(kind: &str, shape: &[usize]) -> Vec<u8> {
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

/// A grey PNG of 16 bits, `[height, width]`.
///
/// # Errors
/// A size that is not that of `levels`, or that PNG does not hold.
pub fn png_u16(size: [usize; 2], levels: &[u16]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let [height, width] = size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::Fast);
    let big_endian: Vec<u8> = levels.iter().flat_map(|level| level.to_be_bytes()).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&big_endian)?;
    writer.finish()?;
    Ok(bytes)
}

/// A PLY file (binary, little-endian) of triangles: each vertex has a row of as many 32-bit floats as there are `properties`,
/// x, y and z among them. Faces are counter-clockwise from outside.
pub fn ply(properties: &[&str], vertices: impl ExactSizeIterator<Item = f32>, faces: &[[u32; 3]]) -> Vec<u8> {
    let rows = vertices.len() / properties.len().max(1);
    let named: String = properties.iter().map(|name| format!("property float {name}\n")).collect();
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {rows}\n{named}element face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        faces.len()
    )
    .into_bytes();
    vertices.for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
    for face in faces {
        out.push(3);
        face.iter().for_each(|corner| out.extend_from_slice(&corner.to_le_bytes()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_numpys() {
        let file = npy_u8(&[2, 3], 1..=6);
        assert_eq!(file.len(), 128 + 6);
        assert!(file.starts_with(
            b"\x93NUMPY\x01\x00\x76\x00{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3,), }"
        ));
        assert_eq!(file[127], b'\n');
        assert_eq!(npy_f32(&[1], [1.0].into_iter())[128..], 1.0_f32.to_le_bytes());
    }

    #[test]
    fn a_picture_of_another_size_is_refused() {
        assert!(png_u16([2, 2], &[0; 3]).is_err());
        assert!(png_u16([2, 2], &[0; 4]).is_ok());
    }

    #[test]
    fn a_ply_has_what_its_header_says() {
        let file = ply(&["x", "y", "z"], [0.0_f32; 9].into_iter(), &[[0, 1, 2]]);
        let text = String::from_utf8_lossy(&file);
        assert!(text.contains("element vertex 3\n") && text.contains("element face 1\n"));
        let body = file.len() - (text.find("end_header\n").expect("the header ends") + 11);
        assert_eq!(body, 9 * 4 + 1 + 3 * 4);
    }
}
