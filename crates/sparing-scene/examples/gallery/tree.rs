//! A tree: branches that fork and bend up to the light, with leaves at their ends.

use super::Random;
use glam::{Quat, Vec3};
use sparing_scene::description::TriangleMesh;

const SIDES: u32 = 10;
const FORKS: u32 = 6;

/// Wood and leaves. The leaves are squares that a picture cuts out.
pub fn tree(seed: u64) -> (TriangleMesh, TriangleMesh) {
    let mut tree = Tree { random: Random(seed), wood: Surface::default(), leaves: Surface::default() };
    tree.branch(Vec3::ZERO, Vec3::Y, 1.5, 0.16, FORKS);
    (tree.wood.mesh(), tree.leaves.mesh())
}

#[derive(Default)]
struct Surface {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<[u32; 3]>,
}

impl Surface {
    fn mesh(self) -> TriangleMesh {
        let Self { positions, normals, uvs, indices } = self;
        TriangleMesh { positions, indices, normals: Some(normals), uvs: Some(uvs), ..TriangleMesh::default() }
    }
}

struct Tree {
    random: Random,
    wood: Surface,
    leaves: Surface,
}

impl Tree {
    fn branch(&mut self, from: Vec3, ahead: Vec3, length: f32, radius: f32, forks: u32) {
        const RINGS: u32 = 5;
        let (mut p, mut ahead) = (from, ahead);
        let mut ring = 0;
        for i in 0..=RINGS {
            let share = i as f32 / RINGS as f32;
            let r = radius * (1.0 - 0.38 * share) * if forks == FORKS && i == 0 { 1.5 } else { 1.0 };
            let first = self.ring(p, ahead, r, share * length);
            if i > 0 {
                for k in 0..SIDES {
                    let (a, b) = (ring + k, ring + k + 1);
                    let (c, d) = (first + k + 1, first + k);
                    self.wood.indices.extend([[a, b, c], [a, c, d]]);
                }
            }
            ring = first;
            if i < RINGS {
                let wind = Vec3::new(self.random.within(-1.0, 1.0), 0.35, self.random.within(-1.0, 1.0));
                ahead = (ahead + wind * 0.14).normalize();
                p += ahead * (length / RINGS as f32);
            }
            if forks < 3 && i > 0 {
                for _ in 0..if forks == 0 { 5 } else { 2 } {
                    self.leaf(p, ahead);
                }
            }
        }
        if forks == 0 {
            return;
        }
        let children = if forks == FORKS { 4 } else { 2 + u32::from(self.random.next() < 0.55) };
        let spin = self.random.within(0.0, std::f32::consts::TAU);
        for i in 0..children {
            let across = ahead.any_orthonormal_vector();
            let turn =
                spin + std::f32::consts::TAU * (i as f32 + self.random.within(-0.2, 0.2)) / children as f32;
            let side = Quat::from_axis_angle(ahead, turn) * across;
            let lean = self.random.within(0.45, 0.85);
            let next = (ahead + side * lean).normalize();
            let scale = self.random.within(0.68, 0.82);
            let thinner = 0.62 * self.random.within(0.85, 1.05);
            self.branch(p, next, length * scale, radius * thinner, forks - 1);
        }
    }

    fn ring(&mut self, center: Vec3, ahead: Vec3, radius: f32, along: f32) -> u32 {
        let first = self.wood.positions.len() as u32;
        // The same axis across for nearly the same direction, so that a branch does not twist.
        let across = ahead.cross(Vec3::new(0.35, 0.12, 0.93)).normalize();
        let up = ahead.cross(across);
        for k in 0..=SIDES {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / SIDES as f32).sin_cos();
            let n = across * cos + up * sin;
            self.wood.positions.push((center + n * radius).to_array());
            self.wood.normals.push(n.to_array());
            self.wood.uvs.push([k as f32 / SIDES as f32, along]);
        }
        first
    }

    fn leaf(&mut self, p: Vec3, ahead: Vec3) {
        let mut out = || self.random.within(-1.0, 1.0);
        let stalk = (ahead * 0.4 + Vec3::new(out(), out() - 0.2, out())).normalize_or(Vec3::Y);
        let across = stalk.cross(Vec3::new(out(), 1.5 + out(), out())).normalize_or(Vec3::X);
        let size = self.random.within(0.075, 0.12);
        let normal = across.cross(stalk);
        let first = self.leaves.positions.len() as u32;
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            // A leaf hangs a little at its tip.
            let corner =
                p + across * ((2.0 * u - 1.0) * size) + stalk * (2.0 * v * size) - Vec3::Y * (v * v * 0.03);
            self.leaves.positions.push(corner.to_array());
            self.leaves.normals.push(normal.to_array());
            self.leaves.uvs.push([u, v]);
        }
        self.leaves.indices.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
}
