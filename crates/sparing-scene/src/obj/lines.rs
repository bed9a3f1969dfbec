//! Lines of an OBJ file: continued ones joined, comments and a byte order mark gone, with their number.

use crate::error::SceneError;
use crate::source::{SourceFile, Span};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

pub(super) struct Lines {
    inner: BufReader<File>,
    name: String,
    line: Vec<u8>,
    number: usize,
}

impl Lines {
    pub fn new(file: File, path: &Path) -> Self {
        let inner = BufReader::with_capacity(1 << 18, file);
        Self { inner, name: path.display().to_string(), line: Vec::new(), number: 0 }
    }

    /// Goes to the next line; false at the end.
    pub fn advance(&mut self) -> Result<bool, SceneError> {
        self.line.clear();
        loop {
            self.number += 1;
            let read = self.inner.read_until(b'\n', &mut self.line);
            let read = read.map_err(|cause| {
                let message = format!("cannot read this file: {cause}");
                SceneError::new(crate::ErrorKind::File, message).at(&self.span()).caused_by(cause)
            })?;
            if self.number == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
                self.line.drain(..3);
            }
            if read == 0 {
                return Ok(!self.line.is_empty());
            }
            let content = self.line.trim_ascii_end().len();
            self.line.truncate(content);
            if self.line.last() != Some(&b'\\') {
                return Ok(true);
            }
            // A continued line.
            self.line.pop();
            self.line.push(b' ');
        }
    }

    /// Keyword and the rest, without blanks around.
    pub fn words(&self) -> (&[u8], &[u8]) {
        let line = self.line.trim_ascii_start();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        (&line[..end], line[end..].trim_ascii())
    }

    pub fn number(&self) -> usize {
        self.number
    }

    /// The whole line, as text.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.line).into_owned()
    }

    pub fn span(&self) -> Span {
        SourceFile::line(&self.name, self.number, &self.line)
    }
}
