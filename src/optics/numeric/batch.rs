//! One function over many independent inputs.
//!
//! # Example
//! ```
//! use domecast_optics::numeric::batch::fill;
//!
//! let mut squares = [0.0; 3];
//! fill(&[1.0, 2.0, 3.0], &mut squares, |x| x * x)?;
//! assert_eq!(squares, [1.0, 4.0, 9.0]);
//! # Ok::<(), domecast_optics::numeric::LengthMismatch>(())
//! ```

use rayon::prelude::*;

/// Below this many inputs one thread is faster than waking the others: a point
/// costs some 50 ns, a fork and join some 10 us.
const PARALLEL_FROM: usize = 4096;

/// Inputs that a thread takes at a time.
const CHUNK: usize = 1024;

/// The input and output slices differ in length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LengthMismatch {
    /// Inputs given.
    pub inputs: usize,
    /// Places for outputs given.
    pub outputs: usize,
}

impl std::fmt::Display for LengthMismatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} inputs do not fit into {} outputs", self.inputs, self.outputs)
    }
}

impl std::error::Error for LengthMismatch {}

/// Writes `f(input)` for each input to the output at the same place.
///
/// Long slices are shared among rayon's threads. Each output depends on its own
/// input only, so the result has the same bytes for any number of threads.
/// Nothing is allocated per point.
///
/// # Errors
/// [`LengthMismatch`]; then no output is written.
pub fn fill<I: Sync, O: Send>(
    inputs: &[I],
    outputs: &mut [O],
    f: impl Fn(&I) -> O + Sync,
) -> Result<(), LengthMismatch> {
    fill_runs(inputs, outputs, |inputs, outputs| {
        for (output, input) in outputs.iter_mut().zip(inputs) {
            *output = f(input);
        }
    })
}

/// [`fill`] for a function that works on runs of inputs: it must write to each
/// output what belongs to the input at the same place, whatever the run.
///
/// # Errors
/// [`LengthMismatch`]; then no output is written.
pub fn fill_runs<I: Sync, O: Send>(
    inputs: &[I],
    outputs: &mut [O],
    run: impl Fn(&[I], &mut [O]) + Sync,
) -> Result<(), LengthMismatch> {
    if inputs.len() != outputs.len() {
        return Err(LengthMismatch { inputs: inputs.len(), outputs: outputs.len() });
    }
    if inputs.len() < PARALLEL_FROM || rayon::current_num_threads() < 2 {
        run(inputs, outputs);
    } else {
        outputs
            .par_chunks_mut(CHUNK)
            .zip(inputs.par_chunks(CHUNK))
            .for_each(|(outputs, inputs)| run(inputs, outputs));
    }
    Ok(())
}
