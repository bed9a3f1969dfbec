//! An owned geometry handle together with everything that Embree reads through it.

use std::any::Any;
use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::Arc;

use embree4_sys as sys;

use super::{check_count, options::Options};
use crate::buffer::{Element, SharedBuffer};
use crate::filter::{Callbacks, on_intersect_filter, on_occluded_filter};
use crate::panics::PanicStash;
use crate::{Device, Error, FeatureMask, Scene};

/// What a geometry needs to know of the scene that takes it in.
pub(crate) struct CreateContext<'a> {
    pub(crate) device: &'a Device,
    pub(crate) panics: &'a Arc<PanicStash>,
}

/// A buffer of a geometry: its type and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Slot(pub(crate) u32, pub(crate) u32);

impl Slot {
    pub(crate) const INDEX: Self = Self(sys::RTCBufferType::RTC_BUFFER_TYPE_INDEX.0, 0);
    pub(crate) const fn vertex(step: u32) -> Self {
        Self(sys::RTCBufferType::RTC_BUFFER_TYPE_VERTEX.0, step)
    }
    pub(crate) const fn attribute(slot: u32) -> Self {
        Self(sys::RTCBufferType::RTC_BUFFER_TYPE_VERTEX_ATTRIBUTE.0, slot)
    }
}

/// Kinds of geometry without coordinates to interpolate at.
const NOT_SURFACES: FeatureMask = FeatureMask::POINT
    .union(FeatureMask::USER_GEOMETRY)
    .union(FeatureMask::INSTANCE)
    .union(FeatureMask::INSTANCE_ARRAY);

/// A buffer in use: what it is made of, and its owner.
pub(crate) struct Bound {
    pub(crate) format: sys::RTCFormat,
    pub(crate) len: usize,
    /// Number of f32 per element; 0 for other types.
    pub(crate) floats: usize,
    _owner: Box<dyn Any + Send + Sync>,
}

pub(crate) struct RawGeometry {
    handle: Handle,
    // What follows is read by Embree through the handle, or by callbacks, as long as the scene lives. Scenes
    // release their own handle before they drop this.
    pub(crate) buffers: BTreeMap<Slot, Bound>,
    pub(crate) scenes: Vec<Scene>,
    callbacks: Option<Arc<Callbacks>>,
    pub(crate) kind: sys::RTCGeometryType,
    pub(crate) primitives: u32,
    pub(crate) steps: u32,
    /// Whether values on the surface can be interpolated.
    pub(crate) interpolates: bool,
    pub(crate) features: FeatureMask,
}

struct Handle {
    raw: sys::RTCGeometry,
    device: Device,
}

// SAFETY: geometries are counted atomically, and functions that change one are only called through `&mut` or
// before it is shared.
unsafe impl Send for Handle {}
// SAFETY: through `&` only functions that read are called, which Embree allows from many threads.
unsafe impl Sync for Handle {}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: this reference was ours and is released once.
        unsafe { sys::rtcReleaseGeometry(self.raw) }
    }
}

impl RawGeometry {
    pub(crate) fn new(
        context: &CreateContext<'_>,
        kind: sys::RTCGeometryType,
        features: FeatureMask,
        primitives: usize,
    ) -> Result<Self, Error> {
        let primitives = check_count("primitives", primitives, u32::MAX as usize - 1)?;
        context.device.clear_error();
        // SAFETY: the device is valid; a null result is handled.
        let raw = unsafe { sys::rtcNewGeometry(context.device.raw(), kind) };
        if raw.is_null() {
            context.device.check()?;
            return Err(Error::Unsupported("this kind of geometry is not in the loaded library"));
        }
        Ok(Self {
            handle: Handle { raw, device: context.device.clone() },
            buffers: BTreeMap::new(),
            scenes: Vec::new(),
            callbacks: None,
            kind,
            primitives,
            steps: 1,
            interpolates: !features.intersects(NOT_SURFACES),
            features,
        })
    }

    pub(crate) fn raw(&self) -> sys::RTCGeometry {
        self.handle.raw
    }

    /// Shares a buffer with Embree and keeps it alive; a buffer that was in the slot is dropped.
    pub(crate) fn set_buffer<T: Element>(&mut self, slot: Slot, buffer: SharedBuffer<T>) {
        // SAFETY: the geometry is valid and not shared (`&mut`). The buffer holds `len` elements of the format,
        // padded to 16 bytes, does not change, and stays alive in `self.buffers`.
        unsafe {
            sys::rtcSetSharedGeometryBuffer(
                self.raw(),
                sys::RTCBufferType(slot.0),
                slot.1,
                T::FORMAT,
                buffer.address(),
                0,
                size_of::<T>(),
                buffer.len(),
            );
        }
        let first_float = sys::RTCFormat::RTC_FORMAT_FLOAT.0;
        let floats = (first_float..first_float + 16).position(|f| f == T::FORMAT.0).map_or(0, |i| i + 1);
        let bound = Bound { format: T::FORMAT, len: buffer.len(), floats, _owner: Box::new(buffer) };
        self.buffers.insert(slot, bound);
    }

    pub(crate) fn set_steps(&mut self, count: usize) -> Result<(), Error> {
        self.steps = check_count("time steps", count, sys::RTC_MAX_TIME_STEP_COUNT as usize)?;
        if self.steps > 1 {
            // SAFETY: the geometry is valid and not shared.
            unsafe { sys::rtcSetGeometryTimeStepCount(self.raw(), self.steps) };
            self.features |= FeatureMask::MOTION_BLUR;
        }
        Ok(())
    }

    pub(crate) fn set_transform(&mut self, step: u32, transform: &[f32; 12]) {
        let format = sys::RTCFormat::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
        // SAFETY: the geometry is a valid instance and not shared; Embree copies the twelve numbers.
        unsafe { sys::rtcSetGeometryTransform(self.raw(), step, format, transform.as_ptr().cast()) }
    }

    pub(crate) fn set_subdivision(&mut self, boundary: sys::RTCSubdivisionMode, rate: Option<f32>) {
        // SAFETY: the geometry is a valid subdivision mesh and not shared; topology 0 always exists.
        unsafe {
            sys::rtcSetGeometrySubdivisionMode(self.raw(), 0, boundary);
            if let Some(rate) = rate {
                sys::rtcSetGeometryTessellationRate(self.raw(), rate.clamp(1.0, 4096.0));
            }
        }
    }

    pub(crate) fn set_attribute_count(&mut self, count: u32) {
        // SAFETY: the geometry is valid and not shared; the count is small.
        unsafe { sys::rtcSetGeometryVertexAttributeCount(self.raw(), count) }
    }

    pub(crate) fn set_options(&mut self, options: Options, panics: &Arc<PanicStash>) -> Result<(), Error> {
        options.check()?;
        let raw = self.raw();
        if options.mask > 0xFF {
            self.features |= FeatureMask::WIDE_RAY_MASK;
        }
        // SAFETY: the geometry is valid and not shared; the values were checked.
        unsafe {
            sys::rtcSetGeometryMask(raw, options.mask);
            sys::rtcSetGeometryBuildQuality(raw, options.quality.raw());
            if let Some((start, end)) = options.time_range {
                sys::rtcSetGeometryTimeRange(raw, start, end);
            }
        }
        let (filter, occlusion_filter) = (options.filter, options.occlusion_filter);
        if filter.is_some() || occlusion_filter.is_some() {
            self.set_callbacks(Callbacks {
                filter,
                occlusion_filter,
                primitive: None,
                panics: panics.clone(),
            });
        }
        Ok(())
    }

    /// Gives the geometry its user pointer and filters. User geometries are not filtered by Embree.
    pub(crate) fn set_callbacks(&mut self, callbacks: Callbacks) {
        let callbacks = Arc::new(callbacks);
        let pointer = Arc::as_ptr(&callbacks);
        // SAFETY: the geometry is valid and not shared. The callbacks stay in `self` as long as the geometry can be
        // traced, and the trampolines only make shared references of the pointer.
        unsafe {
            sys::rtcSetGeometryUserData(self.raw(), pointer.cast_mut().cast::<c_void>());
            if callbacks.primitive.is_none() {
                if callbacks.filter.is_some() {
                    sys::rtcSetGeometryIntersectFilterFunction(self.raw(), Some(on_intersect_filter));
                }
                if callbacks.occlusion_filter.is_some() {
                    sys::rtcSetGeometryOccludedFilterFunction(self.raw(), Some(on_occluded_filter));
                }
                self.features |= FeatureMask::FILTER;
            }
        }
        self.callbacks = Some(callbacks);
    }

    /// Ends a group of changes.
    pub(crate) fn commit(self) -> Result<Self, Error> {
        // SAFETY: the geometry is valid and not shared.
        unsafe { sys::rtcCommitGeometry(self.raw()) };
        self.handle.device.check()?;
        Ok(self)
    }
}
