//! The command line of domecast.

fn main() -> std::process::ExitCode {
    domecast::run()
}
