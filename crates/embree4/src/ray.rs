//! One ray, one hit.

use std::mem::offset_of;

use embree4_sys as sys;

use crate::GeometryId;

/// The id that stands for "nothing": no hit, no geometry, no instance.
pub const INVALID_ID: u32 = u32::MAX;

/// A ray segment. Lengths are in units of `dir`, which need not have length one.
///
/// Components that are not finite numbers make a ray hit or miss arbitrarily, but never do harm. In scenes with curves,
/// points or subdivision surfaces such rays miss, and so do those with components beyond 1e18.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin.
    pub org: [f32; 3],
    /// Start of the segment, not negative.
    pub tnear: f32,
    /// Direction.
    pub dir: [f32; 3],
    /// Time for motion blur, 0 to 1. Other times are moved there (in scenes that move).
    pub time: f32,
    /// End of the segment; the hit distance after `intersect`, minus infinity after `occluded` found something.
    pub tfar: f32,
    /// Only geometries whose mask shares a bit with this are seen. Geometries have mask 1 unless told otherwise.
    pub mask: u32,
    /// Free for the caller; callbacks see it.
    pub id: u32,
    /// Reserved by Embree; keep it zero.
    pub flags: u32,
}

impl Ray {
    /// An endless ray from `org` at time 0 that sees every geometry with a mask other than zero.
    #[inline]
    #[must_use]
    pub const fn new(org: [f32; 3], dir: [f32; 3]) -> Self {
        Self::segment(org, dir, 0.0, f32::INFINITY)
    }

    /// The part of the ray between `tnear` and `tfar`.
    #[inline]
    #[must_use]
    pub const fn segment(org: [f32; 3], dir: [f32; 3], tnear: f32, tfar: f32) -> Self {
        Self { org, tnear, dir, time: 0.0, tfar, mask: u32::MAX, id: 0, flags: 0 }
    }

    /// The same ray at another time.
    #[inline]
    #[must_use]
    pub const fn at_time(self, time: f32) -> Self {
        Self { time, ..self }
    }

    /// The same ray with another mask.
    #[inline]
    #[must_use]
    pub const fn with_mask(self, mask: u32) -> Self {
        Self { mask, ..self }
    }

    /// Whether `occluded` marked this ray as blocked.
    #[inline]
    #[must_use]
    pub fn is_occluded(&self) -> bool {
        self.tfar == f32::NEG_INFINITY
    }
}

/// What a ray hit. Ids are [`INVALID_ID`] where nothing applies.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Geometric normal in the space of the hit geometry (of the instanced scene, if any), not normalised.
    pub ng: [f32; 3],
    /// First surface coordinate.
    pub u: f32,
    /// Second surface coordinate.
    pub v: f32,
    /// Primitive within the geometry.
    pub prim_id: u32,
    /// Geometry within its scene.
    pub geom_id: u32,
    /// Id of the instance geometry that was passed through.
    pub inst_id: [u32; 1],
    /// Element of the instance array that was passed through; 0 for a single instance.
    pub inst_prim_id: [u32; 1],
}

impl Hit {
    /// No hit.
    pub const NONE: Self = Self {
        ng: [0.0; 3],
        u: 0.0,
        v: 0.0,
        prim_id: INVALID_ID,
        geom_id: INVALID_ID,
        inst_id: [INVALID_ID],
        inst_prim_id: [INVALID_ID],
    };

    /// Whether something was hit.
    #[inline]
    #[must_use]
    pub fn is_hit(&self) -> bool {
        self.geom_id != INVALID_ID
    }

    /// The geometry that was hit.
    #[inline]
    #[must_use]
    pub fn geometry(&self) -> Option<GeometryId> {
        self.is_hit().then_some(GeometryId(self.geom_id))
    }

    /// The instance geometry that the hit lies in.
    #[inline]
    #[must_use]
    pub fn instance(&self) -> Option<GeometryId> {
        (self.inst_id[0] != INVALID_ID).then_some(GeometryId(self.inst_id[0]))
    }
}

impl Default for Hit {
    fn default() -> Self {
        Self::NONE
    }
}

/// A ray and room for its hit.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The ray.
    pub ray: Ray,
    /// What it hit.
    pub hit: Hit,
}

impl RayHit {
    /// A ray that has hit nothing yet.
    #[inline]
    #[must_use]
    pub const fn new(ray: Ray) -> Self {
        Self { ray, hit: Hit::NONE }
    }
}

impl From<Ray> for RayHit {
    #[inline]
    fn from(ray: Ray) -> Self {
        Self::new(ray)
    }
}

// The queries hand these structures to Embree by address: any difference to its own is a compile error.
macro_rules! same_layout {
    ($ours:ty, $theirs:ty; $($field:ident = $their_field:ident),* $(,)?) => {
        const _: () = {
            assert!(size_of::<$ours>() == size_of::<$theirs>());
            assert!(align_of::<$ours>() == align_of::<$theirs>());
            $(assert!(offset_of!($ours, $field) == offset_of!($theirs, $their_field));)*
        };
    };
}
pub(crate) use same_layout;

same_layout!(Ray, sys::RTCRay; org = org_x, tnear = tnear, dir = dir_x, time = time, tfar = tfar, mask = mask,
    id = id, flags = flags);
same_layout!(Hit, sys::RTCHit; ng = Ng_x, u = u, v = v, prim_id = primID, geom_id = geomID, inst_id = instID,
    inst_prim_id = instPrimID);
same_layout!(RayHit, sys::RTCRayHit; ray = ray, hit = hit);

const _: () = {
    assert!(offset_of!(sys::RTCRay, org_y) == 4 && offset_of!(sys::RTCRay, org_z) == 8);
    assert!(offset_of!(sys::RTCRay, dir_y) == 20 && offset_of!(sys::RTCRay, dir_z) == 24);
    assert!(offset_of!(sys::RTCHit, Ng_y) == 4 && offset_of!(sys::RTCHit, Ng_z) == 8);
};
