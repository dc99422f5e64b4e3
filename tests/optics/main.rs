//! Lenses and refraction never lie: golden values, an independent reference in
//! double-double arithmetic, and the fuzz run.
//!
//! Tests whose names begin with `long_` belong to the long suite
//! (`scripts/test --all`).

// a broken fixture should stop the test
#![allow(clippy::unwrap_used)]

mod batch;
mod bounds;
mod cases;
mod dd;
mod fuzz;
mod golden;
mod random;
mod reference;
mod reference_lens;
