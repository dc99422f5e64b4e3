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
