//! Textures and the inputs that they feed.

use super::procedural::{Noise, Projection, ScalarFunction};
use super::{ImageId, TextureId};
use glam::{Affine3A, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

/// A colour parameter: linear Rec.709.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColorInput {
    /// The same everywhere.
    Constant(Vec3),
    /// Looked up by the surface's texture coordinates.
    Texture(TextureId),
}

/// A scalar parameter. From a colour texture: the mean of the channels; from a picture with alpha used for
/// opacity: see [`TextureEncoding::Alpha`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FloatInput {
    /// The same everywhere.
    Constant(f32),
    /// Looked up by the surface's texture coordinates.
    Texture(TextureId),
}

/// How a picture repeats outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Continues the border.
    Clamp,
    /// Zero outside.
    Black,
    /// Tiles, every second one mirrored.
    Mirror,
}

/// What the numbers of a picture mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TextureEncoding {
    /// sRGB for 8-bit pictures, linear for floating-point ones.
    #[default]
    Auto,
    /// sRGB transfer function.
    Srgb,
    /// Linear.
    Linear,
    /// Power law: linear = value^gamma.
    Gamma(f32),
    /// Linear, and the value is the alpha channel (or the mean of RGB where there is none).
    Alpha,
    /// Linear, and the value is the red channel.
    Red,
    /// Linear, and the value is the green channel.
    Green,
    /// Linear, and the value is the blue channel.
    Blue,
}

/// A picture that textures or lights use; decoded by the renderer, once.
#[derive(Clone, Debug)]
pub struct Image {
    /// Where it is.
    pub source: ImageSource,
    /// What its numbers mean.
    pub encoding: TextureEncoding,
}

/// Where a picture is.
#[derive(Clone, Debug)]
pub enum ImageSource {
    /// A file (PNG, JPEG, HDR, EXR), path resolved.
    File(PathBuf),
    /// Encoded bytes embedded in the scene.
    Bytes {
        /// Name for messages.
        name: String,
        /// The encoded picture.
        bytes: Arc<[u8]>,
    },
}

/// `u' = scale[0] u + cross[0] v + offset[0]` and `v' = cross[1] u + scale[1] v + offset[1]`, applied to the surface's
/// texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMapping {
    /// Factors.
    pub scale: [f32; 2],
    /// Added after scaling.
    pub offset: [f32; 2],
    /// Factors of the other coordinate: rotations.
    pub cross: [f32; 2],
}

impl Default for UvMapping {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], cross: [0.0; 2] }
    }
}

/// A function of the texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// The same everywhere.
    Constant(Vec3),
    /// A picture, bilinear.
    Image {
        /// Which.
        image: ImageId,
        /// Coordinates.
        mapping: UvMapping,
        /// Outside 0..1, along u and along v.
        wrap: [Wrap; 2],
        /// Factor on the value.
        scale: f32,
        /// value -> 1 - value, before the factor.
        invert: bool,
    },
    /// Alternating unit squares.
    Checkerboard {
        /// Coordinates.
        mapping: UvMapping,
        /// Even squares.
        even: ColorInput,
        /// Odd squares.
        odd: ColorInput,
    },
    /// Product.
    Scale {
        /// Factor.
        a: ColorInput,
        /// Factor.
        b: ColorInput,
    },
    /// (1 - amount) a + amount b.
    Mix {
        /// At 0.
        a: ColorInput,
        /// At 1.
        b: ColorInput,
        /// Share of b.
        amount: FloatInput,
    },
    /// A number put through a function.
    Function {
        /// What goes in.
        input: FloatInput,
        /// The function.
        function: ScalarFunction,
    },
    /// A texture whose coordinates come from the position.
    Projected {
        /// How.
        projection: Projection,
        /// From world space to the space of the projection.
        from_world: Affine3A,
        /// What is looked up there.
        input: ColorInput,
    },
    /// Alternating unit cubes.
    Cubes {
        /// From world space to that of the cubes.
        from_world: Affine3A,
        /// Even cubes.
        even: ColorInput,
        /// Odd cubes.
        odd: ColorInput,
    },
    /// Round dots at random in half of the unit squares.
    Dots {
        /// Coordinates.
        mapping: UvMapping,
        /// In the dots.
        inside: ColorInput,
        /// Between them.
        outside: ColorInput,
    },
    /// A function of the position made of noise.
    Noise {
        /// From world space to that of the noise.
        from_world: Affine3A,
        /// Which function.
        noise: Noise,
    },
    /// By the angle between the normal and a direction: |cos| of the first, the rest of the second.
    DirectionMix {
        /// Unit direction in world space.
        direction: Vec3,
        /// Along the direction.
        a: ColorInput,
        /// Across it.
        b: ColorInput,
    },
    /// Bilinear between four corners of the unit square.
    Bilinear {
        /// Coordinates.
        mapping: UvMapping,
        /// At (0, 0), (0, 1), (1, 0), (1, 1).
        corners: [Vec3; 4],
    },
    /// A texture looked up by the second texture coordinates of the mesh; (0, 0) where it has none.
    SecondUv {
        /// What is looked up there.
        input: ColorInput,
    },
    /// The fractions of u and v as red and green.
    Coordinates {
        /// Coordinates.
        mapping: UvMapping,
    },
}
