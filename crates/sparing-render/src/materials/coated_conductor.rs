//! Metal under a clear dielectric coat.
//!
//! The coat reflects F of the light as in [`super::conductor`]; what enters is bent, meets the metal, and is reflected
//! between the two any number of times. With T = 1 - F, R the metal's reflectance (its index against that of the
//! coat) at the refracted angle,
//!
//! f = F D1 G1 / (4 cos cos) + T(wo) T(wi) R / (1 - R min(F(wo), F(wi))) D2 G2 / (4 cos cos),
//!
//! which is exact where both are smooth, F + T² R / (1 - R F), reciprocal, and never more than the light that enters. Rough layers are approximated: the metal's lobe keeps
//! the width it has without a coat, and the coat lets through what a smooth one does. The reference model traces
//! random walks between the layers ("Physically Based Rendering", 4th edition, section 14.3).

use super::{BsdfSample, Evaluation, fresnel, microfacet::Ggx};
use glam::Vec3;

/// A coated metal.
#[derive(Clone, Copy, Debug)]
pub struct CoatedConductor {
    /// Index of refraction of the coat.
    pub coat_eta: f32,
    /// Microfacets of the coat.
    pub coat: Ggx,
    /// Index of refraction of the metal against that of the coat.
    pub eta: Vec3,
    /// Absorption coefficient of the metal over the coat's index.
    pub k: Vec3,
    /// Microfacets of the metal.
    pub ggx: Ggx,
}

impl CoatedConductor {
    /// Reflectance of the metal through the coat for directions with these cosines, `cos` at the facet.
    #[inline]
    fn metal(&self, f_o: f32, f_i: f32, cos: f32) -> Vec3 {
        let sin2 = (1.0 - cos * cos) / (self.coat_eta * self.coat_eta);
        let r = fresnel::conductor((1.0 - sin2).max(0.0).sqrt(), self.eta, self.k);
        r * ((1.0 - f_o) * (1.0 - f_i)) / (Vec3::ONE - r * f_o.min(f_i)).max(Vec3::splat(1e-6))
    }

    /// Reflectance of the coat at `wo`, and the probability of sampling it.
    #[inline]
    fn coat_probability(&self, wo: Vec3) -> (f32, f32) {
        let (f, _) = fresnel::dielectric(wo.z, self.coat_eta);
        let metal = self.metal(f, f, wo.z).max_element();
        let p = f / (f + metal);
        (f, if p.is_finite() { p.clamp(0.05, 0.95) } else { 0.5 })
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let (f_o, p) = self.coat_probability(wo);
        let wm = (wo + wi).normalize();
        let cos = wo.dot(wm).max(f32::MIN_POSITIVE);
        let mut e = Evaluation::ZERO;
        if !self.coat.is_smooth() {
            let (f, _) = fresnel::dielectric(cos, self.coat_eta);
            e.f_cos += Vec3::splat(f * self.coat.d(wm) * self.coat.g2(wo, wi) / (4.0 * wo.z));
            e.pdf += p * self.coat.visible_d(wo, wm) / (4.0 * cos);
        }
        if !self.ggx.is_smooth() {
            let (f_i, _) = fresnel::dielectric(wi.z, self.coat_eta);
            let r = self.metal(f_o, f_i, cos);
            e.f_cos += r * (self.ggx.d(wm) * self.ggx.g2(wo, wi) / (4.0 * wo.z));
            e.pdf += (1.0 - p) * self.ggx.visible_d(wo, wm) / (4.0 * cos);
        }
        e
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let (f, p) = self.coat_probability(wo);
        let (ggx, probability) = if lobe < p { (&self.coat, p) } else { (&self.ggx, 1.0 - p) };
        if ggx.is_smooth() {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            let r = if lobe < p { Vec3::splat(f) } else { self.metal(f, f, wo.z) };
            return Some(BsdfSample { wi, weight: r / probability, pdf: probability, is_delta: true });
        }
        let wm = ggx.sample(wo, u);
        let wi = 2.0 * wo.dot(wm) * wm - wo;
        let e = self.eval(wo, wi);
        (e.pdf > 0.0).then(|| BsdfSample { wi, weight: e.f_cos / e.pdf, pdf: e.pdf, is_delta: false })
    }
}
