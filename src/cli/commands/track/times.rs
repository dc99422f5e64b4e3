//! The times of frames, from a file beside them.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::super::input::input_fault;
use super::super::output::Failure;

const ALLOWED: &str = "a number of seconds for each frame, a line each";
/// Characters at most of a line.
const MAX_LINE: u64 = 64;

/// Reads a line for each frame, as frames come.
pub struct FrameTimes {
    lines: Option<(PathBuf, BufReader<File>)>,
    number: usize,
}

impl FrameTimes {
    /// Of a file, or of none.
    pub fn open(path: Option<&Path>) -> Result<Self, Failure> {
        let open = |path: &Path| match File::open(path) {
            Ok(file) => Ok((path.to_path_buf(), BufReader::new(file))),
            Err(error) => Err(input_fault(path, format!("cannot be read ({error})"), ALLOWED)),
        };
        Ok(Self { lines: path.map(open).transpose()?, number: 0 })
    }

    /// The next frame's time, s; `None` where no file is given.
    pub fn next_s(&mut self) -> Result<Option<f64>, Failure> {
        let Some((path, lines)) = &mut self.lines else { return Ok(None) };
        self.number += 1;
        let mut line = String::new();
        let read = lines.take(MAX_LINE).read_line(&mut line);
        let fault = |problem: String| input_fault(path, problem, ALLOWED);
        match read {
            Ok(0) => {
                Err(fault(format!("ends before line {}: there are more frames than times", self.number)))
            }
            Ok(_) => match line.trim().parse::<f64>().ok().filter(|time_s| time_s.is_finite()) {
                Some(time_s) => Ok(Some(time_s)),
                None => Err(fault(format!("has no number in line {}", self.number))),
            },
            Err(error) => Err(fault(format!("cannot be read ({error})"))),
        }
    }
}
