//! The page of a measurement: one file that opens from a disk.

use std::fmt::Write as _;

use super::chart::Chart;
use super::{Accuracy, Budget, Ladder, Law};
use domecast_fab::numbers::{duration, significant as sparse};

/// Text that stands in HTML and SVG.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The page: what to take from it first, then a picture and a table for each dial, then the budgets.
pub fn page(accuracy: &Accuracy) -> String {
    let name = escape(&accuracy.design);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>What accuracy costs: {name}</title>\n<link \
         rel=\"icon\" href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>What accuracy costs: \
         {name}</h1>\n<p>{}, {} threads, {}; domecast {}{}. Medians after a warm-up; bars from the lower to the \
         upper quartile.</p>\n",
        include_str!("page.css"),
        escape(&accuracy.machine.processor),
        accuracy.machine.threads,
        escape(&accuracy.machine.system),
        accuracy.version,
        if accuracy.quick { "; a quick look with few runs" } else { "" }
    );
    text += "<h2>In short</h2>\n<table><thead><tr><th>Dial</th><th>In use</th><th>Leaves</th><th>Costs</th><th>Asked\
             </th><th>Cheapest that is enough</th><th>Order, seen and by theory</th></tr></thead><tbody>\n";
    for ladder in &accuracy.ladders {
        text += &row(ladder);
    }
    text += "</tbody></table>\n<ul>\n";
    for ladder in &accuracy.ladders {
        let _ = writeln!(text, "<li><b>{}.</b> {}</li>", escape(&ladder.title), escape(&ladder.says));
    }
    if let Some(frames) = accuracy.frames_to_average {
        let _ = writeln!(
            text,
            "<li><b>Force.</b> Average {frames} frame(s) to reach <code>accuracy.force_n</code> twice over, as far as noise goes.</li>"
        );
    }
    for left in &accuracy.left_out {
        let _ = writeln!(text, "<li>Not measured: {}</li>", escape(left));
    }
    text += "</ul>\n<h2>Settings</h2>\n<ul>\n";
    for setting in &accuracy.settings {
        let _ = writeln!(
            text,
            "<li><code>{}</code> = {}: {}</li>",
            setting.field,
            setting.value,
            escape(&setting.because)
        );
    }
    text += "</ul>\n";
    for budget in &accuracy.budgets {
        text += &sum(budget);
    }
    for ladder in &accuracy.ladders {
        text += &chapter(ladder);
    }
    text + "</main>\n</body>\n</html>\n"
}

fn row(ladder: &Ladder) -> String {
    let rung = |index: Option<usize>| index.and_then(|index| ladder.rungs.get(index));
    let used = rung(ladder.in_use);
    let order = match ladder.law {
        Law::Power { exponent } => Some(exponent),
        Law::Steps { order } => Some(order),
        Law::Within | Law::Falls => None,
    };
    let or_none = |text: Option<String>| text.unwrap_or_else(|| "–".into());
    format!(
        "<tr><td><a href=\"#{}\">{}</a></td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        ladder.name,
        escape(&ladder.title),
        or_none(used.map(|rung| escape(&rung.label))),
        or_none(used.map(|rung| format!("{} {}", sparse(rung.max_error), ladder.unit))),
        or_none(used.map(|rung| format!("{} a {}", duration(rung.per_item_s), ladder.item))),
        or_none(ladder.asked.map(|asked| format!("{} {}", sparse(asked), ladder.unit))),
        or_none(rung(ladder.meets).map(|rung| escape(&rung.label))),
        or_none(order.map(|theory| match ladder.observed {
            Some(seen) => format!("{}, {}", sparse(seen), sparse(theory)),
            None => format!("not seen, {}", sparse(theory)),
        })),
    )
}

fn chapter(ladder: &Ladder) -> String {
    let mut text = format!("<section id=\"{}\">\n<h2>{}</h2>\n", ladder.name, escape(&ladder.title));
    if let Some(chart) = Chart::of(ladder) {
        let svg = chart.to_svg();
        let _ = writeln!(text, "<figure>{svg}<figcaption>Error and time of each rung</figcaption></figure>");
    }
    let _ = writeln!(
        text,
        "<p>Error: {}. Against: {}. Errors below {} {} are the reference's own rounding.</p>\n<table><thead><tr>\
         <th>Rung</th><th>Largest error, {2}</th><th>Root mean square</th><th>Time a {}</th><th>Quartiles</th>\
         <th></th></tr></thead><tbody>",
        escape(ladder.error),
        escape(&ladder.reference),
        sparse(ladder.blind_below()),
        ladder.unit,
        ladder.item,
    );
    for (index, rung) in ladder.rungs.iter().enumerate() {
        let per_item = |seconds: f64| duration(seconds * rung.per_item_s / rung.time.median_s);
        let mut remarks = Vec::new();
        if ladder.in_use == Some(index) {
            remarks.push("in use".to_owned());
        }
        if ladder.meets == Some(index) {
            remarks.push("enough".to_owned());
        }
        if rung.dominated {
            remarks.push("beaten".to_owned());
        }
        remarks.extend(rung.notes.iter().map(|(what, value)| format!("{what} {}", sparse(*value))));
        let _ = writeln!(
            text,
            "<tr{}><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{} to {}</td><td>{}</td></tr>",
            if ladder.in_use == Some(index) { " class=\"used\"" } else { "" },
            escape(&rung.label),
            sparse(rung.max_error),
            sparse(rung.rms_error),
            duration(rung.per_item_s),
            per_item(rung.time.lower_quartile_s),
            per_item(rung.time.upper_quartile_s),
            escape(&remarks.join("; "))
        );
    }
    text + "</tbody></table>\n</section>\n"
}

fn sum(budget: &Budget) -> String {
    let mut text = format!(
        "<h2>{}</h2>\n<p>Together {} {}; of this, {} {1} is worked out and could be bought with time.</p>\n<table>\
         <thead><tr><th>Step</th><th>{1}</th><th>Share of the square</th><th>From</th></tr></thead><tbody>\n",
        escape(&budget.title),
        sparse(budget.total),
        budget.unit,
        sparse(budget.computed)
    );
    for share in &budget.shares {
        let part = 100.0 * (share.amount / budget.total.max(f64::MIN_POSITIVE)).powi(2);
        let _ = writeln!(
            text,
            "<tr><td>{}{}</td><td>{}</td><td>{part:.1} %</td><td><code>{}</code></td></tr>",
            escape(&share.step),
            if share.computed { " (worked out)" } else { "" },
            sparse(share.amount),
            escape(&share.source)
        );
    }
    text + "</tbody></table>\n"
}
