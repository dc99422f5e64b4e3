//! From bytes to a JSON tree, strictly: duplicate keys, which JSON parsers commonly let pass,
//! are faults here, because the second value would silently win.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

use super::error::DesignError;

/// No design is near this size; a larger file is a wrong file.
const MAX_FILE_BYTES: u64 = 16 * 1024 * 1024;

/// Reads a text file that a person wrote.
///
/// # Errors
/// A missing or unreadable file, a folder, a file beyond 16 MiB, bytes that are not UTF-8.
pub fn read_text(path: &Path) -> Result<String, DesignError> {
    let fault = |problem: String, allowed: &str| DesignError::at("", "", problem, allowed).in_file(path);
    let about = std::fs::metadata(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => fault("there is no such file".into(), "the path of a file"),
        _ => fault(format!("cannot be read ({error})"), "a readable file"),
    })?;
    if about.is_dir() {
        return Err(
            fault("this is a folder".into(), "the path of a file").with_help("name the file inside it")
        );
    }
    if about.len() > MAX_FILE_BYTES {
        return Err(fault(format!("the file has {} bytes", about.len()), "at most 16 MiB"));
    }
    let file =
        File::open(path).map_err(|error| fault(format!("cannot be read ({error})"), "a readable file"))?;
    read_text_from(file).map_err(|error| error.in_file(path))
}

/// Reads text that a person or a program wrote from a file, a device or a pipe.
///
/// # Errors
/// What cannot be read, more than 16 MiB, bytes that are not UTF-8.
pub fn read_text_from(stream: impl Read) -> Result<String, DesignError> {
    let fault = |problem: String, allowed: &str| DesignError::at("", "", problem, allowed);
    let bytes = read_up_to(stream, MAX_FILE_BYTES)
        .map_err(|error| fault(format!("cannot be read ({error})"), "UTF-8 text of at most 16 MiB"))?;
    String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        fault(format!("byte {offset} is not UTF-8"), "UTF-8 text")
    })
}

/// Reads a stream whose length nobody knows before: a device may have no end.
///
/// # Errors
/// What the system says, and `FileTooLarge` for more than `max_bytes`.
pub fn read_up_to(stream: impl Read, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(max_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes {
        let problem = format!("it holds more than {max_bytes} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, problem));
    }
    Ok(bytes)
}

/// Parses JSON text into a tree, with the line and column of the first fault.
///
/// # Errors
/// Broken JSON, numbers that no f64 holds, and duplicate keys.
pub fn parse(text: &str) -> Result<Value, DesignError> {
    // Editors on some systems put a byte order mark first; it carries no meaning in UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let parsed = Strict.deserialize(&mut deserializer).and_then(|value| deserializer.end().map(|()| value));
    parsed.map_err(|error| {
        let (line, column) = (error.line().max(1), error.column().max(1));
        let full = error.to_string();
        let problem = full.split(" at line ").next().unwrap_or(&full).to_owned();
        let mut fault = DesignError::at("", "", format!("not valid JSON: {problem}"), "");
        fault.place = Some((line, column));
        fault.help = hint(text, line, column);
        fault
    })
}

/// The likeliest human reason for a syntax fault at this place.
fn hint(text: &str, line: usize, column: usize) -> Option<String> {
    let row = text.lines().nth(line - 1)?;
    let near: String = row.chars().skip(column.saturating_sub(12)).take(24).collect();
    if near.contains("NaN") || near.contains("nan") || near.contains("Infinity") || near.contains("inf") {
        return Some("JSON has no NaN and no infinity: write a finite number".into());
    }
    if near.contains("//") || near.contains("/*") {
        return Some("JSON has no comments: put the reason in the section's \"why\"".into());
    }
    let before: String = row.chars().take(column).collect();
    if let Some(comma) = before.rfind(',') {
        let digit_before = before[..comma].trim_end().ends_with(|c: char| c.is_ascii_digit());
        let digit_after = row[comma + 1..].trim_start().starts_with(|c: char| c.is_ascii_digit());
        if digit_before && digit_after {
            return Some("a decimal comma? JSON wants a point, as in 10.5".into());
        }
    }
    if before.trim_end().ends_with(['}', ']']) || before.trim().is_empty() {
        return Some("look for a comma too many, or one missing, just before this place".into());
    }
    None
}

/// Builds a [`Value`] and refuses duplicate keys.
struct Strict;

impl<'de> DeserializeSeed<'de> for Strict {
    type Value = Value;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Strict {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }
    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(Value::Bool(value))
    }
    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Number::from_f64(value).map(Value::Number).ok_or_else(|| E::custom("the number is not finite"))
    }
    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element_seed(Strict)? {
            list.push(item);
        }
        Ok(Value::Array(list))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            if map.contains_key(&key) {
                return Err(A::Error::custom(format!("the key \"{key}\" stands here twice")));
            }
            let value = entries.next_value_seed(Strict)?;
            map.insert(key, value);
        }
        Ok(Value::Object(map))
    }
}
