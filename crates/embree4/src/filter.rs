//! Filters: closures that accept or reject hits during traversal.

use std::marker::PhantomData;
use std::sync::Arc;

use embree4_sys as sys;

use crate::geometry::user::UserPrimitive;
use crate::panics::PanicStash;
use crate::{Hit, Ray};

/// A filter of a geometry: true accepts the hit.
pub(crate) type Filter = Box<dyn Fn(&FilterHit<'_>) -> bool + Send + Sync>;

/// A possible hit that a filter decides about. Values are read when asked for.
///
/// ```
/// use embree4::{FilterHit, TriangleMesh};
/// // A chequered triangle.
/// let dark = |hit: &FilterHit<'_>| ((hit.u() * 8.0) as i32 + (hit.v() * 8.0) as i32) % 2 == 0;
/// let mesh = TriangleMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).filter(dark).occlusion_filter(dark);
/// ```
///
/// Filters are called from all threads that trace, so what they hold must be shareable:
///
/// ```compile_fail,E0277
/// use embree4::TriangleMesh;
/// let count = std::cell::Cell::new(0);
/// let mesh = TriangleMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).filter(move |_| {
///     count.set(count.get() + 1);
///     true
/// });
/// ```
///
/// and they cannot borrow from a place that the scene may outlive:
///
/// ```compile_fail,E0373
/// use embree4::TriangleMesh;
/// let limit = 0.5;
/// let mesh = TriangleMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).filter(|hit| hit.u() < limit);
/// ```
///
/// What a filter sees cannot be kept:
///
/// ```compile_fail,E0521
/// use embree4::{FilterHit, QueryOptions, Ray, RayHit, Scene};
/// fn keep<'a>(scene: &'a Scene, kept: &mut Vec<&'a FilterHit<'a>>) {
///     let mut query = RayHit::new(Ray::new([0.0; 3], [0.0, 0.0, 1.0]));
///     scene.intersect_filtered(&QueryOptions::default(), &mut query, |hit| {
///         kept.push(hit);
///         true
///     });
/// }
/// ```
pub struct FilterHit<'a> {
    ray: *const f32,
    hit: *const f32,
    /// Rays in the packet, which is the distance between two components of one ray.
    stride: usize,
    lane: usize,
    packet: PhantomData<&'a ()>,
}

macro_rules! getters {
    ($($(#[$doc:meta])* $name:ident: $kind:ident from $block:ident[$index:literal];)*) => {$(
        $(#[$doc])*
        #[inline]
        #[must_use]
        pub fn $name(&self) -> $kind {
            // SAFETY: the pointers come from Embree (or `single`) and hold `stride` values of every component
            // of a ray or hit for as long as `'a`; the lane is below the stride.
            unsafe { self.$block.add($index * self.stride + self.lane).cast::<$kind>().read() }
        }
    )*};
}

macro_rules! vectors {
    ($($(#[$doc:meta])* $name:ident from $block:ident[$index:literal];)*) => {$(
        $(#[$doc])*
        #[inline]
        #[must_use]
        pub fn $name(&self) -> [f32; 3] {
            // SAFETY: as for the scalars; the three components follow one another.
            let component = |k: usize| unsafe { self.$block.add(($index + k) * self.stride + self.lane).read() };
            [component(0), component(1), component(2)]
        }
    )*};
}

impl<'a> FilterHit<'a> {
    /// # Safety
    /// `ray` and `hit` must point to the rays and hits of a packet of `stride` that is valid for reads for `'a`,
    /// and `lane` must be below `stride`.
    pub(crate) unsafe fn new(ray: *const f32, hit: *const f32, stride: usize, lane: usize) -> Self {
        Self { ray, hit, stride, lane, packet: PhantomData }
    }

    /// One ray and hit of our own.
    pub(crate) fn single(ray: &'a Ray, hit: &'a Hit) -> Self {
        // SAFETY: a single ray has the component order of a packet of one.
        unsafe { Self::new((&raw const *ray).cast(), (&raw const *hit).cast(), 1, 0) }
    }

    getters! {
        /// Start of the ray's segment.
        tnear: f32 from ray[3];
        /// Time of the ray.
        time: f32 from ray[7];
        /// Distance of this hit along the ray, in an intersection filter; the end of the ray in an occlusion filter.
        tfar: f32 from ray[8];
        /// The ray's mask.
        ray_mask: u32 from ray[9];
        /// The ray's id, as set by the caller.
        ray_id: u32 from ray[10];
        /// First surface coordinate.
        u: f32 from hit[3];
        /// Second surface coordinate.
        v: f32 from hit[4];
        /// Primitive within the geometry.
        prim_id: u32 from hit[5];
        /// Geometry within its scene.
        geom_id: u32 from hit[6];
        /// Instance geometry that was passed through, or [`INVALID_ID`](crate::INVALID_ID).
        inst_id: u32 from hit[7];
        /// Element of the instance array that was passed through.
        inst_prim_id: u32 from hit[8];
    }

    vectors! {
        /// Origin of the ray, in the space of the geometry.
        org from ray[0];
        /// Direction of the ray, in the space of the geometry.
        dir from ray[4];
        /// Geometric normal, not normalised.
        ng from hit[0];
    }
}

impl std::fmt::Debug for FilterHit<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FilterHit")
            .field("geom_id", &self.geom_id())
            .field("prim_id", &self.prim_id())
            .field("u", &self.u())
            .field("v", &self.v())
            .field("tfar", &self.tfar())
            .finish_non_exhaustive()
    }
}

/// What the user pointer of a geometry leads to.
pub(crate) struct Callbacks {
    pub(crate) filter: Option<Filter>,
    pub(crate) occlusion_filter: Option<Filter>,
    pub(crate) primitive: Option<Box<dyn UserPrimitive>>,
    pub(crate) panics: Arc<PanicStash>,
}

pub(crate) unsafe extern "C" fn on_intersect_filter(args: *const sys::RTCFilterFunctionNArguments) {
    // SAFETY: Embree passes valid arguments.
    unsafe { filter_lanes(args, |callbacks| callbacks.filter.as_ref()) }
}

pub(crate) unsafe extern "C" fn on_occluded_filter(args: *const sys::RTCFilterFunctionNArguments) {
    // SAFETY: Embree passes valid arguments.
    unsafe { filter_lanes(args, |callbacks| callbacks.occlusion_filter.as_ref()) }
}

/// # Safety
/// `args` must be what Embree passes to a filter of a geometry whose user pointer is a `Callbacks`.
unsafe fn filter_lanes(
    args: *const sys::RTCFilterFunctionNArguments,
    choose: impl Fn(&Callbacks) -> Option<&Filter>,
) {
    // SAFETY: as promised by the caller; `Callbacks` outlives the scene and is only shared.
    let (args, callbacks) = unsafe { (&*args, &*(*args).geometryUserPtr.cast_const().cast::<Callbacks>()) };
    if let Some(filter) = choose(callbacks) {
        // SAFETY: as promised by the caller.
        unsafe { decide(args, &callbacks.panics, filter) }
    }
}

/// Asks `filter` about every valid lane and takes the lanes that it rejects out of `valid`. A panic rejects.
///
/// # Safety
/// `args` must be what Embree passes to a filter.
pub(crate) unsafe fn decide(
    args: &sys::RTCFilterFunctionNArguments,
    panics: &PanicStash,
    filter: &dyn Fn(&FilterHit<'_>) -> bool,
) {
    let lanes = args.N as usize;
    for lane in 0..lanes {
        // SAFETY: `valid` has N entries that are ours for the length of the call.
        let valid = unsafe { &mut *args.valid.add(lane) };
        if *valid == 0 {
            continue;
        }
        // SAFETY: Embree passes N rays and hits component by component; the lane is below N.
        let hit = unsafe { FilterHit::new(args.ray.cast(), args.hit.cast(), lanes, lane) };
        if !panics.guard(false, || filter(&hit)) {
            *valid = 0;
        }
    }
}
