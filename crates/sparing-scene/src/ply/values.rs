//! The numbers after the header, one at a time: text or binary.

use super::header::{Format, Property, Scalar};
use super::input::{Input, ends_early};
use crate::error::{ErrorKind, SceneError};
use crate::source::{SourceFile, Span};
use std::sync::Arc;

/// Where the next number comes from.
pub(super) enum Values {
    Ascii(Ascii),
    Binary { input: Input, format: Format },
}

/// Words of text with their place.
pub(super) struct Ascii {
    input: Input,
    file: String,
    line: Vec<u8>,
    /// Of `line`, from 1.
    number: usize,
    /// Where in `line` the next word starts, and where the last one was.
    at: usize,
    last: (usize, usize),
}

impl Values {
    pub fn new(input: Input, format: Format, file: &str, lines: usize) -> Self {
        match format {
            Format::Ascii => Self::Ascii(Ascii {
                input,
                file: file.to_owned(),
                line: Vec::new(),
                number: lines,
                at: 0,
                last: (0, 0),
            }),
            format => Self::Binary { input, format },
        }
    }

    /// Bytes that can still come.
    pub fn rest(&self) -> u64 {
        match self {
            // The line in hand, and an end of line that may be missing in the file.
            Self::Ascii(text) => text.input.rest() + (text.line.len() - text.at) as u64 + 1,
            Self::Binary { input, .. } => input.rest(),
        }
    }

    /// Whether the file is gzip'd.
    pub fn is_compressed(&self) -> bool {
        match self {
            Self::Ascii(text) => text.input.is_compressed(),
            Self::Binary { input, .. } => input.is_compressed(),
        }
    }

    /// The next number.
    #[inline]
    pub fn next(&mut self, scalar: Scalar) -> Result<f64, SceneError> {
        match self {
            Self::Ascii(text) => text.next(scalar),
            Self::Binary { input, format } => Ok(scalar.read(input.take(scalar.size())?, *format)),
        }
    }

    /// The number of values of a list; more than can still come is an error.
    pub fn list_length(&mut self, count: Scalar, item: Scalar) -> Result<usize, SceneError> {
        let length = self.next(count)?;
        let each = match self {
            Self::Ascii(_) => 2,
            Self::Binary { .. } => item.size(),
        };
        if length < 0.0 || length * each as f64 > self.rest() as f64 {
            return Err(self.error(format!("a list of {length} values does not fit into the file")));
        }
        Ok(length as usize)
    }

    /// Passes over a property.
    pub fn skip(&mut self, property: &Property) -> Result<(), SceneError> {
        let length = match property.count {
            Some(count) => self.list_length(count, property.item)?,
            None => 1,
        };
        for _ in 0..length {
            self.next(property.item)?;
        }
        Ok(())
    }

    /// An error at the number that was read last.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        match self {
            Self::Ascii(text) => SceneError::new(ErrorKind::Value, message).at(&text.span()),
            Self::Binary { input, .. } => error_at(message, input.offset()),
        }
    }
}

/// An error before a byte of a binary file.
pub(super) fn error_at(message: impl Into<String>, offset: u64) -> SceneError {
    SceneError::new(ErrorKind::Value, format!("{} (before byte {offset})", message.into()))
}

impl Ascii {
    fn span(&self) -> Span {
        let source = SourceFile {
            name: self.file.clone(),
            bytes: self.line.clone(),
            lines_before: self.number.saturating_sub(1),
        };
        Span { source: Arc::new(source), start: self.last.0, len: self.last.1 - self.last.0 }
    }

    fn word(&mut self) -> Result<(), SceneError> {
        loop {
            let rest = &self.line[self.at..];
            if let Some(start) = rest.iter().position(|b| !b.is_ascii_whitespace()) {
                let start = self.at + start;
                let end = self.line[start..].iter().position(u8::is_ascii_whitespace);
                let end = end.map_or(self.line.len(), |end| start + end);
                self.last = (start, end);
                self.at = end;
                return Ok(());
            }
            let mut line = std::mem::take(&mut self.line);
            let found = self.input.line(&mut line)?.is_some();
            (self.line, self.at) = (line, 0);
            if !found {
                return Err(ends_early(self.input.offset()));
            }
            self.number += 1;
        }
    }

    fn next(&mut self, scalar: Scalar) -> Result<f64, SceneError> {
        self.word()?;
        let word = std::str::from_utf8(&self.line[self.last.0..self.last.1]).unwrap_or_default();
        let value = match scalar {
            Scalar::F32 => word.parse::<f32>().ok().map(f64::from),
            Scalar::F64 => word.parse().ok(),
            // Some writers put `3.0` where a whole number belongs.
            _ => word.parse::<i64>().ok().map(|v| v as f64).or_else(|| word.parse::<f64>().ok()),
        };
        let whole = !scalar.is_integer() || value.is_some_and(|v| v.fract() == 0.0);
        match value.filter(|_| whole) {
            Some(value) => Ok(value),
            None => {
                let word: String =
                    String::from_utf8_lossy(&self.line[self.last.0..self.last.1]).chars().take(20).collect();
                let what = if scalar.is_integer() { "a whole number" } else { "a number" };
                let message = format!("`{word}` is not {what}");
                Err(SceneError::new(ErrorKind::Value, message).at(&self.span()))
            }
        }
    }
}
