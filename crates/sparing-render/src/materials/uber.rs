//! Lobes added up without regard to each other, as `plastic` and `uber` of pbrt before version 4 have them:
//! Lambert, glossy, mirror and clear refraction. Where their factors add up to more than 1 the surface gains light.
//!
//! f = Kd / pi + Ks F D G2 / (4 cos cos) and two deltas, Kr F and Kt (1 - F), with F that of a dielectric
//! ("Physically Based Rendering", 3rd edition, sections 8.2 to 8.4). Here D is GGX and G2 height-correlated.

use super::{BsdfSample, Evaluation, fresnel, microfacet::Ggx};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;

/// The sum, seen from the side of `wo`.
#[derive(Clone, Copy, Debug)]
pub struct Uber {
    /// Albedo of the matte part.
    pub diffuse: Vec3,
    /// Factor on the glossy part.
    pub specular: Vec3,
    /// Factor on mirror reflection.
    pub mirror: Vec3,
    /// Factor on clear refraction.
    pub transmission: Vec3,
    /// Index of refraction of the far side over the near side.
    pub eta: f32,
    /// Microfacets of the glossy part.
    pub ggx: Ggx,
}

/// Probabilities of the lobes: matte, glossy, mirror; the rest refracts.
struct Lobes {
    matte: f32,
    glossy: f32,
    mirror: f32,
    transmission: f32,
    /// Reflectance at the angle of `wo`.
    fresnel: f32,
    cos_t: f32,
}

impl Uber {
    #[inline]
    fn lobes(&self, wo: Vec3) -> Lobes {
        let (f, cos_t) = fresnel::dielectric(wo.z, self.eta);
        let smooth = self.ggx.is_smooth();
        let matte = self.diffuse.max_element();
        let (glossy, mirror) = (self.specular.max_element() * f, self.mirror.max_element() * f);
        let (glossy, mirror) = if smooth { (0.0, glossy + mirror) } else { (glossy, mirror) };
        let transmission = self.transmission.max_element() * (1.0 - f);
        let scale = 1.0 / (matte + glossy + mirror + transmission);
        let scale = if scale.is_finite() { scale } else { 0.0 };
        Lobes {
            matte: matte * scale,
            glossy: glossy * scale,
            mirror: mirror * scale,
            transmission: transmission * scale,
            fresnel: f,
            cos_t,
        }
    }

    /// Whether only deltas are left.
    #[inline]
    #[must_use]
    pub fn is_all_delta(&self) -> bool {
        self.diffuse == Vec3::ZERO && (self.specular == Vec3::ZERO || self.ggx.is_smooth())
    }

    #[inline]
    fn eval_lobes(&self, wo: Vec3, wi: Vec3, p: &Lobes) -> Evaluation {
        if wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let cosine = cosine_hemisphere_pdf(wi.z);
        let mut e = Evaluation { f_cos: self.diffuse * cosine, pdf: p.matte * cosine };
        if p.glossy > 0.0 {
            let wm = (wo + wi).normalize();
            let cos = wo.dot(wm).max(f32::MIN_POSITIVE);
            let (f, _) = fresnel::dielectric(cos, self.eta);
            e.f_cos += self.specular * (f * self.ggx.d(wm) * self.ggx.g2(wo, wi) / (4.0 * wo.z));
            e.pdf += p.glossy * self.ggx.visible_d(wo, wm) / (4.0 * cos);
        }
        e
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        self.eval_lobes(wo, wi, &self.lobes(wo))
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let p = self.lobes(wo);
        let wi = if lobe < p.matte {
            cosine_hemisphere(u)
        } else if lobe < p.matte + p.glossy {
            let wm = self.ggx.sample(wo, u);
            2.0 * wo.dot(wm) * wm - wo
        } else if lobe < p.matte + p.glossy + p.mirror {
            let factor = if self.ggx.is_smooth() { self.mirror + self.specular } else { self.mirror };
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            let weight = factor * (p.fresnel / p.mirror);
            return Some(BsdfSample { wi, weight, pdf: p.mirror, is_delta: true });
        } else if p.transmission > 0.0 && p.cos_t > 0.0 {
            let wi = Vec3::new(-wo.x / self.eta, -wo.y / self.eta, -p.cos_t);
            let weight = self.transmission * ((1.0 - p.fresnel) / (p.transmission * self.eta * self.eta));
            return Some(BsdfSample { wi, weight, pdf: p.transmission, is_delta: true });
        } else {
            return None;
        };
        let e = self.eval_lobes(wo, wi, &p);
        (e.pdf > 0.0).then(|| BsdfSample { wi, weight: e.f_cos / e.pdf, pdf: e.pdf, is_delta: false })
    }
}
