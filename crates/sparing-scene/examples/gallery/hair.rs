//! Hair-like curves on a ball, combed over it and curling at their ends.

use super::Random;
use glam::Vec3;
use std::fmt::Write;

/// Bezier curves as pbrt text: one directive a hair.
pub fn ball(hairs: usize, seed: u64) -> String {
    let mut random = Random(seed);
    let mut text = String::new();
    for i in 0..hairs {
        // Points of a golden spiral are even on the sphere.
        let y = 1.0 - 2.0 * (i as f32 + 0.5) / hairs as f32;
        let angle = i as f32 * 2.399_963;
        let r = (1.0 - y * y).sqrt();
        let n = Vec3::new(r * angle.cos(), y, r * angle.sin());
        // Combed from the crown downwards and around.
        let comb = (Vec3::new(0.35, -1.0, 0.0) - n * Vec3::new(0.35, -1.0, 0.0).dot(n)).normalize_or(Vec3::X);
        let around = n.cross(comb);
        let mut little = |size: f32| random.within(-size, size);
        let lock = (angle * 3.0).sin() * 0.1;
        let length = 0.55 + little(0.12);
        let mut wild = || Vec3::new(little(0.035), little(0.035), little(0.035));
        let p0 = n;
        let p1 = n * (1.0 + 0.35 * length) + comb * 0.08 + wild();
        let p2 = n * (1.0 + 0.55 * length) + comb * (0.5 * length) + around * lock + wild();
        let p3 = n * (1.0 + 0.38 * length) + comb * (0.95 * length) + around * (2.2 * lock) + wild() * 1.5;
        let _ = write!(text, "Shape \"curve\" \"float width0\" 0.016 \"float width1\" 0.003 \"point3 P\" [");
        for p in [p0, p1, p2, p3] {
            let _ = write!(text, " {:.4} {:.4} {:.4}", p.x, p.y, p.z);
        }
        text.push_str(" ]\n");
    }
    text
}
