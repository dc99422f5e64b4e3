//! Who may know whom: crates, files, folders, stages.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::modules::Import;
use crate::tokens::tokens;
use crate::{assert_none, crates, members, short, text, workspace};

/// The crates from the ground up; each may depend on those named beside it and on no others of ours.
const CRATES: [(&str, &[&str]); 16] = [
    ("files", &[]),
    ("optics", &[]),
    ("mesh", &[]),
    ("light", &["optics"]),
    ("springs", &["optics"]),
    ("elastic", &["optics"]),
    ("runtime", &["elastic", "light", "optics", "springs"]),
    ("hardness", &["runtime", "springs"]),
    ("design", &["mesh", "optics", "springs"]),
    ("contact", &["elastic", "mesh", "optics", "springs"]),
    ("sim", &["contact", "design", "files", "light", "mesh", "optics", "springs"]),
    ("fab", &["design", "files", "mesh", "optics", "runtime", "sim", "springs"]),
    ("live", &["optics", "runtime", "springs"]),
    ("dataset", &["contact", "design", "fab", "files", "hardness", "optics", "runtime", "sim", "springs"]),
    (
        "cli",
        &[
            "contact", "dataset", "design", "fab", "files", "hardness", "live", "mesh", "optics", "runtime",
            "sim", "springs",
        ],
    ),
    ("python", &["cli", "design", "fab", "files", "hardness", "live", "optics", "runtime", "sim", "springs"]),
];

/// Where data runs through stages: the crate, the folder of the stages, and they in order.
const STAGES: [(&str, &str, &[&str]); 1] =
    [("sim", "sim", &["scene", "contact", "light", "raster", "electronics", "output"])];

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

#[test]
fn the_library_shows_nothing_of_the_command_line() {
    let facade = tokens(&text(&workspace().join("src/lib.rs")));
    assert!(!facade.iter().any(|token| token.is("domecast_cli")), "src/lib.rs names domecast_cli");
}

/// Who imports whom: each file, or each module, with the names it takes from others.
pub type Graph = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// The imports as a graph between what `node` makes of a file; what has no node stays out.
pub fn graph(imports: &BTreeSet<Import>, node: impl Fn(&Path) -> Option<String>) -> Graph {
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
pub fn circles(graph: &Graph) -> Vec<BTreeSet<&String>> {
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
fn the_runtime_builds_fewer_than_fifty_crates() {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let wanted =
        ["tree", "--offline", "--locked", "-p", "domecast-runtime", "-e", "normal", "--prefix", "none"];
    let tree =
        std::process::Command::new(cargo).args(wanted).current_dir(workspace()).output().expect("cargo");
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let text = String::from_utf8_lossy(&tree.stdout).into_owned();
    let crates: BTreeSet<&str> = text.lines().map(|line| line.trim_end_matches(" (*)")).collect();
    assert!(crates.len() < 50, "{} crates:\n{crates:#?}", crates.len());
    assert!(!crates.iter().any(|name| name.starts_with("tiny-skia")), "drawing is a feature");
}
