//! Flags: what a scene promises, and which features a query has to look for.

use embree4_sys as sys;

bitflags::bitflags! {
    /// How a scene is built and traced.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct SceneFlags: u32 {
        /// Faster builds and updates, slower tracing.
        const DYNAMIC = sys::RTCSceneFlags::RTC_SCENE_FLAG_DYNAMIC.0;
        /// Less memory, somewhat slower tracing.
        const COMPACT = sys::RTCSceneFlags::RTC_SCENE_FLAG_COMPACT.0;
        /// Watertight intersections, somewhat slower tracing.
        const ROBUST = sys::RTCSceneFlags::RTC_SCENE_FLAG_ROBUST.0;
        /// Allows [`Scene::intersect_filtered`](crate::Scene::intersect_filtered) and its kin.
        const QUERY_FILTER = sys::RTCSceneFlags::RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS.0;
    }
}

macro_rules! feature_mask {
    ($($name:ident = $flag:ident, $doc:literal;)*) => {
        bitflags::bitflags! {
            /// Features that a query supports. A scene that uses others may lose those hits, nothing worse.
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
            pub struct FeatureMask: u32 {
                $(#[doc = $doc] const $name = sys::RTCFeatureFlags::$flag.0 as u32;)*
                /// Everything, and what later versions add.
                const ALL = u32::MAX;
            }
        }
    };
}

feature_mask! {
    MOTION_BLUR = RTC_FEATURE_FLAG_MOTION_BLUR, "Several time steps.";
    TRIANGLE = RTC_FEATURE_FLAG_TRIANGLE, "Triangle meshes.";
    QUAD = RTC_FEATURE_FLAG_QUAD, "Quad meshes.";
    SUBDIVISION = RTC_FEATURE_FLAG_SUBDIVISION, "Subdivision surfaces.";
    CURVES = RTC_FEATURE_FLAG_CURVES, "Curves of all kinds.";
    POINT = RTC_FEATURE_FLAG_POINT, "Spheres and discs.";
    INSTANCE = RTC_FEATURE_FLAG_INSTANCE, "Single instances.";
    INSTANCE_ARRAY = RTC_FEATURE_FLAG_INSTANCE_ARRAY, "Instance arrays.";
    FILTER = RTC_FEATURE_FLAG_FILTER_FUNCTION_IN_GEOMETRY, "Filters of geometries.";
    QUERY_FILTER = RTC_FEATURE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS, "Filters of queries.";
    USER_GEOMETRY = RTC_FEATURE_FLAG_USER_GEOMETRY, "User geometries.";
    WIDE_RAY_MASK = RTC_FEATURE_FLAG_32_BIT_RAY_MASK, "Masks with bits above the lowest eight.";
}

impl Default for FeatureMask {
    fn default() -> Self {
        Self::ALL
    }
}

/// How much work a build may spend on fast tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BuildQuality {
    /// Fast build, for scenes that change every frame.
    Low,
    /// Embree's default.
    #[default]
    Medium,
    /// Slow build with spatial splits, fastest tracing.
    High,
    /// For geometries only: moves the bounds of an earlier build along with changed vertices.
    Refit,
}

impl BuildQuality {
    pub(crate) fn raw(self) -> sys::RTCBuildQuality {
        use sys::RTCBuildQuality as Q;
        match self {
            Self::Low => Q::RTC_BUILD_QUALITY_LOW,
            Self::Medium => Q::RTC_BUILD_QUALITY_MEDIUM,
            Self::High => Q::RTC_BUILD_QUALITY_HIGH,
            Self::Refit => Q::RTC_BUILD_QUALITY_REFIT,
        }
    }
}
