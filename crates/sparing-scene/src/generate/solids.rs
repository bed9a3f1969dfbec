//! Closed bodies.

use super::turn::turn;
use super::{fractal_noise, smooth_normals};
use crate::description::TriangleMesh;
use glam::Vec3;
use std::collections::HashMap;

/// A unit sphere from an icosahedron whose triangles are split in four `level` times (at most 10).
#[must_use]
pub fn icosphere(level: u32) -> TriangleMesh {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let corners = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    // The faces are the triples of corners at the distance of an edge, which is 2.
    let points: Vec<Vec3> = corners.map(Vec3::from).to_vec();
    let edge = |a: usize, b: usize| (points[a].distance(points[b]) - 2.0).abs() < 1e-3;
    let mut indices = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if edge(a, b) && edge(b, c) && edge(c, a) {
                    let outwards = (points[b] - points[a]).cross(points[c] - points[a]).dot(points[a]) > 0.0;
                    let (b, c) = if outwards { (b, c) } else { (c, b) };
                    indices.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    let mut points: Vec<Vec3> = points.into_iter().map(Vec3::normalize).collect();
    for _ in 0..level.min(10) {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let split = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        indices = indices.into_iter().flat_map(split).collect();
    }
    let positions: Vec<[f32; 3]> = points.iter().map(Vec3::to_array).collect();
    TriangleMesh { normals: Some(positions.clone()), positions, indices, ..TriangleMesh::default() }
}

/// An icosphere displaced by noise of the given height.
#[must_use]
pub fn rock(level: u32, height: f32, seed: u32) -> TriangleMesh {
    let mut mesh = icosphere(level);
    for position in &mut mesh.positions {
        let p = Vec3::from(*position);
        *position = (p * (1.0 + height * fractal_noise(p * 1.5, 6, seed))).to_array();
    }
    smooth_normals(&mut mesh);
    mesh
}

/// A flat gear wheel about the y axis with a round hole: sharp edges, no vertex normals.
#[must_use]
pub fn gear(teeth: u32, radius: f32, thickness: f32) -> TriangleMesh {
    let teeth = teeth.max(3);
    // Four angles a tooth: root, root, tip, tip.
    let steps = 4 * teeth;
    let mut mesh = TriangleMesh::default();
    for i in 0..steps {
        let outer = if i % 4 < 2 { 0.82 * radius } else { radius };
        let (sin, cos) = turn((i as f32 + 0.25 * (i % 2) as f32) / steps as f32);
        for (r, y) in [(outer, 0.5), (outer, -0.5), (0.35 * radius, -0.5), (0.35 * radius, 0.5)] {
            mesh.positions.push([r * cos, y * thickness, r * sin]);
        }
    }
    for i in 0..steps {
        let (here, next) = (4 * i, 4 * ((i + 1) % steps));
        for side in 0..4 {
            let other = (side + 1) % 4;
            let (a, b, c, d) = (here + side, next + side, next + other, here + other);
            mesh.indices.push([a, b, c]);
            mesh.indices.push([a, c, d]);
        }
    }
    mesh
}
