//! A graph as an ONNX file (IR version 8, operator set 17). Field numbers are those of `onnx.proto3`.

use crate::graph::{Attribute, Constant, Graph, GraphNode, Port, Values};
use crate::protobuf::Message;

/// The version of the operators that are written and read.
pub(crate) const OPERATOR_SET: i64 = 17;
const IR_VERSION: i64 = 8;
/// ONNX's numbers of the element types.
pub(crate) const FLOAT: i64 = 1;
pub(crate) const INT64: i64 = 7;

fn node(message: &mut Message, node: &GraphNode) {
    node.inputs.iter().for_each(|name| message.text(1, name));
    node.outputs.iter().for_each(|name| message.text(2, name));
    message.text(3, node.outputs.first().map_or("", String::as_str));
    message.text(4, &node.operator);
    for (name, value) in &node.attributes {
        message.message(5, |inner| {
            inner.text(1, name);
            let kind = match value {
                Attribute::Float(value) => {
                    inner.float(2, *value);
                    1
                }
                Attribute::Int(value) => {
                    inner.int(3, *value);
                    2
                }
                Attribute::Text(value) => {
                    inner.text(4, value);
                    3
                }
                Attribute::Ints(values) => {
                    values.iter().for_each(|value| inner.int(8, *value));
                    7
                }
            };
            inner.int(20, kind);
        });
    }
}

fn constant(message: &mut Message, constant: &Constant) {
    constant.dims.iter().for_each(|side| message.int(1, *side as i64));
    let (kind, raw): (i64, Vec<u8>) = match &constant.values {
        Values::Float(values) => (FLOAT, values.iter().flat_map(|v| v.to_le_bytes()).collect()),
        Values::Int(values) => (INT64, values.iter().flat_map(|v| v.to_le_bytes()).collect()),
    };
    message.int(2, kind);
    message.text(8, &constant.name);
    message.bytes(9, &raw);
}

fn port(message: &mut Message, port: &Port) {
    message.text(1, &port.name);
    message.message(2, |kind| {
        kind.message(1, |tensor| {
            tensor.int(1, FLOAT);
            tensor.message(2, |shape| {
                port.dims.iter().for_each(|side| shape.message(1, |dim| dim.int(1, *side as i64)));
            });
        });
    });
}

/// The bytes of the file. The same graph gives the same bytes.
pub fn write_onnx(graph: &Graph) -> Vec<u8> {
    let mut model = Message::default();
    model.int(1, IR_VERSION);
    model.text(2, "domecast");
    model.message(7, |message| {
        graph.nodes.iter().for_each(|n| message.message(1, |inner| node(inner, n)));
        message.text(2, "hardness");
        graph.constants.iter().for_each(|c| message.message(5, |inner| constant(inner, c)));
        graph.inputs.iter().for_each(|p| message.message(11, |inner| port(inner, p)));
        graph.outputs.iter().for_each(|p| message.message(12, |inner| port(inner, p)));
    });
    model.message(8, |set| {
        set.text(1, "");
        set.int(2, OPERATOR_SET);
    });
    for (key, value) in &graph.metadata {
        model.message(14, |entry| {
            entry.text(1, key);
            entry.text(2, value);
        });
    }
    model.0
}
