//! What is known, in the user's words.

use domecast_fab::numbers::percent;
use domecast_runtime::calibrate::force::SpringKnowledge;
use serde_json::{Value, json};

/// The axes of the wrench, Fx to Mz, in words.
pub const AXES: [&str; 6] =
    ["force along x", "force along y", "force along z", "torque about x", "torque about y", "torque about z"];

/// `known are force along x to 4 %, torque about x to 2 %; not at all: torque about z (the springs' tolerances leave 9 %)`.
pub fn known(knowledge: &SpringKnowledge) -> String {
    let (now, prior, is_known) = (knowledge.parts(), knowledge.prior_parts(), knowledge.is_known());
    let of = |wanted: bool, parts: [f64; 6]| {
        let one = move |axis: usize| format!("{} to {}", AXES[axis], percent(parts[axis]));
        (0..6).filter(|axis| is_known[*axis] == wanted).map(one).collect::<Vec<_>>()
    };
    let (known, open) = (of(true, now), of(false, prior));
    let mut said = Vec::new();
    if !known.is_empty() {
        said.push(format!("known are {}", known.join(", ")));
    }
    if !open.is_empty() {
        said.push(format!("by no load yet, but by the springs' tolerances: {}", open.join(", ")));
    }
    said.join("; ")
}

/// The same for programs.
pub fn known_json(knowledge: &SpringKnowledge) -> Value {
    let (now, prior, is_known) = (knowledge.parts(), knowledge.prior_parts(), knowledge.is_known());
    let one = |axis: usize| {
        json!({
            "axis": domecast_runtime::constants::WRENCH_AXES[axis],
            "part": now[axis],
            "prior_part": prior[axis],
            "is_known": is_known[axis],
        })
    };
    Value::Array((0..6).map(one).collect())
}
