//! The calibrating commands: what they write. Bad tables stand in `tests/cases/tables`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::str::FromStr;

use domecast::constants::{self, Constants};
use domecast::layout::Layout;

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_domecast")).args(arguments).output().expect("domecast runs")
}

fn thumb24() -> Constants {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let design = domecast::design::Design::load(&path).expect("a design");
    constants::of(&design, &Layout::of_design(&design).expect("a layout")).expect("constants")
}

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().expect("a folder") };
        bench.write("constants.json", &thumb24().to_json());
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a file");
    }

    fn run(&self, command: &str, table: &str) -> Output {
        self.write("table.csv", table);
        let [table, constants] = ["table.csv", "constants.json"].map(|n| self.path(n).display().to_string());
        run(&["--json", command, &table, &constants])
    }
}

/// Pairs from a stiffness that is a tenth above the nominal one, Mz never read.
fn pairs() -> String {
    let stiffness = thumb24().springs.expect("springs").stiffness;
    let mut text = String::from("tx,ty,tz,rx,ry,rz,Fx,Fy,Fz,Mx,My,Mz\n");
    for i in 0..60 {
        let wave = |k: f64| (k * f64::from(i)).sin();
        let d = [
            0.2 * wave(1.1),
            0.2 * wave(2.3),
            wave(0.7) - 1.0,
            0.03 * wave(3.1),
            0.03 * wave(1.7),
            0.03 * wave(2.9),
        ];
        let w = |row: usize| 1.1 * stiffness[row].iter().zip(d).map(|(k, d)| k * d).sum::<f64>();
        let cells: Vec<String> = d.iter().copied().chain((0..5).map(w)).map(|v| v.to_string()).collect();
        text += &format!("{},\n", cells.join(","));
    }
    text
}

#[test]
fn a_measured_stiffness_replaces_the_nominal_one() {
    let bench = Bench::new();
    let ran = bench.run("calibrate-force", &pairs());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    let told: serde_json::Value = serde_json::from_slice(&ran.stdout).expect("JSON");
    assert_eq!(told["fit"]["refused"][0], "Mz: no reading");
    let text = fs::read_to_string(bench.path("constants.measured.json")).expect("measured constants");
    let (measured, nominal) = (Constants::from_str(&text).expect("constants"), thumb24());
    let (measured, nominal) = (measured.springs.expect("springs"), nominal.springs.expect("springs"));
    assert_eq!(measured.source, "measured");
    assert!((measured.stiffness[2][2] / nominal.stiffness[2][2] - 1.1).abs() < 1e-9);
    assert_eq!(measured.stiffness[5], nominal.stiffness[5]);
    // The plain runtime follows.
    let plain =
        |s: &constants::SpringConstants| s.plain_runtime.as_ref().expect("a plain runtime").stiffness[2][2];
    assert!((plain(&measured) / plain(&nominal) - 1.1).abs() < 0.03);
    // The nominal file stays as it was.
    assert_eq!(fs::read_to_string(bench.path("constants.json")).expect("constants"), thumb24().to_json());
}

/// Frames of thumb24 under a constant load, in `folder`.
fn draw(folder: &Path, load: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = format!(
        r#"{{"version": 1, "name": "load", "design": "{}", "frames": {{"count": 2, "rate_hz": 30}},
            "tolerance": {{"px": 0.05, "grey": 8}}, "motion": {{"wrench": [{{"time_s": 0, {load}}}]}},
            "why": {{"motion": "choice: a known load", "tolerance": "choice: half of a tracker's noise"}}}}"#,
        root.join("designs/thumb24.json").display()
    );
    let drawn = folder.with_extension("drawn");
    fs::create_dir_all(folder).expect("a folder");
    fs::write(folder.with_extension("json"), scene).expect("a scene");
    let ran = run(&[
        "simulate",
        &folder.with_extension("json").display().to_string(),
        "--out",
        &drawn.display().to_string(),
        "--quiet",
    ]);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    for frame in 0..2 {
        let name = format!("frame_{frame:04}.png");
        fs::copy(drawn.join(&name), folder.join(&name)).expect("a frame");
    }
}

#[test]
fn the_wizard_learns_from_a_load_refuses_a_wrong_one_and_goes_on() {
    let bench = Bench::new();
    draw(&bench.path("frames/01-rest"), r#""force_n": [0, 0, 0], "point_mm": [0, 0, 10]"#);
    draw(&bench.path("frames/02-weight"), r#""force_n": [0.4903325, 0, 0], "point_mm": [0, 0, 10]"#);
    let [constants, frames, session] =
        ["constants.json", "frames", "session"].map(|n| bench.path(n).display().to_string());
    let answer = |answers: &str| {
        bench.write("answers.txt", answers);
        let answers = bench.path("answers.txt").display().to_string();
        let ran = run(&[
            "--json",
            "calibrate",
            &format!("player:{frames}?rate=500"),
            "--constants",
            &constants,
            "--session",
            &session,
            "--answers",
            &answers,
        ]);
        let said: serde_json::Value = serde_json::from_slice(&ran.stdout).expect("JSON");
        (ran.status.code(), said)
    };
    let (code, early) = answer("weight 50 g +x at pole");
    assert_eq!((code, early["error"]["problem"].as_str()), (Some(1), Some("comes after rest")));
    let (code, rested) = answer("rest");
    assert_eq!(code, Some(0), "{rested}");
    assert!(rested["next"].as_str().expect("a load").starts_with("weight "));
    assert_eq!(rested["known"][0]["is_known"], false);
    let index = fs::read(bench.path("session/session.json")).expect("an index");
    let (code, wrong) = answer("weight 50 kg +x at pole");
    assert_eq!(code, Some(1));
    assert!(wrong["error"]["problem"].as_str().expect("words").contains("g instead of kg"), "{wrong}");
    for words in
        ["50 ounces +x at pole", "50 g sideways at pole", "50 g +x", "-1 g +x at pole", "50 g +x at 1,2"]
    {
        let (code, wrong) = answer(&format!("weight {words}"));
        let problem = wrong["error"]["problem"].as_str().unwrap_or_default().to_owned();
        assert!(code == Some(1) && problem.contains("the form is weight MASS UNIT"), "{words}: {wrong}");
    }
    assert_eq!(fs::read(bench.path("session/session.json")).expect("an index"), index);
    let (code, done) = answer("weight 50 g +x at pole\ndone");
    assert_eq!(code, Some(0), "{done}");
    assert_eq!(done["known"][0]["is_known"], true);
    assert!(done["surprises"][0].as_f64().expect("a number") < 10.0, "{done}");
    let text = fs::read_to_string(bench.path("session/constants.measured.json")).expect("constants");
    let measured = Constants::from_str(&text).expect("constants").springs.expect("springs");
    let nominal = thumb24().springs.expect("springs");
    assert_eq!(measured.source, "measured");
    assert!((measured.stiffness[0][0] / nominal.stiffness[0][0] - 1.0).abs() < 0.03);
    let page = fs::read_to_string(bench.path("session/calibration.html")).expect("a page");
    assert!(page.contains("weight 50 g +x at pole"));
}
