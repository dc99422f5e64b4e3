//! `domecast track` from outside: files, streams, formats, exit codes.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use domecast::numeric::Rigid;
use serde_json::Value;

use super::render::{Picture, still};
use super::{SENSOR, drawn, pose};

pub(super) fn png(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, 640, 480);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
    out
}

pub(super) fn run(folder: &Path, arguments: &[&str], input: &[u8]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_domecast"))
        .current_dir(folder)
        .arg("track")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    std::thread::scope(|scope| {
        // A program that stops early closes the pipe: that is its answer.
        scope.spawn(move || {
            let _ = stdin.write_all(input);
        });
        child.wait_with_output().unwrap()
    })
}

pub(super) fn lines(output: &Output) -> Vec<Value> {
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn frames_of_every_kind_come_in() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("constants.json"), SENSOR.constants.to_json()).unwrap();
    std::fs::create_dir(at("seq")).unwrap();
    let mut raw = Vec::new();
    let mut pnm = Vec::new();
    for number in 0..6_u64 {
        let drawn =
            drawn(&Picture { seed: number, ..still(pose([0.0, 0.0, -0.1 * number as f64], [0.0; 3])) });
        raw.extend_from_slice(&drawn.bytes);
        pnm.extend_from_slice(b"P6\n# a frame\n640 480 255\n");
        pnm.extend(drawn.bytes.iter().flat_map(|v| [*v; 3]));
        let file = png(&drawn.bytes);
        let path = at("seq").join(format!("frame_{number:04}.png"));
        match number {
            2 => std::fs::write(path, &file[..file.len() / 2]).unwrap(),
            3 => std::fs::write(path, b"no picture at all").unwrap(),
            4 => {}
            _ => std::fs::write(path, &file).unwrap(),
        }
    }
    // A folder with a cut file, a broken one and a hole.
    let output = run(
        folder.path(),
        &["seq", "--constants", "constants.json", "--overlay", "o", "--undistorted", "u"],
        b"",
    );
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told: Vec<(u64, String)> = lines(&output)
        .iter()
        .map(|l| (l["frame"].as_u64().unwrap(), l["status"].as_str().unwrap().to_owned()))
        .collect();
    let want = [(0, "ok"), (1, "ok"), (2, "unreadable"), (3, "unreadable"), (5, "gap")];
    assert_eq!(told, want.map(|(n, s)| (n, s.to_owned())));
    let first = &lines(&output)[1];
    for name in ["pose", "wrench", "wrench_sd", "black_dots", "white_markers"] {
        assert!(first[name].is_array(), "{name}");
    }
    let dot = &first["black_dots"][0];
    assert!(
        dot["image_px"][0].is_number()
            && dot["motion_px"][1].is_number()
            && dot["displacement_mm"][2].is_number()
    );
    for (dir, name, size) in
        [("o", "overlay_0001.png", (1280, 960)), ("u", "undistorted_0001.png", (640, 480))]
    {
        let file = std::fs::File::open(at(dir).join(name)).unwrap();
        let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), size);
    }
    // Raw from a pipe, its last frame cut short; the same as pictures.
    let raw_run = run(
        folder.path(),
        &["-", "--raw", "640x480:gray", "--constants", "constants.json"],
        &raw[..raw.len() - 1000],
    );
    let raw_lines = lines(&raw_run);
    assert_eq!((raw_run.status.code(), raw_lines.len()), (Some(0), 6));
    assert_eq!(raw_lines[5]["status"], "unreadable");
    let pnm_lines = lines(&run(folder.path(), &["-", "--constants", "constants.json"], &pnm));
    assert_eq!(pnm_lines.len(), 6);
    assert_eq!(raw_lines[..5], pnm_lines[..5]);
    // Tables.
    let csv = run(
        folder.path(),
        &["seq", "--constants", "constants.json", "--format", "csv", "--out", "w.csv", "--json"],
        b"",
    );
    let summary: Value = serde_json::from_slice(&csv.stdout).unwrap();
    assert_eq!((&summary["frames"], &summary["status"]["ok"]), (&Value::from(5), &Value::from(2)));
    let text = std::fs::read_to_string(at("w.csv")).unwrap();
    let cells: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
    assert_eq!(cells, vec![27; 6]);
    run(
        folder.path(),
        &["seq", "--constants", "constants.json", "--format", "dots-csv", "--out", "d.csv"],
        b"",
    );
    let text = std::fs::read_to_string(at("d.csv")).unwrap();
    assert_eq!(text.lines().count(), 1 + 5 * SENSOR.constants.black_dots.len());
    assert!(text.lines().all(|l| l.split(',').count() == 10));
    // Records of one size, on standard output too.
    let told = run(folder.path(), &["seq", "--constants", "constants.json", "--format", "records"], b"");
    assert_eq!(told.stdout.len(), 5 * domecast::track::RECORD_BYTES);
}

#[test]
fn bad_calls_are_told_with_their_exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("constants.json"), SENSOR.constants.to_json()).unwrap();
    std::fs::write(
        at("absurd.json"),
        SENSOR.constants.to_json().replacen("\"radius_px\": 240", "\"radius_px\": -1", 1),
    )
    .unwrap();
    std::fs::create_dir(at("empty")).unwrap();
    let good = drawn(&still(Rigid::identity()));
    std::fs::write(at("a.png"), png(&good.bytes)).unwrap();
    std::fs::write(at("b.png"), b"x").unwrap();
    std::fs::write(at("v.avi"), b"no video").unwrap();
    for (arguments, code, word) in [
        (&["a.png", "--constants", "none.json"][..], 1, "none.json"),
        (&["a.png", "--constants", "absurd.json"], 1, "mask"),
        (&["empty", "--constants", "constants.json"], 1, "empty"),
        (&["b.png", "--constants", "constants.json"], 1, "b.png"),
        (&["v.avi", "--constants", "constants.json"], 1, "v.avi"),
        (&["a.png", "v.avi", "--constants", "constants.json"], 0, ""),
        (&["-", "--constants", "constants.json"], 1, "no frame"),
        (&["a.png"], 2, "constants"),
        (&["-", "--raw", "640", "--constants", "constants.json"], 2, "WIDTHxHEIGHT"),
    ] {
        let output = run(folder.path(), arguments, b"");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {told}");
        assert!(told.contains(word), "{arguments:?}: {told}");
    }
}
