//! Packets of 4, 8 and 16 rays, stored component by component.

use std::mem::offset_of;

use embree4_sys as sys;

use crate::guard::{Guard, is_traceable};
use crate::ray::same_layout;
use crate::{Hit, INVALID_ID, Ray};

macro_rules! packet {
    ($n:literal, $align:literal, $Ray:ident, $Hit:ident, $RayHit:ident, $Valid:ident,
     $RtcRay:ident, $RtcHit:ident, $RtcRayHit:ident, $allowed:ident) => {
        #[doc = concat!(stringify!($n), " rays; the fields are those of [`Ray`](crate::Ray).")]
        #[repr(C, align($align))]
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(missing_docs, reason = "documented once, at Ray")]
        pub struct $Ray {
            pub org_x: [f32; $n],
            pub org_y: [f32; $n],
            pub org_z: [f32; $n],
            pub tnear: [f32; $n],
            pub dir_x: [f32; $n],
            pub dir_y: [f32; $n],
            pub dir_z: [f32; $n],
            pub time: [f32; $n],
            pub tfar: [f32; $n],
            pub mask: [u32; $n],
            pub id: [u32; $n],
            pub flags: [u32; $n],
        }

        impl $Ray {
            /// Number of rays.
            pub const LANES: usize = $n;

            /// Rays of no length that see nothing.
            pub const EMPTY: Self = Self {
                org_x: [0.0; $n],
                org_y: [0.0; $n],
                org_z: [0.0; $n],
                tnear: [0.0; $n],
                dir_x: [0.0; $n],
                dir_y: [0.0; $n],
                dir_z: [1.0; $n],
                time: [0.0; $n],
                tfar: [0.0; $n],
                mask: [0; $n],
                id: [0; $n],
                flags: [0; $n],
            };

            /// Calls `ray` for every lane.
            #[inline]
            #[must_use]
            pub fn from_fn(mut ray: impl FnMut(usize) -> Ray) -> Self {
                let mut packet = Self::EMPTY;
                for lane in 0..$n {
                    packet.set(lane, &ray(lane));
                }
                packet
            }

            /// Writes one lane.
            ///
            /// # Panics
            #[doc = concat!("If `lane` is not below ", stringify!($n), ".")]
            #[inline]
            pub fn set(&mut self, lane: usize, ray: &Ray) {
                [self.org_x[lane], self.org_y[lane], self.org_z[lane]] = ray.org;
                self.tnear[lane] = ray.tnear;
                [self.dir_x[lane], self.dir_y[lane], self.dir_z[lane]] = ray.dir;
                self.time[lane] = ray.time;
                self.tfar[lane] = ray.tfar;
                self.mask[lane] = ray.mask;
                self.id[lane] = ray.id;
                self.flags[lane] = ray.flags;
            }

            /// Reads one lane.
            ///
            /// # Panics
            #[doc = concat!("If `lane` is not below ", stringify!($n), ".")]
            #[inline]
            #[must_use]
            pub fn get(&self, lane: usize) -> Ray {
                Ray {
                    org: [self.org_x[lane], self.org_y[lane], self.org_z[lane]],
                    tnear: self.tnear[lane],
                    dir: [self.dir_x[lane], self.dir_y[lane], self.dir_z[lane]],
                    time: self.time[lane],
                    tfar: self.tfar[lane],
                    mask: self.mask[lane],
                    id: self.id[lane],
                    flags: self.flags[lane],
                }
            }
        }

        impl Default for $Ray {
            fn default() -> Self {
                Self::EMPTY
            }
        }

        #[doc = concat!(stringify!($n), " hits; the fields are those of [`Hit`](crate::Hit).")]
        #[repr(C, align($align))]
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[allow(missing_docs, reason = "documented once, at Hit")]
        pub struct $Hit {
            pub ng_x: [f32; $n],
            pub ng_y: [f32; $n],
            pub ng_z: [f32; $n],
            pub u: [f32; $n],
            pub v: [f32; $n],
            pub prim_id: [u32; $n],
            pub geom_id: [u32; $n],
            pub inst_id: [[u32; $n]; 1],
            pub inst_prim_id: [[u32; $n]; 1],
        }

        impl $Hit {
            /// No hit in any lane.
            pub const NONE: Self = Self {
                ng_x: [0.0; $n],
                ng_y: [0.0; $n],
                ng_z: [0.0; $n],
                u: [0.0; $n],
                v: [0.0; $n],
                prim_id: [INVALID_ID; $n],
                geom_id: [INVALID_ID; $n],
                inst_id: [[INVALID_ID; $n]],
                inst_prim_id: [[INVALID_ID; $n]],
            };

            /// Reads one lane.
            ///
            /// # Panics
            #[doc = concat!("If `lane` is not below ", stringify!($n), ".")]
            #[inline]
            #[must_use]
            pub fn get(&self, lane: usize) -> Hit {
                Hit {
                    ng: [self.ng_x[lane], self.ng_y[lane], self.ng_z[lane]],
                    u: self.u[lane],
                    v: self.v[lane],
                    prim_id: self.prim_id[lane],
                    geom_id: self.geom_id[lane],
                    inst_id: [self.inst_id[0][lane]],
                    inst_prim_id: [self.inst_prim_id[0][lane]],
                }
            }
        }

        impl Default for $Hit {
            fn default() -> Self {
                Self::NONE
            }
        }

        #[doc = concat!(stringify!($n), " rays and room for their hits.")]
        #[repr(C, align($align))]
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $RayHit {
            /// The rays.
            pub ray: $Ray,
            /// What they hit.
            pub hit: $Hit,
        }

        impl $RayHit {
            /// Rays that have hit nothing yet.
            #[inline]
            #[must_use]
            pub const fn new(ray: $Ray) -> Self {
                Self { ray, hit: $Hit::NONE }
            }
        }

        impl Guard {
            /// Settles the times, and leaves out rays that must not be traced.
            #[inline]
            pub(crate) fn $allowed(self, valid: &$Valid, rays: &mut $Ray) -> $Valid {
                let mut allowed = *valid;
                for lane in 0..$n {
                    self.settle(&mut rays.time[lane]);
                    let Ray { org, dir, .. } = rays.get(lane);
                    if self.fragile() && !is_traceable(org, dir) {
                        allowed.0[lane] = 0;
                    }
                }
                allowed
            }
        }

        impl From<$Ray> for $RayHit {
            #[inline]
            fn from(ray: $Ray) -> Self {
                Self::new(ray)
            }
        }

        #[doc = concat!("Which of ", stringify!($n), " rays take part in a query.")]
        #[repr(C, align($align))]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $Valid([i32; $n]);

        impl $Valid {
            /// Every ray.
            pub const ALL: Self = Self([-1; $n]);
            /// No ray.
            pub const NONE: Self = Self([0; $n]);

            #[doc = concat!("The first `count` rays; all if there are more than ", stringify!($n), ".")]
            #[inline]
            #[must_use]
            pub fn first(count: usize) -> Self {
                Self::from_fn(|lane| lane < count)
            }

            /// The rays for which `valid` holds.
            #[inline]
            #[must_use]
            pub fn from_fn(mut valid: impl FnMut(usize) -> bool) -> Self {
                Self(std::array::from_fn(|lane| -i32::from(valid(lane))))
            }

            /// Includes or excludes one ray.
            ///
            /// # Panics
            #[doc = concat!("If `lane` is not below ", stringify!($n), ".")]
            #[inline]
            pub fn set(&mut self, lane: usize, valid: bool) {
                self.0[lane] = -i32::from(valid);
            }

            /// Whether a ray takes part.
            ///
            /// # Panics
            #[doc = concat!("If `lane` is not below ", stringify!($n), ".")]
            #[inline]
            #[must_use]
            pub fn get(&self, lane: usize) -> bool {
                self.0[lane] != 0
            }

            /// Embree's form: -1 for rays that take part, 0 for others.
            #[inline]
            pub(crate) fn as_ptr(&self) -> *const i32 {
                self.0.as_ptr()
            }
        }

        same_layout!($Ray, sys::$RtcRay; org_x = org_x, org_y = org_y, org_z = org_z, tnear = tnear,
            dir_x = dir_x, dir_y = dir_y, dir_z = dir_z, time = time, tfar = tfar, mask = mask, id = id,
            flags = flags);
        same_layout!($Hit, sys::$RtcHit; ng_x = Ng_x, ng_y = Ng_y, ng_z = Ng_z, u = u, v = v,
            prim_id = primID, geom_id = geomID, inst_id = instID, inst_prim_id = instPrimID);
        same_layout!($RayHit, sys::$RtcRayHit; ray = ray, hit = hit);
        const _: () = assert!(size_of::<$Valid>() == 4 * $n && align_of::<$Valid>() == $align);
    };
}

packet!(4, 16, Ray4, Hit4, RayHit4, Valid4, RTCRay4, RTCHit4, RTCRayHit4, allowed4);
packet!(8, 32, Ray8, Hit8, RayHit8, Valid8, RTCRay8, RTCHit8, RTCRayHit8, allowed8);
packet!(16, 64, Ray16, Hit16, RayHit16, Valid16, RTCRay16, RTCHit16, RTCRayHit16, allowed16);
