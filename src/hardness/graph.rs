//! A network as a list of nodes, as ONNX has it.

/// A constant: weights, or sizes.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// By which nodes name it.
    pub name: String,
    /// Sides, the slowest first.
    pub dims: Vec<usize>,
    /// As many as the product of the sides.
    pub values: Values,
}

/// The numbers of a constant.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 32-bit floats.
    Float(Vec<f32>),
    /// 64-bit integers.
    Int(Vec<i64>),
}

/// What a node is set to.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// An integer.
    Int(i64),
    /// A list of integers.
    Ints(Vec<i64>),
    /// A float.
    Float(f32),
    /// A text.
    Text(String),
}

/// One operation.
#[derive(Debug, Clone, PartialEq)]
pub struct GraphNode {
    /// ONNX's name of the operator.
    pub operator: String,
    /// Names of the values and constants that it reads; an empty one is left out.
    pub inputs: Vec<String>,
    /// Names of the values that it makes.
    pub outputs: Vec<String>,
    /// Its settings by name.
    pub attributes: Vec<(String, Attribute)>,
}

/// A value that goes in or comes out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Its name.
    pub name: String,
    /// Its sides, the slowest first.
    pub dims: Vec<usize>,
}

/// A network: nodes in an order in which they can be run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    /// What goes in.
    pub inputs: Vec<Port>,
    /// What comes out.
    pub outputs: Vec<Port>,
    /// The operations.
    pub nodes: Vec<GraphNode>,
    /// The weights.
    pub constants: Vec<Constant>,
    /// Texts by key, beside the graph.
    pub metadata: Vec<(String, String)>,
}

impl Graph {
    /// Adds a constant of floats and returns its name.
    pub fn floats(&mut self, name: &str, dims: &[usize], values: Vec<f32>) -> String {
        self.constant(name, dims, Values::Float(values))
    }

    /// Adds a constant list of integers and returns its name.
    pub fn ints(&mut self, name: &str, values: Vec<i64>) -> String {
        self.constant(name, &[values.len()], Values::Int(values))
    }

    fn constant(&mut self, name: &str, dims: &[usize], values: Values) -> String {
        self.constants.push(Constant { name: name.into(), dims: dims.to_vec(), values });
        name.into()
    }

    /// Adds a node with one output and returns the output's name.
    pub fn node(
        &mut self,
        operator: &str,
        inputs: &[&str],
        output: &str,
        attributes: &[(&str, Attribute)],
    ) -> String {
        self.nodes.push(GraphNode {
            operator: operator.into(),
            inputs: inputs.iter().map(|name| (*name).into()).collect(),
            outputs: vec![output.into()],
            attributes: attributes.iter().map(|(name, value)| ((*name).into(), value.clone())).collect(),
        });
        output.into()
    }
}
