//! What the tests of the command line share.

use std::path::Path;
use std::process::{Command, Output};

/// Runs the program in `folder`, as a user would.
pub fn domecast(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_domecast"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("it runs")
}
