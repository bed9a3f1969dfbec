//! A pane with two parallel interfaces and no thickness: light inside reflects back and forth, so that
//! R' = R + T² R / (1 - R²) and T' = 1 - R' ("Physically Based Rendering", 4th ed., section 9.5.3).

use super::{BsdfSample, fresnel};
use glam::Vec3;

/// A thin pane.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    /// Index of refraction of the pane over its surroundings'.
    pub eta: f32,
}

impl ThinDielectric {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32) -> Option<BsdfSample> {
        let (single, _) = fresnel::dielectric(wo.z, self.eta);
        let r = if single < 1.0 { 2.0 * single / (1.0 + single) } else { 1.0 };
        if lobe < r {
            Some(BsdfSample { wi: Vec3::new(-wo.x, -wo.y, wo.z), weight: Vec3::ONE, pdf: r, is_delta: true })
        } else {
            Some(BsdfSample { wi: -wo, weight: Vec3::ONE, pdf: 1.0 - r, is_delta: true })
        }
    }
}
