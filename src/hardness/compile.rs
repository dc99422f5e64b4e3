//! A graph to the steps that run it. Everything that a step relies on is checked here.

use std::collections::{HashMap, HashSet};

use crate::error::ModelError;
use crate::graph::{Constant, Graph, GraphNode, Values};
use crate::kernels::Map;
use crate::network::{Network, Shape, Slot, Step};
use crate::settings::Settings;

/// Numbers in all buffers at most.
const MAX_NUMBERS: usize = 16 << 20;
/// Multiplications for a frame or a window at most: some seconds of one core.
const MAX_WORK: u64 = 20_000_000_000;
/// Frames of a window.
const MAX_WINDOW: usize = 1000;

/// A value by its name.
#[derive(Debug, Clone)]
pub(crate) struct Value {
    pub(crate) slot: Slot,
    pub(crate) shape: Shape,
}

/// What has been laid out so far.
pub(crate) struct Compiler<'a> {
    graph: &'a Graph,
    values: HashMap<&'a str, Value>,
    constants: HashMap<&'a str, &'a Constant>,
    /// How many nodes and outputs read a value.
    uses: HashMap<&'a str, usize>,
    /// The border that the readers of a value need.
    borders: HashMap<&'a str, usize>,
    /// The window's buffer of the rows of a frame's buffer.
    remembered: HashMap<Slot, Slot>,
    /// Buffers that go by a second name.
    aliased: HashSet<Slot>,
    pub(crate) network: Network,
    numbers: usize,
    work: u64,
}

impl<'a> Compiler<'a> {
    /// A buffer of a shape.
    pub(crate) fn buffer(&mut self, shape: &Shape) -> Result<Slot, ModelError> {
        self.numbers = self.numbers.saturating_add(shape.len());
        if self.numbers > MAX_NUMBERS || shape.len() == 0 {
            let allowed = format!("1 to {MAX_NUMBERS} numbers in all values together");
            return Err(ModelError::new(
                "the graph",
                format!("has a value of {} numbers", shape.len()),
                allowed,
            ));
        }
        self.network.buffers.push(vec![0.0; shape.len()]);
        Ok(self.network.buffers.len() - 1)
    }

    /// Adds a step, with its multiplications.
    pub(crate) fn step(&mut self, step: Step, work: u64, of_frame: bool) -> Result<(), ModelError> {
        self.work = self.work.saturating_add(work);
        if self.work > MAX_WORK {
            let problem = format!("needs {} multiplications for a frame", self.work);
            return Err(ModelError::new("the graph", problem, format!("at most {MAX_WORK}")));
        }
        let steps = if of_frame { &mut self.network.frame_steps } else { &mut self.network.window_steps };
        steps.push(step);
        Ok(())
    }

    /// Names a value; a name is given once.
    pub(crate) fn name(&mut self, name: &'a str, value: Value) -> Result<(), ModelError> {
        if name.is_empty() || self.constants.contains_key(name) || self.values.insert(name, value).is_some() {
            return Err(ModelError::new(
                format!("value \"{name}\""),
                "is made twice",
                "one node that makes it",
            ));
        }
        Ok(())
    }

    /// The border that the readers of a value need.
    pub(crate) fn border(&self, name: &str) -> usize {
        self.borders.get(name).copied().unwrap_or(0)
    }

    /// Names a buffer once more, as a value of other sides.
    pub(crate) fn alias(&mut self, name: &'a str, slot: Slot, shape: Shape) -> Result<(), ModelError> {
        self.aliased.insert(slot);
        self.name(name, Value { slot, shape })
    }

    /// Whether one node alone sees the buffer of a value.
    pub(crate) fn is_read_once(&self, name: &str, slot: Slot) -> bool {
        self.uses.get(name) == Some(&1) && !self.aliased.contains(&slot)
    }

    /// The value that a node reads.
    pub(crate) fn value(&self, node: &'a GraphNode, at: usize) -> Result<Value, ModelError> {
        let name = node.inputs.get(at).map_or("", String::as_str);
        self.values.get(name).cloned().ok_or_else(|| {
            let problem = format!("reads \"{name}\", which no node before it makes");
            Settings::new(node).error(problem, "an input of the graph, or the output of an earlier node")
        })
    }

    fn constant(&self, node: &GraphNode, at: usize) -> Result<&'a Constant, ModelError> {
        let name = node.inputs.get(at).map_or("", String::as_str);
        self.constants.get(name).copied().ok_or_else(|| {
            Settings::new(node).error(format!("reads \"{name}\", which is no constant"), "a constant tensor")
        })
    }

    /// Floats of given sides that a node reads.
    pub(crate) fn floats(
        &self,
        node: &GraphNode,
        at: usize,
        dims: &[usize],
    ) -> Result<&'a [f32], ModelError> {
        let constant = self.constant(node, at)?;
        match &constant.values {
            Values::Float(values) if constant.dims == dims => Ok(values),
            _ => {
                let problem = format!("reads \"{}\" with the sides {:?}", constant.name, constant.dims);
                Err(Settings::new(node).error(problem, format!("floats with the sides {dims:?}")))
            }
        }
    }

    /// The sides of a constant that a node reads.
    pub(crate) fn dims(&self, node: &GraphNode, at: usize) -> Result<&'a [usize], ModelError> {
        Ok(&self.constant(node, at)?.dims)
    }

    /// A short list of integers that a node reads.
    pub(crate) fn ints(&self, node: &GraphNode, at: usize) -> Result<&'a [i64], ModelError> {
        let constant = self.constant(node, at)?;
        match &constant.values {
            Values::Int(values) if values.len() <= 4 => Ok(values),
            _ => {
                let problem = format!("reads \"{}\", which is no list of integers", constant.name);
                Err(Settings::new(node).error(problem, "a constant list of integers"))
            }
        }
    }

    /// A value as the window has it: a row of a frame becomes as many rows as the window has frames.
    pub(crate) fn of_window(
        &mut self,
        node: &'a GraphNode,
        at: usize,
    ) -> Result<(Slot, Vec<usize>), ModelError> {
        let value = self.value(node, at)?;
        match value.shape {
            Shape::Window(sides) => Ok((value.slot, sides)),
            Shape::Map(_) => Err(Settings::new(node).error("reads a picture", "a list of numbers")),
            Shape::Row(count) => {
                let sides = vec![self.network.window, count];
                if let Some(slot) = self.remembered.get(&value.slot) {
                    return Ok((*slot, sides));
                }
                let slot = self.buffer(&Shape::Window(sides.clone()))?;
                self.remembered.insert(value.slot, slot);
                self.step(Step::Remember(value.slot, slot), 0, true)?;
                Ok((slot, sides))
            }
        }
    }

    fn count(graph: &'a Graph) -> (HashMap<&'a str, usize>, HashMap<&'a str, usize>) {
        let (mut uses, mut borders) = (HashMap::new(), HashMap::new());
        let names = graph.nodes.iter().flat_map(|node| &node.inputs);
        for name in names.chain(graph.outputs.iter().map(|port| &port.name)) {
            *uses.entry(name.as_str()).or_default() += 1;
        }
        for node in graph.nodes.iter().rev() {
            let Some(input) = node.inputs.first() else { continue };
            let border = match node.operator.as_str() {
                "Conv" => Settings::new(node).alike("pads", 4, 0, 0..=3).unwrap_or(0),
                "Relu" => {
                    let made = node.outputs.first().map_or("", String::as_str);
                    borders.get(made).copied().unwrap_or(0)
                }
                _ => continue,
            };
            let known = borders.entry(input.as_str()).or_default();
            *known = border.max(*known);
        }
        (uses, borders)
    }

    fn new(graph: &'a Graph, window: usize) -> Result<Self, ModelError> {
        let mut constants = HashMap::new();
        for constant in &graph.constants {
            if constants.insert(constant.name.as_str(), constant).is_some() {
                let at = format!("tensor \"{}\"", constant.name);
                return Err(ModelError::new(at, "stands there twice", "one tensor of a name"));
            }
        }
        let (uses, borders) = Self::count(graph);
        let network = Network {
            buffers: Vec::new(),
            frame_steps: Vec::new(),
            window_steps: Vec::new(),
            picture: None,
            readings: None,
            outputs: Vec::new(),
            window,
            frames: 0,
        };
        let (values, remembered, aliased) = (HashMap::new(), HashMap::new(), HashSet::new());
        Ok(Self {
            graph,
            values,
            constants,
            uses,
            borders,
            remembered,
            aliased,
            network,
            numbers: 0,
            work: 0,
        })
    }

    fn inputs(&mut self) -> Result<(), ModelError> {
        for port in &self.graph.inputs {
            let shape = match (port.name.as_str(), port.dims.as_slice()) {
                ("picture", [window, channels, height, width]) if *window == self.network.window => {
                    let border = self.border("picture");
                    Shape::Map(Map { channels: *channels, height: *height, width: *width, border })
                }
                ("readings", [window, count]) if *window == self.network.window => Shape::Row(*count),
                _ => {
                    let allowed = "picture [window, channels, height, width], readings [window, count]";
                    let problem = format!("has the sides {:?}", port.dims);
                    return Err(ModelError::new(format!("input \"{}\"", port.name), problem, allowed));
                }
            };
            // before the length is asked for: sides that multiply to more than a machine counts
            let sides = port.dims.iter().chain([&64]).try_fold(1_usize, |all, side| all.checked_mul(*side));
            if sides.is_none_or(|sides| sides / 64 > MAX_NUMBERS) {
                let problem = format!("has the sides {:?}", port.dims);
                return Err(ModelError::new(
                    "the picture",
                    problem,
                    format!("at most {MAX_NUMBERS} numbers"),
                ));
            }
            let slot = self.buffer(&shape)?;
            match &shape {
                Shape::Map(map) => self.network.picture = Some((*map, slot)),
                _ => self.network.readings = Some(slot),
            }
            self.name(&port.name, Value { slot, shape })?;
        }
        Ok(())
    }

    fn outputs(&mut self) -> Result<(), ModelError> {
        for port in &self.graph.outputs {
            let value = self.values.get(port.name.as_str());
            let Some(value) = value.filter(|value| value.shape == Shape::Window(port.dims.clone())) else {
                let problem = "is made by no node, or is of one frame, or has other sides than it says";
                return Err(ModelError::new(
                    format!("output \"{}\"", port.name),
                    problem,
                    "a value of the window",
                ));
            };
            self.network.outputs.push((port.name.clone(), value.slot));
        }
        Ok(())
    }
}

impl Network {
    /// Lays out a graph with the inputs `picture` `[window, channels, height, width]` and `readings` `[window, count]` (one of
    /// them, or both).
    ///
    /// # Errors
    /// [`ModelError`]: a node, a setting or a size that is not known or does not fit.
    pub fn new(graph: &Graph) -> Result<Self, ModelError> {
        let window = graph.inputs.first().and_then(|port| port.dims.first()).copied().unwrap_or(0);
        if !(2..=MAX_WINDOW).contains(&window) {
            let problem = format!("has {window} frames");
            return Err(ModelError::new("the window", problem, format!("2 to {MAX_WINDOW} frames")));
        }
        let mut compiler = Compiler::new(graph, window)?;
        compiler.inputs()?;
        for node in &graph.nodes {
            compiler.node(node)?;
        }
        compiler.outputs()?;
        Ok(compiler.network)
    }
}
