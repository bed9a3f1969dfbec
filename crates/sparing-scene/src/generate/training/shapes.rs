//! Simple meshes that the scenes are put together from.

use crate::description::{Geometry, TriangleMesh};
use crate::generate::turn::turn;
use glam::{Affine3A, Mat3, Vec3};

/// A parallelogram spanned by the half axes `x` and `y`; its normal is `x` cross `y`. Texture coordinates 0..1.
pub(super) fn quad(center: Vec3, x: Vec3, y: Vec3) -> TriangleMesh {
    let corners = [center - x - y, center + x - y, center + x + y, center - x + y];
    TriangleMesh {
        positions: corners.map(|p| p.to_array()).to_vec(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        uvs: Some(vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        ..TriangleMesh::default()
    }
}

/// A horizontal square at height 0 that faces up.
pub(super) fn ground(half: f32) -> TriangleMesh {
    quad(Vec3::ZERO, Vec3::Z * half, Vec3::X * half)
}

/// The part of a parallelogram around an opening; `hole` is u0, u1, v0, v1 in 0..1.
pub(super) fn wall_with_hole(center: Vec3, x: Vec3, y: Vec3, hole: [f32; 4]) -> TriangleMesh {
    let [u0, u1, v0, v1] = hole;
    let part = |a0: f32, a1: f32, b0: f32, b1: f32| {
        quad(center + x * (a0 + a1 - 1.0) + y * (b0 + b1 - 1.0), x * (a1 - a0), y * (b1 - b0))
    };
    merge([part(0.0, u0, 0.0, 1.0), part(u1, 1.0, 0.0, 1.0), part(u0, u1, 0.0, v0), part(u0, u1, v1, 1.0)])
}

/// A rotation about y.
pub(super) fn yaw(turns: f32) -> Mat3 {
    let (sin, cos) = turn(turns);
    Mat3::from_cols(Vec3::new(cos, 0.0, -sin), Vec3::Y, Vec3::new(sin, 0.0, cos))
}

/// A rotation about x.
pub(super) fn pitch(turns: f32) -> Mat3 {
    let (sin, cos) = turn(turns);
    Mat3::from_cols(Vec3::X, Vec3::new(0.0, cos, sin), Vec3::new(0.0, -sin, cos))
}

/// A mesh rotated, scaled, then moved.
pub(super) fn place(mut mesh: TriangleMesh, position: Vec3, rotation: Mat3, scale: f32) -> TriangleMesh {
    for p in &mut mesh.positions {
        *p = (position + rotation * Vec3::from(*p) * scale).to_array();
    }
    for n in mesh.normals.iter_mut().flatten() {
        *n = (rotation * Vec3::from(*n)).to_array();
    }
    mesh
}

/// The transformation of [`place`], for instances.
pub(super) fn placement(position: Vec3, rotation: Mat3, scale: f32) -> Affine3A {
    Affine3A::from_mat3_translation(rotation * scale, position)
}

/// One mesh of many. All have texture coordinates or none, and so for normals; what not all have is dropped.
pub(super) fn merge(meshes: impl IntoIterator<Item = TriangleMesh>) -> TriangleMesh {
    let (mut all, mut normals, mut uvs) = (TriangleMesh::default(), Some(Vec::new()), Some(Vec::new()));
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(mesh.positions);
        all.indices.extend(mesh.indices.iter().map(|t| t.map(|i| i + first)));
        normals = normals.zip(mesh.normals).map(|(mut all, more)| {
            all.extend(more);
            all
        });
        uvs = uvs.zip(mesh.uvs).map(|(mut all, more)| {
            all.extend(more);
            all
        });
    }
    TriangleMesh { normals, uvs, ..all }
}

/// An upright prism or pyramid over a regular polygon, from height 0 to `height`, flat faces; `top` is the
/// upper radius as a share of the lower. Four corners make a box.
pub(super) fn prism(corners: u32, radius: f32, height: f32, top: f32) -> TriangleMesh {
    let corners = corners.max(3);
    let ring = |i: u32, r: f32, y: f32| {
        let (sin, cos) = turn((i % corners) as f32 / corners as f32);
        Vec3::new(r * cos, y, r * sin)
    };
    let mut mesh = TriangleMesh::default();
    let mut face = |a: Vec3, b: Vec3, c: Vec3| {
        if (b - a).cross(c - a).length() > 1e-9 {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([a, b, c].map(|p| p.to_array()));
            mesh.indices.push([first, first + 1, first + 2]);
        }
    };
    for i in 0..corners {
        let (a, b) = (ring(i, radius, 0.0), ring(i + 1, radius, 0.0));
        let (c, d) = (ring(i + 1, radius * top, height), ring(i, radius * top, height));
        face(a, c, b);
        face(a, d, c);
        face(Vec3::Y * height, c, d);
        face(Vec3::ZERO, a, b);
    }
    mesh
}

/// A box with its base at height 0.
pub(super) fn cuboid(half: Vec3) -> TriangleMesh {
    let (x, y, z) = (Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z);
    let middle = y;
    merge([
        quad(middle + x, z * -1.0, y),
        quad(middle - x, z, y),
        quad(middle + y, z, x),
        quad(middle - y, x, z),
        quad(middle + z, x, y),
        quad(middle - z, x * -1.0, y),
    ])
}

/// A tube with `sides` sides along a line of points, open at its ends, smooth normals.
pub(super) fn tube(points: &[Vec3], radius: f32, sides: u32) -> TriangleMesh {
    let sides = sides.max(3);
    let (mut mesh, mut normals) = (TriangleMesh::default(), Vec::new());
    for (i, &p) in points.iter().enumerate() {
        let ahead = points[(i + 1).min(points.len() - 1)] - points[i.saturating_sub(1)];
        let ahead = ahead.normalize_or(Vec3::Y);
        // An axis across that does not jump for smooth lines that are not nearly parallel to this direction.
        let across = ahead.cross(Vec3::new(0.31, 0.17, 0.94)).normalize_or(Vec3::X);
        let up = ahead.cross(across);
        for k in 0..sides {
            let (sin, cos) = turn(k as f32 / sides as f32);
            let n = across * cos + up * sin;
            mesh.positions.push((p + n * radius).to_array());
            normals.push(n.to_array());
        }
    }
    for i in 0..points.len().saturating_sub(1) as u32 {
        for k in 0..sides {
            let (a, b) = (i * sides + k, i * sides + (k + 1) % sides);
            mesh.indices.push([a, b, b + sides]);
            mesh.indices.push([a, b + sides, a + sides]);
        }
    }
    mesh.normals = Some(normals);
    mesh
}

/// A sphere.
pub(super) fn sphere(center: Vec3, radius: f32) -> Geometry {
    Geometry::Sphere { center, radius, axes: [Vec3::X, Vec3::NEG_Z, Vec3::Y] }
}

/// A disk that faces `normal`.
pub(super) fn disk(center: Vec3, normal: Vec3, radius: f32) -> Geometry {
    let normal = normal.normalize_or(Vec3::Y);
    Geometry::Disk { center, normal, tangent: normal.any_orthonormal_vector(), radius }
}

impl From<TriangleMesh> for Geometry {
    fn from(mesh: TriangleMesh) -> Self {
        Self::Triangles(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &TriangleMesh) -> f32 {
        let corner = |t: &[u32; 3]| t.map(|i| Vec3::from(mesh.positions[i as usize]));
        mesh.indices.iter().map(corner).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn bodies_turn_outwards() {
        assert!((volume(&cuboid(Vec3::new(1.0, 2.0, 3.0))) - 48.0).abs() < 1e-3);
        assert!((volume(&prism(4, 1.0, 1.0, 1.0)) - 2.0).abs() < 1e-5);
        assert!((volume(&prism(4, 1.0, 3.0, 0.0)) - 2.0).abs() < 1e-5);
        let straight = tube(&[Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0], 0.5, 64);
        for t in &straight.indices {
            let [a, b, c] = t.map(|i| Vec3::from(straight.positions[i as usize]));
            let n = Vec3::from(straight.normals.as_ref().unwrap()[t[0] as usize]);
            assert!((b - a).cross(c - a).dot(n) > 0.0);
        }
    }

    #[test]
    fn a_wall_keeps_its_area_less_the_hole() {
        let wall = wall_with_hole(Vec3::ZERO, Vec3::X, Vec3::Y, [0.25, 0.5, 0.5, 0.75]);
        let area: f32 = wall
            .indices
            .iter()
            .map(|t| t.map(|i| Vec3::from(wall.positions[i as usize])))
            .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
            .sum();
        assert!((area - (4.0 - 0.25)).abs() < 1e-5);
    }
}
