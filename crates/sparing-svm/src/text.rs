//! Lines, words and numbers of the text formats: strict, and every error knows its place.

use std::io::{BufRead, Read};

use crate::error::{Result, SvmError};

/// A longer line is an error, so that a hostile file cannot fill the memory: enough for 2 million features.
pub(crate) const MAX_LINE_BYTES: usize = 64 << 20;

/// Reads a text line by line and counts.
pub(crate) struct Lines<R> {
    reader: R,
    name: String,
    buffer: Vec<u8>,
    number: usize,
    whole: bool,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn new(reader: R, name: &str) -> Self {
        Self { reader, name: name.to_owned(), buffer: Vec::new(), number: 0, whole: true }
    }

    /// The next line without its end, or `None` after the last.
    pub(crate) fn next_line(&mut self) -> Result<Option<Line<'_>>> {
        self.buffer.clear();
        let mut limited = (&mut self.reader).take(MAX_LINE_BYTES as u64 + 1);
        let read = limited.read_until(b'\n', &mut self.buffer);
        match read {
            Ok(0) => return Ok(None),
            Ok(_) => self.number += 1,
            Err(source) => return Err(SvmError::Io { action: "read", file: self.name.clone(), source }),
        }
        self.whole = self.buffer.last() == Some(&b'\n');
        if self.whole {
            self.buffer.pop();
            if self.buffer.last() == Some(&b'\r') {
                self.buffer.pop();
            }
        } else if self.buffer.len() > MAX_LINE_BYTES {
            return Err(self.error(format!("the line is longer than the limit of {MAX_LINE_BYTES} bytes")));
        }
        match std::str::from_utf8(&self.buffer) {
            Ok(text) => Ok(Some(Line { text, number: self.number, file: &self.name })),
            Err(e) => Err(SvmError::text(
                &self.name,
                self.number,
                Some(e.valid_up_to() + 1),
                "the line is not UTF-8 text",
            )),
        }
    }

    /// Whether the last line that was read had an end: a file cut short has none.
    pub(crate) fn ended_with_newline(&self) -> bool {
        self.whole
    }

    /// An error at the last line that was read.
    pub(crate) fn error(&self, message: impl Into<String>) -> SvmError {
        SvmError::text(&self.name, self.number.max(1), None, message)
    }

    /// An error at a line that was read before.
    pub(crate) fn error_at(&self, line: usize, message: impl Into<String>) -> SvmError {
        SvmError::text(&self.name, line, None, message)
    }
}

/// One line.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    pub(crate) text: &'a str,
    pub(crate) number: usize,
    file: &'a str,
}

impl<'a> Line<'a> {
    pub(crate) fn error(&self, message: impl Into<String>) -> SvmError {
        SvmError::text(self.file, self.number, None, message)
    }

    /// The part before a mark, the whole line if there is none.
    pub(crate) fn before(self, mark: char) -> Self {
        Self { text: self.text.split(mark).next().unwrap_or_default(), ..self }
    }

    /// Words between white space.
    pub(crate) fn words(self) -> impl Iterator<Item = Word<'a>> {
        self.text.split_ascii_whitespace().map(move |text| Word { text, line: self })
    }
}

/// One word, with its place.
#[derive(Clone, Copy)]
pub(crate) struct Word<'a> {
    pub(crate) text: &'a str,
    line: Line<'a>,
}

impl<'a> Word<'a> {
    pub(crate) fn error(&self, message: impl Into<String>) -> SvmError {
        // Both are slices of the same line.
        let column = self.text.as_ptr() as usize - self.line.text.as_ptr() as usize + 1;
        SvmError::text(self.line.file, self.line.number, Some(column), message)
    }

    /// A finite number.
    pub(crate) fn number(&self, what: &str) -> Result<f64> {
        match self.text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(value) if value.is_infinite() && self.text.bytes().any(|b| b.is_ascii_digit()) => {
                Err(self.error(format!("{what} is too large for a double: {}", excerpt(self.text))))
            }
            Ok(_) => Err(self.error(format!("{what} is not finite: {}", excerpt(self.text)))),
            Err(_) => Err(self.error(format!("{what} is not a number: {}", excerpt(self.text)))),
        }
    }

    /// A whole number of the type that the caller wants.
    pub(crate) fn integer<T: std::str::FromStr>(&self, what: &str) -> Result<T> {
        let shown = excerpt(self.text);
        self.text.parse().map_err(|_| {
            let digits = self.text.strip_prefix(['-', '+']).unwrap_or(self.text);
            if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) {
                self.error(format!("{what} is out of range: {shown}"))
            } else {
                self.error(format!("{what} is not a whole number: {shown}"))
            }
        })
    }

    /// The two sides of `index:value`. The index is checked against the one before and the limit.
    pub(crate) fn feature(&self, previous: usize, limit: FeatureLimit) -> Result<(usize, f64)> {
        let Some((index, value)) = self.text.split_once(':') else {
            return Err(self.error(format!("expected index:value, found {}", excerpt(self.text))));
        };
        let index = Word { text: index, line: self.line }.integer::<usize>("the feature index")?;
        if index == 0 {
            return Err(self.error("feature indices begin at 1, found 0"));
        }
        if index == previous {
            return Err(self.error(format!("feature {index} occurs twice")));
        }
        if index < previous {
            return Err(self.error(format!(
                "feature indices must ascend within a line: {index} comes after {previous}"
            )));
        }
        if index > limit.count {
            return Err(self.error(format!(
                "feature {index} is beyond {}, {}",
                if limit.asked { "the number of features" } else { "the limit of features" },
                limit.count
            )));
        }
        let value = Word { text: value, line: self.line }.number(&format!("the value of feature {index}"))?;
        Ok((index, value))
    }
}

/// The largest index allowed.
#[derive(Clone, Copy)]
pub(crate) struct FeatureLimit {
    pub(crate) count: usize,
    /// Whether the caller said how many features there are; otherwise it is a guard.
    pub(crate) asked: bool,
}

/// A word for a message: quoted, and cut if it is long.
pub(crate) fn excerpt(text: &str) -> String {
    if text.chars().count() <= 40 {
        format!("{text:?}")
    } else {
        format!("{:?}...", text.chars().take(40).collect::<String>())
    }
}

/// The shortest text that reads back as the same bits; `e` form for extremes, as C's `%g` would choose.
pub(crate) fn push_number(text: &mut String, value: f64) {
    use std::fmt::Write as _;
    let magnitude = value.abs();
    // Writing to a string cannot fail.
    let _ = if magnitude != 0.0 && !(1e-5..1e17).contains(&magnitude) {
        write!(text, "{value:e}")
    } else {
        write!(text, "{value}")
    };
}
