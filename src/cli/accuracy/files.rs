//! The files of a measurement.

use std::fmt::Write as _;

use super::chart::Chart;
use super::{Accuracy, page};

/// One file, by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AccuracyFile {
    /// Its name.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

impl Accuracy {
    /// `accuracy.json`, `accuracy.csv`, a picture of each ladder as SVG and PNG, and the page.
    pub fn files(&self) -> Vec<AccuracyFile> {
        let mut files = Vec::new();
        let mut add = |name: String, bytes: Vec<u8>| files.push(AccuracyFile { name, bytes });
        // numbers, strings and lists only: nothing here can fail to be written
        let mut json = serde_json::to_string_pretty(self).unwrap_or_default();
        json.push('\n');
        add("accuracy.json".into(), json.into_bytes());
        add("accuracy.csv".into(), self.csv().into_bytes());
        for ladder in &self.ladders {
            let Some(chart) = Chart::of(ladder) else { continue };
            add(format!("{}.svg", ladder.name), chart.to_svg().into_bytes());
            if let Some(png) = chart.to_png() {
                add(format!("{}.png", ladder.name), png);
            }
        }
        add("index.html".into(), page::page(self).into_bytes());
        files
    }

    /// A row for each rung.
    pub fn csv(&self) -> String {
        let mut text = String::from(
            "ladder,rung,way,label,dial,max_error,rms_error,unit,median_s,lower_quartile_s,upper_quartile_s,runs,\
             per_item_s,item,dominated,in_use,meets\n",
        );
        for ladder in &self.ladders {
            for (index, rung) in ladder.rungs.iter().enumerate() {
                let time = &rung.time;
                // labels hold commas
                let _ = writeln!(
                    text,
                    "{},{index},{},\"{}\",{},{:e},{:e},{},{:e},{:e},{:e},{},{:e},{},{},{},{}",
                    ladder.name,
                    rung.way,
                    rung.label,
                    rung.dial,
                    rung.max_error,
                    rung.rms_error,
                    ladder.unit,
                    time.median_s,
                    time.lower_quartile_s,
                    time.upper_quartile_s,
                    time.runs,
                    rung.per_item_s,
                    ladder.item,
                    rung.dominated,
                    ladder.in_use == Some(index),
                    ladder.meets == Some(index),
                );
            }
        }
        text
    }
}
