//! Comma-separated text in rows of cells.
//!
//! # Example
//! ```
//! use domecast_optics::numeric::csv::rows;
//!
//! let text = "id, x_mm\n# measured twice\n7, 1.25\n";
//! let last = rows(text).last().ok_or("no rows")?;
//! assert_eq!((last.line, last.cells), (3, vec!["7", "1.25"]));
//! # Ok::<(), &str>(())
//! ```

/// A row of cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CsvRow<'a> {
    /// Line in the text, from 1.
    pub line: usize,
    /// The line as it is written, without spaces around it.
    pub text: &'a str,
    /// The cells, without spaces and double quotes around them. A quoted cell holds no comma.
    pub cells: Vec<&'a str>,
}

/// The rows of a table. Empty lines and lines that start with `#` are skipped; a byte-order mark and either kind of
/// line end are accepted.
pub fn rows(text: &str) -> impl Iterator<Item = CsvRow<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = (1..).zip(text.lines().map(str::trim));
    lines.filter(|(_, text)| !text.is_empty() && !text.starts_with('#')).map(|(line, text)| CsvRow {
        line,
        text,
        cells: text.split(',').map(|cell| cell.trim().trim_matches('"').trim()).collect(),
    })
}

/// The first name that stands twice in a list.
pub fn repeated<T: PartialEq>(names: &[T]) -> Option<&T> {
    names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)).map(|(_, name)| name)
}
