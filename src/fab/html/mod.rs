//! HTML in which text is escaped by default.
//!
//! [`html!`](crate::html!) formats like [`format!`] and escapes every value that is not [`Html`] already, so that no name
//! out of a design can become markup.
//!
//! ```
//! use domecast_fab::html;
//!
//! let cell = html!("<td>{}</td>", "R < 10");
//! assert_eq!(html!("<tr>{}</tr>", cell).as_str(), "<tr><td>R &lt; 10</td></tr>");
//! ```

use std::fmt::{self, Write as _};

use flate2::Compression;
use flate2::write::GzEncoder;

/// The style of every page: light, dark, print, phone.
const STYLE: &str = include_str!("style.css");

/// The script that every 3D view of a page stands on: `domecastOrbit(canvas, gl, draw)` turns and zooms a WebGL 2 canvas by
/// mouse, fingers and keys.
pub const ORBIT: &str = include_str!("orbit.js");

/// A piece of HTML.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Html(String);

impl Html {
    /// Markup that is known to be whole: a style sheet, a script, an SVG drawing.
    pub fn trusted(markup: impl Into<String>) -> Self {
        Self(markup.into())
    }

    /// The markup.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The markup as bytes of a file.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
    }
}

impl From<&str> for Html {
    /// Escapes the text.
    fn from(text: &str) -> Self {
        html!("{}", text)
    }
}

impl From<String> for Html {
    /// Escapes the text.
    fn from(text: String) -> Self {
        text.as_str().into()
    }
}

impl std::ops::AddAssign for Html {
    fn add_assign(&mut self, more: Self) {
        self.0 += &more.0;
    }
}

impl std::ops::Add for Html {
    type Output = Self;

    fn add(mut self, more: Self) -> Self {
        self += more;
        self
    }
}

impl FromIterator<Html> for Html {
    fn from_iter<I: IntoIterator<Item = Html>>(pieces: I) -> Self {
        pieces.into_iter().fold(Self::default(), std::ops::Add::add)
    }
}

/// What can stand in HTML: markup as it is, everything else escaped.
pub trait ToHtml {
    /// Writes the value as HTML.
    ///
    /// # Errors
    /// Those of `out`.
    fn write_html(&self, out: &mut dyn fmt::Write) -> fmt::Result;
}

impl ToHtml for Html {
    fn write_html(&self, out: &mut dyn fmt::Write) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl ToHtml for str {
    fn write_html(&self, out: &mut dyn fmt::Write) -> fmt::Result {
        for c in self.chars() {
            match c {
                '&' => out.write_str("&amp;")?,
                '<' => out.write_str("&lt;")?,
                '>' => out.write_str("&gt;")?,
                '"' => out.write_str("&quot;")?,
                '\'' => out.write_str("&#39;")?,
                c => out.write_char(c)?,
            }
        }
        Ok(())
    }
}

impl ToHtml for String {
    fn write_html(&self, out: &mut dyn fmt::Write) -> fmt::Result {
        self.as_str().write_html(out)
    }
}

impl<T: ToHtml + ?Sized> ToHtml for &T {
    fn write_html(&self, out: &mut dyn fmt::Write) -> fmt::Result {
        (**self).write_html(out)
    }
}

macro_rules! numbers_to_html {
    ($($number:ty)*) => {$(
        impl ToHtml for $number {
            fn write_html(&self, out: &mut dyn fmt::Write) -> fmt::Result {
                write!(out, "{self}")
            }
        }
    )*};
}
numbers_to_html!(f64 i64 u32 usize);

/// Shows a value as HTML; what [`html!`](crate::html!) puts around each of its values.
#[derive(Debug, Clone, Copy)]
pub struct AsHtml<'a, T: ?Sized>(pub &'a T);

impl<T: ToHtml + ?Sized> fmt::Display for AsHtml<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.write_html(f)
    }
}

/// Formats [`Html`](crate::html::Html): the template is markup, each value is escaped unless it is `Html` itself.
#[macro_export]
macro_rules! html {
    ($template:literal $(, $value:expr)* $(,)?) => {
        $crate::html::Html::trusted(format!($template $(, $crate::html::AsHtml(&$value))*))
    };
}
pub use crate::html;

/// A whole page in the style of all pages, with more `style` of its own; it opens from a disk without a network.
pub fn document(title: &str, style: &str, body: &Html) -> Html {
    html!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<link rel=\"icon\" \
         href=\"data:,\">\n<style>\n{}{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
        title,
        Html::trusted(STYLE),
        Html::trusted(style),
        body,
    )
}

/// Bytes for a page's script, gzipped (RFC 1952) as a browser's `DecompressionStream` opens it; without a time, so that the same bytes
/// give the same. `id` is the element's.
pub fn packed(id: &str, bytes: &[u8]) -> Html {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    // writing to a Vec cannot fail
    let _ = std::io::Write::write_all(&mut encoder, bytes);
    let gzipped = encoder.finish().unwrap_or_default();
    html!("<script type=\"application/gzip\" id=\"{}\">{}</script>\n", id, base64(&gzipped))
}

/// A table; the first column names the row. An empty caption is left out.
pub fn table(caption: &str, heads: &[&str], rows: &[Vec<Html>]) -> Html {
    let head = |head: &&str| match *head {
        "" => Html::trusted("<td></td>"),
        head => html!("<th scope=\"col\">{}</th>", head),
    };
    let heads_text = heads.join(", ");
    let heads: Html = heads.iter().map(head).collect();
    let cells = |row: &Vec<Html>| -> Html {
        let cell = |(index, cell): (usize, &Html)| match index {
            0 => html!("<th scope=\"row\">{}</th>", cell),
            _ => html!("<td>{}</td>", cell),
        };
        html!("<tr>{}</tr>\n", row.iter().enumerate().map(cell).collect::<Html>())
    };
    // what scrolls sideways on a phone must be reached by keys too, and then have a name
    let name = if caption.is_empty() { heads_text } else { caption.to_owned() };
    let caption = if caption.is_empty() { Html::default() } else { html!("<caption>{}</caption>", caption) };
    html!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"group\" aria-label=\"{}\"><table>{}<thead><tr>{}</tr></thead><tbody>\n{}</tbody></table></div>\n",
        name,
        caption,
        heads,
        rows.iter().map(cells).collect::<Html>(),
    )
}

/// A figure with its caption below.
pub fn figure(content: &Html, caption: &str) -> Html {
    html!("<figure>{}<figcaption>{}</figcaption></figure>\n", content, caption)
}

/// A picture that stands in the page itself; `class` is of the style sheet, empty for none.
pub fn picture(mime: &str, bytes: &[u8], alt: &str, class: &str) -> Html {
    let class = if class.is_empty() { Html::default() } else { html!(" class=\"{}\"", class) };
    html!("<img{} src=\"data:{};base64,{}\" alt=\"{}\">", class, mime, base64(bytes), alt)
}

/// Base64 (RFC 4648, section 4), padded.
pub fn base64(bytes: &[u8]) -> String {
    use base64::Engine as _;
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// The style of a bar as long as `share` of its place, for the style sheet's `.bar`.
fn bar_style(share: f64) -> String {
    let mut style = String::new();
    // writing to a String cannot fail
    let _ = write!(style, "--w:{:.1}%", 100.0 * share.clamp(0.0, 1.0));
    style
}

/// A bar of a length between 0 and 1, with its value in words for those who do not see it.
pub fn bar(share: f64, label: &str) -> Html {
    let class = if share > 1.0 { "bar over" } else { "bar" };
    html!("<span class=\"{}\" style=\"{}\">{}</span>", class, bar_style(share), label)
}

/// Bars beside their names, the largest value as long as the place allows: name, value, label.
pub fn bars(rows: &[(String, f64, String)]) -> Html {
    let max = rows.iter().map(|row| row.1).filter(|v| v.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    let line = |(name, value, label): &(String, f64, String)| {
        html!("<li><span>{}</span>{}</li>", name, bar((value / max).min(1.0), label))
    };
    html!("<ul class=\"bars\">{}</ul>\n", rows.iter().map(line).collect::<Html>())
}

/// The colours of a scale from low to high, between the names of its ends.
pub fn color_bar(colors: &[[u8; 3]], low: &str, high: &str) -> Html {
    let stop = |(k, [r, g, b]): (usize, &[u8; 3])| {
        let fill = format!("rgb({r},{g},{b})");
        let width = 200.0 / colors.len() as f64;
        // a little wider: no seams between them
        let (x, wider) = (width * k as f64, width + 0.5);
        html!("<rect x=\"{}\" y=\"0\" width=\"{}\" height=\"14\" fill=\"{}\"/>", x, wider, fill)
    };
    html!(
        "<p>{0} <svg role=\"img\" aria-label=\"Colours from {0} to {1}\" width=\"200\" height=\"14\" \
         viewBox=\"0 0 200 14\">{2}</svg> {1}</p>\n",
        low,
        high,
        colors.iter().enumerate().map(stop).collect::<Html>()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(Html::from("<b a=\"x\">&'").as_str(), "&lt;b a=&quot;x&quot;&gt;&amp;&#39;");
        let row = vec![Html::from("<script>"), html!("<b>{}</b>", "a & b")];
        let table = table("<i>", &["x"], &[row]);
        assert!(table.as_str().contains("&lt;script&gt;") && table.as_str().contains("<b>a &amp; b</b>"));
        assert!(table.as_str().contains("<caption>&lt;i&gt;</caption>"));
    }
}
