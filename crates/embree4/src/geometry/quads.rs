//! Meshes of quadrilaterals.

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{CreateContext, Options, RawGeometry, Slot, Steps, check_indices};
use super::{filter_options, geometry_options, vertex_options};
use crate::{Error, FeatureMask, SharedBuffer};

/// Quadrilaterals that share vertices.
///
/// Each is a pair of triangles, v0 v1 v3 and v2 v3 v1; u runs from v0 to v1 and v from v0 to v3. A triangle is a quad
/// whose last two vertices are the same. Quads with a vertex that is not finite are never hit.
#[must_use]
pub struct QuadMesh {
    vertices: Steps<[f32; 3]>,
    indices: SharedBuffer<[u32; 4]>,
    options: Options,
}

geometry_options!(QuadMesh);
filter_options!(QuadMesh);
vertex_options!(QuadMesh, [f32; 3]);

impl QuadMesh {
    /// A mesh; the indices are checked when a scene takes it in.
    pub fn new(
        vertices: impl Into<SharedBuffer<[f32; 3]>>,
        indices: impl Into<SharedBuffer<[u32; 4]>>,
    ) -> Self {
        Self { vertices: Steps::new(vertices.into()), indices: indices.into(), options: Options::default() }
    }
}

impl Sealed for QuadMesh {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        check_indices("vertex index", self.indices.as_flattened(), self.vertices.first.len())?;
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_QUAD;
        let mut geometry = RawGeometry::new(context, kind, FeatureMask::QUAD, self.indices.len())?;
        self.vertices.bind(&mut geometry)?;
        geometry.set_buffer(Slot::INDEX, self.indices);
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}
