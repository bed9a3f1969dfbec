//! Everything within a distance of a point.

use std::any::Any;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::ptr;

use embree4_sys as sys;

use crate::guard::{LARGEST_RADIUS, is_traceable};
use crate::{INVALID_ID, Scene};

/// A primitive near the point of a query.
pub struct PointCandidate {
    /// Primitive within the geometry.
    pub prim_id: u32,
    /// Geometry within its scene.
    pub geom_id: u32,
    /// Instance that the geometry lies in, or [`INVALID_ID`].
    pub inst_id: u32,
    /// Element of an instance array.
    pub inst_prim_id: u32,
    /// The point of the query, in the space of the outermost scene.
    pub point: [f32; 3],
    /// The instance's transform to the outermost scene as a 3x4 matrix by columns, if the geometry is in an
    /// instance. Distances have to be measured in the outermost space.
    pub instance_to_world: Option<[f32; 12]>,
    radius: f32,
    shrunk: bool,
}

impl PointCandidate {
    /// The distance that still matters.
    #[must_use]
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Leaves out whatever is farther away than `radius` from now on. A radius cannot grow.
    pub fn shrink(&mut self, radius: f32) {
        if radius < self.radius {
            self.radius = radius.max(0.0);
            self.shrunk = true;
        }
    }
}

struct State<'a> {
    visit: &'a mut dyn FnMut(&mut PointCandidate),
    point: [f32; 3],
    panic: Option<Box<dyn Any + Send>>,
}

impl Scene {
    /// Calls `visit` for triangles, quads and user primitives (also within instances) whose bounds come within
    /// `radius` of `point` at `time`, and maybe for some more, in no particular order. To find the nearest, compute
    /// the distance to each and [`shrink`](PointCandidate::shrink) the radius to it. Returns the final radius.
    ///
    /// Embree has no point queries for curves, points and subdivision surfaces; scenes that have some limit the
    /// radius to 1e9. Masks and filters play no part. With a radius that is negative, or anything that is not a
    /// number, nothing is visited.
    ///
    /// # Panics
    /// With a panic of `visit`.
    pub fn point_query(
        &self,
        point: [f32; 3],
        radius: f32,
        time: f32,
        mut visit: impl FnMut(&mut PointCandidate),
    ) -> f32 {
        if radius.is_nan() || radius < 0.0 || point.iter().any(|x| x.is_nan()) {
            return radius;
        }
        let mut state = State { visit: &mut visit, point, panic: None };
        let [x, y, z] = point;
        let (mut time, mut radius) = (time, radius);
        self.guard().settle(&mut time);
        if self.guard().fragile() {
            if !is_traceable(point, [0.0; 3]) {
                return radius;
            }
            radius = radius.min(LARGEST_RADIUS);
        }
        let mut query = sys::RTCPointQuery { x, y, z, time, radius };
        let mut context = sys::RTCPointQueryContext {
            world2inst: [[0.0; 16]],
            inst2world: [[0.0; 16]],
            instID: [INVALID_ID],
            instPrimID: [INVALID_ID],
            instStackSize: 0,
        };
        // SAFETY: the scene is committed; query, context and state live during the call and are only used by it;
        // the callback matches the type, expects a `State` and does not unwind.
        unsafe {
            let state = (&raw mut state).cast::<c_void>();
            sys::rtcPointQuery(self.raw(), &raw mut query, &raw mut context, Some(on_candidate), state);
        }
        if let Some(payload) = state.panic {
            resume_unwind(payload);
        }
        query.radius
    }
}

unsafe extern "C" fn on_candidate(args: *mut sys::RTCPointQueryFunctionArguments) -> bool {
    // SAFETY: Embree passes valid arguments, and the user pointer given to this query.
    let (args, state) = unsafe { (&mut *args, &mut *(*args).userPtr.cast::<State<'_>>()) };
    if state.panic.is_some() {
        return false;
    }
    // SAFETY: Embree passes the query and context given to it, which nobody else uses meanwhile.
    let (query, context) = unsafe { (&mut *args.query, &*ptr::from_ref(&*args.context)) };
    let inside = context.instStackSize > 0;
    let columns = |m: &[f32; 16]| std::array::from_fn(|i| m[i / 3 * 4 + i % 3]);
    let mut candidate = PointCandidate {
        prim_id: args.primID,
        geom_id: args.geomID,
        inst_id: context.instID[0],
        inst_prim_id: context.instPrimID[0],
        point: state.point,
        instance_to_world: inside.then(|| columns(&context.inst2world[0])),
        radius: query.radius,
        shrunk: false,
    };
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| (state.visit)(&mut candidate))) {
        state.panic = Some(payload);
        return false;
    }
    if candidate.shrunk {
        query.radius = candidate.radius;
    }
    candidate.shrunk
}
