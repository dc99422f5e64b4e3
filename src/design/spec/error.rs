//! The error of a design that cannot be used.

use std::fmt;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

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
    /// A value of a field that takes this fault away, where one is known.
    pub cure: Option<Box<Cure>>,
    /// Further faults that were found in the same run.
    pub more: Vec<DesignError>,
}

/// A change of the design that takes a fault away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cure {
    /// The field, as a path from the top.
    pub field: String,
    /// Its new value; null: the field is to be left out.
    pub value: Value,
}

impl Cure {
    /// A number for a field, rounded to 0.01 mm away from `from`, so that rounding never undoes it.
    pub(crate) fn length(field: impl Into<String>, from: f64, to: f64) -> Self {
        let steps = 100.0 * to;
        // A hundredth that is met but for rounding stays.
        let rounded = if to >= from { (steps - 1e-6).ceil() } else { (steps + 1e-6).floor() };
        Self { field: field.into(), value: json!(rounded / 100.0) }
    }

    /// Any value for a field.
    pub(crate) fn value(field: impl Into<String>, value: Value) -> Self {
        Self { field: field.into(), value }
    }
}

impl fmt::Display for Cure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.value.is_null() {
            return write!(f, "leaving {} out would do", self.field);
        }
        write!(f, "{} = {} would do", self.field, self.value)
    }
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
            cure: None,
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
    pub(super) fn cured_by(self, field: &str, value: impl Into<Value>) -> Self {
        self.with_cure(Cure::value(field, value.into()))
    }

    /// The same fault, with the change that takes it away, which is its advice too.
    #[must_use]
    pub fn with_cure(mut self, cure: Cure) -> Self {
        self.help = Some(cure.to_string());
        self.cure = Some(Box::new(cure));
        self
    }

    /// The same fault, with a change that was tried and takes it away, beside the advice that it has.
    #[must_use]
    pub fn with_tried(mut self, cure: Cure) -> Self {
        self.help = Some(match self.help.take() {
            Some(help) => format!("{help}; {cure}"),
            None => cure.to_string(),
        });
        self.cure = Some(Box::new(cure));
        self
    }

    /// The same fault, with a value for its own field that takes it away, for programs: what it says to people is enough.
    #[must_use]
    pub(super) fn with_cure_data(mut self, value: Value) -> Self {
        self.cure = Some(Box::new(Cure { field: self.field.clone(), value }));
        self
    }

    /// What the fault is about, without its numbers: the same before and after a change that does not take it away.
    pub fn kind(&self) -> String {
        let text: String =
            self.problem.chars().filter(|c| !c.is_ascii_digit() && !"-.−".contains(*c)).collect();
        format!("{}: {text}", self.field.split('[').next().unwrap_or_default())
    }

    /// The kinds of all faults.
    pub fn kinds(&self) -> Vec<String> {
        std::iter::once(self).chain(&self.more).map(Self::kind).collect()
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
    pub fn to_json(&self) -> Value {
        let (line, column) = self.place.unzip();
        json!({
            "file": self.file.as_ref().map(|file| file.display().to_string()),
            "line": line,
            "column": column,
            "field": self.field,
            "value": self.value,
            "problem": self.problem,
            "allowed": self.allowed,
            "help": self.help,
            "cure": self.cure.as_ref().map(|cure| json!({ "field": cure.field, "value": cure.value })),
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
