//! A trained network as a graph that runs without the training library: normalisations folded into the weights.

use burn::nn::{BiGru, Gru, Linear};
use burn::tensor::Tensor;
use domecast_hardness::{Attribute, Graph, Port};

use crate::net::{Block, ConvNorm, Eye, LAST_FRAMES, Net};

/// What turns numbers of the network into those of the world.
#[derive(Debug, Clone)]
pub(crate) struct Scales {
    /// Frames of the window.
    pub window: usize,
    /// Height and width of the picture.
    pub picture: Option<[usize; 2]>,
    /// Mean and deviation of each reading.
    pub readings: Vec<[f32; 2]>,
    /// Mean and deviation of log10 of the modulus.
    pub log10_e: [f32; 2],
    /// By which the classes' numbers are divided.
    pub temperature: f32,
}

/// What is like the training data: the squared length of `whiten * (value - mean)` is small.
#[derive(Debug, Clone)]
pub(crate) struct Familiar {
    /// Of the values.
    pub mean: Vec<f32>,
    /// `[row][column]`, square.
    pub whiten: Vec<f32>,
}

fn numbers<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

/// Adds nodes to the graph under names that count up.
struct Writer {
    graph: Graph,
    count: usize,
}

impl Writer {
    fn name(&mut self) -> String {
        self.count += 1;
        format!("n{}", self.count)
    }

    fn node(&mut self, operator: &str, inputs: &[&str], attributes: &[(&str, Attribute)]) -> String {
        let name = self.name();
        self.graph.node(operator, inputs, &name, attributes)
    }

    fn ints(&mut self, values: Vec<i64>) -> String {
        let name = self.name();
        self.graph.ints(&name, values)
    }

    fn conv(&mut self, input: &str, layer: &ConvNorm) -> String {
        let dims = layer.conv.weight.dims();
        let norm = &layer.norm;
        let (gamma, beta) = (numbers(norm.gamma.val()), numbers(norm.beta.val()));
        // the last batch's share too, which `value` may leave out and a checkpoint would lose
        let (mean, variance) =
            (numbers(norm.running_mean.value_sync()), numbers(norm.running_var.value_sync()));
        let scale: Vec<f64> = gamma
            .iter()
            .zip(&variance)
            .map(|(gamma, variance)| f64::from(*gamma) / (f64::from(*variance) + norm.epsilon).sqrt())
            .collect();
        let one: usize = dims[1..].iter().product();
        let weights = numbers(layer.conv.weight.val());
        let weights =
            weights.iter().enumerate().map(|(at, w)| (f64::from(*w) * scale[at / one]) as f32).collect();
        let bias = beta.iter().zip(&mean).zip(&scale);
        let bias =
            bias.map(|((beta, mean), scale)| (f64::from(*beta) - f64::from(*mean) * scale) as f32).collect();
        let (name, offset) = (self.name(), self.name());
        self.graph.floats(&name, &dims, weights);
        self.graph.floats(&offset, &[dims[0]], bias);
        let sides = |values: [usize; 2]| Attribute::Ints(values.iter().map(|v| *v as i64).collect());
        let settings = [
            ("kernel_shape", sides([dims[2], dims[3]])),
            ("strides", sides(layer.conv.stride)),
            ("pads", Attribute::Ints(vec![(dims[2] / 2) as i64; 4])),
        ];
        self.node("Conv", &[input, &name, &offset], &settings)
    }

    fn block(&mut self, input: &str, block: &Block) -> String {
        let inner = self.conv(input, &block.first);
        let inner = self.node("Relu", &[&inner], &[]);
        let inner = self.conv(&inner, &block.second);
        let past = block.past.as_ref().map_or_else(|| input.to_string(), |past| self.conv(input, past));
        let sum = self.node("Add", &[&inner, &past], &[]);
        self.node("Relu", &[&sum], &[])
    }

    fn eye(&mut self, eye: &Eye) -> String {
        let value = self.conv("picture", &eye.stem);
        let mut value = self.node("Relu", &[&value], &[]);
        if eye.pools {
            let ints = |values: &[i64]| Attribute::Ints(values.to_vec());
            let settings =
                [("kernel_shape", ints(&[3, 3])), ("strides", ints(&[2, 2])), ("pads", ints(&[1, 1, 1, 1]))];
            value = self.node("MaxPool", &[&value], &settings);
        }
        for block in &eye.blocks {
            value = self.block(&value, block);
        }
        let value = self.node("GlobalAveragePool", &[&value], &[]);
        let value = self.node("Flatten", &[&value], &[]);
        let value = self.linear(&value, &eye.features, None);
        self.node("Relu", &[&value], &[])
    }

    /// `weights` `[inputs][outputs]`.
    fn gemm(&mut self, input: &str, weights: Vec<f32>, bias: Vec<f32>, output: Option<&str>) -> String {
        let (name, offset) = (self.name(), self.name());
        self.graph.floats(&name, &[weights.len() / bias.len(), bias.len()], weights);
        self.graph.floats(&offset, &[bias.len()], bias);
        let output = output.map_or_else(|| self.name(), str::to_string);
        self.graph.node("Gemm", &[input, &name, &offset], &output, &[])
    }

    fn linear(&mut self, input: &str, layer: &Linear, output: Option<&str>) -> String {
        let (weights, bias) = parts(layer);
        self.gemm(input, weights, bias, output)
    }

    fn gru(&mut self, input: &str, gru: &BiGru) -> String {
        let (mut input_weights, mut recurrent, mut bias) = (Vec::new(), Vec::new(), Vec::new());
        let mut sides = [0, gru.d_hidden];
        for way in [&gru.forward, &gru.reverse] {
            sides[0] = way.update_gate.input_transform.weight.dims()[0];
            direction(way, &mut input_weights, &mut recurrent, &mut bias);
        }
        let [inputs, hidden] = sides;
        let names = [self.name(), self.name(), self.name()];
        self.graph.floats(&names[0], &[2, 3 * hidden, inputs], input_weights);
        self.graph.floats(&names[1], &[2, 3 * hidden, hidden], recurrent);
        self.graph.floats(&names[2], &[2, 6 * hidden], bias);
        let settings = [
            ("hidden_size", Attribute::Int(hidden as i64)),
            ("direction", Attribute::Text("bidirectional".into())),
            ("linear_before_reset", Attribute::Int(1)),
        ];
        self.node("GRU", &[input, &names[0], &names[1], &names[2]], &settings)
    }

    /// The last rows.
    fn last(&mut self, input: &str, rows: usize, window: usize) -> String {
        let first = self.ints(vec![(window - rows) as i64]);
        let end = self.ints(vec![window as i64]);
        let axis = self.ints(vec![0]);
        self.node("Slice", &[input, &first, &end, &axis], &[])
    }

    fn distance(&mut self, input: &str, familiar: &Familiar) -> String {
        let count = familiar.mean.len();
        let mut weights = vec![0.0; count * count];
        let mut bias = vec![0.0; count];
        for (row, shares) in familiar.whiten.chunks_exact(count).enumerate() {
            for (column, share) in shares.iter().enumerate() {
                weights[column * count + row] = *share;
            }
            bias[row] = -shares.iter().zip(&familiar.mean).map(|(a, b)| f64::from(a * b)).sum::<f64>() as f32;
        }
        let value = self.gemm(input, weights, bias, None);
        self.node("ReduceSumSquare", &[&value], &[("axes", Attribute::Ints(vec![1]))])
    }
}

/// Weights `[inputs][outputs]` and offsets of a layer.
fn parts(layer: &Linear) -> (Vec<f32>, Vec<f32>) {
    let outputs = layer.weight.dims()[1];
    let bias = layer.bias.as_ref().map_or_else(|| vec![0.0; outputs], |bias| numbers(bias.val()));
    (numbers(layer.weight.val()), bias)
}

/// Adds one direction's weights, gates in ONNX's order: update, reset, candidate.
fn direction(gru: &Gru, input: &mut Vec<f32>, recurrent: &mut Vec<f32>, bias: &mut Vec<f32>) {
    let gates = [&gru.update_gate, &gru.reset_gate, &gru.new_gate];
    for gate in gates {
        input.extend(numbers(gate.input_transform.weight.val().transpose()));
        recurrent.extend(numbers(gate.hidden_transform.weight.val().transpose()));
    }
    gates.iter().for_each(|gate| bias.extend(parts(&gate.input_transform).1));
    gates.iter().for_each(|gate| bias.extend(parts(&gate.hidden_transform).1));
}

/// Scales of a layer's outputs, then offsets, worked into the layer.
fn scaled(
    layer: &Linear,
    scale: impl Fn(usize) -> f32,
    offset: impl Fn(usize) -> f32,
) -> (Vec<f32>, Vec<f32>) {
    let (mut weights, mut bias) = parts(layer);
    let outputs = bias.len();
    weights.iter_mut().enumerate().for_each(|(at, weight)| *weight *= scale(at % outputs));
    bias.iter_mut().enumerate().for_each(|(at, bias)| *bias = *bias * scale(at) + offset(at));
    (weights, bias)
}

/// The readings' layer, with their means and deviations worked in.
fn of_raw_readings(layer: &Linear, scales: &[[f32; 2]]) -> (Vec<f32>, Vec<f32>) {
    let (mut weights, mut bias) = parts(layer);
    let outputs = bias.len();
    for (row, [mean, deviation]) in weights.chunks_exact_mut(outputs).zip(scales) {
        for (weight, bias) in row.iter_mut().zip(&mut bias) {
            *weight /= deviation;
            *bias -= *weight * mean;
        }
    }
    (weights, bias)
}

/// The graph; with `familiar` of the last states and of the last readings it has the output `novelty`, without it the
/// output `state`.
pub fn graph(net: &Net, scales: &Scales, familiar: &[Familiar]) -> Graph {
    let mut writer = Writer { graph: Graph::default(), count: 0 };
    let (window, hidden) = (scales.window, net.gru.d_hidden);
    let mut features = Vec::new();
    if let (Some(eye), Some([height, width])) = (&net.eye, scales.picture) {
        writer.graph.inputs.push(Port { name: "picture".into(), dims: vec![window, 3, height, width] });
        features.push(writer.eye(eye));
    }
    if let Some(layer) = &net.readings {
        writer.graph.inputs.push(Port { name: "readings".into(), dims: vec![window, scales.readings.len()] });
        let (weights, bias) = of_raw_readings(layer, &scales.readings);
        let value = writer.gemm("readings", weights, bias, None);
        features.push(writer.node("Relu", &[&value], &[]));
    }
    let names: Vec<&str> = features.iter().map(String::as_str).collect();
    let value = writer.node("Concat", &names, &[("axis", Attribute::Int(1))]);
    let axis = writer.ints(vec![1]);
    let value = writer.node("Unsqueeze", &[&value, &axis], &[]);
    let states = writer.gru(&value, &net.gru);
    let last = writer.last(&states, LAST_FRAMES.min(window), window);
    let settings = [("axes", Attribute::Ints(vec![0])), ("keepdims", Attribute::Int(0))];
    let mean = writer.node("ReduceMean", &[&last], &settings);
    let shape = writer.ints(vec![1, 2 * hidden as i64]);
    let state = writer.graph.node("Reshape", &[&mean, &shape], "state", &[]);

    let (weights, bias) = scaled(&net.class, |_| 1.0 / scales.temperature, |_| 0.0);
    let classes = bias.len();
    let value = writer.gemm(&state, weights, bias, None);
    writer.graph.node("Softmax", &[&value], "probability", &[("axis", Attribute::Int(1))]);
    let [middle, deviation] = scales.log10_e;
    let offset = [middle, deviation.ln()];
    let (weights, bias) = scaled(&net.modulus, |at| if at == 0 { deviation } else { 1.0 }, |at| offset[at]);
    writer.gemm(&state, weights, bias, Some("log10_e"));
    let mut outputs = vec![("probability", classes), ("log10_e", 2)];
    if familiar.is_empty() {
        outputs.push(("state", 2 * hidden));
    } else {
        let mut distances = vec![writer.distance(&state, &familiar[0])];
        if let Some(familiar) = familiar.get(1) {
            let readings = writer.last("readings", 1, window);
            distances.push(writer.distance(&readings, familiar));
        }
        let names: Vec<&str> = distances.iter().map(String::as_str).collect();
        writer.graph.node("Concat", &names, "novelty", &[("axis", Attribute::Int(1))]);
        outputs.push(("novelty", distances.len()));
    }
    let ports = outputs.into_iter().map(|(name, count)| Port { name: name.into(), dims: vec![1, count] });
    writer.graph.outputs = ports.collect();
    writer.graph
}
