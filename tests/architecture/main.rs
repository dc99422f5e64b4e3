//! The order of the code: which crate may know which, no files that import each other in a circle, no two
//! public types of one name, nothing too long, the field's words.

mod modules;
mod names;
mod of_itself;
mod order;
mod sizes;
mod tokens;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use modules::Crate;

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
                // what Cargo makes of a crate that is a workspace of its own
                if path.file_name().is_none_or(|name| name != "target") {
                    open.push(path);
                }
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
    // no member, for what it compiles, but held to the same
    all.push(("learn".to_owned(), Crate::read(&src.join("learn/main.rs"))));
    all.push(("domecast".to_owned(), Crate::read(&src.join("lib.rs"))));
    all.push(("domecast (program)".to_owned(), Crate::read(&src.join("main.rs"))));
    all
}

#[track_caller]
fn assert_none(faults: &[String], rule: &str) {
    assert!(faults.is_empty(), "{rule}; {} at fault:\n{}\n", faults.len(), faults.join("\n"));
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
