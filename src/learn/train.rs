//! Fits the weights.

use std::path::{Path, PathBuf};
use std::time::Instant;

use burn::grad_clipping::GradientClippingConfig;
use burn::module::Module;
use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer, SgdConfig};
use burn::store::ModuleRecord;
#[cfg(feature = "gpu")]
use burn::tensor::DeviceKind;
use burn::tensor::activation::log_softmax;
use burn::tensor::{Bytes, Device, Tensor, TensorData};
use domecast_files::{OutputRules, StagedFolder};
use serde::{Deserialize, Serialize};

use crate::data::{DataSet, LEVEL_PARTS, Split, Video};
use crate::export::{Scales, graph};
use crate::judge::{outputs, score};
use crate::net::Net;
use crate::options::{Leak, Options};
use crate::tar::Problem;

/// Files of a checkpoint.
const NET: &str = "net.bpk";
const OPTIMIZER: &str = "optimizer.bpk";
const STATE: &str = "state.json";
/// Part of the steps in which the rate rises.
const WARM_UP: f64 = 0.1;
/// The last rate in parts of the largest.
const LAST_RATE: f64 = 0.02;
/// The norm that a step's gradient is cut to.
const MAX_GRADIENT: f32 = 1.0;
const WEIGHT_DECAY: f32 = 0.01;

/// One pass over the training videos.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Epoch {
    /// From 1.
    pub epoch: usize,
    /// Mean of the steps.
    pub train_loss: f64,
    /// Of the videos for calibration.
    pub val_accuracy: f64,
    /// Cross entropy there.
    pub val_log_loss: f64,
    /// Root mean square error of log10 of the modulus there.
    pub val_rmse_log10: f64,
    /// Time that it took, s.
    pub seconds: f64,
}

/// What a checkpoint says of itself.
#[derive(Debug, Serialize, Deserialize)]
struct State {
    of: String,
    curve: Vec<Epoch>,
}

/// A small generator of which the same seed gives the same numbers everywhere (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn shuffle<T>(&mut self, list: &mut [T]) {
        for at in (1..list.len()).rev() {
            list.swap(at, (self.next() % (at as u64 + 1)) as usize);
        }
    }
}

fn mean_and_deviation(values: impl Iterator<Item = f32> + Clone) -> [f32; 2] {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().map(f64::from).sum::<f64>() / count;
    let variance = values.map(|value| (f64::from(value) - mean).powi(2)).sum::<f64>() / count;
    [mean as f32, (variance.sqrt() as f32).max(1e-6)]
}

/// The scales of the training videos.
pub fn scales_of(set: &DataSet) -> Scales {
    let train = set.part(Split::Train);
    let (count, seen) = (set.readings.len(), set.seen);
    let column = |at: usize| {
        train.iter().flat_map(move |video| video.readings.iter().skip(at).step_by(count).copied())
    };
    Scales {
        window: set.frames,
        picture: set.picture,
        readings: (0..seen).map(|at| mean_and_deviation(column(at))).collect(),
        log10_e: mean_and_deviation(train.iter().map(|video| video.log10_e)),
        temperature: 1.0,
    }
}

/// Some videos as tensors.
struct Batch {
    picture: Option<Tensor<4>>,
    readings: Option<Tensor<3>>,
    classes: Tensor<2>,
    log10_e: Tensor<2>,
    sides: [usize; 2],
}

impl Batch {
    fn new(set: &DataSet, videos: &[(&Video, usize)], scales: &Scales, device: &Device) -> Self {
        let sides = [videos.len(), set.frames];
        let frames = sides[0] * sides[1];
        let picture = set.picture.map(|[height, width]| {
            let levels = videos.iter().flat_map(|(video, _)| &video.picture);
            let values: Vec<f32> = levels.map(|level| f32::from(*level) / (LEVEL_PARTS * 255.0)).collect();
            let picture: Tensor<4> =
                Tensor::from_data(TensorData::new(values, [frames, height, width, 3]), device);
            picture.permute([0, 3, 1, 2])
        });
        let count = set.seen;
        let readings = (count > 0).then(|| {
            let rows = videos.iter().flat_map(|(video, _)| video.readings.chunks_exact(set.readings.len()));
            let table = rows.flat_map(|row| row.iter().zip(&scales.readings));
            let values: Vec<f32> =
                table.map(|(value, [mean, deviation])| (value - mean) / deviation).collect();
            Tensor::from_data(TensorData::new(values, [sides[0], sides[1], count]), device)
        });
        let mut classes = vec![0.0_f32; sides[0] * set.classes.len()];
        videos.iter().enumerate().for_each(|(at, (_, label))| classes[at * set.classes.len() + label] = 1.0);
        let [middle, deviation] = scales.log10_e;
        let log10_e: Vec<f32> =
            videos.iter().map(|(video, _)| (video.log10_e - middle) / deviation).collect();
        Self {
            picture,
            readings,
            classes: Tensor::from_data(TensorData::new(classes, [sides[0], set.classes.len()]), device),
            log10_e: Tensor::from_data(TensorData::new(log10_e, [sides[0], 1]), device),
            sides,
        }
    }
}

/// Cross entropy, and where the set has a range of moduli the negative log likelihood of a normal error.
fn loss(net: &Net, batch: Batch, states_modulus: bool) -> Tensor<1> {
    let (classes, modulus) = net.forward(batch.picture, batch.readings, batch.sides);
    let entropy = (log_softmax(classes, 1) * batch.classes).sum().neg() / batch.sides[0] as f32;
    if !states_modulus {
        return entropy;
    }
    let (mean, ln_deviation) = (modulus.clone().narrow(1, 0, 1), modulus.narrow(1, 1, 1));
    let parts = (batch.log10_e - mean) * ln_deviation.clone().neg().exp();
    entropy + (parts.clone() * parts * 0.5 + ln_deviation).mean()
}

/// The rate of a step.
fn rate(options: &Options, step: usize, steps: usize) -> f64 {
    if options.sgd {
        return options.rate;
    }
    let at = (step as f64 + 0.5) / steps as f64;
    let falling = 0.5 * (1.0 + (std::f64::consts::PI * (at - WARM_UP).max(0.0) / (1.0 - WARM_UP)).cos());
    options.rate * (at / WARM_UP).min(1.0) * (LAST_RATE + (1.0 - LAST_RATE) * falling)
}

/// What multiplies.
fn device(options: &Options) -> Device {
    #[cfg(feature = "gpu")]
    if options.gpu {
        return Device::wgpu(DeviceKind::DefaultDevice);
    }
    debug_assert!(!options.gpu, "refused with the arguments");
    Device::flex()
}

/// Weights, the optimizer's state, and how far they are.
struct Trainer<'a> {
    set: &'a DataSet,
    options: &'a Options,
    scales: &'a Scales,
    device: Device,
    net: Net,
    optimizer: ModuleOptimizer,
    curve: Vec<Epoch>,
}

impl<'a> Trainer<'a> {
    fn new(set: &'a DataSet, options: &'a Options, scales: &'a Scales) -> Self {
        let device = device(options);
        device.seed(options.seed);
        let device = device.autodiff();
        let net = Net::new(options.paper, set.picture.is_some(), set.seen, set.classes.len(), &device);
        let optimizer = if options.sgd {
            SgdConfig::new().init()
        } else {
            let clipping = Some(GradientClippingConfig::Norm(MAX_GRADIENT));
            AdamWConfig::new().with_weight_decay(WEIGHT_DECAY).with_grad_clipping(clipping).init()
        };
        Self { set, options, scales, device, net, optimizer, curve: Vec::new() }
    }

    fn checkpoint(&self) -> PathBuf {
        let mut name = self.options.out.as_os_str().to_os_string();
        name.push(".checkpoint");
        name.into()
    }

    /// Only a run of the same set and settings goes on from a checkpoint.
    fn fingerprint(&self) -> String {
        let o = self.options;
        format!(
            "set {} of {} videos {:?}; readings {}; paper {}; picture {:?}; epochs {}; batch {}; rate {}; sgd {}; gpu {}; seed {}; leak {:?}",
            self.set.name,
            self.set.videos.len(),
            [Split::Train, Split::Val, Split::Test].map(|split| self.set.part(split).len()),
            self.set.readings[..self.set.seen].join(" "),
            o.paper,
            self.set.picture,
            o.epochs,
            o.batch,
            o.rate,
            o.sgd,
            o.gpu,
            o.seed,
            o.leak
        )
    }

    /// Writes a checkpoint and goes on from its bytes, as a run that was stopped does: what a checkpoint does not keep to the bit
    /// then has no part in an uninterrupted run either, and both end with the same weights.
    fn save(&mut self) -> Result<(), Problem> {
        let rules = OutputRules::default();
        let folder = StagedFolder::new(&self.checkpoint(), "learn", &rules).map_err(|e| e.to_string())?;
        let fault = |e: &dyn std::fmt::Debug| format!("the weights cannot be written: {e:?}");
        let net = self.net.clone().into_record().into_bytes().map_err(|e| fault(&e))?.to_vec();
        let optimizer = self.optimizer.into_bytes().map_err(|e| fault(&e))?.to_vec();
        let state = State { of: self.fingerprint(), curve: self.curve.clone() };
        let text = serde_json::to_string_pretty(&state).map_err(|e| e.to_string())?;
        for (name, bytes) in [(NET, &net[..]), (OPTIMIZER, &optimizer), (STATE, text.as_bytes())] {
            folder.write(name, bytes).map_err(|e| e.to_string())?;
        }
        folder.commit().map_err(|e| e.to_string())?;
        self.take(net, optimizer)
    }

    /// Weights and the optimizer's state from bytes. From files they would be read piece by piece when they are first needed, by
    /// then perhaps from another checkpoint.
    fn take(&mut self, net: Vec<u8>, optimizer: Vec<u8>) -> Result<(), Problem> {
        let fault = |e: &dyn std::fmt::Debug| format!("a checkpoint that is not whole: {e:?}");
        let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(net)).map_err(|e| fault(&e))?;
        self.net = self.net.clone().try_load_record(record).map_err(|e| fault(&e))?;
        let fresh = std::mem::replace(&mut self.optimizer, SgdConfig::new().init());
        self.optimizer = fresh.from_bytes(Bytes::from_bytes_vec(optimizer)).map_err(|e| fault(&e))?;
        Ok(())
    }

    /// Goes on from the checkpoint.
    fn resume(&mut self) -> Result<(), Problem> {
        let folder = self.checkpoint();
        let fault = |e: &dyn std::fmt::Debug| {
            format!("{}: {e:?}; leave --resume out to begin anew", folder.display())
        };
        let text = std::fs::read_to_string(folder.join(STATE)).map_err(|e| fault(&e))?;
        let state: State = serde_json::from_str(&text).map_err(|e| fault(&e))?;
        if state.of != self.fingerprint() {
            let problem =
                format!("is of another run:\n  {}\nthan this one:\n  {}", state.of, self.fingerprint());
            return Err(format!("{}: {problem}", folder.display()));
        }
        let bytes = |name: &str| std::fs::read(folder.join(name)).map_err(|e| fault(&e));
        self.take(bytes(NET)?, bytes(OPTIMIZER)?).map_err(|e| fault(&e))?;
        self.curve = state.curve;
        Ok(())
    }

    /// The training videos with their labels, in this epoch's order.
    fn order(&self, epoch: usize) -> Vec<(&'a Video, usize)> {
        let train = self.set.part(Split::Train);
        let mut labels: Vec<usize> = train.iter().map(|video| video.label).collect();
        if self.options.leak == Leak::Shuffled {
            Random(self.options.seed ^ 0x5eed).shuffle(&mut labels);
        }
        let mut order: Vec<_> = train.into_iter().zip(labels).collect();
        Random(self.options.seed.wrapping_mul(1_000_003).wrapping_add(epoch as u64)).shuffle(&mut order);
        order
    }

    fn epoch(&mut self, epoch: usize) -> Epoch {
        let began = Instant::now();
        let order = self.order(epoch);
        let per_epoch = order.len().div_ceil(self.options.batch);
        let (steps, mut sum) = (per_epoch * self.options.epochs, 0.0);
        for (at, videos) in order.chunks(self.options.batch).enumerate() {
            // a normalisation needs more than one video
            if videos.len() < 2 && at > 0 {
                continue;
            }
            let batch = Batch::new(self.set, videos, self.scales, &self.device);
            let loss = loss(&self.net, batch, !self.set.own_classes);
            let step = (epoch - 1) * per_epoch + at;
            let gradients = GradientsParams::from_grads(loss.backward(), &self.net);
            let rate = rate(self.options, step, steps);
            self.net = self.optimizer.step(rate, self.net.clone(), gradients);
            sum += f64::from(loss.into_scalar::<f32>()) * videos.len() as f64;
        }
        let val = self.set.part(Split::Val);
        let score =
            outputs(&graph(&self.net, self.scales, &[]), self.set, &val).map(|rows| score(&rows, &val));
        let score = score.unwrap_or_default();
        Epoch {
            epoch,
            train_loss: sum / order.len() as f64,
            val_accuracy: score.accuracy,
            val_log_loss: score.log_loss,
            val_rmse_log10: score.rmse_log10,
            seconds: began.elapsed().as_secs_f64(),
        }
    }
}

/// Trains; the network is missing where the run was to stop before its end.
///
/// # Errors
/// A checkpoint cannot be written or read, or the loss is not finite any more.
pub fn train(
    set: &DataSet,
    options: &Options,
    scales: &Scales,
) -> Result<(Option<Net>, Vec<Epoch>), Problem> {
    let mut trainer = Trainer::new(set, options, scales);
    if options.resume {
        trainer.resume()?;
    }
    let first = trainer.curve.len() + 1;
    for epoch in first..=options.epochs {
        let row = trainer.epoch(epoch);
        if !row.train_loss.is_finite() {
            return Err(format!("epoch {epoch}: the loss is not finite; a smaller --rate may cure it"));
        }
        if !options.quiet {
            let left = row.seconds * (options.epochs - epoch) as f64 / 60.0;
            eprintln!(
                "epoch {epoch} of {}: loss {:.4}, calibration set {:.1} % right, log loss {:.3}, rmse {:.3}; {:.0} s, {left:.1} min left",
                options.epochs,
                row.train_loss,
                100.0 * row.val_accuracy,
                row.val_log_loss,
                row.val_rmse_log10,
                row.seconds
            );
        }
        trainer.curve.push(row);
        let stops =
            options.stop_after.is_some_and(|count| epoch + 1 - first >= count) && epoch < options.epochs;
        trainer.save()?;
        if stops {
            return Ok((None, trainer.curve));
        }
    }
    let checkpoint = trainer.checkpoint();
    remove(&checkpoint)?;
    Ok((Some(trainer.net), trainer.curve))
}

/// The checkpoint of a run that has come to its end.
fn remove(folder: &Path) -> Result<(), Problem> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(format!("{}: {e}", folder.display())),
        _ => Ok(()),
    }
}
