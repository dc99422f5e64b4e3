//! Tables of measurements: comma-separated, with a header.

use domecast_optics::numeric::csv::{self, CsvRow};

/// A table with named columns; an empty cell is a missing value.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Names of the columns, as written, without spaces around them.
    pub columns: Vec<String>,
    /// Cells by row, as written; every row has one for each column.
    pub rows: Vec<Vec<String>>,
    /// Line number (from 1) of each row.
    pub lines: Vec<usize>,
}

/// Why a table cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableError {
    /// Line, from 1.
    pub line: usize,
    /// Name of the column, where one is at fault.
    pub column: Option<String>,
    /// What is wrong and what is allowed.
    pub problem: String,
}

impl std::fmt::Display for TableError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.column {
            Some(column) => write!(f, "line {}, column {column}: {}", self.line, self.problem),
            None => write!(f, "line {}: {}", self.line, self.problem),
        }
    }
}

impl std::error::Error for TableError {}

impl Table {
    /// Reads a table; lines that are empty or begin with `#` are passed over.
    ///
    /// # Errors
    /// No header, a row with more cells than the header, or a column named twice.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let mut rows = csv::rows(text);
        let cells = |cells: &[&str]| cells.iter().map(|cell| (*cell).to_owned()).collect::<Vec<_>>();
        let fault = |line, problem: &str| TableError { line, column: None, problem: problem.into() };
        let header = rows
            .next()
            .ok_or_else(|| fault(1, "the file is empty; it starts with a line of column names"))?;
        let columns = cells(&header.cells);
        if let Some(name) = csv::repeated(&columns) {
            return Err(fault(header.line, &format!("the column \"{name}\" stands there twice")));
        }
        let mut table = Self { columns, rows: Vec::new(), lines: Vec::new() };
        for CsvRow { line, cells: found, .. } in rows {
            let mut row = cells(&found);
            if row.len() > table.columns.len() {
                let problem = format!("{} cells, but the header names {}", row.len(), table.columns.len());
                return Err(fault(line, &problem));
            }
            row.resize(table.columns.len(), String::new());
            table.rows.push(row);
            table.lines.push(line);
        }
        Ok(table)
    }

    /// Index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// The number in a cell, `None` where it is empty.
    ///
    /// # Errors
    /// A cell that is not a finite number.
    pub fn number(&self, row: usize, column: usize) -> Result<Option<f64>, TableError> {
        let cell = self.rows.get(row).and_then(|r| r.get(column)).map_or("", String::as_str);
        if cell.is_empty() {
            return Ok(None);
        }
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(TableError {
                line: self.lines.get(row).copied().unwrap_or(0),
                column: self.columns.get(column).cloned(),
                problem: format!("\"{cell}\" is not a finite number; leave a missing value empty"),
            }),
        }
    }

    /// The number in a cell that must not be empty.
    ///
    /// # Errors
    /// An empty cell, or one that is not a finite number.
    pub fn required(&self, row: usize, column: usize) -> Result<f64, TableError> {
        self.number(row, column)?.ok_or_else(|| TableError {
            line: self.lines.get(row).copied().unwrap_or(0),
            column: self.columns.get(column).cloned(),
            problem: "a number is missing".into(),
        })
    }
}
