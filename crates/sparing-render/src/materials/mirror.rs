//! A mirror that reflects the same share at every angle, as `mirror` of pbrt before version 4.

use super::BsdfSample;
use glam::Vec3;

/// A mirror.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    /// Share of reflected light.
    pub reflectance: Vec3,
}

impl Mirror {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        let wi = Vec3::new(-wo.x, -wo.y, wo.z);
        Some(BsdfSample { wi, weight: self.reflectance, pdf: 1.0, is_delta: true })
    }
}
