//! The gated recurrent unit, both ways over a sequence, as ONNX defines it with `linear_before_reset`.

use super::Linear;

/// One direction.
#[derive(Debug, Clone)]
struct Direction {
    /// To the three gates: update, reset, candidate.
    input: Linear,
    hidden: Linear,
}

/// A bidirectional GRU over a sequence of fixed length.
#[derive(Debug, Clone)]
pub(crate) struct Gru {
    inputs: usize,
    hidden: usize,
    directions: [Direction; 2],
    state: Vec<f32>,
    from_input: Vec<f32>,
    from_state: Vec<f32>,
}

fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + (-value).exp())
}

impl Gru {
    /// `input` `[2][3 hidden][inputs]`, `recurrent` `[2][3 hidden][hidden]`, `bias` `[2][6 hidden]`, as ONNX has them.
    pub(crate) fn new([inputs, hidden]: [usize; 2], input: &[f32], recurrent: &[f32], bias: &[f32]) -> Self {
        let gates = 3 * hidden;
        let directions = [0, 1].map(|way| Direction {
            input: Linear::new(
                inputs,
                &input[way * gates * inputs..][..gates * inputs],
                true,
                &bias[way * 2 * gates..][..gates],
            ),
            hidden: Linear::new(
                hidden,
                &recurrent[way * gates * hidden..][..gates * hidden],
                true,
                &bias[way * 2 * gates + gates..][..gates],
            ),
        });
        let zeros = |count| vec![0.0; count];
        Self {
            inputs,
            hidden,
            directions,
            state: zeros(hidden),
            from_input: zeros(gates),
            from_state: zeros(gates),
        }
    }

    /// Multiplications for one step of the sequence.
    pub(crate) fn work(&self) -> u64 {
        self.directions.iter().map(|way| way.input.work() + way.hidden.work()).sum()
    }

    /// `output` is `[step][direction][hidden]`.
    pub(crate) fn run(&mut self, input: &[f32], output: &mut [f32]) {
        let hidden = self.hidden;
        let steps = input.len() / self.inputs;
        for (way, direction) in self.directions.iter().enumerate() {
            self.state.fill(0.0);
            for turn in 0..steps {
                let step = if way == 0 { turn } else { steps - 1 - turn };
                direction.input.run(&input[step * self.inputs..][..self.inputs], &mut self.from_input);
                direction.hidden.run(&self.state, &mut self.from_state);
                for (i, state) in self.state.iter_mut().enumerate() {
                    let gate = |at: usize| self.from_input[at] + self.from_state[at];
                    let update = sigmoid(gate(i));
                    let reset = sigmoid(gate(hidden + i));
                    let at = 2 * hidden + i;
                    let candidate = (self.from_input[at] + reset * self.from_state[at]).tanh();
                    *state = (1.0 - update) * candidate + update * *state;
                }
                output[(2 * step + way) * hidden..][..hidden].copy_from_slice(&self.state);
            }
        }
    }
}
