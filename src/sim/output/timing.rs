//! When the rows of a frame gather light.

use std::ops::Range;

use crate::effects::pipeline::Pipeline;

/// Times at which a row gathers light, s after its own.
pub(super) fn exposure_s(pipeline: &Pipeline) -> Vec<f64> {
    let Some(exposure) = pipeline.timing.exposure else { return vec![0.0] };
    let count = exposure.samples.max(1);
    let part = |k: u32| (f64::from(k) + 0.5) / f64::from(count) - 0.5;
    (0..count).map(|k| exposure.exposure_s * part(k)).collect()
}

/// The rows of a picture with the time of their middle, s after the frame's.
pub(super) fn rows_s(pipeline: &Pipeline, height: usize) -> Vec<(Range<usize>, f64)> {
    let Some(rolling) = pipeline.timing.rolling else { return vec![(0..height, 0.0)] };
    let count = (rolling.slices as usize).clamp(1, height.max(1));
    let slice = |k: usize| {
        let rows = k * height / count..(k + 1) * height / count;
        let middle = 0.5 * (rows.start + rows.end).saturating_sub(1) as f64;
        let span = (height.max(2) - 1) as f64;
        (rows, rolling.readout_s * (middle / span - 0.5))
    };
    (0..count).map(slice).collect()
}
