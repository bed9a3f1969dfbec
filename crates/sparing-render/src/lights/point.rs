//! Lights without a size: point, spot, distant.

use super::{LightSample, luminance};
use glam::Vec3;
use sparing_scene::description::SpotEdge;
use std::f32::consts::PI;

/// Isotropic point light.
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    /// World position.
    pub position: Vec3,
    /// W/sr.
    pub intensity: Vec3,
}

impl PointLight {
    #[inline]
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        from_point(self.position, self.intensity, p)
    }

    pub(super) fn power(&self) -> f32 {
        4.0 * PI * luminance(self.intensity)
    }
}

#[inline]
pub(super) fn from_point(position: Vec3, intensity: Vec3, p: Vec3) -> Option<LightSample> {
    let d = position - p;
    let distance = d.length();
    if !(distance > 0.0 && distance.is_finite()) {
        return None;
    }
    // Divided twice: the square of a tiny distance would underflow.
    let radiance = intensity / distance / distance;
    Some(LightSample { wi: d / distance, distance, radiance, pdf: 1.0, is_delta: true })
}

/// Point light with a cone whose edge falls off in the cosine.
#[derive(Clone, Copy, Debug)]
pub struct SpotLight {
    /// World position.
    pub position: Vec3,
    /// Unit axis.
    pub direction: Vec3,
    /// W/sr on the axis.
    pub intensity: Vec3,
    /// Cosine at which the fall-off starts.
    pub cos_start: f32,
    /// Cosine at which the light ends.
    pub cos_end: f32,
    /// How it falls off in between.
    pub edge: SpotEdge,
}

impl SpotLight {
    #[inline]
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        let mut s = from_point(self.position, self.intensity, p)?;
        let falloff = self.falloff(-s.wi.dot(self.direction));
        s.radiance *= falloff;
        (falloff > 0.0).then_some(s)
    }

    fn falloff(&self, cos: f32) -> f32 {
        if cos <= self.cos_end {
            return 0.0;
        }
        let t = (cos - self.cos_end) / (self.cos_start - self.cos_end);
        let t = if t.is_nan() { 1.0 } else { t.min(1.0) };
        match self.edge {
            SpotEdge::Smooth => t * t * (3.0 - 2.0 * t),
            SpotEdge::Square => t * t,
            SpotEdge::Fourth => (t * t) * (t * t),
        }
    }

    pub(super) fn power(&self) -> f32 {
        // The edge integrates to this part of the ring.
        let part = match self.edge {
            SpotEdge::Smooth => 1.0 / 2.0,
            SpotEdge::Square => 1.0 / 3.0,
            SpotEdge::Fourth => 1.0 / 5.0,
        };
        let cone = (1.0 - self.cos_start) + part * (self.cos_start - self.cos_end);
        2.0 * PI * cone * luminance(self.intensity)
    }
}

/// Parallel light.
#[derive(Clone, Copy, Debug)]
pub struct DistantLight {
    /// Unit direction towards the light.
    pub towards: Vec3,
    /// Irradiance on a facing surface.
    pub irradiance: Vec3,
}

impl DistantLight {
    #[inline]
    pub(super) fn sample(&self) -> LightSample {
        let (wi, radiance) = (self.towards, self.irradiance);
        LightSample { wi, distance: f32::INFINITY, radiance, pdf: 1.0, is_delta: true }
    }

    pub(super) fn power(&self, scene_radius: f32) -> f32 {
        PI * scene_radius * scene_radius * luminance(self.irradiance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_square() {
        let l = PointLight { position: Vec3::new(0.0, 3.0, 0.0), intensity: Vec3::splat(18.0) };
        let s = l.sample(Vec3::ZERO).expect("it is lit");
        assert_eq!((s.wi, s.distance, s.radiance), (Vec3::Y, 3.0, Vec3::splat(2.0)));
        assert!(l.sample(l.position).is_none());
        let tiny = l.sample(Vec3::new(1e-25, 3.0, 0.0));
        assert!(tiny.is_none_or(|s| !s.radiance.is_nan()));
    }

    #[test]
    fn spot_falls_off_smoothly_and_its_power_is_the_integral() {
        let (start, end) = (20f32.to_radians().cos(), 40f32.to_radians().cos());
        for (edge, middle) in [(SpotEdge::Smooth, 0.5), (SpotEdge::Square, 0.25), (SpotEdge::Fourth, 0.0625)]
        {
            let l = SpotLight {
                position: Vec3::ZERO,
                direction: Vec3::Z,
                intensity: Vec3::ONE,
                cos_start: start,
                cos_end: end,
                edge,
            };
            assert_eq!(l.falloff(1.0), 1.0);
            assert_eq!(l.falloff(end), 0.0);
            assert!((l.falloff((start + end) / 2.0) - middle).abs() < 1e-6);
            // The mean of the sphere in steps of the cosine, within the cone.
            let n = 100_000;
            let at = |i: i32| l.falloff(1.0 - (1.0 - end) * (i as f32 + 0.5) / n as f32);
            let integral = (0..n).map(at).sum::<f32>() * (1.0 - end) / n as f32 * 2.0 * PI;
            assert!((integral / l.power() - 1.0).abs() < 1e-3, "{edge:?}: {integral} {}", l.power());
        }
    }
}
