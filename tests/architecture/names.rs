//! One thing, one name: the field's, and no two public types of one name. Public modules open with an example.

use std::collections::{BTreeMap, BTreeSet};

use crate::tokens::{tokens, without_tests};
use crate::{assert_none, crates, rust_files, short, text, workspace};

/// Words of our own for what has a name in the field, and that name; with a capital they are those of types alone.
const WORDS: &[(&str, &str)] = &[
    ("Lit", "shading, shaded"),
    ("Surplus", "residual scale"),
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
    ("dented", "deformed"),
    ("rests", "interpolation error"),
    ("reckoned", "computed"),
    ("reckoning", "computation"),
    ("rung", "sample, level"),
    ("rungs", "samples, levels"),
    ("settled", "converged; for a tile: classified"),
    ("spare", "padding, scratch, redundancy, candidate for omission"),
    ("suspicion", "lint"),
    ("suspicions", "lints"),
    ("told", "interpolated, predicted; or say what is written"),
    ("whites", "white markers"),
    ("blacks", "black dots"),
];

/// What comments and pages say of it, in words that a reader knows without asking.
const PROSE: &[(&str, &str)] = &[
    ("beaten", "dominated"),
    ("dent", "deform; displacement map"),
    ("dented", "deformed"),
    ("dents", "deforms"),
    ("dice", "seeded generator"),
    ("foreseen", "predicted"),
    ("foretold", "predicted"),
    ("ladder", "sweep"),
    ("ladders", "sweeps"),
    ("reckon", "compute"),
    ("reckoned", "computed"),
    ("reckoning", "computation, plan"),
    ("rung", "sample, level"),
    ("rungs", "samples, levels"),
    ("settle", "converge; classify"),
    ("settled", "converged; classified"),
    ("settles", "converges; classifies"),
    ("spare", "leave out; margin, padding"),
    ("spared", "left out"),
    ("told", "written, reported, computed, distinguished"),
    ("whites", "white markers"),
    ("worked out", "computed"),
];

/// Each of these opens with an example that the doc tests run: the public modules of the library.
const PUBLIC_MODULES: [&str; 22] = [
    "contact/lib.rs",
    "design/layout/mod.rs",
    "design/lib.rs",
    "design/parts/mod.rs",
    "design/transfer/mod.rs",
    "fab/artwork/mod.rs",
    "fab/build/mod.rs",
    "fab/compare/mod.rs",
    "fab/constants/mod.rs",
    "fab/report/mod.rs",
    "mesh/lib.rs",
    "optics/camera/mod.rs",
    "optics/lib.rs",
    "optics/numeric/mod.rs",
    "optics/pose/mod.rs",
    "runtime/calibrate/mod.rs",
    "runtime/constants/mod.rs",
    "runtime/frames/mod.rs",
    "runtime/overlay/mod.rs",
    "runtime/track/mod.rs",
    "sim/lib.rs",
    "springs/lib.rs",
];

#[test]
fn public_modules_open_with_an_example() {
    let src = workspace().join("src");
    let opens = |path: &&str| {
        let text = text(&src.join(path));
        text.lines().take_while(|line| line.starts_with("//!")).any(|line| line.starts_with("//! ```"))
    };
    let faults: Vec<String> =
        PUBLIC_MODULES.iter().filter(|path| !opens(path)).map(|path| format!("  src/{path}")).collect();
    assert_none(&faults, "a public module's documentation opens with an example that is run");
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

/// The words of a name: `LitSurface` is Lit, Surface; `lit_surface` is lit, surface.
fn words_of(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in name.chars() {
        if c == '_' || (c.is_uppercase() && was_lower) {
            words.push(String::new());
        }
        was_lower = c.is_lowercase() || c.is_numeric();
        words.last_mut().expect("one").extend((c != '_').then_some(c));
    }
    words
}

#[test]
fn bounds_are_called_min_and_max() {
    let mut faults = BTreeSet::new();
    for path in rust_files(&["src", "tests", "benches"]) {
        for token in tokens(&text(&path)) {
            let words = words_of(&token.text.to_lowercase());
            let ends = [words.first(), words.last()].into_iter().flatten();
            if token.is_name() && ends.into_iter().any(|word| word == "most" || word == "least") {
                faults.insert(format!("  {}: {}", short(&path), token.text));
            }
        }
    }
    let faults: Vec<String> = faults.into_iter().collect();
    assert_none(&faults, "a bound is max_ or min_ (in capitals for constants), not most_ or least_");
}

#[test]
fn names_are_the_fields_words() {
    let mut faults = BTreeMap::<String, usize>::new();
    for (_, read) in crates() {
        let files: BTreeSet<_> = read.modules.iter().map(|module| &module.file).collect();
        for path in files {
            let (code, _) = without_tests(&tokens(&text(path)));
            let stem = path.file_stem().expect("a name").to_string_lossy().into_owned();
            let names = code.into_iter().filter(|token| token.is_name()).map(|token| token.text);
            for name in names.chain([stem]) {
                for word in words_of(&name) {
                    let is_it = |own: &str| own == word || own == word.to_lowercase();
                    if let Some((_, say)) = WORDS.iter().find(|(own, _)| is_it(own)) {
                        *faults.entry(format!("  {}: {name}: say {say}", short(path))).or_default() += 1;
                    }
                }
            }
        }
    }
    let faults: Vec<String> =
        faults.into_iter().map(|(fault, times)| format!("{fault} ({times}x)")).collect();
    assert_none(&faults, "things that have a name in the field carry it");
}

/// The comments of a Rust source, or all of a page, line by line.
fn prose(path: &std::path::Path) -> Vec<String> {
    let text = text(path);
    let is_rust = path.extension().is_some_and(|extension| extension == "rs");
    let comment =
        |line: &str| line.split_once("//").map(|(_, comment)| comment.to_owned()).unwrap_or_default();
    text.lines().map(|line| if is_rust { comment(line) } else { line.to_owned() }).collect()
}

#[test]
fn comments_and_pages_use_plain_words() {
    let mut pages = rust_files(&["src", "benches", "scripts/examples"]);
    pages.extend(["README.md", "CHANGELOG.md"].map(|name| workspace().join(name)));
    let guide = std::fs::read_dir(workspace().join("src/guide")).expect("the guide");
    pages.extend(guide.map(|entry| entry.expect("an entry").path()));
    let mut faults = Vec::new();
    for path in pages {
        for (number, line) in (1..).zip(prose(&path)) {
            // names of data that other programs read stand in backquotes
            let plain = line.split('`').step_by(2).collect::<Vec<_>>().join(" ").to_lowercase();
            let words: Vec<&str> =
                plain.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
            let spaced = format!(" {} ", words.join(" "));
            for &(word, say) in PROSE {
                if spaced.contains(&format!(" {word} ")) {
                    faults.push(format!("  {}:{number}: {word}: say {say}", short(&path)));
                }
            }
        }
    }
    assert_none(&faults, "comments and pages are in words that anyone in the field knows");
}
