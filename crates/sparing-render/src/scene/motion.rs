//! Transformations while the shutter is open.

use super::Placement;
use glam::{Affine3A, Mat3A};

/// A transformation that moves: even steps from the opening of the shutter to its closing, straight in between, as
/// Embree has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    steps: Vec<Affine3A>,
}

impl Way {
    /// A way through at least two steps; `None` if there are fewer.
    #[must_use]
    pub fn new(steps: Vec<Affine3A>) -> Option<Self> {
        (steps.len() > 1).then_some(Self { steps })
    }

    /// The transformation at a time in 0..=1 of the shutter.
    #[inline]
    #[must_use]
    pub fn at(&self, time: f32) -> Affine3A {
        let segments = self.steps.len() - 1;
        let scaled = time * segments as f32;
        let first = (scaled as usize).min(segments - 1);
        let t = scaled - first as f32;
        let (a, b) = (&self.steps[first], &self.steps[first + 1]);
        let mix = |a: glam::Vec3A, b: glam::Vec3A| a * (1.0 - t) + b * t;
        let (m, n) = (&a.matrix3, &b.matrix3);
        Affine3A {
            matrix3: Mat3A::from_cols(
                mix(m.x_axis, n.x_axis),
                mix(m.y_axis, n.y_axis),
                mix(m.z_axis, n.z_axis),
            ),
            translation: mix(a.translation, b.translation),
        }
    }
}

impl Placement {
    /// By a transformation.
    #[inline]
    #[must_use]
    pub fn new(object_to_world: Affine3A) -> Self {
        let m = object_to_world.matrix3;
        let handedness = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        // Cofactors: right up to a factor even where the inverse overflows or does not exist.
        let normal_to_world =
            Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
                * handedness;
        Self {
            object_to_world,
            world_to_object: object_to_world.inverse(),
            normal_to_world,
            handedness,
            magnitude: glam::Vec3::from(object_to_world.translation).abs().max_element(),
        }
    }
}
