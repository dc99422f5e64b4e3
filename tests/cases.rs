//! Cases that are files: `tests/cases/<topic>/<name>.json` holds an input that is at fault (or hard) and what the
//! program must answer; `tests/cases/README.md` says how to add one. A failure names the file of its case.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use rayon::prelude::*;
use serde::Deserialize;
use serde_json::{Map, Value};

use common::domecast;

const REPOSITORY: &str = env!("CARGO_MANIFEST_DIR");

/// What all cases of a topic share: `tests/cases/<topic>/topic.json`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Topic {
    /// the arguments of the program, where the case names no others
    run: Option<Vec<String>>,
    /// the file that is made from the base and the case's changes, or copied from beside the case; `*` stands
    /// for the ending of the file beside it
    input: Option<String>,
    /// a file below the repository, or the JSON itself
    base: Option<Value>,
    /// files that stand in the folder before
    #[serde(default)]
    files: BTreeMap<String, Value>,
    exit: i32,
    /// how each message begins
    begins: Option<String>,
    /// what each message says
    #[serde(default)]
    says: Vec<String>,
}

/// One case: how its input differs from the topic's base, and the answer.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// what the case is about, where its name does not say it
    #[serde(default, rename = "why")]
    _why: String,
    run: Option<Vec<String>>,
    /// values by JSON pointer
    #[serde(default)]
    set: Map<String, Value>,
    /// JSON pointers of what is left out
    #[serde(default)]
    remove: Vec<String>,
    /// (text, other text), each once in the input's text
    #[serde(default)]
    replace: Vec<(String, String)>,
    #[serde(default)]
    files: BTreeMap<String, Value>,
    exit: Option<i32>,
    #[serde(default)]
    says: Vec<String>,
    /// parts of the page's warnings, where the program goes on all the same
    #[serde(default)]
    warns: Vec<String>,
    /// parts of standard output
    #[serde(default)]
    prints: Vec<String>,
    /// values in the JSON on standard output, by pointer
    #[serde(default)]
    json: Map<String, Value>,
    /// the same for each line of standard output
    json_lines: Option<Vec<Map<String, Value>>>,
}

/// A build of thumb24, for cases that start from its files.
fn built() -> &'static Path {
    static BUILT: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = BUILT.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let design = format!("{REPOSITORY}/designs/thumb24.json");
        let output = domecast(&["build", &design, "--out", "thumb24", "--quiet"], folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        folder
    });
    folder.path()
}

/// The text with the places that it names: `{repository}`, and `{built}` with its folder `thumb24`.
fn with_places(text: &str) -> String {
    let text = text.replace("{repository}", REPOSITORY);
    if text.contains("{built}") { text.replace("{built}", &built().display().to_string()) } else { text }
}

/// A file's bytes from what a case says of it: text as it stands, a copy of another file, or JSON.
fn bytes_of(value: &Value) -> Vec<u8> {
    match value {
        Value::String(text) => match text.strip_prefix("copy ") {
            Some(path) => fs::read(with_places(path)).unwrap_or_else(|error| panic!("{path}: {error}")),
            None => with_places(text).into_bytes(),
        },
        other => with_places(&other.to_string()).into_bytes(),
    }
}

/// The topic's base with the case's changes.
fn changed(base: &[u8], case: &Case) -> Vec<u8> {
    if case.set.is_empty() && case.remove.is_empty() && case.replace.is_empty() {
        return base.to_vec();
    }
    let mut text = String::from_utf8(base.to_vec()).expect("the base is text");
    for (from, to) in &case.replace {
        assert!(text.contains(from.as_str()), "\"{from}\" is not in the base");
        text = text.replacen(from.as_str(), to, 1);
    }
    if case.set.is_empty() && case.remove.is_empty() {
        return text.into_bytes();
    }
    let mut value: Value = serde_json::from_str(&text).expect("the base is JSON");
    for pointer in &case.remove {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let parent = value.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent} in the base"));
        let removed = match parent {
            Value::Object(map) => map.remove(key),
            Value::Array(list) => Some(list.remove(key.parse().expect("an index"))),
            _ => None,
        };
        assert!(removed.is_some(), "no {pointer} in the base");
    }
    for (pointer, new) in &case.set {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let new: Value = serde_json::from_slice(&bytes_of_json(new)).expect("JSON");
        match value.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent} in the base")) {
            Value::Object(map) => drop(map.insert(key.to_owned(), new)),
            Value::Array(list) => list[key.parse::<usize>().expect("an index")] = new,
            other => panic!("{other} has no members"),
        }
    }
    value.to_string().into_bytes()
}

fn bytes_of_json(value: &Value) -> Vec<u8> {
    with_places(&value.to_string()).into_bytes()
}

/// Every file below a folder, with its bytes.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("the folder can be read") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                found.insert(path.clone(), Vec::new());
                open.push(path);
            } else {
                let bytes = fs::read(&path).expect("the file can be read");
                found.insert(path, bytes);
            }
        }
    }
    found
}

/// The page's verdict, which has its warnings, as text.
fn page_warnings(page: &Path) -> String {
    let page = fs::read_to_string(page).expect("a page");
    let start = page.find("id=\"verdict\"").expect("a verdict");
    page[start..].split("</section>").next().expect("its text").to_owned()
}

/// Lays out a case's files in a folder; returns the input's name.
fn lay_out(topic: &Topic, case: &Case, raw: Option<&Path>, folder: &Path) -> String {
    for (name, value) in topic.files.iter().chain(&case.files) {
        let path = folder.join(name);
        if value.is_null() {
            fs::create_dir_all(&path).expect("made");
        } else {
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(&path, bytes_of(value)).expect("written");
        }
    }
    let Some(name) = &topic.input else { return String::new() };
    let ending = raw.and_then(Path::extension).unwrap_or_default().to_string_lossy();
    let name = name.replace('*', &ending);
    let base = match &topic.base {
        Some(Value::String(path)) => fs::read(with_places(path)).expect("the base can be read"),
        Some(json) => bytes_of_json(json),
        None => Vec::new(),
    };
    let bytes = raw.map_or_else(|| changed(&base, case), |path| fs::read(path).expect("it can be read"));
    fs::write(folder.join(&name), bytes).expect("written");
    name
}

/// What is wrong with standard output.
fn faults_of_output(case: &Case, printed: &str) -> Vec<String> {
    let mut faults = Vec::new();
    for part in &case.prints {
        if !printed.contains(&with_places(part)) {
            faults.push(format!("standard output lacks \"{part}\""));
        }
    }
    let mut compare = |json: &str, values: &Map<String, Value>| {
        let json: Value = serde_json::from_str(json).unwrap_or_default();
        for (pointer, value) in values {
            match json.pointer(pointer) {
                Some(found) if found == value => {}
                Some(found) => faults.push(format!("{pointer} is {found}, not {value}")),
                None => faults.push(format!("{pointer} is missing, and should be {value}")),
            }
        }
    };
    if !case.json.is_empty() {
        compare(printed, &case.json);
    }
    if let Some(lines) = &case.json_lines {
        for (line, values) in printed.lines().zip(lines) {
            compare(line, values);
        }
        if printed.lines().count() != lines.len() {
            faults.push(format!("not {} lines on standard output", lines.len()));
        }
    }
    faults
}

/// What is wrong with the answer to a case; empty if nothing is.
fn faults(topic: &Topic, case: &Case, raw: Option<&Path>) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let input = lay_out(topic, case, raw, folder.path());
    let before = contents(folder.path());

    let run = case.run.as_ref().or(topic.run.as_ref()).expect("the topic or the case says what to run");
    let run: Vec<String> =
        run.iter().map(|argument| with_places(&argument.replace("{input}", &input))).collect();
    let arguments: Vec<&str> = run.iter().map(String::as_str).collect();
    let output = domecast(&arguments, folder.path());
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    let printed = String::from_utf8(output.stdout).expect("UTF-8");

    let mut faults = Vec::new();
    let mut expect = |holds: bool, fault: String| faults.extend((!holds).then_some(fault));
    let exit = case.exit.unwrap_or(topic.exit);
    expect(output.status.code() == Some(exit), format!("exit code {:?}, not {exit}", output.status.code()));
    for part in case.says.iter().chain(topic.says.iter().filter(|_| exit == topic.exit)) {
        expect(message.contains(&with_places(part)), format!("the message does not say \"{part}\""));
    }
    faults.extend(faults_of_output(case, &printed));
    let mut expect = |holds: bool, fault: String| faults.extend((!holds).then_some(fault));
    if exit == 1 && run.iter().any(|argument| argument == "--json") {
        expect(message.is_empty(), "with --json, something stands on standard error".to_owned());
        let json: Value = serde_json::from_str(&printed).unwrap_or_default();
        expect(json.pointer("/error/message").is_some(), "the JSON holds no error".to_owned());
    } else if exit == 1 {
        expect(message.trim_end().lines().count() == 1, "the message is not one line".to_owned());
        if let Some(start) = &topic.begins {
            expect(message.starts_with(start.as_str()), format!("the message does not begin with {start}"));
        }
        let is_silent = case.prints.is_empty() && case.json.is_empty() && case.json_lines.is_none();
        expect(!is_silent || printed.is_empty(), "something stands on standard output".to_owned());
    }
    if exit != 0 {
        expect(contents(folder.path()) == before, "files were written, changed or lost".to_owned());
    }
    if !case.warns.is_empty() {
        let told = page_warnings(&folder.path().join("out/report/index.html"));
        for part in &case.warns {
            expect(told.contains(part.as_str()), format!("the page does not warn of \"{part}\": {told}"));
        }
    }
    if !faults.is_empty() {
        faults.push(format!("message: {}", message.trim_end()));
        faults
            .push(format!("standard output: {}", printed.chars().take(2000).collect::<String>().trim_end()));
    }
    faults
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> T {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Runs every case of a topic; `DOMECAST_CASE` in the environment picks those whose name contains it.
fn run_topic(name: &str) {
    let folder = Path::new(REPOSITORY).join("tests/cases").join(name);
    let topic: Topic = read(&folder.join("topic.json"));
    // <name>.json says what is expected; another <name>.* is the input as it stands
    let (mut cases, mut inputs) = (BTreeMap::new(), BTreeMap::new());
    for entry in fs::read_dir(&folder).expect("the topic's folder") {
        let path = entry.expect("an entry").path();
        let file = path.file_name().expect("a name").to_string_lossy().into_owned();
        match file.split_once('.') {
            Some(("topic", _)) | None => {}
            Some((case, "json")) => drop(cases.insert(case.to_owned(), path)),
            Some((case, _)) => drop(inputs.insert(case.to_owned(), path)),
        }
    }
    assert!(!cases.is_empty(), "{name} has no cases");
    for (input, path) in &inputs {
        assert!(cases.contains_key(input), "{}: no {input}.json says what is expected", path.display());
    }
    let picked = std::env::var("DOMECAST_CASE").unwrap_or_default();
    let wrong: Vec<String> = cases
        .par_iter()
        .filter(|(case, _)| case.contains(&picked))
        .filter_map(|(case, path)| {
            let faults = faults(&topic, &read(path), inputs.get(case).map(PathBuf::as_path));
            (!faults.is_empty())
                .then(|| format!("tests/cases/{name}/{case}.json:\n  {}", faults.join("\n  ")))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

#[test]
fn designs() {
    run_topic("designs");
}

#[test]
fn scenes() {
    run_topic("scenes");
}

#[test]
fn constants() {
    run_topic("constants");
}

#[test]
fn tables() {
    run_topic("tables");
}

#[test]
fn frames() {
    run_topic("frames");
}

#[test]
fn points() {
    run_topic("points");
}

#[test]
fn arguments() {
    run_topic("arguments");
}

#[test]
fn calibrations() {
    run_topic("calibrations");
}

#[test]
fn mounts() {
    run_topic("mounts");
}

#[test]
fn every_topic_is_run() {
    let mut found = Vec::new();
    for entry in fs::read_dir(Path::new(REPOSITORY).join("tests/cases")).expect("the cases") {
        let path = entry.expect("an entry").path();
        if path.join("topic.json").is_file() {
            found.push(path.file_name().expect("a name").to_string_lossy().into_owned());
        }
    }
    found.sort();
    assert_eq!(
        found,
        [
            "arguments",
            "calibrations",
            "constants",
            "designs",
            "frames",
            "mounts",
            "points",
            "scenes",
            "tables"
        ]
    );
}
