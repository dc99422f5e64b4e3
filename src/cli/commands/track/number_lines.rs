//! A number for each frame, from a file beside them: when it is, or how far the hand has moved.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::super::input::input_fault;
use super::super::output::Failure;

/// Characters at most of a line.
const MAX_LINE: u64 = 64;

/// Reads a line for each frame, as frames come.
pub struct NumberLines {
    lines: Option<(PathBuf, BufReader<File>)>,
    unit: &'static str,
    number: usize,
}

impl NumberLines {
    /// Of a file, or of none; `unit` in words.
    pub fn open(path: Option<&Path>, unit: &'static str) -> Result<Self, Failure> {
        let open = |path: &Path| match File::open(path) {
            Ok(file) => Ok((path.to_path_buf(), BufReader::new(file))),
            Err(error) => Err(input_fault(path, format!("cannot be read ({error})"), &allowed(unit))),
        };
        Ok(Self { lines: path.map(open).transpose()?, unit, number: 0 })
    }

    /// The next frame's number; `None` where no file is given.
    pub fn read_next(&mut self) -> Result<Option<f64>, Failure> {
        let Some((path, lines)) = &mut self.lines else { return Ok(None) };
        self.number += 1;
        let mut line = String::new();
        let read = lines.take(MAX_LINE).read_line(&mut line);
        let fault = |problem: String| input_fault(path, problem, &allowed(self.unit));
        match read {
            Ok(0) => {
                Err(fault(format!("ends before line {}: there are more frames than lines", self.number)))
            }
            Ok(_) => match line.trim().parse::<f64>().ok().filter(|value| value.is_finite()) {
                Some(value) => Ok(Some(value)),
                None => Err(fault(format!("has no number in line {}", self.number))),
            },
            Err(error) => Err(fault(format!("cannot be read ({error})"))),
        }
    }
}

fn allowed(unit: &str) -> String {
    format!("a number of {unit} for each frame, a line each")
}
