//! Lights. Each kind has a file; [`Light`] is their closed union and [`LightTable`] picks among them.
//!
//! `sample` gives a direction from a point towards the light with the radiance that arrives from there if
//! nothing is in between, and its density per steradian; `pdf` is that density for a direction found in
//! another way. They must agree: the chi-square tests hold them to it.

pub mod alias;
pub mod disk;
pub mod environment;
pub mod flat;
pub mod picture;
pub mod point;
pub mod sphere;

pub use disk::DiskLight;
pub(crate) use environment::square_to_equal_area;
pub use environment::{Environment, EnvironmentMap};
pub use flat::FlatLight;
pub use picture::{GoniometricLight, ProjectionLight};
pub use point::{DistantLight, PointLight, SpotLight};
pub use sphere::SphereLight;

use crate::texture::{Color, TextureTable};
use alias::AliasTable;
use glam::Vec3;

/// Light from one sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction towards the light.
    pub wi: Vec3,
    /// Distance to the light; infinite where it has no place.
    pub distance: f32,
    /// Radiance that arrives (for delta lights: irradiance on a facing surface).
    pub radiance: Vec3,
    /// Density per steradian; 1 for delta lights.
    pub pdf: f32,
    /// Whether no ray can find the light by chance.
    pub is_delta: bool,
}

/// What a surface emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance.
    pub radiance: Color,
    /// Whether both sides emit.
    pub two_sided: bool,
}

impl Emission {
    /// Radiance at texture coordinates, never negative.
    #[inline]
    #[must_use]
    pub fn radiance(&self, textures: &TextureTable, uv: [f32; 2]) -> Vec3 {
        match self.radiance {
            Color::Constant(v) => v,
            color => textures.eval_color(color, uv).max(Vec3::ZERO),
        }
    }

    /// Luminance averaged over a grid of texture coordinates spanned by three corners.
    pub(crate) fn mean_luminance(&self, textures: &TextureTable, uvs: [[f32; 2]; 3]) -> f32 {
        if let Color::Constant(v) = self.radiance {
            return luminance(v);
        }
        let n = 8;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let (a, b) = ((i as f32 + 0.5) / n as f32, (j as f32 + 0.5) / n as f32);
                let at = |k: usize| uvs[0][k] + a * (uvs[1][k] - uvs[0][k]) + b * (uvs[2][k] - uvs[0][k]);
                sum += luminance(self.radiance(textures, [at(0), at(1)]));
            }
        }
        sum / (n * n) as f32
    }
}

/// Luminance of linear Rec.709.
#[inline]
#[must_use]
pub fn luminance(v: Vec3) -> f32 {
    v.dot(Vec3::new(0.212_671, 0.715_160, 0.072_169))
}

/// Everything that can be sampled.
#[derive(Clone, Debug)]
pub enum Light {
    /// Isotropic point.
    Point(PointLight),
    /// Point with a cone.
    Spot(SpotLight),
    /// Parallel light.
    Distant(DistantLight),
    /// Light from infinity.
    Environment(Environment),
    /// Triangle or parallelogram.
    Flat(FlatLight),
    /// Sphere.
    Sphere(SphereLight),
    /// Disk.
    Disk(DiskLight),
    /// Point with a picture of directions.
    Goniometric(Box<GoniometricLight>),
    /// Slide projector.
    Projection(Box<ProjectionLight>),
}

impl Light {
    /// A direction from `p` towards the light; `None` where it sends nothing to `p`.
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, p: Vec3, u: [f32; 2], context: &LightContext<'_>) -> Option<LightSample> {
        match self {
            Self::Flat(l) => l.sample(p, u, context),
            other => other.sample_other(p, u, context),
        }
    }

    /// The rarer lights, kept out of the inner loop's code.
    #[inline(never)]
    fn sample_other(&self, p: Vec3, u: [f32; 2], context: &LightContext<'_>) -> Option<LightSample> {
        match self {
            Self::Point(l) => l.sample(p),
            Self::Spot(l) => l.sample(p),
            Self::Distant(l) => Some(l.sample()),
            Self::Environment(l) => l.sample(u),
            Self::Flat(l) => l.sample(p, u, context),
            Self::Sphere(l) => l.sample(p, u, context),
            Self::Disk(l) => l.sample(p, u, context),
            Self::Goniometric(l) => l.sample(p),
            Self::Projection(l) => l.sample(p),
        }
    }

    /// Power in luminance units, roughly: what selection goes by.
    fn power(&self, scene_radius: f32, context: &LightContext<'_>) -> f32 {
        let p = match self {
            Self::Point(l) => l.power(),
            Self::Spot(l) => l.power(),
            Self::Distant(l) => l.power(scene_radius),
            Self::Environment(l) => l.power(scene_radius),
            Self::Flat(l) => l.power(context),
            Self::Sphere(l) => l.power(context),
            Self::Disk(l) => l.power(context),
            Self::Goniometric(l) => l.power(),
            Self::Projection(l) => l.power(),
        };
        if p.is_finite() { p.max(0.0) } else { 0.0 }
    }

    /// Whether rays can find the light by chance.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        matches!(
            self,
            Self::Point(_) | Self::Spot(_) | Self::Distant(_) | Self::Goniometric(_) | Self::Projection(_)
        )
    }
}

/// What emitting shapes look things up in.
#[derive(Clone, Copy, Debug)]
pub struct LightContext<'a> {
    /// Emissions by index.
    pub emissions: &'a [Emission],
    /// Textures.
    pub textures: &'a TextureTable,
}

/// All lights of a scene.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    lights: Vec<Light>,
    selection: AliasTable,
    environments: Vec<u32>,
}

impl LightTable {
    /// Prepares lights. `groups` gives for each light the source that it is part of (all triangles of one
    /// shape are one source): half of the samples go by power, half evenly to the sources, so that a dim lamp
    /// in a closed room is not starved by a bright sky outside.
    #[must_use]
    pub fn new(lights: Vec<Light>, groups: &[u32], scene_radius: f32, context: &LightContext<'_>) -> Self {
        let powers: Vec<f64> = lights.iter().map(|l| f64::from(l.power(scene_radius, context))).collect();
        let mut group_power = vec![0.0f64; groups.iter().max().map_or(0, |g| *g as usize + 1)];
        for (p, g) in powers.iter().zip(groups) {
            group_power[*g as usize] += p;
        }
        let total: f64 = group_power.iter().sum();
        let lit = group_power.iter().filter(|p| **p > 0.0).count().max(1) as f64;
        let weight = |(p, g): (&f64, &u32)| {
            let of_group = group_power[*g as usize];
            if of_group > 0.0 { 0.5 * p / total + 0.5 * p / (of_group * lit) } else { 0.0 }
        };
        let weights: Vec<f64> = powers.iter().zip(groups).map(weight).collect();
        let is_environment = |l: &Light| matches!(l, Light::Environment(_));
        let environments =
            lights.iter().enumerate().filter(|(_, l)| is_environment(l)).map(|(i, _)| i as u32).collect();
        Self { lights, selection: AliasTable::new(&weights), environments }
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The lights.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Whether any light can be chosen: one with no power never is.
    #[must_use]
    pub fn can_sample(&self) -> bool {
        !self.selection.is_empty()
    }

    /// Picks a light with `choice`, and a direction from `p` to it with `u`.
    #[inline]
    #[must_use]
    pub fn sample(
        &self,
        p: Vec3,
        choice: f32,
        u: [f32; 2],
        context: &LightContext<'_>,
    ) -> Option<LightSample> {
        let (index, probability) = self.selection.sample(choice);
        let mut s = self.lights[index as usize].sample(p, u, context)?;
        if s.is_delta {
            s.radiance /= probability;
        } else {
            s.pdf *= probability;
        }
        Some(s)
    }

    /// Density with which [`LightTable::sample`] from `p` finds the point at `distance` along `wi` of emitting
    /// light `index`; `cos` is that of the light's normal with the ray, absolute.
    #[inline]
    #[must_use]
    pub fn pdf_hit(&self, index: u32, p: Vec3, distance: f32, cos: f32) -> f32 {
        let pdf = match &self.lights[index as usize] {
            Light::Flat(l) => l.pdf(distance, cos),
            Light::Sphere(l) => l.pdf(p, distance, cos),
            Light::Disk(l) => l.pdf(distance, cos),
            _ => 0.0,
        };
        pdf * self.selection.probability(index)
    }

    /// Radiance from infinity along `wi`, all environments together, and its light-sampling density.
    #[inline]
    #[must_use]
    pub fn environment(&self, wi: Vec3) -> (Vec3, f32) {
        crate::counters::count(crate::counters::Counter::Environment);
        let (mut radiance, mut pdf) = (Vec3::ZERO, 0.0);
        for index in &self.environments {
            if let Light::Environment(e) = &self.lights[*index as usize] {
                radiance += e.radiance(wi);
                pdf += e.pdf(wi) * self.selection.probability(*index);
            }
        }
        (radiance, pdf)
    }
}
