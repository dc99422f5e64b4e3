//! The files of a measurement.

use std::fmt::Write as _;

use super::page::page;
use super::result::Accuracy;
use super::sweep_chart::sweep_chart;

/// Name and content of each file: `accuracy.json`, `accuracy.csv`, a picture of each sweep as SVG and PNG, the page.
pub fn accuracy_files(accuracy: &Accuracy) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut add = |name: String, bytes: Vec<u8>| files.push((name, bytes));
    // numbers, strings and lists only: nothing here can fail to be written
    let mut json = serde_json::to_string_pretty(accuracy).unwrap_or_default();
    json.push('\n');
    add("accuracy.json".into(), json.into_bytes());
    add("accuracy.csv".into(), csv(accuracy).into_bytes());
    for sweep in &accuracy.sweeps {
        let Some(chart) = sweep_chart(sweep) else { continue };
        add(format!("{}.svg", sweep.name), chart.to_svg().into_bytes());
        if let Some(png) = chart.to_png() {
            add(format!("{}.png", sweep.name), png);
        }
    }
    add("index.html".into(), page(accuracy).into_bytes());
    files
}

/// A row for each sample.
pub fn csv(accuracy: &Accuracy) -> String {
    let mut text = String::from(
        "sweep,sample,method,label,setting,max_error,rms_error,unit,median_s,lower_quartile_s,upper_quartile_s,runs,\
         per_item_s,item,dominated,in_use,meets\n",
    );
    for sweep in &accuracy.sweeps {
        for (index, sample) in sweep.samples.iter().enumerate() {
            let time = &sample.time;
            // labels hold commas
            let _ = writeln!(
                text,
                "{},{index},{},\"{}\",{},{:e},{:e},{},{:e},{:e},{:e},{},{:e},{},{},{},{}",
                sweep.name,
                sample.method,
                sample.label,
                sample.setting,
                sample.max_error,
                sample.rms_error,
                sweep.unit,
                time.median_s,
                time.lower_quartile_s,
                time.upper_quartile_s,
                time.runs,
                sample.per_item_s,
                sweep.item,
                sample.dominated,
                sweep.in_use == Some(index),
                sweep.meets == Some(index),
            );
        }
    }
    text
}
