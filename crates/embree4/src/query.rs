//! Tracing rays. Nothing here allocates, locks or checks errors.

use std::ptr;

use embree4_sys as sys;

use crate::{FeatureMask, Ray, Ray4, Ray8, Ray16, RayHit, RayHit4, RayHit8, RayHit16, Scene};
use crate::{Valid4, Valid8, Valid16};

/// Options of a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryOptions {
    /// Rays of a packet start near each other and go the same way, as camera rays do.
    pub coherent: bool,
    /// What to look for; see [`Scene::features`].
    pub feature_mask: FeatureMask,
}

impl QueryOptions {
    /// For rays that go everywhere, and all features: the same as no options.
    pub const INCOHERENT: Self = Self { coherent: false, feature_mask: FeatureMask::ALL };
    /// For rays that go the same way, and all features.
    pub const COHERENT: Self = Self { coherent: true, feature_mask: FeatureMask::ALL };

    #[inline]
    fn flags(self) -> sys::RTCRayQueryFlags {
        if self.coherent {
            sys::RTCRayQueryFlags::RTC_RAY_QUERY_FLAG_COHERENT
        } else {
            sys::RTCRayQueryFlags::RTC_RAY_QUERY_FLAG_INCOHERENT
        }
    }

    #[inline]
    pub(crate) fn intersect(self) -> sys::RTCIntersectArguments {
        sys::RTCIntersectArguments {
            flags: self.flags(),
            feature_mask: sys::RTCFeatureFlags(self.feature_mask.bits() as _),
            context: ptr::null_mut(),
            filter: None,
            intersect: None,
        }
    }

    #[inline]
    pub(crate) fn occluded(self) -> sys::RTCOccludedArguments {
        sys::RTCOccludedArguments {
            flags: self.flags(),
            feature_mask: sys::RTCFeatureFlags(self.feature_mask.bits() as _),
            context: ptr::null_mut(),
            filter: None,
            occluded: None,
        }
    }
}

impl Scene {
    /// Finds the nearest hit between `tnear` and `tfar`; `tfar` becomes its distance. Without a hit nothing changes.
    #[inline]
    pub fn intersect(&self, query: &mut RayHit) {
        if self.guard().any() && !self.guard().allows(&mut query.ray) {
            return;
        }
        // SAFETY: the scene is committed; the structure has Embree's layout and alignment and is ours to write.
        unsafe { sys::rtcIntersect1(self.raw(), ptr::from_mut(query).cast(), ptr::null_mut()) }
    }

    /// [`intersect`](Self::intersect) with options.
    #[inline]
    pub fn intersect_with(&self, options: &QueryOptions, query: &mut RayHit) {
        if self.guard().any() && !self.guard().allows(&mut query.ray) {
            return;
        }
        let mut args = options.intersect();
        // SAFETY: as above; the arguments live during the call.
        unsafe { sys::rtcIntersect1(self.raw(), ptr::from_mut(query).cast(), &raw mut args) }
    }

    /// Whether anything lies between `tnear` and `tfar`; then `tfar` becomes minus infinity.
    #[inline]
    pub fn occluded(&self, ray: &mut Ray) -> bool {
        if self.guard().any() && !self.guard().allows(ray) {
            return false;
        }
        // SAFETY: the scene is committed; the structure has Embree's layout and alignment and is ours to write.
        unsafe { sys::rtcOccluded1(self.raw(), ptr::from_mut(ray).cast(), ptr::null_mut()) };
        ray.is_occluded()
    }

    /// [`occluded`](Self::occluded) with options.
    #[inline]
    pub fn occluded_with(&self, options: &QueryOptions, ray: &mut Ray) -> bool {
        if self.guard().any() && !self.guard().allows(ray) {
            return false;
        }
        let mut args = options.occluded();
        // SAFETY: as above; the arguments live during the call.
        unsafe { sys::rtcOccluded1(self.raw(), ptr::from_mut(ray).cast(), &raw mut args) };
        ray.is_occluded()
    }
}

macro_rules! packet_queries {
    ($n:literal, $Valid:ident, $Ray:ident, $RayHit:ident, $intersect:ident, $intersect_with:ident,
     $occluded:ident, $occluded_with:ident, $rtc_intersect:ident, $rtc_occluded:ident,
     $allowed:ident) => {
        impl Scene {
            #[doc = concat!("[`intersect`](Self::intersect) for the valid ones of ", stringify!($n), " rays.")]
            #[inline]
            pub fn $intersect(&self, valid: &$Valid, query: &mut $RayHit) {
                let allowed;
                let valid = if self.guard().any() {
                    allowed = self.guard().$allowed(valid, &mut query.ray);
                    &allowed
                } else {
                    valid
                };
                // SAFETY: the scene is committed; mask and packet have Embree's layout and alignment, and the
                // packet is ours to write.
                unsafe {
                    let query = ptr::from_mut(query).cast();
                    sys::$rtc_intersect(valid.as_ptr(), self.raw(), query, ptr::null_mut());
                }
            }

            #[doc = concat!("[`", stringify!($intersect), "`](Self::", stringify!($intersect), ") with options.")]
            #[inline]
            pub fn $intersect_with(&self, options: &QueryOptions, valid: &$Valid, query: &mut $RayHit) {
                let allowed;
                let valid = if self.guard().any() {
                    allowed = self.guard().$allowed(valid, &mut query.ray);
                    &allowed
                } else {
                    valid
                };
                let mut args = options.intersect();
                // SAFETY: as above; the arguments live during the call.
                unsafe {
                    let query = ptr::from_mut(query).cast();
                    sys::$rtc_intersect(valid.as_ptr(), self.raw(), query, &raw mut args);
                }
            }

            #[doc = concat!("[`occluded`](Self::occluded) for the valid ones of ", stringify!($n), " rays:")]
            /// `tfar` of blocked rays becomes minus infinity.
            #[inline]
            pub fn $occluded(&self, valid: &$Valid, rays: &mut $Ray) {
                let allowed;
                let valid = if self.guard().any() {
                    allowed = self.guard().$allowed(valid, rays);
                    &allowed
                } else {
                    valid
                };
                // SAFETY: the scene is committed; mask and packet have Embree's layout and alignment, and the
                // packet is ours to write.
                unsafe {
                    let rays = ptr::from_mut(rays).cast();
                    sys::$rtc_occluded(valid.as_ptr(), self.raw(), rays, ptr::null_mut());
                }
            }

            #[doc = concat!("[`", stringify!($occluded), "`](Self::", stringify!($occluded), ") with options.")]
            #[inline]
            pub fn $occluded_with(&self, options: &QueryOptions, valid: &$Valid, rays: &mut $Ray) {
                let allowed;
                let valid = if self.guard().any() {
                    allowed = self.guard().$allowed(valid, rays);
                    &allowed
                } else {
                    valid
                };
                let mut args = options.occluded();
                // SAFETY: as above; the arguments live during the call.
                unsafe {
                    let rays = ptr::from_mut(rays).cast();
                    sys::$rtc_occluded(valid.as_ptr(), self.raw(), rays, &raw mut args);
                }
            }
        }
    };
}

packet_queries!(
    4,
    Valid4,
    Ray4,
    RayHit4,
    intersect4,
    intersect4_with,
    occluded4,
    occluded4_with,
    rtcIntersect4,
    rtcOccluded4,
    allowed4
);
packet_queries!(
    8,
    Valid8,
    Ray8,
    RayHit8,
    intersect8,
    intersect8_with,
    occluded8,
    occluded8_with,
    rtcIntersect8,
    rtcOccluded8,
    allowed8
);
packet_queries!(
    16,
    Valid16,
    Ray16,
    RayHit16,
    intersect16,
    intersect16_with,
    occluded16,
    occluded16_with,
    rtcIntersect16,
    rtcOccluded16,
    allowed16
);
