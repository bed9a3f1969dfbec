//! Plastic: a diffuse base under a dielectric coat. Light enters through the coat, scatters, and what meets
//! the coat from below is partly reflected back, any number of times: with internal diffuse reflectance r,
//! f = (1 - F(wo)) (1 - F(wi)) albedo / (pi eta² (1 - albedo r)). The closed form conserves energy exactly
//! for a smooth coat (the sum of the geometric series, as used since L. Wolff 1994; W. Jakob's "plastic").

use super::{BsdfSample, Evaluation, fresnel, microfacet::Ggx};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;

/// A coated matte surface.
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse {
    /// Albedo of the base, in 0..1.
    pub reflectance: Vec3,
    /// Index of refraction of the coat.
    pub eta: f32,
    /// Mean internal reflectance of the coat for diffuse light from below.
    pub internal_reflectance: f32,
    /// Microfacets of the coat.
    pub ggx: Ggx,
}

impl CoatedDiffuse {
    /// 1 - (1 - F_diffuse) / eta²: what reciprocity demands of the inside.
    #[must_use]
    pub fn internal_reflectance(eta: f32) -> f32 {
        (1.0 - (1.0 - fresnel::diffuse_reflectance(eta)) / (eta * eta)).clamp(0.0, 1.0)
    }

    /// Base colour with all internal reflections: f without the two Fresnel factors, times pi.
    #[inline]
    fn base(&self) -> Vec3 {
        self.reflectance / ((Vec3::ONE - self.reflectance * self.internal_reflectance) * (self.eta * self.eta))
    }

    #[inline]
    fn coat_probability(&self, f: f32) -> f32 {
        let base = (1.0 - f) * self.base().max_element();
        let p = f / (f + base);
        if p.is_finite() { p.clamp(0.05, 0.95) } else { 0.5 }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let (fo, _) = fresnel::dielectric(wo.z, self.eta);
        let (fi, _) = fresnel::dielectric(wi.z, self.eta);
        let p = self.coat_probability(fo);
        let density = cosine_hemisphere_pdf(wi.z);
        let mut e = Evaluation {
            f_cos: self.base() * ((1.0 - fo) * (1.0 - fi) * density),
            pdf: (1.0 - p) * density,
        };
        if !self.ggx.is_smooth() {
            let wm = (wo + wi).normalize();
            let cos = wo.dot(wm).max(f32::MIN_POSITIVE);
            let (f, _) = fresnel::dielectric(cos, self.eta);
            e.f_cos += Vec3::splat(f * self.ggx.d(wm) * self.ggx.g2(wo, wi) / (4.0 * wo.z));
            e.pdf += p * self.ggx.visible_d(wo, wm) / (4.0 * cos);
        }
        e
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let (fo, _) = fresnel::dielectric(wo.z, self.eta);
        let p = self.coat_probability(fo);
        let wi = if lobe < p {
            if self.ggx.is_smooth() {
                let wi = Vec3::new(-wo.x, -wo.y, wo.z);
                return Some(BsdfSample { wi, weight: Vec3::splat(fo / p), pdf: p, is_delta: true });
            }
            let wm = self.ggx.sample(wo, u);
            2.0 * wo.dot(wm) * wm - wo
        } else {
            cosine_hemisphere(u)
        };
        let e = self.eval(wo, wi);
        (e.pdf > 0.0).then(|| BsdfSample { wi, weight: e.f_cos / e.pdf, pdf: e.pdf, is_delta: false })
    }
}
