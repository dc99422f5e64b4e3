//! The page of a measurement: one file that opens from a disk.

use super::budget::{ErrorBudget, ErrorShare};
use super::result::Accuracy;
use super::sweep::{Law, Sweep, SweepSample};
use super::sweep_chart::sweep_chart;
use super::tenth;
use domecast_fab::html::{Html, bars, document, figure, html, table};
use domecast_fab::numbers::{duration, significant};

/// The page: what a tenth of the error costs, the conclusions, the budgets, then a picture for each sweep; tables are folded.
pub fn page(accuracy: &Accuracy) -> Html {
    let link = |sweep: &Sweep| html!("<li><a href=\"#{}\">{}</a></li>\n", sweep.name, sweep.title);
    let body = html!(
        "<header>\n<h1>What accuracy costs: \
         {0}</h1>\n<p class=\"soft\">{1}, {2} threads, {3}; domecast {4}{5}. Times are medians after a warm-up; bars in the \
         pictures reach from the lower to the upper quartile.</p>\n<nav aria-label=\"Settings\"><ul>\n{6}</ul></nav>\n\
         </header>\n<main>\n{7}{8}{9}{10}</main>\n",
        accuracy.design,
        accuracy.machine.processor,
        accuracy.machine.threads,
        accuracy.machine.system,
        accuracy.version,
        if accuracy.quick { "; a quick look with few runs" } else { "" },
        accuracy.sweeps.iter().map(link).collect::<Html>(),
        tenth::chapter(&accuracy.sweeps),
        summary(accuracy),
        accuracy.budgets.iter().map(budget).collect::<Html>(),
        accuracy.sweeps.iter().map(chapter).collect::<Html>(),
    );
    document(&format!("What accuracy costs: {}", accuracy.design), "", &body)
}

/// A table behind its name.
fn folded(name: &str, table: &Html) -> Html {
    html!("<details><summary>{}</summary>\n{}</details>\n", name, table)
}

fn summary(accuracy: &Accuracy) -> Html {
    let heads = [
        "What is computed",
        "In use",
        "Error",
        "Time",
        "Asked",
        "Fastest that is enough",
        "Order of convergence, measured and by theory",
    ];
    let rows: Vec<Vec<Html>> = accuracy.sweeps.iter().map(row).collect();
    let said = accuracy.sweeps.iter().filter(|sweep| !sweep.conclusion.is_empty());
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
        "<h2>In short</h2>\n<ul>\n{}{}{}</ul>\n{}{}",
        said.map(conclusion).collect::<Html>(),
        frames.unwrap_or_default(),
        left_out.collect::<Html>(),
        folded("All settings in a table", &table("", &heads, &rows)),
        settings(accuracy),
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
        .map(|chart| {
            figure(&chart.to_html(), "Error and time of each sample: lower and further left is better.")
        })
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
    let rms = format!("Root mean square, {}", sweep.unit);
    let time = format!("Time per {}", sweep.item);
    html!(
        "<section id=\"{}\">\n<h2>{}</h2>\n{}<p>Error: {}. Compared with: {}. Errors below {} {} are rounding of what it is \
         compared with.</p>\n{}</section>\n",
        sweep.name,
        sweep.title,
        picture,
        sweep.error,
        sweep.reference,
        significant(sweep.noise_floor()),
        sweep.unit,
        folded(
            "All samples",
            &table("", &["Sample", &error, &rms, &time, "Quartiles of the time", ""], &rows)
        ),
    )
}

fn budget(budget: &ErrorBudget) -> Html {
    let part = |amount: f64| 100.0 * (amount / budget.total.max(f64::MIN_POSITIVE)).powi(2);
    let bar = |share: &ErrorShare| {
        let label = format!("{} {}", significant(share.amount), budget.unit);
        (share.step.clone(), share.amount, label)
    };
    let row = |share: &ErrorShare| {
        vec![
            format!("{}{}", share.step, if share.computed { " (computed)" } else { "" }).into(),
            format!("{} {}", significant(share.amount), budget.unit).into(),
            format!("{:.1} %", part(share.amount)).into(),
            html!("<code>{}</code>", share.source),
        ]
    };
    let rows: Vec<Vec<Html>> = budget.shares.iter().map(row).collect();
    html!(
        "<h2>{0}</h2>\n<p>In all {1} {2}. Of this, {3} {2} come from computing, which more time makes smaller; the rest is \
         how the sensor is made.</p>\n{4}{5}",
        budget.title,
        significant(budget.total),
        budget.unit,
        significant(budget.computed),
        bars(&budget.shares.iter().map(bar).collect::<Vec<_>>()),
        folded("Where each comes from", &table("", &["Step", "Size", "Share of the square", "From"], &rows)),
    )
}
