//! Spheres and discs.

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{CreateContext, Options, RawGeometry, Slot, Steps, check_length};
use super::{filter_options, geometry_options, vertex_options};
use crate::{Error, FeatureMask, SharedBuffer};

macro_rules! points {
    ($(#[$doc:meta])* $Type:ident, $kind:ident) => {
        $(#[$doc])*
        #[must_use]
        pub struct $Type {
            vertices: Steps<[f32; 4]>,
            options: Options,
        }

        geometry_options!($Type);
        filter_options!($Type);
        vertex_options!($Type, [f32; 4]);

        impl $Type {
            /// One per element: centre, then radius. Elements that are not finite, or of negative radius, are
            /// never hit.
            pub fn new(points: impl Into<SharedBuffer<[f32; 4]>>) -> Self {
                Self { vertices: Steps::new(points.into()), options: Options::default() }
            }
        }

        impl Sealed for $Type {
            #[allow(private_interfaces, reason = "nobody outside can name this trait")]
            fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
                let kind = sys::RTCGeometryType::$kind;
                let count = self.vertices.first.len();
                let mut geometry = RawGeometry::new(context, kind, FeatureMask::POINT, count)?;
                self.vertices.bind(&mut geometry)?;
                geometry.set_options(self.options, context.panics)?;
                geometry.commit()
            }
        }
    };
}

points! {
    /// Spheres. Embree reports the entry hit, or the exit hit for a ray that starts inside. There are no surface
    /// coordinates (u and v are 0); the normal points outwards.
    Spheres, RTC_GEOMETRY_TYPE_SPHERE_POINT
}

points! {
    /// Discs that always face the ray.
    Discs, RTC_GEOMETRY_TYPE_DISC_POINT
}

/// Discs with a normal of their own.
#[must_use]
pub struct OrientedDiscs {
    vertices: Steps<[f32; 4]>,
    normals: Vec<SharedBuffer<[f32; 3]>>,
    options: Options,
}

geometry_options!(OrientedDiscs);
filter_options!(OrientedDiscs);

impl OrientedDiscs {
    /// One per element: centre, then radius; and a normal of any length for each.
    pub fn new(
        points: impl Into<SharedBuffer<[f32; 4]>>,
        normals: impl Into<SharedBuffer<[f32; 3]>>,
    ) -> Self {
        let (vertices, normals) = (Steps::new(points.into()), vec![normals.into()]);
        Self { vertices, normals, options: Options::default() }
    }

    /// Adds points and normals for one further time step; see [`TriangleMesh::time_steps`](super::TriangleMesh::time_steps).
    pub fn time_step(
        mut self,
        points: impl Into<SharedBuffer<[f32; 4]>>,
        normals: impl Into<SharedBuffer<[f32; 3]>>,
    ) -> Self {
        self.vertices.later.push(points.into());
        self.normals.push(normals.into());
        self
    }

    /// Attaches values to the discs. Slots count from 0; there can be 16.
    pub fn vertex_attribute(mut self, slot: u32, values: impl Into<super::Attribute>) -> Self {
        self.vertices.attributes.push((slot, values.into()));
        self
    }
}

impl Sealed for OrientedDiscs {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT;
        let count = self.vertices.first.len();
        let mut geometry = RawGeometry::new(context, kind, FeatureMask::POINT, count)?;
        self.vertices.bind(&mut geometry)?;
        for (step, normals) in (0..).zip(self.normals) {
            check_length("normals", normals.len(), count)?;
            geometry.set_buffer(Slot(sys::RTCBufferType::RTC_BUFFER_TYPE_NORMAL.0, step), normals);
        }
        geometry.set_options(self.options, context.panics)?;
        geometry.commit()
    }
}
