//! Springs, loads and resolution on the page.

use serde_json::Value;

use super::Subject;
use super::html::{bar, escape, figure, number, percent, table};

fn at(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

fn text_at<'a>(value: &'a Value, path: &str) -> &'a str {
    value.pointer(path).and_then(Value::as_str).unwrap_or_default()
}

fn list<'a>(value: &'a Value, path: &str) -> &'a [Value] {
    value.pointer(path).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// A limit's name in words.
fn words(name: &str) -> String {
    escape(&name.replace('_', " "))
}

/// The springs, each claim with how near it comes to its limits, the envelope, and other springs.
pub fn loads(subject: &Subject<'_>) -> String {
    let json = &subject.forces.json;
    let spring = [
        ("axial stiffness of one spring", "/spring/axial_n_per_mm", "N/mm"),
        ("lateral stiffness of one, at rest", "/spring/lateral_n_per_mm", "N/mm"),
        ("torsion of one", "/spring/torsion_nmm_per_rad", "N·mm/rad"),
        ("spring index", "/spring/index", ""),
        ("Wahl factor", "/spring/wahl_factor", ""),
        ("solid height", "/spring/solid_height_mm", "mm"),
        ("compression at rest", "/spring/rest_compression_mm", "mm"),
    ]
    .map(|(name, path, unit)| vec![name.to_owned(), format!("{} {unit}", number(at(json, path)))]);
    let mut text = String::from("<div class=\"row\">\n");
    text += &figure(
        &subject.shown("report/load_envelope.svg", "Pushes and presses at the pole up to the first limit"),
        "Push and press at the pole, up to the first limit.",
    );
    text += &table("The springs", &["", "value"], &spring);
    text += "</div>\n";
    let claims: Vec<Vec<String>> = list(json, "/claims")
        .iter()
        .map(|claim| {
            let near = list(claim, "/checks").iter().max_by(|a, b| at(a, "/used").total_cmp(&at(b, "/used")));
            let near = near.map_or_else(String::new, |check| {
                let used = at(check, "/used");
                // the bar escapes its own label
                bar(used, &format!("{}: {}", text_at(check, "/limit").replace('_', " "), percent(used)))
            });
            let held = claim.get("held").and_then(Value::as_bool).unwrap_or(false);
            vec![
                escape(text_at(claim, "/name")),
                if held { "held".into() } else { "<strong>not held</strong>".into() },
                near,
                format!("{} ×", number(at(claim, "/factor_to_first_limit"))),
                words(text_at(claim, "/first_limit/limit")),
            ]
        })
        .collect();
    text += &table(
        "Claimed loads",
        &["load", "", "nearest limit", "grows until the first limit by", "which is"],
        &claims,
    );
    let paper = json.pointer("/press_17_n/held").and_then(Value::as_bool).unwrap_or(false);
    text += &format!(
        "<p>The 17 N of arXiv 2303.03093 on the pole: <strong>{}</strong>.</p>\n",
        if paper { "carried" } else { "not carried" }
    );
    let lines: Vec<Vec<String>> = subject
        .forces
        .lines
        .iter()
        .map(|line| vec![escape(&line.load), number(line.size), words(&line.ended_by), escape(&line.part)])
        .collect();
    text += "<details><summary>The whole envelope</summary>\n";
    text += &table(
        "Each load grows until a limit ends it (N, or N·mm)",
        &["load", "size", "ended by", "part"],
        &lines,
    );
    text += "</details>\n";
    let choices: Vec<Vec<String>> = list(json, "/spring_choices")
        .iter()
        .map(|choice| {
            let held = choice.get("held").and_then(Value::as_bool).unwrap_or(false);
            vec![
                format!("{} mm", number(at(choice, "/wire_diameter_mm"))),
                number(at(choice, "/active_coils")),
                format!("{} N/mm", number(at(choice, "/axial_n_per_mm"))),
                if held { "holds".into() } else { "does not hold".into() },
                format!(
                    "{} ({})",
                    words(text_at(choice, "/worst/limit")),
                    percent(at(choice, "/worst/used"))
                ),
            ]
        })
        .collect();
    if !choices.is_empty() {
        text += "<details><summary>Other springs of the same outer size</summary>\n";
        text += &table(
            "What they do under the hardest press",
            &["wire", "active coils", "axial stiffness in sum", "", "nearest limit"],
            &choices,
        );
        text += "</details>\n";
    }
    text
}

/// Standard deviations of pose and wrench, and what changes of the design do to them.
pub fn resolution(subject: &Subject<'_>) -> String {
    let json = &subject.forces.json;
    let axes = ["Fx, N", "Fy, N", "Fz, N", "Mx, N·mm", "My, N·mm", "Mz, N·mm"];
    let moves = ["tx, mm", "ty, mm", "tz, mm", "rx, °", "ry, °", "rz, °"];
    let row = |name: &str, path: &str| {
        std::iter::once(name.to_owned())
            .chain((0..6).map(|k| number(at(json, &format!("{path}/{k}")))))
            .collect::<Vec<_>>()
    };
    let heads = |names: &[&'static str; 6]| {
        let mut heads = vec![""];
        heads.extend(names);
        heads
    };
    let mut text = format!(
        "<p>One standard deviation of a single frame, with white centroids known to {} px: no reading of the centroids does \
         better (Cramér-Rao).</p>\n",
        number(at(json, "/centroid_noise_px"))
    );
    text += &table(
        "Wrench",
        &heads(&axes),
        &[
            row("at rest", "/resolution_at_rest/wrench_sd"),
            row("under 17 N", "/resolution_at_17_n/wrench_sd"),
        ],
    );
    text += &table(
        "Pose",
        &heads(&moves),
        &[row("at rest", "/resolution_at_rest/pose_sd"), row("under 17 N", "/resolution_at_17_n/pose_sd")],
    );
    let weak: Vec<String> =
        list(json, "/resolution_at_rest/weak_axes").iter().filter_map(Value::as_str).map(escape).collect();
    text += &format!(
        "<p>Weak axes: {}. Condition number {} (with a lever of {} mm).</p>\n",
        weak.join(", "),
        number(at(json, "/resolution_at_rest/condition")),
        number(at(json, "/resolution_at_rest/lever_mm"))
    );
    let choices: Vec<Vec<String>> = list(json, "/design_choices")
        .iter()
        .map(|choice| {
            let sd = |k: usize| number(at(choice, &format!("/resolution/wrench_sd/{k}")));
            std::iter::once(escape(text_at(choice, "/change"))).chain((0..6).map(sd)).collect()
        })
        .collect();
    text += &table("What a change of the design does to the wrench", &heads(&axes), &choices);
    let bias = json.pointer("/plain_runtime_bias").unwrap_or(&Value::Null);
    if !bias.is_null() {
        let row = |name: &str, path: &str| {
            std::iter::once(name.to_owned())
                .chain((0..6).map(|k| number(at(bias, &format!("{path}/{k}")))))
                .collect::<Vec<_>>()
        };
        text += &table(
            "Mean size of the bias of plain solvePnP over the load envelope, relative to rest",
            &heads(&axes),
            &[
                row("with true coordinates", "/naive/mean_wrench_size"),
                row("with the apparent ones and springs.plain_runtime", "/left/mean_wrench_size"),
            ],
        );
    }
    text
}
