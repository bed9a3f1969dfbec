//! Emitting spheres: the visible cap is sampled evenly by solid angle from outside, the surface by area
//! from inside ("Physically Based Rendering", 4th ed., section 6.2.4).

use super::{LightContext, LightSample};
use crate::sampling::{Frame, uniform_cone, uniform_cone_pdf, uniform_sphere};
use glam::Vec3;
use std::f32::consts::PI;

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub struct SphereLight {
    /// Centre.
    pub center: Vec3,
    /// Radius.
    pub radius: f32,
    /// Axes of the texture coordinates.
    pub axes: [Vec3; 3],
    /// Whether the emitting side is the inside.
    pub flip: bool,
    /// Index of the emission.
    pub emission: u32,
}

impl SphereLight {
    /// 1 - cos of the half-angle under which the sphere is seen; `None` from inside.
    #[inline]
    fn one_minus_cos(&self, distance2: f32) -> Option<f32> {
        let r2 = self.radius * self.radius;
        // Just outside, the cone is the better strategy down to where its angle loses its digits.
        if distance2 <= r2 * 1.000_01 {
            return None;
        }
        let sin2 = r2 / distance2;
        // 1 - sqrt(1 - s) without cancellation.
        Some(sin2 / (1.0 + (1.0 - sin2).sqrt()))
    }

    #[inline]
    pub(super) fn sample(&self, p: Vec3, u: [f32; 2], context: &LightContext<'_>) -> Option<LightSample> {
        let to_center = self.center - p;
        let distance2 = to_center.length_squared();
        let emission = &context.emissions[self.emission as usize];
        let (wi, distance, pdf, normal) = if let Some(one_minus_cos) = self.one_minus_cos(distance2) {
            let d = distance2.sqrt();
            let axis = to_center / d;
            let wi = Frame::from_z(axis).to_world(uniform_cone(u, one_minus_cos)).normalize();
            // Nearest intersection, along the ray from the foot of the centre.
            let b = to_center.dot(wi);
            let foot2 = (to_center - wi * b).length_squared();
            let h = (self.radius * self.radius - foot2).max(0.0).sqrt();
            let distance = b - h;
            (wi, distance, uniform_cone_pdf(one_minus_cos), (wi * distance - to_center) / self.radius)
        } else {
            let normal = uniform_sphere(u);
            let d = to_center + normal * self.radius;
            let distance = d.length();
            let wi = d / distance;
            let cos = normal.dot(wi).abs();
            (wi, distance, distance * distance / (4.0 * PI * self.radius * self.radius * cos), normal)
        };
        let outside = normal.dot(wi) < 0.0;
        if !(emission.two_sided || outside != self.flip) || !(pdf.is_finite() && pdf > 0.0 && distance > 0.0)
        {
            return None;
        }
        let radiance =
            emission.radiance(context.textures, crate::scene::surface::sphere_uv(normal, &self.axes));
        Some(LightSample { wi, distance, radiance, pdf, is_delta: false })
    }

    #[inline]
    pub(super) fn pdf(&self, p: Vec3, distance: f32, cos: f32) -> f32 {
        match self.one_minus_cos((self.center - p).length_squared()) {
            Some(one_minus_cos) => uniform_cone_pdf(one_minus_cos),
            None => distance * distance / (4.0 * PI * self.radius * self.radius * cos),
        }
    }

    pub(super) fn power(&self, context: &LightContext<'_>) -> f32 {
        let e = &context.emissions[self.emission as usize];
        let sides = if e.two_sided { 2.0 } else { 1.0 };
        let mean = e.mean_luminance(context.textures, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        sides * PI * 4.0 * PI * self.radius * self.radius * mean
    }
}
