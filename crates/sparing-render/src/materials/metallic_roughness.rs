//! The metallic-roughness model of glTF 2.0 (appendix B) with the extensions for transmission, index of refraction,
//! specular colour and clear coat: a mix of metal and of a dielectric layer over a matte or clear base.
//!
//! Facets are GGX with Schlick's Fresnel reflectance (C. Schlick 1994, eq. 15). What the layer lets through is 1 - E
//! of both directions, E being its directional albedo, over the mean of 1 - E (as C. Kelemen and L. Szirmay-Kalos
//! 2001): reciprocal, and a white base loses and gains nothing, whereas the 1 - F of the half angle in appendix B
//! gives back nearly twice the light at grazing angles. Schlick's formula is linear in F0 and F90, so E is, too, and
//! one table of two factors serves all materials. Transmission is that of a thin sheet: the reflected lobe turned to
//! the other side. A coat dims what is below it by 1 - E on the way in and on the way out.

use super::{Bsdf, BsdfSample, Evaluation, ShadingInput, microfacet::Ggx};
use crate::sampler::{Dimension, PixelSampler, SamplerKind};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::texture::{Color, Scalar, TextureTable};
use glam::Vec3;
use sparing_scene::description as d;
use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

/// Reflectance of the clear coat at normal incidence: an index of 1.5.
const COAT_F0: f32 = 0.04;

/// A surface, all textures looked up.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    /// Albedo of the base, reflectance of the metal, tint of transmitted light; in 0..1.
    pub base_color: Vec3,
    /// Share of metal.
    pub metallic: f32,
    /// Share of the dielectric's base that lets light through instead of scattering it.
    pub transmission: f32,
    /// Reflectance of the dielectric at normal incidence.
    pub f0: Vec3,
    /// Reflectance of the dielectric at grazing angles.
    pub f90: f32,
    /// Microfacets.
    pub ggx: Ggx,
    /// Share of the surface that is coated.
    pub clearcoat: f32,
    /// Microfacets of the coat.
    pub coat_ggx: Ggx,
}

/// Factors of F0 and F90 in the directional albedo of Schlick's microfacets, less those of a smooth surface.
struct AlbedoTable {
    rows: [[[f32; 2]; COSINES]; ALPHAS],
    /// Means over the hemisphere, weighted by the cosine.
    means: [[f32; 2]; ALPHAS],
}

/// Nodes along the cosine and along alpha, at squares of even steps.
const COSINES: usize = 24;
const ALPHAS: usize = 24;

static TABLE: LazyLock<AlbedoTable> = LazyLock::new(AlbedoTable::new);

fn square(i: usize, n: usize) -> f32 {
    (i as f32 / (n - 1) as f32).powi(2)
}

/// Factors of F0 and F90 in Schlick's reflectance.
#[inline]
fn schlick(cos: f32) -> [f32; 2] {
    let x = 1.0 - cos.clamp(0.0, 1.0);
    let x5 = (x * x) * (x * x) * x;
    [1.0 - x5, x5]
}

/// Where a value lies between the nodes at squares of even steps.
#[inline]
fn node(value: f32, n: usize) -> (usize, f32) {
    let x = value.clamp(0.0, 1.0).sqrt() * (n - 1) as f32;
    let i = (x as usize).min(n - 2);
    (i, x - i as f32)
}

#[inline]
fn mix(a: [f32; 2], b: [f32; 2], t: f32) -> [f32; 2] {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
}

impl AlbedoTable {
    fn new() -> Self {
        let mut table = Self { rows: [[[0.0; 2]; COSINES]; ALPHAS], means: [[0.0; 2]; ALPHAS] };
        for (i, row) in table.rows.iter_mut().enumerate() {
            let ggx = Ggx::new(square(i, ALPHAS), square(i, ALPHAS));
            for (k, entry) in row.iter_mut().enumerate().filter(|_| !ggx.is_smooth()) {
                let cos = square(k, COSINES).max(1e-4);
                let (rough, smooth) = (directional_albedo(&ggx, cos), schlick(cos));
                *entry = [rough[0] - smooth[0], rough[1] - smooth[1]];
            }
        }
        for i in 0..ALPHAS {
            // 2 * the integral of E(c) c dc, with c = s².
            let n = 256;
            let mut sum = [0.0f64; 2];
            for k in 0..n {
                let s = (f64::from(k) + 0.5) / f64::from(n);
                let e = table.factors((s * s) as f32, square(i, ALPHAS));
                sum = [0, 1].map(|j| sum[j] + f64::from(e[j]) * 4.0 * s * s * s);
            }
            table.means[i] = sum.map(|s| (s / f64::from(n)) as f32);
        }
        table
    }

    /// Factors of F0 and F90 in the directional albedo.
    #[inline]
    fn factors(&self, cos: f32, alpha: f32) -> [f32; 2] {
        let ((i, s), (k, t)) = (node(alpha, ALPHAS), node(cos, COSINES));
        let [a, b] = [i, i + 1].map(|i| mix(self.rows[i][k], self.rows[i][k + 1], t));
        let (correction, smooth) = (mix(a, b, s), schlick(cos));
        [smooth[0] + correction[0], smooth[1] + correction[1]]
    }

    #[inline]
    fn mean(&self, alpha: f32) -> [f32; 2] {
        let (i, s) = node(alpha, ALPHAS);
        mix(self.means[i], self.means[i + 1], s)
    }
}

/// The mean weights of visible-normal samples.
fn directional_albedo(ggx: &Ggx, cos: f32) -> [f32; 2] {
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let sampler = PixelSampler::new(SamplerKind::Sobol, 0, 0, 0);
    let n = 512;
    let mut sum = [0.0; 2];
    for i in 0..n {
        let wm = ggx.sample(wo, sampler.get_2d(i, 0, Dimension::Bsdf));
        let c = wo.dot(wm);
        let wi = 2.0 * c * wm - wo;
        if wi.z > 0.0 && c > 0.0 {
            let weight = ggx.g2(wo, wi) / ggx.g1(wo);
            let f = schlick(c);
            sum = [sum[0] + f[0] * weight, sum[1] + f[1] * weight];
        }
    }
    sum.map(|s| s / n as f32)
}

/// What depends on one direction: shares of light that get through the layers.
#[derive(Clone, Copy)]
struct Through {
    coat: f32,
    layer: f32,
}

/// Probabilities of the lobes.
struct Lobes {
    coat: f32,
    specular: f32,
    diffuse: f32,
    transmission: f32,
}

impl MetallicRoughness {
    fn metal_or_layer(&self, factors: [f32; 2]) -> Vec3 {
        let f0 = self.f0.lerp(self.base_color, self.metallic);
        let f90 = self.f90 + (1.0 - self.f90) * self.metallic;
        f0 * factors[0] + Vec3::splat(f90 * factors[1])
    }

    /// The largest channel of the layer's reflectance: what gets through keeps its colour.
    fn layer(&self, factors: [f32; 2]) -> f32 {
        (self.f0.max_element() * factors[0] + self.f90 * factors[1]).min(1.0)
    }

    fn coat_albedo(&self, cos: f32) -> f32 {
        if self.clearcoat == 0.0 {
            return 0.0;
        }
        let [a, b] = TABLE.factors(cos, self.coat_ggx.mean_alpha());
        self.clearcoat * (COAT_F0 * a + b).clamp(0.0, 1.0)
    }

    /// Factors of the albedo of the facets below the coat.
    fn factors(&self, cos: f32) -> [f32; 2] {
        TABLE.factors(cos, self.ggx.mean_alpha())
    }

    fn through(&self, cos: f32, factors: [f32; 2]) -> Through {
        Through { coat: 1.0 - self.coat_albedo(cos), layer: (1.0 - self.layer(factors)).max(0.0) }
    }

    /// Share of the base, as against metal.
    fn base(&self) -> f32 {
        1.0 - self.metallic
    }

    /// Matte part of f without what the direction of the light lets through.
    fn matte(&self, wo: Through) -> Vec3 {
        let share = self.base() * (1.0 - self.transmission);
        let mean = (1.0 - self.layer(TABLE.mean(self.ggx.mean_alpha()))).max(1e-4);
        self.base_color * (share * wo.layer * wo.coat * FRAC_1_PI / mean)
    }

    /// Each lobe's share of the reflected light.
    fn lobes(&self, factors: [f32; 2], wo: Through) -> Lobes {
        let color = self.base_color.max_element() * self.base() * wo.layer * wo.coat;
        let coat = 1.0 - wo.coat;
        let specular = self.metal_or_layer(factors).max_element() * wo.coat;
        let (diffuse, transmission) = (color * (1.0 - self.transmission), color * self.transmission);
        let sum = coat + specular + diffuse + transmission;
        if !(sum > 0.0 && sum.is_finite()) {
            return Lobes { coat: 0.0, specular: 1.0, diffuse: 0.0, transmission: 0.0 };
        }
        Lobes {
            coat: coat / sum,
            specular: specular / sum,
            diffuse: diffuse / sum,
            transmission: transmission / sum,
        }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wi.z == 0.0 {
            return Evaluation::ZERO;
        }
        let factors = self.factors(wo.z);
        let out = self.through(wo.z, factors);
        let lobes = self.lobes(factors, out);
        let cos_i = wi.z.abs();
        let mut e = Evaluation::ZERO;
        // Transmitted light is reflected light turned over.
        let turned = Vec3::new(wi.x, wi.y, cos_i);
        let wm = (wo + turned).normalize();
        let cos = wo.dot(wm).max(f32::MIN_POSITIVE);
        let fresnel = schlick(cos);
        let coat_in = 1.0 - self.coat_albedo(cos_i);
        let facets = |ggx: &Ggx| ggx.d(wm) * ggx.g2(wo, turned) / (4.0 * wo.z);
        let density = |ggx: &Ggx| ggx.visible_d(wo, wm) / (4.0 * cos);
        if wi.z < 0.0 {
            if lobes.transmission > 0.0 && !self.ggx.is_smooth() {
                let passed = self.base() * self.transmission * (1.0 - self.layer(fresnel));
                e.f_cos = self.base_color * (passed * facets(&self.ggx) * out.coat * coat_in);
                e.pdf = lobes.transmission * density(&self.ggx);
            }
            return e;
        }
        if lobes.diffuse > 0.0 {
            let light = self.through(cos_i, self.factors(cos_i));
            e.f_cos += self.matte(out) * (light.layer * light.coat * cos_i);
            e.pdf += lobes.diffuse * cosine_hemisphere_pdf(cos_i);
        }
        if !self.ggx.is_smooth() {
            e.f_cos += self.metal_or_layer(fresnel) * (facets(&self.ggx) * out.coat * coat_in);
            e.pdf += lobes.specular * density(&self.ggx);
        }
        if lobes.coat > 0.0 && !self.coat_ggx.is_smooth() {
            let f = self.clearcoat * (COAT_F0 * fresnel[0] + fresnel[1]);
            e.f_cos += Vec3::splat(f * facets(&self.coat_ggx));
            e.pdf += lobes.coat * density(&self.coat_ggx);
        }
        e
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let factors = self.factors(wo.z);
        let out = self.through(wo.z, factors);
        let lobes = self.lobes(factors, out);
        let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
        let delta = |wi: Vec3, value: Vec3, p: f32| {
            Some(BsdfSample { wi, weight: value / p, pdf: p, is_delta: true })
        };
        let reflect = |ggx: &Ggx| {
            let wm = ggx.sample(wo, u);
            let wi = 2.0 * wo.dot(wm) * wm - wo;
            (wi.z > 0.0).then_some(wi) // else a facet sends light into the surface: lost, as in the masking model
        };
        let fresnel = schlick(wo.z);
        let coat2 = out.coat * out.coat;
        let wi = if lobe < lobes.diffuse {
            cosine_hemisphere(u)
        } else if lobe < lobes.diffuse + lobes.coat {
            if self.coat_ggx.is_smooth() {
                let f = self.clearcoat * (COAT_F0 * fresnel[0] + fresnel[1]);
                return delta(mirror, Vec3::splat(f), lobes.coat);
            }
            reflect(&self.coat_ggx)?
        } else if lobe < lobes.diffuse + lobes.coat + lobes.transmission {
            if self.ggx.is_smooth() {
                let passed = self.base() * self.transmission * (1.0 - self.layer(fresnel)) * coat2;
                return delta(-wo, self.base_color * passed, lobes.transmission);
            }
            let wi = reflect(&self.ggx)?;
            Vec3::new(wi.x, wi.y, -wi.z)
        } else {
            if self.ggx.is_smooth() {
                return (lobes.specular > 0.0)
                    .then(|| delta(mirror, self.metal_or_layer(fresnel) * coat2, lobes.specular))?;
            }
            reflect(&self.ggx)?
        };
        let e = self.eval(wo, wi);
        (e.pdf > 0.0 && e.pdf.is_finite()).then(|| BsdfSample {
            wi,
            weight: e.f_cos / e.pdf,
            pdf: e.pdf,
            is_delta: false,
        })
    }

    /// Whether only mirror reflection and clear transmission are left.
    pub(super) fn is_all_delta(&self) -> bool {
        let matte = self.base() * (1.0 - self.transmission) > 0.0 && self.base_color != Vec3::ZERO;
        !matte && self.ggx.is_smooth() && (self.clearcoat == 0.0 || self.coat_ggx.is_smooth())
    }

    /// Whether light passes to the other side.
    pub(super) fn is_transmissive(&self) -> bool {
        self.base() * self.transmission > 0.0
    }
}

/// The parameters of a material before the textures are looked up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inputs {
    base_color: Color,
    metallic: Scalar,
    roughness: Scalar,
    /// Reflectance at normal incidence by the index of refraction alone.
    f0: f32,
    specular: Scalar,
    specular_color: Color,
    transmission: Scalar,
    clearcoat: Scalar,
    clearcoat_roughness: Scalar,
    vertex_colors: bool,
}

impl Inputs {
    pub fn new(m: &d::MetallicRoughness, textures: &TextureTable) -> Self {
        let r = (m.eta - 1.0) / (m.eta + 1.0);
        Self {
            base_color: textures.color(m.base_color),
            metallic: textures.scalar(m.metallic),
            roughness: textures.scalar(m.roughness),
            f0: r * r,
            specular: textures.scalar(m.specular),
            specular_color: textures.color(m.specular_color),
            transmission: textures.scalar(m.transmission),
            clearcoat: textures.scalar(m.clearcoat),
            clearcoat_roughness: textures.scalar(m.clearcoat_roughness),
            vertex_colors: m.vertex_colors,
        }
    }

    /// Whether it is the same at every point.
    pub fn is_constant(&self) -> bool {
        let colors = [self.base_color, self.specular_color];
        let scalars = [
            self.metallic,
            self.roughness,
            self.specular,
            self.transmission,
            self.clearcoat,
            self.clearcoat_roughness,
        ];
        !self.vertex_colors
            && colors.iter().all(|c| matches!(c, Color::Constant(_)))
            && scalars.iter().all(|s| matches!(s, Scalar::Constant(_)))
    }

    pub fn uses_vertex_colors(&self) -> bool {
        self.vertex_colors
    }

    pub fn is_transmissive(&self) -> bool {
        self.transmission != Scalar::Constant(0.0)
    }

    pub fn bsdf(&self, textures: &TextureTable, input: ShadingInput) -> Bsdf {
        let unit = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let number = |s: Scalar| unit(textures.eval_scalar(s, input.uv));
        let color = |c: Color| {
            let v = textures.eval_color(c, input.uv);
            Vec3::new(v.x.max(0.0), v.y.max(0.0), v.z.max(0.0))
        };
        let base = color(self.base_color);
        let base = if self.vertex_colors { base * input.color } else { base };
        let ggx = |s: Scalar| {
            let roughness = number(s);
            Ggx::new(roughness * roughness, roughness * roughness)
        };
        let f90 = number(self.specular);
        Bsdf::MetallicRoughness(MetallicRoughness {
            base_color: base.min(Vec3::ONE),
            metallic: number(self.metallic),
            transmission: number(self.transmission),
            f0: (color(self.specular_color) * self.f0).min(Vec3::ONE) * f90,
            f90,
            ggx: ggx(self.roughness),
            clearcoat: number(self.clearcoat),
            coat_ggx: ggx(self.clearcoat_roughness),
        })
    }
}
