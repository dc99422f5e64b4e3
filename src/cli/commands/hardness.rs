//! `domecast hardness DATASET`

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use super::output::{Failure, Output};
use domecast_dataset::{INDEX_NAME, StoredSet};
use domecast_design::DesignError;
use domecast_files::StagedFile;
use domecast_hardness::PRESS_COLUMNS;
use domecast_hardness::physics::{Dome, Hardness, PressRow, Prior, hardness};

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
    let dome = Dome::of_set(&set.index).ok_or_else(|| in_index("dome", "a number of the dome is missing"))?;
    let prior = Prior::of_set(&set.index).ok_or_else(|| in_index("spec.hardness", "no range of hardness"))?;
    let border = border(&set.index);
    let mut staged =
        out.map(|path| StagedFile::new(path, "hardness", &output.rules(&[folder]))).transpose()?;
    let mut splits: BTreeMap<String, Tally> = BTreeMap::new();
    let mut lines = String::new();
    set.each(&mut |video| {
        let rows: Vec<PressRow> = video.rows.iter().map(|row| PRESS_COLUMNS.map(|at| row[at])).collect();
        let found = hardness(&rows, &dome, &prior);
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

/// The border between two classes, log10 of MPa.
fn border(index: &Value) -> Option<f64> {
    let class =
        |k: usize| index.pointer(&format!("/spec/hardness/classes/{k}/young_mpa")).and_then(Value::as_f64);
    Some(0.5 * (class(0)?.log10() + class(1)?.log10()))
}
