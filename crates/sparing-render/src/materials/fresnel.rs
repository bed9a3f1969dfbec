//! Fresnel reflectance. Sources: "Physically Based Rendering", 4th ed., section 9.3; the conductor in real
//! arithmetic after S. Lagarde, "Memo on Fresnel equations", 2013.

use glam::Vec3;

/// Reflectance of a dielectric for unpolarised light. `cos_i` in [0, 1] on the incident side; `eta` is the
/// index of the other side over the incident side's. Also returns the cosine of the refracted ray
/// (0 at total internal reflection).
#[inline]
#[must_use]
pub fn dielectric(cos_i: f32, eta: f32) -> (f32, f32) {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    if sin2_t >= 1.0 {
        return (1.0, 0.0);
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    (0.5 * (parallel * parallel + perpendicular * perpendicular), cos_t)
}

/// Reflectance of a conductor per channel, `eta` and `k` relative to the outside; `cos_i` in [0, 1].
#[inline]
#[must_use]
pub fn conductor(cos_i: f32, eta: Vec3, k: Vec3) -> Vec3 {
    let cos2 = cos_i * cos_i;
    let sin2 = 1.0 - cos2;
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let a2_plus_b2 = sqrt(t0 * t0 + 4.0 * eta2 * k2);
    let t1 = a2_plus_b2 + cos2;
    let a = sqrt((0.5 * (a2_plus_b2 + t0)).max(Vec3::ZERO));
    let t2 = 2.0 * cos_i * a;
    let rs = (t1 - t2) / (t1 + t2).max(Vec3::splat(f32::MIN_POSITIVE));
    let t3 = cos2 * a2_plus_b2 + sin2 * sin2;
    let t4 = t2 * sin2;
    let rp = rs * (t3 - t4) / (t3 + t4).max(Vec3::splat(f32::MIN_POSITIVE));
    (0.5 * (rs + rp)).clamp(Vec3::ZERO, Vec3::ONE)
}

fn sqrt(v: Vec3) -> Vec3 {
    Vec3::new(v.x.sqrt(), v.y.sqrt(), v.z.sqrt())
}

/// Mean reflectance of a dielectric under uniform diffuse light from outside: 2 times the integral of
/// F(c) c over c in [0, 1], by the midpoint rule after c = s² (error below 1e-5 for eta in 1..4).
#[must_use]
pub fn diffuse_reflectance(eta: f32) -> f32 {
    let n = 512;
    let sum: f64 = (0..n)
        .map(|i| {
            let s = (f64::from(i) + 0.5) / f64::from(n);
            let c = s * s;
            f64::from(dielectric(c as f32, eta).0) * c * 2.0 * s
        })
        .sum();
    (2.0 * sum / f64::from(n)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_known_values() {
        assert!((dielectric(1.0, 1.5).0 - 0.04).abs() < 1e-6);
        assert!((dielectric(1.0, 1.0 / 1.5).0 - 0.04).abs() < 1e-6);
        assert!((dielectric(0.0, 1.5).0 - 1.0).abs() < 1e-6);
        assert_eq!(dielectric(0.5, 1.0 / 1.5).0, 1.0); // beyond the critical angle of 41.8 degrees
        assert!(dielectric(0.3, 1.0).0 < 1e-12);
        // Brewster's angle: the parallel part vanishes, F = perpendicular / 2.
        let c = 1.5f32.atan().cos();
        let (f, ct) = dielectric(c, 1.5);
        let perpendicular = (c - 1.5 * ct) / (c + 1.5 * ct);
        assert!((f - 0.5 * perpendicular * perpendicular).abs() < 1e-6);
    }

    #[test]
    fn conductor_limits() {
        // k = 0 is a dielectric.
        for c in [0.05, 0.3, 0.7, 1.0] {
            let f = conductor(c, Vec3::splat(1.5), Vec3::ZERO).x;
            assert!((f - dielectric(c, 1.5).0).abs() < 2e-5, "{c}: {f}");
        }
        // Normal incidence: ((eta-1)^2 + k^2) / ((eta+1)^2 + k^2).
        let f = conductor(1.0, Vec3::splat(0.2), Vec3::splat(3.0)).x;
        assert!((f - (0.64 + 9.0) / (1.44 + 9.0)).abs() < 1e-6);
        for (e, k) in [(1e-6, 1e6), (1e4, 0.0), (0.0, 0.0), (1.0, 1e-9)] {
            for c in [0.0, 1e-7, 0.5, 1.0] {
                let f = conductor(c, Vec3::splat(e), Vec3::splat(k)).x;
                assert!((0.0..=1.0).contains(&f), "eta {e} k {k} cos {c}: {f}");
            }
        }
    }

    #[test]
    fn diffuse_reflectance_of_glass() {
        // 0.0918 for eta = 1.5 (A. Ryde 1931; also Egan and Hilgeman 1979).
        assert!((diffuse_reflectance(1.5) - 0.0918).abs() < 1e-4, "{}", diffuse_reflectance(1.5));
        assert!(diffuse_reflectance(1.0) < 1e-6);
    }
}
