//! Source texts, places in them, and the few lines that an error keeps.

use crate::error::{ErrorKind, SceneError};
use crate::options::LoadOptions;
use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Characters of a source line that an error shows on each side of the place.
const CONTEXT: usize = 60;

/// A text that was read whole.
#[derive(Debug)]
pub(crate) struct SourceFile {
    /// Name for messages.
    pub name: String,
    /// Bytes as they are in the file.
    pub bytes: Vec<u8>,
    /// Lines of the file before these bytes, where they are not the whole of it.
    pub lines_before: usize,
}

impl SourceFile {
    /// The place of one line of a file that is not kept.
    pub fn line(name: &str, number: usize, text: &[u8]) -> Span {
        let bytes = text.trim_ascii().to_vec();
        let len = bytes.len();
        let source = Arc::new(Self { name: name.to_owned(), bytes, lines_before: number.saturating_sub(1) });
        Span { source, start: 0, len }
    }
}

/// A place in a source text.
#[derive(Clone, Debug)]
pub(crate) struct Span {
    pub source: Arc<SourceFile>,
    pub start: usize,
    pub len: usize,
}

impl Span {
    /// Line and column from 1.
    pub fn line_column(&self) -> (usize, usize) {
        let before = &self.source.bytes[..self.start.min(self.source.bytes.len())];
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        let line = before.iter().filter(|&&b| b == b'\n').count() + 1 + self.source.lines_before;
        (line, String::from_utf8_lossy(&before[line_start..]).chars().count() + 1)
    }

    /// `file:line:column`.
    pub fn place(&self) -> String {
        let (line, column) = self.line_column();
        format!("{}:{line}:{column}", self.source.name)
    }

    /// The line around the place, cut to a readable length.
    pub fn excerpt(&self) -> Excerpt {
        let bytes = &self.source.bytes;
        let start = self.start.min(bytes.len());
        let (line, column) = self.line_column();
        let line_start = bytes[..start].iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        let from = line_start.max(start.saturating_sub(CONTEXT));
        let line_end = bytes[start..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |i| start + i);
        let to = line_end.min(start + self.len.min(CONTEXT) + CONTEXT);
        let clean = |part: &[u8]| -> String {
            String::from_utf8_lossy(part).chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
        };
        let before = clean(&bytes[from..start]);
        let marked_end = (start + self.len).min(to);
        let marked = clean(&bytes[start..marked_end]);
        let marks = marked.chars().count().max(1);
        let indent = before.chars().count();
        let offset = before.len();
        let len = marked.len();
        let text = format!("{before}{marked}{}", clean(&bytes[marked_end..to]).trim_end());
        let shown_column = column - indent.min(column - 1);
        Excerpt {
            name: self.source.name.clone(),
            text,
            line,
            column,
            shown_column,
            indent,
            marks,
            offset,
            len,
        }
    }
}

/// One source line, or the part of it around an error.
#[derive(Clone, Debug)]
pub(crate) struct Excerpt {
    name: String,
    text: String,
    pub line: usize,
    pub column: usize,
    shown_column: usize,
    indent: usize,
    marks: usize,
    /// Byte offset and length of the marked part within `text`.
    pub offset: usize,
    pub len: usize,
}

impl Excerpt {
    /// The line with a caret below the place.
    pub fn draw(&self) -> String {
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        let text = self.text.trim_end();
        let carets = format!("{}{}", " ".repeat(self.indent), "^".repeat(self.marks));
        format!("{margin} |\n{number} | {text}\n{margin} | {carets}\n")
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        _span: &SourceSpan,
        _before: usize,
        _after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            self.text.as_bytes(),
            (0, self.text.len()).into(),
            self.line - 1,
            self.shown_column - 1,
            1,
        )))
    }
}

/// Checks that a file is in a folder that may be read, symbolic links and all. A file that does not exist passes: it
/// cannot be read anyway.
pub(crate) fn check_folder(path: &Path, options: &LoadOptions) -> Result<(), SceneError> {
    let Some(folders) = &options.folders else { return Ok(()) };
    let Ok(real) = path.canonicalize() else { return Ok(()) };
    let holds =
        |folder: &std::path::PathBuf| folder.canonicalize().is_ok_and(|folder| real.starts_with(folder));
    if folders.iter().any(holds) {
        return Ok(());
    }
    let message = format!("`{}` is outside of the folder of the scene", path.display());
    let error = SceneError::new(ErrorKind::Refused, message);
    Err(error.help("allow its folder with --allow-path, or any with --no-sandbox, if you trust the scene"))
}

/// Opens a regular file whose size is within the limit.
pub(crate) fn open(path: &Path, options: &LoadOptions) -> Result<(File, u64), SceneError> {
    let failed = |cause: std::io::Error| {
        let message = match cause.kind() {
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            std::io::ErrorKind::PermissionDenied => "no permission to read this file".to_owned(),
            _ => format!("cannot read this file: {cause}"),
        };
        SceneError::new(ErrorKind::File, message).in_file(path).caused_by(cause)
    };
    check_folder(path, options)?;
    let about = std::fs::metadata(path).map_err(failed)?;
    if !about.is_file() {
        return Err(SceneError::new(ErrorKind::File, "this is not a regular file").in_file(path));
    }
    if about.len() > options.max_file_bytes {
        return Err(options.exceeded("max_file_bytes", options.max_file_bytes, about.len()).in_file(path));
    }
    let file = File::open(path).map_err(failed)?;
    options.count_file(about.len());
    Ok((file, about.len()))
}

/// Reads a whole file within the size limit; a gzip file is expanded.
pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<Arc<SourceFile>, SceneError> {
    let (mut file, size) = open(path, options)?;
    let failed = |cause: std::io::Error| {
        SceneError::new(ErrorKind::File, format!("cannot read this file: {cause}"))
            .in_file(path)
            .caused_by(cause)
    };
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
    let limit = options.max_file_bytes;
    (&mut file).take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    let length = bytes.len() as u64;
    if length > limit {
        return Err(options.exceeded("max_file_bytes", limit, length).in_file(path));
    }
    if bytes.starts_with(&GZIP) {
        bytes = expand(&bytes, options).map_err(|error| error.in_file(path))?;
    }
    Ok(Arc::new(SourceFile { name: path.display().to_string(), bytes, lines_before: 0 }))
}

/// How gzip files begin (RFC 1952, section 2.3.1).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The contents of a gzip file, within the limits.
fn expand(bytes: &[u8], options: &LoadOptions) -> Result<Vec<u8>, SceneError> {
    let size = bytes.len() as u64;
    let largest = size.saturating_mul(options.max_expansion);
    let limit = largest.min(options.max_file_bytes);
    let mut out = Vec::new();
    let mut reader = flate2::read::MultiGzDecoder::new(bytes).take(limit.saturating_add(1));
    reader.read_to_end(&mut out).map_err(|cause| {
        SceneError::new(ErrorKind::Format, format!("cannot expand this gzip file: {cause}")).caused_by(cause)
    })?;
    if out.len() as u64 <= limit {
        return Ok(out);
    }
    Err(if limit == options.max_file_bytes {
        options.exceeded("max_file_bytes", limit, out.len() as u64)
    } else {
        options.exceeded("max_expansion", options.max_expansion, (out.len() as u64).div_ceil(size.max(1)))
    })
}
