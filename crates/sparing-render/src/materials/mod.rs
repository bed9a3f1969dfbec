//! Scattering at surfaces. Each model has a file; [`Bsdf`] is their closed union.
//!
//! Conventions: directions are unit, in the local shading frame, z is the normal on the side of `wo`, so
//! `wo.z > 0` always; both point away from the surface. `f_cos` is f(wo, wi) |cos wi| in 1/sr, `pdf` is per
//! steradian of `wi`. `sample` and `eval` must agree: the chi-square tests hold them to it.

pub mod coated_conductor;
pub mod coated_diffuse;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod diffuse_transmission;
pub mod fresnel;
pub mod metallic_roughness;
pub mod microfacet;
pub mod mirror;
pub mod oren_nayar;
pub mod substrate;
pub mod thin_dielectric;
pub mod uber;

mod material;

pub use coated_conductor::CoatedConductor;
pub use coated_diffuse::{CoatTable, CoatedDiffuse};
pub use conductor::Conductor;
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use diffuse_transmission::DiffuseTransmission;
pub use material::{Material, MaterialTable, ShadingInput};
pub use metallic_roughness::MetallicRoughness;
pub use mirror::Mirror;
pub use oren_nayar::OrenNayar;
pub use substrate::Substrate;
pub use thin_dielectric::ThinDielectric;
pub use uber::Uber;

use glam::Vec3;

/// Value and density of the non-delta part of a BSDF for a pair of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// f(wo, wi) |cos wi|, 1/sr.
    pub f_cos: Vec3,
    /// Density with which `sample` gives `wi`, 1/sr.
    pub pdf: f32,
}

impl Evaluation {
    /// No light this way.
    pub const ZERO: Self = Self { f_cos: Vec3::ZERO, pdf: 0.0 };
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Unit direction, local.
    pub wi: Vec3,
    /// f |cos wi| / pdf.
    pub weight: Vec3,
    /// Density per steradian; for a delta lobe the probability of the lobe.
    pub pdf: f32,
    /// Whether `wi` is the only direction of its lobe: light sampling cannot produce it.
    pub is_delta: bool,
}

/// A material at one point, all textures looked up.
#[derive(Clone, Copy, Debug)]
pub enum Bsdf {
    /// Matte.
    Diffuse(Diffuse),
    /// Metal.
    Conductor(Conductor),
    /// Glass.
    Dielectric(Dielectric),
    /// Pane.
    ThinDielectric(ThinDielectric),
    /// Plastic.
    CoatedDiffuse(CoatedDiffuse),
    /// Leaf.
    DiffuseTransmission(DiffuseTransmission),
    /// Nothing: light passes.
    Interface,
    /// Rough matte.
    OrenNayar(OrenNayar),
    /// The same share at every angle.
    Mirror(Mirror),
    /// Lobes added up.
    Uber(Uber),
    /// Matte under a glossy layer.
    Substrate(Substrate),
    /// Coated metal.
    CoatedConductor(CoatedConductor),
    /// glTF's metal, plastic and thin glass.
    MetallicRoughness(MetallicRoughness),
}

impl Bsdf {
    /// Value and density for light from `wi`. Delta lobes give zero.
    #[inline(always)]
    #[must_use]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Self::Diffuse(b) => b.eval(wi),
            other => other.eval_other(wo, wi),
        }
    }

    /// The rarer models, kept out of the inner loop's code.
    #[inline(never)]
    fn eval_other(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        match self {
            Self::Diffuse(b) => b.eval(wi),
            Self::Conductor(b) => b.eval(wo, wi),
            Self::Dielectric(b) => b.eval(wo, wi),
            Self::CoatedDiffuse(b) => b.eval(wo, wi),
            Self::DiffuseTransmission(b) => b.eval(wi),
            Self::OrenNayar(b) => b.eval(wo, wi),
            Self::Uber(b) => b.eval(wo, wi),
            Self::Substrate(b) => b.eval(wo, wi),
            Self::CoatedConductor(b) => b.eval(wo, wi),
            Self::MetallicRoughness(b) => b.eval(wo, wi),
            Self::ThinDielectric(_) | Self::Interface | Self::Mirror(_) => Evaluation::ZERO,
        }
    }

    /// A direction; `lobe` and `u` are uniform in [0, 1). `None` where the model loses the light.
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(b) => b.sample(u),
            other => other.sample_other(wo, lobe, u),
        }
    }

    /// The rarer models, kept out of the inner loop's code.
    #[inline(never)]
    fn sample_other(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        match self {
            Self::Diffuse(b) => b.sample(u),
            Self::Conductor(b) => b.sample(wo, u),
            Self::Dielectric(b) => b.sample(wo, lobe, u),
            Self::ThinDielectric(b) => b.sample(wo, lobe),
            Self::CoatedDiffuse(b) => b.sample(wo, lobe, u),
            Self::DiffuseTransmission(b) => b.sample(lobe, u),
            Self::OrenNayar(b) => b.sample(wo, u),
            Self::Mirror(b) => b.sample(wo),
            Self::Uber(b) => b.sample(wo, lobe, u),
            Self::Substrate(b) => b.sample(wo, lobe, u),
            Self::CoatedConductor(b) => b.sample(wo, lobe, u),
            Self::MetallicRoughness(b) => b.sample(wo, lobe, u),
            Self::Interface => Some(BsdfSample { wi: -wo, weight: Vec3::ONE, pdf: 1.0, is_delta: true }),
        }
    }

    /// Whether light sampling can contribute at all.
    #[inline]
    #[must_use]
    pub fn is_all_delta(&self) -> bool {
        match self {
            Self::Diffuse(_) | Self::CoatedDiffuse(_) | Self::DiffuseTransmission(_) => false,
            Self::Conductor(b) => b.ggx.is_smooth(),
            Self::Dielectric(b) => b.ggx.is_smooth() || b.eta == 1.0,
            Self::OrenNayar(_) | Self::Substrate(_) => false,
            Self::Uber(b) => b.is_all_delta(),
            Self::CoatedConductor(b) => b.coat.is_smooth() && b.ggx.is_smooth(),
            Self::MetallicRoughness(b) => b.is_all_delta(),
            Self::ThinDielectric(_) | Self::Interface | Self::Mirror(_) => true,
        }
    }

    /// Whether the reflection depends on the direction of the tangents.
    #[must_use]
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Self::Conductor(b) => b.ggx.is_anisotropic(),
            Self::Dielectric(b) => b.ggx.is_anisotropic(),
            Self::CoatedDiffuse(b) => b.ggx.is_anisotropic(),
            Self::Uber(b) => b.ggx.is_anisotropic(),
            Self::Substrate(b) => b.ggx.is_anisotropic(),
            Self::CoatedConductor(b) => b.ggx.is_anisotropic() || b.coat.is_anisotropic(),
            _ => false,
        }
    }

    /// Whether light passes to the other side.
    #[inline]
    #[must_use]
    pub fn is_transmissive(&self) -> bool {
        match self {
            Self::Dielectric(_)
            | Self::ThinDielectric(_)
            | Self::DiffuseTransmission(_)
            | Self::Interface => true,
            Self::Uber(b) => b.transmission != Vec3::ZERO,
            Self::MetallicRoughness(b) => b.is_transmissive(),
            _ => false,
        }
    }

    /// Colour for the albedo layer: reflected and transmitted light under uniform light, roughly.
    #[must_use]
    pub fn albedo(&self) -> Vec3 {
        match self {
            Self::Diffuse(b) => b.reflectance,
            Self::Conductor(b) => fresnel::conductor(1.0, b.eta, b.k),
            Self::Dielectric(_) | Self::ThinDielectric(_) | Self::Interface => Vec3::ONE,
            Self::CoatedDiffuse(b) => b.reflectance,
            Self::DiffuseTransmission(b) => b.reflectance + b.transmittance,
            Self::OrenNayar(b) => b.reflectance(),
            Self::Mirror(b) => b.reflectance,
            Self::Uber(b) => (b.diffuse + b.transmission).min(Vec3::ONE),
            Self::Substrate(b) => b.diffuse * (Vec3::ONE - b.specular) + b.specular,
            Self::CoatedConductor(b) => fresnel::conductor(1.0, b.eta, b.k),
            Self::MetallicRoughness(b) => b.base_color,
        }
    }
}
