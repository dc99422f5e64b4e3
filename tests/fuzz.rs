//! Corrupt inputs through the program: whatever comes, it ends by itself, says what is wrong, changes nothing of the
//! user's, and leaves a whole result or none. 500 runs in every suite, the next 3,500 in the long one; a run is named by its
//! number, and `DOMECAST_FUZZ_RUN` repeats that one alone and keeps its folder.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use serde_json::{Value, json};

const REPOSITORY: &str = env!("CARGO_MANIFEST_DIR");
/// A run that takes longer hangs; a build on a busy machine takes some seconds.
const MAX_TIME: Duration = Duration::from_secs(120);

/// The generator of Marsaglia's "Xorshift RNGs" (2003), seeded by the run's number.
struct Random(u64);

impl Random {
    fn new(run: u64) -> Self {
        let mut random = Self(run.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d);
        for _ in 0..8 {
            random.below(2);
        }
        random
    }

    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 11) % end as u64) as usize
    }

    fn one_of<'a, T: ?Sized>(&mut self, list: &[&'a T]) -> &'a T {
        list[self.below(list.len())]
    }
}

/// Bytes changed, cut out, doubled, put in.
fn corrupt_bytes(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..1 + random.below(6) {
        let at = random.below(bytes.len() + 1);
        let end = (at + random.below(24)).min(bytes.len());
        match random.below(8) {
            0 => drop(bytes.drain(at..end)),
            1 => bytes.insert(at, random.below(256) as u8),
            2 => bytes.truncate(at),
            3 => {
                let copy = bytes[at..end].to_vec();
                bytes.splice(at..at, copy);
            }
            4 => {
                let texts = ["\u{feff}", "NaN", "1e999", "-0", "\"", "{", "]", ",", "\0", "\r\n", "é"];
                bytes.splice(at..at, random.one_of(&texts).bytes());
            }
            _ if at < bytes.len() => bytes[at] = random.below(256) as u8,
            _ => {}
        }
    }
}

/// Pointers of all values in a tree.
fn pointers(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Object(map) => {
            map.iter().for_each(|(key, value)| pointers(value, &format!("{at}/{key}"), found));
        }
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, value)| pointers(value, &format!("{at}/{i}"), found));
        }
        _ => {}
    }
}

/// Values of a JSON tree replaced, removed, exchanged.
fn corrupt_structure(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let Ok(mut tree) = serde_json::from_slice::<Value>(bytes) else { return bytes.to_vec() };
    for _ in 0..1 + random.below(3) {
        let mut all = Vec::new();
        pointers(&tree, "", &mut all);
        let (at, other) = (all[random.below(all.len())].clone(), all[random.below(all.len())].clone());
        let other = tree.pointer(&other).cloned().unwrap_or_default();
        let Some(value) = tree.pointer_mut(&at) else { continue };
        let scaled =
            value.as_f64().map(|number| number * [-1.0, 0.0, 1e-9, 0.5, 1.01, 3.0, 1e9][random.below(7)]);
        *value = match random.below(8) {
            0 => Value::Null,
            1 => json!([]),
            2 => json!("text"),
            3 => json!([1e308, -1e308, 5e-324, 1e15, -1.0][random.below(5)]),
            4 => other,
            _ => scaled.map_or_else(|| value.clone(), |number| json!(number)),
        };
        if let (0, Some((parent, key))) = (random.below(4), at.rsplit_once('/')) {
            match tree.pointer_mut(parent) {
                Some(Value::Object(map)) => drop(map.remove(key)),
                Some(Value::Array(list)) if !list.is_empty() => drop(list.pop()),
                _ => {}
            }
        }
    }
    tree.to_string().into_bytes()
}

/// Inputs that are whole, by their names.
fn seeds() -> &'static BTreeMap<&'static str, Vec<u8>> {
    static SEEDS: OnceLock<BTreeMap<&str, Vec<u8>>> = OnceLock::new();
    SEEDS.get_or_init(|| {
        let read = |path: &str| fs::read(Path::new(REPOSITORY).join(path)).expect("a seed");
        let folder = tempfile::tempdir().expect("a folder");
        let design = format!("{REPOSITORY}/designs/thumb24.json");
        let output = program(&["build", &design, "--out", "built", "--quiet"], folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let scene = json!({
            "version": 1, "name": "s", "design": design, "frames": {"count": 2, "rate_hz": 30, "images": false},
            "tolerance": {"px": 0.5, "grey": 50}, "contact": {"level": "geometric"},
            "objects": [{"name": "o", "shape": {"kind": "mesh", "file": "part.stl", "scale": 1.0},
                "path": [{"time_s": 0, "position_mm": [0, 0, 14]}, {"time_s": 1, "position_mm": [0, 0, 12]}]}],
        });
        let force: String = (0..40)
            .map(|i| {
                let d: Vec<f64> = (0..6).map(|j| 0.05 * f64::from((i * (j + 3)) % 11 - 5)).collect();
                format!("{},{},{},{},{},{},{},{},{},0,0,0\n", d[0], d[1], d[2], d[3], d[4], d[5], d[0], d[1], d[2])
            })
            .collect();
        let constants = fs::read(folder.path().join("built/constants/constants.json")).expect("constants");
        BTreeMap::from([
            ("design.json", read("designs/thumb24.json")),
            ("scene.json", scene.to_string().into_bytes()),
            ("points.csv", b"u,v\n320,240\n100,80\n-5,7\n".to_vec()),
            ("force.csv", format!("tx,ty,tz,rx,ry,rz,Fx,Fy,Fz,Mx,My,Mz\n{force}").into_bytes()),
            ("part.stl", tetrahedron()),
            ("constants.json", constants),
            ("frame_0000.png", read("tests/cases/frames/turned-on-its-side.png")),
        ])
    })
}

/// A tetrahedron of 8 mm as binary STL.
fn tetrahedron() -> Vec<u8> {
    let corners = [[0.0_f32, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0]];
    let mut bytes = vec![0; 80];
    bytes.extend(4_u32.to_le_bytes());
    for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]] {
        let numbers =
            [0.0_f32; 3].into_iter().chain(face.into_iter().flat_map(|corner: usize| corners[corner]));
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_domecast"))
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "1")
        .stdin(Stdio::null())
        .stdout(fs::File::create(folder.with_extension("stdout")).expect("a file"))
        .stderr(fs::File::create(folder.with_extension("stderr")).expect("a file"))
        .spawn()
        .expect("it starts");
    let began = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        if began.elapsed() > MAX_TIME {
            child.kill().expect("it ends");
            break child.wait().expect("a child");
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let read = |ending: &str| fs::read(folder.with_extension(ending)).expect("its output");
    Output { status, stdout: read("stdout"), stderr: read("stderr") }
}

/// Every file, folder and link below a folder.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("the folder can be read") {
            let path = entry.expect("an entry").path();
            let about = fs::symlink_metadata(&path).expect("an entry");
            if about.is_dir() {
                open.push(path.clone());
            }
            found.insert(
                path.clone(),
                if about.is_file() { fs::read(&path).expect("a file") } else { Vec::new() },
            );
        }
    }
    found
}

/// What may be done to the place of the result before the run.
fn prepare(out: &Path, is_folder: bool, random: &mut Random) {
    match (random.below(6), is_folder) {
        (0, true) => {
            fs::create_dir(out).expect("made");
            fs::write(out.join("truth.jsonl"), "mine").expect("written");
            fs::write(out.join("manifest.json"), r#"{"files": [{"path": "truth.jsonl"}]}"#).expect("written");
        }
        (1, true) => {
            // a marker of someone's making
            let mut marker = b"# domecast 0.1.0 build wrote this folder\n00  mine\n# seal 00\n".to_vec();
            corrupt_bytes(&mut marker, random);
            fs::create_dir(out).expect("made");
            fs::write(out.join("mine"), "mine").expect("written");
            fs::write(out.join(".domecast"), marker).expect("written");
        }
        (0, false) => fs::write(out, "mine").expect("written"),
        #[cfg(unix)]
        (2, _) => std::os::unix::fs::symlink("design.json", out).expect("linked"),
        _ => {}
    }
}

/// An earlier result in which one file, or its hash in the marker, was changed.
fn edited_result(out: &Path, random: &mut Random) {
    static EARLIER: OnceLock<BTreeMap<PathBuf, Vec<u8>>> = OnceLock::new();
    let earlier = EARLIER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, bytes) in seeds() {
            fs::write(folder.path().join(name), bytes).expect("written");
        }
        let track = ["track", "frame_0000.png", "--constants", "constants.json", "--overlay", "o", "--quiet"];
        let output = program(&track, folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found = contents(&folder.path().join("o"));
        found.into_iter().map(|(path, bytes)| (path.file_name().expect("a name").into(), bytes)).collect()
    });
    let _ = fs::remove_dir_all(out);
    fs::create_dir(out).expect("made");
    let edited = random.below(earlier.len());
    for (index, (name, bytes)) in earlier.iter().enumerate() {
        let mut changed = bytes.clone();
        while index == edited && changed == *bytes {
            corrupt_bytes(&mut changed, random);
        }
        fs::write(out.join(name), changed).expect("written");
    }
}

/// One run; whether it was done, and what is wrong with it.
fn faults(run: u64, place: &Path) -> (bool, Vec<String>) {
    let mut random = Random::new(run);
    // name of the corrupt input, arguments, the result and whether it is a folder
    type Plan<'a> = (&'a str, &'a [&'a str], Option<(&'a str, bool)>);
    let plans: [Plan<'_>; 12] = [
        ("design.json", &["trace", "design.json", "--pixels", "points.csv"], None),
        ("design.json", &["explain", "pattern", "--design", "design.json"], None),
        ("design.json", &["new", "n", "--from", "design.json", "--out", "n.json"], Some(("n.json", false))),
        (
            "design.json",
            &["calibrate-print", "points.csv", "design.json", "--out", "p.json"],
            Some(("p.json", false)),
        ),
        ("points.csv", &["trace", "design.json", "--pixels", "points.csv"], None),
        ("force.csv", &["calibrate-force", "force.csv", "constants.json", "--out", "c"], Some(("c", false))),
        (
            "constants.json",
            &["calibrate-force", "force.csv", "constants.json", "--out", "c"],
            Some(("c", false)),
        ),
        (
            "constants.json",
            &["track", "frame_0000.png", "--constants", "constants.json", "--out", "t"],
            Some(("t", false)),
        ),
        (
            "frame_0000.png",
            &["track", "frame_0000.png", "--constants", "constants.json", "--overlay", "o"],
            Some(("o", true)),
        ),
        ("scene.json", &["simulate", "scene.json", "--out", "out"], Some(("out", true))),
        ("part.stl", &["simulate", "scene.json", "--out", "out"], Some(("out", true))),
        ("design.json", &["build", "design.json", "--out", "out"], Some(("out", true))),
    ];
    // builds and simulations that succeed take seconds: fewer of them
    let index = random.below(200);
    let plan = match index {
        0 | 1 => 11,
        2..8 => 9 + index % 2,
        _ => random.below(9),
    };
    let (corrupt, arguments, result) = plans[plan];

    let folder = place.join("run");
    fs::create_dir(&folder).expect("made");
    for (name, bytes) in seeds() {
        let mut bytes = bytes.clone();
        if *name == corrupt {
            bytes = if random.below(2) == 0 { corrupt_structure(&bytes, &mut random) } else { bytes };
            if random.below(2) == 0 {
                corrupt_bytes(&mut bytes, &mut random);
            }
        }
        fs::write(folder.join(name), bytes).expect("written");
    }
    if let Some((name, is_folder)) = result {
        prepare(&folder.join(name), is_folder, &mut random);
    }
    if plan == 8 && !folder.join("o").is_symlink() {
        edited_result(&folder.join("o"), &mut random);
    }
    let before = contents(&folder);
    let output = program(arguments, &folder);
    let after = contents(&folder);

    let mut faults = Vec::new();
    let code = output.status.code();
    if !matches!(code, Some(0..=2)) {
        faults.push(format!("exit {code:?}"));
    }
    if code != Some(0) && output.stderr.is_empty() {
        faults.push("it fails and does not say why".into());
    }
    for (path, bytes) in &before {
        if after.get(path) != Some(bytes) {
            faults.push(format!("{} is changed or lost", path.display()));
        }
    }
    let out = result.map(|(name, _)| folder.join(name));
    let schema = folder.join("domecast.schema.json");
    for path in after.keys().filter(|path| !before.contains_key(*path)) {
        let is_result =
            out.as_ref().is_some_and(|out| path.starts_with(out)) || (plan == 2 && *path == schema);
        if !is_result || code != Some(0) {
            // frames that cannot be read are an answer, and it is written
            if !(is_result && corrupt == "frame_0000.png") {
                faults.push(format!("{} is left behind", path.display()));
            }
        }
    }
    if let (Some(0), Some(out)) = (code, &out)
        && out.is_dir()
        && !out.join(".domecast").is_file()
    {
        faults.push("the result has no marker".into());
    }
    if !faults.is_empty() {
        faults.push(format!(
            "run {run}: {}: {}",
            arguments.join(" "),
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    (code == Some(0), faults)
}

fn fuzz(runs: Range<u64>) {
    let asked = std::env::var("DOMECAST_FUZZ_RUN").ok().and_then(|run| run.parse().ok());
    let runs: Vec<u64> = asked.map_or_else(|| runs.collect(), |run: u64| vec![run]);
    seeds();
    let ended: Vec<(bool, Vec<String>)> = runs
        .par_iter()
        .map(|run| {
            let place = tempfile::tempdir().expect("a folder");
            let found = faults(*run, place.path());
            if asked.is_some() {
                println!("kept: {}", place.keep().display());
            }
            found
        })
        .collect();
    let done = ended.iter().filter(|(done, _)| *done).count();
    let wrong: Vec<String> = ended.into_iter().flat_map(|(_, wrong)| wrong).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    println!("{done} of {} runs were done, the others refused", runs.len());
    // neither are all inputs so corrupt that nothing is tried, nor so whole that nothing is refused
    assert!(runs.len() == 1 || (runs.len() / 20..runs.len() / 2).contains(&done), "{done} were done");
}

#[test]
fn corrupt_inputs_lose_nothing() {
    fuzz(0..500);
}

#[test]
fn long_corrupt_inputs_lose_nothing() {
    // the first ones are the test above
    fuzz(500..2_000);
}
