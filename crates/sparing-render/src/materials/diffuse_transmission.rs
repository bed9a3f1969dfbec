//! Lambert's reflection and transmission: leaves, paper, cloth.

use super::{BsdfSample, Evaluation};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;

/// A thin matte sheet.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    /// Albedo on the side of the light.
    pub reflectance: Vec3,
    /// Albedo through the sheet.
    pub transmittance: Vec3,
}

impl DiffuseTransmission {
    #[inline]
    fn reflect_probability(&self) -> f32 {
        let (r, t) = (self.reflectance.max_element(), self.transmittance.max_element());
        if r + t > 0.0 { r / (r + t) } else { 1.0 }
    }

    #[inline]
    pub(super) fn eval(&self, wi: Vec3) -> Evaluation {
        let p = self.reflect_probability();
        let density = cosine_hemisphere_pdf(wi.z.abs());
        if wi.z > 0.0 {
            Evaluation { f_cos: self.reflectance * density, pdf: p * density }
        } else {
            Evaluation { f_cos: self.transmittance * density, pdf: (1.0 - p) * density }
        }
    }

    #[inline]
    pub(super) fn sample(&self, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let p = self.reflect_probability();
        let mut wi = cosine_hemisphere(u);
        let density = cosine_hemisphere_pdf(wi.z);
        if lobe < p {
            Some(BsdfSample { wi, weight: self.reflectance / p, pdf: p * density, is_delta: false })
        } else {
            wi.z = -wi.z;
            let q = 1.0 - p;
            Some(BsdfSample { wi, weight: self.transmittance / q, pdf: q * density, is_delta: false })
        }
    }
}
