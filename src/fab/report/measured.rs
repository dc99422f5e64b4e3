//! What accuracy costs in time, where it was measured.

use std::fmt::Write as _;

use serde_json::Value;

use super::Subject;
use super::html::{escape, figure, table};
use super::numbers::{duration, sparse};

/// The folder of a build that holds a measurement.
pub const MEASURED: &str = "accuracy";

/// A picture of each dial with what is in use; `None` where nothing was measured.
pub fn chapter(subject: &Subject<'_>) -> Option<String> {
    let bytes = subject.file(&format!("{MEASURED}/accuracy.json"))?;
    let all: Value = serde_json::from_slice(bytes).ok()?;
    let machine = &all["machine"];
    let word = |value: &Value| escape(value.as_str().unwrap_or_default());
    let mut text = format!(
        "<p>Measured on {}, {} threads, {}{}. Each picture has the error over the time; \
         <a href=\"../{MEASURED}/index.html\">all rungs and the error budgets</a>.</p>\n<div class=\"row wide\">\n",
        word(&machine["processor"]),
        machine["threads"],
        word(&machine["system"]),
        if all["quick"].as_bool() == Some(true) { ", a quick look with few runs" } else { "" }
    );
    let mut rows = Vec::new();
    for ladder in all["ladders"].as_array()? {
        let title = ladder["title"].as_str().unwrap_or_default();
        let unit = word(&ladder["unit"]);
        let rung = |which: &str| ladder["rungs"].get(usize::try_from(ladder[which].as_u64()?).ok()?);
        let label = |rung: Option<&Value>| rung.map_or_else(|| "–".into(), |rung| word(&rung["label"]));
        let used = rung("in_use");
        let amount =
            |value: &Value| value.as_f64().map_or_else(|| "–".into(), |v| format!("{} {unit}", sparse(v)));
        let cost = |rung: &Value| {
            let seconds = rung["per_item_s"].as_f64();
            seconds.map_or_else(|| "–".into(), |s| format!("{} a {}", duration(s), word(&ladder["item"])))
        };
        rows.push(vec![
            escape(title),
            label(used),
            used.map_or_else(|| "–".into(), |rung| amount(&rung["max_error"])),
            used.map_or_else(|| "–".into(), cost),
            amount(&ladder["asked"]),
            label(rung("meets")),
        ]);
        let name = ladder["name"].as_str().unwrap_or_default();
        let shown = subject.shown(&format!("{MEASURED}/{name}.svg"), &format!("{title}: error over time"));
        if !shown.is_empty() {
            text += &figure(&shown, title);
        }
    }
    text += "</div>\n";
    text += &table(
        "What is in use, and what would be enough",
        &["dial", "in use", "leaves", "costs", "asked", "cheapest that is enough"],
        &rows,
    );
    for budget in all["budgets"].as_array().into_iter().flatten() {
        let number = |key: &str| sparse(budget[key].as_f64().unwrap_or(f64::NAN));
        let _ = writeln!(
            text,
            "<p>{}: {} {3} in all, of which {} {3} are worked out and could be bought with time.</p>",
            word(&budget["title"]),
            number("total"),
            number("computed"),
            word(&budget["unit"])
        );
    }
    Some(text)
}
