#![doc = include_str!("../README.md")]
mod bounds;
mod buffer;
mod builder;
mod config;
mod device;
mod error;
mod features;
mod filter;
mod float_env;
pub mod geometry;
mod guard;
mod interpolate;
mod layout;
mod memory;
mod packet;
mod panics;
mod point_query;
mod query;
mod query_filter;
mod ray;
mod scene;

pub use bounds::{Bounds, LinearBounds};
pub use buffer::{Element, SharedBuffer};
pub use builder::{Joiner, SceneBuilder};
pub use config::{DeviceBuilder, Isa};
pub use device::Device;
pub use error::{Error, ErrorCode};
pub use features::{BuildQuality, FeatureMask, SceneFlags};
pub use filter::FilterHit;
pub use geometry::{
    Attribute, BoundaryMode, CurveBasis, CurveShape, Curves, Discs, Geometry, GeometryId, IDENTITY, Instance,
    InstanceArray, OrientedDiscs, QuadMesh, Spheres, Subdivision, TriangleMesh, UserGeometry, UserHit,
    UserPrimitive,
};
pub use interpolate::{Interpolated, VertexData};
pub use memory::MemoryEvent;
pub use packet::{Hit4, Hit8, Hit16, Ray4, Ray8, Ray16, RayHit4, RayHit8, RayHit16, Valid4, Valid8, Valid16};
pub use panics::PanicPayload;
pub use point_query::PointCandidate;
pub use query::QueryOptions;
pub use ray::{Hit, INVALID_ID, Ray, RayHit};
pub use scene::Scene;
