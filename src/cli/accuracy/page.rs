//! The page of a measurement: one file that opens from a disk.

use super::budget::ErrorBudget;
use super::result::Accuracy;
use super::sweep::{Law, Sweep, SweepSample};
use super::sweep_chart::sweep_chart;
use domecast_fab::html::{Html, figure, html, table};
use domecast_fab::numbers::{duration, significant};

/// The page: the conclusions first, then the budgets, then a picture and a table for each sweep.
pub fn page(accuracy: &Accuracy) -> Html {
    html!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>What accuracy costs: {0}</title>\n<link \
         rel=\"icon\" href=\"data:,\">\n<style>\n{1}</style>\n</head>\n<body>\n<main>\n<h1>What accuracy costs: \
         {0}</h1>\n<p>{2}, {3} threads, {4}; domecast {5}{6}. Medians after a warm-up; bars from the lower to the \
         upper quartile.</p>\n{7}{8}{9}{10}</main>\n</body>\n</html>\n",
        accuracy.design,
        Html::trusted(include_str!("page.css")),
        accuracy.machine.processor,
        accuracy.machine.threads,
        accuracy.machine.system,
        accuracy.version,
        if accuracy.quick { "; a quick look with few runs" } else { "" },
        summary(accuracy),
        settings(accuracy),
        accuracy.budgets.iter().map(budget).collect::<Html>(),
        accuracy.sweeps.iter().map(chapter).collect::<Html>(),
    )
}

fn summary(accuracy: &Accuracy) -> Html {
    let heads = [
        "Sweep",
        "In use",
        "Error",
        "Time",
        "Asked",
        "Fastest that is enough",
        "Order, measured and by theory",
    ];
    let rows: Vec<Vec<Html>> = accuracy.sweeps.iter().map(row).collect();
    let conclusion = |sweep: &Sweep| html!("<li><b>{}.</b> {}</li>\n", sweep.title, sweep.conclusion);
    let frames = accuracy.frames_to_average.map(|frames| {
        html!(
            "<li><b>Force.</b> The mean of {} frame{} keeps <code>accuracy.force_n</code> with a safety factor of 2, as \
             far as noise goes.</li>\n",
            frames,
            if frames == 1 { "" } else { "s" },
        )
    });
    let left_out = accuracy.left_out.iter().map(|left| html!("<li>Not measured: {}</li>\n", left));
    html!(
        "<h2>In short</h2>\n{}<ul>\n{}{}{}</ul>\n",
        table("", &heads, &rows),
        accuracy.sweeps.iter().map(conclusion).collect::<Html>(),
        frames.unwrap_or_default(),
        left_out.collect::<Html>(),
    )
}

fn settings(accuracy: &Accuracy) -> Html {
    let line = |setting: &super::result::SettingRecord| {
        html!("<li><code>{}</code> = {}: {}</li>\n", setting.field, setting.value, setting.because)
    };
    html!("<h2>Settings</h2>\n<ul>\n{}</ul>\n", accuracy.settings.iter().map(line).collect::<Html>())
}

fn row(sweep: &Sweep) -> Vec<Html> {
    let sample = |index: Option<usize>| index.and_then(|index| sweep.samples.get(index));
    let used = sample(sweep.in_use);
    let order = match sweep.law {
        Law::Power { exponent } => Some(exponent),
        Law::Steps { order } => Some(order),
        Law::Within | Law::Falls => None,
    };
    let or_none = |text: Option<String>| Html::from(text.unwrap_or_else(|| "–".into()));
    let label = |sample: Option<&SweepSample>| or_none(sample.map(|sample| sample.label.clone()));
    vec![
        html!("<a href=\"#{}\">{}</a>", sweep.name, sweep.title),
        label(used),
        or_none(used.map(|sample| format!("{} {}", significant(sample.max_error), sweep.unit))),
        or_none(used.map(|sample| format!("{} per {}", duration(sample.per_item_s), sweep.item))),
        or_none(sweep.asked.map(|asked| format!("{} {}", significant(asked), sweep.unit))),
        label(sample(sweep.meets)),
        or_none(order.map(|theory| match sweep.observed {
            Some(seen) => format!("{}, {}", significant(seen), significant(theory)),
            None => format!("not measured, {}", significant(theory)),
        })),
    ]
}

fn chapter(sweep: &Sweep) -> Html {
    let picture = sweep_chart(sweep)
        .map(|chart| figure(&Html::trusted(chart.to_svg()), "Error and time of each sample"))
        .unwrap_or_default();
    let row = |(index, sample): (usize, &SweepSample)| {
        let per_item = |seconds: f64| duration(seconds * sample.per_item_s / sample.time.median_s);
        let is_used = sweep.in_use == Some(index);
        let mut remarks: Vec<String> =
            [(is_used, "in use"), (sweep.meets == Some(index), "enough"), (sample.dominated, "dominated")]
                .into_iter()
                .filter(|(applies, _)| *applies)
                .map(|(_, remark)| remark.to_owned())
                .collect();
        remarks.extend(sample.notes.iter().map(|(what, value)| format!("{what} {}", significant(*value))));
        let time = &sample.time;
        vec![
            if is_used { html!("<mark>{}</mark>", sample.label) } else { sample.label.as_str().into() },
            significant(sample.max_error).into(),
            significant(sample.rms_error).into(),
            duration(sample.per_item_s).into(),
            format!("{} to {}", per_item(time.lower_quartile_s), per_item(time.upper_quartile_s)).into(),
            remarks.join("; ").into(),
        ]
    };
    let rows: Vec<Vec<Html>> = sweep.samples.iter().enumerate().map(row).collect();
    let error = format!("Largest error, {}", sweep.unit);
    let time = format!("Time per {}", sweep.item);
    html!(
        "<section id=\"{}\">\n<h2>{}</h2>\n{}<p>Error: {}. Reference: {}. Errors below {} {} are the reference's own \
         rounding.</p>\n{}</section>\n",
        sweep.name,
        sweep.title,
        picture,
        sweep.error,
        sweep.reference,
        significant(sweep.noise_floor()),
        sweep.unit,
        table("", &["Sample", &error, "Root mean square", &time, "Quartiles", ""], &rows),
    )
}

fn budget(budget: &ErrorBudget) -> Html {
    let rows: Vec<Vec<Html>> = budget
        .shares
        .iter()
        .map(|share| {
            let part = 100.0 * (share.amount / budget.total.max(f64::MIN_POSITIVE)).powi(2);
            vec![
                format!("{}{}", share.step, if share.computed { " (computed)" } else { "" }).into(),
                significant(share.amount).into(),
                format!("{part:.1} %").into(),
                html!("<code>{}</code>", share.source),
            ]
        })
        .collect();
    html!(
        "<h2>{0}</h2>\n<p>In all {1} {2}. Of this, {3} {2} come from computing, which more time makes smaller.</p>\n{4}",
        budget.title,
        significant(budget.total),
        budget.unit,
        significant(budget.computed),
        table("", &["Step", budget.unit, "Share of the square", "From"], &rows),
    )
}
