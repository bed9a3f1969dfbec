//! Keeps rays away from scenes that they could crash.
//!
//! Embree's traversal may enter the unused children of a node with a ray that is not made of finite numbers: infinity
//! times zero passes a comparison there. Leaves of triangles, quads, instances and user geometries then are empty
//! loops. Leaves of curves, points and subdivision surfaces are read before that, at address zero. So scenes with
//! those ("fragile" ones) check every ray, others do not. Scenes that move check the time, which Embree turns into an
//! index. Nothing else is checked, and scenes that are neither pay one predictable branch a query.

use crate::{FeatureMask, Ray};

/// Largest coordinate of origins and directions in fragile scenes; Embree ignores geometry beyond about the same.
pub(crate) const LARGEST: f32 = 1e18;

/// Largest radius of a point query in fragile scenes, so that its square is finite within instances too.
pub(crate) const LARGEST_RADIUS: f32 = 1e9;

const FRAGILE: FeatureMask = FeatureMask::CURVES.union(FeatureMask::POINT).union(FeatureMask::SUBDIVISION);

/// What queries of a scene have to check.
#[derive(Clone, Copy)]
pub(crate) struct Guard {
    moving: bool,
    fragile: bool,
    any: bool,
}

impl Guard {
    pub(crate) fn new(features: FeatureMask) -> Self {
        let moving = features.contains(FeatureMask::MOTION_BLUR);
        let fragile = is_fragile(features);
        Self { moving, fragile, any: moving || fragile }
    }

    /// Whether there is anything to check.
    #[inline]
    pub(crate) fn any(self) -> bool {
        self.any
    }

    pub(crate) fn fragile(self) -> bool {
        self.fragile
    }

    /// Settles the time and says whether the ray may be traced; if not, it misses.
    #[inline]
    pub(crate) fn allows(self, ray: &mut Ray) -> bool {
        self.settle(&mut ray.time);
        !self.fragile || is_traceable(ray.org, ray.dir)
    }

    /// Moves the time into 0 to 1; a time that is not a number becomes 0.
    #[inline]
    pub(crate) fn settle(self, time: &mut f32) {
        if self.moving && !(0.0..=1.0).contains(time) {
            *time = if *time > 1.0 { 1.0 } else { 0.0 };
        }
    }
}

pub(crate) fn is_fragile(features: FeatureMask) -> bool {
    features.intersects(FRAGILE)
}

#[inline]
pub(crate) fn is_traceable(org: [f32; 3], dir: [f32; 3]) -> bool {
    // One comparison for each number, no early exit: NaN compares false.
    let mut all = true;
    for x in [org[0], org[1], org[2], dir[0], dir[1], dir[2]] {
        all &= x.abs() <= LARGEST;
    }
    all
}
