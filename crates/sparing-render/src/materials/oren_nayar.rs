//! Rough matte surfaces: V-shaped grooves of Lambert facets (M. Oren and S. Nayar 1994, the "qualitative" model,
//! eq. 30, as in "Physically Based Rendering", 3rd edition, section 8.4.1).

use super::{BsdfSample, Evaluation};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;

/// A rough matte surface.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    reflectance: Vec3,
    a: f32,
    b: f32,
}

impl OrenNayar {
    /// Of an albedo and a standard deviation of the slope in degrees.
    #[must_use]
    pub fn new(reflectance: Vec3, sigma: f32) -> Self {
        let s = sigma.clamp(0.0, 90.0).to_radians();
        let s2 = if s.is_nan() { 0.0 } else { s * s };
        Self { reflectance, a: 1.0 - s2 / (2.0 * (s2 + 0.33)), b: 0.45 * s2 / (s2 + 0.09) }
    }

    /// The albedo without grooves.
    #[must_use]
    pub fn reflectance(&self) -> Vec3 {
        self.reflectance
    }

    #[inline]
    fn factor(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (sin_o, sin_i) = ((1.0 - wo.z * wo.z).max(0.0).sqrt(), (1.0 - wi.z * wi.z).max(0.0).sqrt());
        // max(0, cos of the difference of azimuths) sin alpha tan beta: the sines cancel the lengths of the
        // projections, and beta is the smaller angle, of the larger cosine.
        let cosines = (wo.x * wi.x + wo.y * wi.y).max(0.0);
        if sin_o < 1e-4 || sin_i < 1e-4 {
            return self.a;
        }
        self.a + self.b * cosines / wo.z.max(wi.z)
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let pdf = cosine_hemisphere_pdf(wi.z);
        Evaluation { f_cos: self.reflectance * (pdf * self.factor(wo, wi)), pdf }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(u);
        let pdf = cosine_hemisphere_pdf(wi.z);
        let weight = self.reflectance * self.factor(wo, wi);
        (pdf > 0.0).then_some(BsdfSample { wi, weight, pdf, is_delta: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// sigma 20 degrees, both directions at 60 degrees on the same side: A = 0.844, B = 0.259, and
    /// sin 60 tan 60 = 1.5.
    #[test]
    fn a_value_by_hand() {
        let s2 = 20f32.to_radians().powi(2);
        let (a, b) = (1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09));
        let w = Vec3::new(60f32.to_radians().sin(), 0.0, 0.5);
        let surface = OrenNayar::new(Vec3::ONE, 20.0);
        let f = surface.eval(w, w).f_cos.x / 0.5 * std::f32::consts::PI;
        assert!((f - (a + b * 1.5)).abs() < 1e-5, "{f}");
        let opposite = Vec3::new(-w.x, 0.0, w.z);
        assert!((surface.eval(w, opposite).f_cos.x / 0.5 * std::f32::consts::PI - a).abs() < 1e-5);
    }

    #[test]
    fn without_grooves_it_is_lambert() {
        let w = Vec3::new(0.6, 0.0, 0.8);
        let f = OrenNayar::new(Vec3::ONE, 0.0).eval(w, w).f_cos.x;
        assert!((f - 0.8 * std::f32::consts::FRAC_1_PI).abs() < 1e-6);
    }
}
