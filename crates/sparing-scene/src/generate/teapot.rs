//! The teapot of M. Newell, "The Utilization of Procedure Models in Digital Image Synthesis" (1975): 32 bicubic Bezier
//! patches. Six of them are turned into four quarters, four (handle and spout) are mirrored.

use super::grid_indices;
use crate::description::TriangleMesh;
use glam::{Vec3, vec3};

type Patch = [[Vec3; 4]; 4];

/// Control points of a quarter circle: the tangents' length that the data has, in radii.
const QUARTER: f32 = 0.56;

/// Radius and height of four control points from one end of a surface of revolution to the other.
const PROFILES: [[[f32; 2]; 4]; 6] = [
    [[1.4, 2.4], [1.3375, 2.53125], [1.4375, 2.53125], [1.5, 2.4]], // rim
    [[1.5, 2.4], [1.75, 1.875], [2.0, 1.35], [2.0, 0.9]],           // body
    [[2.0, 0.9], [2.0, 0.45], [1.5, 0.225], [1.5, 0.15]],
    [[0.0, 3.15], [0.8, 3.15], [0.0, 2.85], [0.2, 2.7]], // lid
    [[0.2, 2.7], [0.4, 2.55], [1.3, 2.55], [1.3, 2.4]],
    [[0.0, 0.0], [1.425, 0.0], [1.5, 0.075], [1.5, 0.15]], // bottom
];

/// Half a tube: for each of four rows x and height of its inner and its outer end, and how far the middle bulges.
type HalfTube = [([f32; 2], [f32; 2], f32); 4];

const TUBES: [HalfTube; 4] = [
    // Handle.
    [
        ([-1.6, 2.025], [-1.5, 2.25], 0.3),
        ([-2.3, 2.025], [-2.5, 2.25], 0.3),
        ([-2.7, 2.025], [-3.0, 2.25], 0.3),
        ([-2.7, 1.8], [-3.0, 1.8], 0.3),
    ],
    [
        ([-2.7, 1.8], [-3.0, 1.8], 0.3),
        ([-2.7, 1.575], [-3.0, 1.35], 0.3),
        ([-2.5, 1.125], [-2.65, 0.9375], 0.3),
        ([-2.0, 0.9], [-1.9, 0.6], 0.3),
    ],
    // Spout.
    [
        ([1.7, 1.425], [1.7, 0.6], 0.66),
        ([2.6, 1.425], [3.1, 0.825], 0.66),
        ([2.3, 2.1], [2.4, 2.025], 0.25),
        ([2.7, 2.4], [3.3, 2.4], 0.25),
    ],
    [
        ([2.7, 2.4], [3.3, 2.4], 0.25),
        ([2.8, 2.475], [3.525, 2.49375], 0.25),
        ([2.9, 2.475], [3.45, 2.5125], 0.15),
        ([2.8, 2.4], [3.2, 2.4], 0.15),
    ],
];

/// The 32 patches, y up, and for each a point that is inside of it.
fn patches() -> Vec<(Patch, Vec3)> {
    let mut all = Vec::new();
    for profile in PROFILES {
        for quarter in 0..4 {
            let turned = |x: f32, z: f32, y: f32| match quarter {
                0 => vec3(x, y, z),
                1 => vec3(-z, y, x),
                2 => vec3(-x, y, -z),
                _ => vec3(z, y, -x),
            };
            let row = |[r, y]: [f32; 2]| {
                [turned(r, 0.0, y), turned(r, r * QUARTER, y), turned(r * QUARTER, r, y), turned(0.0, r, y)]
            };
            all.push((profile.map(row), Vec3::Y * 1.2));
        }
    }
    for tube in TUBES {
        for side in [1.0, -1.0] {
            let row = |([x0, y0], [x1, y1], bulge): ([f32; 2], [f32; 2], f32)| {
                let z = side * bulge;
                [vec3(x0, y0, 0.0), vec3(x0, y0, z), vec3(x1, y1, z), vec3(x1, y1, 0.0)]
            };
            let inside = tube.iter().map(|(a, b, _)| vec3(a[0] + b[0], a[1] + b[1], 0.0)).sum::<Vec3>() / 8.0;
            all.push((tube.map(row), inside));
        }
    }
    all
}

/// Cubic Bernstein polynomials and their derivatives.
fn bernstein(t: f32) -> ([f32; 4], [f32; 4]) {
    let s = 1.0 - t;
    let value = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    (value, [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t])
}

fn sum(patch: &Patch, rows: [f32; 4], columns: [f32; 4]) -> Vec3 {
    let row = |r: &[Vec3; 4]| (0..4).map(|k| r[k] * columns[k]).sum::<Vec3>();
    (0..4).map(|j| row(&patch[j]) * rows[j]).sum()
}

/// Position and normal, of either sign.
fn point(patch: &Patch, u: f32, v: f32) -> (Vec3, Vec3) {
    let ((bu, _), (bv, _)) = (bernstein(u), bernstein(v));
    // Where all of a row is one point, the normal is that beside it.
    let near = |t: f32| t.clamp(1e-3, 1.0 - 1e-3);
    let ((nu, du), (nv, dv)) = (bernstein(near(u)), bernstein(near(v)));
    let normal = sum(patch, du, nv).cross(sum(patch, nu, dv));
    (sum(patch, bu, bv), normal.normalize_or(Vec3::Y))
}

/// The teapot, 3.15 high and standing on y = 0, its spout along x: `cells` by `cells` cells a patch.
#[must_use]
pub fn teapot(cells: u32) -> TriangleMesh {
    let cells = cells.clamp(1, 1024);
    let (mut mesh, mut normals, mut uvs) = (TriangleMesh::default(), Vec::new(), Vec::new());
    for (patch, inside) in patches() {
        let first = mesh.positions.len() as u32;
        let share = |i: u32| i as f32 / cells as f32;
        let points: Vec<(Vec3, Vec3)> = (0..=cells)
            .flat_map(|j| (0..=cells).map(move |i| (i, j)))
            .map(|(i, j)| point(&patch, share(j), share(i)))
            .collect();
        let outwards: f32 = points.iter().map(|(p, n)| (*p - inside).dot(*n)).sum();
        for (i, (p, n)) in points.iter().enumerate() {
            mesh.positions.push(p.to_array());
            normals.push((*n * outwards.signum()).to_array());
            let [i, j] = [i as u32 % (cells + 1), i as u32 / (cells + 1)];
            uvs.push([share(i), share(j)]);
        }
        for mut t in grid_indices(cells, cells) {
            let corners = t.map(|i| points[i as usize].0);
            let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let normal: Vec3 = t.iter().map(|&i| points[i as usize].1 * outwards.signum()).sum();
            if area.length() <= 1e-7 {
                continue;
            }
            if area.dot(normal) < 0.0 {
                t.swap(1, 2);
            }
            mesh.indices.push(t.map(|i| i + first));
        }
    }
    mesh.normals = Some(normals);
    mesh.uvs = Some(uvs);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_32_patches_that_meet_at_their_edges() {
        let all = patches();
        assert_eq!(all.len(), 32);
        let edges = |p: &Patch| {
            let column = |k: usize| [0, 1, 2, 3].map(|j| p[j][k]);
            [p[0], p[3], column(0), column(3)]
        };
        let same = |a: &[Vec3; 4], b: &[Vec3; 4]| {
            let close = |b: &[Vec3; 4]| a.iter().zip(b).all(|(x, y)| x.abs_diff_eq(*y, 1e-6));
            close(b) || close(&[b[3], b[2], b[1], b[0]])
        };
        // Edges that meet nothing: the ends of handle and spout where they enter the body or open (2 times 2 each), the lid
        // in the rim and the rim's inside (4 quarters each). Edges that are a single point meet themselves.
        let all_edges: Vec<[Vec3; 4]> = all.iter().flat_map(|(p, _)| edges(p)).collect();
        let point = |e: &[Vec3; 4]| e.iter().all(|p| p.abs_diff_eq(e[0], 1e-6));
        let free = all_edges
            .iter()
            .filter(|e| !point(e) && all_edges.iter().filter(|other| same(e, other)).count() == 1)
            .count();
        assert_eq!(free, 2 * 4 + 4 + 4);
    }

    #[test]
    fn its_measures_are_those_of_the_data() {
        let mesh = teapot(8);
        let height = mesh.positions.iter().map(|p| p[1]).fold(0.0, f32::max);
        assert!((height - 3.15).abs() < 1e-5, "{height}");
        // Body and bottom alone: the widest circle has radius 2 at height 0.9; the circle's error is below 1e-2.
        let at = |p: &&[f32; 3]| (p[1] - 0.9).abs() < 1e-6;
        for p in mesh.positions.iter().filter(at).filter(|p| p[0] > -1.85) {
            assert!((p[0].hypot(p[2]) - 2.0).abs() < 0.02, "{p:?}");
        }
        let normals = mesh.normals.as_ref().expect("it has normals");
        for t in &mesh.indices {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.positions[i as usize]));
            let n: Vec3 = t.iter().map(|&i| Vec3::from(normals[i as usize])).sum();
            assert!((b - a).cross(c - a).dot(n) > 0.0);
        }
        // The tip of the spout is on top and the foot below.
        let top = mesh.positions.iter().zip(normals).find(|(p, _)| p[1] == height).expect("the knob");
        assert!(top.1[1] > 0.99);
        let foot = mesh.positions.iter().zip(normals).find(|(p, _)| p[1] == 0.0).expect("the foot");
        assert!(foot.1[1] < -0.99);
    }
}
