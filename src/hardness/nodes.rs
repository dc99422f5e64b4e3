//! Each kind of node: what it may be set to, and the step that it becomes.

use crate::compile::{Compiler, Value};
use crate::error::ModelError;
use crate::graph::GraphNode;
use crate::kernels::{Conv, Gru, Linear, Map, MaxPool, swept};
use crate::network::{Shape, Slot, Step};
use crate::settings::Settings;

/// The kinds of nodes that are known.
const KNOWN: &str = "Conv, Relu, Add, MaxPool, GlobalAveragePool, Flatten, Gemm, Concat, Unsqueeze, GRU, Slice, ReduceMean, \
                     Reshape, ReduceSumSquare, Softmax";

impl<'a> Compiler<'a> {
    /// Adds the step of one node.
    pub(crate) fn node(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        if node.outputs.len() != 1 {
            let problem = format!("has {} outputs", node.outputs.len());
            return Err(Settings::new(node).error(problem, "one"));
        }
        match node.operator.as_str() {
            "Conv" => self.conv(node),
            "Relu" => self.relu(node),
            "Add" => self.add(node),
            "MaxPool" => self.max_pool(node),
            "GlobalAveragePool" => self.average(node),
            "Flatten" => self.flatten(node),
            "Gemm" => self.gemm(node),
            "Concat" => self.concat(node),
            "Unsqueeze" => self.unsqueeze(node),
            "GRU" => self.gru(node),
            "Slice" => self.slice(node),
            "ReduceMean" => self.mean(node),
            "Reshape" => self.reshape(node),
            "ReduceSumSquare" => self.sum_of_squares(node),
            "Softmax" => self.softmax(node),
            other => {
                Err(ModelError::new(format!("node \"{other}\""), "is of a kind that is not known", KNOWN))
            }
        }
    }

    /// A new buffer for the node's output.
    fn output(&mut self, node: &'a GraphNode, shape: Shape) -> Result<Slot, ModelError> {
        let slot = self.buffer(&shape)?;
        self.name(&node.outputs[0], Value { slot, shape })?;
        Ok(slot)
    }

    /// The map that a node reads.
    fn map(&self, node: &'a GraphNode, at: usize) -> Result<(Map, Slot), ModelError> {
        let value = self.value(node, at)?;
        match value.shape {
            Shape::Map(map) => Ok((map, value.slot)),
            _ => Err(Settings::new(node).error("reads a list of numbers", "a picture")),
        }
    }

    fn takes(&self, node: &GraphNode, counts: std::ops::RangeInclusive<usize>) -> Result<(), ModelError> {
        let count = node.inputs.len();
        let allowed = || format!("{} to {}", counts.start(), counts.end());
        let fault = || Settings::new(node).error(format!("has {count} inputs"), allowed());
        if counts.contains(&count) { Ok(()) } else { Err(fault()) }
    }

    /// Kernel, stride and pad, and the output's map.
    fn sweep(&self, node: &GraphNode, map: &Map, channels: usize) -> Result<([usize; 3], Map), ModelError> {
        let mut settings = Settings::new(node);
        let kernel = settings.alike("kernel_shape", 2, 0, 1..=7)?;
        let stride = settings.alike("strides", 2, 1, 1..=4)?;
        let pad = settings.alike("pads", 4, 0, 0..=3)?;
        settings.alike("dilations", 2, 1, 1..=1)?;
        settings.text("auto_pad", "NOTSET", "NOTSET")?;
        if node.operator == "Conv" {
            settings.must_be("group", 1, 1)?;
        } else {
            settings.must_be("ceil_mode", 0, 0)?;
            settings.must_be("storage_order", 0, 0)?;
        }
        let sides = [map.height, map.width].map(|side| swept(side, kernel, stride, pad));
        let (true, [Some(height), Some(width)]) = (2 * pad <= kernel, sides) else {
            let problem =
                format!("sweeps {kernel} pixels with {pad} more over {} x {}", map.width, map.height);
            return Err(settings.error(problem, "a kernel within the picture, at most half of it outside"));
        };
        settings.end()?;
        let border = self.border(&node.outputs[0]);
        Ok(([kernel, stride, pad], Map { channels, height, width, border }))
    }

    fn conv(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 3..=3)?;
        let (map, from) = self.map(node, 0)?;
        let channels = *self.dims(node, 1)?.first().unwrap_or(&0);
        let (sweep, output) = self.sweep(node, &map, channels)?;
        let weights = self.floats(node, 1, &[channels, map.channels, sweep[0], sweep[0]])?;
        let bias = self.floats(node, 2, &[channels])?;
        let to = self.output(node, Shape::Map(output))?;
        let conv = Conv::new([map, output], sweep, weights, bias);
        let work = conv.work();
        self.step(Step::Conv(conv, from, to), work, true)
    }

    /// Joins the step before it where that can be, else becomes one of its own.
    fn relu(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 1..=1)?;
        Settings::new(node).end()?;
        let value = self.value(node, 0)?;
        let single = self.is_read_once(&node.inputs[0], value.slot);
        let of_frame = !matches!(value.shape, Shape::Window(_));
        let steps = if of_frame { &mut self.network.frame_steps } else { &mut self.network.window_steps };
        let last = steps.last_mut().filter(|step| step.target() == value.slot);
        let joined = match last {
            Some(Step::Conv(conv, ..)) => Some(&mut conv.relu),
            Some(Step::Linear(linear, ..)) => Some(&mut linear.relu),
            Some(Step::AddMaps { relu, .. }) => Some(relu),
            _ => None,
        };
        if let Some(relu) = joined.filter(|_| single) {
            *relu = true;
            return self.name(&node.outputs[0], value);
        }
        let to = self.output(node, value.shape.clone())?;
        self.step(Step::Relu(value.slot, to), 0, of_frame)
    }

    fn add(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 2..=2)?;
        Settings::new(node).end()?;
        let ((a, from_a), (b, from_b)) = (self.map(node, 0)?, self.map(node, 1)?);
        if !a.alike(&b) {
            return Err(Settings::new(node).error("adds pictures of two sizes", "two of one size"));
        }
        let sum = Map { border: self.border(&node.outputs[0]), ..a };
        let to = self.output(node, Shape::Map(sum))?;
        let step = Step::AddMaps { maps: [a, b, sum], from: [from_a, from_b], to, relu: false };
        self.step(step, sum.len() as u64, true)
    }

    fn max_pool(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 1..=1)?;
        let (input, from) = self.map(node, 0)?;
        let ([kernel, stride, pad], output) = self.sweep(node, &input, input.channels)?;
        let to = self.output(node, Shape::Map(output))?;
        let work = (output.len() * kernel * kernel) as u64;
        self.step(Step::MaxPool(MaxPool { input, output, kernel, stride, pad }, from, to), work, true)
    }

    fn average(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 1..=1)?;
        Settings::new(node).end()?;
        let (map, from) = self.map(node, 0)?;
        let one = Map { channels: map.channels, height: 1, width: 1, border: 0 };
        if self.border(&node.outputs[0]) != 0 {
            return Err(Settings::new(node).error("is convolved with a border", "Flatten after it"));
        }
        let to = self.output(node, Shape::Map(one))?;
        self.step(Step::Average(map, from, to), map.len() as u64, true)
    }

    fn flatten(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 1..=1)?;
        let mut settings = Settings::new(node);
        settings.must_be("axis", 1, 1)?;
        let (map, slot) = self.map(node, 0)?;
        if [map.height, map.width, map.border] != [1, 1, 0] {
            return Err(settings.error("reads more than a pixel", "GlobalAveragePool before it"));
        }
        settings.end()?;
        self.alias(&node.outputs[0], slot, Shape::Row(map.channels))
    }

    fn gemm(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 3..=3)?;
        let mut settings = Settings::new(node);
        settings.float("alpha", 1.0)?;
        settings.float("beta", 1.0)?;
        settings.must_be("transA", 0, 0)?;
        let transposed = settings.int("transB", 0)? != 0;
        let value = self.value(node, 0)?;
        let (rows, inputs) = match &value.shape {
            Shape::Row(count) => (None, *count),
            Shape::Window(sides) if sides.len() == 2 => (Some(sides[0]), sides[1]),
            _ => return Err(settings.error("reads a value of other than two sides", "rows of numbers")),
        };
        settings.end()?;
        let outputs = *self.dims(node, 2)?.first().unwrap_or(&0);
        let sides = if transposed { [outputs, inputs] } else { [inputs, outputs] };
        let weights = self.floats(node, 1, &sides)?;
        let linear = Linear::new(inputs, weights, transposed, self.floats(node, 2, &[outputs])?);
        let work = linear.work() * rows.unwrap_or(1) as u64;
        let shape = rows.map_or(Shape::Row(outputs), |rows| Shape::Window(vec![rows, outputs]));
        let to = self.output(node, shape)?;
        self.step(Step::Linear(linear, value.slot, to), work, rows.is_none())
    }

    /// Rows of a frame, or single rows of the window, one after the other.
    fn concat(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 1..=16)?;
        let mut settings = Settings::new(node);
        let axis = settings.int("axis", 1)?;
        let (mut slots, mut count, mut of_frame) = (Vec::new(), 0, Vec::new());
        for at in 0..node.inputs.len() {
            let value = self.value(node, at)?;
            match &value.shape {
                Shape::Row(_) => of_frame.push(true),
                Shape::Window(sides) if sides.len() == 2 && sides[0] == 1 => of_frame.push(false),
                _ => return Err(settings.error("reads a picture or several rows", "single rows")),
            }
            slots.push(value.slot);
            count += value.shape.len();
        }
        let of_frame_all = of_frame[0];
        if (axis != 1 && axis != -1) || of_frame.iter().any(|of| *of != of_frame_all) {
            let problem = format!("joins along {axis}, or rows of a frame with those of the window");
            return Err(settings.error(problem, "rows of one kind along 1"));
        }
        settings.end()?;
        let shape = if of_frame_all { Shape::Row(count) } else { Shape::Window(vec![1, count]) };
        let to = self.output(node, shape)?;
        self.step(Step::Concat(slots, to), 0, of_frame_all)
    }

    /// `[window, n]` as `[window, 1, n]`: what a GRU reads.
    fn unsqueeze(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 2..=2)?;
        let settings = Settings::new(node);
        let (slot, sides) = self.of_window(node, 0)?;
        if self.ints(node, 1)? != [1] || sides.len() != 2 {
            return Err(settings.error("adds another side than the second", "axes [1] of rows"));
        }
        settings.end()?;
        self.alias(&node.outputs[0], slot, Shape::Window(vec![sides[0], 1, sides[1]]))
    }

    fn gru(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 4..=4)?;
        let mut settings = Settings::new(node);
        settings.text("direction", "forward", "bidirectional")?;
        settings.must_be("linear_before_reset", 0, 1)?;
        let value = self.value(node, 0)?;
        let (steps, inputs) = match &value.shape {
            Shape::Window(sides) if sides.len() == 3 && sides[1] == 1 => (sides[0], sides[2]),
            _ => return Err(settings.error("reads no sequence", "a value [window, 1, n]")),
        };
        let hidden = self.dims(node, 2)?.last().copied().unwrap_or(0).min(1 << 16);
        settings.must_be("hidden_size", hidden as i64, hidden as i64)?;
        settings.end()?;
        let weights = self.floats(node, 1, &[2, 3 * hidden, inputs])?;
        let recurrent = self.floats(node, 2, &[2, 3 * hidden, hidden])?;
        let gru = Gru::new([inputs, hidden], weights, recurrent, self.floats(node, 3, &[2, 6 * hidden])?);
        let work = gru.work() * steps as u64;
        let to = self.output(node, Shape::Window(vec![steps, 2, 1, hidden]))?;
        self.step(Step::Gru(Box::new(gru), value.slot, to), work, false)
    }

    /// Some of the rows.
    fn slice(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 4..=5)?;
        let settings = Settings::new(node);
        let (from, mut sides) = self.of_window(node, 0)?;
        let rows = sides[0] as i64;
        let one = |at| match self.ints(node, at) {
            Ok([value]) => Ok(*value),
            Ok(_) => Err(Settings::new(node).error("cuts several sides", "one")),
            Err(error) => Err(error),
        };
        let step = if node.inputs.len() == 5 { one(4)? } else { 1 };
        let end = |at: i64| if at < 0 { at.saturating_add(rows) } else { at.min(rows) };
        let (first, last) = (end(one(1)?), end(one(2)?));
        if one(3)? != 0 || step != 1 || first < 0 || first >= last {
            return Err(
                settings.error(format!("cuts {first}..{last} in steps of {step}"), "rows, one by one")
            );
        }
        settings.end()?;
        sides[0] = (last - first) as usize;
        let width: usize = sides[1..].iter().product();
        let to = self.output(node, Shape::Window(sides))?;
        self.step(Step::Part(from, first as usize * width, to), 0, false)
    }

    fn mean(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 1..=1)?;
        let mut settings = Settings::new(node);
        let axes = settings.ints("axes", &[])?;
        let keeps = settings.int("keepdims", 1)? != 0;
        let (from, mut sides) = self.of_window(node, 0)?;
        if axes != [0] || sides.len() < 2 {
            return Err(settings.error(format!("is the mean over {axes:?}"), "[0]"));
        }
        settings.end()?;
        if keeps {
            sides[0] = 1;
        } else {
            sides.remove(0);
        }
        let to = self.output(node, Shape::Window(sides))?;
        self.step(Step::MeanOfRows(from, to), 0, false)
    }

    fn reshape(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        self.takes(node, 2..=2)?;
        let mut settings = Settings::new(node);
        settings.must_be("allowzero", 0, 0)?;
        let (slot, sides) = self.of_window(node, 0)?;
        let count: usize = sides.iter().product();
        let wanted = self.ints(node, 1)?;
        if wanted != [1, count as i64] && wanted != [1, -1] {
            return Err(settings.error(format!("has the shape {wanted:?}"), format!("[1, {count}]")));
        }
        settings.end()?;
        self.alias(&node.outputs[0], slot, Shape::Window(vec![1, count]))
    }

    /// The settings of a node that reads one row and the row.
    fn single_row(&mut self, node: &'a GraphNode) -> Result<(Slot, usize), ModelError> {
        self.takes(node, 1..=1)?;
        match self.of_window(node, 0)? {
            (from, sides) if sides.len() == 2 && sides[0] == 1 => Ok((from, sides[1])),
            _ => Err(Settings::new(node).error("reads several rows", "a single row")),
        }
    }

    fn sum_of_squares(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        let (from, _) = self.single_row(node)?;
        let mut settings = Settings::new(node);
        let axes = settings.ints("axes", &[])?;
        settings.must_be("keepdims", 1, 1)?;
        if axes != [1] {
            return Err(settings.error(format!("is the sum over {axes:?}"), "[1]"));
        }
        settings.end()?;
        let to = self.output(node, Shape::Window(vec![1, 1]))?;
        self.step(Step::SumOfSquares(from, to), 0, false)
    }

    fn softmax(&mut self, node: &'a GraphNode) -> Result<(), ModelError> {
        let (from, count) = self.single_row(node)?;
        let mut settings = Settings::new(node);
        let axis = settings.int("axis", -1)?;
        if axis != 1 && axis != -1 {
            return Err(settings.error(format!("runs along {axis}"), "1"));
        }
        settings.end()?;
        let to = self.output(node, Shape::Window(vec![1, count]))?;
        self.step(Step::Softmax(from, to), 0, false)
    }
}
