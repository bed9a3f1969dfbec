//! The anisotropic GGX (Trowbridge-Reitz) microfacet distribution with visible-normal sampling.
//!
//! B. Walter et al. 2007; E. Heitz 2014 "Understanding the Masking-Shadowing Function" (height-correlated
//! G2, eq. 99); J. Dupuy and A. Benyoub 2023 "Sampling Visible GGX Normals with Spherical Caps".
//! Directions are local, z is the normal, all on the upper side.

use crate::sampling::sin_cos;
use glam::Vec3;
use std::f32::consts::PI;

/// Below this alpha a surface is treated as perfectly smooth: its lobe is narrower than a milliradian.
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// GGX with widths `alpha` along x and y, each at least [`SMOOTH_ALPHA`] unless smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha_x: f32,
    alpha_y: f32,
}

impl Ggx {
    /// From widths in 0..1; NaN counts as 0.
    #[inline]
    #[must_use]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        let (alpha_x, alpha_y) = (alpha_x.clamp(0.0, 1.0), alpha_y.clamp(0.0, 1.0));
        let clean = |a: f32| if a.is_nan() { 0.0 } else { a };
        let (x, y) = (clean(alpha_x), clean(alpha_y));
        if x.max(y) < SMOOTH_ALPHA {
            Self { alpha_x: 0.0, alpha_y: 0.0 }
        } else {
            Self { alpha_x: x.max(SMOOTH_ALPHA), alpha_y: y.max(SMOOTH_ALPHA) }
        }
    }

    /// Whether this is a mirror.
    #[inline]
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        self.alpha_x == 0.0
    }

    /// Whether the two widths differ.
    #[inline]
    #[must_use]
    pub fn is_anisotropic(&self) -> bool {
        self.alpha_x != self.alpha_y
    }

    /// Geometric mean of the widths.
    #[inline]
    #[must_use]
    pub fn mean_alpha(&self) -> f32 {
        (self.alpha_x * self.alpha_y).sqrt()
    }

    /// Density of normals D(wm), 1/sr of projected area.
    #[inline]
    #[must_use]
    pub fn d(&self, wm: Vec3) -> f32 {
        let (x, y) = (wm.x / self.alpha_x, wm.y / self.alpha_y);
        let s = x * x + y * y + wm.z * wm.z;
        1.0 / (PI * self.alpha_x * self.alpha_y * s * s)
    }

    #[inline]
    fn lambda(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        let a = (x * x + y * y) / (w.z * w.z);
        if a.is_finite() { 0.5 * ((1.0 + a).sqrt() - 1.0) } else { f32::MAX }
    }

    /// Masking of one direction.
    #[inline]
    #[must_use]
    pub fn g1(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Height-correlated masking and shadowing for directions on the same or on opposite sides.
    #[inline]
    #[must_use]
    pub fn g2(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// Density of visible normals seen from `wo` (upper side).
    #[inline]
    #[must_use]
    pub fn visible_d(&self, wo: Vec3, wm: Vec3) -> f32 {
        // G1 / wo.z = 2 / (wo.z + sqrt(wo.z² + (ax wo.x)² + (ay wo.y)²)) has no 0/0 at grazing angles.
        let (x, y) = (self.alpha_x * wo.x, self.alpha_y * wo.y);
        let g1_over_z = 2.0 / (wo.z + (wo.z * wo.z + x * x + y * y).sqrt());
        g1_over_z * wo.dot(wm).max(0.0) * self.d(wm)
    }

    /// A normal visible from `wo` (upper side), distributed as [`Ggx::visible_d`].
    #[inline]
    #[must_use]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let w = Vec3::new(wo.x * self.alpha_x, wo.y * self.alpha_y, wo.z).normalize();
        let z = (1.0 - u[1]) * (1.0 + w.z) - w.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = sin_cos(PI * (2.0 * u[0] - 1.0));
        let h = Vec3::new(r * cos, r * sin, z) + w;
        Vec3::new(h.x * self.alpha_x, h.y * self.alpha_y, h.z.max(1e-9)).normalize()
    }
}
