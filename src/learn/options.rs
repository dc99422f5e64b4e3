//! The program's arguments.

use std::path::PathBuf;

use crate::tar::Problem;

/// What is said by `--help`.
pub const USAGE: &str = "\
Trains a network that reads hardness from touch, on a data set of `domecast dataset`, and writes it as ONNX.

usage: domecast-learn DATASET --out DIR [OPTIONS]

  --net small|paper     small residual network (default), or the paper's ResNet-18; a bidirectional GRU behind either
  --inputs LIST         of picture, dots, wrench, travel, physics, separated by commas (default: the first three, which `track` has;
                        paper: picture); travel is the robot hand's, physics the modulus by contact mechanics, which needs it
  --width N             width of the picture, pixels, 16 to 512 (default 64)
  --epochs N            (default 20)
  --batch N             videos of a step (default 16)
  --rate X              largest learning rate (default 0.002; paper: 0.001)
  --optimizer NAME      adamw, with a cosine of the rate, or sgd at one rate, as the paper (default: as the network's)
  --device NAME         cpu (default), or gpu: a graphics card, in a build with `--features gpu`; there two runs differ in the last bits
  --seed N              of weights and order (default 1)
  --max-videos N        read the first N videos only
  --leak CHECK          before-contact or shuffled: a network that must fail
  --resume              go on from the checkpoint in DIR
  --stop-after N        end after N epochs of this run, with a checkpoint
  --quiet               no progress";

/// A check that a network has nothing to learn from what it should not see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Leak {
    /// None: learn.
    No,
    /// Only frames before contact are shown.
    BeforeContact,
    /// Labels of the training videos are shuffled.
    Shuffled,
}

/// What is asked for.
#[derive(Debug, Clone)]
pub(crate) struct Options {
    /// The folder of the data set.
    pub dataset: PathBuf,
    /// The folder of the results.
    pub out: PathBuf,
    /// The paper's network.
    pub paper: bool,
    /// Whether pictures are seen.
    pub picture: bool,
    /// Whether the dots' readings are seen.
    pub dots: bool,
    /// Whether wrench and motion are seen.
    pub wrench: bool,
    /// Whether the robot hand's travel is seen.
    pub travel: bool,
    /// Whether the modulus by contact mechanics is seen.
    pub physics: bool,
    /// Of the picture, pixels.
    pub width: usize,
    /// Passes over the training videos.
    pub epochs: usize,
    /// Videos of a step.
    pub batch: usize,
    /// Largest learning rate.
    pub rate: f64,
    /// Plain gradient descent at one rate instead of AdamW.
    pub sgd: bool,
    /// On a graphics card.
    pub gpu: bool,
    /// Of weights and order.
    pub seed: u64,
    /// Videos at most.
    pub max_videos: Option<usize>,
    /// A check instead of learning.
    pub leak: Leak,
    /// From the checkpoint.
    pub resume: bool,
    /// Epochs of this run at most.
    pub stop_after: Option<usize>,
    /// No progress.
    pub quiet: bool,
}

fn number<T: std::str::FromStr + PartialOrd + std::fmt::Display>(
    name: &str,
    text: &str,
    [low, high]: [T; 2],
) -> Result<T, Problem> {
    let value = text.parse().ok().filter(|value| *value >= low && *value <= high);
    value.ok_or_else(|| format!("{name} {text}: allowed: {low} to {high}"))
}

impl Options {
    fn inputs(&mut self, list: &str) -> Result<(), Problem> {
        (self.picture, self.dots, self.wrench, self.travel, self.physics) =
            (false, false, false, false, false);
        for name in list.split(',') {
            match name.trim() {
                "picture" => self.picture = true,
                "dots" => self.dots = true,
                "wrench" => self.wrench = true,
                "travel" => self.travel = true,
                "physics" => self.physics = true,
                other => {
                    return Err(format!("--inputs {other}: allowed: picture, dots, wrench, travel, physics"));
                }
            }
        }
        Ok(())
    }

    /// Reads the arguments.
    ///
    /// # Errors
    /// The first that is not allowed, and what is.
    pub fn parse(arguments: &[String]) -> Result<Self, Problem> {
        let mut options = Self {
            dataset: PathBuf::new(),
            out: PathBuf::new(),
            paper: false,
            picture: true,
            dots: true,
            wrench: true,
            travel: false,
            physics: false,
            width: 64,
            epochs: 20,
            batch: 16,
            rate: 0.0,
            sgd: false,
            gpu: false,
            seed: 1,
            max_videos: None,
            leak: Leak::No,
            resume: false,
            stop_after: None,
            quiet: false,
        };
        let (mut inputs, mut sgd) = (None, None);
        let mut left = arguments.iter();
        while let Some(name) = left.next() {
            let mut value = || left.next().cloned().ok_or_else(|| format!("{name} needs a value"));
            match name.as_str() {
                "--out" => options.out = value()?.into(),
                "--net" => match value()?.as_str() {
                    "small" => options.paper = false,
                    "paper" => options.paper = true,
                    other => return Err(format!("--net {other}: allowed: small, paper")),
                },
                "--inputs" => inputs = Some(value()?),
                "--width" => options.width = number(name, &value()?, [16, 512])?,
                "--epochs" => options.epochs = number(name, &value()?, [1, 10_000])?,
                "--batch" => options.batch = number(name, &value()?, [2, 1024])?,
                "--rate" => options.rate = number(name, &value()?, [1e-6, 1.0])?,
                "--optimizer" => match value()?.as_str() {
                    "adamw" => sgd = Some(false),
                    "sgd" => sgd = Some(true),
                    other => return Err(format!("--optimizer {other}: allowed: adamw, sgd")),
                },
                "--device" => match value()?.as_str() {
                    "cpu" => options.gpu = false,
                    "gpu" if cfg!(feature = "gpu") => options.gpu = true,
                    "gpu" => return Err("--device gpu: this build knows none; build with `--features gpu`".into()),
                    other => return Err(format!("--device {other}: allowed: cpu, gpu")),
                },
                "--seed" => options.seed = number(name, &value()?, [0, u64::MAX])?,
                "--max-videos" => options.max_videos = Some(number(name, &value()?, [16, usize::MAX])?),
                "--stop-after" => options.stop_after = Some(number(name, &value()?, [1, 10_000])?),
                "--leak" => match value()?.as_str() {
                    "before-contact" => options.leak = Leak::BeforeContact,
                    "shuffled" => options.leak = Leak::Shuffled,
                    other => return Err(format!("--leak {other}: allowed: before-contact, shuffled")),
                },
                "--resume" => options.resume = true,
                "--quiet" => options.quiet = true,
                other if !other.starts_with('-') && options.dataset.as_os_str().is_empty() => {
                    options.dataset = other.into();
                }
                other => return Err(format!("{other} is not known; --help lists what is")),
            }
        }
        if options.dataset.as_os_str().is_empty() || options.out.as_os_str().is_empty() {
            return Err("needs DATASET and --out DIR; --help says more".into());
        }
        if options.paper {
            (options.dots, options.wrench) = (false, false);
        }
        options.sgd = sgd.unwrap_or(options.paper);
        if options.rate == 0.0 {
            options.rate = if options.sgd { 0.001 } else { 0.002 };
        }
        inputs.map_or(Ok(()), |list| options.inputs(&list))?;
        Ok(options)
    }
}
