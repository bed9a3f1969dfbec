//! Triangle meshes.

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{CreateContext, Options, RawGeometry, Slot, Steps, check_indices};
use super::{filter_options, geometry_options, vertex_options};
use crate::{Error, FeatureMask, SharedBuffer};

/// Triangles that share vertices.
///
/// The hit point is `(1 - u - v) * v0 + u * v1 + v * v2`, and the normal is `(v1 - v0) x (v2 - v0)`. Triangles with
/// a vertex that is not finite are never hit.
#[must_use]
pub struct TriangleMesh {
    vertices: Steps<[f32; 3]>,
    indices: SharedBuffer<[u32; 3]>,
    options: Options,
}

geometry_options!(TriangleMesh);
filter_options!(TriangleMesh);
vertex_options!(TriangleMesh, [f32; 3]);

impl TriangleMesh {
    /// A mesh; the indices are checked when a scene takes it in. No triangles at all are fine.
    pub fn new(
        vertices: impl Into<SharedBuffer<[f32; 3]>>,
        indices: impl Into<SharedBuffer<[u32; 3]>>,
    ) -> Self {
        Self { vertices: Steps::new(vertices.into()), indices: indices.into(), options: Options::default() }
    }
}

impl Sealed for TriangleMesh {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        check_indices("vertex index", self.indices.as_flattened(), self.vertices.first.len())?;
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE;
        let mut geometry = RawGeometry::new(context, kind, FeatureMask::TRIANGLE, self.indices.len())?;
        self.vertices.bind(&mut geometry)?;
        geometry.set_buffer(Slot::INDEX, self.indices);
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}
