//! Plastic: a diffuse base under a dielectric coat.
//!
//! The coat reflects a share E(w) of the light from w; the rest enters, scatters, and what meets the coat from
//! below is partly reflected back, any number of times. With T = 1 - E, its mean T' over the hemisphere and
//! internal diffuse reflectance r, f = T(wo) T(wi) / (pi T') * albedo (1 - r) / (1 - albedo r): the geometric
//! series of internal reflections, coupled as by C. Kelemen and L. Szirmay-Kalos 2001, so that a white base
//! loses and gains nothing. E is the Fresnel reflectance for a smooth coat; a rough one reflects less at
//! grazing angles, which a small table per coat corrects.

use super::{BsdfSample, Evaluation, fresnel, microfacet::Ggx};
use crate::sampler::{Dimension, PixelSampler, SamplerKind};
use crate::sampling::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Nodes of the table along the cosine, at even steps of [`stretch`].
const COSINES: usize = 16;
/// Nodes along alpha, at squares of even steps, too: narrow lobes change fast near grazing angles.
const ALPHAS: usize = 17;

/// Directional albedo of a rough coat minus its Fresnel reflectance, and the means that follow.
#[derive(Clone, Debug)]
pub struct CoatTable {
    eta: f32,
    rows: Box<[CoatRow; ALPHAS]>,
}

/// The table at one roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatRow {
    /// Of the coat: how near to grazing angles it differs from a smooth one.
    alpha: f32,
    /// E(cos) - F(cos) at nodes.
    correction: [f32; COSINES],
    /// 1 / T', over pi.
    inv_mean: f32,
    /// Internal diffuse reflectance r.
    internal: f32,
}

/// A coated matte surface.
#[derive(Clone, Copy, Debug)]
pub struct CoatedDiffuse {
    /// Albedo of the base, in 0..1.
    pub reflectance: Vec3,
    /// Index of refraction of the coat.
    pub eta: f32,
    /// How the coat lets light through at this roughness.
    pub row: CoatRow,
    /// Microfacets of the coat.
    pub ggx: Ggx,
}

/// Position of node `i` of `n` in 0..1.
fn square(i: usize, n: usize) -> f32 {
    (i as f32 / (n - 1) as f32).powi(2)
}

/// Where a cosine is among the nodes, in 0..1. How much of a lobe is below the horizon or masked depends on the cosine over
/// alpha, however small both are.
#[inline]
fn stretch(cos: f32, alpha: f32) -> f32 {
    (cos * (1.0 + alpha) / (cos + alpha).max(f32::MIN_POSITIVE)).sqrt()
}

impl CoatTable {
    /// Integrates the coat of index `eta`; some milliseconds.
    #[must_use]
    pub fn new(eta: f32) -> Self {
        Self { eta, rows: Box::new(std::array::from_fn(|i| CoatRow::new(eta, square(i, ALPHAS)))) }
    }

    /// The row of a roughness, interpolated; anisotropic coats go by their mean.
    #[must_use]
    pub fn row(&self, ggx: &Ggx) -> CoatRow {
        let x = ggx.mean_alpha().sqrt() * (ALPHAS - 1) as f32;
        let i = (x as usize).min(ALPHAS - 2);
        let t = x - i as f32;
        let (a, b) = (&self.rows[i], &self.rows[i + 1]);
        let mix = |a: f32, b: f32| a + (b - a) * t;
        CoatRow {
            alpha: ggx.mean_alpha(),
            correction: std::array::from_fn(|k| mix(a.correction[k], b.correction[k])),
            inv_mean: mix(a.inv_mean, b.inv_mean),
            internal: mix(a.internal, b.internal),
        }
    }

    /// The coat on a base.
    #[must_use]
    pub fn coat(&self, reflectance: Vec3, ggx: Ggx) -> CoatedDiffuse {
        CoatedDiffuse { reflectance, eta: self.eta, row: self.row(&ggx), ggx }
    }
}

impl CoatRow {
    fn new(eta: f32, alpha: f32) -> Self {
        let ggx = Ggx::new(alpha, alpha);
        // The inverse of `stretch`.
        let cos = |i: usize| {
            let square = square(i, COSINES);
            if i + 1 == COSINES { 1.0 } else { square * alpha / (1.0 + alpha - square) }
        };
        let correction = std::array::from_fn(|i| {
            if ggx.is_smooth() {
                0.0
            } else {
                coat_albedo(eta, &ggx, cos(i).max(1e-6)) - fresnel::dielectric(cos(i), eta).0
            }
        });
        let mut row = Self { alpha, correction, inv_mean: 0.0, internal: 0.0 };
        // T' = 2 * the integral of T(c) c dc, with c = s².
        let n = 256;
        let sum: f64 = (0..n)
            .map(|i| {
                let s = (f64::from(i) + 0.5) / f64::from(n);
                f64::from(row.transmittance((s * s) as f32, eta)) * 4.0 * s * s * s
            })
            .sum();
        let mean = (sum / f64::from(n)) as f32;
        row.inv_mean = FRAC_1_PI / mean.max(1e-6);
        // Reciprocity: (1 - r) eta² = T'.
        row.internal = (1.0 - mean / (eta * eta)).clamp(0.0, 1.0);
        row
    }

    /// Share of light at this angle that enters the coat.
    #[inline]
    fn transmittance(&self, cos: f32, eta: f32) -> f32 {
        let x = stretch(cos.clamp(0.0, 1.0), self.alpha) * (COSINES - 1) as f32;
        let i = (x as usize).min(COSINES - 2);
        let t = x - i as f32;
        let correction = self.correction[i] + (self.correction[i + 1] - self.correction[i]) * t;
        (1.0 - fresnel::dielectric(cos, eta).0 - correction).clamp(0.0, 1.0)
    }
}

/// Reflected share of light from one angle: the mean weight of visible-normal samples.
fn coat_albedo(eta: f32, ggx: &Ggx, cos: f32) -> f32 {
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let sampler = PixelSampler::new(SamplerKind::Sobol, 0, 0, 0);
    let n = 1024;
    let sum: f32 = (0..n)
        .map(|i| {
            let wm = ggx.sample(wo, sampler.get_2d(i, 0, Dimension::Bsdf));
            let c = wo.dot(wm);
            let wi = 2.0 * c * wm - wo;
            if wi.z <= 0.0 || c <= 0.0 {
                0.0
            } else {
                fresnel::dielectric(c, eta).0 * ggx.g2(wo, wi) / ggx.g1(wo)
            }
        })
        .sum();
    sum / n as f32
}

impl CoatedDiffuse {
    /// The base's part of f with all internal reflections, without T(wo) T(wi).
    #[inline]
    fn base(&self) -> Vec3 {
        let r = self.row.internal;
        self.reflectance * ((1.0 - r) * self.row.inv_mean) / (Vec3::ONE - self.reflectance * r)
    }

    /// Probability of sampling the coat: its share of the reflected light.
    #[inline]
    fn coat_probability(&self, entering: f32) -> f32 {
        let r = self.row.internal;
        let a = self.reflectance.max_element();
        let base = entering * a * (1.0 - r) / (1.0 - a * r);
        let p = (1.0 - entering) / (1.0 - entering + base);
        if p.is_finite() { p.clamp(0.05, 0.95) } else { 0.5 }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Evaluation {
        if wi.z <= 0.0 {
            return Evaluation::ZERO;
        }
        let entering = self.row.transmittance(wo.z, self.eta);
        let p = self.coat_probability(entering);
        let mut e = Evaluation {
            f_cos: self.base() * (entering * self.row.transmittance(wi.z, self.eta) * wi.z),
            pdf: (1.0 - p) * cosine_hemisphere_pdf(wi.z),
        };
        if !self.ggx.is_smooth() {
            let wm = (wo + wi).normalize();
            let cos = wo.dot(wm).max(f32::MIN_POSITIVE);
            let (f, _) = fresnel::dielectric(cos, self.eta);
            e.f_cos += Vec3::splat(f * self.ggx.d(wm) * self.ggx.g2(wo, wi) / (4.0 * wo.z));
            e.pdf += p * self.ggx.visible_d(wo, wm) / (4.0 * cos);
        }
        e
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, lobe: f32, u: [f32; 2]) -> Option<BsdfSample> {
        let entering = self.row.transmittance(wo.z, self.eta);
        let p = self.coat_probability(entering);
        let wi = if lobe < p {
            if self.ggx.is_smooth() {
                let wi = Vec3::new(-wo.x, -wo.y, wo.z);
                let (f, _) = fresnel::dielectric(wo.z, self.eta);
                return Some(BsdfSample { wi, weight: Vec3::splat(f / p), pdf: p, is_delta: true });
            }
            let wm = self.ggx.sample(wo, u);
            2.0 * wo.dot(wm) * wm - wo
        } else {
            cosine_hemisphere(u)
        };
        let e = self.eval(wo, wi);
        (e.pdf > 0.0).then(|| BsdfSample { wi, weight: e.f_cos / e.pdf, pdf: e.pdf, is_delta: false })
    }
}
