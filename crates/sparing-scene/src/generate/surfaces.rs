//! Surfaces over a grid of parameters, with normals and texture coordinates.

use super::turn::turn;
use super::{fractal_noise, grid_indices, smooth_normals};
use crate::description::TriangleMesh;
use glam::Vec3;
use std::f32::consts::TAU;

/// A point of the torus knot (p, q) for t in 0..1: the curve winds on a torus of radii 2 and 1.
pub(super) fn knot_point(p: f32, q: f32, t: f32) -> [f32; 3] {
    let ((around_sin, around_cos), (tube_sin, tube_cos)) = (turn(p * t), turn(q * t));
    let r = 2.0 + tube_cos;
    [r * around_cos, tube_sin, r * around_sin]
}

/// A tube of radius `tube` around the torus knot (p, q): `along` by `around` cells of two triangles.
#[must_use]
pub fn torus_knot(p: u32, q: u32, along: u32, around: u32, tube: f32) -> TriangleMesh {
    let (along, around) = (along.max(3), around.max(3));
    let point = |t: f32| Vec3::from(knot_point(p as f32, q as f32, t));
    let mut mesh = TriangleMesh::default();
    let (mut normals, mut uvs) = (Vec::new(), Vec::new());
    for i in 0..=along {
        // The last ring repeats the first for its texture coordinates.
        let t = (i % along) as f32 / along as f32;
        let center = point(t);
        let tangent = (point(t + 1e-3) - point(t - 1e-3)).normalize_or(Vec3::X);
        // The direction away from the axis of the torus is never along the curve.
        let side = tangent.cross(center.with_y(0.0)).normalize_or(Vec3::Y);
        let out = side.cross(tangent);
        for j in 0..=around {
            let (sin, cos) = turn((j % around) as f32 / around as f32);
            let normal = side * cos + out * sin;
            mesh.positions.push((center + normal * tube).to_array());
            normals.push(normal.to_array());
            uvs.push([j as f32 / around as f32, i as f32 / along as f32]);
        }
    }
    mesh.indices = grid_indices(around, along);
    finish(mesh, normals, uvs)
}

/// Turns a profile of (radius, height) points about the y axis. The profile goes round the outside from bottom
/// to top and may come back inside.
#[must_use]
pub fn revolve(profile: &[[f32; 2]], segments: u32) -> TriangleMesh {
    let segments = segments.max(3);
    let mut mesh = TriangleMesh::default();
    let (mut normals, mut uvs) = (Vec::new(), Vec::new());
    let last = profile.len().saturating_sub(1);
    for (i, &[radius, height]) in profile.iter().enumerate() {
        let (before, after) = (profile[i.saturating_sub(1)], profile[(i + 1).min(last)]);
        let (dr, dh) = (after[0] - before[0], after[1] - before[1]);
        for j in 0..=segments {
            let (sin, cos) = turn((j % segments) as f32 / segments as f32);
            mesh.positions.push([radius * cos, height, radius * sin]);
            normals.push(Vec3::new(dh * cos, -dr, dh * sin).normalize_or(Vec3::NEG_Y).to_array());
            uvs.push([j as f32 / segments as f32, i as f32 / last.max(1) as f32]);
        }
    }
    mesh.indices = grid_indices(segments, last as u32);
    let positions = &mesh.positions;
    let point = |i: u32| Vec3::from(positions[i as usize]);
    let area = |&[a, b, c]: &[u32; 3]| (point(b) - point(a)).cross(point(c) - point(a)).length();
    mesh.indices.retain(|t| area(t) > 0.0);
    finish(mesh, normals, uvs)
}

/// The profile of a vase with a rounded rim and an inside, about 2 high, for [`revolve`].
#[must_use]
pub fn vase_profile(steps: u32) -> Vec<[f32; 2]> {
    let steps = steps.max(8);
    let outside = |h: f32| 0.45 + 0.3 * turn((1.2 + 2.6 * h) / TAU).0 + 0.12 * h * h;
    let wall = 0.06;
    let height = 2.0;
    let share = |i: u32| i as f32 / steps as f32;
    let mut profile = vec![[0.0, 0.0], [0.5 * outside(0.0), 0.0]];
    profile.extend((0..=steps).map(|i| [outside(share(i)), height * share(i)]));
    let rim = |i: u32| {
        let (sin, cos) = turn(i as f32 / 16.0);
        [outside(1.0) - wall / 2.0 + wall / 2.0 * cos, height + wall / 2.0 * sin]
    };
    profile.extend((1..8).map(rim));
    let inside = |i: u32| {
        let h = (1.0 - share(i)).max(wall / height);
        [outside(h) - wall, height * h]
    };
    profile.extend((0..=steps).map(inside));
    profile.push([0.0, wall]);
    profile.dedup();
    profile
}

/// A square of hills: `cells` by `cells` over `size`, heights about within `height`.
#[must_use]
pub fn terrain(cells: u32, size: f32, height: f32, seed: u32) -> TriangleMesh {
    let cells = cells.max(1);
    let mut mesh = TriangleMesh::default();
    let mut uvs = Vec::new();
    for row in 0..=cells {
        for column in 0..=cells {
            let (u, v) = (column as f32 / cells as f32, row as f32 / cells as f32);
            let y = height * fractal_noise(Vec3::new(4.0 * u, 0.5, 4.0 * v), 6, seed);
            // Rows go towards -z so that triangles turn upwards.
            mesh.positions.push([(u - 0.5) * size, y, (0.5 - v) * size]);
            uvs.push([u, v]);
        }
    }
    mesh.indices = grid_indices(cells, cells);
    smooth_normals(&mut mesh);
    mesh.uvs = Some(uvs);
    mesh
}

/// Adds normals and texture coordinates and turns each triangle to its normals' side.
fn finish(mut mesh: TriangleMesh, normals: Vec<[f32; 3]>, uvs: Vec<[f32; 2]>) -> TriangleMesh {
    let positions = &mesh.positions;
    for t in &mut mesh.indices {
        let [a, b, c] = t.map(|i| Vec3::from(positions[i as usize]));
        let normal: Vec3 = t.iter().map(|&i| Vec3::from(normals[i as usize])).sum();
        if (b - a).cross(c - a).dot(normal) < 0.0 {
            t.swap(1, 2);
        }
    }
    mesh.normals = Some(normals);
    mesh.uvs = Some(uvs);
    mesh
}
