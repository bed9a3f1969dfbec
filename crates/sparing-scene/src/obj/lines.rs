//! A reader that hands `tobj` one cleaned line at a time and knows which one it was.
//!
//! It joins continued lines, repairs text that is not UTF-8, and refuses what `tobj` would not survive or
//! would report without a line: numbers that are not finite, indices of 0 or beyond the start of the file.

use crate::error::{ErrorKind, SceneError};
use crate::source::{SourceFile, Span};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

pub(super) struct LineReader {
    inner: BufReader<File>,
    name: String,
    line: Vec<u8>,
    at: usize,
    number: usize,
    /// Vertices, texture coordinates and normals so far.
    counts: [i64; 3],
    /// The first face that names a vertex which has not come yet.
    suspect: Option<Span>,
    /// Why reading stopped.
    pub error: Option<SceneError>,
    /// Materials by name with the line that first names them.
    pub used_materials: BTreeMap<String, (usize, String)>,
}

impl LineReader {
    pub fn new(file: File, path: &Path) -> Self {
        Self {
            inner: BufReader::with_capacity(1 << 16, file),
            name: path.display().to_string(),
            line: Vec::new(),
            at: 0,
            number: 0,
            counts: [0; 3],
            suspect: None,
            error: None,
            used_materials: BTreeMap::new(),
        }
    }

    fn span(&self) -> Span {
        SourceFile::line(&self.name, self.number, &self.line)
    }

    /// An error of `tobj` in our words, at the line it was about.
    pub fn explain(&self, error: tobj::LoadError) -> SceneError {
        use tobj::LoadError as E;
        let (message, span) = match error {
            E::PositionParseError => ("a vertex needs three numbers", self.span()),
            E::ScalingByZeroError => ("the weight of a vertex must not be 0", self.span()),
            E::ColorParseError => ("a vertex has 3, 4 or 6 numbers", self.span()),
            E::NormalParseError => ("a normal needs three numbers", self.span()),
            E::TexcoordParseError => ("texture coordinates need two numbers", self.span()),
            E::FaceParseError | E::InvalidPolygon => ("this is not a face", self.span()),
            E::MaterialParseError => ("the name of the material is missing", self.span()),
            E::FaceVertexOutOfBounds => ("a face names a vertex that does not exist", self.suspect()),
            E::FaceTexCoordOutOfBounds => {
                ("a face names texture coordinates that do not exist", self.suspect())
            }
            E::FaceNormalOutOfBounds => ("a face names a normal that does not exist", self.suspect()),
            E::FaceColorOutOfBounds => ("only some vertices have colours", self.suspect()),
            _ => ("this line cannot be read", self.span()),
        };
        SceneError::new(ErrorKind::Value, message).at(&span)
    }

    fn suspect(&self) -> Span {
        self.suspect.clone().unwrap_or_else(|| self.span())
    }

    fn next_line(&mut self) -> io::Result<()> {
        self.line.clear();
        self.at = 0;
        loop {
            self.number += 1;
            if self.inner.read_until(b'\n', &mut self.line)? == 0 {
                break;
            }
            let content = self.line.trim_ascii_end().len();
            if content == 0 || self.line[content - 1] != b'\\' {
                break;
            }
            // A continued line.
            self.line.truncate(content - 1);
            self.line.push(b' ');
        }
        if !self.line.is_ascii()
            && let std::borrow::Cow::Owned(text) = String::from_utf8_lossy(&self.line)
        {
            self.line = text.into_bytes();
        }
        if let Err(error) = self.check() {
            self.error = Some(error);
            return Err(io::Error::other("malformed"));
        }
        Ok(())
    }

    fn check(&mut self) -> Result<(), SceneError> {
        let bad = |reader: &Self, message: String| {
            Err(SceneError::new(ErrorKind::Value, message).at(&reader.span()))
        };
        let text = std::str::from_utf8(&self.line).unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        let counter = match words.next() {
            Some("v") => 0,
            Some("vt") => 1,
            Some("vn") => 2,
            Some("f") => return self.check_face(),
            Some("usemtl") => {
                let name = text.split_once(' ').map(|(_, name)| name.trim().to_owned());
                let number = self.number;
                let line = text.to_owned();
                self.used_materials.entry(name.unwrap_or_default()).or_insert((number, line));
                return Ok(());
            }
            Some(word) if word.bytes().any(|b| b == 0) => {
                return bad(self, "this is not text: an OBJ file is plain text".to_owned());
            }
            _ => return Ok(()),
        };
        let word = words.find(|word| {
            let digits = word.trim_start_matches(['-', '+']);
            digits.starts_with(|c: char| c.is_ascii_alphabetic())
        });
        if let Some(word) = word {
            let what = if word.parse::<f32>().is_ok() { "is not finite" } else { "is not a number" };
            return bad(self, format!("`{}` {what}", word.chars().take(20).collect::<String>()));
        }
        self.counts[counter] += 1;
        Ok(())
    }

    fn check_face(&mut self) -> Result<(), SceneError> {
        let text = std::str::from_utf8(&self.line).unwrap_or_default();
        if text.split_ascii_whitespace().nth(1).is_none() {
            let message = "a face needs corners";
            return Err(SceneError::new(ErrorKind::Value, message).at(&self.span()));
        }
        let mut ahead = false;
        for corner in text.split_ascii_whitespace().skip(1) {
            for (index, count) in corner.split('/').zip(self.counts) {
                let Ok(value) = index.parse::<i64>() else {
                    if index.is_empty() {
                        continue;
                    }
                    let shown: String = corner.chars().take(20).collect();
                    let message = format!("`{shown}` is not a corner of a face");
                    return Err(SceneError::new(ErrorKind::Value, message).at(&self.span()));
                };
                if value == 0 || value < -count || value > i64::from(u32::MAX) {
                    let message = format!("index {value} does not exist: there are {count} so far");
                    return Err(SceneError::new(ErrorKind::Value, message).at(&self.span()));
                }
                ahead |= value > count;
            }
        }
        if ahead && self.suspect.is_none() {
            self.suspect = Some(self.span());
        }
        Ok(())
    }
}

impl Read for LineReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(out.len());
        out[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for LineReader {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.at >= self.line.len() {
            self.next_line()?;
        }
        Ok(&self.line[self.at..])
    }

    fn consume(&mut self, count: usize) {
        self.at = (self.at + count).min(self.line.len());
    }
}
