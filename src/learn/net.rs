//! The networks: residual blocks on each frame's picture, a list of readings beside it, a bidirectional GRU over the frames.

use burn::module::Module;
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::{
    BatchNorm, BatchNormConfig, BiGru, BiGruConfig, Initializer, Linear, LinearConfig, PaddingConfig2d,
};
use burn::tensor::activation::relu;
use burn::tensor::module::max_pool2d;
use burn::tensor::ops::MaxPoolOptions;
use burn::tensor::{Device, Tensor};

/// Frames at the end of the window whose states are averaged: the paper's choice.
pub const LAST_FRAMES: usize = 5;
/// Numbers that the readings become.
const READING_FEATURES: usize = 32;

/// A convolution without offset, and the normalisation of its channels.
#[derive(Module, Debug)]
pub(crate) struct ConvNorm {
    /// Weights `[out][in][row][column]`.
    pub conv: Conv2d,
    /// Scale and offset.
    pub norm: BatchNorm,
}

impl ConvNorm {
    fn new([inputs, outputs]: [usize; 2], kernel: usize, stride: usize, device: &Device) -> Self {
        let pad = kernel / 2;
        let conv = Conv2dConfig::new([inputs, outputs], [kernel, kernel])
            .with_stride([stride, stride])
            .with_padding(PaddingConfig2d::Explicit(pad, pad, pad, pad))
            .with_bias(false)
            .with_initializer(Initializer::KaimingNormal {
                gain: std::f64::consts::SQRT_2,
                fan_out_only: false,
            });
        Self { conv: conv.init(device), norm: BatchNormConfig::new(outputs).init(device) }
    }

    fn forward(&self, input: Tensor<4>) -> Tensor<4> {
        self.norm.forward(self.conv.forward(input))
    }
}

/// Two convolutions, and the way past them.
#[derive(Module, Debug)]
pub(crate) struct Block {
    /// With the block's stride.
    pub first: ConvNorm,
    /// With stride one.
    pub second: ConvNorm,
    /// Where size or channels change: one pixel wide.
    pub past: Option<ConvNorm>,
}

impl Block {
    fn new(inputs: usize, outputs: usize, stride: usize, device: &Device) -> Self {
        let past =
            (stride != 1 || inputs != outputs).then(|| ConvNorm::new([inputs, outputs], 1, stride, device));
        Self {
            first: ConvNorm::new([inputs, outputs], 3, stride, device),
            second: ConvNorm::new([outputs, outputs], 3, 1, device),
            past,
        }
    }

    fn forward(&self, input: Tensor<4>) -> Tensor<4> {
        let inner = self.second.forward(relu(self.first.forward(input.clone())));
        relu(inner + self.past.as_ref().map_or_else(|| input.clone(), |past| past.forward(input.clone())))
    }
}

/// The part that sees the picture.
#[derive(Module, Debug)]
pub(crate) struct Eye {
    /// At half of the picture's size.
    pub stem: ConvNorm,
    /// Whether the largest of nine pixels is taken after the stem, which halves the size again.
    pub pools: bool,
    /// In their order.
    pub blocks: Vec<Block>,
    /// From the last block's channels.
    pub features: Linear,
}

impl Eye {
    fn new(paper: bool, device: &Device) -> Self {
        let channels = if paper { [64, 128, 256, 512] } else { [16, 32, 64, 128] };
        let strides: &[usize] = if paper { &[1, 1, 2, 1, 2, 1, 2, 1] } else { &[2, 2, 2, 2] };
        let mut before = channels[0];
        let per_stage = strides.len() / channels.len();
        let blocks = strides.iter().enumerate().map(|(at, stride)| {
            let outputs = channels[at / per_stage];
            let block = Block::new(before, outputs, *stride, device);
            before = outputs;
            block
        });
        let blocks = blocks.collect();
        let count = if paper { 128 } else { 64 };
        Self {
            stem: ConvNorm::new([3, channels[0]], if paper { 7 } else { 3 }, 2, device),
            pools: paper,
            blocks,
            features: LinearConfig::new(channels[3], count).init(device),
        }
    }

    /// `[frames, 3, height, width]` to `[frames, features]`.
    fn forward(&self, picture: Tensor<4>) -> Tensor<2> {
        let mut value = relu(self.stem.forward(picture));
        if self.pools {
            let options = MaxPoolOptions {
                kernel_size: [3; 2],
                stride: [2; 2],
                padding: [(1, 1); 2],
                dilation: [1; 2],
                ceil_mode: false,
            };
            value = max_pool2d(value, options);
        }
        for block in &self.blocks {
            value = block.forward(value);
        }
        let [frames, channels, height, width] = value.dims();
        let mean: Tensor<2> = value.reshape([frames, channels, height * width]).mean_dim(2).squeeze_dim(2);
        relu(self.features.forward(mean))
    }
}

/// A network.
#[derive(Module, Debug)]
pub(crate) struct Net {
    /// What sees the picture.
    pub eye: Option<Eye>,
    /// What sees the readings, of mean zero and deviation one.
    pub readings: Option<Linear>,
    /// Over the frames.
    pub gru: BiGru,
    /// To a number for each class.
    pub class: Linear,
    /// To mean and ln deviation of log10 of the modulus, of mean zero and deviation one.
    pub modulus: Linear,
}

impl Net {
    /// A network with random weights.
    pub fn new(paper: bool, picture: bool, readings: usize, classes: usize, device: &Device) -> Self {
        let eye = picture.then(|| Eye::new(paper, device));
        let hidden = if paper { 128 } else { 32 };
        let seen = eye.as_ref().map_or(0, |eye| eye.features.weight.dims()[1]);
        let beside = (readings > 0).then(|| LinearConfig::new(readings, READING_FEATURES).init(device));
        let inputs = seen + if readings > 0 { READING_FEATURES } else { 0 };
        Self {
            eye,
            readings: beside,
            gru: BiGruConfig::new(inputs, hidden, true).init(device),
            class: LinearConfig::new(2 * hidden, classes).init(device),
            modulus: LinearConfig::new(2 * hidden, 2).init(device),
        }
    }

    /// `picture` `[videos * frames, 3, height, width]`, `readings` `[videos, frames, count]` to `[videos, classes]` and
    /// `[videos, 2]`.
    pub fn forward(
        &self,
        picture: Option<Tensor<4>>,
        readings: Option<Tensor<3>>,
        [videos, frames]: [usize; 2],
    ) -> (Tensor<2>, Tensor<2>) {
        let seen = self.eye.as_ref().zip(picture).map(|(eye, picture)| {
            let rows = eye.forward(picture);
            let width = rows.dims()[1];
            rows.reshape([videos, frames, width])
        });
        let beside =
            self.readings.as_ref().zip(readings).map(|(linear, readings)| relu(linear.forward(readings)));
        let parts: Vec<Tensor<3>> = seen.into_iter().chain(beside).collect();
        let (states, _) = self.gru.forward(Tensor::cat(parts, 2), None);
        let first = frames.saturating_sub(LAST_FRAMES);
        let last: Tensor<2> = states.narrow(1, first, frames - first).mean_dim(1).squeeze_dim(1);
        (self.class.forward(last.clone()), self.modulus.forward(last))
    }
}
