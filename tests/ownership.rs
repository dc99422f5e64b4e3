//! Nothing of a user's is changed or lost, whatever the command and however it ends.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::process::{Command, Stdio};
#[cfg(unix)]
use std::time::{Duration, Instant};

use common::domecast;

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/thumb24.json");

fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("the folder can be read") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path.clone());
            }
            found.insert(path.clone(), fs::read(&path).unwrap_or_default());
        }
    }
    found
}

/// Runs a command that must refuse its output, at once, by naming `named`.
fn refused(arguments: &[&str], folder: &Path, named: &str) {
    let before = contents(folder);
    let output = domecast(arguments, folder);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {message}");
    assert!(message.contains(named) && message.contains("allowed: "), "{arguments:?}: {message}");
    assert!(contents(folder) == before, "{arguments:?} changed a file");
}

#[test]
fn files_of_the_user_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let design = fs::read_to_string(DESIGN).expect("a design");
    fs::write(at("d.json"), design).expect("written");
    let scene = r#"{"version": 1, "name": "s", "design": "d.json", "frames": {"count": 1, "rate_hz": 30, "images": false},
        "tolerance": {"px": 0.5, "grey": 50}}"#;
    fs::write(at("s.json"), scene).expect("written");
    fs::write(at("m.csv"), "tx,ty,tz,rx,ry,rz,Fx,Fy,Fz,Mx,My,Mz\n").expect("written");
    for (name, text) in [
        ("frames/frame_0001.png", "mine"),
        ("frames/truth.jsonl", "mine"),
        ("thesis/thesis.tex", "three years"),
        ("thesis/manifest.json", r#"{"files": [{"path": "thesis.tex"}]}"#),
    ] {
        fs::create_dir_all(at(name).parent().expect("a folder")).expect("made");
        fs::write(at(name), text).expect("written");
    }
    let built = domecast(&["build", "d.json", "--out", "built", "--quiet"], folder.path());
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    fs::copy(at("built/constants/constants.json"), at("c.json")).expect("copied");
    fs::write(at("domecast.schema.json"), "mine").expect("written");

    let folder = folder.path();
    refused(&["simulate", "s.json", "--out", "frames"], folder, "frame_0001.png");
    refused(&["build", "d.json", "--out", "thesis"], folder, "thesis.tex");
    refused(&["build", "built/design.json", "--out", "built"], folder, "input");
    refused(&["simulate", "s.json", "--out", "built"], folder, "domecast build");
    refused(&["calibrate-force", "m.csv", "c.json", "--out", "m.csv"], folder, "input");
    refused(&["calibrate-force", "m.csv", "c.json", "--out", "c.json", "--force"], folder, "input");
    refused(&["calibrate-print", "m.csv", "d.json", "--out", "d.json"], folder, "input");
    refused(&["new", "n", "--out", "n.json"], folder, "domecast.schema.json");
    let track = ["track", "none.png", "--constants", "c.json"];
    refused(&[&track[..], &["--out", "s.json"]].concat(), folder, "s.json");
    refused(&[&track[..], &["--overlay", "thesis"]].concat(), folder, "thesis.tex");
    refused(&[&track[..], &["--undistorted", "built"]].concat(), folder, "domecast build");
    refused(&[&track[..], &["--overlay", "o", "--undistorted", "o"]].concat(), folder, "two results");
    refused(&["build", "d.json", "--out", "."], folder, "in which this command runs");
    refused(&["build", "d.json", "--out", "/"], folder, "/");

    // an edit is refused, and kept where the user asks for it
    fs::write(folder.join("built/parts/bom.csv"), "mine").expect("written");
    refused(&["build", "d.json", "--out", "built"], folder, "parts/bom.csv");
    let forced = domecast(&["build", "d.json", "--out", "built", "--force", "--quiet"], folder);
    assert!(forced.status.success());
    assert!(String::from_utf8_lossy(&forced.stderr).contains("built.bak-1"));
    assert_eq!(fs::read(folder.join("built.bak-1/parts/bom.csv")).expect("it is kept"), b"mine");
    assert!(domecast(&["check", "built"], folder).status.success());

    // a file that is missing everywhere but in the marker
    fs::remove_file(folder.join("built/parts/assembly.glb")).expect("removed");
    let text = fs::read_to_string(folder.join("built/manifest.json")).expect("the manifest");
    let mut manifest: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    manifest["files"].as_array_mut().expect("files").retain(|file| file["path"] != "parts/assembly.glb");
    fs::write(folder.join("built/manifest.json"), manifest.to_string()).expect("written");
    let checked = domecast(&["check", "built", "--quiet"], folder);
    assert!(String::from_utf8_lossy(&checked.stderr).contains("parts/assembly.glb"));
}

#[test]
fn a_single_file_of_ours_is_replaced_until_it_is_edited() {
    let folder = tempfile::tempdir().expect("a folder");
    let new = |force: &[&str]| domecast(&[&["new", "n", "--out", "n.json"], force].concat(), folder.path());
    assert!(new(&[]).status.success());
    // a design is never replaced unasked; its schema is
    assert!(String::from_utf8_lossy(&new(&[]).stderr).contains("exists"));
    fs::write(folder.path().join("n.json"), "mine").expect("written");
    assert!(new(&["--force"]).status.success());
    assert_eq!(fs::read(folder.path().join("n.json.bak-1")).expect("it is kept"), b"mine");
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 3);
}

#[cfg(unix)]
#[test]
fn whatever_ends_a_run_nothing_is_left() {
    use std::os::unix::process::ExitStatusExt;
    let folder = tempfile::tempdir().expect("a folder");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/scenes/still.json");
    let build: &[&str] = &["build", DESIGN, "--out", "deep/out"];
    // frames are written all the while
    let simulate: &[&str] = &["simulate", scene, "--frames", "2000", "--out", "deep/out"];
    let signals = [("-INT", 2), ("-TERM", 15), ("-KILL", 9)];
    for (command, (signal, number)) in [build, simulate].into_iter().flat_map(|c| signals.map(|s| (c, s))) {
        let mut child = Command::new(env!("CARGO_BIN_EXE_domecast"))
            .args(command)
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let began = Instant::now();
        let is_begun = || {
            let entries = fs::read_dir(folder.path()).expect("the folder");
            let mut hidden = entries.filter_map(|entry| Some(entry.ok()?.path()));
            hidden.any(|path| {
                let waits_for = if command == build { "target" } else { "draft/frame_0003.png" };
                path.to_string_lossy().contains("/.domecast-") && path.join(waits_for).exists()
            })
        };
        while !is_begun() {
            assert!(began.elapsed() < Duration::from_secs(60), "the result is made beside its place");
            std::thread::sleep(Duration::from_millis(1));
        }
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
        assert!(sent.success());
        let status = child.wait().expect("it ends");
        assert_eq!(status.signal(), Some(number), "as the signal would end it");
        let mut said = String::new();
        let stderr = child.stderr.take().expect("it is piped");
        std::io::Read::read_to_string(&mut { stderr }, &mut said).expect("text");
        assert!(!said.contains("error"), "a signal is no fault: {said}");
        if number == 9 {
            // any command that is run there ends what was begun, and says so
            let next = domecast(&["list", "cameras", "--quiet"], folder.path());
            assert!(String::from_utf8_lossy(&next.stderr).contains("deep/out: a run was stopped here"));
        }
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0, "{command:?} {signal}");
    }
    assert!(domecast(build, folder.path()).status.success());
    assert!(folder.path().join("deep/out/manifest.json").is_file());
}
