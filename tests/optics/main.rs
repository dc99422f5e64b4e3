//! Lenses and refraction never lie: golden values, an independent reference in
//! double-double arithmetic, and the fuzz run.
//!
//! Tests whose names begin with `long_` are ignored by default; run them with
//! `cargo nextest run --release --run-ignored all -E 'test(/long_/)'`.

mod batch;
mod cases;
mod dd;
mod fuzz;
mod golden;
mod reference;
