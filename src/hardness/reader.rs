//! Frame by frame: a window of frames to class and modulus.

use std::path::Path;

use crate::error::ModelError;
use crate::metadata::{Class, Metadata};
use crate::network::Network;
use crate::onnx_read::read_onnx;
use crate::physics::Hardness;
use crate::picture::{FrameView, Shrinker, rest_profile};

/// Bytes of a model's file at most.
const MAX_FILE_BYTES: u64 = 300 << 20;
/// How far beyond the range that was trained with a modulus may be, in parts of the range.
const RANGE_MARGIN: f64 = 0.05;

/// Why no hardness is stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unsure {
    /// The distance of this number in [`Metadata::novelty_names`] is larger than what was trained with.
    Novel(usize),
    /// The reading of this number is out of the range that was trained with.
    Reading(usize),
    /// This number of the picture at rest is out of the range of the sensors that were trained with: 0 its level (light), else
    /// a block of it (lens, dome).
    Rest(usize),
    /// No class is probable enough, and the model states no modulus.
    Undecided,
    /// The modulus would be out of the range that was trained with.
    Modulus,
    /// The network's numbers are not finite.
    NotFinite,
    /// A frame's skin lay above its shape at rest: the frame at rest was touched.
    Raised,
    /// Contact mechanics has another class or modulus ([`HardnessReader::contradicts`]).
    ContradictsContactMechanics,
}

/// What was read from a window of frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HardnessEstimate {
    /// The most probable class, by its number.
    pub class: usize,
    /// Its calibrated probability.
    pub probability: f64,
    /// log10 of Young's modulus in MPa, where the model states one.
    pub log10_e_mpa: f64,
    /// Within these 90 of 100 lie.
    pub interval: [f64; 2],
}

/// A model, the last frames that it saw, and what the sensor looks like untouched.
#[derive(Debug, Clone)]
pub struct HardnessReader {
    metadata: Metadata,
    network: Network,
    shrinker: Shrinker,
    rest: Option<Vec<f32>>,
    foreign_rest: Option<usize>,
    picture: Vec<f32>,
    readings: Vec<f32>,
}

impl HardnessReader {
    /// Reads a model.
    ///
    /// # Errors
    /// [`ModelError`]: no model of ours, cut, too large, or of a kind that is not known.
    pub fn new(bytes: &[u8]) -> Result<Self, ModelError> {
        let graph = read_onnx(bytes)?;
        let network = Network::new(&graph)?;
        let metadata = Metadata::of(&graph, &network)?;
        let count = network.picture_dims().map_or(0, |dims| dims.iter().product());
        let readings = vec![0.0; metadata.readings.len()];
        let (shrinker, picture) = (Shrinker::default(), vec![0.0; count]);
        Ok(Self { metadata, network, shrinker, rest: None, foreign_rest: None, picture, readings })
    }

    /// Reads a model's file.
    ///
    /// # Errors
    /// As [`HardnessReader::new`]; or the file cannot be read.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let at = |problem: String| ModelError::new("the file", problem, "an ONNX file of a model");
        let length = std::fs::metadata(path).map_err(|e| at(e.to_string()))?.len();
        if length > MAX_FILE_BYTES {
            return Err(at(format!("has {length} bytes, of {MAX_FILE_BYTES} at most")));
        }
        Self::new(&std::fs::read(path).map_err(|e| at(e.to_string()))?)
    }

    /// What the model says of itself.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// The network within.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Whether it sees a picture, and so needs [`HardnessReader::set_rest`].
    pub fn sees_picture(&self) -> bool {
        self.network.picture_dims().is_some()
    }

    /// Sets the frame of the untouched sensor that pictures are compared with. False: it is not whole.
    pub fn set_rest(&mut self, frame: &FrameView<'_>) -> bool {
        let Some([_, height, width]) = self.network.picture_dims() else { return true };
        let mut rest = vec![0.0; self.picture.len()];
        let whole = self.shrinker.shrink(frame, [height, width], &mut rest);
        self.foreign_rest = self.metadata.foreign_rest(&rest_profile(&rest, [height, width]));
        self.rest = whole.then_some(rest);
        self.network.restart();
        whole
    }

    /// Forgets the frames, not the rest.
    pub fn restart(&mut self) {
        self.network.restart();
    }

    fn look(&mut self, frame: Option<&FrameView<'_>>) -> bool {
        let Some([_, height, width]) = self.network.picture_dims() else { return true };
        let (Some(frame), Some(rest)) = (frame, &self.rest) else { return false };
        if !self.shrinker.shrink(frame, [height, width], &mut self.picture) {
            return false;
        }
        self.picture.iter_mut().zip(rest).for_each(|(level, rest)| *level = (*level - rest) / 255.0);
        true
    }

    /// Takes the next frame in, and its readings in the order of [`Metadata::readings`]. None until the window is full. A
    /// frame or a reading that is missing (not finite) empties the window: it must be one stretch of good frames. After the
    /// first frame of a size nothing is allocated.
    pub fn push(
        &mut self,
        frame: Option<&FrameView<'_>>,
        readings: &[f64],
    ) -> Option<Result<HardnessEstimate, Unsure>> {
        let whole = readings.len() == self.readings.len();
        self.readings.iter_mut().zip(readings).for_each(|(to, value)| *to = *value as f32);
        if !whole || self.readings.iter().any(|value| !value.is_finite()) || !self.look(frame) {
            self.network.restart();
            return None;
        }
        self.network.push(&self.picture, &self.readings);
        self.network.run().then(|| self.judge(readings))
    }

    fn judge(&self, readings: &[f64]) -> Result<HardnessEstimate, Unsure> {
        let outside = |value: f64, [low, high]: [f64; 2]| {
            let margin = RANGE_MARGIN * (high - low);
            !(low - margin..=high + margin).contains(&value)
        };
        let numbers = |name: &str| self.network.output(name).unwrap_or(&[]);
        let all = ["probability", "log10_e", "novelty"].into_iter().flat_map(numbers);
        if all.clone().any(|value| !value.is_finite()) {
            return Err(Unsure::NotFinite);
        }
        if let Some(at) = self.foreign_rest {
            return Err(Unsure::Rest(at));
        }
        if let Some(at) =
            readings.iter().zip(&self.metadata.readings).position(|(value, r)| !r.allows(*value))
        {
            return Err(Unsure::Reading(at));
        }
        let novelty = numbers("novelty").iter().zip(&self.metadata.novelty_limits);
        if let Some(at) = novelty.into_iter().position(|(value, limit)| f64::from(*value) > *limit) {
            return Err(Unsure::Novel(at));
        }
        let (mut class, mut probability) = (0, 0.0);
        for (at, value) in numbers("probability").iter().enumerate() {
            if f64::from(*value) > probability {
                (class, probability) = (at, f64::from(*value));
            }
        }
        if self.metadata.is_undecided(probability) {
            return Err(Unsure::Undecided);
        }
        let log10_e_mpa = f64::from(numbers("log10_e")[0]);
        let half = self.metadata.interval_quantile * f64::from(numbers("log10_e")[1]).exp();
        if self.states_modulus() && outside(log10_e_mpa, self.metadata.log10_e_range) {
            return Err(Unsure::Modulus);
        }
        let interval = [log10_e_mpa - half, log10_e_mpa + half];
        if !half.is_finite() {
            return Err(Unsure::NotFinite);
        }
        Ok(HardnessEstimate { class, probability, log10_e_mpa, interval })
    }

    /// Whether the model states a modulus, or classes alone.
    pub fn states_modulus(&self) -> bool {
        self.metadata.interval_quantile > 0.0
    }

    /// A class of [`HardnessEstimate::class`].
    pub fn class(&self, class: usize) -> Option<&Class> {
        self.metadata.classes.get(class)
    }

    /// Whether contact mechanics says something else than the network: a modulus out of its interval where the model states one, else
    /// another class.
    pub fn contradicts(&self, found: &HardnessEstimate, by_contact: &Hardness) -> bool {
        if self.states_modulus() {
            let [low, high] = by_contact.interval;
            return found.interval[1] < low || high < found.interval[0];
        }
        let off = |class: &Class| Some((class.youngs_modulus_mpa?.log10() - by_contact.log10_young).abs());
        let others = self.metadata.classes.iter().filter_map(off);
        let nearest = others.fold(f64::INFINITY, f64::min);
        self.class(found.class).and_then(off).is_some_and(|own| own > nearest)
    }

    /// Why nothing is stated, in words.
    pub fn reason(&self, unsure: Unsure) -> String {
        let name = |at: usize| self.metadata.readings.get(at).map_or("", |reading| reading.name.as_str());
        match unsure {
            Unsure::Novel(at) => {
                let name = self.metadata.novelty_names.get(at).map_or("", String::as_str);
                format!("unlike_training_{name}")
            }
            Unsure::Reading(at) => format!("out_of_range_{}", name(at)),
            Unsure::Rest(0) => "out_of_range_light".into(),
            Unsure::Rest(_) => "unlike_training_rest".into(),
            Unsure::Undecided => "undecided".into(),
            Unsure::Modulus => "out_of_range_modulus".into(),
            Unsure::NotFinite => "not_finite".into(),
            Unsure::Raised => "raised".into(),
            Unsure::ContradictsContactMechanics => "contradicts_contact_mechanics".into(),
        }
    }
}
