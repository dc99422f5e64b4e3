//! The command line of domecast.

fn main() {}
