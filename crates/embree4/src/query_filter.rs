//! Queries with a filter of their own.
//!
//! The closure travels behind the query context, which Embree hands to its callback unchanged. It runs on the calling
//! thread during the call, so it may borrow and change what it likes, and its panics continue after the call.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr;

use embree4_sys as sys;

use crate::{FilterHit, INVALID_ID, QueryOptions, Ray, RayHit, Scene};

/// Embree sees the first field, the callback all of it.
#[repr(C)]
struct Context<F> {
    base: sys::RTCRayQueryContext,
    filter: F,
    panic: Option<Box<dyn Any + Send>>,
}

impl<F: FnMut(&FilterHit<'_>) -> bool> Context<F> {
    fn new(filter: F) -> Self {
        let base = sys::RTCRayQueryContext { instID: [INVALID_ID], instPrimID: [INVALID_ID] };
        Self { base, filter, panic: None }
    }

    fn finish(self) {
        if let Some(payload) = self.panic {
            resume_unwind(payload);
        }
    }
}

const FLAG: sys::RTCRayQueryFlags = sys::RTCRayQueryFlags::RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;

impl Scene {
    /// [`intersect`](Self::intersect) with a filter for this query, which returns true to accept a hit. It is asked
    /// after a filter of the geometry, and not about user geometries.
    ///
    /// The scene needs [`SceneFlags::QUERY_FILTER`](crate::SceneFlags::QUERY_FILTER); without it the filter is not
    /// called.
    ///
    /// # Panics
    /// With a panic of `filter`.
    #[inline]
    pub fn intersect_filtered<F: FnMut(&FilterHit<'_>) -> bool>(
        &self,
        options: &QueryOptions,
        query: &mut RayHit,
        filter: F,
    ) {
        if self.guard().any() && !self.guard().allows(&mut query.ray) {
            return;
        }
        let mut context = Context::new(filter);
        let mut args = options.intersect();
        args.flags |= FLAG;
        args.context = (&raw mut context).cast();
        args.filter = Some(on_filter::<F>);
        // SAFETY: the scene is committed; ray and hit have Embree's layout; arguments and context live during the
        // call, and the callback expects this context and does not unwind.
        unsafe { sys::rtcIntersect1(self.raw(), ptr::from_mut(query).cast(), &raw mut args) };
        context.finish();
    }

    /// [`occluded`](Self::occluded) with a filter for this query, which returns true if a hit blocks the ray. See
    /// [`intersect_filtered`](Self::intersect_filtered).
    ///
    /// # Panics
    /// With a panic of `filter`.
    #[inline]
    pub fn occluded_filtered<F: FnMut(&FilterHit<'_>) -> bool>(
        &self,
        options: &QueryOptions,
        ray: &mut Ray,
        filter: F,
    ) -> bool {
        if self.guard().any() && !self.guard().allows(ray) {
            return false;
        }
        let mut context = Context::new(filter);
        let mut args = options.occluded();
        args.flags |= FLAG;
        args.context = (&raw mut context).cast();
        args.filter = Some(on_filter::<F>);
        // SAFETY: as above.
        unsafe { sys::rtcOccluded1(self.raw(), ptr::from_mut(ray).cast(), &raw mut args) };
        context.finish();
        ray.is_occluded()
    }
}

unsafe extern "C" fn on_filter<F: FnMut(&FilterHit<'_>) -> bool>(
    args: *const sys::RTCFilterFunctionNArguments,
) {
    // SAFETY: Embree passes valid arguments with the context of this query, which only this callback uses; it is
    // not entered twice, since a filter cannot start the same query.
    let (args, filter, panic) = unsafe {
        let context = (*args).context.cast::<Context<F>>();
        (&*args, &mut (*context).filter, &mut (*context).panic)
    };
    for lane in 0..args.N as usize {
        // SAFETY: `valid` has N entries that are ours during the call.
        let valid = unsafe { &mut *args.valid.add(lane) };
        if *valid == 0 {
            continue;
        }
        // SAFETY: Embree passes N rays and hits component by component; the lane is below N.
        let hit = unsafe { FilterHit::new(args.ray.cast(), args.hit.cast(), args.N as usize, lane) };
        let accepted = panic.is_none()
            && catch_unwind(AssertUnwindSafe(|| filter(&hit))).unwrap_or_else(|payload| {
                *panic = Some(payload);
                false
            });
        if !accepted {
            *valid = 0;
        }
    }
}
