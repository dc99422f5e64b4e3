//! Convolution of a map, as tiles of four pixels by eight channels that stay in registers.

use glam::Vec4;

use super::Map;

/// Channels of a tile: two of the registers that every machine has.
const LANES: usize = 8;
const PIXELS: usize = 4;

type Lanes = [Vec4; 2];

fn lanes(values: [f32; LANES]) -> Lanes {
    [Vec4::from_slice(&values), Vec4::from_slice(&values[4..])]
}

/// A convolution with square kernel, ready to run.
#[derive(Debug, Clone)]
pub(crate) struct Conv {
    /// Where the patch of each output pixel begins in the input, and where the pixel is in the output.
    pixels: Vec<(usize, usize)>,
    kernel: usize,
    /// Numbers of one row of a patch: pixels side by side with their channels.
    span: usize,
    input_stride: usize,
    channels: usize,
    /// For each eight output channels, each row of the patch and each number in it: eight weights.
    weights: Vec<Lanes>,
    bias: Vec<Lanes>,
    pub(crate) relu: bool,
}

impl Conv {
    /// `weights` as ONNX has them, `[out][in][row][column]`; `kernel`, `stride` and `pad` in pixels. The input's border is
    /// at least `pad`, the output's sides are those that `kernels::swept` gives.
    pub(crate) fn new(
        [input, output]: [Map; 2],
        [kernel, stride, pad]: [usize; 3],
        weights: &[f32],
        bias: &[f32],
    ) -> Self {
        let inset = input.border - pad;
        let pixels = (0..output.height).flat_map(|row| (0..output.width).map(move |column| (row, column)));
        let pixels = pixels
            .map(|(row, column)| {
                let from =
                    (row * stride + inset) * input.stride() + (column * stride + inset) * input.channels;
                (from, output.at(row, column))
            })
            .collect();
        let span = kernel * input.channels;
        let blocks = output.channels.div_ceil(LANES);
        let mut packed = vec![[0.0; LANES]; blocks * kernel * span];
        for (out, one) in weights.chunks_exact(input.channels * kernel * kernel).enumerate() {
            for (channel, plane) in one.chunks_exact(kernel * kernel).enumerate() {
                for (at, weight) in plane.iter().enumerate() {
                    let (row, column) = (at / kernel, at % kernel);
                    let place = (out / LANES * kernel + row) * span + column * input.channels + channel;
                    packed[place][out % LANES] = *weight;
                }
            }
        }
        let mut padded = vec![[0.0; LANES]; blocks];
        bias.iter().enumerate().for_each(|(out, value)| padded[out / LANES][out % LANES] = *value);
        Self {
            pixels,
            kernel,
            span,
            input_stride: input.stride(),
            channels: output.channels,
            weights: packed.into_iter().map(lanes).collect(),
            bias: padded.into_iter().map(lanes).collect(),
            relu: false,
        }
    }

    /// Multiplications of one run.
    pub(crate) fn work(&self) -> u64 {
        self.pixels.len() as u64 * self.weights.len() as u64 * LANES as u64
    }

    pub(crate) fn run(&self, input: &[f32], output: &mut [f32]) {
        let floor = if self.relu { 0.0 } else { f32::NEG_INFINITY };
        let block_size = self.kernel * self.span;
        for (block, (weights, bias)) in self.weights.chunks_exact(block_size).zip(&self.bias).enumerate() {
            let first = block * LANES;
            let lanes = LANES.min(self.channels - first);
            for tile in self.pixels.chunks(PIXELS) {
                // a tile that is not full repeats its last pixel
                let from = std::array::from_fn(|i| tile[i.min(tile.len() - 1)].0);
                let sums = self.tile(input, from, weights, *bias);
                for ((_, to), sum) in tile.iter().zip(&sums) {
                    let out = &mut output[to + first..to + first + lanes];
                    let sum = sum.iter().flat_map(Vec4::as_ref);
                    out.iter_mut().zip(sum).for_each(|(out, sum)| *out = sum.max(floor));
                }
            }
        }
    }

    #[inline(always)]
    fn tile(&self, input: &[f32], from: [usize; PIXELS], weights: &[Lanes], bias: Lanes) -> [Lanes; PIXELS] {
        let [mut a, mut b, mut c, mut d] = [bias; PIXELS];
        for (row, weights) in weights.chunks_exact(self.span).enumerate() {
            let patches = from.map(|from| &input[from + row * self.input_stride..][..weights.len()]);
            let [at_a, at_b, at_c, at_d] = patches.map(|patch| patch.iter());
            for ((((weights, va), vb), vc), vd) in weights.iter().zip(at_a).zip(at_b).zip(at_c).zip(at_d) {
                a = [a[0] + weights[0] * *va, a[1] + weights[1] * *va];
                b = [b[0] + weights[0] * *vb, b[1] + weights[1] * *vb];
                c = [c[0] + weights[0] * *vc, c[1] + weights[1] * *vc];
                d = [d[0] + weights[0] * *vd, d[1] + weights[1] * *vd];
            }
        }
        [a, b, c, d]
    }
}
