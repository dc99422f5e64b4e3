//! The modules of one crate: what each defines, re-exports and imports, and in which file a path ends.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::tokens::{Token, after_group, tokens, without_tests};

/// One module of a crate, in a file of its own or inside another's.
#[derive(Default)]
pub struct Module {
    pub file: PathBuf,
    parent: usize,
    children: BTreeMap<String, usize>,
    items: BTreeSet<String>,
    uses: Vec<Use>,
    /// every path and name in the code
    paths: BTreeSet<Vec<String>>,
    pub types: Vec<PublicType>,
}

/// One leaf of a `use`: the name it brings (`*` for all) and where that stands.
struct Use {
    path: Vec<String>,
    name: String,
    is_export: bool,
}

/// A `pub struct`, `enum`, `trait`, `type` or `union`.
pub struct PublicType {
    pub name: String,
    pub line: usize,
}

/// Where a path ends: at a module, or at the item of this name that a module defines.
enum End {
    Module(usize),
    Item(usize, String),
}

/// A file imports a name from another file of its crate.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Import {
    pub from: PathBuf,
    pub to: PathBuf,
    pub name: String,
}

/// All modules of a crate but those for tests.
#[derive(Default)]
pub struct Crate {
    pub modules: Vec<Module>,
    /// the files of modules that only tests see
    pub test_files: Vec<PathBuf>,
}

impl Crate {
    /// Reads the crate whose first file is `root` (a `lib.rs` or `main.rs`).
    pub fn read(root: &Path) -> Crate {
        let mut all = Crate::default();
        all.add_file(root, 0);
        all
    }

    /// Reads a file as a module below `parent`; returns its number.
    fn add_file(&mut self, file: &Path, parent: usize) -> usize {
        let source = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let (code, test_modules) = without_tests(&tokens(&source));
        for name in test_modules {
            if let Some(path) = child_file(file, &name) {
                self.add_test_files(&path);
            }
        }
        self.add(file, parent, &code)
    }

    fn add_test_files(&mut self, file: &Path) {
        self.test_files.push(file.to_owned());
        let all = tokens(&fs::read_to_string(file).unwrap_or_default());
        for three in all.windows(3).filter(|three| three[0].is("mod") && three[2].is(";")) {
            if let Some(path) = child_file(file, &three[1].text) {
                self.add_test_files(&path);
            }
        }
    }

    fn add(&mut self, file: &Path, parent: usize, code: &[Token]) -> usize {
        let number = self.modules.len();
        self.modules.push(Module { file: file.to_owned(), parent, ..Module::default() });
        let (mut index, mut depth) = (0, 0);
        while index < code.len() {
            let is = |offset: usize, text: &str| code.get(index + offset).is_some_and(|t| t.is(text));
            let name = || code.get(index + 1).map(|token| token.text.clone()).unwrap_or_default();
            let previous = index.checked_sub(1).map_or("", |before| code[before].text.as_str());
            match code[index].text.as_str() {
                "use" if !is(1, "<") => {
                    let is_export = depth == 0 && (previous == "pub" || previous == ")");
                    let end = index + code[index..].iter().position(|t| t.is(";")).expect("use ends");
                    for (path, name) in leaves(&code[index + 1..end], &[]) {
                        self.modules[number].uses.push(Use { path, name, is_export });
                    }
                    index = end;
                }
                "mod" if is(2, ";") => {
                    let path = child_file(file, &name())
                        .unwrap_or_else(|| panic!("{}: no file for mod {}", file.display(), name()));
                    let child = self.add_file(&path, number);
                    self.modules[number].children.insert(name(), child);
                    index += 2;
                }
                "mod" if is(2, "{") => {
                    let end = after_group(code, index + 2);
                    let child = self.add(file, number, &code[index + 3..end - 1]);
                    self.modules[number].children.insert(name(), child);
                    index = end - 1;
                }
                kind @ ("fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union")
                    if depth == 0 && code.get(index + 1).is_some_and(Token::is_name) =>
                {
                    let is_type = matches!(kind, "struct" | "enum" | "trait" | "type" | "union");
                    // `const fn f`: the name follows the last keyword
                    if !(kind == "const" && (is(1, "fn") || is(1, "unsafe"))) {
                        let module = &mut self.modules[number];
                        module.items.insert(name());
                        if is_type && previous == "pub" {
                            module.types.push(PublicType { name: name(), line: code[index].line });
                        }
                    }
                }
                "macro_rules" if is(1, "!") => {
                    self.modules[number].items.insert(code[index + 2].text.clone());
                }
                "{" | "(" | "[" => depth += 1,
                "}" | ")" | "]" => depth -= 1,
                _ if code[index].is_name() && previous != "." && previous != "::" => {
                    let mut path = vec![code[index].text.clone()];
                    while code.get(index + 1).is_some_and(|t| t.is("::"))
                        && code.get(index + 2).is_some_and(Token::is_name)
                    {
                        index += 2;
                        path.push(code[index].text.clone());
                    }
                    // `radius: 3.0` names a field or a variable
                    if path.len() > 1 || !code.get(index + 1).is_some_and(|t| t.is(":")) {
                        self.modules[number].paths.insert(path);
                    }
                }
                _ => {}
            }
            index += 1;
        }
        number
    }

    /// Where a path ends that is written in module `from`; `None` for other crates and local variables.
    fn end_of(&self, from: usize, path: &[String], depth: usize) -> Option<End> {
        if depth > 16 {
            return None;
        }
        let (mut at, mut index) = (from, 0);
        match path[0].as_str() {
            "crate" => (at, index) = (0, 1),
            "self" => index = 1,
            "super" => {
                while path.get(index).is_some_and(|part| part == "super") {
                    (at, index) = (self.modules[at].parent, index + 1);
                }
            }
            _ => {}
        }
        let is_sure = index > 0;
        while index < path.len() {
            let (name, is_last) = (&path[index], index + 1 == path.len());
            match self.look_up(at, name, is_last, depth) {
                Some(End::Module(next)) => (at, index) = (next, index + 1),
                // a name that a macro defines belongs to the file that holds the macro's call
                None if is_sure => return Some(End::Item(at, name.clone())),
                end => return end,
            }
        }
        Some(End::Module(at))
    }

    fn look_up(&self, at: usize, name: &str, is_last: bool, depth: usize) -> Option<End> {
        let module = &self.modules[at];
        if is_last && module.items.contains(name) {
            return Some(End::Item(at, name.to_owned()));
        }
        if let Some(child) = module.children.get(name) {
            return Some(End::Module(*child));
        }
        if module.items.contains(name) {
            return Some(End::Item(at, name.to_owned()));
        }
        if let Some(import) = module.uses.iter().find(|import| import.name == name) {
            return self.end_of(at, &import.path, depth + 1);
        }
        let mut globs = module.uses.iter().filter(|import| import.name == "*");
        globs.find_map(|glob| match self.end_of(at, &glob.path, depth + 1) {
            Some(End::Module(inner)) if inner != at => self.look_up(inner, name, is_last, depth + 1),
            _ => None,
        })
    }

    /// What each file imports from other files of the crate; re-exports alone are no imports.
    pub fn imports(&self) -> BTreeSet<Import> {
        let mut found = BTreeSet::new();
        for (number, module) in self.modules.iter().enumerate() {
            let named = module.uses.iter().filter(|import| !import.is_export && import.name != "*");
            for path in named.map(|import| &import.path).chain(&module.paths) {
                if let Some(End::Item(other, name)) = self.end_of(number, path, 0) {
                    let to = &self.modules[other].file;
                    if *to != module.file {
                        found.insert(Import { from: module.file.clone(), to: to.clone(), name });
                    }
                }
            }
        }
        found
    }
}

/// The file of `mod name;` in `file`.
fn child_file(file: &Path, name: &str) -> Option<PathBuf> {
    let folder = file.parent()?;
    let stem = file.file_stem()?.to_str()?;
    let folder = if matches!(stem, "mod" | "lib" | "main") { folder.to_owned() } else { folder.join(stem) };
    let choices = [folder.join(format!("{name}.rs")), folder.join(name).join("mod.rs")];
    choices.into_iter().find(|path| path.is_file())
}

/// Every (path, name) that a tree of imports brings: `a::{b, c::{self, d as e}}`.
fn leaves(tree: &[Token], before: &[String]) -> Vec<(Vec<String>, String)> {
    let mut path = before.to_vec();
    let mut index = 0;
    while let Some(token) = tree.get(index) {
        match token.text.as_str() {
            "::" => {}
            "{" => {
                let inner = &tree[index + 1..after_group(tree, index) - 1];
                let (mut found, mut start, mut depth) = (Vec::new(), 0, 0);
                for (at, token) in inner.iter().enumerate() {
                    match token.text.as_str() {
                        "{" => depth += 1,
                        "}" => depth -= 1,
                        "," if depth == 0 => {
                            found.extend(leaves(&inner[start..at], &path));
                            start = at + 1;
                        }
                        _ => {}
                    }
                }
                found.extend(leaves(&inner[start..], &path));
                return found;
            }
            "*" => return vec![(path, "*".to_owned())],
            "as" => return vec![(path, tree[index + 1].text.clone())],
            "self" if !path.is_empty() => {}
            _ => path.push(token.text.clone()),
        }
        index += 1;
    }
    let name = path.last().cloned();
    name.filter(|_| !tree.is_empty()).map(|name| (path, name)).into_iter().collect()
}
