//! Scenes that are being put together.

use std::collections::BTreeMap;
use std::ffi::c_void;
use std::panic::resume_unwind;
use std::sync::{Arc, Mutex, PoisonError};

use embree4_sys as sys;

use crate::geometry::sealed::Sealed;
use crate::geometry::{CreateContext, Geometry, RawGeometry, Slot, check_length, transform};
use crate::panics::PanicStash;
use crate::scene::SceneInner;
use crate::{BuildQuality, Device, Error, FeatureMask, GeometryId, Scene, SceneFlags, SharedBuffer};

type Progress = Box<dyn Fn(f64) -> bool + Send + Sync>;

/// A scene before it is committed: geometries come and go, nothing can be traced.
///
/// ```
/// use embree4::{Device, Ray, RayHit, SceneBuilder, TriangleMesh};
/// let device = Device::new()?;
/// let mut builder = SceneBuilder::new(&device)?;
/// let vertices = vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
/// let id = builder.attach(TriangleMesh::new(vertices, vec![[0, 1, 2]]))?;
/// let scene = builder.commit()?;
///
/// let mut query = RayHit::new(Ray::new([0.2, 0.2, 0.0], [0.0, 0.0, 1.0]));
/// scene.intersect(&mut query);
/// assert_eq!(query.hit.geometry(), Some(id));
/// assert_eq!(query.ray.tfar, 1.0);
/// # Ok::<(), embree4::Error>(())
/// ```
pub struct SceneBuilder {
    inner: SceneInner,
    progress: Option<Progress>,
}

impl SceneBuilder {
    /// An empty scene.
    ///
    /// # Errors
    /// [`Error::Embree`] if there is no memory.
    pub fn new(device: &Device) -> Result<Self, Error> {
        device.clear_error();
        // SAFETY: the device is valid; a null result is handled.
        let raw = unsafe { sys::rtcNewScene(device.raw()) };
        if raw.is_null() {
            device.check()?;
            return Err(Error::Unsupported("Embree made no scene"));
        }
        let inner = SceneInner {
            raw,
            geometries: BTreeMap::new(),
            features: FeatureMask::empty(),
            panics: Arc::default(),
            device: device.clone(),
        };
        Ok(Self { inner, progress: None })
    }

    pub(crate) fn from_inner(inner: SceneInner) -> Self {
        Self { inner, progress: None }
    }

    /// How the scene is built and traced.
    #[must_use]
    pub fn flags(self, flags: SceneFlags) -> Self {
        let flags = sys::RTCSceneFlags(flags.bits() & SceneFlags::all().bits());
        // SAFETY: the scene is valid and not shared.
        unsafe { sys::rtcSetSceneFlags(self.inner.raw, flags) };
        self
    }

    /// How much work the build may spend. `Refit` is for geometries; here it means `Low`.
    #[must_use]
    pub fn build_quality(self, quality: BuildQuality) -> Self {
        let quality = if quality == BuildQuality::Refit { BuildQuality::Low } else { quality };
        // SAFETY: the scene is valid and not shared.
        unsafe { sys::rtcSetSceneBuildQuality(self.inner.raw, quality.raw()) };
        self
    }

    /// Calls `progress` during the commit with the part that is done, from any thread, about every ten
    /// milliseconds. Returning false stops the commit with [`ErrorCode::Cancelled`](crate::ErrorCode::Cancelled).
    /// A panic stops it too, and continues from the commit.
    #[must_use]
    pub fn progress(mut self, progress: impl Fn(f64) -> bool + Send + Sync + 'static) -> Self {
        self.progress = Some(Box::new(progress));
        self
    }

    /// Takes a geometry in, under the lowest free id.
    ///
    /// # Errors
    /// Whatever is wrong with its buffers or options, or Embree has no memory. The builder stays as it was.
    pub fn attach(&mut self, geometry: impl Geometry) -> Result<GeometryId, Error> {
        let geometry = self.create(geometry)?;
        // SAFETY: scene and geometry are valid, of the same device, and not shared.
        let id = unsafe { sys::rtcAttachGeometry(self.inner.raw, geometry.raw()) };
        self.inner.device.check()?;
        self.inner.geometries.insert(id, geometry);
        Ok(GeometryId(id))
    }

    /// Takes a geometry in under the given id. Ids should be dense.
    ///
    /// # Errors
    /// As [`attach`](Self::attach), and [`Error::GeometryIdUnavailable`].
    pub fn attach_with_id(&mut self, geometry: impl Geometry, id: GeometryId) -> Result<(), Error> {
        if id > GeometryId::MAX || self.inner.geometries.contains_key(&id.0) {
            return Err(Error::GeometryIdUnavailable(id));
        }
        let geometry = self.create(geometry)?;
        // SAFETY: scene and geometry are valid, of the same device, and not shared; the id is free.
        unsafe { sys::rtcAttachGeometryByID(self.inner.raw, geometry.raw(), id.0) };
        self.inner.device.check()?;
        self.inner.geometries.insert(id.0, geometry);
        Ok(())
    }

    /// Removes a geometry; its id becomes free.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`].
    pub fn detach(&mut self, id: GeometryId) -> Result<(), Error> {
        self.inner.geometry(id)?;
        self.inner.device.clear_error();
        // SAFETY: the scene is valid and not shared; the id is attached.
        unsafe { sys::rtcDetachGeometry(self.inner.raw, id.0) };
        self.inner.device.check()?;
        self.inner.geometries.remove(&id.0);
        Ok(())
    }

    /// Hides a geometry from rays, or shows it again, from the next commit on.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`].
    pub fn set_enabled(&mut self, id: GeometryId, enabled: bool) -> Result<(), Error> {
        self.edit(id, |raw| {
            // SAFETY: the geometry is valid and not shared.
            unsafe { if enabled { sys::rtcEnableGeometry(raw) } else { sys::rtcDisableGeometry(raw) } }
        })
    }

    /// Changes a geometry's mask from the next commit on.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`].
    pub fn set_mask(&mut self, id: GeometryId, mask: u32) -> Result<(), Error> {
        if mask > 0xFF
            && let Some(geometry) = self.inner.geometries.get_mut(&id.0)
        {
            geometry.features |= FeatureMask::WIDE_RAY_MASK;
        }
        self.edit(id, |raw| {
            // SAFETY: the geometry is valid and not shared.
            unsafe { sys::rtcSetGeometryMask(raw, mask) }
        })
    }

    /// Changes the placement of a single instance.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`], [`Error::NotFinite`] and [`Error::InvalidOption`] as for
    /// [`Instance`](crate::Instance), or [`Error::Unsupported`] for other geometries.
    pub fn set_transform(&mut self, id: GeometryId, transform: [f32; 12]) -> Result<(), Error> {
        let geometry = self.inner.geometries.get_mut(&id.0).ok_or(Error::NoSuchGeometry(id))?;
        if geometry.kind != sys::RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE || geometry.steps != 1 {
            return Err(Error::Unsupported("only an instance with one time step has a transform to set"));
        }
        transform::check(&geometry.scenes, &[&[transform]])?;
        geometry.set_transform(0, &transform);
        self.edit(id, |_| ())
    }

    /// Replaces the vertices of one time step by as many others.
    ///
    /// # Errors
    /// [`Error::NoSuchGeometry`]; [`Error::LengthMismatch`]; [`Error::Unsupported`] if the geometry has no such
    /// time step, or vertices of another type.
    pub fn update_vertices<T: crate::Element>(
        &mut self,
        id: GeometryId,
        time_step: u32,
        vertices: impl Into<SharedBuffer<T>>,
    ) -> Result<(), Error> {
        let geometry = self.inner.geometries.get_mut(&id.0).ok_or(Error::NoSuchGeometry(id))?;
        let vertices = vertices.into();
        let slot = Slot::vertex(time_step);
        match geometry.buffers.get(&slot) {
            Some(old) if old.format == T::FORMAT => check_length("vertices", vertices.len(), old.len)?,
            _ => return Err(Error::Unsupported("no vertices of this type at this time step")),
        }
        geometry.set_buffer(slot, vertices);
        self.edit(id, |raw| {
            // SAFETY: the geometry is valid and not shared, and the buffer exists.
            unsafe { sys::rtcUpdateGeometryBuffer(raw, sys::RTCBufferType(slot.0), slot.1) }
        })
    }

    /// Builds the scene with Embree's threads.
    ///
    /// # Errors
    /// [`Error::Embree`]: no memory, or cancelled by the progress callback. The scene is gone then.
    ///
    /// # Panics
    /// With the panic of a progress callback or of [`UserPrimitive::bounds`](crate::UserPrimitive::bounds).
    pub fn commit(self) -> Result<Scene, Error> {
        self.commit_by(|scene, device| {
            // SAFETY: the scene is valid and nobody else uses it.
            unsafe { sys::rtcCommitScene(scene) };
            device.check()
        })
    }

    /// Builds the scene with the caller's threads: `help` should call [`Joiner::join`] on all of them.
    ///
    /// With a pool of rayon, say, `builder.commit_with(|joiner| { pool.broadcast(|_| joiner.join()); })`. Give the
    /// device as many `user_threads`, or Embree's own take part as well.
    ///
    /// # Errors
    /// As [`commit`](Self::commit).
    ///
    /// # Panics
    /// As [`commit`](Self::commit), and with a panic of `help`.
    pub fn commit_with(self, help: impl FnOnce(&Joiner<'_>)) -> Result<Scene, Error> {
        self.commit_by(|raw, device| {
            let joiner = Joiner { raw, device, error: Mutex::new(None) };
            help(&joiner);
            if let Some(error) = joiner.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
                return Err(error);
            }
            // SAFETY: the scene is valid, and the helpers have returned since they borrow the joiner. This does
            // nothing if they built the scene, and everything if none helped.
            unsafe { sys::rtcJoinCommitScene(raw) };
            device.check()
        })
    }

    fn commit_by(
        mut self,
        build: impl FnOnce(sys::RTCScene, &Device) -> Result<(), Error>,
    ) -> Result<Scene, Error> {
        let raw = self.inner.raw;
        self.inner.features =
            self.inner.geometries.values().map(|g| g.features).fold(FeatureMask::empty(), |a, b| a | b);
        self.inner.device.clear_error();
        let monitor = self.progress.take().map(|closure| {
            let panics = Arc::clone(&self.inner.panics);
            Monitor { closure, panics }
        });
        let result = {
            let _registered = monitor.as_ref().map(|monitor| Registered::new(raw, monitor));
            build(raw, &self.inner.device)
        };
        if let Some(payload) = self.inner.panics.take() {
            drop(self);
            resume_unwind(payload);
        }
        result?;
        Ok(Scene::new(self.inner))
    }

    fn create(&self, geometry: impl Geometry) -> Result<RawGeometry, Error> {
        let context = CreateContext { device: &self.inner.device, panics: &self.inner.panics };
        Sealed::create(geometry, &context)
    }

    fn edit(&mut self, id: GeometryId, change: impl FnOnce(sys::RTCGeometry)) -> Result<(), Error> {
        let raw = self.inner.geometry(id)?.raw();
        self.inner.device.clear_error();
        change(raw);
        // SAFETY: the geometry is valid and not shared.
        unsafe { sys::rtcCommitGeometry(raw) };
        self.inner.device.check()
    }
}

impl std::fmt::Debug for SceneBuilder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SceneBuilder")
            .field("geometries", &self.inner.geometries.len())
            .finish_non_exhaustive()
    }
}

/// Lets threads help with a commit; see [`SceneBuilder::commit_with`].
pub struct Joiner<'a> {
    raw: sys::RTCScene,
    device: &'a Device,
    error: Mutex<Option<Error>>,
}

// SAFETY: the only use of the scene is to join its commit, which Embree allows from many threads.
unsafe impl Sync for Joiner<'_> {}

impl Joiner<'_> {
    /// Helps until the scene is built. Errors appear at the end of the commit.
    pub fn join(&self) {
        self.device.clear_error();
        // SAFETY: the scene is being committed and outlives the joiner.
        unsafe { sys::rtcJoinCommitScene(self.raw) };
        if let Err(error) = self.device.check() {
            self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }
}

struct Monitor {
    closure: Progress,
    panics: Arc<PanicStash>,
}

/// A progress callback, known to Embree as long as this lives.
struct Registered<'a> {
    raw: sys::RTCScene,
    _monitor: &'a Monitor,
}

impl<'a> Registered<'a> {
    fn new(raw: sys::RTCScene, monitor: &'a Monitor) -> Self {
        let pointer = (&raw const *monitor).cast_mut().cast::<c_void>();
        // SAFETY: the scene is valid and not shared; `drop` unregisters the pointer before the monitor goes, and
        // the callback only makes shared references of it.
        unsafe { sys::rtcSetSceneProgressMonitorFunction(raw, Some(on_progress), pointer) };
        Self { raw, _monitor: monitor }
    }
}

impl Drop for Registered<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene is valid: the builder owns it and lives longer.
        unsafe { sys::rtcSetSceneProgressMonitorFunction(self.raw, None, std::ptr::null_mut()) }
    }
}

unsafe extern "C" fn on_progress(monitor: *mut c_void, done: f64) -> bool {
    // SAFETY: the pointer is the one registered, alive during the commit.
    let monitor = unsafe { &*monitor.cast_const().cast::<Monitor>() };
    monitor.panics.guard_in_build(false, || (monitor.closure)(done))
}
