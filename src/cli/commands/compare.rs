//! `domecast compare A B`

use std::path::Path;

use serde_json::json;

use super::output::{Failure, Output};
use domecast_fab::build::BuildError;
use domecast_fab::compare::{CompareSide, compare};

/// Opens both sides, then prints what differs.
pub fn run(output: &Output, a: &Path, b: &Path) -> Result<(), Failure> {
    let open = |path: &Path| {
        output.step(&format!("reading {}", path.display()));
        CompareSide::open(path, &mut |doing| output.step(&format!("{}: {doing}", path.display()))).map_err(
            |error| match error {
                BuildError::Design(error) => Failure::from(*error),
                BuildError::Ours(what) => Failure::Internal(what),
            },
        )
    };
    let (a, b) = (open(a)?, open(b)?);
    output.steps_done();
    let found = compare(&a, &b);
    output.say(found.to_string().trim_end())?;
    output.result(&json!(found))
}
