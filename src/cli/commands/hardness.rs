//! `domecast hardness DATASET`

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use super::output::{Failure, Output};
use domecast_dataset::physics::{Hardness, Prior, hardness};
use domecast_dataset::{INDEX_NAME, StoredSet};
use domecast_design::DesignError;
use domecast_files::StagedFile;

/// Two classes may be of any modulus within this factor of theirs.
const BEYOND_CLASSES: f64 = 3.0;
/// Noise of a hand's travel where the set says none, mm.
const USUAL_TRAVEL_SD_MM: f64 = 0.02;

/// What came of a split.
#[derive(Default)]
struct Tally {
    videos: u32,
    square: f64,
    truth: Vec<f64>,
    within: u32,
    right: u32,
    classed: u32,
    by_status: BTreeMap<&'static str, u32>,
}

impl Tally {
    fn to_json(&self) -> Value {
        let count = f64::from(self.videos.max(1));
        let mean = self.truth.iter().sum::<f64>() / count;
        let spread: f64 = self.truth.iter().map(|truth| (truth - mean).powi(2)).sum();
        json!({
            "videos": self.videos,
            "rms_log10": (self.square / count).sqrt(),
            "r2": (spread > 0.0).then(|| 1.0 - self.square / spread),
            "interval_90_holds": f64::from(self.within) / count,
            "class_right": (self.classed > 0).then(|| f64::from(self.right) / f64::from(self.classed)),
            "status": self.by_status,
        })
    }
}

/// Judges every video of the set that is there.
pub fn run(output: &Output, folder: &Path, out: Option<&Path>) -> Result<(), Failure> {
    let set = StoredSet::open(folder)?;
    let in_index = |field: &str, problem: &str| {
        DesignError::at(field, "", problem, "what `domecast dataset` writes")
            .in_file(&folder.join(INDEX_NAME))
    };
    let dome = set.dome().ok_or_else(|| in_index("dome", "a number of the dome is missing"))?;
    let (prior, border) =
        prior(&set.index).ok_or_else(|| in_index("spec.hardness", "no range of hardness"))?;
    let mut staged =
        out.map(|path| StagedFile::new(path, "hardness", &output.rules(&[folder]))).transpose()?;
    let mut splits: BTreeMap<String, Tally> = BTreeMap::new();
    let mut lines = String::new();
    set.each(&mut |video| {
        let found = hardness(&video.rows, &dome, &prior);
        let text = |key: &str| video.label.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
        let truth = video.label.get("log10_youngs_modulus_mpa").and_then(Value::as_f64);
        let label = video.label.get("label").and_then(Value::as_u64);
        let class = border.map(|border| u64::from(found.log10_young > border));
        add(splits.entry(text("split")).or_default(), &found, truth, class.zip(label));
        let line = json!({
            "key": text("key"),
            "log10_youngs_modulus_mpa": found.log10_young,
            "interval_90": found.interval,
            "label": class,
            "status": found.status.as_str(),
        });
        lines += &format!("{line}\n");
    })?;
    if let Some(mut staged) = staged.take() {
        staged.write(lines.as_bytes())?;
        output.kept(staged.commit()?);
    }
    let splits: BTreeMap<String, Value> =
        splits.iter().map(|(split, tally)| (split.clone(), tally.to_json())).collect();
    for (split, tally) in &splits {
        output.say(&format!("{split}: {tally}"))?;
    }
    output.result(&json!({ "ok": true, "splits": splits }))
}

fn add(tally: &mut Tally, found: &Hardness, truth: Option<f64>, class: Option<(u64, u64)>) {
    let Some(truth) = truth else { return };
    let [low, high] = found.interval;
    tally.videos += 1;
    tally.square += (found.log10_young - truth).powi(2);
    tally.truth.push(truth);
    tally.within += u32::from((low..=high).contains(&truth));
    if let Some((said, label)) = class {
        tally.classed += 1;
        tally.right += u32::from(said == label);
    }
    *tally.by_status.entry(found.status.as_str()).or_insert(0) += 1;
}

/// What is known before, and for two classes the border between them.
fn prior(index: &Value) -> Option<(Prior, Option<f64>)> {
    let number = |path: &str| index.pointer(path).and_then(Value::as_f64);
    let poisson = 0.5 * (number("/spec/poisson/0")? + number("/spec/poisson/1")?);
    let travel_sd_mm = number("/spec/readings/robot_travel_sd_mm").unwrap_or(USUAL_TRAVEL_SD_MM);
    let range = number("/label_range_mpa/0").zip(number("/label_range_mpa/1"));
    if let Some((low, high)) = range {
        return Some((Prior { young_mpa: [low, high], poisson, travel_sd_mm }, None));
    }
    let class = |k: usize| number(&format!("/spec/hardness/classes/{k}/young_mpa"));
    let (one, other) = (class(0)?, class(1)?);
    let young_mpa = [one.min(other) / BEYOND_CLASSES, one.max(other) * BEYOND_CLASSES];
    Some((Prior { young_mpa, poisson, travel_sd_mm }, Some(0.5 * (one.log10() + other.log10()))))
}
