//! The blur of whole planes of bytes. Outside of the plane the border's pixels go on.

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
