//! Meshes made by formulas, for demo scenes, tests and benches. Sizes are free: a torus knot of 512 by 70
//! segments has 71 680 triangles, an icosphere of level 8 has 1.3 million.
//!
//! All surfaces have y up and normals that point outwards. Everything is deterministic.

mod noise;
mod solids;
mod surfaces;
mod teapot;
pub mod training;
mod turn;
mod write;

pub use noise::fractal_noise;
pub use solids::{gear, icosphere, rock};
pub use surfaces::{revolve, terrain, torus_knot, vase_profile};
pub use teapot::teapot;
pub use write::write_obj;

use crate::description::TriangleMesh;
use glam::Vec3;

/// Replaces the normals by averages of the adjacent triangles', weighted by area.
pub fn smooth_normals(mesh: &mut TriangleMesh) {
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.indices {
        let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]));
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&i| sums[i as usize] += normal);
    }
    mesh.normals = Some(sums.iter().map(|n| n.normalize_or(Vec3::Y).to_array()).collect());
}

/// Two triangles for each cell of a grid of `columns` by `rows` cells, vertices row by row.
fn grid_indices(columns: u32, rows: u32) -> Vec<[u32; 3]> {
    let width = columns + 1;
    let cell = |i: u32| {
        let a = i / columns * width + i % columns;
        let (b, c, d) = (a + 1, a + width + 1, a + width);
        [[a, b, c], [a, c, d]]
    };
    (0..columns * rows).flat_map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem: positive if triangles turn outwards.
    fn volume(mesh: &TriangleMesh) -> f32 {
        let corner = |t: [u32; 3]| t.map(|i| Vec3::from(mesh.positions[i as usize]));
        mesh.indices.iter().map(|&t| corner(t)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    fn normals_agree(mesh: &TriangleMesh) -> bool {
        let Some(normals) = &mesh.normals else { return true };
        mesh.indices.iter().all(|t| {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.positions[i as usize]));
            let sum: Vec3 = t.iter().map(|&i| Vec3::from(normals[i as usize])).sum();
            (b - a).cross(c - a).dot(sum) >= -1e-6
        })
    }

    #[test]
    fn solids_are_closed_and_turn_outwards() {
        let sphere = icosphere(4);
        assert_eq!(sphere.indices.len(), 20 * 4usize.pow(4));
        assert!((volume(&sphere) / (4.0 / 3.0 * std::f32::consts::PI) - 1.0).abs() < 0.01);
        for mesh in [sphere, rock(3, 0.3, 7), torus_knot(2, 3, 100, 12, 0.4), gear(12, 1.0, 0.3)] {
            assert!(volume(&mesh) > 0.0);
            assert!(normals_agree(&mesh));
        }
    }

    #[test]
    fn the_knot_of_the_benches_has_seventy_thousand_triangles() {
        let mesh = torus_knot(2, 3, 512, 70, 0.4);
        assert_eq!(mesh.indices.len(), 2 * 512 * 70);
        // A tube of radius r around a curve of length l has the volume pi r² l.
        let thin = torus_knot(2, 3, 512, 32, 0.05);
        let length: f32 = (0..512)
            .map(|i| {
                let at = |i: usize| Vec3::from(surfaces::knot_point(2.0, 3.0, i as f32 / 512.0));
                at(i).distance(at(i + 1))
            })
            .sum();
        let expected = std::f32::consts::PI * 0.05 * 0.05 * length;
        assert!((volume(&thin) / expected - 1.0).abs() < 0.02);
    }

    #[test]
    fn surfaces_of_revolution_have_normals_outwards() {
        let mesh = revolve(&vase_profile(40), 48);
        assert!(normals_agree(&mesh));
        assert_eq!(mesh.uvs.as_ref().map(Vec::len), Some(mesh.positions.len()));
    }

    #[test]
    fn terrain_points_up() {
        let mesh = terrain(16, 2.0, 0.3, 1);
        assert_eq!(mesh.indices.len(), 2 * 16 * 16);
        assert!(normals_agree(&mesh));
        assert!(mesh.normals.iter().flatten().all(|n| n[1] > 0.0));
    }

    #[test]
    fn obj_text_reads_back_the_same() {
        let mesh = torus_knot(2, 3, 20, 6, 0.4);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("knot.obj");
        write_obj(&mesh, std::fs::File::create(&path).unwrap()).unwrap();
        let scene = crate::load(&path).unwrap();
        // Ground and knot.
        assert_eq!(scene.triangle_count(), 2 + mesh.indices.len() as u64);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}
