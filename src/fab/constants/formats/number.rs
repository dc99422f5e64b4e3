//! Numbers as other programs read them.

/// A number as all these forms read it: the shortest that reads back the same, always with a point, and with a
/// sign in the exponent, without which YAML 1.1 takes it for a word.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-5..1e15).contains(&size) {
        let text = format!("{value}");
        return if text.contains('.') { text } else { text + ".0" };
    }
    let text = format!("{value:e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if digits.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{digits}{point}e{sign}{exponent}")
}

/// A list in YAML's flow style.
pub(super) fn list(values: impl IntoIterator<Item = f64>) -> String {
    let parts: Vec<String> = values.into_iter().map(number).collect();
    format!("[{}]", parts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_the_same() {
        for value in [0.0, -0.0, 1.0, 229.18, 1e-17, -3.25e300, 0.1, 1e22] {
            assert_eq!(number(value).parse::<f64>().unwrap(), value);
            assert!(number(value).contains('.') && !number(value).contains("e2"), "{}", number(value));
        }
    }
}
