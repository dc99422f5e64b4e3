//! What a file says, found but not judged yet, and numbers in the shapes that files have.

use serde_json::Value;

use super::CalibrationForm;
use crate::spec::DesignError;
use domecast_optics::camera::LensModel;

/// A value and the name of its field in the file.
#[derive(Debug, Clone)]
pub(super) struct Named<T> {
    pub field: String,
    pub value: T,
}

/// A calibration's parts.
#[derive(Debug, Clone)]
pub(super) struct Parts {
    pub form: CalibrationForm,
    pub camera: String,
    pub width: Option<Named<u64>>,
    pub height: Option<Named<u64>>,
    pub matrix: Named<[f64; 9]>,
    pub model: LensModel,
    pub distortion: Named<Vec<f64>>,
}

/// The numbers of a list, a list of rows, or a matrix node with `rows`, `cols` and `data`.
pub(super) fn numbers(field: &str, value: &Value) -> Result<Vec<f64>, DesignError> {
    let (data, size) = match value {
        Value::Object(node) => {
            let side = |name: &str| node.get(name).and_then(Value::as_u64);
            let Some(data) = node.get("data") else {
                return Err(DesignError::at(
                    field,
                    value,
                    "a matrix without `data`",
                    "`rows`, `cols` and `data`",
                ));
            };
            (data, side("rows").zip(side("cols")))
        }
        _ => (value, None),
    };
    let items: Vec<&Value> = match data {
        Value::Array(rows) if rows.iter().all(Value::is_array) => {
            rows.iter().filter_map(Value::as_array).flatten().collect()
        }
        Value::Array(items) => items.iter().collect(),
        Value::Null => Vec::new(),
        _ => return Err(DesignError::at(field, value, "no list of numbers", "a list of finite numbers")),
    };
    let mut found = Vec::with_capacity(items.len());
    for (i, item) in items.into_iter().enumerate() {
        match item.as_f64().filter(|number| number.is_finite()) {
            Some(number) => found.push(number),
            None => {
                let place = format!("{field}[{i}]");
                return Err(DesignError::at(place, item, "not a number that can be used", "a finite number"));
            }
        }
    }
    match size {
        Some((rows, cols)) if rows.checked_mul(cols) != Some(found.len() as u64) => Err(DesignError::at(
            field,
            format!("{rows} x {cols}"),
            format!("its data has {} numbers", found.len()),
            "as many numbers as rows times columns",
        )),
        _ => Ok(found),
    }
}

/// A count of pixels.
pub(super) fn pixels(field: &str, value: &Value) -> Result<Named<u64>, DesignError> {
    let whole = value.as_f64().filter(|number| number.fract() == 0.0 && (1.0..=1e6).contains(number));
    match whole {
        Some(number) => Ok(Named { field: field.to_owned(), value: number as u64 }),
        None => Err(DesignError::at(field, value, "not a size in pixels", "a whole number, 1 to 1000000")),
    }
}

/// Three rows of three.
pub(super) fn nine(field: &str, value: &Value) -> Result<Named<[f64; 9]>, DesignError> {
    let found = numbers(field, value)?;
    match <[f64; 9]>::try_from(found.as_slice()) {
        Ok(matrix) => Ok(Named { field: field.to_owned(), value: matrix }),
        Err(_) => Err(DesignError::at(
            field,
            format!("{} numbers", found.len()),
            "not a camera matrix",
            "3 rows of 3: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]",
        )),
    }
}

/// A word of the file, without regard to capitals.
pub(super) fn word(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), |text| text.trim().to_ascii_lowercase())
}

/// A fault in the number of coefficients.
pub(super) fn wrong_count(field: &str, found: usize, name: &str, allowed: &str) -> DesignError {
    DesignError::at(
        field,
        format!("a list of {found}"),
        format!("{name} does not have that many coefficients"),
        allowed,
    )
}
