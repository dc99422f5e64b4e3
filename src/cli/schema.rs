//! `domecast schema`

use super::output::{Failure, Output};

/// Prints the JSON schema of the design file.
pub fn run(output: &Output) -> Result<(), Failure> {
    output.answer(&format!("{:#}\n", crate::design::design_schema()))
}
