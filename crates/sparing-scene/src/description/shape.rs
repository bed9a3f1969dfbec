//! Shapes, groups of shapes and their placements.

use super::{ColorInput, FloatInput, MaterialId};
use glam::{Affine3A, Vec3};

/// Geometry with its surface properties.
#[derive(Clone, Debug)]
pub struct Shape {
    /// The surface.
    pub geometry: Geometry,
    /// What it is made of.
    pub material: MaterialId,
    /// Emitted light, if any.
    pub emission: Option<Emission>,
    /// Opacity in 0..1: cut-out. `None` is opaque. The opacity of the vertices' colours is a factor.
    pub alpha: Option<FloatInput>,
    /// Opacities from here on are opaque, those below are absent; `None`: opacity is a probability.
    pub alpha_cutoff: Option<f32>,
    /// Whether the geometric normal is flipped (matters for one-sided emission and for `eta`).
    pub reverse_orientation: bool,
}

/// Emitted radiance of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission {
    /// Radiance, W/(m² sr), all factors applied.
    pub radiance: ColorInput,
    /// Whether both sides emit; else the side of the geometric normal.
    pub two_sided: bool,
}

/// The surfaces that exist.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles.
    Triangles(TriangleMesh),
    /// Quadrilaterals; a non-planar one is two triangles (0,1,3) and (2,3,1).
    Quads(QuadMesh),
    /// A full sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, > 0.
        radius: f32,
        /// Rotation of the texture coordinates: unit axes, z is the pole.
        axes: [Vec3; 3],
    },
    /// A full flat disk.
    Disk {
        /// Centre.
        center: Vec3,
        /// Unit normal.
        normal: Vec3,
        /// Unit tangent where the texture's u is 0.
        tangent: Vec3,
        /// Radius, > 0.
        radius: f32,
    },
}

/// An indexed triangle mesh. Indices are in range; all else is per vertex.
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Three vertices a triangle.
    pub indices: Vec<[u32; 3]>,
    /// Shading normals, not necessarily unit.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates; v = 0 is the bottom of the picture.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Colours and opacities, linear Rec.709 and 0..1.
    pub colors: Option<Vec<[f32; 4]>>,
    /// Further texture coordinates, for [`Texture::SecondUv`](super::Texture::SecondUv).
    pub second_uvs: Option<Vec<[f32; 2]>>,
    /// Where normal maps have their x axis, not necessarily unit; without them along dp/du of each triangle.
    pub tangents: Option<Vec<[f32; 3]>>,
}

/// An indexed quad mesh; vertices go round each quad.
#[derive(Clone, Debug, Default)]
pub struct QuadMesh {
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Four vertices a quad, in order around it.
    pub indices: Vec<[u32; 4]>,
    /// Shading normals, not necessarily unit.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates.
    pub uvs: Option<Vec<[f32; 2]>>,
}

/// A named group of shapes in its own space.
#[derive(Clone, Debug, Default)]
pub struct ObjectDefinition {
    /// Name in the file.
    pub name: String,
    /// Its shapes.
    pub shapes: Vec<Shape>,
}

/// One placement of an object.
#[derive(Clone)]
pub struct Instance {
    /// Index into the scene's objects.
    pub object: u32,
    /// From the object's space to world space; may shear and mirror. Where the placement moves, at the start.
    pub object_to_world: Affine3A,
    /// The same at the end, if the placement moves: [`Motion`](super::Motion) says how it goes between.
    pub end: Option<Affine3A>,
}

impl Instance {
    /// A placement at rest.
    #[must_use]
    pub fn still(object: u32, object_to_world: Affine3A) -> Self {
        Self { object, object_to_world, end: None }
    }
}

/// A placement at rest prints without its motion, for the same reason as a [`Camera`](super::Camera).
impl std::fmt::Debug for Instance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { object, object_to_world, end } = self;
        let mut text = f.debug_struct("Instance");
        text.field("object", object).field("object_to_world", object_to_world);
        if end.is_some() {
            text.field("end", end);
        }
        text.finish()
    }
}
