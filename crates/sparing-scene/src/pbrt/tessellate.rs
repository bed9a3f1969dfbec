//! Round shapes as meshes: partial or sheared spheres, disks and cylinders. Texture coordinates as in pbrt.

use crate::description::TriangleMesh;
use std::f64::consts::TAU;

/// Segments of a full turn.
const AROUND: usize = 128;

/// A grid of `rows` + 1 by turn vertices; `at` gives position and normal for v in 0..=1 and an angle.
fn grid(phi_max: f64, rows: usize, at: impl Fn(f64, f64) -> ([f64; 3], [f64; 3])) -> TriangleMesh {
    let columns = ((AROUND as f64 * phi_max / TAU).ceil() as usize).max(3);
    let (mut positions, mut normals, mut uvs, mut indices) = (vec![], vec![], vec![], vec![]);
    for row in 0..=rows {
        for column in 0..=columns {
            let u = column as f64 / columns as f64;
            let v = row as f64 / rows as f64;
            let (p, n) = at(v, u * phi_max);
            positions.push(p.map(|x| x as f32));
            normals.push(n.map(|x| x as f32));
            uvs.push([u as f32, v as f32]);
        }
    }
    let width = columns as u32 + 1;
    for row in 0..rows as u32 {
        for column in 0..columns as u32 {
            let a = row * width + column;
            let (b, c, d) = (a + 1, a + width + 1, a + width);
            indices.push([a, b, c]);
            indices.push([a, c, d]);
        }
    }
    // The poles and the centre of a disk make slivers without area: they go here, not as a warning later.
    let point = |i: u32| glam::Vec3::from(positions[i as usize]);
    indices.retain(|&[a, b, c]: &[u32; 3]| {
        let (p, q, r) = (point(a), point(b), point(c));
        p.distance(q).min(q.distance(r)).min(r.distance(p))
            > 1e-6 * p.length().max(q.length()).max(r.length())
    });
    TriangleMesh { positions, indices, normals: Some(normals), uvs: Some(uvs), ..TriangleMesh::default() }
}

/// A sphere between two heights, for angles up to `phi_max` radians.
pub(super) fn sphere(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> TriangleMesh {
    let theta = |z: f64| (z / radius).clamp(-1.0, 1.0).acos();
    let (from, to) = (theta(z_min), theta(z_max));
    grid(phi_max, AROUND / 2, |v, phi| {
        let theta = from + v * (to - from);
        let n = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        (n.map(|x| x * radius), n)
    })
}

/// A disk or ring at a height.
pub(super) fn disk(height: f64, radius: f64, inner: f64, phi_max: f64) -> TriangleMesh {
    grid(phi_max, 1, |v, phi| {
        let r = radius + v * (inner - radius);
        ([r * phi.cos(), r * phi.sin(), height], [0.0, 0.0, 1.0])
    })
}

/// A tube between two heights.
pub(super) fn cylinder(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> TriangleMesh {
    grid(phi_max, 1, |v, phi| {
        let n = [phi.cos(), phi.sin(), 0.0];
        ([radius * n[0], radius * n[1], z_min + v * (z_max - z_min)], n)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn area(mesh: &TriangleMesh) -> f64 {
        let corner = |t: [u32; 3]| t.map(|i| glam::Vec3::from(mesh.positions[i as usize]));
        mesh.indices.iter().map(|&t| super::super::mesh::cross(corner(t)).length() / 2.0).sum()
    }

    #[test]
    fn areas_are_close_to_the_true_ones() {
        assert!((area(&sphere(2.0, -2.0, 2.0, TAU)) / (16.0 * PI) - 1.0).abs() < 2e-3);
        assert!((area(&sphere(2.0, 0.0, 2.0, PI)) / (4.0 * PI) - 1.0).abs() < 2e-3);
        assert!((area(&disk(1.0, 2.0, 1.0, TAU)) / (3.0 * PI) - 1.0).abs() < 2e-3);
        assert!((area(&cylinder(1.0, -1.0, 2.0, TAU)) / (6.0 * PI) - 1.0).abs() < 2e-3);
    }
}
