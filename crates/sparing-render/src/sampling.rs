//! Warps from the unit square to directions and surfaces, each with its density.
//!
//! Sources: P. Shirley and K. Chiu 1997 (concentric map), N. Malley's method for the cosine hemisphere,
//! E. Heitz 2019 "A low-distortion map between triangle and square"; M. Pharr, W. Jakob, G. Humphreys,
//! "Physically Based Rendering", 4th ed., appendix A.5.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

/// Unit disk, uniform; density 1/pi.
#[inline]
#[must_use]
pub fn concentric_disk(u: [f32; 2]) -> Vec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    // No branches: which half a sample falls into cannot be predicted.
    let steep = b.abs() >= a.abs();
    let (r, other) = if steep { (b, a) } else { (a, b) };
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let (sin, cos) = sin_cos_octant(FRAC_PI_4 * ratio);
    let (x, y) = if steep { (sin, cos) } else { (cos, sin) };
    Vec2::new(r * x, r * y)
}

/// Sine and cosine for |x| <= pi/4.
#[inline(always)]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let s = x + x * x2 * (-0.166_666_55 + x2 * (8.332_161e-3 + x2 * -1.951_529_6e-4));
    let c = 1.0 + x2 * (-0.5 + x2 * (4.166_664_6e-2 + x2 * (-1.388_731_6e-3 + x2 * 2.443_315_7e-5)));
    (s, c)
}

/// Sine and cosine for |x| <= pi by minimax polynomials, absolute error below 3e-7; several times faster
/// than the library's and the same on every machine.
#[inline]
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    // Reduce to |r| <= pi/4 around a multiple of pi/2.
    let k = ((x * (2.0 / PI) + 8.5) as i32 - 8) as f32; // rounds; the library's round is a call without SSE4.1
    let r = (x - k * 1.570_796_4) + k * 4.371_139e-8;
    let (s, c) = sin_cos_octant(r);
    // Quadrant k: swap for odd ones, then the signs.
    let k = k as i32;
    let (s, c) = if k & 1 == 0 { (s, c) } else { (c, s) };
    let negate = |v: f32, yes: i32| f32::from_bits(v.to_bits() ^ ((yes as u32) << 31));
    (negate(s, k >> 1 & 1), negate(c, (k + 1) >> 1 & 1))
}

/// Hemisphere around +z, density cos/pi.
#[inline]
#[must_use]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = concentric_disk(u);
    // Never exactly on the horizon, where the density is 0.
    Vec3::new(d.x, d.y, (1.0 - d.length_squared()).max(1e-12).sqrt())
}

/// Density of [`cosine_hemisphere`], per steradian.
#[inline]
#[must_use]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Sphere, uniform; density 1/(4 pi).
#[inline]
#[must_use]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos(PI * (2.0 * u[1] - 1.0));
    Vec3::new(r * cos, r * sin, z)
}

/// Cone of directions around +z, uniform. `one_minus_cos` is 1 - cos of its half-angle, which keeps its
/// digits for small cones.
#[inline]
#[must_use]
pub fn uniform_cone(u: [f32; 2], one_minus_cos: f32) -> Vec3 {
    let c = u[0] * one_minus_cos; // 1 - cos theta
    let r = (c * (2.0 - c)).max(0.0).sqrt();
    let (sin, cos) = sin_cos(PI * (2.0 * u[1] - 1.0));
    Vec3::new(r * cos, r * sin, 1.0 - c)
}

/// Density of [`uniform_cone`], per steradian.
#[inline]
#[must_use]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (2.0 * PI * one_minus_cos)
}

/// Barycentric weights (b1, b2) of a uniform point on a triangle.
#[inline]
#[must_use]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    if u[0] < u[1] {
        let b1 = u[0] * 0.5;
        [b1, u[1] - b1]
    } else {
        let b2 = u[1] * 0.5;
        [u[0] - b2, b2]
    }
}

/// An orthonormal frame; its z axis is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// Normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around a unit vector (T. Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
    #[inline]
    #[must_use]
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1.0f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// A frame around unit `z` whose x axis lies near `tangent`; any frame around z if that is degenerate.
    #[inline]
    #[must_use]
    pub fn from_z_and_tangent(z: Vec3, tangent: Vec3) -> Self {
        let x = tangent - z * z.dot(tangent);
        let length = x.length();
        if length > 1e-4 * tangent.length() && length.is_finite() && length > 0.0 {
            let x = x / length;
            // Once more: the first step cancels digits where the tangent is nearly the normal.
            let x = (x - z * z.dot(x)).normalize();
            Self { x, y: z.cross(x), z }
        } else {
            Self::from_z(z)
        }
    }

    /// World to local.
    #[inline]
    #[must_use]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Local to world.
    #[inline]
    #[must_use]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// Power heuristic with exponent 2 (E. Veach 1997, eq. 9.13): the weight of the strategy with density
/// `a` against one with density `b`. Right for one of the two infinite or zero, too.
#[inline]
#[must_use]
pub fn power_heuristic(a: f32, b: f32) -> f32 {
    let r = b / a;
    let w = 1.0 / (1.0 + r * r);
    if w.is_nan() { if a > b { 1.0 } else { 0.5 } } else { w }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sin_cos_matches_the_library() {
        for i in -100_000..=100_000 {
            let x = i as f32 * (PI / 100_000.0);
            let (s, c) = sin_cos(x);
            let (es, ec) = f64::from(x).sin_cos();
            assert!((f64::from(s) - es).abs() < 3e-7 && (f64::from(c) - ec).abs() < 3e-7, "{x}: {s} {c}");
        }
    }

    #[test]
    fn frames_are_orthonormal() {
        for i in 0..2000 {
            let u = [(i as f32 * 0.618_034).fract(), (i as f32 * 0.414_213_5).fract()];
            let z = uniform_sphere(u);
            for f in [Frame::from_z(z), Frame::from_z_and_tangent(z, Vec3::new(1.0, 2.0, -0.5))] {
                let m = glam::Mat3::from_cols(f.x, f.y, f.z);
                assert!((m.transpose() * m).abs_diff_eq(glam::Mat3::IDENTITY, 3e-6));
                let v = Vec3::new(0.3, -0.2, 0.9);
                assert!(f.to_world(f.to_local(v)).abs_diff_eq(v, 3e-6));
            }
        }
        assert!(Frame::from_z_and_tangent(Vec3::Z, Vec3::Z).x.is_finite());
        assert!(Frame::from_z_and_tangent(Vec3::Z, Vec3::NAN).x.is_finite());
    }

    #[test]
    fn power_heuristic_is_a_partition_of_one() {
        for (a, b) in [(1.0, 1.0), (1e-20, 1e20), (3.0, 0.5), (1e30, 1e30), (1.0, 0.0)] {
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-6, "{a} {b}");
        }
        assert_eq!(power_heuristic(f32::INFINITY, 1.0), 1.0);
        assert_eq!(power_heuristic(1.0, f32::INFINITY), 0.0);
    }
}
