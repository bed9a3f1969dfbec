//! The one error type of all loaders: what is wrong, where (file:line:column), and what would help.
//!
//! [`SceneError`] prints as `file:line:column: message`, [`SceneError::report`] adds the source line with a
//! caret, and its [`miette::Diagnostic`] implementation gives the same to graphical reporters. Only the lines
//! around the place are kept, so an error in a file of a gigabyte stays small.

use crate::source::{Excerpt, Span};
use miette::{Diagnostic, LabeledSpan, SourceCode};
use std::fmt;
use std::path::Path;

/// What sort of thing went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A file is missing or cannot be read.
    File,
    /// The file name or its contents are of no supported format.
    Format,
    /// One of the [`crate::LoadOptions`] limits was exceeded.
    Limit,
    /// The text breaks the grammar of its format.
    Syntax,
    /// A directive, type or name that does not exist.
    Unknown,
    /// A value has the wrong type, count or range.
    Value,
    /// Part of the format that is not supported yet.
    Unsupported,
    /// A file in a folder that may not be read: see [`crate::LoadOptions::folders`].
    Refused,
    /// The scene as a whole makes no sense: nothing to render, ids out of range, numbers that are not finite.
    Invalid,
}

impl ErrorKind {
    fn code(self) -> &'static str {
        match self {
            Self::File => "scene::file",
            Self::Format => "scene::format",
            Self::Limit => "scene::limit",
            Self::Syntax => "scene::syntax",
            Self::Unknown => "scene::unknown",
            Self::Value => "scene::value",
            Self::Unsupported => "scene::unsupported",
            Self::Refused => "scene::refused",
            Self::Invalid => "scene::invalid",
        }
    }
}

/// Why a scene could not be loaded.
#[derive(Debug)]
pub struct SceneError(Box<Inner>);

#[derive(Debug)]
struct Inner {
    kind: ErrorKind,
    message: String,
    help: Option<String>,
    file: Option<String>,
    place: Option<Excerpt>,
    cause: Option<std::io::Error>,
}

impl SceneError {
    pub(crate) fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self(Box::new(Inner {
            kind,
            message: message.into(),
            help: None,
            file: None,
            place: None,
            cause: None,
        }))
    }

    pub(crate) fn at(mut self, span: &Span) -> Self {
        self.0.file = Some(span.source.name.clone());
        self.0.place = Some(span.excerpt());
        self
    }

    /// Names the file, unless the error has a place already.
    pub(crate) fn in_file(mut self, path: &Path) -> Self {
        self.0.file.get_or_insert_with(|| path.display().to_string());
        self
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    pub(crate) fn maybe_help(mut self, help: Option<String>) -> Self {
        self.0.help = help.or(self.0.help);
        self
    }

    pub(crate) fn caused_by(mut self, cause: std::io::Error) -> Self {
        self.0.cause = Some(cause);
        self
    }

    /// What sort of thing went wrong.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The message without the place.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.0.message
    }

    /// What to do about it, if there is something to say.
    #[must_use]
    pub fn help_text(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// The file in which the error is.
    #[must_use]
    pub fn file(&self) -> Option<&str> {
        self.0.file.as_deref()
    }

    /// Line and column, both counted from 1; columns count characters.
    #[must_use]
    pub fn position(&self) -> Option<(usize, usize)> {
        self.0.place.as_ref().map(|place| (place.line, place.column))
    }

    /// The error as text of several lines: place, message, source line with a caret, help.
    #[must_use]
    pub fn report(&self) -> String {
        let mut text = format!("error: {self}\n");
        if let Some(place) = &self.0.place {
            text.push_str(&place.draw());
        }
        if let Some(help) = &self.0.help {
            text.push_str(&format!("help: {help}\n"));
        }
        text
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.0.file {
            write!(f, "{file}:")?;
            if let Some(place) = &self.0.place {
                write!(f, "{}:{}:", place.line, place.column)?;
            }
            f.write_str(" ")?;
        }
        f.write_str(&self.0.message)
    }
}

impl std::error::Error for SceneError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.cause.as_ref().map(|cause| cause as _)
    }
}

impl Diagnostic for SceneError {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.0.kind.code()))
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.place.as_ref().map(|place| place as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = self.0.place.as_ref()?;
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(
            Some("here".to_owned()),
            (place.offset, place.len),
        ))))
    }
}

/// `did you mean` for a misspelt word: the closest of `known` within a third of its letters.
pub(crate) fn did_you_mean<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let best = known.into_iter().map(|name| (edit_distance(word, name), name)).min()?;
    let allowed = word.chars().count().div_ceil(3);
    (best.0 <= allowed).then(|| format!("did you mean `{}`?", best.1))
}

/// Levenshtein distance, letter case free, of words cut to 64 characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().take(64).flat_map(char::to_lowercase).collect();
    let b: Vec<char> = b.chars().take(64).flat_map(char::to_lowercase).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let above = row[j + 1];
            row[j + 1] = (diagonal + usize::from(ca != cb)).min(above + 1).min(row[j] + 1);
            diagonal = above;
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_words_are_suggested_and_far_ones_are_not() {
        let known = ["trianglemesh", "sphere", "disk"];
        assert_eq!(did_you_mean("triangelmesh", known).as_deref(), Some("did you mean `trianglemesh`?"));
        assert_eq!(did_you_mean("Sphere", known).as_deref(), Some("did you mean `sphere`?"));
        assert_eq!(did_you_mean("loopsubdiv", known), None);
    }

    #[test]
    fn diagnostics_mark_the_place_within_their_excerpt() {
        let long = format!("{}\nWorldBegin {} Shape \"cube\" # end", "#".repeat(300), " ".repeat(500));
        let error = crate::load_pbrt_text(long.as_bytes(), Path::new("."), &crate::LoadOptions::default());
        let error = error.unwrap_err();
        assert_eq!(error.position(), Some((2, 519)));
        let label = error.labels().and_then(|mut labels| labels.next()).unwrap();
        let contents = error.source_code().unwrap().read_span(label.inner(), 1, 1).unwrap();
        let text = std::str::from_utf8(contents.data()).unwrap();
        assert!(text.len() < 200);
        assert_eq!(&text[label.offset()..label.offset() + label.len()], "\"cube\"");
        assert_eq!(contents.line(), 1);
    }
}
