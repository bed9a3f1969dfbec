//! Parameter lists: `"float radius" 2`, `"point3 P" [ 0 0 0 ... ]`.
//!
//! Every getter marks its parameter as used; what nobody asked for becomes a warning at the end.

use super::tokenizer::{TokenKind, token_at};
pub(super) use super::values::{ParamType, Values};
use crate::error::{ErrorKind, SceneError};
use crate::source::Span;
use crate::warnings::Warnings;
use glam::{DVec3, Vec3};
use std::cell::Cell;
use std::rc::Rc;

/// One parameter.
#[derive(Clone, Debug)]
pub(super) struct Param {
    pub name: String,
    pub ty: ParamType,
    pub values: Values,
    /// Its declaration.
    pub span: Span,
    /// Byte at which its values start.
    pub values_start: usize,
    pub used: Cell<bool>,
}

impl Param {
    /// The place of value number `index`, found by reading the text again.
    pub fn value_span(&self, index: usize) -> Span {
        let source = &self.span.source;
        let mut at = self.values_start;
        let mut count = 0;
        while let Ok(Some(token)) = token_at(source, at) {
            at = token.end;
            match token.kind {
                TokenKind::Open => {}
                TokenKind::Close => break,
                _ if count == index => return token.span(source),
                _ => count += 1,
            }
        }
        self.span.clone()
    }

    /// An error at this parameter.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        SceneError::new(ErrorKind::Value, message).at(&self.span)
    }

    /// An error at one of its values.
    pub fn value_error(&self, index: usize, message: impl Into<String>) -> SceneError {
        SceneError::new(ErrorKind::Value, message).at(&self.value_span(index))
    }

    /// The numbers, which must be a multiple of `group`.
    pub fn floats(&self, group: usize) -> Result<&[f32], SceneError> {
        match &self.values {
            Values::Floats(values) if values.len() % group == 0 => Ok(values),
            Values::Triples(whole, rest) if rest.is_empty() && 3 * whole.len() % group == 0 => {
                Ok(whole.as_flattened())
            }
            Values::Floats(_) | Values::Triples(..) => Err(self.error(format!(
                "`{}` has {} values, which is not a multiple of {group}",
                self.name,
                self.values.len()
            ))),
            _ => Err(self.error(format!("`{}` should be numbers", self.name))),
        }
    }
}

/// The parameters of a directive.
#[derive(Clone, Debug, Default)]
pub(super) struct ParamList {
    pub params: Vec<Rc<Param>>,
}

impl ParamList {
    /// The parameter of that name, whatever its type.
    pub fn get(&self, name: &str) -> Option<&Param> {
        let param = self.params.iter().find(|param| param.name == name)?;
        param.used.set(true);
        Some(param)
    }

    fn typed(&self, name: &str, types: &[ParamType]) -> Result<Option<&Param>, SceneError> {
        match self.get(name) {
            Some(param) if !types.contains(&param.ty) => {
                let wanted: Vec<_> = types.iter().map(|ty| ty.name()).collect();
                let (wanted, found) = (wanted.join(" or "), param.ty.name());
                Err(param.error(format!("`{name}` should be of type {wanted}, not {found}")))
            }
            other => Ok(other),
        }
    }

    /// The one value of a parameter.
    fn one<'a, T>(param: &'a Param, values: &'a [T]) -> Result<&'a T, SceneError> {
        match values {
            [value] => Ok(value),
            _ => Err(param.error(format!("`{}` takes one value, not {}", param.name, values.len()))),
        }
    }

    pub fn float(&self, name: &str) -> Result<Option<f32>, SceneError> {
        match self.typed(name, &[ParamType::Float, ParamType::Integer])? {
            None => Ok(None),
            Some(param) => match &param.values {
                Values::Floats(values) => Self::one(param, values).copied().map(Some),
                Values::Integers(values) => Self::one(param, values).map(|&v| Some(v as f32)),
                _ => Ok(None),
            },
        }
    }

    /// A float that must satisfy a condition, which `rule` says in words.
    pub fn float_where(
        &self,
        name: &str,
        default: f32,
        rule: &str,
        holds: impl Fn(f32) -> bool,
    ) -> Result<f32, SceneError> {
        match self.float(name)? {
            None => Ok(default),
            Some(value) if holds(value) => Ok(value),
            Some(value) => match self.get(name) {
                Some(param) => Err(param.value_error(0, format!("`{name}` must be {rule}, not {value}"))),
                None => Ok(default),
            },
        }
    }

    pub fn integer(&self, name: &str) -> Result<Option<i32>, SceneError> {
        match self.typed(name, &[ParamType::Integer])? {
            None => Ok(None),
            Some(param) => match &param.values {
                Values::Integers(values) => Self::one(param, values).copied().map(Some),
                _ => Ok(None),
            },
        }
    }

    /// An integer within bounds.
    pub fn integer_in(
        &self,
        name: &str,
        range: std::ops::RangeInclusive<i32>,
    ) -> Result<Option<i32>, SceneError> {
        let Some(value) = self.integer(name)? else { return Ok(None) };
        match self.get(name) {
            Some(param) if !range.contains(&value) => {
                let (low, high) = (range.start(), range.end());
                Err(param.value_error(0, format!("`{name}` must be from {low} to {high}, not {value}")))
            }
            _ => Ok(Some(value)),
        }
    }

    pub fn integers(&self, name: &str) -> Result<Option<(&Param, &[i32])>, SceneError> {
        Ok(self.typed(name, &[ParamType::Integer])?.and_then(|param| match &param.values {
            Values::Integers(values) => Some((param, values.as_slice())),
            _ => None,
        }))
    }

    pub fn bool(&self, name: &str) -> Result<Option<bool>, SceneError> {
        match self.typed(name, &[ParamType::Bool])? {
            None => Ok(None),
            Some(param) => match &param.values {
                Values::Bools(values) => Self::one(param, values).copied().map(Some),
                _ => Ok(None),
            },
        }
    }

    pub fn string(&self, name: &str) -> Result<Option<(&str, &Param)>, SceneError> {
        match self.typed(name, &[ParamType::String])? {
            None => Ok(None),
            Some(param) => Ok(Some((Self::one(param, param.strings())?.as_str(), param))),
        }
    }

    /// One point or vector.
    pub fn point3(&self, name: &str) -> Result<Option<DVec3>, SceneError> {
        let Some(param) = self.typed(name, &[ParamType::Point3, ParamType::Normal])? else { return Ok(None) };
        match *param.floats(3)? {
            [x, y, z] => Ok(Some(Vec3::new(x, y, z).as_dvec3())),
            ref other => {
                Err(param.error(format!("`{name}` takes one point of 3 numbers, not {}", other.len())))
            }
        }
    }

    /// Numbers in groups: points, normals, texture coordinates.
    pub fn groups(
        &self,
        name: &str,
        types: &[ParamType],
        group: usize,
    ) -> Result<Option<(&Param, &[f32])>, SceneError> {
        match self.typed(name, types)? {
            None => Ok(None),
            Some(param) => Ok(Some((param, param.floats(group)?))),
        }
    }

    /// The points that [`Self::groups`] has found in a parameter, moved out of it: a mesh has no second copy of its vertices.
    pub fn take_points(&mut self, name: &str) -> Vec<[f32; 3]> {
        let Some(param) = self.params.iter_mut().find(|param| param.name == name) else { return Vec::new() };
        let mut points = match Rc::get_mut(param).map(|param| &mut param.values) {
            Some(Values::Triples(whole, _)) => std::mem::take(whole),
            // A default given by `Attribute` is needed again.
            _ => match &param.values {
                Values::Triples(whole, _) => whole.clone(),
                _ => Vec::new(),
            },
        };
        points.shrink_to_fit();
        points
    }

    /// Adds parameters given by `Attribute` for those that are not in this list.
    pub fn add_defaults(&mut self, defaults: &[Rc<Param>]) {
        for default in defaults {
            if !self.params.iter().any(|param| param.name == default.name) {
                let param = default.clone();
                param.used.set(true);
                self.params.push(param);
            }
        }
    }

    /// Warns about parameters that nobody asked for.
    pub fn warn_unused(&self, of: &str, warnings: &mut Warnings) {
        for param in self.params.iter().filter(|param| !param.used.get()) {
            warnings.at(&param.span, format!("parameter `{}` of {of} is not known and ignored", param.name));
        }
    }

    /// Marks parameters as used that make no difference here.
    pub fn ignore(&self, names: &[&str]) {
        for name in names {
            self.get(name);
        }
    }
}

impl Param {
    /// The strings of a string-like parameter.
    pub fn strings(&self) -> &[String] {
        match &self.values {
            Values::Strings(values) => values,
            _ => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::SourceFile;

    #[test]
    fn points_are_moved_out_unless_others_have_them() {
        let points = vec![[1.0, 2.0, 3.0]; 5];
        let at = points.as_ptr();
        let param = Rc::new(Param {
            name: "P".to_owned(),
            ty: ParamType::Point3,
            values: Values::Triples(points, Vec::new()),
            span: SourceFile::line("text", 1, b""),
            values_start: 0,
            used: Cell::new(false),
        });
        let mut list = ParamList { params: vec![param.clone()] };
        let copy = list.take_points("P");
        assert!(copy == [[1.0, 2.0, 3.0]; 5] && copy.as_ptr() != at);
        drop(param);
        assert_eq!(list.groups("P", &[ParamType::Point3], 3).unwrap().unwrap().1.len(), 15);
        let taken = list.take_points("P");
        assert!(taken == copy && taken.as_ptr() == at, "the same memory");
    }
}
