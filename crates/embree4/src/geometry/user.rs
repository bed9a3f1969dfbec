//! Geometries whose primitives are Rust code.

use std::sync::Arc;

use embree4_sys as sys;

use super::sealed::Sealed;
use super::{CreateContext, Options, RawGeometry, filter_options, geometry_options};
use crate::filter::Callbacks;
use crate::{Bounds, Error, FeatureMask, FilterHit, Hit, Ray};

/// Shapes that Embree asks about by number. Called from many threads at once.
///
/// A panic in `bounds` stops the commit and continues there; the primitive counts as empty. A panic in `intersect`
/// or `occluded` counts as a miss and can be fetched with [`Scene::take_panic`](crate::Scene::take_panic).
pub trait UserPrimitive: Send + Sync + 'static {
    /// A box around the primitive at the given time step. Empty or non-finite boxes are never asked again.
    fn bounds(&self, prim_id: u32, time_step: u32) -> Bounds;

    /// The nearest hit between `ray.tnear` and `ray.tfar`. Hits outside of that are ignored.
    fn intersect(&self, prim_id: u32, ray: &Ray) -> Option<UserHit>;

    /// Whether anything lies between `ray.tnear` and `ray.tfar`.
    ///
    /// With an occlusion filter set, `intersect` is asked instead, because the filter needs to see the hit.
    fn occluded(&self, prim_id: u32, ray: &Ray) -> bool {
        self.intersect(prim_id, ray).is_some()
    }
}

impl<T: UserPrimitive + ?Sized> UserPrimitive for Arc<T> {
    fn bounds(&self, prim_id: u32, time_step: u32) -> Bounds {
        (**self).bounds(prim_id, time_step)
    }

    fn intersect(&self, prim_id: u32, ray: &Ray) -> Option<UserHit> {
        (**self).intersect(prim_id, ray)
    }

    fn occluded(&self, prim_id: u32, ray: &Ray) -> bool {
        (**self).occluded(prim_id, ray)
    }
}

/// A hit of a user primitive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UserHit {
    /// Distance along the ray.
    pub t: f32,
    /// Geometric normal, of any length.
    pub ng: [f32; 3],
    /// First surface coordinate.
    pub u: f32,
    /// Second surface coordinate.
    pub v: f32,
}

/// Primitives defined by a [`UserPrimitive`].
///
/// The state must be shareable between threads:
///
/// ```compile_fail,E0277
/// use embree4::{Bounds, Ray, UserGeometry, UserHit, UserPrimitive};
/// struct Counting(std::rc::Rc<u32>);
/// impl UserPrimitive for Counting {
///     fn bounds(&self, _: u32, _: u32) -> Bounds { Bounds::EMPTY }
///     fn intersect(&self, _: u32, _: &Ray) -> Option<UserHit> { None }
/// }
/// ```
#[must_use]
pub struct UserGeometry {
    count: u32,
    steps: usize,
    primitive: Box<dyn UserPrimitive>,
    options: Options,
}

geometry_options!(UserGeometry);
filter_options!(UserGeometry);

impl UserGeometry {
    /// `count` primitives, numbered from 0.
    pub fn new(count: u32, primitive: impl UserPrimitive) -> Self {
        Self { count, steps: 1, primitive: Box::new(primitive), options: Options::default() }
    }

    /// Number of time steps that `bounds` is asked about; between them bounds are interpolated linearly.
    pub fn time_step_count(mut self, steps: usize) -> Self {
        self.steps = steps;
        self
    }
}

impl Sealed for UserGeometry {
    #[allow(private_interfaces, reason = "nobody outside can name this trait")]
    fn create(mut self, context: &CreateContext<'_>) -> Result<RawGeometry, Error> {
        let kind = sys::RTCGeometryType::RTC_GEOMETRY_TYPE_USER;
        let mut geometry = RawGeometry::new(context, kind, FeatureMask::USER_GEOMETRY, self.count as usize)?;
        if self.steps == 0 {
            return Err(Error::InvalidOption { what: "time steps", reason: "at least one is needed" });
        }
        geometry.set_steps(self.steps)?;
        let (filter, occlusion_filter) = (self.options.filter.take(), self.options.occlusion_filter.take());
        geometry.set_options(self.options, context.panics)?;
        let panics = Arc::clone(context.panics);
        geometry.set_callbacks(Callbacks {
            filter,
            occlusion_filter,
            primitive: Some(self.primitive),
            panics,
        });
        // SAFETY: the geometry is a valid user geometry and not shared; the callbacks match their types.
        unsafe {
            let raw = geometry.raw();
            sys::rtcSetGeometryUserPrimitiveCount(raw, self.count);
            sys::rtcSetGeometryBoundsFunction(raw, Some(on_bounds), std::ptr::null_mut());
            sys::rtcSetGeometryIntersectFunction(raw, Some(on_intersect));
            sys::rtcSetGeometryOccludedFunction(raw, Some(on_occluded));
        }
        geometry.commit()
    }
}

unsafe extern "C" fn on_bounds(args: *const sys::RTCBoundsFunctionArguments) {
    // SAFETY: Embree passes valid arguments; the user pointer is our `Callbacks`, which is only shared.
    let (args, callbacks) = unsafe { (&*args, &*(*args).geometryUserPtr.cast_const().cast::<Callbacks>()) };
    let Some(primitive) = &callbacks.primitive else { return };
    let bounds = callbacks
        .panics
        .guard_in_build(Bounds::EMPTY, || primitive.bounds(args.primID, args.timeStep))
        .to_raw();
    // SAFETY: Embree passes room for one result.
    unsafe { args.bounds_o.write(bounds) };
}

unsafe extern "C" fn on_intersect(args: *const sys::RTCIntersectFunctionNArguments) {
    // SAFETY: Embree passes valid arguments; the user pointer is our `Callbacks`, which is only shared.
    let (args, callbacks) = unsafe { (&*args, &*(*args).geometryUserPtr.cast_const().cast::<Callbacks>()) };
    let Some(primitive) = &callbacks.primitive else { return };
    let lanes = args.N as usize;
    for lane in 0..lanes {
        // SAFETY: `valid` has N entries that are ours during the call.
        let valid = unsafe { &mut *args.valid.add(lane) };
        if *valid == 0 {
            continue;
        }
        // SAFETY: Embree passes N rays, followed by N hits; the lane is below N.
        let ray = unsafe { read_ray(args.rayhit.cast(), lanes, lane) };
        let found = callbacks.panics.guard(None, || {
            let found = primitive.intersect(args.primID, &ray)?;
            // SAFETY: Embree passes its context, which is not changed during the call.
            let hit = accept(&ray, &found, args.primID, args.geomID, unsafe { &*args.context })?;
            let seen = Ray { tfar: found.t, ..ray };
            let filter = callbacks.filter.as_ref();
            filter.is_none_or(|filter| filter(&FilterHit::single(&seen, &hit))).then_some((found.t, hit))
        });
        *valid = 0;
        if let Some((t, hit)) = found {
            *valid = -1;
            // SAFETY: as for the read; the packet is writable during the call.
            unsafe {
                let base: *mut f32 = args.rayhit.cast();
                base.add(8 * lanes + lane).write(t);
                write_hit(base.add(12 * lanes), lanes, lane, &hit);
            }
        }
    }
}

unsafe extern "C" fn on_occluded(args: *const sys::RTCOccludedFunctionNArguments) {
    // SAFETY: Embree passes valid arguments; the user pointer is our `Callbacks`, which is only shared.
    let (args, callbacks) = unsafe { (&*args, &*(*args).geometryUserPtr.cast_const().cast::<Callbacks>()) };
    let Some(primitive) = &callbacks.primitive else { return };
    let lanes = args.N as usize;
    for lane in 0..lanes {
        // SAFETY: `valid` has N entries that are ours during the call.
        let valid = unsafe { &mut *args.valid.add(lane) };
        if *valid == 0 {
            continue;
        }
        // SAFETY: Embree passes N rays; the lane is below N.
        let ray = unsafe { read_ray(args.ray.cast(), lanes, lane) };
        let blocked = callbacks.panics.guard(false, || {
            let Some(filter) = &callbacks.occlusion_filter else {
                return primitive.occluded(args.primID, &ray);
            };
            let Some(found) = primitive.intersect(args.primID, &ray) else { return false };
            // SAFETY: Embree passes its context, which is not changed during the call.
            accept(&ray, &found, args.primID, args.geomID, unsafe { &*args.context })
                .is_some_and(|hit| filter(&FilterHit::single(&ray, &hit)))
        });
        *valid = 0;
        if blocked {
            *valid = -1;
            // SAFETY: as for the read; the packet is writable during the call.
            unsafe { args.ray.cast::<f32>().add(8 * lanes + lane).write(f32::NEG_INFINITY) };
        }
    }
}

/// The hit as Embree wants it, if it lies on the ray's segment.
fn accept(
    ray: &Ray,
    found: &UserHit,
    prim_id: u32,
    geom_id: u32,
    context: &sys::RTCRayQueryContext,
) -> Option<Hit> {
    (ray.tnear <= found.t && found.t <= ray.tfar).then_some(Hit {
        ng: found.ng,
        u: found.u,
        v: found.v,
        prim_id,
        geom_id,
        inst_id: context.instID,
        inst_prim_id: context.instPrimID,
    })
}

/// # Safety
/// `base` must point to a packet of `lanes` rays, and `lane` be below `lanes`.
unsafe fn read_ray(base: *const f32, lanes: usize, lane: usize) -> Ray {
    // SAFETY: as promised by the caller: every component has `lanes` values.
    let f = |component: usize| unsafe { base.add(component * lanes + lane).read() };
    Ray {
        org: [f(0), f(1), f(2)],
        tnear: f(3),
        dir: [f(4), f(5), f(6)],
        time: f(7),
        tfar: f(8),
        mask: f(9).to_bits(),
        id: f(10).to_bits(),
        flags: f(11).to_bits(),
    }
}

/// # Safety
/// `base` must point to a writable packet of `lanes` hits, and `lane` be below `lanes`.
unsafe fn write_hit(base: *mut f32, lanes: usize, lane: usize, hit: &Hit) {
    let id = f32::from_bits;
    let values = [
        hit.ng[0],
        hit.ng[1],
        hit.ng[2],
        hit.u,
        hit.v,
        id(hit.prim_id),
        id(hit.geom_id),
        id(hit.inst_id[0]),
        id(hit.inst_prim_id[0]),
    ];
    for (component, value) in values.into_iter().enumerate() {
        // SAFETY: as promised by the caller: every component has `lanes` values.
        unsafe { base.add(component * lanes + lane).write(value) };
    }
}
