//! The order of the house: a module imports only from rows above its own, and siblings do not know each other.

use std::fs;
use std::path::{Path, PathBuf};

/// From the ground up; modules in one row do not import each other.
const ROWS: [&[&str]; 14] = [
    &["numeric"],
    &["camera", "mesh", "frames"],
    &["optics"],
    &["pose", "design"],
    &["mechanics", "transfer"],
    &["layout"],
    &["artwork", "parts"],
    &["constants"],
    &["sim", "track", "calibrate"],
    &["accuracy"],
    &["report"],
    &["build"],
    &["compare"],
    &["cli"],
];

fn row_of(module: &str) -> Option<usize> {
    ROWS.iter().position(|row| row.contains(&module))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The names that follow `crate::` in a source text, braces included: `crate::{a, b::c}` imports a and b.
fn imported(text: &str) -> Vec<String> {
    let name = |text: &str| {
        text.trim().split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next().map(str::to_owned)
    };
    let mut names = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        let Some(group) = rest.strip_prefix('{') else {
            names.extend(name(rest));
            continue;
        };
        let (mut depth, mut start) = (1, 0);
        for (index, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if (c == ',' && depth == 1) || depth == 0 {
                names.extend(name(&group[start..index]));
                start = index + 1;
            }
            if depth == 0 {
                break;
            }
        }
    }
    names
}

#[test]
fn modules_import_only_from_rows_above() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    let mut looked_at = 0;
    for path in sources(&src) {
        let relative = path.strip_prefix(&src).expect("below src");
        let module = relative.components().next().expect("a part").as_os_str().to_string_lossy().into_owned();
        if module.ends_with(".rs") {
            continue;
        }
        let row = row_of(&module).unwrap_or_else(|| panic!("the module {module} has no row in the house"));
        looked_at += 1;
        // tests may build their inputs from anywhere
        if relative.ends_with("tests.rs") {
            continue;
        }
        for name in imported(&fs::read_to_string(&path).expect("UTF-8")) {
            let allowed = name == module || row_of(&name).is_some_and(|other| other < row);
            if !allowed && row_of(&name).is_some() {
                wrong.push(format!("{} imports {name}", relative.display()));
            }
        }
    }
    assert!(looked_at > 20, "the sources were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn groups_of_imports_are_understood() {
    assert_eq!(imported("use crate::{a, b::{c, d}, e};\nuse crate::f::g;"), ["a", "b", "e", "f"]);
}
