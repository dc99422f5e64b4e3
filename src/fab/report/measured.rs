//! What accuracy costs in time, where it was measured.

use serde_json::Value;

use super::subject::ReportSubject;
use crate::html::{Html, figure, html, table};
use crate::numbers::{duration, significant};

/// The folder of a build that holds a measurement.
pub const MEASURED: &str = "accuracy";

fn word(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// A picture of each setting's sweep with what is in use; `None` where nothing was measured.
pub(super) fn chapter(subject: &ReportSubject<'_>) -> Option<Html> {
    let bytes = subject.file(&format!("{MEASURED}/accuracy.json"))?;
    let all: Value = serde_json::from_slice(bytes).ok()?;
    let machine = &all["machine"];
    let (mut rows, mut pictures) = (Vec::new(), Html::default());
    for sweep in all["sweeps"].as_array()? {
        rows.push(row(sweep));
        let (name, title) = (word(&sweep["name"]), word(&sweep["title"]));
        let shown = subject.drawn(&format!("{MEASURED}/{name}.svg"), &format!("{title}: error over time"));
        if !shown.is_empty() {
            pictures += figure(&shown, title);
        }
    }
    let budget = |budget: &Value| {
        let number = |key: &str| significant(budget[key].as_f64().unwrap_or(f64::NAN));
        html!(
            "<p>{0}: {1} {3} in all. Of this, {2} {3} come from computing, which more time makes smaller.</p>\n",
            word(&budget["title"]),
            number("total"),
            number("computed"),
            word(&budget["unit"]),
        )
    };
    Some(html!(
        "<p>Measured on {0}, {1} threads, {2}{3}. Each picture has the error over the time; \
         <a href=\"../{4}/index.html\">all samples and the error budgets</a>.</p>\n<div class=\"row wide\">\n{5}</div>\n\
         <details><summary>What is in use, and what would be enough</summary>{6}</details>\n{7}",
        word(&machine["processor"]),
        machine["threads"].to_string(),
        word(&machine["system"]),
        if all["quick"].as_bool() == Some(true) { ", a quick look with few runs" } else { "" },
        MEASURED,
        pictures,
        table("", &["setting", "in use", "error", "time", "asked", "fastest that is enough"], &rows,),
        all["budgets"].as_array().into_iter().flatten().map(budget).collect::<Html>(),
    ))
}

fn row(sweep: &Value) -> Vec<Html> {
    let sample = |which: &str| sweep["samples"].get(usize::try_from(sweep[which].as_u64()?).ok()?);
    let or_none = |text: Option<String>| Html::from(text.unwrap_or_else(|| "–".into()));
    let label = |sample: Option<&Value>| or_none(sample.map(|sample| word(&sample["label"]).to_owned()));
    let amount = |value: &Value| Some(format!("{} {}", significant(value.as_f64()?), word(&sweep["unit"])));
    let cost = |sample: &Value| {
        Some(format!("{} per {}", duration(sample["per_item_s"].as_f64()?), word(&sweep["item"])))
    };
    let used = sample("in_use");
    vec![
        word(&sweep["title"]).into(),
        label(used),
        or_none(used.and_then(|sample| amount(&sample["max_error"]))),
        or_none(used.and_then(cost)),
        or_none(amount(&sweep["asked"])),
        label(sample("meets")),
    ]
}
