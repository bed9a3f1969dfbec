//! Value noise on the integer lattice, summed over octaves (Ebert et al., "Texturing and Modeling", ch. 2).

use glam::{IVec3, Vec3};

/// A value in -1..1 for a lattice point: an integer hash with the finaliser of MurmurHash3 (Appleby).
fn lattice(p: IVec3, seed: u32) -> f32 {
    let mut h = seed
        ^ (p.x as u32).wrapping_mul(0x8da6_b343)
        ^ (p.y as u32).wrapping_mul(0xd816_3841)
        ^ (p.z as u32).wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^= h >> 16;
    h as f32 / u32::MAX as f32 * 2.0 - 1.0
}

fn value_noise(p: Vec3, seed: u32) -> f32 {
    let base = p.floor();
    let t = p - base;
    // Quintic fade: first and second derivatives vanish at lattice points.
    let w = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let at = |x: i32, y: i32, z: i32| lattice(base.as_ivec3() + IVec3::new(x, y, z), seed);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |y: i32, z: i32| mix(at(0, y, z), at(1, y, z), w.x);
    mix(mix(edge(0, 0), edge(1, 0), w.y), mix(edge(0, 1), edge(1, 1), w.y), w.z)
}

/// Noise with octaves of half the size and half the height, roughly in -1..1.
#[must_use]
pub fn fractal_noise(p: Vec3, octaves: u32, seed: u32) -> f32 {
    let octave = |i: u32| {
        let scale = (1u32 << i.min(16)) as f32;
        value_noise(p * scale, seed.wrapping_add(i)) / scale
    };
    (0..octaves).map(octave).sum::<f32>() * 0.5
}
