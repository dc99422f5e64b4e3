//! Raw frames of webcams: YUYV (4:2:2).

use super::Picture;

/// Red, green and blue of a YUYV frame: two pixels share their colour. The numbers are those of JPEG (BT.601, full range), as
/// webcams send them (`V4L2_COLORSPACE_SRGB` with its default encoding has a limited range on paper; UVC cameras use all of
/// it or next to all, and for dots and shape only ratios to rest count).
///
/// # Errors
/// Bytes that are too few for the size, or an odd width.
pub fn yuyv(width: usize, height: usize, line_bytes: usize, bytes: &[u8]) -> Result<Picture, String> {
    let row = 2 * width;
    let line_bytes = line_bytes.max(row);
    let wanted = line_bytes.saturating_mul(height.saturating_sub(1)).saturating_add(row);
    if !width.is_multiple_of(2) || height == 0 || width == 0 || bytes.len() < wanted {
        return Err(format!("is no whole YUYV frame of {width} x {height}: {} bytes", bytes.len()));
    }
    let mut rgb = Vec::with_capacity(3 * width * height);
    for line in bytes.chunks(line_bytes).take(height) {
        for quad in line[..row].chunks_exact(4) {
            let [left, u, right, v] = [quad[0], quad[1], quad[2], quad[3]].map(i32::from);
            let (u, v) = (u - 128, v - 128);
            // in 1/65536, rounded
            let add = [91_881 * v, -22_554 * u - 46_802 * v, 116_130 * u];
            for y in [left, right] {
                rgb.extend(add.map(|add| (y + ((add + 32_768) >> 16)).clamp(0, 255) as u8));
            }
        }
    }
    Picture { width, height, channels: 3, bytes: rgb }.checked()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_of_the_formula() {
        for (y, u, v) in [(0, 128, 128), (255, 128, 128), (81, 90, 240), (145, 54, 34), (41, 240, 110)] {
            let quad = [y, u, y, v];
            let picture = yuyv(2, 1, 4, &quad).unwrap();
            let (y, u, v) = (f64::from(y), f64::from(u) - 128.0, f64::from(v) - 128.0);
            let exact = [y + 1.402 * v, y - 0.344_136 * u - 0.714_136 * v, y + 1.772 * u];
            for (channel, value) in exact.into_iter().enumerate() {
                let found = f64::from(picture.bytes[channel]);
                assert!((found - value.clamp(0.0, 255.0)).abs() <= 0.51, "{found} {value}");
            }
        }
    }

    #[test]
    fn frames_that_are_cut_off_are_refused() {
        assert!(yuyv(4, 2, 8, &[128; 16]).is_ok());
        assert!(yuyv(4, 2, 10, &[128; 18]).is_ok());
        assert!(yuyv(4, 2, 10, &[128; 17]).is_err());
        assert!(yuyv(3, 2, 8, &[128; 99]).is_err());
        assert!(yuyv(0, 2, 8, &[128; 99]).is_err());
    }
}
