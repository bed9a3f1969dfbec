//! Conversion between f32 and the bits of IEEE 754 binary16.

/// Exact.
#[must_use]
pub fn to_f32(bits: u16) -> f32 {
    let sign = u32::from(bits >> 15) << 31;
    let exponent = u32::from(bits >> 10) & 31;
    let fraction = u32::from(bits) & 0x3ff;
    match exponent {
        // Zero and subnormals: fraction * 2^-24 has at most ten significant bits.
        0 => f32::from_bits((fraction as f32 * f32::powi(2.0, -24)).to_bits() | sign),
        31 => f32::from_bits(sign | 0x7f80_0000 | fraction << 13),
        _ => f32::from_bits(sign | (exponent + 127 - 15) << 23 | fraction << 13),
    }
}

/// To nearest, ties to even; beyond 65504 + 8 it is infinity; NaN stays NaN.
#[must_use]
pub fn from_f32(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = (bits >> 16 & 0x8000) as u16;
    let magnitude = f32::from_bits(bits & 0x7fff_ffff);
    if magnitude.is_nan() {
        return sign | 0x7e00;
    }
    if magnitude >= 65520.0 {
        return sign | 0x7c00;
    }
    if magnitude < f32::powi(2.0, -14) {
        // In units of the smallest subnormal; the scaling is exact, rounding carries into the exponent.
        return sign | (magnitude * f32::powi(2.0, 24)).round_ties_even() as u16;
    }
    let bits = magnitude.to_bits() - ((127 - 15) << 23);
    let rounded = bits + 0xfff + (bits >> 13 & 1);
    sign | (rounded >> 13) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_half_survives_the_round_trip() {
        for bits in 0..=u16::MAX {
            let x = to_f32(bits);
            if x.is_nan() {
                assert!(to_f32(from_f32(x)).is_nan());
            } else {
                assert_eq!(from_f32(x), bits, "{x}");
            }
        }
    }

    #[test]
    fn known_values_and_rounding() {
        assert_eq!(to_f32(0x3c00), 1.0);
        assert_eq!(to_f32(0x7bff), 65504.0);
        assert_eq!(to_f32(0x0001), f32::powi(2.0, -24));
        assert_eq!(from_f32(65519.996), 0x7bff);
        assert_eq!(from_f32(65520.0), 0x7c00);
        assert_eq!(from_f32(-f32::INFINITY), 0xfc00);
        // Half way between two neighbours of 1: to even.
        assert_eq!(from_f32(1.0 + f32::powi(2.0, -11)), 0x3c00);
        assert_eq!(from_f32(1.0 + 3.0 * f32::powi(2.0, -11)), 0x3c02);
        assert_eq!(from_f32(f32::powi(2.0, -25)), 0);
        assert_eq!(from_f32(f32::powi(2.0, -25) * 1.001), 1);
        // The largest f32 below the smallest normal half rounds up to it.
        assert_eq!(from_f32(f32::from_bits(f32::powi(2.0, -14).to_bits() - 1)), 0x0400);
    }
}
