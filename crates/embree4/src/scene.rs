//! Committed scenes.

use std::collections::BTreeMap;
use std::sync::Arc;

use embree4_sys as sys;

use crate::geometry::RawGeometry;
use crate::guard::Guard;
use crate::panics::PanicStash;
use crate::{Bounds, Device, Error, FeatureMask, GeometryId, LinearBounds, PanicPayload, SceneBuilder};

/// A committed scene: ready for queries from any number of threads, and never changed again.
///
/// Clones share it. To edit, turn the only clone back into a builder with
/// [`try_into_builder`](Self::try_into_builder). Nothing can be attached to a committed scene:
///
/// ```compile_fail,E0599
/// use embree4::{Device, SceneBuilder, TriangleMesh};
/// let scene = SceneBuilder::new(&Device::new().unwrap()).unwrap().commit().unwrap();
/// scene.attach(TriangleMesh::new(vec![], vec![]));
/// ```
///
/// and a builder is gone once it is committed:
///
/// ```compile_fail,E0382
/// use embree4::{Device, SceneBuilder};
/// let mut builder = SceneBuilder::new(&Device::new().unwrap()).unwrap();
/// let scene = builder.commit().unwrap();
/// builder.detach(embree4::GeometryId(0)).unwrap();
/// ```
#[derive(Clone)]
pub struct Scene {
    /// The same as in `inner`, without the indirection.
    raw: sys::RTCScene,
    guard: Guard,
    inner: Arc<SceneInner>,
}

pub(crate) struct SceneInner {
    pub(crate) raw: sys::RTCScene,
    /// Everything that Embree reads and calls through the scene. Dropped after the scene's handle.
    pub(crate) geometries: BTreeMap<u32, RawGeometry>,
    pub(crate) features: FeatureMask,
    pub(crate) panics: Arc<PanicStash>,
    pub(crate) device: Device,
}

// SAFETY: Embree's scenes are counted atomically and not bound to a thread; all other parts are Send.
unsafe impl Send for SceneInner {}
// SAFETY: through `&` only queries happen, which Embree allows from many threads; all other parts are Sync.
unsafe impl Sync for SceneInner {}
// SAFETY: the handle is that of `inner`, which is Send and Sync.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Drop for SceneInner {
    fn drop(&mut self) {
        // SAFETY: this reference was ours and is released once.
        unsafe { sys::rtcReleaseScene(self.raw) }
    }
}

impl SceneInner {
    pub(crate) fn geometry(&self, id: GeometryId) -> Result<&RawGeometry, Error> {
        self.geometries.get(&id.0).ok_or(Error::NoSuchGeometry(id))
    }

    fn take_panic(&self) -> Option<PanicPayload> {
        let instanced = || self.geometries.values().flat_map(|g| &g.scenes);
        self.panics.take().or_else(|| instanced().find_map(|scene| scene.inner.take_panic()))
    }
}

impl Scene {
    pub(crate) fn new(inner: SceneInner) -> Self {
        let (raw, guard) = (inner.raw, Guard::new(inner.features));
        Self { raw, guard, inner: Arc::new(inner) }
    }

    #[inline]
    pub(crate) fn raw(&self) -> sys::RTCScene {
        self.raw
    }

    /// What to check of rays.
    #[inline]
    pub(crate) fn guard(&self) -> Guard {
        self.guard
    }

    pub(crate) fn inner(&self) -> &SceneInner {
        &self.inner
    }

    /// The device that the scene lives on.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.inner.device
    }

    /// What the scene and the scenes instanced in it use; good as
    /// [`QueryOptions::feature_mask`](crate::QueryOptions::feature_mask).
    #[must_use]
    pub fn features(&self) -> FeatureMask {
        self.inner.features
    }

    /// Ids of all geometries.
    pub fn geometry_ids(&self) -> impl Iterator<Item = GeometryId> + '_ {
        self.inner.geometries.keys().copied().map(GeometryId)
    }

    /// Number of primitives of a geometry.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`].
    pub fn primitive_count(&self, id: GeometryId) -> Result<u32, Error> {
        Ok(self.inner.geometry(id)?.primitives)
    }

    /// The box around everything at all times; empty if there is nothing to hit.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let mut raw = sys::RTCBounds::default();
        // SAFETY: the scene is committed; there is room for one result.
        unsafe { sys::rtcGetSceneBounds(self.raw, &raw mut raw) };
        Bounds::from_raw(&raw)
    }

    /// Boxes at both ends of the time range.
    #[must_use]
    pub fn linear_bounds(&self) -> LinearBounds {
        let mut raw = sys::RTCLinearBounds::default();
        // SAFETY: the scene is committed; there is room for one result.
        unsafe { sys::rtcGetSceneLinearBounds(self.raw, &raw mut raw) };
        LinearBounds { start: Bounds::from_raw(&raw.bounds0), end: Bounds::from_raw(&raw.bounds1) }
    }

    /// The first panic of a filter or user primitive since the last call, of this scene or one instanced in it.
    ///
    /// Queries do not look for panics, so that they cost nothing more; callers with filters or user geometries
    /// should ask after a batch of queries, and may continue the panic with [`std::panic::resume_unwind`].
    #[must_use]
    pub fn take_panic(&self) -> Option<PanicPayload> {
        self.inner.take_panic()
    }

    /// Turns the scene back into a builder, if this is its only clone and nothing instances it.
    ///
    /// # Errors
    /// The scene itself, if it is shared.
    pub fn try_into_builder(self) -> Result<SceneBuilder, Self> {
        let Self { raw, guard, inner } = self;
        Arc::try_unwrap(inner).map(SceneBuilder::from_inner).map_err(|inner| Self { raw, guard, inner })
    }
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scene")
            .field("geometries", &self.inner.geometries.len())
            .field("features", &self.inner.features)
            .finish_non_exhaustive()
    }
}
