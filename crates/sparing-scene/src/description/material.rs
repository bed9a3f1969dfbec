//! Materials.

use super::{ColorInput, FloatInput, MaterialId, TextureId};
use glam::Vec3;

/// A surface material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file, may be empty.
    pub name: String,
    /// Scattering model.
    pub kind: MaterialKind,
    /// Tangent-space normal map (RGB in 0..1, z up, linear).
    pub normal_map: Option<TextureId>,
    /// Height texture in scene units, for bump mapping.
    pub bump: Option<TextureId>,
}

/// Microfacet roughness along the two tangents.
#[derive(Clone, Debug, PartialEq)]
pub struct Roughness {
    /// Along dp/du.
    pub u: FloatInput,
    /// Along dp/dv.
    pub v: FloatInput,
    /// Whether the values are perceptual and become GGX alpha by a square root (pbrt-v4's remapping).
    pub remap: bool,
}

impl Roughness {
    /// A perfectly smooth surface.
    pub const SMOOTH: Self =
        Self { u: FloatInput::Constant(0.0), v: FloatInput::Constant(0.0), remap: false };
}

/// What a conductor is made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Conductor {
    /// Complex index of refraction.
    EtaK {
        /// Real part.
        eta: ColorInput,
        /// Absorption coefficient.
        k: ColorInput,
    },
    /// Reflectance at normal incidence, in 0..1.
    Reflectance(ColorInput),
}

/// Scattering models.
#[derive(Clone, Debug, PartialEq)]
pub enum MaterialKind {
    /// Lambert.
    Diffuse {
        /// Albedo.
        reflectance: ColorInput,
    },
    /// Metal.
    Conductor {
        /// Substance.
        conductor: Conductor,
        /// Microfacets.
        roughness: Roughness,
    },
    /// Glass and other refracting interfaces.
    Dielectric {
        /// Index of refraction inside over outside.
        eta: f32,
        /// Microfacets.
        roughness: Roughness,
        /// Factor on refracted light (1 is clear).
        tint: ColorInput,
    },
    /// A pane so thin that refraction does not shift light.
    ThinDielectric {
        /// Index of refraction.
        eta: f32,
    },
    /// Diffuse base under a dielectric coat (plastic, varnish).
    CoatedDiffuse {
        /// Albedo of the base.
        reflectance: ColorInput,
        /// Microfacets of the coat.
        roughness: Roughness,
        /// Index of refraction of the coat.
        eta: f32,
    },
    /// Diffuse reflection and transmission (leaves, paper).
    DiffuseTransmission {
        /// Albedo on the side of the light.
        reflectance: ColorInput,
        /// Albedo through the surface.
        transmittance: ColorInput,
    },
    /// Stochastic mix of two materials.
    Mix {
        /// `amount` 0 is the first, 1 the second.
        materials: [MaterialId; 2],
        /// Share of the second.
        amount: FloatInput,
    },
    /// No surface at all: light passes unchanged.
    Interface,
    /// Rough matte (M. Oren and S. Nayar 1994).
    OrenNayar {
        /// Albedo.
        reflectance: ColorInput,
        /// Standard deviation of the slope angle, degrees.
        sigma: FloatInput,
    },
    /// Reflects the same share at every angle.
    Mirror {
        /// Share.
        reflectance: ColorInput,
    },
    /// Lobes that are added up, as `plastic` and `uber` of older pbrt versions do it.
    Uber {
        /// Albedo of the matte part.
        diffuse: ColorInput,
        /// Factor on the glossy part.
        specular: ColorInput,
        /// Factor on mirror reflection.
        mirror: ColorInput,
        /// Factor on clear refraction.
        transmission: ColorInput,
        /// Microfacets of the glossy part.
        roughness: Roughness,
        /// Index of refraction inside over outside.
        eta: f32,
    },
    /// Matte under a glossy layer (M. Ashikhmin and P. Shirley 2000).
    Substrate {
        /// Albedo of the base.
        diffuse: ColorInput,
        /// Reflectance of the layer at normal incidence.
        specular: ColorInput,
        /// Microfacets of the layer.
        roughness: Roughness,
    },
    /// Metal under a dielectric coat.
    CoatedConductor {
        /// The metal; indices are against vacuum.
        conductor: Conductor,
        /// Microfacets of the metal.
        roughness: Roughness,
        /// Index of refraction of the coat.
        eta: f32,
        /// Microfacets of the coat.
        coat_roughness: Roughness,
    },
    /// glTF 2.0's model of metals, plastics and thin glass.
    MetallicRoughness(MetallicRoughness),
}

/// The parameters of glTF 2.0's model (appendix B) and of its extensions. Numbers are in 0..1.
#[derive(Clone, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// Albedo, reflectance of metal, tint of transmitted light.
    pub base_color: ColorInput,
    /// Share of metal.
    pub metallic: FloatInput,
    /// GGX alpha is its square.
    pub roughness: FloatInput,
    /// Index of refraction of what is not metal; 0 reflects everything.
    pub eta: f32,
    /// Factor on the reflectance of what is not metal.
    pub specular: FloatInput,
    /// Colour of that at normal incidence, may exceed 1.
    pub specular_color: ColorInput,
    /// Share of the base that light passes through, as through a thin sheet.
    pub transmission: FloatInput,
    /// Share of the surface that has a clear coat.
    pub clearcoat: FloatInput,
    /// GGX alpha of the coat is its square.
    pub clearcoat_roughness: FloatInput,
    /// Whether the colours of vertices multiply `base_color`.
    pub vertex_colors: bool,
}

impl Default for MetallicRoughness {
    /// A white, rough surface that is no metal.
    fn default() -> Self {
        Self {
            base_color: ColorInput::Constant(Vec3::ONE),
            metallic: FloatInput::Constant(0.0),
            roughness: FloatInput::Constant(1.0),
            eta: 1.5,
            specular: FloatInput::Constant(1.0),
            specular_color: ColorInput::Constant(Vec3::ONE),
            transmission: FloatInput::Constant(0.0),
            clearcoat: FloatInput::Constant(0.0),
            clearcoat_roughness: FloatInput::Constant(0.0),
            vertex_colors: false,
        }
    }
}
