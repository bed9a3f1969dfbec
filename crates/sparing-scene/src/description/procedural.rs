//! Functions that textures are made of.

use super::{ColorInput, FloatInput, Texture};
use glam::Vec3;

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScalarFunction {
    /// pbrt-v3's roughness in 0..1 to GGX alpha: a polynomial of fourth degree in the logarithm.
    RoughnessPolynomial,
    /// pbrt-v2's roughness, the inverse of a Blinn exponent, to GGX alpha.
    BlinnRoughness,
    /// 1 - x, within 0..1.
    Complement,
}

impl ScalarFunction {
    /// The value.
    #[must_use]
    pub fn apply(self, x: f32) -> f32 {
        match self {
            // "Physically Based Rendering", 3rd edition, section 8.4.2: a fit in x = ln roughness, from 0.001 on.
            Self::RoughnessPolynomial => {
                let x = x.max(1e-3).ln();
                let coefficients = [0.000_640_711, 0.017_120_1, 0.1734, 0.819_955, 1.621_42];
                coefficients.into_iter().fold(0.0, |sum, c| sum * x + c)
            }
            // B. Walter et al. 2007, section 5.1: a Phong (here Blinn) exponent e matches alpha² = 2 / (e + 2).
            // Exponents end at 10000, as in pbrt-v2.
            Self::BlinnRoughness => {
                let exponent = (1.0 / x.max(0.0)).min(10_000.0);
                (2.0 / (exponent + 2.0)).sqrt()
            }
            Self::Complement => (1.0 - x).clamp(0.0, 1.0),
        }
    }
}

/// Texture coordinates from a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// u is the angle from z over pi, v the one about z over 2 pi.
    Spherical,
    /// u is the angle about z, from 0 at -x; v is z.
    Cylindrical {
        /// Whether v is z over the distance from the origin (pbrt before v4).
        normalize: bool,
    },
    /// Dot products with two vectors, plus offsets.
    Planar {
        /// For u.
        u: Vec3,
        /// For v.
        v: Vec3,
        /// Added.
        offset: [f32; 2],
    },
}

/// Functions of the position made of Perlin noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Sum of octaves, each `roughness` times the one before and 1.99 times as fine.
    Fbm {
        /// How many.
        octaves: u32,
        /// Ratio of amplitudes.
        roughness: f32,
    },
    /// The same of absolute values.
    Wrinkled {
        /// How many.
        octaves: u32,
        /// Ratio of amplitudes.
        roughness: f32,
    },
    /// Waves on water, higher in gusts.
    Windy,
    /// Veins of marble.
    Marble {
        /// Octaves of the noise that bends the layers.
        octaves: u32,
        /// Ratio of their amplitudes.
        roughness: f32,
        /// Layers per unit of length, over 2 pi.
        scale: f32,
        /// How much they bend.
        variation: f32,
    },
}

impl Noise {
    /// Octaves that one look-up sums.
    #[must_use]
    pub fn octaves(self) -> u32 {
        match self {
            Self::Fbm { octaves, .. } | Self::Wrinkled { octaves, .. } | Self::Marble { octaves, .. } => {
                octaves
            }
            Self::Windy => 9,
        }
    }
}

impl Texture {
    /// The inputs that are textures or colours.
    #[must_use]
    pub fn inputs(&self) -> Vec<ColorInput> {
        let float = |input: FloatInput| match input {
            FloatInput::Constant(value) => ColorInput::Constant(Vec3::splat(value)),
            FloatInput::Texture(id) => ColorInput::Texture(id),
        };
        match *self {
            Self::Constant(_)
            | Self::Image { .. }
            | Self::Noise { .. }
            | Self::Bilinear { .. }
            | Self::Coordinates { .. } => vec![],
            Self::Checkerboard { even: a, odd: b, .. }
            | Self::Cubes { even: a, odd: b, .. }
            | Self::Dots { inside: a, outside: b, .. }
            | Self::DirectionMix { a, b, .. }
            | Self::Scale { a, b } => vec![a, b],
            Self::Mix { a, b, amount } => vec![a, b, float(amount)],
            Self::Function { input, .. } => vec![float(input)],
            Self::Projected { input, .. } | Self::SecondUv { input } => vec![input],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values worked out by hand from the polynomial: at roughness 1 the logarithm is 0; at 0.1 it is -2.302585.
    #[test]
    fn old_roughness_becomes_alpha() {
        let v3 = |r: f32| ScalarFunction::RoughnessPolynomial.apply(r);
        assert!((v3(1.0) - 1.62142).abs() < 1e-5);
        assert!((v3(0.1) - 0.461_76).abs() < 1e-4, "{}", v3(0.1));
        assert_eq!(v3(0.0), v3(1e-3));
        // Exponent 10: sqrt(2 / 12).
        assert!((ScalarFunction::BlinnRoughness.apply(0.1) - 0.408_248).abs() < 1e-6);
        assert!((ScalarFunction::BlinnRoughness.apply(0.0) - (2f32 / 10_002.0).sqrt()).abs() < 1e-7);
    }
}
