//! Sample values as pure functions of (pixel, sample index, dimension, seed).

pub mod sobol;

use multiversion::multiversion;

pub use sparing_scene::description::SamplerKind;

/// What a two-dimensional sample is used for. Each use at each path vertex is a dimension of its own, with
/// its own scrambling, so that uses are independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Dimension {
    /// Position inside the pixel filter.
    Pixel = 0,
    /// Position on the lens.
    Lens = 1,
    /// Direction of the scattered ray.
    Bsdf = 2,
    /// Point on the light.
    Light = 3,
    /// First value: lobe of the BSDF. Second value: which light.
    Choice = 4,
    /// First value: Russian roulette. Second value: which material of a mix.
    Roulette = 5,
    /// First value: time between the opening and the closing of the shutter.
    Time = 6,
}

const DIMENSIONS_PER_VERTEX: u32 = 8;

/// Samples of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct PixelSampler {
    kind: SamplerKind,
    pixel_seed: u32,
}

impl PixelSampler {
    /// The sampler of pixel (`x`, `y`) of the full picture (not of a crop).
    #[must_use]
    pub fn new(kind: SamplerKind, seed: u64, x: u32, y: u32) -> Self {
        let seed = hash(seed as u32 ^ hash((seed >> 32) as u32 ^ 0x9e37_79b9));
        Self { kind, pixel_seed: hash(x ^ hash(y ^ seed)) }
    }

    /// [`PixelSampler::get_2d`] for samples `first..first + 16` at once.
    #[inline]
    #[must_use]
    pub fn get_2d_packet(&self, first: u32, vertex: u32, dimension: Dimension) -> [[f32; 16]; 2] {
        let seed = self.sequence_seed(vertex, dimension);
        match self.kind {
            SamplerKind::Sobol => sobol_packet(sobol::OwenSobol::new(seed), first),
            SamplerKind::Independent => independent_packet(seed, first),
        }
    }

    #[inline]
    fn sequence_seed(&self, vertex: u32, dimension: Dimension) -> u32 {
        let d = vertex * DIMENSIONS_PER_VERTEX + dimension as u32;
        hash(self.pixel_seed ^ d.wrapping_mul(0x9e37_79b9))
    }

    /// Two values in [0, 1) for sample `index`, path vertex `vertex` (0 is the camera).
    #[inline]
    #[must_use]
    pub fn get_2d(&self, index: u32, vertex: u32, dimension: Dimension) -> [f32; 2] {
        let seed = self.sequence_seed(vertex, dimension);
        let bits = match self.kind {
            SamplerKind::Sobol => sobol::owen_sobol_2d(index, seed),
            SamplerKind::Independent => independent(seed, index),
        };
        bits.map(to_unit_float)
    }
}

#[inline(always)]
fn independent(seed: u32, index: u32) -> [u32; 2] {
    let a = hash(index ^ seed);
    [a, hash(a ^ 0x68bc_21eb)]
}

// The same integer and exactly rounded operations on every instruction set: the values do not depend on it.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2"))]
fn sobol_packet(sequence: sobol::OwenSobol, first: u32) -> [[f32; 16]; 2] {
    packet(|i| sequence.point(i), first)
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2", "x86_64+avx2"))]
fn independent_packet(seed: u32, first: u32) -> [[f32; 16]; 2] {
    packet(|i| independent(seed, i), first)
}

#[inline(always)]
fn packet(point: impl Fn(u32) -> [u32; 2], first: u32) -> [[f32; 16]; 2] {
    let mut values = [[0.0; 16]; 2];
    let [x, y] = &mut values;
    for (lane, (x, y)) in x.iter_mut().zip(y).enumerate() {
        [*x, *y] = point(first.wrapping_add(lane as u32)).map(to_unit_float);
    }
    values
}

/// The upper 24 bits as a number in [0, 1 - 2^-24].
#[inline(always)]
#[must_use]
pub fn to_unit_float(bits: u32) -> f32 {
    // Through i32: unsigned conversion is a library of instructions before AVX-512.
    (bits >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// A bijective 32-bit mixer of low bias ("lowbias32" by C. Wellons, hash-prospector project, 2018).
#[inline(always)]
#[must_use]
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_in_the_unit_square_and_reproducible() {
        for kind in [SamplerKind::Sobol, SamplerKind::Independent] {
            let s = PixelSampler::new(kind, 7, 3, 4);
            for i in 0..1000 {
                for d in [Dimension::Pixel, Dimension::Light] {
                    let u = s.get_2d(i, i % 9, d);
                    assert!(u.iter().all(|v| (0.0..1.0).contains(v)));
                    assert_eq!(u, PixelSampler::new(kind, 7, 3, 4).get_2d(i, i % 9, d));
                }
            }
        }
        assert!(to_unit_float(u32::MAX) < 1.0);
    }

    #[test]
    fn packets_hold_the_same_values() {
        for kind in [SamplerKind::Sobol, SamplerKind::Independent] {
            let s = PixelSampler::new(kind, 1, 100, 7);
            for first in [0, 8, 16, 1000, u32::MAX - 3] {
                let packet = s.get_2d_packet(first, 3, Dimension::Light);
                for (lane, (x, y)) in packet[0].iter().zip(packet[1]).enumerate() {
                    let one = s.get_2d(first.wrapping_add(lane as u32), 3, Dimension::Light);
                    assert_eq!([*x, y], one);
                }
            }
        }
    }

    #[test]
    fn dimensions_pixels_and_seeds_are_uncorrelated() {
        // The correlation of n independent pairs has standard deviation 1/sqrt(n); 5 sigma over 45 pairs.
        let n = 4096;
        let columns: Vec<Vec<f32>> = (0..10)
            .map(|c| {
                let s = PixelSampler::new(SamplerKind::Sobol, (c % 2) as u64, c as u32 / 4, 5);
                (0..n).map(|i| s.get_2d(i, c as u32, Dimension::Bsdf)[c % 2]).collect()
            })
            .collect();
        for a in 0..columns.len() {
            for b in 0..a {
                let r: f64 = columns[a]
                    .iter()
                    .zip(&columns[b])
                    .map(|(x, y)| (f64::from(*x) - 0.5) * (f64::from(*y) - 0.5) * 12.0)
                    .sum::<f64>()
                    / f64::from(n);
                assert!(r.abs() < 5.0 / f64::from(n).sqrt(), "columns {a} and {b}: {r}");
            }
        }
    }
}
