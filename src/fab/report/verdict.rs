//! The verdict on top of the page: five questions, each with its answer, its numbers, and what to look at.

use serde_json::Value;

use super::subject::ReportSubject;
use crate::constants::RIGID;
use crate::html::{Html, html};
use crate::numbers::{percent, typeset};

/// What a build must answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Question {
    Built,
    Sees,
    Lighted,
    Carries,
    Resolves,
}

const QUESTIONS: [Question; 5] =
    [Question::Built, Question::Sees, Question::Lighted, Question::Carries, Question::Resolves];

impl Question {
    /// The question that a warning about a field belongs to: by its section.
    fn of(field: &str) -> Self {
        match field.split(['.', '[']).next().unwrap_or_default() {
            "camera" | "optics" | "runtime" | "pattern" => Self::Sees,
            "leds" | "exposure" | "white_markers" | "elastomer" => Self::Lighted,
            "springs" | "loads" | "gravity" | "mount" => Self::Carries,
            "noise" | "tolerances" | "accuracy" => Self::Resolves,
            _ => Self::Built,
        }
    }

    /// The name, and the chapter that has the whole of it.
    fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Built => ("Can be built", "parts"),
            Self::Sees => ("Can see", "coverage"),
            Self::Lighted => ("Is lit", "light"),
            Self::Carries => ("Carries its loads", "loads"),
            Self::Resolves => ("Resolves", "resolution"),
        }
    }

    fn answer(self, subject: &ReportSubject<'_>) -> String {
        match self {
            Self::Built => built(subject),
            Self::Sees => sees(subject),
            Self::Lighted => lit(subject),
            Self::Carries => carries(subject),
            Self::Resolves => resolves(subject),
        }
    }
}

/// The five answers; a warning stands under the question that it belongs to.
pub(super) fn verdict(subject: &ReportSubject<'_>) -> Html {
    let row = |question: &Question| {
        let (name, chapter) = question.name();
        let own = subject.warnings.iter().filter(|(field, _)| Question::of(field) == *question);
        let warnings: Html =
            own.map(|(field, text)| html!("<li><code>{}</code> {}</li>\n", field, with_code(text))).collect();
        let (class, mark) = if warnings.is_empty() { ("fine", "✓ yes") } else { ("look", "! look") };
        let list = match warnings.is_empty() {
            true => Html::default(),
            false => html!("<ul class=\"warnings\">\n{}</ul>", warnings),
        };
        html!(
            "<li class=\"{}\"><span class=\"mark\">{}</span><div><a href=\"#{}\"><strong>{}</strong></a> {}{}</div></li>\n",
            class,
            mark,
            chapter,
            name,
            question.answer(subject),
            list
        )
    };
    html!(
        "<section id=\"verdict\"><h2>Verdict</h2><ul class=\"verdict\">\n{}</ul></section>\n",
        QUESTIONS.iter().map(row).collect::<Html>()
    )
}

/// A message whose `commands` are set as such.
fn with_code(text: &str) -> Html {
    let piece = |(index, piece): (usize, &str)| match index % 2 {
        0 => html!("{}", piece),
        _ => html!("<code>{}</code>", piece),
    };
    text.split('`').enumerate().map(piece).collect()
}

fn plural(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn built(subject: &ReportSubject<'_>) -> String {
    format!(
        "{} within the limits of {}; no two parts touch in {} of the platform",
        plural(subject.parts.len(), "part"),
        subject.design.sections().process.name,
        plural(subject.poses.len(), "position"),
    )
}

fn sees(subject: &ReportSubject<'_>) -> String {
    let rays = subject.sight.iter().flat_map(|pose| &pose.counts);
    let (traced, blocked) = rays.fold((0, 0), |(t, b), count| (t + count.traced, b + count.blocked));
    let covered = subject.judged.coverage.first().and_then(|record| record.coverage.as_ref());
    let covered =
        covered.map_or_else(String::new, |c| format!("; {} of the dome inside the mask", percent(c.in_mask)));
    format!(
        "{}; {blocked} of {traced} traced rays blocked by a part{covered}",
        plural(subject.layout.dots.len(), "dot")
    )
}

fn lit(subject: &ReportSubject<'_>) -> String {
    let dome = &subject.light.dome;
    let faintest = subject.light.markers.iter().map(|m| m.contrast_levels).reduce(f64::min);
    let markers = faintest.map_or_else(String::new, |levels| {
        format!("; white markers {} levels above what is around them, or more", typeset(levels))
    });
    format!(
        "dome at {} of 255, its darkest twentieth below {}{markers}",
        typeset(dome.median_level),
        typeset(dome.percentile_5_level)
    )
}

fn carries(subject: &ReportSubject<'_>) -> String {
    if subject.design.is_rigid() {
        return RIGID.into();
    }
    let claims = subject.forces.json["claims"].as_array().map_or(&[][..], Vec::as_slice);
    let factor = |claim: &Value| claim["factor_to_first_limit"].as_f64().unwrap_or(f64::INFINITY);
    match claims.iter().min_by(|a, b| factor(a).total_cmp(&factor(b))) {
        None => "no load is claimed".into(),
        Some(nearest) => format!(
            "{}; nearest to a limit: \"{}\", which may grow {}-fold",
            plural(claims.len(), "claimed load"),
            nearest["name"].as_str().unwrap_or_default(),
            typeset(factor(nearest)),
        ),
    }
}

fn resolves(subject: &ReportSubject<'_>) -> String {
    let sd = |k: usize| subject.forces.json["resolution_at_rest"]["wrench_sd"][k].as_f64();
    match (sd(0), sd(2), sd(5)) {
        (Some(across), Some(along), Some(twist)) => format!(
            "one frame at rest: {} N across, {} N along the axis, {} N·mm of twist (one standard deviation)",
            typeset(across),
            typeset(along),
            typeset(twist)
        ),
        _ => "no net wrench: the dots alone tell of a touch".into(),
    }
}
