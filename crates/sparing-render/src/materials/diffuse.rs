//! Lambert's reflection: f = albedo / pi.

use super::{BsdfSample, Evaluation};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;

/// A matte surface.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    /// Albedo in 0..1.
    pub reflectance: Vec3,
}

impl Diffuse {
    #[inline(always)]
    pub(super) fn eval(&self, wi: Vec3) -> Evaluation {
        let pdf = cosine_hemisphere_pdf(wi.z);
        Evaluation { f_cos: self.reflectance * pdf, pdf }
    }

    #[inline(always)]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<BsdfSample> {
        let wi = cosine_hemisphere(u);
        let pdf = cosine_hemisphere_pdf(wi.z);
        Some(BsdfSample { wi, weight: self.reflectance, pdf, is_delta: false })
    }
}
