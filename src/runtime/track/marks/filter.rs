//! Filters of 3 x 3 pixels on whole planes of bytes. Outside of the plane the border's pixels go on.

/// Runs a separable or full kernel row by row: `f(above, here, below, out)`, rows padded by one pixel on each side.
fn by_rows(
    width: usize,
    height: usize,
    from: &[u8],
    to: &mut [u8],
    pads: &mut [Vec<u8>; 3],
    f: impl Fn(&[u8], &[u8], &[u8], &mut [u8]),
) {
    if width == 0 || height == 0 || from.len() < width * height || to.len() < width * height {
        return;
    }
    let load = |pad: &mut Vec<u8>, y: usize| {
        pad.resize(width + 2, 0);
        let row = &from[y * width..(y + 1) * width];
        pad[1..=width].copy_from_slice(row);
        pad[0] = row[0];
        pad[width + 1] = row[width - 1];
    };
    load(&mut pads[0], 0);
    load(&mut pads[1], 0);
    for y in 0..height {
        load(&mut pads[2], (y + 1).min(height - 1));
        let [above, here, below] = &*pads;
        f(above, here, below, &mut to[y * width..(y + 1) * width]);
        pads.rotate_left(1);
    }
}

/// Buffers of the filters; they grow to the widest row once.
pub type Pads = [Vec<u8>; 3];

/// The binomial blur 1 2 1 / 2 4 2 / 1 2 1 over 16, OpenCV's `GaussianBlur` with a 3 x 3 kernel.
pub fn blur(width: usize, height: usize, from: &[u8], to: &mut [u8], pads: &mut Pads) {
    by_rows(width, height, from, to, pads, |above, here, below, out| {
        let column = |i: usize| u16::from(above[i]) + 2 * u16::from(here[i]) + u16::from(below[i]);
        for (i, to) in out.iter_mut().enumerate() {
            *to = ((column(i) + 2 * column(i + 1) + column(i + 2) + 8) >> 4) as u8;
        }
    });
}

/// The sharpening 0 -1 0 / -1 5 -1 / 0 -1 0.
pub fn sharpen(width: usize, height: usize, from: &[u8], to: &mut [u8], pads: &mut Pads) {
    by_rows(width, height, from, to, pads, |above, here, below, out| {
        for (i, to) in out.iter_mut().enumerate() {
            let around = i16::from(above[i + 1])
                + i16::from(below[i + 1])
                + i16::from(here[i])
                + i16::from(here[i + 2]);
            *to = (5 * i16::from(here[i + 1]) - around).clamp(0, 255) as u8;
        }
    });
}

fn extreme(width: usize, height: usize, from: &[u8], to: &mut [u8], pads: &mut Pads, pick: fn(u8, u8) -> u8) {
    by_rows(width, height, from, to, pads, |above, here, below, out| {
        let column = |i: usize| pick(pick(above[i], here[i]), below[i]);
        for (i, to) in out.iter_mut().enumerate() {
            *to = pick(pick(column(i), column(i + 1)), column(i + 2));
        }
    });
}

/// Opening by a 3 x 3 square of a plane whose marks are non-zero: what is narrower than three pixels goes.
pub fn open(width: usize, height: usize, plane: &mut [u8], scratch: &mut [u8], pads: &mut Pads) {
    extreme(width, height, plane, scratch, pads, u8::min);
    extreme(width, height, scratch, plane, pads, u8::max);
}
