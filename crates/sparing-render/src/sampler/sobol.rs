//! Owen-scrambled Sobol points in two dimensions, shuffled per use ("padded").
//!
//! Sobol 1967 (first two dimensions); hash-based nested uniform scrambling and index shuffling after
//! B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; the hash constants are
//! N. Vegdahl's improvement of the Laine-Karras permutation (2021). Every power-of-two block of samples
//! is a (0, m, 2)-net.

/// One shuffled and scrambled sequence.
#[derive(Clone, Copy, Debug)]
pub struct OwenSobol {
    shuffle: u32,
    scramble: [u32; 2],
}

impl OwenSobol {
    /// The sequence of a seed; seeds should come out of a hash.
    #[inline]
    #[must_use]
    pub fn new(seed: u32) -> Self {
        let x = super::hash(seed.wrapping_mul(0x9e37_79b9) ^ 0x6a09_e667);
        let y = super::hash(seed.wrapping_mul(0x85eb_ca6b) ^ 0xbb67_ae85);
        Self { shuffle: seed, scramble: [x, y] }
    }

    /// Point `index` as 32-bit fractions.
    #[inline(always)]
    #[must_use]
    pub fn point(&self, index: u32) -> [u32; 2] {
        let shuffled = reverse_bits(laine_karras(reverse_bits(index), self.shuffle));
        // The radical inverse of the first dimension and the bit reversal around its scrambling cancel.
        let x = reverse_bits(laine_karras(shuffled, self.scramble[0]));
        let y = reverse_bits(laine_karras(pascal(shuffled), self.scramble[1]));
        [x, y]
    }
}

/// Point `index` of the sequence of `seed`.
#[inline]
#[must_use]
pub fn owen_sobol_2d(index: u32, seed: u32) -> [u32; 2] {
    OwenSobol::new(seed).point(index)
}

/// Spelled out so that loops over it become vector code.
#[inline(always)]
fn reverse_bits(x: u32) -> u32 {
    let x = (x >> 1) & 0x5555_5555 | (x & 0x5555_5555) << 1;
    let x = (x >> 2) & 0x3333_3333 | (x & 0x3333_3333) << 2;
    let x = (x >> 4) & 0x0f0f_0f0f | (x & 0x0f0f_0f0f) << 4;
    let x = (x >> 8) & 0x00ff_00ff | (x & 0x00ff_00ff) << 8;
    x.rotate_left(16)
}

/// A permutation in which each output bit depends only on input bits of the same or lower position: on
/// bit-reversed numbers that is an Owen scrambling.
#[inline(always)]
fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Product with Pascal's triangle modulo 2, the generator matrix of Sobol's second dimension, in
/// log2(32) steps: the matrix is a Kronecker power of [[1, 1], [0, 1]].
#[inline(always)]
fn pascal(mut x: u32) -> u32 {
    x ^= (x & 0xaaaa_aaaa) >> 1;
    x ^= (x & 0xcccc_cccc) >> 2;
    x ^= (x & 0xf0f0_f0f0) >> 4;
    x ^= (x & 0xff00_ff00) >> 8;
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference: direction numbers of Sobol's second dimension, v_k = v_{k-1} ^ (v_{k-1} >> 1).
    fn sobol_second(index: u32) -> u32 {
        let (mut v, mut r) = (1u32 << 31, 0);
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                r ^= v;
            }
            v ^= v >> 1;
        }
        r
    }

    #[test]
    fn pascal_product_is_the_second_sobol_dimension() {
        for i in (0..4096).chain([u32::MAX, 0x8000_0000, 0x1234_5678]) {
            assert_eq!(pascal(i).reverse_bits(), sobol_second(i), "index {i}");
        }
    }

    /// Every elementary interval of area 1/n of the first n = 2^m points, and of the second n, holds one.
    #[test]
    fn every_power_of_two_block_is_a_0_m_2_net() {
        for seed in [0, 1, 0xdead_beef, 42] {
            for m in 0..=12u32 {
                let n = 1u32 << m;
                for block in 0..2 {
                    let points: Vec<_> =
                        (block * n..(block + 1) * n).map(|i| owen_sobol_2d(i, seed)).collect();
                    for k in 0..=m {
                        let mut seen = vec![false; n as usize];
                        for [x, y] in &points {
                            let cx = u64::from(*x) >> (32 - k);
                            let cy = u64::from(*y) >> (32 - (m - k));
                            let cell = (cx << (m - k) | cy) as usize;
                            assert!(!seen[cell], "seed {seed} m {m} k {k} block {block}: cell {cell} twice");
                            seen[cell] = true;
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn scrambling_keeps_the_mean_of_a_smooth_function() {
        // x*y has mean 1/4; the error of a scrambled net of n points falls as n^-1.5.
        for seed in 0..50 {
            let n = 1024;
            let mean = (0..n)
                .map(|i| owen_sobol_2d(i, seed).map(|v| f64::from(v) / 4_294_967_296.0))
                .map(|[x, y]| x * y)
                .sum::<f64>()
                / f64::from(n);
            assert!((mean - 0.25).abs() < 3e-4, "seed {seed}: {mean}");
        }
    }
}
