//! `domecast track --report` from outside: the page's numbers, its form, and that it is there whole or not at all.
//! What shows with `--shape` is judged by `scripts/check_track_report.py`.

use std::path::Path;

use serde_json::Value;

use super::program::{lines, png, run};
use super::render::{Picture, still};
use super::{SENSOR, drawn, pose};

/// A folder with constants and frames: pressed deeper and deeper, one missing, one that is no picture.
fn recording() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("constants.json"), SENSOR.constants.to_json()).unwrap();
    std::fs::create_dir(folder.path().join("seq")).unwrap();
    for number in (0..7_u64).filter(|number| *number != 3) {
        let at = pose([0.0, 0.0, -0.1 * number as f64], [0.0; 3]);
        let file = match number {
            5 => b"no picture".to_vec(),
            _ => png(&drawn(&Picture { seed: number, ..still(at) }).bytes),
        };
        std::fs::write(folder.path().join(format!("seq/frame_{number:04}.png")), file).unwrap();
    }
    folder
}

/// The page's data.
fn data(page: &Path) -> Value {
    let text = std::fs::read_to_string(page).unwrap();
    let from = text.split("<script type=\"application/json\" id=\"track\">").nth(1).unwrap();
    serde_json::from_str(from.split("</script>").next().unwrap()).unwrap()
}

#[test]
fn a_page_says_what_the_lines_say() {
    let folder = recording();
    let arguments = ["seq", "--constants", "constants.json", "--report", "page.html"];
    let output = run(folder.path(), &arguments, b"");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let (lines, page) = (lines(&output), folder.path().join("page.html"));
    let data = data(&page);
    let of = |key: &str| -> Vec<Value> { lines.iter().map(|line| line[key].clone()).collect() };
    assert_eq!(data["frames"], Value::Array(of("frame")));
    assert_eq!(data["status"], Value::Array(of("status")));
    assert_eq!((&data["every"], &data["frames_in_all"]), (&1.into(), &lines.len().into()));
    let mut compared = 0;
    for (index, line) in lines.iter().enumerate() {
        for (keys, name) in
            [(["force_n", "torque_nmm"], "wrench"), (["force_sd_n", "torque_sd_nmm"], "wrench_sd")]
        {
            let Some(six) = line[name].as_array() else {
                assert!(keys.iter().all(|key| data[*key][index].is_null()), "{name} of {line}");
                continue;
            };
            let found = keys.iter().flat_map(|key| data[*key][index].as_array().unwrap());
            for (a, b) in found.zip(six) {
                assert!((a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1.1e-6, "{a} {b}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 12 * 5, "every frame but the one that is no picture has a wrench");
    assert!(data.get("skin").is_none(), "no shape was asked for");

    let text = std::fs::read_to_string(&page).unwrap();
    for outside in ["http:", "https:", "url(", "@import", " src=\"/"] {
        let allowed = text.replace("http://www.w3.org/", "");
        assert!(!allowed.contains(outside), "the page names {outside}");
    }
    for element in ["section", "svg", "table", "figure", "script", "main"] {
        let (opened, closed) = (format!("<{element}"), format!("</{element}>"));
        assert_eq!(text.matches(&opened).count(), text.matches(&closed).count(), "{element}");
    }
    assert!(text.contains("<title>frame 5: unreadable</title>"), "the band of statuses");
    assert!(!text.contains("NaN") && !text.contains(">inf<"));

    // The same frames give the same page, in the place of the first.
    let before = std::fs::read(&page).unwrap();
    assert_eq!(run(folder.path(), &arguments, b"").status.code(), Some(0));
    assert_eq!(std::fs::read(&page).unwrap(), before);
}

#[test]
fn a_page_is_there_whole_or_not_at_all() {
    let folder = recording();
    let there = |name: &str| folder.path().join(name).exists();
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let of = |frames: &str, page: &str| {
        run(folder.path(), &[frames, "--constants", "constants.json", "--report", page], b"").status.code()
    };
    assert_eq!(of("empty", "none.html"), Some(1));
    assert!(!there("none.html"));
    // A file of someone else's stays, and an input is no place for a page.
    std::fs::write(folder.path().join("mine.html"), "mine").unwrap();
    assert_eq!(of("seq", "mine.html"), Some(1));
    assert_eq!(std::fs::read_to_string(folder.path().join("mine.html")).unwrap(), "mine");
    assert_eq!(of("seq", "constants.json"), Some(1));
    assert!(
        SENSOR.constants.to_json() == std::fs::read_to_string(folder.path().join("constants.json")).unwrap()
    );
}
