//! Lights that are not shapes.

use super::ImageId;
use glam::{Mat3, Vec3};

/// A light that no ray can hit, or one infinitely far away. Emitting shapes carry a [`super::Emission`].
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Isotropic point light.
    Point {
        /// World position.
        position: Vec3,
        /// Radiant intensity, W/sr.
        intensity: Vec3,
    },
    /// Cone with a smooth edge.
    Spot {
        /// World position.
        position: Vec3,
        /// Unit axis, away from the light.
        direction: Vec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Vec3,
        /// Half-angle in degrees at which the light ends.
        cone_angle: f32,
        /// Degrees before `cone_angle` at which the fall-off starts.
        cone_delta: f32,
    },
    /// Parallel light.
    Distant {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light, W/m².
        irradiance: Vec3,
    },
    /// Light from every direction.
    Environment {
        /// Radiance, or a factor on the image.
        radiance: Vec3,
        /// Latitude-longitude picture twice as wide as high, or a square equal-area octahedral one.
        image: Option<ImageId>,
        /// From light space (z up, as in pbrt) to world space, orthonormal but possibly mirrored.
        light_to_world: Mat3,
    },
}
