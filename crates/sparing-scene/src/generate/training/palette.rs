//! Materials. The two splits share the scattering models, as all scenes do, but none of their parameters: hues
//! interleave, roughness comes from ranges that alternate, metals, glasses and kinds of texture differ.

use super::Split;
use super::pictures;
use super::random::Random;
use super::stage::Stage;
use crate::description::{
    ColorInput, Conductor, FloatInput, Image, MaterialId, MaterialKind, Roughness, Texture, UvMapping, Wrap,
};
use glam::Vec3;

impl Stage {
    /// A reflectance: a hue of this split's, more or less saturated.
    pub fn color(&self) -> Vec3 {
        let sixth = self.random.below(6) as f32;
        let inside = self.random.range(0.02, 0.48) + if self.split == Split::Training { 0.0 } else { 0.5 };
        let saturation = self.random.range(0.15, 0.75);
        Random::hue((sixth + inside) / 6.0, saturation) * self.random.range(0.35, 0.85)
    }

    /// A nearly grey reflectance between two values.
    pub fn grey(&self, from: f32, to: f32) -> Vec3 {
        let tint = self.color() * 0.12;
        (tint + 0.88) * self.random.range(from, to)
    }

    /// The colour of a lamp, of luminance about 1.
    pub fn warmth(&self) -> Vec3 {
        match self.split {
            Split::Training => {
                self.random.pick([Vec3::ONE, Vec3::new(1.25, 0.97, 0.6), Vec3::new(0.85, 1.0, 1.3)])
            }
            Split::Validation => self.random.pick([
                Vec3::new(1.1, 1.0, 0.85),
                Vec3::new(1.4, 0.92, 0.45),
                Vec3::new(0.75, 1.02, 1.5),
            ]),
        }
    }

    fn rough(&self, smooth: f32) -> Roughness {
        if self.random.chance(smooth) {
            return Roughness::SMOOTH;
        }
        let (low, high) = match self.split {
            Split::Training => self.random.pick([(0.03, 0.09), (0.2, 0.32)]),
            Split::Validation => self.random.pick([(0.1, 0.18), (0.35, 0.5)]),
        };
        let alpha = FloatInput::Constant(self.random.range(low, high));
        Roughness { u: alpha, v: alpha, remap: false }
    }

    pub fn matte(&mut self) -> MaterialId {
        let albedo = self.color();
        self.diffuse(albedo)
    }

    /// A pattern: checkerboards and noise for training; stripes, bricks and dots for validation.
    pub fn pattern(&mut self, repeat: f32) -> ColorInput {
        let (a, b) = (self.color(), self.grey(0.1, 0.8));
        let seed = self.random.bits() as u32;
        let image: Image = match (self.split, self.random.below(3)) {
            (Split::Training, 0 | 1) => {
                let mapping = UvMapping { scale: [repeat * 4.0; 2], ..UvMapping::default() };
                let (even, odd) = (ColorInput::Constant(a), ColorInput::Constant(b));
                return ColorInput::Texture(self.texture(Texture::Checkerboard { mapping, even, odd }));
            }
            (Split::Training, _) => pictures::noise(a, b, 3.0, seed),
            (Split::Validation, 0) => pictures::stripes(a, b, seed),
            (Split::Validation, 1) => pictures::bricks(a, b, seed),
            (Split::Validation, _) => pictures::dots(a, b, 0.32),
        };
        let image = self.image(image);
        let mapping = UvMapping { scale: [repeat; 2], ..UvMapping::default() };
        let wrap = Wrap::Repeat;
        ColorInput::Texture(self.texture(Texture::Image {
            image,
            mapping,
            wrap: [wrap; 2],
            scale: 1.0,
            invert: false,
        }))
    }

    /// A matte pattern.
    pub fn patterned(&mut self, repeat: f32) -> MaterialId {
        let reflectance = self.pattern(repeat);
        self.material("patterned", MaterialKind::Diffuse { reflectance })
    }

    pub fn metal(&mut self, smooth: f32) -> MaterialId {
        let reflectance = match self.split {
            // Copper, gold, aluminium; silver, brass, iron: reflectances at normal incidence.
            Split::Training => [[0.96, 0.64, 0.54], [1.0, 0.78, 0.34], [0.91, 0.92, 0.92]],
            Split::Validation => [[0.97, 0.96, 0.91], [0.89, 0.79, 0.43], [0.56, 0.57, 0.58]],
        };
        let conductor =
            Conductor::Reflectance(ColorInput::Constant(Vec3::from(self.random.pick(reflectance))));
        let roughness = self.rough(smooth);
        self.material("metal", MaterialKind::Conductor { conductor, roughness })
    }

    /// Plastic or varnish, plain or patterned.
    pub fn plastic(&mut self, patterned: f32) -> MaterialId {
        let reflectance = if self.random.chance(patterned) {
            self.pattern(2.0)
        } else {
            ColorInput::Constant(self.color())
        };
        let eta = if self.split == Split::Training { 1.5 } else { 1.42 };
        let roughness = self.rough(0.3);
        self.material("plastic", MaterialKind::CoatedDiffuse { reflectance, roughness, eta })
    }

    pub fn glass(&mut self, smooth: f32) -> MaterialId {
        let eta = match self.split {
            Split::Training => self.random.pick([1.5, 1.7]),
            Split::Validation => self.random.pick([1.33, 1.6]),
        };
        let tint = if self.random.chance(0.4) { self.color() * 0.4 + 0.6 } else { Vec3::ONE };
        let (tint, roughness) = (ColorInput::Constant(tint), self.rough(smooth));
        self.material("glass", MaterialKind::Dielectric { eta, roughness, tint })
    }

    /// Anything opaque.
    pub fn opaque(&mut self) -> MaterialId {
        match self.random.below(5) {
            0 | 1 => self.matte(),
            2 => self.patterned(1.0),
            3 => self.metal(0.25),
            _ => self.plastic(0.25),
        }
    }

    /// Anything, now and then glass.
    pub fn anything(&mut self) -> MaterialId {
        if self.random.chance(0.15) { self.glass(0.7) } else { self.opaque() }
    }

    /// The cut-out of a pointed leaf, for quads.
    pub fn leaf_shape(&mut self) -> FloatInput {
        let image = self.image(pictures::picture("leaf", 48, 48, |u, v| {
            let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            if x.abs() < 0.7 * (1.0 - y * y) * (1.0 - 0.3 * y) { Vec3::ONE } else { Vec3::ZERO }
        }));
        let mapping = UvMapping::default();
        FloatInput::Texture(self.texture(Texture::Image {
            image,
            mapping,
            wrap: [Wrap::Clamp; 2],
            scale: 1.0,
            invert: false,
        }))
    }

    /// A leaf or a sheet of paper: light comes through.
    pub fn leaf(&mut self) -> MaterialId {
        let color = self.color();
        let (reflectance, transmittance) =
            (ColorInput::Constant(color * 0.5), ColorInput::Constant(color * 0.4));
        self.material("leaf", MaterialKind::DiffuseTransmission { reflectance, transmittance })
    }
}
