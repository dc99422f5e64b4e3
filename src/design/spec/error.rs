//! The error of a design that cannot be used.

use std::fmt;
use std::path::{Path, PathBuf};

/// A fault in a design file: where it is, what stands there, what is allowed, and what to do.
///
/// The message is one line, so that it survives a terminal, a log and a bug report alike.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DesignError {
    /// The file that was read; `None` while a design is checked in memory.
    pub file: Option<PathBuf>,
    /// Line and column (both from 1), for faults of the JSON text itself.
    pub place: Option<(usize, usize)>,
    /// The field, as a path from the top: `optics.layers[0].index`. Empty for the whole file.
    pub field: String,
    /// The value that stands there, as JSON; empty where there is none.
    pub value: String,
    /// What is wrong, in words.
    pub problem: String,
    /// What is allowed there.
    pub allowed: String,
    /// What to do, where more than "change the value" can be said.
    pub help: Option<String>,
    /// Further faults that were found in the same run.
    pub more: Vec<DesignError>,
}

impl DesignError {
    /// A fault at `field`, whose value is `value` (JSON text), with the rule that it breaks.
    pub fn at(
        field: impl Into<String>,
        value: impl fmt::Display,
        problem: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            file: None,
            place: None,
            field: field.into(),
            value: shorten(&value.to_string()),
            problem: problem.into(),
            allowed: allowed.into(),
            help: None,
            more: Vec::new(),
        }
    }

    /// The same fault, with others that were found in the same run.
    #[must_use]
    pub fn with_more(mut self, more: Vec<Self>) -> Self {
        self.more.extend(more);
        self
    }

    /// All faults as one error, in their order, or none.
    ///
    /// # Errors
    /// The first, which carries the others.
    pub fn all(faults: Vec<Self>) -> Result<(), Self> {
        let mut flat: Vec<Self> = Vec::new();
        for mut fault in faults {
            let more = std::mem::take(&mut fault.more);
            flat.push(fault);
            flat.extend(more);
        }
        let mut flat = flat.into_iter();
        flat.next().map_or(Ok(()), |first| Err(first.with_more(flat.collect())))
    }

    /// The same fault, with a value of a field that takes it away.
    #[must_use]
    pub(super) fn cured_by(self, field: &str, value: impl fmt::Display) -> Self {
        self.with_help(format!("{field} = {value} would do"))
    }

    /// The same fault, with advice.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The same fault, in the named file.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        self.file = Some(file.to_path_buf());
        self
    }

    /// The fault as a JSON object for programs.
    pub fn to_json(&self) -> serde_json::Value {
        let (line, column) = self.place.unzip();
        serde_json::json!({
            "file": self.file.as_ref().map(|file| file.display().to_string()),
            "line": line,
            "column": column,
            "field": self.field,
            "value": self.value,
            "problem": self.problem,
            "allowed": self.allowed,
            "help": self.help,
            "message": self.to_string(),
            "more": self.more.iter().map(Self::to_json).collect::<Vec<_>>(),
        })
    }
}

/// Values are quoted in messages; a pasted mesh must not fill the screen.
fn shorten(value: &str) -> String {
    const LONGEST: usize = 80;
    if value.chars().count() <= LONGEST {
        return value.to_owned();
    }
    value.chars().take(LONGEST).chain("...".chars()).collect()
}

impl fmt::Display for DesignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}", file.display())?;
            if let Some((line, column)) = self.place {
                write!(f, ":{line}:{column}")?;
            }
            write!(f, ": ")?;
        } else if let Some((line, column)) = self.place {
            write!(f, "line {line}, column {column}: ")?;
        }
        if !self.field.is_empty() {
            write!(f, "`{}`", self.field)?;
            if !self.value.is_empty() {
                write!(f, " is {}", self.value)?;
            }
            write!(f, ": ")?;
        }
        write!(f, "{}", self.problem)?;
        if !self.allowed.is_empty() {
            write!(f, "; allowed: {}", self.allowed)?;
        }
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        for fault in &self.more {
            write!(f, "; also: {fault}")?;
        }
        Ok(())
    }
}

impl std::error::Error for DesignError {}
