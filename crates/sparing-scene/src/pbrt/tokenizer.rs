//! Splits pbrt text into words, strings and brackets.
//!
//! Blanks separate, `#` starts a comment up to the end of the line, strings stand in double quotes and do not
//! span lines, brackets stand alone. A word is anything else: directive names, numbers, `true` and `false`.

use crate::error::{ErrorKind, SceneError};
use crate::source::{SourceFile, Span};
use std::sync::Arc;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TokenKind {
    Word,
    /// A quoted string; its span includes the quotes.
    Str,
    Open,
    Close,
}

/// A piece of the text, by byte offsets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Token {
    pub kind: TokenKind,
    pub start: usize,
    pub end: usize,
}

impl Token {
    /// The bytes of the token.
    pub fn bytes(self, source: &SourceFile) -> &[u8] {
        &source.bytes[self.start..self.end]
    }

    /// The place of the token.
    pub fn span(self, source: &Arc<SourceFile>) -> Span {
        Span { source: source.clone(), start: self.start, len: self.end - self.start }
    }
}

/// The token at or after byte `at`, or `None` at the end.
pub(super) fn token_at(source: &Arc<SourceFile>, mut at: usize) -> Result<Option<Token>, SceneError> {
    let bytes = &source.bytes;
    loop {
        match bytes.get(at) {
            None => return Ok(None),
            Some(b' ' | b'\t' | b'\r' | b'\n') => at += 1,
            Some(b'#') => {
                at = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |i| at + i);
            }
            // A byte order mark at the very start.
            Some(0xEF) if at == 0 && bytes.starts_with(&[0xEF, 0xBB, 0xBF]) => at = 3,
            Some(_) => break,
        }
    }
    let token = |kind, end| Token { kind, start: at, end };
    match bytes[at] {
        b'[' => Ok(Some(token(TokenKind::Open, at + 1))),
        b']' => Ok(Some(token(TokenKind::Close, at + 1))),
        b'"' => string_end(source, at).map(|end| Some(token(TokenKind::Str, end))),
        _ => {
            let is_end = |b: &u8| matches!(b, b' ' | b'\t' | b'\r' | b'\n' | b'"' | b'[' | b']' | b'#');
            let end = bytes[at..].iter().position(is_end).map_or(bytes.len(), |i| at + i);
            if let Some(bad) = bytes[at..end].iter().position(|b| !b.is_ascii_graphic()) {
                let span = Span { source: source.clone(), start: at + bad, len: 1 };
                let message = format!("byte 0x{:02x} is not text", bytes[at + bad]);
                return Err(SceneError::new(ErrorKind::Syntax, message)
                    .at(&span)
                    .help("pbrt scenes are plain text, neither compressed nor binary"));
            }
            Ok(Some(token(TokenKind::Word, end)))
        }
    }
}

/// The byte after the closing quote of the string that starts at `at`.
fn string_end(source: &Arc<SourceFile>, at: usize) -> Result<usize, SceneError> {
    let mut escaped = false;
    for (i, &b) in source.bytes.iter().enumerate().skip(at + 1) {
        match b {
            b'\n' => break,
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return Ok(i + 1),
            _ => {}
        }
    }
    let span = Span { source: source.clone(), start: at, len: 1 };
    Err(SceneError::new(ErrorKind::Syntax, "this string has no closing quote on its line").at(&span))
}

/// The text of a string token without quotes and escapes.
pub(super) fn unquote(bytes: &[u8]) -> String {
    let inner = bytes.get(1..bytes.len().saturating_sub(1)).unwrap_or_default();
    let text = String::from_utf8_lossy(inner);
    if !text.contains('\\') {
        return text.into_owned();
    }
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        match (c, c == '\\') {
            (_, true) => match chars.next() {
                Some('n') => out.push('\n'),
                Some('t') => out.push('\t'),
                Some('r') => out.push('\r'),
                Some(other) => out.push(other),
                None => {}
            },
            (c, false) => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Result<Vec<String>, SceneError> {
        let source =
            Arc::new(SourceFile { name: "t".into(), bytes: text.as_bytes().to_vec(), lines_before: 0 });
        let (mut at, mut out) = (0, Vec::new());
        while let Some(token) = token_at(&source, at)? {
            out.push(String::from_utf8_lossy(token.bytes(&source)).into_owned());
            at = token.end;
        }
        Ok(out)
    }

    #[test]
    fn words_strings_brackets_and_comments() {
        let tokens = all("Shape \"a b\"[1 -2e3]#x\n\"c\"5# end").unwrap();
        assert_eq!(tokens, ["Shape", "\"a b\"", "[", "1", "-2e3", "]", "\"c\"", "5"]);
        assert!(all(" # only a comment").unwrap().is_empty());
    }

    #[test]
    fn broken_strings_and_bytes_are_errors_with_a_place() {
        assert_eq!(all("a\n  \"open\n").unwrap_err().position(), Some((2, 3)));
        assert_eq!(all("a b\u{1}c").unwrap_err().position(), Some((1, 4)));
    }

    #[test]
    fn escapes() {
        assert_eq!(unquote(br#""a\"b\\c""#), r#"a"b\c"#);
        assert_eq!(unquote(b"\""), "");
    }
}
