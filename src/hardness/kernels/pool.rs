//! Largest and mean values of a map.

use super::Map;

/// The largest value in a window that is moved over the map; what lies outside of the map does not count.
#[derive(Debug, Clone)]
pub(crate) struct MaxPool {
    pub(crate) input: Map,
    pub(crate) output: Map,
    pub(crate) kernel: usize,
    pub(crate) stride: usize,
    pub(crate) pad: usize,
}

impl MaxPool {
    pub(crate) fn run(&self, input: &[f32], output: &mut [f32]) {
        let channels = self.input.channels;
        let span = |at: usize, side: usize| {
            let start = (at * self.stride).saturating_sub(self.pad);
            start..(at * self.stride + self.kernel).saturating_sub(self.pad).min(side)
        };
        for row in 0..self.output.height {
            for column in 0..self.output.width {
                let out = &mut output[self.output.at(row, column)..][..channels];
                out.fill(f32::NEG_INFINITY);
                for from_row in span(row, self.input.height) {
                    for from_column in span(column, self.input.width) {
                        let pixel = &input[self.input.at(from_row, from_column)..][..channels];
                        out.iter_mut().zip(pixel).for_each(|(out, value)| *out = out.max(*value));
                    }
                }
            }
        }
    }
}

/// The mean of each channel.
pub(crate) fn average(map: &Map, input: &[f32], output: &mut [f32]) {
    output.fill(0.0);
    for row in 0..map.height {
        for pixel in input[map.row(row)].chunks_exact(map.channels) {
            output.iter_mut().zip(pixel).for_each(|(out, value)| *out += value);
        }
    }
    let count = (map.height * map.width) as f32;
    output.iter_mut().for_each(|out| *out /= count);
}
