//! Geometries: described by value, handed to Embree when a scene takes them in.

mod curves;
mod instance;
mod instance_array;
mod options;
mod points;
mod quads;
mod raw;
mod subdivision;
pub(crate) mod transform;
mod triangles;
pub(crate) mod user;

pub use curves::{CurveBasis, CurveShape, Curves};
pub use instance::{IDENTITY, Instance};
pub use instance_array::InstanceArray;
pub use options::Attribute;
pub(crate) use options::{Options, Steps, filter_options, geometry_options, vertex_options};
pub use points::{Discs, OrientedDiscs, Spheres};
pub use quads::QuadMesh;
pub(crate) use raw::{CreateContext, RawGeometry, Slot};
pub use subdivision::{BoundaryMode, Subdivision};
pub use triangles::TriangleMesh;
pub use user::{UserGeometry, UserHit, UserPrimitive};

use crate::Error;

/// Anything that can be attached to a scene. Cannot be implemented elsewhere; for shapes of your own see
/// [`UserGeometry`].
pub trait Geometry: sealed::Sealed {}

pub(crate) mod sealed {
    use super::{CreateContext, RawGeometry};
    use crate::Error;

    pub trait Sealed {
        #[allow(private_interfaces, reason = "nobody outside can name this trait")]
        fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error>;
    }
}

/// Id of a geometry within its scene; the `geom_id` or `inst_id` of hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GeometryId(pub u32);

impl GeometryId {
    /// The largest id that can be asked for. Embree's tables are as long as the largest id in use.
    pub const MAX: Self = Self((1 << 24) - 1);
}

impl std::fmt::Display for GeometryId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl From<GeometryId> for u32 {
    fn from(id: GeometryId) -> Self {
        id.0
    }
}

/// Refuses indices that are not below `limit`.
pub(crate) fn check_indices(what: &'static str, indices: &[u32], limit: usize) -> Result<(), Error> {
    let Some(max) = indices.iter().copied().max() else { return Ok(()) };
    if (max as usize) < limit {
        return Ok(());
    }
    let position = indices.iter().position(|&i| i as usize >= limit).unwrap_or(0);
    Err(Error::IndexOutOfRange { what, position, index: indices[position], limit })
}

pub(crate) fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected { Ok(()) } else { Err(Error::LengthMismatch { what, expected, found }) }
}

pub(crate) fn check_finite(what: &'static str, values: &[f32]) -> Result<(), Error> {
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(position) => Err(Error::NotFinite { what, position }),
    }
}

pub(crate) fn check_count(what: &'static str, count: usize, limit: usize) -> Result<u32, Error> {
    match u32::try_from(count) {
        Ok(n) if count <= limit => Ok(n),
        _ => Err(Error::TooLarge { what, count, limit }),
    }
}
