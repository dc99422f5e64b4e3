//! The check finds what it is for: small crates with known imports.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::order::{circles, graph};
use crate::modules::Crate;
use crate::tokens::tokens;

/// Reads a crate of these files; returns its imports as "from <- to: name", and its circles.
fn read(test: &str, files: &[(&str, &str)]) -> (Vec<String>, Vec<String>) {
    let folder = std::env::temp_dir().join(format!("domecast-architecture-{}-{test}", std::process::id()));
    for (name, text) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, text).expect("written");
    }
    let read = Crate::read(&folder.join("lib.rs"));
    let name =
        |path: &Path| path.strip_prefix(&folder).expect("below").display().to_string().replace('\\', "/");
    let imports = read.imports();
    let lines = imports.iter().map(|i| format!("{} <- {}: {}", name(&i.from), name(&i.to), i.name));
    let graph = graph(&imports, |file| Some(name(file)));
    let groups: Vec<String> = circles(&graph)
        .into_iter()
        .map(|group: BTreeSet<&String>| group.into_iter().cloned().collect::<Vec<_>>().join(" "))
        .collect();
    fs::remove_dir_all(&folder).expect("removed");
    (lines.collect(), groups)
}

#[test]
fn names_are_followed_to_the_file_that_defines_them() {
    let (imports, circles) = read(
        "chain",
        &[
            ("lib.rs", "pub mod a; mod b; pub use b::Deep;"),
            (
                "a.rs",
                "use crate::Deep; use crate::b::{inner::{self, Low as Other}, Kind}; fn f() { inner::g() }",
            ),
            ("b/mod.rs", "pub mod inner; pub use inner::deep::Deep; pub enum Kind { One }"),
            ("b/inner/mod.rs", "pub mod deep; pub struct Low; pub fn g() {}"),
            ("b/inner/deep.rs", "pub struct Deep;"),
        ],
    );
    assert_eq!(
        imports,
        [
            "a.rs <- b/inner/deep.rs: Deep",
            "a.rs <- b/inner/mod.rs: Low",
            "a.rs <- b/inner/mod.rs: g",
            "a.rs <- b/mod.rs: Kind",
        ]
    );
    assert!(circles.is_empty(), "{circles:?}");
}

#[test]
fn circles_are_found_through_any_kind_of_path() {
    let (_, groups) = read(
        "circles",
        &[
            ("lib.rs", "mod a; mod b; mod c; mod d { pub fn own() { super::c::run() } }"),
            ("a/mod.rs", "mod child; pub struct Spec; fn f() { child::run(); }"),
            ("a/child.rs", "pub fn run() {} fn f(_: super::Spec) {}"),
            ("b.rs", "fn f() -> crate::c::Thing { todo!() } pub struct Other;"),
            ("c.rs", "use super::*; pub struct Thing(b::Other); pub fn run() { crate::d::own() }"),
        ],
    );
    assert_eq!(groups, ["a/child.rs a/mod.rs", "b.rs c.rs lib.rs"]);
}

#[test]
fn comments_texts_and_tests_import_nothing() {
    let (imports, _) = read(
        "tests",
        &[
            ("lib.rs", "mod a; mod b;"),
            (
                "a.rs",
                "//! crate::b::X\n/* crate::b::X /* */ */ const T: &str = r#\"crate::b::X \"# ; const Q: char = '\\'';\n\
                 #[cfg(test)] use crate::b::X;\n#[derive(Clone)] #[cfg(test)] mod tests { use crate::b::X; }\n\
                 struct B<'a> { X: &'a str }",
            ),
            ("b.rs", "pub struct X;"),
        ],
    );
    assert!(imports.is_empty(), "{imports:?}");
}

#[test]
fn lines_are_counted_through_texts_and_comments() {
    let found = tokens("a \"x\ny\" /* \n */ b\n'\\n' c 'd e");
    let found: Vec<(&str, usize)> = found.iter().map(|token| (token.text.as_str(), token.line)).collect();
    assert_eq!(found, [("a", 1), ("b", 3), ("c", 4), ("d", 4), ("e", 4)]);
}
