//! Matrix times vector, and the softmax.

/// `output = input * weights + bias`, for each row of the input.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    inputs: usize,
    /// For each input, a weight for each output.
    weights: Vec<f32>,
    bias: Vec<f32>,
    pub(crate) relu: bool,
}

impl Linear {
    /// `weights` are `[input][output]`, or `[output][input]` where `transposed`.
    pub(crate) fn new(inputs: usize, weights: &[f32], transposed: bool, bias: &[f32]) -> Self {
        let outputs = bias.len();
        let weights = if transposed {
            (0..inputs * outputs).map(|at| weights[at % outputs * inputs + at / outputs]).collect()
        } else {
            weights.to_vec()
        };
        Self { inputs, weights, bias: bias.to_vec(), relu: false }
    }

    /// Multiplications for one row.
    pub(crate) fn work(&self) -> u64 {
        self.weights.len() as u64
    }

    pub(crate) fn outputs(&self) -> usize {
        self.bias.len()
    }

    pub(crate) fn run(&self, input: &[f32], output: &mut [f32]) {
        let outputs = self.outputs();
        for (row, out) in input.chunks_exact(self.inputs).zip(output.chunks_exact_mut(outputs)) {
            out.copy_from_slice(&self.bias);
            for (value, weights) in row.iter().zip(self.weights.chunks_exact(outputs)) {
                out.iter_mut().zip(weights).for_each(|(out, weight)| *out += value * weight);
            }
            if self.relu {
                out.iter_mut().for_each(|out| *out = out.max(0.0));
            }
        }
    }
}

/// Exponentials that sum to one.
pub(crate) fn softmax(input: &[f32], output: &mut [f32]) {
    let largest = input.iter().fold(f32::NEG_INFINITY, |a, b| a.max(*b));
    let mut sum = 0.0;
    for (out, value) in output.iter_mut().zip(input) {
        *out = (value - largest).exp();
        sum += *out;
    }
    output.iter_mut().for_each(|out| *out /= sum);
}
