//! Emitting triangles and parallelograms, sampled evenly by area.

use super::{LightContext, LightSample};
use crate::sampling::uniform_triangle;
use glam::Vec3;

/// A triangle or a parallelogram.
#[derive(Clone, Copy, Debug)]
pub struct FlatLight {
    /// A corner.
    pub corner: Vec3,
    /// Edge from the corner.
    pub edge_u: Vec3,
    /// Edge from the corner.
    pub edge_v: Vec3,
    /// Unit normal on the emitting side.
    pub normal: Vec3,
    /// Whether the whole parallelogram emits, not only the triangle at the corner.
    pub parallelogram: bool,
    /// Texture coordinates at the corner and at the ends of the edges.
    pub uvs: [[f32; 2]; 3],
    /// Index of the emission.
    pub emission: u32,
    /// 1 / area.
    inv_area: f32,
}

impl FlatLight {
    /// `None` if it has no area. `flip` turns the emitting side from that of `edge_u x edge_v`.
    #[must_use]
    pub fn new(
        corner: Vec3,
        edge_u: Vec3,
        edge_v: Vec3,
        flip: bool,
        parallelogram: bool,
        uvs: [[f32; 2]; 3],
        emission: u32,
    ) -> Option<Self> {
        let n = edge_u.cross(edge_v);
        let length = n.length();
        let area = if parallelogram { length } else { 0.5 * length };
        let (normal, inv_area) = (if flip { -n } else { n } / length, 1.0 / area);
        (normal.is_finite() && inv_area.is_finite() && inv_area > 0.0).then_some(Self {
            corner,
            edge_u,
            edge_v,
            normal,
            parallelogram,
            uvs,
            emission,
            inv_area,
        })
    }

    #[inline]
    pub(super) fn sample(&self, p: Vec3, u: [f32; 2], context: &LightContext<'_>) -> Option<LightSample> {
        let [a, b] = if self.parallelogram { u } else { uniform_triangle(u) };
        let d = self.corner - p + self.edge_u * a + self.edge_v * b;
        let distance2 = d.length_squared();
        let distance = distance2.sqrt();
        let wi = d / distance;
        let cos = -self.normal.dot(wi);
        let emission = &context.emissions[self.emission as usize];
        if !(cos > 0.0 || (emission.two_sided && cos < 0.0)) {
            return None;
        }
        let pdf = self.pdf(distance, cos.abs());
        let at = |k: usize| {
            self.uvs[0][k] + a * (self.uvs[1][k] - self.uvs[0][k]) + b * (self.uvs[2][k] - self.uvs[0][k])
        };
        let radiance = emission.radiance(context.textures, [at(0), at(1)]);
        (pdf.is_finite() && pdf > 0.0).then_some(LightSample { wi, distance, radiance, pdf, is_delta: false })
    }

    #[inline]
    pub(super) fn pdf(&self, distance: f32, cos: f32) -> f32 {
        distance * distance * self.inv_area / cos
    }

    pub(super) fn power(&self, context: &LightContext<'_>) -> f32 {
        let e = &context.emissions[self.emission as usize];
        let sides = if e.two_sided { 2.0 } else { 1.0 };
        sides * std::f32::consts::PI / self.inv_area * e.mean_luminance(context.textures, self.uvs)
    }
}
