//! Reads tokens through a stack of included files and groups them into numbers, names and parameter lists.

use super::params::{Param, ParamList, ParamType, Values};
use super::tokenizer::{Token, TokenKind, token_at, unquote};
use crate::error::{ErrorKind, SceneError};
use crate::options::LoadOptions;
use crate::source::{SourceFile, Span};
use std::rc::Rc;
use std::sync::Arc;

/// A file being read.
#[derive(Debug)]
struct Frame {
    source: Arc<SourceFile>,
    at: usize,
    /// Whether it came by `Import`, which keeps its attributes to itself.
    import: bool,
}

/// The stack of files.
#[derive(Debug)]
pub(super) struct Parser<'o> {
    frames: Vec<Frame>,
    options: &'o LoadOptions,
    total_bytes: u64,
}

/// What comes next at the level of directives.
pub(super) enum Next {
    Directive(String, Span),
    /// An imported file ended.
    ImportEnd,
    End,
}

impl<'o> Parser<'o> {
    pub fn new(source: Arc<SourceFile>, options: &'o LoadOptions) -> Self {
        let total_bytes = source.bytes.len() as u64;
        Self { frames: vec![Frame { source, at: 0, import: false }], options, total_bytes }
    }

    /// Reads `source` before the rest of the current file.
    pub fn include(&mut self, source: Arc<SourceFile>, import: bool, at: &Span) -> Result<(), SceneError> {
        if self.frames.iter().any(|frame| frame.source.name == source.name) {
            let message = format!("{} includes itself", source.name);
            return Err(SceneError::new(ErrorKind::Value, message).at(at));
        }
        let depth = self.frames.len() as u64;
        if depth >= self.options.max_include_depth {
            let limit = self.options.max_include_depth;
            return Err(self.options.exceeded("max_include_depth", limit, depth + 1).at(at));
        }
        self.total_bytes += source.bytes.len() as u64;
        if self.total_bytes > self.options.max_total_bytes {
            let limit = self.options.max_total_bytes;
            return Err(self.options.exceeded("max_total_bytes", limit, self.total_bytes).at(at));
        }
        self.frames.push(Frame { source, at: 0, import });
        Ok(())
    }

    /// The next directive, in whatever file it is.
    pub fn next_directive(&mut self) -> Result<Next, SceneError> {
        while let Some(frame) = self.frames.last_mut() {
            let Some(token) = token_at(&frame.source, frame.at)? else {
                let import = frame.import;
                if self.frames.len() == 1 {
                    return Ok(Next::End);
                }
                self.frames.pop();
                if import {
                    return Ok(Next::ImportEnd);
                }
                continue;
            };
            frame.at = token.end;
            let span = token.span(&frame.source);
            let text = String::from_utf8_lossy(token.bytes(&frame.source)).into_owned();
            if token.kind == TokenKind::Word {
                return Ok(Next::Directive(text, span));
            }
            let text = shorten(&text);
            let error = SceneError::new(ErrorKind::Syntax, format!("expected a directive, found `{text}`"));
            return Err(error.at(&span));
        }
        Ok(Next::End)
    }

    /// The next token of the current file.
    fn peek(&self) -> Result<Option<(Token, &Arc<SourceFile>)>, SceneError> {
        let Some(frame) = self.frames.last() else { return Ok(None) };
        Ok(token_at(&frame.source, frame.at)?.map(|token| (token, &frame.source)))
    }

    fn advance(&mut self, token: Token) {
        if let Some(frame) = self.frames.last_mut() {
            frame.at = token.end;
        }
    }

    fn next(&mut self, wanted: &str, after: &Span) -> Result<(Token, Arc<SourceFile>), SceneError> {
        match self.peek()? {
            Some((token, source)) => {
                let source = source.clone();
                self.advance(token);
                Ok((token, source))
            }
            None => {
                let message = format!("expected {wanted}, found the end of the file");
                Err(SceneError::new(ErrorKind::Syntax, message).at(after))
            }
        }
    }

    /// A string, as after `Shape`.
    pub fn string(&mut self, after: &Span) -> Result<(String, Span), SceneError> {
        let (token, source) = self.next("a string", after)?;
        if token.kind != TokenKind::Str {
            return Err(unexpected("a string", token, &source));
        }
        Ok((unquote(token.bytes(&source)), token.span(&source)))
    }

    /// `N` numbers, with or without brackets around them.
    pub fn numbers<const N: usize>(&mut self, after: &Span) -> Result<[f64; N], SceneError> {
        let wanted = if N == 1 { "a number".to_owned() } else { format!("{N} numbers") };
        let bracketed = matches!(self.peek()?, Some((token, _)) if token.kind == TokenKind::Open);
        if bracketed {
            self.next(&wanted, after)?;
        }
        let mut values = [0.0; N];
        for value in &mut values {
            let (token, source) = self.next(&wanted, after)?;
            if token.kind != TokenKind::Word {
                return Err(unexpected(&wanted, token, &source));
            }
            *value = number(token, &source)?;
        }
        if bracketed {
            let (token, source) = self.next("`]`", after)?;
            if token.kind != TokenKind::Close {
                return Err(unexpected("`]`", token, &source));
            }
        }
        Ok(values)
    }

    /// A bare word, as after `ActiveTransform`.
    pub fn word(&mut self, wanted: &str, after: &Span) -> Result<(String, Span), SceneError> {
        let (token, source) = self.next(wanted, after)?;
        if token.kind != TokenKind::Word {
            return Err(unexpected(wanted, token, &source));
        }
        Ok((String::from_utf8_lossy(token.bytes(&source)).into_owned(), token.span(&source)))
    }

    /// Strings up to the next directive, skipped.
    pub fn strings_left(&mut self) -> Result<(), SceneError> {
        while let Some((token, _)) = self.peek()? {
            if token.kind != TokenKind::Str {
                break;
            }
            self.advance(token);
        }
        Ok(())
    }

    /// A parameter list: `"type name" value` any number of times.
    pub fn params(&mut self, after: &Span) -> Result<ParamList, SceneError> {
        let mut list = ParamList::default();
        while let Some((token, source)) = self.peek()? {
            if token.kind != TokenKind::Str {
                break;
            }
            let span = token.span(source);
            let declaration = unquote(token.bytes(source));
            self.advance(token);
            let param = self.param(&declaration, span)?;
            if let Some(earlier) = list.params.iter().find(|p| p.name == param.name && p.ty == param.ty) {
                let (line, _) = earlier.span.line_column();
                let message = format!("`{}` is already given in line {line}", param.name);
                return Err(SceneError::new(ErrorKind::Value, message).at(&param.span));
            }
            list.params.push(Rc::new(param));
            let count = list.params.len() as u64;
            if count > self.options.max_params {
                return Err(self.options.exceeded("max_params", self.options.max_params, count).at(after));
            }
        }
        Ok(list)
    }

    fn param(&mut self, declaration: &str, span: Span) -> Result<Param, SceneError> {
        let mut words = declaration.split_ascii_whitespace();
        let (Some(ty), Some(name), None) = (words.next(), words.next(), words.next()) else {
            let message = format!("`{}` is not a parameter", shorten(declaration));
            return Err(SceneError::new(ErrorKind::Syntax, message)
                .at(&span)
                .help("a parameter is written \"type name\" [ values ]"));
        };
        let Some(ty) = ParamType::parse(ty) else {
            let error =
                SceneError::new(ErrorKind::Unknown, format!("there is no parameter type `{}`", shorten(ty)));
            return Err(error.at(&span).maybe_help(ParamType::suggest(ty)));
        };
        let (first, source) = self.next("a value", &span)?;
        let values_start = first.start;
        let mut values = Values::empty(ty);
        if first.kind == TokenKind::Open {
            loop {
                let (token, source) = self.next("`]`", &span)?;
                match token.kind {
                    TokenKind::Close => break,
                    TokenKind::Open => return Err(unexpected("a value or `]`", token, &source)),
                    _ => values.push(ty, name, token, &source)?,
                }
                let count = values.len() as u64;
                if count > self.options.max_values {
                    return Err(self
                        .options
                        .exceeded("max_values", self.options.max_values, count)
                        .at(&span));
                }
            }
        } else if first.kind == TokenKind::Close {
            return Err(unexpected("a value", first, &source));
        } else {
            values.push(ty, name, first, &source)?;
        }
        Ok(Param { name: name.to_owned(), ty, values, span, values_start, used: false.into() })
    }
}

/// A finite number.
pub(super) fn number(token: Token, source: &Arc<SourceFile>) -> Result<f64, SceneError> {
    let value = std::str::from_utf8(token.bytes(source)).ok().and_then(|text| text.parse::<f64>().ok());
    match value {
        Some(value) if value.is_finite() && value.abs() <= f64::from(f32::MAX) => Ok(value),
        Some(value) => {
            let what = if value.is_nan() { "is not a number (NaN)" } else { "is too large or infinite" };
            let text = shorten(&String::from_utf8_lossy(token.bytes(source)));
            let error = SceneError::new(ErrorKind::Value, format!("`{text}` {what}"));
            Err(error.at(&token.span(source)))
        }
        None => Err(unexpected("a number", token, source)),
    }
}

/// The error for a token of the wrong kind.
pub(super) fn unexpected(wanted: &str, token: Token, source: &Arc<SourceFile>) -> SceneError {
    let text = shorten(&String::from_utf8_lossy(token.bytes(source)));
    SceneError::new(ErrorKind::Syntax, format!("expected {wanted}, found `{text}`")).at(&token.span(source))
}

/// A text short enough for a message.
pub(super) fn shorten(text: &str) -> String {
    let clean = text.chars().map(|c| if c.is_control() { ' ' } else { c });
    let mut short: String = clean.take(40).collect();
    if text.chars().nth(40).is_some() {
        short.push_str("...");
    }
    short
}
