//! How results, progress and failures reach a person or a program.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::{Value, json};

use domecast_design::DesignError;
use domecast_files::{Cache, OutputRules, WriteError};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::{ShapeError, ShapeFromColor, ShapeOptions};
use domecast_runtime::track::Tracker;

/// Why a command did not do what it was asked for.
#[derive(Debug)]
pub enum Failure {
    /// The design, or another input, is at fault.
    Input(Box<DesignError>),
    /// The result could not be written.
    Write(WriteError),
    /// The command ran and its answer is "no" (a check that failed); its result is already printed.
    Negative,
    /// Standard output could not be written.
    Print(io::Error),
    /// A recording that cannot go on; what was written of it stays.
    Record(PathBuf, String),
    /// Something that must not happen, whatever the input.
    Internal(String),
}

impl From<DesignError> for Failure {
    fn from(error: DesignError) -> Self {
        Self::Input(Box::new(error))
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::Write(error)
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Print(error)
    }
}

impl Failure {
    /// 1 the input is at fault, 3 our fault. A reader that closes the pipe early is neither.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Print(error) if error.kind() == io::ErrorKind::BrokenPipe => 0,
            Self::Input(_) | Self::Write(_) | Self::Negative | Self::Record(..) | Self::Print(_) => 1,
            Self::Internal(_) => 3,
        }
    }

    /// The same for the caller of a library.
    pub fn into_call_error(self) -> CallError {
        match self {
            Self::Input(error) => CallError::Input(error),
            Self::Internal(what) => CallError::Internal(what),
            other => CallError::Other(other.message().unwrap_or_else(|| "the answer is no".into())),
        }
    }

    /// What is said of it; nothing where all is said.
    pub fn message(&self) -> Option<String> {
        match self {
            Self::Input(error) => Some(error.to_string()),
            Self::Write(error) => Some(error.to_string()),
            Self::Record(path, problem) => Some(format!("{}: {problem}", path.display())),
            Self::Negative => None,
            Self::Print(error) if error.kind() == io::ErrorKind::BrokenPipe => None,
            Self::Print(error) => Some(format!("standard output: cannot be written ({error})")),
            Self::Internal(what) => Some(format!("a fault in domecast itself, please report it: {what}")),
        }
    }
}

/// Why a command that was called as a function has no result.
#[derive(Debug)]
#[non_exhaustive]
pub enum CallError {
    /// The design, or another input, is at fault.
    Input(Box<DesignError>),
    /// Arguments that the command does not take, or a result that cannot be written, in words.
    Other(String),
    /// Something that must not happen, whatever the input.
    Internal(String),
}

/// What a command that was called as a function says.
#[derive(Debug, Default)]
pub struct Called {
    /// Its result, as `--json` prints it; null of a command without one.
    pub result: Value,
    /// What its caller must know of their files, a sentence each.
    pub notes: Vec<String>,
}

/// Standard output and standard error, as the user wants them.
#[derive(Debug)]
pub struct Output {
    json: bool,
    quiet: bool,
    progress: bool,
    force: bool,
    /// Gives the cache of tables, where the process has one.
    cache: fn() -> Option<Cache>,
    /// Where results and notes go instead of being printed.
    called: Option<Mutex<Called>>,
}

impl Output {
    /// Progress shows only on a terminal.
    pub fn new(json: bool, quiet: bool, force: bool) -> Self {
        let progress = !json && !quiet && io::stderr().is_terminal();
        Self { json, quiet, progress, force, cache: || None, called: None }
    }

    /// The same with a cache of tables: of a process that is the program itself, and no other that calls it as a library.
    pub fn with_cache(self, cache: fn() -> Option<Cache>) -> Self {
        Self { cache, ..self }
    }

    /// The cache of tables, if there is one.
    pub fn cache(&self) -> Option<Cache> {
        (self.cache)()
    }

    /// What reads the skin's shape, by kept tables of the light where there are some.
    pub fn shape(&self, constants: &Constants, tracker: &Tracker) -> Result<ShapeFromColor, ShapeError> {
        let cache = self.cache();
        ShapeFromColor::with_tables(constants, tracker, ShapeOptions::default(), &|key, count, make| {
            match &cache {
                Some(cache) => cache.numbers(key, count, make),
                None => make(),
            }
        })
    }

    /// Prints nothing: results and notes are kept.
    pub fn silent(force: bool) -> Self {
        Self { called: Some(Mutex::default()), ..Self::new(true, true, force) }
    }

    /// What was kept.
    pub fn into_called(self) -> Called {
        let called = self.called.map(|called| called.into_inner().unwrap_or_else(PoisonError::into_inner));
        called.unwrap_or_default()
    }

    /// Keeps something; whether it is to be kept.
    fn keep(&self, take: impl FnOnce(&mut Called)) -> bool {
        let Some(called) = &self.called else { return false };
        take(&mut called.lock().unwrap_or_else(PoisonError::into_inner));
        true
    }

    /// What may be replaced by the result of a command that reads `inputs`.
    pub fn rules<'a>(&self, inputs: &'a [&'a Path]) -> OutputRules<'a> {
        OutputRules { force: self.force, inputs }
    }

    /// Something of the user's files that they must know of, whatever the mode; never on standard output.
    pub fn note(&self, line: &str) {
        if self.keep(|called| called.notes.push(line.to_owned())) {
            return;
        }
        let _ = writeln!(io::stderr(), "note: {line}");
    }

    /// Says where the thing is that stood in a result's place and was not an unchanged earlier result.
    pub fn kept(&self, copy: Option<PathBuf>) {
        if let Some(copy) = copy {
            self.note(&format!("what stood in the result's place is kept as {}", copy.display()));
        }
    }

    /// Whether the result is wanted as JSON.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Says what is being done now; the line is replaced by the next.
    pub fn step(&self, doing: &str) {
        if self.progress {
            // progress is a courtesy: a terminal that cannot take it must not stop the work
            let _ = write!(io::stderr(), "\r\x1b[2K{doing} ...");
            let _ = io::stderr().flush();
        }
    }

    /// Clears the progress line.
    pub fn steps_done(&self) {
        if self.progress {
            let _ = write!(io::stderr(), "\r\x1b[2K");
        }
    }

    /// A line of a summary, for people only.
    pub fn say(&self, line: &str) -> Result<(), Failure> {
        if !self.json && !self.quiet {
            writeln!(io::stdout(), "{line}")?;
        }
        Ok(())
    }

    /// A warning, for people only (the JSON result carries warnings itself).
    pub fn warn(&self, line: &str) {
        if !self.json && !self.quiet {
            let _ = writeln!(io::stderr(), "warning: {line}");
        }
    }

    /// A fault that does not stop the command: a warning, which `--quiet` does not silence.
    pub fn fault(&self, line: &str) {
        if self.quiet && !self.json {
            self.error(line);
        }
        self.warn(line);
    }

    /// A fault, for people, whatever the mode.
    pub fn error(&self, line: &str) {
        let _ = writeln!(io::stderr(), "error: {line}");
    }

    /// The result, for programs only.
    pub fn result(&self, value: &Value) -> Result<(), Failure> {
        if self.keep(|called| called.result = value.clone()) {
            return Ok(());
        }
        if self.json {
            writeln!(io::stdout(), "{value:#}")?;
        }
        Ok(())
    }

    /// Text that is the command's very answer, whatever the mode.
    pub fn answer(&self, text: &str) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes())?;
        out.flush()?;
        Ok(())
    }

    /// Reports a failure: on standard error for people, on standard output for programs.
    pub fn failure(&self, failure: &Failure) {
        self.steps_done();
        let Some(message) = failure.message() else { return };
        if self.json {
            let error = match failure {
                Failure::Input(error) => error.to_json(),
                _ => json!({ "message": message }),
            };
            let _ = writeln!(io::stdout(), "{:#}", json!({ "error": error }));
        } else {
            self.error(&message);
        }
    }
}
