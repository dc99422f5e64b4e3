//! Small pieces of HTML: escaped text, tables, figures, numbers as people read them.

use std::fmt::Write as _;

/// Text with the characters escaped that mean something in HTML, inside attributes too.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c => safe.push(c),
        }
    }
    safe
}

/// A number with as many digits as matter to a person: three after the first, never an exponent between
/// 0.0001 and a million.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let size = value.abs();
    if size < 1e-9 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&size) {
        return format!("{value:.2e}").replace('-', "−");
    }
    let before = size.log10().floor() as i32;
    let decimals = usize::try_from(3 - before).unwrap_or(0).min(6);
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.replace('-', "−")
}

/// A share as percent.
pub fn percent(share: f64) -> String {
    let hundred = 100.0 * share;
    let decimals = if hundred.abs() >= 1.0 { 10.0 } else { 1000.0 };
    format!("{} %", number((hundred * decimals).round() / decimals))
}

/// A table; the cells are HTML. The first column names the row.
pub fn table(caption: &str, heads: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("<div class=\"scroll\"><table><caption>{}</caption><thead><tr>", escape(caption));
    for head in heads {
        let _ = write!(text, "<th scope=\"col\">{}</th>", escape(head));
    }
    text += "</tr></thead><tbody>\n";
    for row in rows {
        text += "<tr>";
        for (index, cell) in row.iter().enumerate() {
            if index == 0 {
                let _ = write!(text, "<th scope=\"row\">{cell}</th>");
            } else {
                let _ = write!(text, "<td>{cell}</td>");
            }
        }
        text += "</tr>\n";
    }
    text + "</tbody></table></div>\n"
}

/// A figure with its caption below; the content is HTML.
pub fn figure(content: &str, caption: &str) -> String {
    format!("<figure>{content}<figcaption>{}</figcaption></figure>\n", escape(caption))
}

/// A picture that stands in the page itself.
pub fn picture(mime: &str, bytes: &[u8], alt: &str) -> String {
    format!("<img src=\"data:{mime};base64,{}\" alt=\"{}\">", base64(bytes), escape(alt))
}

/// Base64 (RFC 4648, section 4), padded.
pub fn base64(bytes: &[u8]) -> String {
    use base64::Engine as _;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// A bar of a length between 0 and 1, with its value in words for those who do not see it.
pub fn bar(share: f64, label: &str) -> String {
    let width = 100.0 * share.clamp(0.0, 1.0);
    let class = if share > 1.0 { "bar over" } else { "bar" };
    format!("<span class=\"{class}\" style=\"--w:{width:.1}%\">{}</span>", escape(label))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_people_write_them() {
        let cases = [
            (0.0, "0"),
            (17.0, "17"),
            (1.234567, "1.235"),
            (-0.012346, "−0.01235"),
            (1234.5678, "1235"),
            (100.0, "100"),
            (f64::NAN, "–"),
            (2.5e-7, "2.50e−7"),
        ];
        for (value, wanted) in cases {
            assert_eq!(number(value), wanted, "{value}");
        }
    }

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escape("<b a=\"x\">&'"), "&lt;b a=&quot;x&quot;&gt;&amp;&#39;");
    }
}
