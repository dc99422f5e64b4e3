//! The JSON line of a frame.

use domecast_runtime::track::Field;

use crate::error::Fault;

/// Room for a frame's line.
pub(crate) const LINE_BYTES: usize = 1 << 17;

/// The fields of these names.
pub(crate) fn fields_of(names: Option<Vec<String>>) -> Result<Vec<Field>, Fault> {
    let one = |name: String| {
        let allowed = || Field::ALL.map(Field::as_str).join(", ");
        Field::from_name(&name)
            .ok_or_else(|| Fault::argument("fields", format!("{name:?}"), "is no field", &allowed()))
    };
    names.unwrap_or_default().into_iter().map(one).collect()
}

/// A line without its end, with further members.
pub(crate) fn text_of(line: Vec<u8>, members: Option<String>) -> Result<String, Fault> {
    let text = String::from_utf8(line).map_err(|error| Fault::Ours(error.to_string()))?;
    let text = text.trim_end();
    Ok(match members {
        Some(members) => format!("{},{members}}}", text.strip_suffix('}').unwrap_or(text)),
        None => text.to_owned(),
    })
}
