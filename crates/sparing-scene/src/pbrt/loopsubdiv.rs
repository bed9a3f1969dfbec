//! `loopsubdiv`: C. Loop's subdivision of triangle meshes (1987), with J. Warren's weights, the boundary rules and the
//! limit surface of "Physically Based Rendering", 3rd edition, section 3.8.
//!
//! As in pbrt, vertices are pushed to the limit surface before tangents are taken, boundary vertices with weights 1/5,
//! 3/5, 1/5, and normals point to the side from which the triangles are seen clockwise. Where a mesh is not a manifold
//! around a vertex, that vertex stays where it is.

use crate::description::TriangleMesh;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// A mesh that is being refined.
struct Surface {
    points: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

/// What is around the vertices and edges of a surface.
struct Topology {
    /// The third corners of the faces at each edge; edges by their lower and higher vertex.
    opposite: HashMap<(u32, u32), Vec<u32>>,
    /// Neighbours of each vertex: all of them, and those along the boundary.
    rings: Vec<Ring>,
}

#[derive(Clone, Default)]
struct Ring {
    all: Vec<u32>,
    boundary: Vec<u32>,
    /// For each face, the next corner and the one after it.
    corners: Vec<[u32; 2]>,
}

fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Faces after a number of levels; `None` if they overflow.
pub(super) fn faces(count: usize, levels: u32) -> Option<u64> {
    (count as u64).checked_mul(1u64.checked_shl(2 * levels)?)
}

/// The limit surface after `levels` refinements. Indices must be in range; vertices without a face are dropped.
pub(super) fn subdivide(positions: &[[f32; 3]], indices: &[[u32; 3]], levels: u32) -> TriangleMesh {
    let mut surface = Surface::new(positions, indices);
    for _ in 0..levels {
        surface = surface.refined();
    }
    surface.limit()
}

/// Weight of each neighbour of an interior vertex.
fn beta(valence: usize) -> f64 {
    if valence == 3 { 3.0 / 16.0 } else { 3.0 / (8.0 * valence as f64) }
}

impl Surface {
    fn new(positions: &[[f32; 3]], indices: &[[u32; 3]]) -> Self {
        let mut names = vec![u32::MAX; positions.len()];
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for face in indices.iter().filter(|[a, b, c]| a != b && b != c && c != a) {
            faces.push(face.map(|i| {
                let name = &mut names[i as usize];
                if *name == u32::MAX {
                    *name = points.len() as u32;
                    points.push(DVec3::from_array(positions[i as usize].map(f64::from)));
                }
                *name
            }));
        }
        Self { points, faces }
    }

    fn topology(&self) -> Topology {
        let mut opposite: HashMap<(u32, u32), Vec<u32>> = HashMap::with_capacity(self.faces.len() * 2);
        let mut rings = vec![Ring::default(); self.points.len()];
        for &[a, b, c] in &self.faces {
            for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                opposite.entry(edge(a, b)).or_default().push(c);
                rings[a as usize].corners.push([b, c]);
            }
        }
        for (&(a, b), others) in &opposite {
            rings[a as usize].all.push(b);
            rings[b as usize].all.push(a);
            if others.len() != 2 {
                rings[a as usize].boundary.push(b);
                rings[b as usize].boundary.push(a);
            }
        }
        // The order of a hash map must not show.
        for ring in &mut rings {
            ring.all.sort_unstable();
            ring.boundary.sort_unstable();
        }
        Topology { opposite, rings }
    }

    /// Vertex `i` by the weights of its neighbours.
    fn moved(&self, i: usize, ring: &Ring, inside: f64, boundary: f64) -> DVec3 {
        let sum = |of: &[u32]| of.iter().map(|j| self.points[*j as usize]).sum::<DVec3>();
        let p = self.points[i];
        match ring.boundary.len() {
            0 => p * (1.0 - ring.all.len() as f64 * inside) + sum(&ring.all) * inside,
            2 => p * (1.0 - 2.0 * boundary) + sum(&ring.boundary) * boundary,
            _ => p,
        }
    }

    fn refined(&self) -> Self {
        let topology = self.topology();
        let mut points: Vec<DVec3> = topology
            .rings
            .iter()
            .enumerate()
            .map(|(i, ring)| self.moved(i, ring, beta(ring.all.len()), 1.0 / 8.0))
            .collect();
        let mut middles: HashMap<(u32, u32), u32> = HashMap::with_capacity(topology.opposite.len());
        let mut faces = Vec::with_capacity(4 * self.faces.len());
        for &[a, b, c] in &self.faces {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| {
                *middles.entry(edge(a, b)).or_insert_with(|| {
                    let ends = self.points[a as usize] + self.points[b as usize];
                    let point = match topology.opposite.get(&edge(a, b)).map(Vec::as_slice) {
                        Some([c, d]) => {
                            ends * (3.0 / 8.0) + (self.points[*c as usize] + self.points[*d as usize]) / 8.0
                        }
                        _ => ends / 2.0,
                    };
                    points.push(point);
                    points.len() as u32 - 1
                })
            });
            faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        Self { points, faces }
    }

    fn limit(mut self) -> TriangleMesh {
        let topology = self.topology();
        let limit = |(i, ring): (usize, &Ring)| {
            let n = ring.all.len();
            self.moved(i, ring, 1.0 / (n as f64 + 3.0 / (8.0 * beta(n))), 1.0 / 5.0)
        };
        self.points = topology.rings.iter().enumerate().map(limit).collect();
        let normals = (0..self.points.len()).map(|i| self.normal(i, &topology.rings[i]).as_vec3().to_array());
        TriangleMesh {
            normals: Some(normals.collect()),
            positions: self.points.iter().map(|p| p.as_vec3().to_array()).collect(),
            indices: self.faces,
            ..TriangleMesh::default()
        }
    }

    /// Normal of the limit surface from the ring of neighbours in order, counter-clockwise from the boundary if there
    /// is one; the mean of the faces where there is no such order.
    fn normal(&self, i: usize, ring: &Ring) -> DVec3 {
        let at = |j: u32| self.points[j as usize];
        let p = self.points[i];
        let Some(order) = ring.ordered() else {
            let cross = |[b, c]: &[u32; 2]| (at(*b) - p).cross(at(*c) - p);
            return -ring.corners.iter().map(cross).sum::<DVec3>().normalize_or_zero();
        };
        let n = order.len();
        let (mut s, mut t) = (DVec3::ZERO, DVec3::ZERO);
        if ring.boundary.is_empty() {
            for (k, j) in order.iter().enumerate() {
                let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
                s += at(*j) * cos;
                t += at(*j) * sin;
            }
            // Counter-clockwise here, clockwise in pbrt.
            return -s.cross(t).normalize_or_zero();
        }
        let (first, last) = (at(order[0]), at(order[n - 1]));
        s = last - first;
        t = match n {
            2 => first + last - 2.0 * p,
            3 => at(order[1]) - p,
            4 => -first + 2.0 * at(order[1]) + 2.0 * at(order[2]) - last - 2.0 * p,
            _ => {
                let theta = TAU * 0.5 / (n - 1) as f64;
                let ends = (first + last) * theta.sin();
                let weight = |k: usize| (2.0 * theta.cos() - 2.0) * (k as f64 * theta).sin();
                -(1..n - 1).fold(ends, |sum, k| sum + at(order[k]) * weight(k))
            }
        };
        s.cross(t).normalize_or_zero()
    }
}

impl Ring {
    /// The neighbours counter-clockwise; `None` if the faces do not make one closed or open fan of one orientation.
    fn ordered(&self) -> Option<Vec<u32>> {
        let next: HashMap<u32, u32> = self.corners.iter().map(|[b, c]| (*b, *c)).collect();
        if next.len() != self.corners.len() || !matches!(self.boundary.len(), 0 | 2) {
            return None;
        }
        let starts = |b: &&u32| !self.corners.iter().any(|[_, c]| c == *b);
        let first = match self.boundary.is_empty() {
            true => self.corners.first()?[0],
            false => *next.keys().find(starts)?,
        };
        let mut order = vec![first];
        while order.len() < self.all.len() {
            order.push(*next.get(order.last()?)?);
        }
        let closes = next.get(order.last()?) == Some(&first);
        (closes == self.boundary.is_empty()).then_some(order)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// An octahedron with outward triangles.
    fn octahedron() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let points = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|p| p.to_array());
        let top = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
        let bottom = top.map(|[a, b, _]| [b, a, 5]);
        (points.to_vec(), [top, bottom].concat())
    }

    /// One level by hand: valence 4 has beta 3/32, so a vertex at 1 goes to 1 - 4 * 3/32 = 5/8; the middle of an edge
    /// of the octahedron at 3/8 (x + y) + 1/8 (z - z).
    #[test]
    fn one_level_of_an_octahedron_by_hand() {
        let (points, faces) = octahedron();
        let refined = Surface::new(&points, &faces).refined();
        assert_eq!((refined.points.len(), refined.faces.len()), (18, 32));
        assert!(refined.points[0].abs_diff_eq(DVec3::X * 0.625, 1e-12));
        let middle = DVec3::new(0.375, 0.375, 0.0);
        assert!(refined.points.iter().any(|p| p.abs_diff_eq(middle, 1e-12)));
    }

    /// The limit of a vertex does not depend on how often the mesh is refined: 4 neighbours that cancel, so the vertex
    /// at 1 goes to 1 - 4 gamma with gamma = 1 / (4 + 3 / (8 * 3/32)) = 1/8, that is 1/2.
    #[test]
    fn limits_do_not_depend_on_the_level() {
        let (points, faces) = octahedron();
        for levels in 0..4 {
            let mesh = subdivide(&points, &faces, levels);
            assert_eq!(mesh.indices.len() as u64, super::faces(8, levels).unwrap());
            let tip = Vec3::from(mesh.positions[0]);
            assert!(tip.abs_diff_eq(Vec3::X * 0.5, 1e-6), "{levels}: {tip}");
            // Seen clockwise from outside of what the winding calls outside: as in pbrt.
            let normals = mesh.normals.as_ref().unwrap();
            for (p, n) in mesh.positions.iter().zip(normals) {
                assert!(Vec3::from(*p).dot(Vec3::from(*n)) < -0.1);
            }
            assert!(Vec3::from(normals[0]).abs_diff_eq(Vec3::NEG_X, 1e-5));
        }
    }

    /// A flat square of two triangles stays flat; its corners go by the boundary rule: 3/5 p + 1/5 of both neighbours.
    #[test]
    fn boundaries_are_curves_of_their_own() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = subdivide(&points, &[[0, 1, 2], [0, 2, 3]], 0);
        assert!(Vec3::from(mesh.positions[0]).abs_diff_eq(Vec3::new(0.2, 0.2, 0.0), 1e-6));
        let mesh = subdivide(&points, &[[0, 1, 2], [0, 2, 3]], 3);
        for n in mesh.normals.unwrap() {
            assert!(Vec3::from(n).abs_diff_eq(Vec3::NEG_Z, 1e-5), "{n:?}");
        }
        assert!(mesh.positions.iter().all(|p| p[2] == 0.0));
    }

    #[test]
    fn broken_meshes_do_no_harm() {
        let points = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [9.0, 9.0, 9.0]];
        let cases: &[&[[u32; 3]]] = &[
            &[],
            &[[0, 0, 1]],
            &[[0, 1, 2], [0, 1, 2]],
            &[[0, 1, 2], [1, 0, 3], [0, 1, 4]],
            &[[0, 1, 2], [0, 2, 1]],
            &[[0, 1, 2], [0, 3, 4]],
        ];
        for faces in cases {
            let mesh = subdivide(&points, faces, 2);
            assert!(mesh.positions.as_flattened().iter().all(|x| x.is_finite()));
            assert!(mesh.indices.as_flattened().iter().all(|i| (*i as usize) < mesh.positions.len()));
        }
        assert_eq!(super::faces(8, 40), None);
    }
}
