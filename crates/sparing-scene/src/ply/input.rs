//! Bytes of a PLY file, plain or gzip'd, a piece at a time.

use crate::error::{ErrorKind, SceneError};
use crate::options::LoadOptions;
use crate::source;
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;

/// Bytes of a piece: fits into the second-level cache.
const PIECE: usize = 1 << 18;

enum Stream {
    Plain(File),
    Gzip(Box<MultiGzDecoder<File>>),
}

/// A file with a buffer in front.
pub(super) struct Input {
    stream: Stream,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Bytes of the file, expanded, that came before the buffer.
    before: u64,
    /// Bytes that the whole file, expanded, has at most.
    most: u64,
    limit: SceneError,
}

impl Input {
    pub fn open(path: &Path, options: &LoadOptions) -> Result<Self, SceneError> {
        let (mut file, size) = source::open(path, options)?;
        let mut magic = [0; 2];
        let gzip = file.read_exact(&mut magic).is_ok() && magic == [0x1f, 0x8b];
        file.rewind().map_err(|cause| unreadable(cause).in_file(path))?;
        let mut most = size;
        let mut limit = SceneError::new(ErrorKind::File, "this file grows while it is read");
        if gzip {
            let expanded = size.saturating_mul(options.max_expansion);
            let by_size = options.max_file_bytes < expanded;
            most = expanded.min(options.max_file_bytes);
            let (name, value) = match by_size {
                true => ("max_file_bytes", options.max_file_bytes),
                false => ("max_expansion", options.max_expansion),
            };
            let message = format!("the limit {name} = {value} is exceeded when this file is expanded");
            limit = SceneError::new(ErrorKind::Limit, message)
                .help(format!("raise LoadOptions::{name} if this is meant"));
        }
        let stream = match gzip {
            true => Stream::Gzip(Box::new(MultiGzDecoder::new(file))),
            false => Stream::Plain(file),
        };
        Ok(Self { stream, buffer: vec![0; PIECE], start: 0, end: 0, before: 0, most, limit })
    }

    /// What is in the buffer.
    pub fn available(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    pub fn advance(&mut self, count: usize) {
        self.start = (self.start + count).min(self.end);
    }

    /// Bytes from the start of the file.
    pub fn offset(&self) -> u64 {
        self.before + self.start as u64
    }

    /// Whether the file is gzip'd.
    pub fn is_compressed(&self) -> bool {
        matches!(self.stream, Stream::Gzip(_))
    }

    /// Bytes that can still come.
    pub fn rest(&self) -> u64 {
        self.most.saturating_sub(self.offset())
    }

    /// At least `count` bytes, or what is left of the file if that is less.
    pub fn fill(&mut self, count: usize) -> Result<&[u8], SceneError> {
        if self.end - self.start < count {
            self.buffer.copy_within(self.start..self.end, 0);
            self.before += self.start as u64;
            self.end -= self.start;
            self.start = 0;
            if self.buffer.len() < count {
                // Only as much as can come.
                let size = count.min(usize::try_from(self.rest()).unwrap_or(usize::MAX)).max(self.end);
                self.buffer.resize(size.max(self.buffer.len()), 0);
            }
            while self.end < count.min(self.buffer.len()) {
                let free = &mut self.buffer[self.end..];
                let read = match &mut self.stream {
                    Stream::Plain(file) => file.read(free),
                    Stream::Gzip(file) => file.read(free),
                };
                match read {
                    Ok(0) => break,
                    Ok(read) => self.end += read,
                    Err(cause) if cause.kind() == io::ErrorKind::Interrupted => {}
                    Err(cause) => return Err(unreadable(cause)),
                }
                if self.before + self.end as u64 > self.most {
                    return Err(std::mem::replace(&mut self.limit, SceneError::new(ErrorKind::Limit, "")));
                }
            }
        }
        Ok(self.available())
    }

    /// Exactly `count` bytes, which are then behind.
    pub fn take(&mut self, count: usize) -> Result<&[u8], SceneError> {
        let offset = self.offset();
        let found = self.fill(count)?.len();
        if found < count {
            return Err(ends_early(offset + found as u64));
        }
        self.start += count;
        Ok(&self.buffer[self.start - count..self.start])
    }

    /// The next line without its end, or what is left; `None` at the end of the file.
    pub fn line<'l>(&mut self, line: &'l mut Vec<u8>) -> Result<Option<&'l [u8]>, SceneError> {
        line.clear();
        loop {
            if self.fill(1)?.is_empty() {
                return Ok((!line.is_empty()).then_some(line));
            }
            let available = self.available();
            let end = available.iter().position(|&b| b == b'\n');
            line.extend_from_slice(&available[..end.unwrap_or(available.len())]);
            match end {
                Some(end) => {
                    self.advance(end + 1);
                    return Ok(Some(line.strip_suffix(b"\r").unwrap_or(line)));
                }
                None => self.advance(usize::MAX - self.start),
            }
        }
    }
}

fn unreadable(cause: io::Error) -> SceneError {
    SceneError::new(ErrorKind::File, format!("cannot read this file: {cause}")).caused_by(cause)
}

pub(super) fn ends_early(offset: u64) -> SceneError {
    SceneError::new(ErrorKind::Syntax, format!("the file ends early, at byte {offset}"))
}
