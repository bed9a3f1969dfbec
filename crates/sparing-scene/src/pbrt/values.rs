//! Types and values of parameters.

use super::parser::{number, unexpected};
use super::tokenizer::{Token, TokenKind, unquote};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::SourceFile;
use std::sync::Arc;

/// The declared type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ParamType {
    Integer,
    Float,
    Point2,
    Point3,
    Normal,
    Rgb,
    Xyz,
    Blackbody,
    Spectrum,
    Bool,
    String,
    Texture,
}

const TYPES: &[(&str, ParamType)] = &[
    ("integer", ParamType::Integer),
    ("float", ParamType::Float),
    ("point2", ParamType::Point2),
    ("vector2", ParamType::Point2),
    ("point3", ParamType::Point3),
    ("point", ParamType::Point3),
    ("vector3", ParamType::Point3),
    ("vector", ParamType::Point3),
    ("normal", ParamType::Normal),
    ("normal3", ParamType::Normal),
    ("rgb", ParamType::Rgb),
    ("color", ParamType::Rgb),
    ("xyz", ParamType::Xyz),
    ("blackbody", ParamType::Blackbody),
    ("spectrum", ParamType::Spectrum),
    ("bool", ParamType::Bool),
    ("string", ParamType::String),
    ("texture", ParamType::Texture),
];

impl ParamType {
    pub fn parse(name: &str) -> Option<Self> {
        TYPES.iter().find(|(known, _)| *known == name).map(|(_, ty)| *ty)
    }

    pub fn suggest(name: &str) -> Option<String> {
        did_you_mean(name, TYPES.iter().map(|(known, _)| *known))
    }

    pub fn name(self) -> &'static str {
        TYPES.iter().find(|(_, ty)| *ty == self).map_or("", |(name, _)| name)
    }
}

/// The values of a parameter.
#[derive(Clone, Debug)]
pub(super) enum Values {
    Floats(Vec<f32>),
    /// Points, vectors and normals, as meshes have them, with up to two numbers of the next one.
    Triples(Vec<[f32; 3]>, Vec<f32>),
    Integers(Vec<i32>),
    Bools(Vec<bool>),
    Strings(Vec<String>),
}

impl Values {
    pub fn empty(ty: ParamType) -> Self {
        match ty {
            ParamType::Integer => Self::Integers(Vec::new()),
            ParamType::Bool => Self::Bools(Vec::new()),
            ParamType::Point3 | ParamType::Normal => Self::Triples(Vec::new(), Vec::new()),
            ParamType::String | ParamType::Texture => Self::Strings(Vec::new()),
            _ => Self::Floats(Vec::new()),
        }
    }

    pub fn len(&self) -> usize {
        match self {
            Self::Floats(v) => v.len(),
            Self::Triples(whole, rest) => 3 * whole.len() + rest.len(),
            Self::Integers(v) => v.len(),
            Self::Bools(v) => v.len(),
            Self::Strings(v) => v.len(),
        }
    }

    /// Adds the value of a token, which must fit the type.
    pub fn push(
        &mut self,
        ty: ParamType,
        name: &str,
        token: Token,
        source: &Arc<SourceFile>,
    ) -> Result<(), SceneError> {
        // A named spectrum or a spectrum file: strings instead of numbers.
        if ty == ParamType::Spectrum && token.kind == TokenKind::Str && self.len() == 0 {
            *self = Self::Strings(Vec::new());
        }
        let wrong = |wanted: &str| {
            let wanted = format!("{wanted} for `{} {name}`", ty.name());
            Err(unexpected(&wanted, token, source))
        };
        match (self, token.kind) {
            (Self::Strings(values), TokenKind::Str) => values.push(unquote(token.bytes(source))),
            (Self::Strings(_), _) => return wrong("a string"),
            (Self::Bools(values), kind) => {
                let text = token.bytes(source);
                let text =
                    if kind == TokenKind::Str { unquote(text) } else { String::from_utf8_lossy(text).into() };
                match text.as_str() {
                    "true" => values.push(true),
                    "false" => values.push(false),
                    _ => return wrong("true or false"),
                }
            }
            (_, TokenKind::Str) => return wrong("a number"),
            (Self::Floats(values), _) => {
                if token.bytes(source).first().is_some_and(u8::is_ascii_alphabetic)
                    && number(token, source).is_err_and(|e| e.kind() == ErrorKind::Syntax)
                {
                    return wrong("a number");
                }
                // The limit of `number` is that of f32, so this does not overflow.
                values.push(number(token, source)? as f32);
            }
            (Self::Triples(whole, rest), _) => {
                rest.push(number(token, source)? as f32);
                if let [x, y, z] = rest[..] {
                    whole.push([x, y, z]);
                    rest.clear();
                }
            }
            (Self::Integers(values), _) => {
                let text = std::str::from_utf8(token.bytes(source)).unwrap_or_default();
                match text.parse::<i32>() {
                    Ok(value) => values.push(value),
                    Err(_) => {
                        let value = number(token, source)?;
                        if value.fract() != 0.0 || value.abs() > f64::from(i32::MAX) {
                            return wrong("an integer of 32 bits");
                        }
                        values.push(value as i32);
                    }
                }
            }
        }
        Ok(())
    }
}
