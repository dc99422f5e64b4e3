//! YAML, XML and JSON to one kind of tree.

use serde_json::{Map, Number, Value};
use yaml_rust2::parser::{Event, Parser};
use yaml_rust2::scanner::TScalarStyle;

use super::ALLOWED_FILE;
use crate::spec::{DesignError, parse_json};

/// No calibration nests deeper; what does would exhaust the stack.
const MAX_DEPTH: usize = 32;

fn fault(problem: impl Into<String>) -> DesignError {
    DesignError::at("", "", problem, ALLOWED_FILE)
}

/// The tree of a text in any of the three languages.
pub(super) fn parse(text: &str) -> Result<Value, DesignError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    match text.trim_start().chars().next() {
        None => Err(fault("the file is empty")),
        Some('<') => xml(text),
        // YAML's braces are no JSON, so what fails as JSON may still be YAML
        Some('{') => parse_json(text).or_else(|error| yaml(text).map_err(|_| error)),
        Some(_) => yaml(text),
    }
}

/// A bare word as a number, if it is one that a double holds.
fn scalar(text: &str) -> Value {
    if let Ok(whole) = text.parse::<i64>() {
        return whole.into();
    }
    let digits = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    let number = text.parse().ok().filter(|_| digits).and_then(Number::from_f64);
    number.map_or_else(|| Value::String(text.to_owned()), Value::Number)
}

/// A list or a mapping that is not closed yet.
enum Open {
    List(Vec<Value>),
    Map(Map<String, Value>, Option<String>),
}

/// The first document of a YAML text; tags are dropped, aliases refused.
fn yaml(text: &str) -> Result<Value, DesignError> {
    // OpenCV's first line, `%YAML:1.0`, is no YAML
    let body: String = text
        .lines()
        .map(|line| if line.starts_with('%') { "\n".into() } else { format!("{line}\n") })
        .collect();
    let mut parser = Parser::new_from_str(&body);
    let mut open: Vec<Open> = Vec::new();
    loop {
        let (event, mark) = parser.next_token().map_err(|error| {
            let mut found = fault(format!("not valid YAML: {}", error.info()));
            found.place = Some((error.marker().line(), error.marker().col() + 1));
            found
        })?;
        let at_line = |mut found: DesignError| {
            found.place = Some((mark.line(), mark.col() + 1));
            found
        };
        let done = match event {
            Event::Scalar(text, style, ..) => match open.last_mut() {
                Some(Open::Map(_, key @ None)) => {
                    *key = Some(text);
                    continue;
                }
                _ if style != TScalarStyle::Plain => Value::String(text),
                _ if text.is_empty() || text == "~" || text == "null" => Value::Null,
                _ => scalar(&text),
            },
            Event::SequenceStart(..) | Event::MappingStart(..) if open.len() >= MAX_DEPTH => {
                return Err(at_line(fault(format!("nested more than {MAX_DEPTH} deep"))));
            }
            Event::SequenceStart(..) | Event::MappingStart(..)
                if matches!(open.last(), Some(Open::Map(_, None))) =>
            {
                return Err(at_line(fault("a key that is no word")));
            }
            Event::SequenceStart(..) => {
                open.push(Open::List(Vec::new()));
                continue;
            }
            Event::MappingStart(..) => {
                open.push(Open::Map(Map::new(), None));
                continue;
            }
            Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                Some(Open::List(items)) => Value::Array(items),
                Some(Open::Map(entries, _)) => Value::Object(entries),
                None => Value::Null,
            },
            Event::Alias(_) => {
                return Err(at_line(fault("an alias (`*name`), which calibrations do not have")));
            }
            Event::StreamEnd | Event::DocumentEnd => return Ok(Value::Null),
            Event::Nothing | Event::StreamStart | Event::DocumentStart => continue,
        };
        match open.last_mut() {
            None => return Ok(done),
            Some(Open::List(items)) => items.push(done),
            Some(Open::Map(entries, key)) => {
                let key = key.take().unwrap_or_default();
                if entries.contains_key(&key) {
                    return Err(at_line(fault(format!("the key \"{key}\" stands there twice"))));
                }
                entries.insert(key, done);
            }
        }
    }
}

/// OpenCV's XML: the elements below `opencv_storage`.
fn xml(text: &str) -> Result<Value, DesignError> {
    let depth = xml_depth(text);
    if depth > MAX_DEPTH {
        return Err(fault(format!("nested more than {MAX_DEPTH} deep")));
    }
    let document =
        roxmltree::Document::parse(text).map_err(|error| fault(format!("not valid XML: {error}")))?;
    let root = document.root_element();
    if root.tag_name().name() != "opencv_storage" {
        let name = root.tag_name().name();
        return Err(fault(format!("XML whose root is <{name}>, not OpenCV's <opencv_storage>")));
    }
    element(root)
}

/// A bound on the depth: opening tags less closing ones, so that a parser that recurses is never asked too much.
fn xml_depth(text: &str) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    for piece in text.split('<').skip(1) {
        match piece.chars().next() {
            Some('/') => depth = depth.saturating_sub(1),
            Some('?' | '!') => {}
            _ if piece.split('>').next().is_some_and(|tag| tag.ends_with('/')) => {}
            _ => depth += 1,
        }
        deepest = deepest.max(depth);
    }
    deepest
}

fn element(node: roxmltree::Node<'_, '_>) -> Result<Value, DesignError> {
    let children: Vec<_> = node.children().filter(roxmltree::Node::is_element).collect();
    if children.is_empty() {
        let text = node.text().unwrap_or_default().trim();
        if let Some(quoted) = text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) {
            return Ok(Value::String(quoted.to_owned()));
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        return Ok(match words.as_slice() {
            [] => Value::Null,
            [word] if node.tag_name().name() != "data" => scalar(word),
            _ => {
                let values: Vec<Value> = words.iter().map(|word| scalar(word)).collect();
                if values.iter().all(Value::is_number) || node.tag_name().name() == "data" {
                    Value::Array(values)
                } else {
                    Value::String(text.to_owned())
                }
            }
        });
    }
    if children.iter().all(|child| child.tag_name().name() == "_") {
        return children.into_iter().map(element).collect::<Result<_, _>>().map(Value::Array);
    }
    let mut entries = Map::new();
    for child in children {
        let key = child.tag_name().name().to_owned();
        let value = element(child)?;
        if entries.insert(key.clone(), value).is_some() {
            return Err(fault(format!("the element <{key}> stands there twice")));
        }
    }
    Ok(Value::Object(entries))
}
