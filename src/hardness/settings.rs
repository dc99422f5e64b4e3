//! What a node is set to, read strictly: an attribute that is not asked for is an error.

use crate::error::ModelError;
use crate::graph::{Attribute, GraphNode};

/// The attributes of one node that are not yet read.
pub(crate) struct Settings<'a> {
    node: &'a GraphNode,
    left: Vec<&'a (String, Attribute)>,
}

impl<'a> Settings<'a> {
    pub(crate) fn new(node: &'a GraphNode) -> Self {
        Self { node, left: node.attributes.iter().collect() }
    }

    pub(crate) fn error(&self, problem: impl Into<String>, allowed: impl Into<String>) -> ModelError {
        let output = self.node.outputs.first().map_or("", String::as_str);
        ModelError::new(format!("node {} \"{output}\"", self.node.operator), problem, allowed)
    }

    fn take(&mut self, name: &str) -> Option<&'a Attribute> {
        let at = self.left.iter().position(|(other, _)| other == name)?;
        Some(&self.left.swap_remove(at).1)
    }

    /// An integer, or what stands for it where it is left out.
    pub(crate) fn int(&mut self, name: &str, default: i64) -> Result<i64, ModelError> {
        match self.take(name) {
            None => Ok(default),
            Some(Attribute::Int(value)) => Ok(*value),
            Some(_) => Err(self.error(format!("{name} is no integer"), "an integer")),
        }
    }

    /// An integer that must have one value.
    pub(crate) fn must_be(&mut self, name: &str, default: i64, wanted: i64) -> Result<(), ModelError> {
        let value = self.int(name, default)?;
        let problem = || self.error(format!("{name} is {value}"), format!("{wanted}"));
        if value == wanted { Ok(()) } else { Err(problem()) }
    }

    pub(crate) fn ints(&mut self, name: &str, default: &[i64]) -> Result<Vec<i64>, ModelError> {
        match self.take(name) {
            None => Ok(default.to_vec()),
            Some(Attribute::Ints(values)) => Ok(values.clone()),
            Some(_) => Err(self.error(format!("{name} is no list of integers"), "a list of integers")),
        }
    }

    /// A list of equal integers within bounds, such as the sides of a square kernel.
    pub(crate) fn alike(
        &mut self,
        name: &str,
        count: usize,
        default: i64,
        bounds: std::ops::RangeInclusive<i64>,
    ) -> Result<usize, ModelError> {
        let values = self.ints(name, &vec![default; count])?;
        match values.first() {
            Some(value)
                if values.len() == count && values.iter().all(|v| v == value) && bounds.contains(value) =>
            {
                Ok(*value as usize)
            }
            _ => {
                let allowed = format!("{count} equal numbers from {} to {}", bounds.start(), bounds.end());
                Err(self.error(format!("{name} is {:?}", &values[..values.len().min(8)]), allowed))
            }
        }
    }

    pub(crate) fn text(&mut self, name: &str, default: &str, wanted: &str) -> Result<(), ModelError> {
        let value = match self.take(name) {
            None => default,
            Some(Attribute::Text(value)) => value,
            Some(_) => return Err(self.error(format!("{name} is no text"), wanted)),
        };
        let problem = || self.error(format!("{name} is \"{value}\""), wanted);
        if value == wanted { Ok(()) } else { Err(problem()) }
    }

    pub(crate) fn float(&mut self, name: &str, wanted: f32) -> Result<(), ModelError> {
        match self.take(name) {
            None => Ok(()),
            Some(Attribute::Float(value)) if *value == wanted => Ok(()),
            Some(_) => Err(self.error(format!("{name} is set"), format!("{wanted}"))),
        }
    }

    /// Refuses what was not asked for.
    pub(crate) fn end(self) -> Result<(), ModelError> {
        match self.left.first() {
            None => Ok(()),
            Some((name, _)) => Err(self.error(format!("has the attribute {name}"), "none of that name")),
        }
    }
}
