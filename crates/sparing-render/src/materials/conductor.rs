//! Metal: GGX microfacets with the Fresnel reflectance of a conductor (Walter et al. 2007, eq. 20).

use super::{BsdfSample, Evaluation, fresnel, microfacet::Ggx};
use glam::Vec3;

/// A metal surface.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    /// Index of refraction.
    pub eta: Vec3,
    /// Absorption coefficient.
    pub k: Vec3,
    /// Microfacets.
    pub ggx: Ggx,
}

impl Conductor {
    /// Absorption coefficient that gives reflectance `r` at normal incidence together with eta = 1
    /// ("Physically Based Rendering", 4th ed., section 9.3.6).
    #[must_use]
    pub fn k_from_reflectance(r: Vec3) -> Vec3 {
        let r = r.clamp(Vec3::ZERO, Vec3::splat(0.9999));
        let q = r / (Vec3::ONE - r);
        2.0 * Vec3::new(q.x.sqrt(), q.y.sqrt(), q.z.sqrt())
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if self.ggx.is_smooth() || wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let wm = (wo + wi).normalize();
        let f = fresnel::conductor(wo.dot(wm).max(0.0), self.eta, self.k);
        let f_cos = f * (self.ggx.d(wm) * self.ggx.g2(wo, wi) / (4.0 * wo.z));
        let pdf = self.ggx.visible_d(wo, wm) / (4.0 * wo.dot(wm).max(f32::MIN_POSITIVE));
        Evaluation { f_cos, pdf }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        if self.ggx.is_smooth() {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            let weight = fresnel::conductor(wo.z, self.eta, self.k);
            return Some(BsdfSample { wi, weight, pdf: 1.0, is_delta: true });
        }
        let wm = self.ggx.sample(wo, u);
        let cos = wo.dot(wm);
        let wi = 2.0 * cos * wm - wo;
        if wi.z <= 0.0 || cos <= 0.0 {
            return None; // a facet that sends light into the surface: lost, as in the masking model
        }
        let weight = fresnel::conductor(cos, self.eta, self.k) * (self.ggx.g2(wo, wi) / self.ggx.g1(wo));
        let pdf = self.ggx.visible_d(wo, wm) / (4.0 * cos);
        Some(BsdfSample { wi, weight, pdf, is_delta: false })
    }
}
