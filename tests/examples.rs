//! The five example programs, run as a reader would: each does what its first lines say.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::domecast;

const REPOSITORY: &str = env!("CARGO_MANIFEST_DIR");

/// Runs an example in the repository; returns what it prints.
fn run(name: &str, arguments: &[&str]) -> String {
    let beside = Path::new(env!("CARGO_BIN_EXE_domecast")).parent().expect("a folder").join("examples");
    let program = beside.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let output = Command::new(&program).args(arguments).current_dir(REPOSITORY).output();
    let output = output.unwrap_or_else(|error| panic!("{}: {error}", program.display()));
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let mut names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn trace_goes_to_the_dome_and_back() {
    let text = run("trace", &["designs/thumb24.json", "400", "240"]);
    assert!(text.contains("seen again   [400.000, 240.000] px"), "{text}");
    assert!(run("trace", &["designs/thumb24.json", "0", "0"]).contains("sees nothing beyond_fold"));
}

#[test]
fn dots_lists_every_dot_and_draws_its_film() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = run("dots", &["designs/thumb24.json", folder.path().to_str().expect("UTF-8")]);
    let dots = text.lines().count() - 2;
    assert!(text.starts_with(&format!("{dots} dots")), "{text}");
    let films: Vec<String> = names(folder.path());
    assert!(!films.is_empty() && films[0] == "film-1.svg", "{films:?}");
    let drawn = films.iter().map(|film| fs::read_to_string(folder.path().join(film)).expect("a film"));
    assert_eq!(drawn.map(|film| film.matches("data-id=").count()).sum::<usize>(), dots);
}

#[test]
fn parts_writes_every_part() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = run("parts", &["designs/thumb24.json", folder.path().to_str().expect("UTF-8")]);
    let files = names(folder.path());
    assert_eq!(files.len(), text.lines().count());
    assert!(files.contains(&"upper_platform.stl".to_owned()), "{files:?}");
}

#[test]
fn track_feels_what_pressed() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    let place = |name: &str| at(name).display().to_string();
    let repository = |path: &str| format!("{REPOSITORY}/{path}");
    for arguments in [
        ["build", &repository("designs/thumb24.json"), "--out", "built"],
        ["simulate", &repository("designs/scenes/push.json"), "--out", "push"],
    ] {
        let output = domecast(&arguments, folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let frames: Vec<String> = names(&at("push")).into_iter().filter(|name| name.ends_with(".png")).collect();
    // the push ends where it began
    let pressed = &frames[frames.len() / 2];
    let constants = place("built/constants/constants.json");
    let text = run(
        "track",
        &[&constants, &place(&format!("push/{}", frames[0])), &place(&format!("push/{pressed}"))],
    );
    assert_eq!(text.lines().count(), 2, "{text}");
    assert!(text.lines().all(|line| line.contains(": ok, force ")), "{text}");
}

#[test]
fn simulate_feels_the_true_force() {
    let text = run("simulate", &["designs/scenes/push.json"]);
    let mut pressed = 0;
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split_whitespace().collect();
        let [truth, felt]: [f64; 2] = std::array::from_fn(|i| cells[1 + i].parse().expect("a number"));
        assert_eq!(cells[4], "ok", "{line}");
        assert!((truth - felt).abs() < 0.02, "{line}");
        pressed += u32::from(truth < -0.5);
    }
    assert!(pressed > 0, "{text}");
}
