//! Where shapes and objects are placed, at rest or moving.

use super::Builder;
use super::graphics_state::invert;
use super::params::ParamList;
use super::parser::shorten;
use crate::description::{Instance, Motion, ObjectDefinition};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;
use glam::{Affine3A, DMat4};

/// A shape that moves along with the object it is part of.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingPart {
    /// The shape, an object of its own.
    object: u32,
    /// Its way in the space of the larger object.
    ends: [DMat4; 2],
}

impl Builder<'_> {
    /// A shape where the current transformation is; if that moves, as an object in its own space with an instance.
    pub(super) fn shape_at_rest_or_moving(
        &mut self,
        ty: &str,
        at: &Span,
        params: ParamList,
    ) -> Result<(), SceneError> {
        let Some(end) = self.state.end() else { return self.shape(ty, at, params) };
        let start = self.state.ctm;
        self.check_ends([start, end], at)?;
        let object = self.scene.objects.len() as u32;
        self.count_entity()?;
        self.scene.objects.push(ObjectDefinition { name: format!("moving {ty}"), shapes: Vec::new() });
        let whole = self.object.replace(object);
        self.moving = whole.is_none().then_some(start);
        (self.state.ctm, self.state.ctm_end) = (DMat4::IDENTITY, DMat4::IDENTITY);
        let made = self.shape(ty, at, params);
        (self.state.ctm, self.state.ctm_end) = (start, end);
        self.moving = None;
        self.object = whole;
        made?;
        match whole {
            Some(whole) => {
                let part = MovingPart { object, ends: [start, end] };
                self.moving_parts.entry(whole).or_default().push(part);
                Ok(())
            }
            None => self.place(object, [start, end], at),
        }
    }

    /// `ObjectInstance`.
    pub(super) fn instance(&mut self, name: &str, at: &Span) -> Result<(), SceneError> {
        let Some(&object) = self.objects.get(name) else {
            let error =
                SceneError::new(ErrorKind::Unknown, format!("there is no object `{}`", shorten(name)));
            let known = self.objects.keys().map(String::as_str);
            return Err(error.at(at).maybe_help(did_you_mean(name, known)));
        };
        if self.object.is_some() {
            let message = "an instance inside an object definition is not supported";
            return Err(SceneError::new(ErrorKind::Unsupported, message).at(at));
        }
        let ends = [self.state.ctm, self.state.ctm_end];
        self.place(object, ends, at)?;
        for part in self.moving_parts.get(&object).cloned().unwrap_or_default() {
            self.place(part.object, [ends[0] * part.ends[0], ends[1] * part.ends[1]], at)?;
        }
        Ok(())
    }

    fn place(&mut self, object: u32, ends: [DMat4; 2], at: &Span) -> Result<(), SceneError> {
        self.check_ends(ends, at)?;
        self.count_entity()?;
        let [object_to_world, end] = ends.map(|m| Affine3A::from_mat4(m.as_mat4()));
        let moves = ends[0] != ends[1];
        if moves && Motion::new(object_to_world, end).is_none() {
            return Err(squashed(at));
        }
        self.scene.instances.push(Instance { object, object_to_world, end: moves.then_some(end) });
        Ok(())
    }

    fn check_ends(&self, ends: [DMat4; 2], at: &Span) -> Result<(), SceneError> {
        if ends.iter().any(|m| invert(*m).is_none()) { Err(squashed(at)) } else { Ok(()) }
    }
}

fn squashed(at: &Span) -> SceneError {
    SceneError::new(ErrorKind::Value, "the current transformation squashes space").at(at)
}
