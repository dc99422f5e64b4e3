//! The order of the code: which crate may know which, no files that import each other in a circle, no two
//! public types of one name, nothing too long, the field's words.

mod modules;
mod of_itself;
mod tokens;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use modules::{Crate, Import};
use tokens::{after_group, tokens, without_tests};

/// The crates from the ground up; each may depend on those named beside it and on no others of ours.
const CRATES: [(&str, &[&str]); 9] = [
    ("optics", &[]),
    ("mesh", &[]),
    ("springs", &["optics"]),
    ("runtime", &["optics", "springs"]),
    ("design", &["mesh", "optics", "springs"]),
    ("contact", &["mesh", "optics", "springs"]),
    ("sim", &["contact", "design", "mesh", "optics", "springs"]),
    ("fab", &["design", "mesh", "optics", "runtime", "sim", "springs"]),
    ("cli", &["contact", "design", "fab", "mesh", "optics", "runtime", "sim", "springs"]),
];

const MAX_FILE_LINES: usize = 400;
const MAX_FUNCTION_LINES: usize = 80;

/// Functions that are one table, and may be longer.
const TABLES: [&str; 0] = [];

/// Where data runs through stages: the crate, the folder of the stages, and they in order.
const STAGES: [(&str, &str, &[&str]); 1] =
    [("sim", "sim", &["scene", "contact", "light", "raster", "electronics", "output"])];

/// Words of our own for what has a name in the field, and that name.
const WORDS: [(&str, &str); 20] = [
    ("beaten", "dominated"),
    ("bought", "purchased"),
    ("carrier", "projector"),
    ("dent", "displacement map"),
    ("dents", "displacement map"),
    ("dice", "seeded generator"),
    ("foreseen", "predicted"),
    ("foretold", "interpolated, predicted"),
    ("glance", "exposure statistics"),
    ("ladder", "sweep"),
    ("ladders", "sweep"),
    ("least", "min"),
    ("lit", "shading, shaded"),
    ("rests", "interpolation error"),
    ("rung", "sample, level"),
    ("rungs", "samples, levels"),
    ("surplus", "residual scale"),
    ("suspicion", "lint"),
    ("suspicions", "lints"),
    ("told", "interpolated, predicted; or say what is written"),
];

/// The folder of the workspace.
fn workspace() -> PathBuf {
    // at run time first, so that a program built in one checkout can judge another
    let set = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    set.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")))
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The path as seen from the workspace.
fn short(path: &Path) -> String {
    let root = workspace();
    path.strip_prefix(&root).unwrap_or(path).display().to_string().replace('\\', "/")
}

/// Every Rust file below these folders of the workspace.
fn rust_files(folders: &[&str]) -> Vec<PathBuf> {
    let mut open: Vec<PathBuf> = folders.iter().map(|folder| workspace().join(folder)).collect();
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "no Rust files in {folders:?}");
    found
}

/// The members of the workspace, as folders below `src`.
fn members() -> Vec<String> {
    let manifest = text(&workspace().join("Cargo.toml"));
    let list = manifest.split("members = [").nth(1).and_then(|rest| rest.split(']').next());
    let list = list.expect("the workspace lists its members");
    list.split('"').skip(1).step_by(2).map(|path| path.trim_start_matches("src/").to_owned()).collect()
}

/// Each crate with its name: the members, then the facade and the program.
fn crates() -> Vec<(String, Crate)> {
    let src = workspace().join("src");
    let mut all: Vec<(String, Crate)> = members()
        .into_iter()
        .map(|name| {
            let read = Crate::read(&src.join(&name).join("lib.rs"));
            (name, read)
        })
        .collect();
    all.push(("domecast".to_owned(), Crate::read(&src.join("lib.rs"))));
    all.push(("domecast (program)".to_owned(), Crate::read(&src.join("main.rs"))));
    all
}

#[track_caller]
fn assert_none(faults: &[String], rule: &str) {
    assert!(faults.is_empty(), "{rule}; {} at fault:\n{}\n", faults.len(), faults.join("\n"));
}

#[test]
fn crates_depend_only_on_those_below() {
    let names: Vec<&str> = CRATES.iter().map(|(name, _)| *name).collect();
    let members = members();
    assert_eq!(
        members.iter().map(String::as_str).collect::<BTreeSet<_>>(),
        names.iter().copied().collect(),
        "each member of the workspace has a row in CRATES"
    );
    let mut faults = Vec::new();
    for (name, allowed) in CRATES {
        let manifest = text(&workspace().join("src").join(name).join("Cargo.toml"));
        // dependencies, those for tests included
        let used = manifest.lines().filter_map(|line| line.trim().strip_prefix("domecast-"));
        for other in used.map(|rest| rest.split(['.', ' ', '=']).next().unwrap_or_default()) {
            if !allowed.contains(&other) {
                faults.push(format!("  {name} depends on {other}"));
            }
        }
        let below = &names[..names.iter().position(|other| *other == name).expect("it is listed")];
        assert!(allowed.iter().all(|other| below.contains(other)), "CRATES is in order at {name}");
    }
    assert_none(&faults, "a crate depends only on crates that CRATES allows it");
}

/// Who imports whom: each file, or each module, with the names it takes from others.
type Graph = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// The imports as a graph between what `node` makes of a file; what has no node stays out.
fn graph(imports: &BTreeSet<Import>, node: impl Fn(&Path) -> Option<String>) -> Graph {
    let mut graph = Graph::new();
    for import in imports {
        if let (Some(from), Some(to)) = (node(&import.from), node(&import.to))
            && from != to
        {
            graph.entry(from).or_default().entry(to).or_default().insert(import.name.clone());
        }
    }
    graph
}

/// Groups of more than one node in which each imports, directly or not, every other.
fn circles(graph: &Graph) -> Vec<BTreeSet<&String>> {
    let reach = |start| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(node) = open.pop() {
            open.extend(
                graph.get(node).into_iter().flat_map(BTreeMap::keys).filter(|next| seen.insert(*next)),
            );
        }
        seen
    };
    let reach: BTreeMap<&String, BTreeSet<&String>> = graph.keys().map(|node| (node, reach(node))).collect();
    let is_mutual =
        |a: &String, b: &String| reach[a].contains(b) && reach.get(b).is_some_and(|r| r.contains(a));
    let groups =
        reach.keys().map(|node| reach[node].iter().filter(|o| is_mutual(node, o)).copied().collect());
    let groups: BTreeSet<BTreeSet<&String>> = groups.collect();
    groups.into_iter().filter(|group| !group.is_empty()).collect()
}

/// Each circle as lines of text: who, from whom, which names.
fn circles_of(name: &str, graph: &Graph) -> Vec<String> {
    let mut faults = Vec::new();
    for group in circles(graph) {
        faults.push(format!("{name}: {} in one circle", group.len()));
        for from in &group {
            for (to, names) in graph[*from].iter().filter(|(to, _)| group.contains(to)) {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                faults.push(format!("  {from} <- {to}: {}", names.join(", ")));
            }
        }
    }
    faults
}

#[test]
fn files_do_not_import_each_other_in_a_circle() {
    let (mut faults, mut files) = (Vec::new(), 0);
    for (name, read) in crates() {
        files += read.modules.len();
        faults.extend(circles_of(&name, &graph(&read.imports(), |file| Some(short(file)))));
    }
    assert!(files > 100, "the modules were found: {files}");
    assert_none(&faults, "no circles of imports (to read as: the file <- the file it imports from: names)");
}

/// The part of a crate that a file belongs to: the folder or file right below the crate's own folder.
fn part_of(file: &Path) -> Option<String> {
    let path = short(file);
    let mut parts = path.split('/').skip(2);
    parts.next().map(|part| part.trim_end_matches(".rs").to_owned()).filter(|part| part != "lib")
}

#[test]
fn folders_do_not_import_each_other_in_a_circle() {
    let mut faults = Vec::new();
    for (name, read) in crates() {
        faults.extend(circles_of(&name, &graph(&read.imports(), part_of)));
    }
    assert_none(&faults, "no circles between the folders of a crate (to read as: this <- that: names)");
}

#[test]
fn stages_know_only_those_before_them() {
    let mut faults = Vec::new();
    for (name, folder, stages) in STAGES {
        let root = workspace().join("src").join(folder);
        for stage in stages {
            if !root.join(stage).is_dir() && !root.join(format!("{stage}.rs")).is_file() {
                faults.push(format!("  {folder} has no stage {stage}"));
            }
        }
        let (_, read) = crates().into_iter().find(|(other, _)| other == name).expect("the crate is there");
        let order = |file: &Path| {
            let below = file.strip_prefix(&root).ok()?.components().next()?.as_os_str().to_string_lossy();
            stages.iter().position(|stage| below.trim_end_matches(".rs") == *stage)
        };
        for import in read.imports() {
            if let (Some(from), Some(to)) = (order(&import.from), order(&import.to))
                && to > from
            {
                faults.push(format!("  {} <- {}: {}", short(&import.from), short(&import.to), import.name));
            }
        }
    }
    assert_none(&faults, "data runs one way: a stage knows only the types of those before it");
}

#[test]
fn every_file_belongs_to_a_crate() {
    let mut known: BTreeSet<PathBuf> = BTreeSet::new();
    for (_, read) in crates() {
        known.extend(read.modules.iter().map(|module| module.file.clone()));
        known.extend(read.test_files);
    }
    let orphans: Vec<String> =
        rust_files(&["src"]).iter().filter(|path| !known.contains(*path)).map(|path| short(path)).collect();
    assert_none(&orphans, "every file below src is a module of a crate");
}

#[test]
fn no_two_public_types_share_a_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (_, read) in crates() {
        for module in &read.modules {
            for found in &module.types {
                let place = format!("{}:{}", short(&module.file), found.line);
                places.entry(found.name.clone()).or_default().push(place);
            }
        }
    }
    assert!(places.len() > 100, "the types were found");
    let shared = places.iter().filter(|(_, places)| places.len() > 1);
    let faults: Vec<String> =
        shared.map(|(name, places)| format!("  {name}: {}", places.join(", "))).collect();
    assert_none(&faults, "a public type's name stands once in the workspace");
}

#[test]
fn no_file_is_too_long() {
    let mut faults = Vec::new();
    for path in rust_files(&["src", "tests", "benches"]) {
        let lines = text(&path).lines().count();
        if lines > MAX_FILE_LINES {
            faults.push(format!("  {}: {lines} lines", short(&path)));
        }
    }
    assert_none(&faults, &format!("a file has at most {MAX_FILE_LINES} lines"));
}

#[test]
fn no_function_is_too_long() {
    let mut faults = Vec::new();
    for path in rust_files(&["src"]) {
        let (code, _) = without_tests(&tokens(&text(&path)));
        for at in (0..code.len()).filter(|at| code[*at].is("fn") && code[*at + 1].is_name()) {
            let mut end = at;
            while !matches!(code[end].text.as_str(), ";" | "{") {
                end = if matches!(code[end].text.as_str(), "(" | "[") {
                    after_group(&code, end)
                } else {
                    end + 1
                };
            }
            let last = if code[end].is("{") { after_group(&code, end) - 1 } else { end };
            let lines = code[last].line + 1 - code[at].line;
            let name = &code[at + 1].text;
            if lines > MAX_FUNCTION_LINES && !TABLES.contains(&name.as_str()) {
                faults.push(format!("  {}:{}: fn {name}: {lines} lines", short(&path), code[at].line));
            }
        }
    }
    assert_none(&faults, &format!("a function that is no table has at most {MAX_FUNCTION_LINES} lines"));
}

/// The words of a name: `LitSurface` and `lit_surface` are both lit, surface.
fn words_of(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in name.chars() {
        if c == '_' || (c.is_uppercase() && was_lower) {
            words.push(String::new());
        }
        was_lower = c.is_lowercase() || c.is_numeric();
        if c != '_' {
            words.last_mut().expect("one").extend(c.to_lowercase());
        }
    }
    words
}

#[test]
fn bounds_are_called_min_and_max() {
    let mut faults = BTreeSet::new();
    for path in rust_files(&["src", "tests", "benches"]) {
        for token in tokens(&text(&path)) {
            if ["MOST_", "LEAST_"].iter().any(|start| token.text.starts_with(start)) {
                faults.insert(format!("  {}: {}", short(&path), token.text));
            }
        }
    }
    let faults: Vec<String> = faults.into_iter().collect();
    assert_none(&faults, "a bound is MAX_ or MIN_, not MOST_ or LEAST_");
}

#[test]
fn names_are_the_fields_words() {
    let mut faults = BTreeMap::<String, usize>::new();
    for path in rust_files(&["src"]) {
        let stem = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let names = tokens(&text(&path)).into_iter().filter(|token| token.is_name()).map(|token| token.text);
        for name in names.chain([stem]) {
            let words = words_of(&name);
            for (at, word) in words.iter().enumerate() {
                // least squares are called so everywhere
                let is_usual = word == "least" && words.get(at + 1).is_some_and(|next| next == "squares");
                if let Some((_, say)) = WORDS.iter().find(|(own, _)| own == word && !is_usual) {
                    *faults.entry(format!("  {}: {name}: say {say}", short(&path))).or_default() += 1;
                }
            }
        }
    }
    let faults: Vec<String> =
        faults.into_iter().map(|(fault, times)| format!("{fault} ({times}x)")).collect();
    assert_none(&faults, "things that have a name in the field carry it");
}
