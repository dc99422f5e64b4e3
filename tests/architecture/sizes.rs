//! Nothing is too long to be read in one sitting.

use crate::tokens::{after_group, tokens, without_tests};
use crate::{assert_none, rust_files, short, text};

const MAX_FILE_LINES: usize = 400;
const MAX_FUNCTION_LINES: usize = 80;

/// Functions that are one table, and may be longer.
const TABLES: [&str; 0] = [];

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
