//! Random choices that are the same on every machine: integers and exactly rounded operations only.

use glam::Vec3;
use std::cell::Cell;

/// SplitMix64 (G. Steele, D. Lea and C. Flood 2014, figure 17).
///
/// Draws need no exclusive borrow, so that they can stand among the arguments of what changes a scene.
pub(super) struct Random(Cell<u64>);

impl Random {
    /// A stream of its own for each list of keys.
    pub fn new(keys: &[u64]) -> Self {
        let random = Self(Cell::new(0));
        for key in keys {
            random.0.set(random.bits() ^ key);
        }
        random
    }

    /// 64 random bits.
    pub fn bits(&self) -> u64 {
        let mut z = self.0.get().wrapping_add(0x9e37_79b9_7f4a_7c15);
        self.0.set(z);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    pub fn unit(&self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform between two numbers.
    pub fn range(&self, from: f32, to: f32) -> f32 {
        from + (to - from) * self.unit()
    }

    /// Between `from` and `from` times 2^`octaves`, about evenly in the logarithm.
    pub fn octaves(&self, from: f32, octaves: f32) -> f32 {
        let exponent = self.unit() * octaves;
        let whole = exponent.floor();
        from * power_of_two(whole as i32) * (1.0 + exponent - whole)
    }

    /// One of 0, 1, ... `count` - 1.
    pub fn below(&self, count: u32) -> u32 {
        // 32 random bits times the count: the bias is far below what anyone could see.
        (((self.bits() >> 32) * u64::from(count)) >> 32) as u32
    }

    /// True with this probability.
    pub fn chance(&self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// One of the choices.
    pub fn pick<T: Copy, const N: usize>(&self, choices: [T; N]) -> T {
        choices[self.below(N as u32) as usize]
    }

    /// A colour of this hue in 0..1 (red, yellow, green, ...), of full value, `saturation` away from white.
    pub fn hue(hue: f32, saturation: f32) -> Vec3 {
        // The triangle wave of the HSV cone (A. R. Smith 1978).
        let channel = |offset: f32| {
            let x = (hue + offset).rem_euclid(1.0) * 6.0;
            ((x - 3.0).abs() - 1.0).clamp(0.0, 1.0)
        };
        let pure = Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0));
        Vec3::ONE + (pure - Vec3::ONE) * saturation
    }
}

/// 2^`exponent`, exactly.
pub(super) fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((exponent.clamp(-126, 127) + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_in_their_ranges_and_streams_differ() {
        let random = Random::new(&[1, 2]);
        for _ in 0..1000 {
            assert!((2.0..3.0).contains(&random.range(2.0, 3.0)));
            assert!((0.5..4.0).contains(&random.octaves(0.5, 3.0)));
            assert!(random.below(3) < 3);
        }
        assert_ne!(Random::new(&[1, 2]).bits(), Random::new(&[2, 1]).bits());
        assert_eq!(Random::hue(0.0, 1.0), Vec3::X);
        assert_eq!(Random::hue(2.0 / 3.0, 1.0).z, 1.0);
        assert_eq!(power_of_two(-3), 0.125);
    }
}
