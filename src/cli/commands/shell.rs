//! `domecast completions SHELL` and `domecast man`

use clap::Command;
use clap_complete::Shell;

use super::output::{Failure, Output};

/// Prints the completions for a shell.
pub fn completions(output: &Output, shell: Shell, mut command: Command) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut command, "domecast", &mut text);
    output.answer(&String::from_utf8_lossy(&text))
}

/// Prints the man page: the program, then every command.
pub fn man(output: &Output, command: Command) -> Result<(), Failure> {
    let mut text = Vec::new();
    let mut command = command;
    command.build();
    let page = |command: &Command, text: &mut Vec<u8>| clap_mangen::Man::new(command.clone()).render(text);
    page(&command, &mut text)?;
    for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
        page(below, &mut text)?;
    }
    output.answer(&String::from_utf8_lossy(&text))
}
