//! Triangles of one group and material, with vertices that are corners: position, texture coordinates, normal.
//!
//! Where a group has no normals, faces within a smoothing group share those of their common vertices, weighted by the
//! angles of the faces there (G. Thürmer and C. Wüthrich 1998); other faces are flat.

use crate::description::TriangleMesh;
use crate::warnings::Warnings;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// The numbers of the whole file.
#[derive(Default)]
pub(super) struct Vertices {
    pub positions: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f32; 3]>,
    /// Linear colours of the first positions, if any position has one; NaN for those without.
    pub colors: Vec<[f32; 3]>,
}

impl Vertices {
    /// The colour of a position, if it has one.
    fn color(&self, v: u32) -> Option<[f32; 3]> {
        self.colors.get(v as usize).copied().filter(|color| !color[0].is_nan())
    }
}

/// Indices into [`Vertices`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Corner {
    pub v: u32,
    pub vt: u32,
    /// A normal, or a smoothing group, or [`Corner::NONE`].
    pub vn: u32,
}

impl Corner {
    pub const NONE: u32 = u32::MAX;
    /// Smoothing groups stand below this, normals far below: there are at most 2^30 by default.
    const GROUPS: u32 = 0xffff_0000;

    /// What stands for a missing normal in a smoothing group; 0 is none.
    pub fn smooth(group: u32) -> u32 {
        if group == 0 { Self::NONE } else { Self::GROUPS + group.min(0xfffe) }
    }

    fn is_smooth(self) -> bool {
        self.vn != Self::NONE && self.vn >= Self::GROUPS
    }
}

fn opaque(color: Option<[f32; 3]>) -> [f32; 4] {
    let [r, g, b] = color.unwrap_or([1.0; 3]);
    [r, g, b, 1.0]
}

/// Which part used each position of the file last, and its first corner there.
#[derive(Default)]
pub(super) struct Heads(Vec<[u32; 2]>);

/// A part being made.
pub(super) struct PartBuilder {
    pub name: String,
    pub material: Option<String>,
    number: u32,
    /// Each different corner once; again where another part has come in between.
    corners: Vec<Corner>,
    /// The next corner with the same position.
    next: Vec<u32>,
    indices: Vec<[u32; 3]>,
}

impl PartBuilder {
    pub fn new(name: String, material: Option<String>, number: u32) -> Self {
        Self { name, material, number, corners: Vec::new(), next: Vec::new(), indices: Vec::new() }
    }

    pub fn triangle(&mut self, corners: [Corner; 3], heads: &mut Heads) {
        let triangle = corners.map(|corner| self.index(corner, heads));
        self.indices.push(triangle);
    }

    fn index(&mut self, corner: Corner, Heads(heads): &mut Heads) -> u32 {
        let v = corner.v as usize;
        if v >= heads.len() {
            heads.resize((v + 1).next_power_of_two(), [Corner::NONE; 2]);
        }
        let [part, first] = &mut heads[v];
        if *part != self.number {
            (*part, *first) = (self.number, Corner::NONE);
        }
        let mut at = *first;
        while at != Corner::NONE {
            if self.corners[at as usize] == corner {
                return at;
            }
            at = self.next[at as usize];
        }
        let new = self.corners.len() as u32;
        self.corners.push(corner);
        self.next.push(*first);
        *first = new;
        new
    }

    /// Makes the mesh.
    pub fn finish(mut self, all: &Vertices, path: &Path, warnings: &mut Warnings) -> TriangleMesh {
        self.next = Vec::new();
        let with_normal = self.corners.iter().filter(|c| c.vn < Corner::GROUPS).count();
        let smooth = self.corners.iter().any(|c| c.is_smooth());
        let with_uv = self.corners.iter().filter(|c| c.vt != Corner::NONE).count();
        let mut complete = |count: usize, what: &str, effect: &str| {
            if count != 0 && count != self.corners.len() {
                let (place, name) = (path.display(), &self.name);
                warnings.add(format!("{place}: some vertices of group `{name}` have no {what}: {effect}"));
            }
            count == self.corners.len() && count != 0
        };
        // With a material, they are for whoever made the file: its pictures and factors say what is to be seen.
        let with_color = match self.material {
            None => self.corners.iter().filter(|c| all.color(c.v).is_some()).count(),
            Some(_) => 0,
        };
        let has_colors = complete(with_color, "colour", "it is grey");
        let has_uvs = complete(with_uv, "texture coordinates", "it has none");
        let has_normals = smooth || complete(with_normal, "normal", "it is shaded flat");
        let computed = if smooth { self.smooth_normals(all) } else { Vec::new() };
        let position = |c: &Corner| all.positions[c.v as usize];
        let normal = |(i, c): (usize, &Corner)| match c.vn {
            Corner::NONE => computed[i],
            vn if vn >= Corner::GROUPS => computed[i],
            vn => all.normals[vn as usize],
        };
        TriangleMesh {
            positions: self.corners.iter().map(position).collect(),
            normals: has_normals.then(|| self.corners.iter().enumerate().map(normal).collect()),
            uvs: has_uvs.then(|| self.corners.iter().map(|c| all.uvs[c.vt as usize]).collect()),
            indices: self.indices,
            colors: has_colors.then(|| self.corners.iter().map(|c| opaque(all.color(c.v))).collect()),
            ..TriangleMesh::default()
        }
    }

    /// Normals of all corners that have none of their own; flat corners become one for each face.
    fn smooth_normals(&mut self, all: &Vertices) -> Vec<[f32; 3]> {
        let at = |c: &Corner| Vec3::from(all.positions[c.v as usize]).as_dvec3();
        let mut sums: HashMap<(u32, u32), DVec3> = HashMap::new();
        let mut flat: HashMap<u32, DVec3> = HashMap::new();
        let mut used = vec![false; self.corners.len()];
        for triangle in &mut self.indices {
            let p = triangle.map(|i| at(&self.corners[i as usize]));
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            for k in 0..3 {
                let i = triangle[k] as usize;
                let corner = self.corners[i];
                if corner.is_smooth() {
                    let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                    let angle = a.cross(b).length().atan2(a.dot(b));
                    *sums.entry((corner.v, corner.vn)).or_default() += normal * angle;
                } else if corner.vn == Corner::NONE {
                    if std::mem::replace(&mut used[i], true) {
                        triangle[k] = self.corners.len() as u32;
                        self.corners.push(corner);
                        used.push(true);
                    }
                    flat.insert(triangle[k], normal);
                }
            }
        }
        let normal = |(i, c): (usize, &Corner)| {
            let sum = if c.is_smooth() { sums.get(&(c.v, c.vn)) } else { flat.get(&(i as u32)) };
            sum.copied().unwrap_or_default().normalize_or_zero().as_vec3().to_array()
        };
        self.corners.iter().enumerate().map(normal).collect()
    }
}
