//! Matte under a glossy layer (M. Ashikhmin and P. Shirley, "An Anisotropic Phong BRDF Model", 2000, eqs. 4 and 5),
//! with GGX for the normals as in "Physically Based Rendering", 3rd edition, section 8.5.

use super::{BsdfSample, Evaluation, microfacet::Ggx};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;
use std::f32::consts::PI;

/// The layer on its base.
#[derive(Clone, Copy, Debug)]
pub struct Substrate {
    /// Albedo of the base.
    pub diffuse: Vec3,
    /// Reflectance of the layer at normal incidence.
    pub specular: Vec3,
    /// Microfacets of the layer.
    pub ggx: Ggx,
}

fn fifth(x: f32) -> f32 {
    let x2 = x * x;
    x2 * x2 * x
}

impl Substrate {
    /// C. Schlick's approximation (1994).
    #[inline]
    fn fresnel(&self, cos: f32) -> Vec3 {
        self.specular + (Vec3::ONE - self.specular) * fifth((1.0 - cos).clamp(0.0, 1.0))
    }

    /// Probability of sampling the layer.
    #[inline]
    fn layer_probability(&self, wo: Vec3) -> f32 {
        let (f, d) = (self.fresnel(wo.z).max_element(), self.diffuse.max_element());
        let p = f / (f + d * (1.0 - f));
        if p.is_finite() { p.clamp(0.1, 0.9) } else { 0.5 }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let side = |cos: f32| 1.0 - fifth(1.0 - 0.5 * cos);
        let base =
            self.diffuse * (Vec3::ONE - self.specular) * (28.0 / (23.0 * PI) * side(wo.z) * side(wi.z));
        let p = self.layer_probability(wo);
        let mut e = Evaluation { f_cos: base * wi.z, pdf: (1.0 - p) * cosine_hemisphere_pdf(wi.z) };
        if !self.ggx.is_smooth() {
            let wm = (wo + wi).normalize();
            let cos = wo.dot(wm).max(f32::MIN_POSITIVE);
            let layer = self.ggx.d(wm) / (4.0 * cos * wo.z.max(wi.z));
            e.f_cos += self.fresnel(cos) * (layer * wi.z);
            e.pdf += p * self.ggx.visible_d(wo, wm) / (4.0 * cos);
        }
        e
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let p = self.layer_probability(wo);
        let wi = if lobe < p {
            if self.ggx.is_smooth() {
                let wi = Vec3::new(-wo.x, -wo.y, wo.z);
                return Some(BsdfSample { wi, weight: self.fresnel(wo.z) / p, pdf: p, is_delta: true });
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a layer at normal incidence, head-on: 28 / (23 pi) (31 / 32)² Rd.
    #[test]
    fn the_base_by_hand() {
        let base = Substrate { diffuse: Vec3::ONE, specular: Vec3::ZERO, ggx: Ggx::new(0.0, 0.0) };
        let f = base.eval(Vec3::Z, Vec3::Z).f_cos.x;
        assert!((f - 28.0 / (23.0 * PI) * (31.0f32 / 32.0).powi(2)).abs() < 1e-6);
    }
}
