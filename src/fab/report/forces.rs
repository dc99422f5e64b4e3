//! Springs, loads and resolution on the page.

use serde_json::Value;

use super::subject::ReportSubject;
use crate::constants::RIGID;
use crate::html::{Html, bar, figure, html, table};
use crate::numbers::{percent, typeset};

fn at(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

fn text_at<'a>(value: &'a Value, path: &str) -> &'a str {
    value.pointer(path).and_then(Value::as_str).unwrap_or_default()
}

fn list<'a>(value: &'a Value, path: &str) -> &'a [Value] {
    value.pointer(path).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn is_held(value: &Value) -> bool {
    value.get("held").and_then(Value::as_bool).unwrap_or(false)
}

/// A limit's name in words.
fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// The springs, each claim with how near it comes to its limits, the envelope, and other springs.
pub(super) fn loads(subject: &ReportSubject<'_>) -> Html {
    if subject.design.is_rigid() {
        return html!(
            "<p><strong>{}.</strong> The upper platform stands on {} posts and does not move; what a load does is seen \
             in the dots alone.</p>",
            RIGID,
            subject.design.sections().mount.at_mm.len()
        );
    }
    let json = &subject.forces.json;
    let lines: Vec<Vec<Html>> = subject
        .forces
        .lines
        .iter()
        .map(|line| {
            let size = typeset(line.size);
            vec![
                line.load.as_str().into(),
                size.into(),
                words(&line.ended_by).into(),
                line.part.as_str().into(),
            ]
        })
        .collect();
    html!(
        "<div class=\"row\">\n{}{}</div>\n{}<details><summary>The whole envelope</summary>\n{}</details>\n{}",
        figure(
            &subject.forces.envelope().to_html(),
            "Push and press at the pole. The shaded loads are carried; each edge is the first limit that ends them. Dots: \
             claimed loads at the pole.",
        ),
        springs(json),
        claims(json),
        table(
            "Each load grows until a limit ends it (N, or N·mm)",
            &["load", "size", "ended by", "part"],
            &lines,
        ),
        spring_choices(json),
    )
}

fn springs(json: &Value) -> Html {
    let rows = [
        ("axial stiffness of one spring", "/spring/axial_n_per_mm", "N/mm"),
        ("lateral stiffness of one, at rest", "/spring/lateral_n_per_mm", "N/mm"),
        ("torsion of one", "/spring/torsion_nmm_per_rad", "N·mm/rad"),
        ("spring index", "/spring/index", ""),
        ("Wahl factor", "/spring/wahl_factor", ""),
        ("solid height", "/spring/solid_height_mm", "mm"),
        ("compression at rest", "/spring/rest_compression_mm", "mm"),
    ]
    .map(|(name, path, unit)| vec![name.into(), format!("{} {unit}", typeset(at(json, path))).into()]);
    table("The springs", &["", "value"], &rows)
}

fn claims(json: &Value) -> Html {
    let row = |claim: &Value| {
        let used = |check: &Value| at(check, "/used");
        let nearest = list(claim, "/checks").iter().max_by(|a, b| used(a).total_cmp(&used(b)));
        let nearest = nearest.map_or_else(Html::default, |check| {
            bar(used(check), &format!("{}: {}", words(text_at(check, "/limit")), percent(used(check))))
        });
        vec![
            text_at(claim, "/name").into(),
            if is_held(claim) { "held".into() } else { html!("<strong>not held</strong>") },
            nearest,
            format!("{} ×", typeset(at(claim, "/factor_to_first_limit"))).into(),
            words(text_at(claim, "/first_limit/limit")).into(),
        ]
    };
    table(
        "Claimed loads",
        &["load", "", "nearest limit", "factor to the first limit", "first limit"],
        &list(json, "/claims").iter().map(row).collect::<Vec<_>>(),
    )
}

fn spring_choices(json: &Value) -> Html {
    let row = |choice: &Value| {
        let worst =
            format!("{} ({})", words(text_at(choice, "/worst/limit")), percent(at(choice, "/worst/used")));
        vec![
            format!("{} mm", typeset(at(choice, "/wire_diameter_mm"))).into(),
            typeset(at(choice, "/active_coils")).into(),
            format!("{} N/mm", typeset(at(choice, "/axial_n_per_mm"))).into(),
            if is_held(choice) { "holds".into() } else { "does not hold".into() },
            worst.into(),
        ]
    };
    let rows: Vec<Vec<Html>> = list(json, "/spring_choices").iter().map(row).collect();
    if rows.is_empty() {
        return Html::default();
    }
    html!(
        "<details><summary>Other springs of the same outer size</summary>\n{}</details>\n",
        table(
            "What they do under the hardest press",
            &["wire", "active coils", "axial stiffness in sum", "", "nearest limit"],
            &rows,
        ),
    )
}

/// A row of six numbers from `path` on.
fn six(json: &Value, name: &str, path: &str) -> Vec<Html> {
    let cell = |k: usize| typeset(at(json, &format!("{path}/{k}"))).into();
    std::iter::once(Html::from(name)).chain((0..6).map(cell)).collect()
}

/// Standard deviations of pose and wrench, and what changes of the design do to them.
pub(super) fn resolution(subject: &ReportSubject<'_>) -> Html {
    if subject.design.is_rigid() {
        return html!(
            "<p><strong>{}</strong>, and no pose: there are no white markers to find it from.</p>",
            RIGID
        );
    }
    const WRENCH: [&str; 7] = ["", "Fx, N", "Fy, N", "Fz, N", "Mx, N·mm", "My, N·mm", "Mz, N·mm"];
    const POSE: [&str; 7] = ["", "tx, mm", "ty, mm", "tz, mm", "rx, °", "ry, °", "rz, °"];
    let json = &subject.forces.json;
    let pressed = json.pointer("/resolution_under_press").filter(|press| !press.is_null());
    let at_rest_and_pressed = |what: &str| {
        let mut rows = vec![six(json, "at rest", &format!("/resolution_at_rest/{what}"))];
        rows.extend(pressed.map(|press| {
            let name =
                format!("under \"{}\" ({} N)", text_at(press, "/name"), typeset(at(press, "/press_n")));
            six(press, &name, &format!("/resolution/{what}"))
        }));
        rows
    };
    let weak: Vec<&str> =
        list(json, "/resolution_at_rest/weak_axes").iter().filter_map(Value::as_str).collect();
    let choices: Vec<Vec<Html>> = list(json, "/design_choices")
        .iter()
        .map(|choice| six(choice, text_at(choice, "/change"), "/resolution/wrench_sd"))
        .collect();
    let bias = json.pointer("/plain_runtime_bias").filter(|bias| !bias.is_null()).map(|bias| {
        table(
            "Mean size of the bias of plain solvePnP over the load envelope, relative to rest",
            &WRENCH,
            &[
                six(bias, "with true coordinates", "/naive/mean_wrench_size"),
                six(bias, "with the apparent ones and springs.plain_runtime", "/left/mean_wrench_size"),
            ],
        )
    });
    html!(
        "<p>One standard deviation of a single frame, with white centroids known to {} px by their contrast in the lit frame: no estimate from the centroids \
         does better (Cramér-Rao).</p>\n{}{}<p>Weak axes: {}. Condition number {} (with a lever of {} mm).</p>\n{}{}",
        typeset(at(json, "/centroid_noise_px")),
        table("Wrench", &WRENCH, &at_rest_and_pressed("wrench_sd")),
        table("Pose", &POSE, &at_rest_and_pressed("pose_sd")),
        weak.join(", "),
        typeset(at(json, "/resolution_at_rest/condition")),
        typeset(at(json, "/resolution_at_rest/lever_mm")),
        table("What a change of the design does to the wrench", &WRENCH, &choices),
        bias.unwrap_or_default(),
    )
}
