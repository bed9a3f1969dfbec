//! Glass: GGX microfacets that reflect and refract (Walter et al. 2007, eqs. 17, 20, 21), smooth below
//! [`super::microfacet::SMOOTH_ALPHA`]. Radiance is scaled by 1/eta² on refraction.

use super::{BsdfSample, Evaluation, fresnel, microfacet::Ggx};
use glam::Vec3;

/// A dielectric interface seen from the side of `wo`.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Index of refraction of the far side over the near side.
    pub eta: f32,
    /// Factor on refracted light.
    pub tint: Vec3,
    /// Microfacets.
    pub ggx: Ggx,
}

impl Dielectric {
    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if self.ggx.is_smooth() || self.eta == 1.0 || wi.z == 0.0 {
            return Evaluation::ZERO;
        }
        let reflect = wi.z > 0.0;
        let half = if reflect { wo + wi } else { wo + self.eta * wi };
        let wm = half.normalize_or_zero();
        let wm = if wm.z < 0.0 { -wm } else { wm };
        // Back-facing microfacets do not contribute.
        if wm.z == 0.0 || wo.dot(wm) <= 0.0 || wi.dot(wm) * wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let (f, _) = fresnel::dielectric(wo.dot(wm), self.eta);
        let (d, g2) = (self.ggx.d(wm), self.ggx.g2(wo, wi));
        if reflect {
            let f_cos = Vec3::splat(f * d * g2 / (4.0 * wo.z));
            Evaluation { f_cos, pdf: f * self.ggx.visible_d(wo, wm) / (4.0 * wo.dot(wm)) }
        } else {
            let s = wi.dot(wm) + wo.dot(wm) / self.eta;
            let jacobian = wi.dot(wm).abs() / (s * s);
            let f_cos =
                self.tint * ((1.0 - f) * d * g2 * jacobian * wo.dot(wm) / (wo.z * self.eta * self.eta));
            Evaluation { f_cos, pdf: (1.0 - f) * self.ggx.visible_d(wo, wm) * jacobian }
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let smooth = self.ggx.is_smooth() || self.eta == 1.0;
        let wm = if smooth { Vec3::Z } else { self.ggx.sample(wo, u) };
        let cos_o = wo.dot(wm);
        if cos_o <= 0.0 {
            return None;
        }
        let (f, cos_t) = fresnel::dielectric(cos_o, self.eta);
        let reflect = lobe < f;
        let wi =
            if reflect { 2.0 * cos_o * wm - wo } else { (cos_o / self.eta - cos_t) * wm - wo / self.eta };
        if (wi.z > 0.0) != reflect || wi.z == 0.0 {
            return None;
        }
        // Both the lobe's probability and the Fresnel factor are f (or 1 - f): they cancel in the weight.
        let transport = if reflect { Vec3::ONE } else { self.tint / (self.eta * self.eta) };
        let p = if reflect { f } else { 1.0 - f };
        if smooth {
            return Some(BsdfSample { wi, weight: transport, pdf: p, is_delta: true });
        }
        let weight = transport * (self.ggx.g2(wo, wi) / self.ggx.g1(wo));
        let density = self.ggx.visible_d(wo, wm);
        let pdf = if reflect {
            p * density / (4.0 * cos_o)
        } else {
            let s = wi.dot(wm) + cos_o / self.eta;
            p * density * wi.dot(wm).abs() / (s * s)
        };
        (pdf > 0.0 && pdf.is_finite()).then_some(BsdfSample { wi, weight, pdf, is_delta: false })
    }
}
