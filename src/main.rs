//! The command line of domecast.

fn main() -> std::process::ExitCode {
    domecast_cli::run()
}
