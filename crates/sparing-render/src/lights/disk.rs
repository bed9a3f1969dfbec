//! Emitting disks, sampled evenly by area.

use super::{LightContext, LightSample};
use crate::sampling::{Frame, concentric_disk};
use glam::Vec3;
use std::f32::consts::PI;

/// A disk.
#[derive(Clone, Copy, Debug)]
pub struct DiskLight {
    /// Centre.
    pub center: Vec3,
    /// Tangents and the normal on the emitting side.
    pub frame: Frame,
    /// Radius.
    pub radius: f32,
    /// Index of the emission.
    pub emission: u32,
}

impl DiskLight {
    #[inline]
    pub(super) fn sample(&self, p: Vec3, u: [f32; 2], context: &LightContext<'_>) -> Option<LightSample> {
        let unit = concentric_disk(u);
        let d = self.center - p + (self.frame.x * unit.x + self.frame.y * unit.y) * self.radius;
        let distance = d.length();
        let wi = d / distance;
        let cos = -self.frame.z.dot(wi);
        let emission = &context.emissions[self.emission as usize];
        if !(cos > 0.0 || (emission.two_sided && cos < 0.0)) {
            return None;
        }
        let pdf = self.pdf(distance, cos.abs());
        let radiance = emission.radiance(context.textures, crate::scene::surface::disk_uv(unit.x, unit.y));
        (pdf.is_finite() && pdf > 0.0).then_some(LightSample { wi, distance, radiance, pdf, is_delta: false })
    }

    #[inline]
    pub(super) fn pdf(&self, distance: f32, cos: f32) -> f32 {
        distance * distance / (PI * self.radius * self.radius * cos)
    }

    pub(super) fn power(&self, context: &LightContext<'_>) -> f32 {
        let e = &context.emissions[self.emission as usize];
        let sides = if e.two_sided { 2.0 } else { 1.0 };
        let mean = e.mean_luminance(context.textures, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        sides * PI * PI * self.radius * self.radius * mean
    }
}
