//! Perlin noise and what textures make of it.
//!
//! Noise: K. Perlin, "Improving Noise", SIGGRAPH 2002, with his permutation. Sums of octaves, gusts of wind and
//! marble as in "Physically Based Rendering", 3rd edition, sections 10.6.3 to 10.6.6; there the number of octaves
//! also falls with distance, here all of them are summed.

use glam::Vec3;
use sparing_scene::description::Noise;

/// Perlin's permutation of 0..256.
#[rustfmt::skip]
const PERMUTATION: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225,
    140, 36, 103, 30, 69, 142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148,
    247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219, 203, 117, 35, 11, 32,
    57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175,
    74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122,
    60, 211, 133, 230, 220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54,
    65, 25, 63, 161, 1, 216, 80, 73, 209, 76, 132, 187, 208, 89, 18, 169,
    200, 196, 135, 130, 116, 188, 159, 86, 164, 100, 109, 198, 173, 186, 3, 64,
    52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82, 85, 212,
    207, 206, 59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213,
    119, 248, 152, 2, 44, 154, 163, 70, 221, 153, 101, 155, 167, 43, 172, 9,
    129, 22, 39, 253, 19, 98, 108, 110, 79, 113, 224, 232, 178, 185, 112, 104,
    218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179, 162, 241,
    81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157,
    184, 84, 204, 176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93,
    222, 114, 67, 29, 24, 72, 243, 141, 128, 195, 78, 66, 215, 61, 156, 180,
];

/// Each octave is that much finer: not quite 2, so that zeros of octaves do not coincide.
const LACUNARITY: f32 = 1.99;

fn permuted(i: i32) -> i32 {
    i32::from(PERMUTATION[(i & 255) as usize])
}

/// The gradient of a lattice point, times the offset from it: one of the twelve edges of a cube.
fn gradient(cell: [i32; 3], offset: Vec3) -> f32 {
    let h = permuted(permuted(permuted(cell[0]) + cell[1]) + cell[2]) & 15;
    let u = if h < 8 || h == 12 || h == 13 { offset.x } else { offset.y };
    let v = if h < 4 || h == 12 || h == 13 { offset.y } else { offset.z };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

/// Smooth noise in about -1..1, zero on the lattice of integers; it repeats after 256.
#[must_use]
pub fn noise(p: Vec3) -> f32 {
    // Far out, or without a value, the lattice has no digits left.
    let reduce = |x: f32| if x.abs() < 1e9 { x } else { 0.0 };
    let p = Vec3::new(reduce(p.x), reduce(p.y), reduce(p.z));
    let floor = p.floor();
    let d = p - floor;
    let cell = floor.to_array().map(|x| x as i32);
    let weight = d * d * d * (d * (d * 6.0 - 15.0) + 10.0);
    let corner = |x: i32, y: i32, z: i32| {
        let offset = d - Vec3::new(x as f32, y as f32, z as f32);
        gradient([cell[0] + x, cell[1] + y, cell[2] + z], offset)
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge = |y: i32, z: i32| mix(corner(0, y, z), corner(1, y, z), weight.x);
    let side = |z: i32| mix(edge(0, z), edge(1, z), weight.y);
    mix(side(0), side(1), weight.z)
}

/// Sum of octaves; `shape` is applied to each.
fn octaves(p: Vec3, count: u32, roughness: f32, shape: impl Fn(f32) -> f32) -> f32 {
    let (mut sum, mut frequency, mut amplitude) = (0.0, 1.0, 1.0);
    for _ in 0..count {
        sum += amplitude * shape(noise(p * frequency));
        frequency *= LACUNARITY;
        amplitude *= roughness;
    }
    sum
}

fn fbm(p: Vec3, count: u32, roughness: f32) -> f32 {
    octaves(p, count, roughness, |x| x)
}

/// A noise texture at a point of its space.
#[must_use]
pub fn eval(kind: Noise, p: Vec3) -> Vec3 {
    match kind {
        Noise::Fbm { octaves: count, roughness } => Vec3::splat(fbm(p, count, roughness)),
        Noise::Wrinkled { octaves: count, roughness } => Vec3::splat(octaves(p, count, roughness, f32::abs)),
        Noise::Windy => {
            let (gusts, waves) = (fbm(p * 0.1, 3, 0.5), fbm(p, 6, 0.5));
            Vec3::splat(gusts.abs() * waves)
        }
        Noise::Marble { octaves: count, roughness, scale, variation } => {
            let p = p * scale;
            marble(p.y + variation * fbm(p, count, roughness))
        }
    }
}

/// Colours of the layers: control points of overlapping cubic Bezier segments.
const LAYERS: [Vec3; 9] = [
    Vec3::new(0.58, 0.58, 0.6),
    Vec3::new(0.58, 0.58, 0.6),
    Vec3::new(0.58, 0.58, 0.6),
    Vec3::splat(0.5),
    Vec3::new(0.6, 0.59, 0.58),
    Vec3::new(0.58, 0.58, 0.6),
    Vec3::new(0.58, 0.58, 0.6),
    Vec3::new(0.2, 0.2, 0.33),
    Vec3::new(0.58, 0.58, 0.6),
];

/// The colour at a phase of the layers.
fn marble(phase: f32) -> Vec3 {
    let segments = LAYERS.len() - 3;
    let t = (0.5 + 0.5 * phase.sin()) * segments as f32;
    let first = (t.max(0.0) as usize).min(segments - 1);
    let t = t - first as f32;
    let s = 1.0 - t;
    let c = &LAYERS[first..first + 4];
    (c[0] * (s * s * s) + c[1] * (3.0 * s * s * t) + c[2] * (3.0 * s * t * t) + c[3] * (t * t * t)) * 1.5
}

/// Radius of the dots of a dot texture, in squares.
const DOT: f32 = 0.35;

/// Whether a point is in a dot: half of the unit squares around integers have one, shifted at random but inside its
/// square ("Physically Based Rendering", 3rd edition, section 10.5.2).
#[must_use]
pub fn in_dot(uv: [f32; 2]) -> bool {
    let cell = uv.map(|x| (x + 0.5).floor());
    let at = |du: f32, dv: f32| noise(Vec3::new(cell[0] + du, cell[1] + dv, 0.5));
    if at(0.5, 0.5) <= 0.0 {
        return false;
    }
    let shift = 0.5 - DOT;
    let center = [cell[0] + shift * at(1.5, 2.8), cell[1] + shift * at(4.5, 9.8)];
    (uv[0] - center[0]).powi(2) + (uv[1] - center[1]).powi(2) < DOT * DOT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_zero_on_the_lattice_and_continuous() {
        for i in 0..200 {
            let p = Vec3::new((i % 7) as f32, (i % 11) as f32 - 5.0, (i % 13) as f32);
            assert_eq!(noise(p), 0.0);
            let q = p + Vec3::new(0.3, 0.999_99, 0.6);
            assert!((noise(q) - noise(q + Vec3::new(0.0, 2e-5, 0.0))).abs() < 1e-3);
            assert!(noise(q).abs() <= 1.5);
        }
        for bad in [f32::NAN, f32::INFINITY, 1e30] {
            assert!(noise(Vec3::splat(bad)).is_finite());
        }
    }

    /// By hand at (0.5, 0, 0) in cell 0: all weights along y and z vanish, the two corners on the x axis have the
    /// gradients of P[P[P[0]]] = P[P[151]] = P[17] = 125 & 15 = 13 and P[P[P[1]]] = P[P[160]] = P[187] = 2.
    #[test]
    fn one_value_by_hand() {
        let h = |x: i32| permuted(permuted(permuted(x))) & 15;
        let part = |h: i32, dx: f32| {
            let u = if h < 8 || h == 12 || h == 13 { dx } else { 0.0 };
            if h & 1 == 0 { u } else { -u }
        };
        let expected = 0.5 * part(h(0), 0.5) + 0.5 * part(h(1), -0.5);
        assert!((noise(Vec3::new(0.5, 0.0, 0.0)) - expected).abs() < 1e-7);
    }

    #[test]
    fn sums_of_octaves_and_marble() {
        let p = Vec3::new(0.3, 1.7, -0.4);
        let one = eval(Noise::Fbm { octaves: 1, roughness: 0.5 }, p).x;
        assert_eq!(one, noise(p));
        let two = eval(Noise::Fbm { octaves: 2, roughness: 0.5 }, p).x;
        assert!((two - one - 0.5 * noise(p * 1.99)).abs() < 1e-6);
        assert!(eval(Noise::Wrinkled { octaves: 3, roughness: 0.5 }, p).x >= one.abs());
        // No variation: at height 0 the middle of the layers, (4 - 3/6...) by the Bezier weights 1, 0, 0, 0.
        let plain =
            eval(Noise::Marble { octaves: 8, roughness: 0.5, scale: 1.0, variation: 0.0 }, Vec3::ZERO);
        assert!(plain.abs_diff_eq(LAYERS[3] * 1.5, 1e-6), "{plain}");
    }

    /// A dot covers pi r² of half of the squares, roughly.
    #[test]
    fn dots_cover_their_share() {
        let n = 1000;
        let inside = (0..n * n).filter(|i| in_dot([(i % n) as f32 * 0.1, (i / n) as f32 * 0.1])).count();
        let share = inside as f32 / (n * n) as f32;
        assert!((share - 0.5 * std::f32::consts::PI * DOT * DOT).abs() < 0.05, "{share}");
    }
}
