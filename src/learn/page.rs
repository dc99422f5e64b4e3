//! A page of a training: its curves, and what came of the videos that were not trained with.

use std::fmt::Write;

use serde_json::Value;

use crate::train::Epoch;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}\
svg{width:100%;max-width:36em;height:auto}table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #bbb;\
padding:.2em .7em;text-align:right}figure{margin:1.5em 0}pre{white-space:pre-wrap}";
/// Of a chart's inside and of the room about it, units of its own.
const SIDES: [f64; 2] = [400.0, 160.0];
const ROOM: f64 = 46.0;
const COLORS: [&str; 2] = ["#1f6fb4", "#c4501b"];

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Lines over the epochs, each with its name.
fn chart(title: &str, lines: &[(&str, Vec<f64>)]) -> String {
    let all = || lines.iter().flat_map(|(_, values)| values).copied().filter(|value| value.is_finite());
    let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let span = (high - low).max(1e-9);
    let [width, height] = SIDES;
    let mut svg = format!(
        "<figure><figcaption>{title}</figcaption><svg role=\"img\" aria-label=\"{title}\" viewBox=\"0 0 {} {}\">\
         <rect x=\"{ROOM}\" y=\"10\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#999\"/>",
        width + 2.0 * ROOM,
        height + 50.0
    );
    for ((name, values), color) in lines.iter().zip(COLORS) {
        let step = width / (values.len().max(2) - 1) as f64;
        let at = |(epoch, value): (usize, &f64)| {
            format!("{:.1},{:.1}", ROOM + epoch as f64 * step, 10.0 + height * (high - value) / span)
        };
        let points: Vec<String> = values.iter().enumerate().filter(|(_, v)| v.is_finite()).map(at).collect();
        _ = write!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"><title>{name}</title></polyline>",
            points.join(" ")
        );
    }
    let epochs = lines.first().map_or(0, |(_, values)| values.len());
    let names = lines.iter().zip(COLORS).enumerate().map(|(at, ((name, _), color))| {
        let x = ROOM + 170.0 * at as f64;
        format!("<text x=\"{x}\" y=\"{}\" fill=\"{color}\">{name}</text>", height + 44.0)
    });
    _ = write!(
        svg,
        "<g font-size=\"12\" fill=\"#333\"><text x=\"2\" y=\"20\">{high:.3}</text><text x=\"2\" y=\"{y}\">{low:.3}</text>\
         <text x=\"{ROOM}\" y=\"{below}\">epoch 1</text><text x=\"{end}\" y=\"{below}\" text-anchor=\"end\">{epochs}</text>{names}</g></svg></figure>",
        y = height + 10.0,
        below = height + 26.0,
        end = ROOM + width,
        names = names.collect::<String>()
    );
    svg
}

/// True classes down, stated ones across.
fn confusion(metrics: &Value) -> String {
    let names: Vec<String> = metrics["classes"].as_array().into_iter().flatten().map(text).collect();
    let head: String = names.iter().map(|name| format!("<th>{name}</th>")).collect();
    let rows =
        metrics["test"]["confusion"].as_array().into_iter().flatten().zip(&names).map(|(row, name)| {
            let cells: String =
                row.as_array().into_iter().flatten().map(|n| format!("<td>{n}</td>")).collect();
            format!("<tr><th>{name}</th>{cells}</tr>")
        });
    format!("<table><tr><th>is \\ stated</th>{head}</tr>{}</table>", rows.collect::<String>())
}

fn text(value: &Value) -> String {
    escaped(value.as_str().unwrap_or_default())
}

/// What the page says of a share of videos.
fn share(value: &Value) -> String {
    let part = |at: &Value| 100.0 * at.as_f64().unwrap_or(f64::NAN);
    let [low, high] = [0, 1].map(|end| part(&value["wilson_95"][end]));
    format!(
        "{} of {} ({:.2} %, 95 % interval {low:.2} to {high:.2})",
        value["right"],
        value["of"],
        part(&value["part"])
    )
}

/// The page (HTML), whole in itself.
pub fn page(metrics: &Value, curve: &[Epoch]) -> String {
    let line = |of: fn(&Epoch) -> f64| curve.iter().map(of).collect::<Vec<f64>>();
    let mut charts = chart(
        "loss",
        &[
            ("training", line(|epoch| epoch.train_loss)),
            ("calibration set: log loss", line(|epoch| epoch.val_log_loss)),
        ],
    );
    charts +=
        &chart("part of the classes that is right, calibration set", &[("right", line(|e| e.val_accuracy))]);
    let test = &metrics["test"];
    let modulus = match &test["modulus"] {
        Value::Null => String::new(),
        modulus => {
            charts +=
                &chart("rms error of log10 E, calibration set", &[("decades", line(|e| e.val_rmse_log10))]);
            format!(
                "<p>log10 E: R2 {:.3}, {:.3} of a decade rms; its 90 % interval holds {}.</p>",
                modulus["r2"].as_f64().unwrap_or(f64::NAN),
                modulus["rmse_log10"].as_f64().unwrap_or(f64::NAN),
                share(&modulus["interval_90_holds"])
            )
        }
    };
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Hardness: {name}</title><style>{STYLE}</style></head>\
         <body><h1>Hardness: {name}</h1><h2>Videos that were not trained with</h2><p>Right: {right}. Where the model is not \
         unsure: {stated}; unsure of {unsure}.</p>{modulus}{confusion}<h2>Training</h2>{charts}<h2>Setup</h2>\
         <pre>{setup}</pre><p>model.onnx: SHA-256 {hash}</p></body></html>\n",
        name = text(&metrics["setup"]["dataset"]),
        right = share(&test["accuracy"]),
        stated = share(&test["accuracy_where_stated"]),
        unsure = test["unsure"],
        confusion = confusion(metrics),
        setup = escaped(&format!("{:#}", metrics["setup"])),
        hash = text(&metrics["model_sha256"]),
    )
}
