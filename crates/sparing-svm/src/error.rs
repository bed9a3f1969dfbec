//! The one error of this crate.

use std::fmt;
use std::io;
use std::path::Path;

/// Result with [`SvmError`].
pub type Result<T> = std::result::Result<T, SvmError>;

/// A place in a text file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Position {
    /// The file's name as it was given, or what the caller called the text.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Byte in the line, from 1; `None` where the message is about the line as a whole.
    pub column: Option<usize>,
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)?;
        self.column.map_or(Ok(()), |column| write!(f, ":{column}"))
    }
}

/// What can go wrong with models, data and training. Every message says what is wrong and where.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SvmError {
    /// A file that cannot be opened, read or written.
    #[error("cannot {action} {file}: {source}")]
    Io {
        /// "read" or "write".
        action: &'static str,
        /// The file.
        file: String,
        /// Cause.
        source: io::Error,
    },
    /// A text that is not what it should be.
    #[error("{position}: {message}")]
    Text {
        /// Where.
        position: Position,
        /// What is wrong.
        message: String,
    },
    /// A model built by hand whose parts contradict each other.
    #[error("the model is not valid: {0}")]
    Model(String),
    /// Data that cannot be trained on or scaled: shapes, values that are not finite, constant features.
    #[error("the data cannot be used: {0}")]
    Data(String),
    /// Parameters out of their range.
    #[error("the parameters cannot be used: {0}")]
    Parameters(String),
    /// A model card that does not fit its model or the caller's features.
    #[error("{file}: {message}")]
    Card {
        /// The card's file.
        file: String,
        /// What does not fit.
        message: String,
    },
    /// The time limit was reached before all fits were done.
    #[error("the time limit was reached after {done} of {total} fits; missing: {missing}")]
    TimeLimit {
        /// Fits that were finished.
        done: usize,
        /// Fits that were asked for.
        total: usize,
        /// What was not done, in words.
        missing: String,
    },
}

impl SvmError {
    /// The place in a text, for [`SvmError::Text`].
    #[must_use]
    pub fn position(&self) -> Option<&Position> {
        match self {
            Self::Text { position, .. } => Some(position),
            _ => None,
        }
    }

    pub(crate) fn text(file: &str, line: usize, column: Option<usize>, message: impl Into<String>) -> Self {
        Self::Text { position: Position { file: file.to_owned(), line, column }, message: message.into() }
    }

    pub(crate) fn reading(file: &Path) -> impl Fn(io::Error) -> Self + '_ {
        |source| Self::Io { action: "read", file: file.display().to_string(), source }
    }

    pub(crate) fn writing(file: &Path) -> impl Fn(io::Error) -> Self + '_ {
        |source| Self::Io { action: "write", file: file.display().to_string(), source }
    }
}
