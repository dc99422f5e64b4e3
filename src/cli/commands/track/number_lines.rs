//! Numbers for each frame, from a file beside them: when it is, how far the hand has moved, how gravity lies.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::super::input::input_fault;
use super::super::output::Failure;

/// Characters at most of a number.
const MAX_NUMBER: u64 = 64;

/// Reads a line of `N` numbers for each frame, as frames come; blanks or commas stand between them.
pub struct NumberLines<const N: usize> {
    lines: Option<(PathBuf, BufReader<File>)>,
    unit: &'static str,
    number: usize,
}

impl<const N: usize> NumberLines<N> {
    /// Of a file, or of none; `unit` in words.
    pub fn open(path: Option<&Path>, unit: &'static str) -> Result<Self, Failure> {
        let open = |path: &Path| match File::open(path) {
            Ok(file) => Ok((path.to_path_buf(), BufReader::new(file))),
            Err(error) => Err(input_fault(path, format!("cannot be read ({error})"), &allowed(N, unit))),
        };
        Ok(Self { lines: path.map(open).transpose()?, unit, number: 0 })
    }

    /// The next frame's numbers; `None` where no file is given.
    pub fn read_next(&mut self) -> Result<Option<[f64; N]>, Failure> {
        let Some((path, lines)) = &mut self.lines else { return Ok(None) };
        self.number += 1;
        let mut line = String::new();
        let read = lines.take(MAX_NUMBER * N as u64).read_line(&mut line);
        let fault = |problem: String| input_fault(path, problem, &allowed(N, self.unit));
        match read {
            Ok(0) => {
                Err(fault(format!("ends before line {}: there are more frames than lines", self.number)))
            }
            Ok(_) => match numbers_of(&line) {
                Some(values) => Ok(Some(values)),
                None if N == 1 => Err(fault(format!("has no number in line {}", self.number))),
                None => Err(fault(format!("has not {N} numbers in line {}", self.number))),
            },
            Err(error) => Err(fault(format!("cannot be read ({error})"))),
        }
    }
}

/// The numbers of a line, finite and as many as wanted.
fn numbers_of<const N: usize>(line: &str) -> Option<[f64; N]> {
    let words = line.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
    let values: Vec<f64> = words.map(|word| word.parse().ok()).collect::<Option<_>>()?;
    values.try_into().ok().filter(|values: &[f64; N]| values.iter().all(|value| value.is_finite()))
}

fn allowed(count: usize, unit: &str) -> String {
    let what = if count == 1 { "a number".to_owned() } else { format!("{count} numbers") };
    format!("{what} of {unit} for each frame, a line each")
}
