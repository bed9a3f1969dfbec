//! The state that directives change and blocks save: transform, material, light of shapes, attributes.

use super::colorspace::ColorSpace;
use super::params::Param;
use crate::description::MaterialId;
use crate::source::Span;
use glam::{DMat4, DVec3};
use std::rc::Rc;

/// An `AreaLightSource` waiting for its shapes.
#[derive(Clone, Debug)]
pub(super) struct AreaLight {
    /// Radiance with `scale`, before `power`.
    pub radiance: glam::Vec3,
    /// A texture in place of that: an own extension.
    pub texture: Option<crate::description::ColorInput>,
    /// Total power in W that the shape must emit, if asked for.
    pub power: Option<f32>,
    pub two_sided: bool,
    pub span: Span,
}

/// What `ActiveTransform` says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Active {
    #[default]
    All,
    StartTime,
    EndTime,
}

/// What `AttributeBegin` saves.
#[derive(Clone, Debug, Default)]
pub(super) struct GraphicsState {
    /// Current transformation matrix: object to world. Where it moves, at the start.
    pub ctm: DMat4,
    /// The same at the end.
    pub ctm_end: DMat4,
    /// Which of the two directives change.
    pub active: Active,
    pub reverse_orientation: bool,
    pub material: Option<MaterialId>,
    pub area_light: Option<AreaLight>,
    pub color_space: ColorSpace,
    /// Defaults set by `Attribute "shape"` and so on.
    pub shape_defaults: Vec<Rc<Param>>,
    pub light_defaults: Vec<Rc<Param>>,
    pub material_defaults: Vec<Rc<Param>>,
    pub texture_defaults: Vec<Rc<Param>>,
}

impl GraphicsState {
    /// Appends a transformation: it acts on points before those already there.
    pub fn concat(&mut self, transform: DMat4) {
        self.change(|matrix| matrix * transform);
    }

    /// Replaces the current transformation.
    pub fn set(&mut self, transform: DMat4) {
        self.change(|_| transform);
    }

    fn change(&mut self, to: impl Fn(DMat4) -> DMat4) {
        if self.active != Active::EndTime {
            self.ctm = to(self.ctm);
        }
        if self.active != Active::StartTime {
            self.ctm_end = to(self.ctm_end);
        }
    }

    /// The transformation at the end, if it moves.
    pub fn end(&self) -> Option<DMat4> {
        (self.ctm != self.ctm_end).then_some(self.ctm_end)
    }
}

/// Rotation by `degrees` about an axis, as `Rotate` has it (counter-clockwise seen against the axis in a
/// right-handed system).
pub(super) fn rotate(degrees: f64, axis: DVec3) -> Option<DMat4> {
    Some(DMat4::from_axis_angle(axis.try_normalize()?, degrees.to_radians()))
}

/// World to camera for a left-handed camera space: x right, y up, z towards the target.
/// Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th edition, section 3.9.6.
pub(super) fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<DMat4> {
    let forward = (target - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(forward).try_normalize()?;
    let camera_up = forward.cross(right);
    let camera_to_world =
        DMat4::from_cols(right.extend(0.0), camera_up.extend(0.0), forward.extend(0.0), eye.extend(1.0));
    Some(camera_to_world.inverse())
}

/// The inverse, unless the matrix squashes space or is not finite.
pub(super) fn invert(m: DMat4) -> Option<DMat4> {
    let scale = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    let inverse = m.inverse();
    let regular = m.determinant().abs() > 1e-12 * scale && inverse.is_finite() && m.is_finite();
    regular.then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn look_at_is_left_handed() {
        // Looking along +z with y up: x must be to the right, which is left-handed.
        let m = look_at(DVec3::ZERO, DVec3::Z, DVec3::Y).unwrap();
        assert!(m.abs_diff_eq(DMat4::IDENTITY, 1e-12));
        // From (0, 0, 5) towards the origin a point at +x appears on the left.
        let m = look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y).unwrap();
        assert!(m.transform_point3(DVec3::X).abs_diff_eq(DVec3::new(-1.0, 0.0, 5.0), 1e-12));
        assert!(look_at(DVec3::ZERO, DVec3::ZERO, DVec3::Y).is_none());
        assert!(look_at(DVec3::ZERO, DVec3::Y, DVec3::Y).is_none());
    }

    #[test]
    fn rotations_turn_x_to_y() {
        let m = rotate(90.0, DVec3::new(0.0, 0.0, 3.0)).unwrap();
        assert!(m.transform_vector3(DVec3::X).abs_diff_eq(DVec3::Y, 1e-12));
    }

    #[test]
    fn later_transforms_act_first() {
        let mut state = GraphicsState::default();
        state.concat(DMat4::from_translation(DVec3::X));
        state.concat(DMat4::from_scale(DVec3::splat(2.0)));
        assert_eq!(state.ctm.transform_point3(DVec3::X), DVec3::new(3.0, 0.0, 0.0));
    }

    #[test]
    fn flat_matrices_have_no_inverse() {
        assert!(invert(DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0))).is_none());
        assert!(invert(DMat4::from_scale(DVec3::splat(1e-9))).is_some());
    }
}
