//! What a model says of itself, beside its graph: the text `domecast_hardness` of the file's metadata, as JSON.

use serde::{Deserialize, Serialize};

use crate::error::ModelError;
use crate::graph::Graph;
use crate::network::Network;
use crate::picture::REST_NUMBERS;

/// The metadata's key in the ONNX file.
pub const METADATA_KEY: &str = "domecast_hardness";
const VERSION: u32 = 1;
/// What a class must have to be stated alone, as the intervals of a modulus hold nine of ten.
const MIN_PROBABILITY: f64 = 0.9;

/// A class that a model tells apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// Its name in the data set.
    pub name: String,
    /// The mean modulus of what was trained with, MPa, where it has one.
    pub youngs_modulus_mpa: Option<f64>,
}

/// A reading of a frame that a model sees beside the picture, or that must be as it was in the training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelReading {
    /// The column's name in the data set, with its unit.
    pub name: String,
    /// The smallest and largest value at the end of the windows that were trained with.
    pub range: [f64; 2],
}

impl ModelReading {
    /// Whether a value is near the range: a quarter of the range beyond it, but no nearer to zero than half of its end. A
    /// push that is never less than 0.4 N in the training is then not looked for below 0.2 N.
    pub fn allows(&self, value: f64) -> bool {
        let [low, high] = self.range;
        let margin = 0.25 * (high - low);
        let low = if low > 0.0 { (low - margin).max(0.5 * low) } else { low - margin };
        let high = if high < 0.0 { (high + margin).min(0.5 * high) } else { high + margin };
        (low..=high).contains(&value)
    }
}

/// The limits of what a model was trained on, and the scale of its errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metadata {
    /// Of this layout: 1.
    pub version: u32,
    /// In the order of the output `probability`.
    pub classes: Vec<Class>,
    /// In the order of the input `readings`, then those that are only held to their range.
    pub readings: Vec<ModelReading>,
    /// The smallest and largest of each number of [`rest_profile`](crate::rest_profile) of the sensors that were trained with;
    /// empty of a model that sees no picture.
    pub rest_ranges: Vec<[f64; 2]>,
    /// The smallest and largest log10 of the modulus in MPa that was trained with.
    pub log10_e_range: [f64; 2],
    /// Half of a 90 % interval in parts of the stated deviation, by split conformal calibration on videos that were not
    /// trained with. Zero: the model states no modulus.
    pub interval_quantile: f64,
    /// In the order of the output `novelty`, the largest squared distance from what was trained with that is not `unsure`.
    pub novelty_limits: Vec<f64>,
    /// Names of these distances.
    pub novelty_names: Vec<String>,
    /// What it was trained with, and how: for people.
    #[serde(default)]
    pub training: serde_json::Value,
}

impl Metadata {
    /// The metadata of a graph, checked against it.
    ///
    /// # Errors
    /// [`ModelError`]: missing, not as this version has it, or not fitting the network.
    pub fn of(graph: &Graph, network: &Network) -> Result<Self, ModelError> {
        let text = graph.metadata.iter().find(|(key, _)| key == METADATA_KEY).map(|(_, text)| text.as_str());
        let at = || format!("metadata \"{METADATA_KEY}\"");
        let text =
            text.ok_or_else(|| ModelError::new(at(), "is missing", "a model written by `domecast-learn`"))?;
        let metadata: Self = serde_json::from_str(text)
            .map_err(|e| ModelError::new(at(), e.to_string(), "JSON as `domecast-learn` writes it"))?;
        metadata.check(network)?;
        Ok(metadata)
    }

    /// Whether a model of classes alone has none to state: the likeliest is less probable than 0.9.
    pub fn is_undecided(&self, probability: f64) -> bool {
        self.interval_quantile == 0.0 && probability < MIN_PROBABILITY
    }

    /// The first number of a picture at rest that is beyond those of the training: the light, which differs from video to video, by a
    /// twentieth of their range; its form, of which a few sensors do not show all that their tolerances allow, by half of it; either by a
    /// fiftieth of the largest in any case.
    pub fn foreign_rest(&self, profile: &[f64]) -> Option<usize> {
        let mut ranges = self.rest_ranges.iter().zip(profile).enumerate();
        ranges.find_map(|(at, ([low, high], value))| {
            let part = if at == 0 { 0.05 } else { 0.5 };
            let margin = (part * (high - low)).max(0.02 * high.abs());
            (!(low - margin..=high + margin).contains(value)).then_some(at)
        })
    }

    /// Adds the metadata to a graph.
    pub fn write_to(&self, graph: &mut Graph) {
        graph.metadata.retain(|(key, _)| key != METADATA_KEY);
        // numbers and texts always have a JSON
        graph.metadata.push((METADATA_KEY.into(), serde_json::json!(self).to_string()));
    }

    fn check(&self, network: &Network) -> Result<(), ModelError> {
        let fault = |member: &str, problem: String, allowed: &str| {
            Err(ModelError::new(format!("metadata \"{METADATA_KEY}\": {member}"), problem, allowed))
        };
        let width = |name: &str| network.output(name).map_or(0, <[f32]>::len);
        if self.version != VERSION {
            return fault("version", format!("is {}", self.version), "1");
        }
        let rest_count = network.picture_dims().map_or(0, |_| REST_NUMBERS);
        if self.readings.len() < network.readings_count() {
            return fault(
                "readings",
                format!("has {}", self.readings.len()),
                "one for each number of `readings`",
            );
        }
        let of_network = [
            ("classes", self.classes.len(), width("probability"), "one for each number of `probability`"),
            ("log10_e", 2, width("log10_e"), "an output `log10_e` of mean and ln deviation"),
            (
                "rest_ranges",
                self.rest_ranges.len(),
                rest_count,
                "as many as a profile has, none without a picture",
            ),
            (
                "novelty_limits",
                self.novelty_limits.len(),
                width("novelty"),
                "one for each number of `novelty`",
            ),
            ("novelty_names", self.novelty_names.len(), width("novelty"), "one for each number of `novelty`"),
        ];
        for (member, count, wanted, allowed) in of_network {
            if count != wanted || (count == 0 && member != "rest_ranges") {
                return fault(member, format!("has {count}, the network {wanted}"), allowed);
            }
        }
        if network.picture_dims().is_some_and(|[channels, ..]| channels != 3) {
            return fault("picture", "has other than 3 channels".into(), "3");
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let ranges = self.readings.iter().map(|r| r.range).chain([self.log10_e_range]);
        let ranges = ranges.chain(self.rest_ranges.iter().copied());
        if ranges.clone().any(|range| !finite(&range) || range[0] > range[1]) {
            return fault(
                "range",
                "is not finite or runs backwards".into(),
                "the smallest value, then the largest",
            );
        }
        let positive = |values: &[f64]| finite(values) && values.iter().all(|value| *value >= 0.0);
        if !positive(&self.novelty_limits) || !positive(&[self.interval_quantile]) {
            return fault("limits", "are negative or not finite".into(), "numbers from 0 on");
        }
        Ok(())
    }
}
