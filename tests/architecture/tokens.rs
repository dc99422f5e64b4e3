//! Words and signs of a Rust source, without comments, texts and tests: enough to see what a file imports.

/// A word, a number, `::` or one sign, and the line (from 1) where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Token {
    pub text: String,
    pub line: usize,
}

impl Token {
    pub fn is(&self, text: &str) -> bool {
        self.text == text
    }

    /// Whether this is a name, a keyword included.
    pub fn is_name(&self) -> bool {
        self.text.starts_with(|c: char| c.is_alphabetic() || c == '_')
    }
}

/// All tokens of a source text.
pub fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let at = |index: usize| chars.get(index).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut found, mut line, mut index) = (Vec::new(), 1, 0);
    while index < chars.len() {
        let start = index;
        let c = chars[index];
        if c.is_whitespace() {
            index += 1;
        } else if c == '/' && at(index + 1) == '/' {
            while index < chars.len() && chars[index] != '\n' {
                index += 1;
            }
        } else if c == '/' && at(index + 1) == '*' {
            index = end_of_comment(&chars, index);
        } else if let Some(end) = end_of_text(&chars, index) {
            index = end;
        } else if c == '\'' {
            index = end_of_char_or_lifetime(&chars, index);
        } else {
            if is_word(c) {
                while is_word(at(index)) {
                    index += 1;
                }
            } else {
                index += if c == ':' && at(index + 1) == ':' { 2 } else { 1 };
            }
            found.push(Token { text: chars[start..index].iter().collect(), line });
        }
        line += chars[start..index.min(chars.len())].iter().filter(|c| **c == '\n').count();
    }
    found
}

/// Comments in `/* */` may stand in each other.
fn end_of_comment(chars: &[char], start: usize) -> usize {
    let (mut depth, mut index) = (0, start);
    while index + 1 < chars.len() {
        match (chars[index], chars[index + 1]) {
            ('/', '*') => (depth, index) = (depth + 1, index + 2),
            ('*', '/') => (depth, index) = (depth - 1, index + 2),
            _ => index += 1,
        }
        if depth == 0 {
            return index;
        }
    }
    chars.len()
}

/// The end of a text that starts here: `".."`, `b".."`, `r#".."#` and their like.
fn end_of_text(chars: &[char], start: usize) -> Option<usize> {
    let mut index = start;
    while index < start + 2 && matches!(chars.get(index), Some('b' | 'r' | 'c')) {
        index += 1;
    }
    let is_raw = chars[start..index].contains(&'r');
    let hashes = if is_raw { chars[index..].iter().take_while(|c| **c == '#').count() } else { 0 };
    index += hashes;
    if chars.get(index) != Some(&'"') {
        return None;
    }
    index += 1;
    while index < chars.len() {
        match chars[index] {
            '\\' if !is_raw => index += 1,
            '"' if chars[index + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes => {
                return Some(index + 1 + hashes);
            }
            _ => {}
        }
        index += 1;
    }
    Some(chars.len())
}

fn end_of_char_or_lifetime(chars: &[char], start: usize) -> usize {
    match (chars.get(start + 1), chars.get(start + 2)) {
        (Some('\\'), _) => {
            // the escaped sign itself may be a quote
            let end = chars[(start + 3).min(chars.len())..].iter().position(|c| *c == '\'');
            end.map_or(chars.len(), |end| start + 3 + end + 1)
        }
        (Some(_), Some('\'')) => start + 3,
        _ => start + 1,
    }
}

/// The index after the bracket that closes the one at `open`.
pub fn after_group(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (index, token) in tokens.iter().enumerate().skip(open) {
        match token.text.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return index + 1;
        }
    }
    tokens.len()
}

/// Splits off what only tests see, and drops attributes: (the rest, the modules `mod x;` that are for tests).
pub fn without_tests(tokens: &[Token]) -> (Vec<Token>, Vec<String>) {
    let (mut kept, mut test_modules, mut index) = (Vec::new(), Vec::new(), 0);
    while index < tokens.len() {
        let inner = tokens[index].is("#") && tokens.get(index + 1).is_some_and(|next| next.is("!"));
        let open = index + 1 + usize::from(inner);
        if !(tokens[index].is("#") && tokens.get(open).is_some_and(|next| next.is("["))) {
            kept.push(tokens[index].clone());
            index += 1;
            continue;
        }
        let end = after_group(tokens, open);
        let words: Vec<&str> = tokens[open..end].iter().map(|token| token.text.as_str()).collect();
        index = end;
        if words == ["[", "cfg", "(", "test", ")", "]"] || words == ["[", "test", "]"] {
            let after = after_item(tokens, index);
            if let Some(at) = (index..after).find(|at| tokens[*at].is("mod")) {
                test_modules.push(tokens[at + 1].text.clone());
            }
            index = after;
        }
    }
    (kept, test_modules)
}

/// The index after the item that starts here: at its `;`, or at the end of its braces.
fn after_item(tokens: &[Token], start: usize) -> usize {
    let mut index = start;
    let is_use = tokens[start..].iter().take(6).any(|token| token.is("use"));
    while index < tokens.len() {
        match tokens[index].text.as_str() {
            ";" => return index + 1,
            "{" if !is_use => return after_group(tokens, index),
            "(" | "[" | "{" => index = after_group(tokens, index),
            _ => index += 1,
        }
    }
    index
}
