//! A camera's frame at the size that the network sees: each of its pixels is the mean of the area that it covers.

/// A frame of bytes, rows of pixels, 1 (grey) or 3 (red, green, blue) bytes each.
#[derive(Debug, Clone, Copy)]
pub struct FrameView<'a> {
    /// Pixels of a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 or 3.
    pub channels: usize,
    /// `width * height * channels` bytes.
    pub bytes: &'a [u8],
}

impl FrameView<'_> {
    fn is_whole(&self) -> bool {
        let count = self.width.checked_mul(self.height).and_then(|count| count.checked_mul(self.channels));
        matches!(self.channels, 1 | 3) && self.width > 0 && count == Some(self.bytes.len())
    }
}

/// Which pixels a side's pixel covers: the first, the shares of it and the next ones.
type Cover = (usize, Vec<f32>);

fn covers(from: usize, to: usize) -> Vec<Cover> {
    let ratio = from as f64 / to as f64;
    let cover = |at: usize| {
        let (start, end) = (at as f64 * ratio, (at + 1) as f64 * ratio);
        let first = (start.floor() as usize).min(from - 1);
        let last = (end.ceil() as usize).clamp(first + 1, from);
        let share = |pixel: usize| {
            let inside = end.min((pixel + 1) as f64) - start.max(pixel as f64);
            (inside.max(0.0) / ratio) as f32
        };
        (first, (first..last).map(share).collect())
    };
    (0..to).map(cover).collect()
}

/// Shrinks frames of one size; laid out anew when the size changes.
#[derive(Debug, Clone, Default)]
pub struct Shrinker {
    from: [usize; 3],
    to: [usize; 2],
    rows: Vec<Cover>,
    columns: Vec<Cover>,
    sums: Vec<f32>,
}

impl Shrinker {
    fn lay_out(&mut self, frame: &FrameView<'_>, to: [usize; 2]) {
        let from = [frame.height, frame.width, frame.channels];
        if self.from != from || self.to != to {
            *self = Self {
                from,
                to,
                rows: covers(frame.height, to[0]),
                columns: covers(frame.width, to[1]),
                sums: vec![0.0; frame.width * frame.channels],
            };
        }
    }

    /// Writes the means, levels from 0 to 255, as `[row][column][3]`; grey thrice. `to` is height and width. False, and
    /// nothing written, where the frame's bytes are not as many as its sides say, or `out` is not as long as `to` says.
    pub fn shrink(&mut self, frame: &FrameView<'_>, to: [usize; 2], out: &mut [f32]) -> bool {
        if !frame.is_whole() || to[0].checked_mul(to[1] * 3) != Some(out.len()) || out.is_empty() {
            return false;
        }
        self.lay_out(frame, to);
        let stride = frame.width * frame.channels;
        for ((first, shares), out) in self.rows.iter().zip(out.chunks_exact_mut(to[1] * 3)) {
            self.sums.fill(0.0);
            for (row, share) in frame.bytes[first * stride..].chunks_exact(stride).zip(shares) {
                self.sums.iter_mut().zip(row).for_each(|(sum, level)| *sum += share * f32::from(*level));
            }
            for ((first, shares), out) in self.columns.iter().zip(out.as_chunks_mut::<3>().0) {
                *out = [0.0; 3];
                let pixels = self.sums[first * frame.channels..].chunks_exact(frame.channels);
                for (pixel, share) in pixels.zip(shares) {
                    for (channel, out) in out.iter_mut().enumerate() {
                        *out += share * pixel[channel.min(pixel.len() - 1)];
                    }
                }
            }
        }
        true
    }
}

/// Blocks of a picture at rest: rows and columns.
const BLOCKS: [usize; 2] = [3, 4];
/// How many numbers say what a picture at rest looks like.
pub const REST_NUMBERS: usize = 1 + BLOCKS[0] * BLOCKS[1];

/// What a picture at rest looks like, `[row][column][3]`: its mean level, then the levels of its blocks in parts of that. Less
/// light changes the first, another lens or dome the others. Zeros of a picture without a pixel or without light.
pub fn rest_profile(levels: &[f32], [height, width]: [usize; 2]) -> [f64; REST_NUMBERS] {
    let (mut sums, mut counts) = ([0.0; REST_NUMBERS], [0.0_f64; REST_NUMBERS]);
    for (at, pixel) in levels.as_chunks::<3>().0.iter().take(height * width).enumerate() {
        let (row, column) = (at / width * BLOCKS[0] / height, at % width * BLOCKS[1] / width);
        for place in [0, 1 + row * BLOCKS[1] + column] {
            sums[place] += pixel.iter().map(|level| f64::from(*level)).sum::<f64>() / 3.0;
            counts[place] += 1.0;
        }
    }
    sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum /= count.max(1.0));
    let mean = sums[0];
    sums[1..].iter_mut().for_each(|block| *block /= if mean > 0.0 { mean } else { f64::INFINITY });
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shrunk(width: usize, height: usize, to: [usize; 2], level: impl Fn(usize, usize) -> u8) -> Vec<f32> {
        let bytes: Vec<u8> = (0..width * height).map(|at| level(at / width, at % width)).collect();
        let mut out = vec![0.0; to[0] * to[1] * 3];
        let frame = FrameView { width, height, channels: 1, bytes: &bytes };
        assert!(Shrinker::default().shrink(&frame, to, &mut out));
        out.iter().step_by(3).copied().collect()
    }

    #[test]
    fn pixels_are_means_of_what_they_cover() {
        assert_eq!(shrunk(4, 2, [1, 2], |row, column| (row * 4 + column) as u8 * 8), [20.0, 36.0]);
        // three pixels onto two: the middle one is shared
        let thirds = shrunk(3, 1, [1, 2], |_, column| [0, 90, 30][column]);
        assert!((thirds[0] - 30.0).abs() < 1e-4 && (thirds[1] - 50.0).abs() < 1e-4, "{thirds:?}");
        // a flat picture stays flat, larger or smaller
        for to in [[3, 5], [48, 64], [7, 7]] {
            assert!(shrunk(31, 17, to, |_, _| 200).iter().all(|level| (level - 200.0).abs() < 1e-3));
        }
    }

    #[test]
    fn a_profile_separates_light_from_form() {
        let levels: Vec<f32> = (0..6 * 8 * 3).map(|at| if at / 3 % 8 < 2 { 90.0 } else { 30.0 }).collect();
        let profile = rest_profile(&levels, [6, 8]);
        assert_eq!(profile[..3], [45.0, 2.0, 30.0 / 45.0]);
        let half: Vec<f32> = levels.iter().map(|level| level * 0.5).collect();
        let dim = rest_profile(&half, [6, 8]);
        assert_eq!((dim[0], &dim[1..]), (22.5, &profile[1..]));
        assert_eq!(rest_profile(&[], [0, 0]), [0.0; REST_NUMBERS]);
        assert_eq!(rest_profile(&[0.0; 12], [2, 2]), [0.0; REST_NUMBERS]);
    }

    #[test]
    fn frames_of_other_lengths_are_refused() {
        let mut out = vec![0.0; 12];
        for (width, height, channels, count) in
            [(2, 2, 3, 11), (2, 2, 2, 8), (0, 2, 3, 0), (usize::MAX, 2, 3, 12)]
        {
            let bytes = vec![0; count];
            let frame = FrameView { width, height, channels, bytes: &bytes };
            assert!(!Shrinker::default().shrink(&frame, [2, 2], &mut out));
        }
    }
}
