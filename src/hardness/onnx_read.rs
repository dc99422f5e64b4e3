//! ONNX files to graphs. What is not written by [`crate::write_onnx`] may be in a file, as long as nothing of it would
//! change the result: names and descriptions are skipped, anything else that is not known is refused by name.

use crate::error::ModelError;
use crate::graph::{Attribute, Constant, Graph, GraphNode, Port, Values};
use crate::onnx_write::{FLOAT, INT64, OPERATOR_SET};
use crate::protobuf::{Fields, Wire};

/// Numbers of a model at most: the paper's own network has 11 million.
const MAX_WEIGHTS: usize = 64 << 20;

fn sides(dims: &[i64], at: &str) -> Result<Vec<usize>, ModelError> {
    let side = |dim: &i64| usize::try_from(*dim).ok().filter(|side| *side <= MAX_WEIGHTS);
    let sides: Option<Vec<usize>> = dims.iter().map(side).collect();
    let sides = sides.filter(|sides| sides.len() <= 4);
    let product = sides.as_ref().and_then(|s| s.iter().try_fold(1_usize, |all, side| all.checked_mul(*side)));
    match (sides, product) {
        (Some(sides), Some(product)) if product <= MAX_WEIGHTS => Ok(sides),
        _ => Err(ModelError::new(
            at,
            format!("has the sides {:?}", &dims[..dims.len().min(8)]),
            format!("at most 4 sides and {MAX_WEIGHTS} numbers"),
        )),
    }
}

fn constant(bytes: &[u8]) -> Result<Constant, ModelError> {
    let (mut dims, mut kind, mut name, mut raw) = (Vec::new(), 0, String::new(), &[][..]);
    let (mut floats, mut ints) = (Vec::new(), Vec::new());
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            1 => wire.ints_into("the sides of a tensor", &mut dims)?,
            2 => kind = wire.int("the type of a tensor")?,
            4 => match wire {
                Wire::Fixed32(bits) => floats.push(f32::from_bits(bits)),
                wire => floats.extend(floats_of(wire.bytes("float_data")?)?),
            },
            7 => wire.ints_into("int64_data", &mut ints)?,
            8 => name = wire.text("a tensor's name")?,
            9 => raw = wire.bytes("raw_data")?,
            12 => {}
            other => {
                let problem = format!("has field {other} (external or typed data)");
                return Err(ModelError::new(format!("tensor \"{name}\""), problem, "raw_data in the file"));
            }
        }
    }
    let at = format!("tensor \"{name}\"");
    let dims = sides(&dims, &at)?;
    let values = match kind {
        FLOAT if floats.is_empty() => Values::Float(floats_of(raw)?),
        FLOAT => Values::Float(floats),
        INT64 if ints.is_empty() => {
            let (chunks, rest) = raw.as_chunks::<8>();
            if !rest.is_empty() {
                return Err(ModelError::new(at, "has a part of a number at its end", "whole numbers"));
            }
            Values::Int(chunks.iter().map(|bytes| i64::from_le_bytes(*bytes)).collect())
        }
        INT64 => Values::Int(ints),
        other => {
            let allowed = format!("{FLOAT} (float) or {INT64} (int64)");
            return Err(ModelError::new(at, format!("is of type {other}"), allowed));
        }
    };
    let count = match &values {
        Values::Float(values) => values.len(),
        Values::Int(values) => values.len(),
    };
    let wanted: usize = dims.iter().product();
    if count != wanted {
        let problem = format!("has {count} numbers for the sides {dims:?}");
        return Err(ModelError::new(at, problem, format!("{wanted} numbers")));
    }
    if let Values::Float(values) = &values
        && values.iter().any(|value| !value.is_finite())
    {
        return Err(ModelError::new(at, "has a number that is not finite", "finite numbers"));
    }
    Ok(Constant { name, dims, values })
}

fn floats_of(bytes: &[u8]) -> Result<Vec<f32>, ModelError> {
    let (chunks, rest) = bytes.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(ModelError::broken("has a tensor with a part of a number at its end"));
    }
    Ok(chunks.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect())
}

fn attribute(bytes: &[u8]) -> Result<(String, Attribute), ModelError> {
    let (mut name, mut kind, mut float, mut int) = (String::new(), 0, 0.0, 0);
    let (mut text, mut ints) = (String::new(), Vec::new());
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            1 => name = wire.text("an attribute's name")?,
            2 => {
                let Wire::Fixed32(bits) = wire else {
                    return Err(ModelError::broken("has an attribute of the wrong wire type"));
                };
                float = f32::from_bits(bits);
            }
            3 => int = wire.int("an attribute")?,
            4 => text = wire.text("an attribute")?,
            8 => wire.ints_into("an attribute", &mut ints)?,
            13 => {}
            20 => kind = wire.int("an attribute's type")?,
            other => {
                let allowed = "numbers, lists of integers, texts";
                return Err(ModelError::new(
                    format!("attribute \"{name}\""),
                    format!("has field {other}"),
                    allowed,
                ));
            }
        }
    }
    let value = match kind {
        1 => Attribute::Float(float),
        2 => Attribute::Int(int),
        3 => Attribute::Text(text),
        7 => Attribute::Ints(ints),
        other => {
            let at = format!("attribute \"{name}\"");
            return Err(ModelError::new(at, format!("is of type {other}"), "float, int, string or ints"));
        }
    };
    Ok((name, value))
}

fn node(bytes: &[u8]) -> Result<GraphNode, ModelError> {
    let mut node = GraphNode {
        operator: String::new(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        attributes: Vec::new(),
    };
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            1 => node.inputs.push(wire.text("a node's input")?),
            2 => node.outputs.push(wire.text("a node's output")?),
            4 => node.operator = wire.text("a node's operator")?,
            5 => node.attributes.push(attribute(wire.bytes("an attribute")?)?),
            3 | 6 => {}
            7 => {
                let domain = wire.text("a node's domain")?;
                if !(domain.is_empty() || domain == "ai.onnx") {
                    let at = format!("node \"{}\"", node.operator);
                    return Err(ModelError::new(at, format!("is of the domain \"{domain}\""), "ai.onnx"));
                }
            }
            other => {
                let at = format!("node \"{}\"", node.operator);
                return Err(ModelError::new(at, format!("has field {other}"), "inputs, outputs, attributes"));
            }
        }
    }
    Ok(node)
}

/// The bytes of a message's field, where each message has one field that counts.
fn within(bytes: &[u8], wanted: u64, at: &str) -> Result<Vec<u8>, ModelError> {
    let mut found = Vec::new();
    for field in Fields(bytes) {
        let (number, wire) = field?;
        if number == wanted {
            found = wire.bytes(at)?.to_vec();
        }
    }
    Ok(found)
}

fn port(bytes: &[u8]) -> Result<Port, ModelError> {
    let (mut name, mut kind) = (String::new(), &[][..]);
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            1 => name = wire.text("an input's name")?,
            2 => kind = wire.bytes("an input's type")?,
            _ => {}
        }
    }
    let tensor = within(kind, 1, "an input's type")?;
    let (mut element, mut dims) = (0, Vec::new());
    for field in Fields(&tensor) {
        let (number, wire) = field?;
        match number {
            1 => element = wire.int("an element type")?,
            2 => {
                for dim in Fields(wire.bytes("a shape")?) {
                    let mut side = -1;
                    for part in Fields(dim?.1.bytes("a side")?) {
                        let (number, wire) = part?;
                        side = if number == 1 { wire.int("a side")? } else { -1 };
                    }
                    dims.push(side);
                }
            }
            _ => {}
        }
    }
    let at = format!("input or output \"{name}\"");
    if element != FLOAT {
        return Err(ModelError::new(at, format!("is of type {element}"), format!("{FLOAT} (float)")));
    }
    Ok(Port { dims: sides(&dims, &at)?, name })
}

fn graph(bytes: &[u8], graph: &mut Graph) -> Result<(), ModelError> {
    let mut weights = 0;
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            1 => graph.nodes.push(node(wire.bytes("a node")?)?),
            5 => {
                let constant = constant(wire.bytes("a tensor")?)?;
                weights += constant.dims.iter().product::<usize>();
                graph.constants.push(constant);
            }
            11 => graph.inputs.push(port(wire.bytes("an input")?)?),
            12 => graph.outputs.push(port(wire.bytes("an output")?)?),
            2 | 10 | 13 => {}
            other => return Err(ModelError::broken(format!("has a graph with field {other}"))),
        }
    }
    if weights > MAX_WEIGHTS {
        let problem = format!("has {weights} weights");
        return Err(ModelError::new("the graph", problem, format!("at most {MAX_WEIGHTS}")));
    }
    Ok(())
}

fn operator_set(bytes: &[u8]) -> Result<(), ModelError> {
    let (mut domain, mut version) = (String::new(), 0);
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            1 => domain = wire.text("an operator set")?,
            2 => version = wire.int("an operator set")?,
            _ => {}
        }
    }
    if (domain.is_empty() || domain == "ai.onnx") && version == OPERATOR_SET {
        return Ok(());
    }
    let problem = format!("needs \"{domain}\" in version {version}");
    Err(ModelError::new("the operator set", problem, format!("ai.onnx in version {OPERATOR_SET}")))
}

/// Reads a graph.
///
/// # Errors
/// [`ModelError`]: the bytes are cut, are no ONNX, or hold what this reader does not know.
pub fn read_onnx(bytes: &[u8]) -> Result<Graph, ModelError> {
    let mut result = Graph::default();
    let (mut graphs, mut sets) = (0, 0);
    for field in Fields(bytes) {
        let (number, wire) = field?;
        match number {
            7 => {
                graphs += 1;
                graph(wire.bytes("the graph")?, &mut result)?;
            }
            8 => {
                sets += 1;
                operator_set(wire.bytes("an operator set")?)?;
            }
            14 => {
                let (mut key, mut value) = (String::new(), String::new());
                for field in Fields(wire.bytes("metadata")?) {
                    let (number, wire) = field?;
                    match number {
                        1 => key = wire.text("a key of the metadata")?,
                        2 => value = wire.text("a text of the metadata")?,
                        _ => {}
                    }
                }
                result.metadata.push((key, value));
            }
            1..=6 => {}
            other => return Err(ModelError::broken(format!("has field {other}"))),
        }
    }
    if graphs != 1 || sets != 1 {
        let problem = format!("holds {graphs} graphs and {sets} operator sets, where each is needed once");
        return Err(ModelError::broken(problem));
    }
    Ok(result)
}
