//! The device: options, memory accounting and error reports of one Embree instance.

use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::Arc;
use std::{cell::RefCell, ptr};

use embree4_sys as sys;

use crate::config::DeviceBuilder;
use crate::layout;
use crate::memory::MemoryMonitor;
use crate::{Error, PanicPayload};

/// An Embree device. Scenes are made on one. Clones share it; it lives as long as its last clone or scene.
///
/// ```
/// let device = embree4::Device::new()?;
/// let (major, minor, _) = device.version();
/// assert!(major == 4 && minor >= 3);
/// # Ok::<(), embree4::Error>(())
/// ```
#[derive(Clone)]
pub struct Device {
    inner: Arc<DeviceInner>,
}

struct DeviceInner {
    raw: sys::RTCDevice,
    version: (u32, u32, u32),
    /// Embree calls into this until the device is gone, which is after `drop` below.
    monitor: Arc<MemoryMonitor>,
}

// SAFETY: Embree's devices are counted atomically and their functions may be called from any thread; the monitor
// is Send and Sync by itself.
unsafe impl Send for DeviceInner {}
// SAFETY: as above; nothing in here is changed through a shared reference.
unsafe impl Sync for DeviceInner {}

impl Drop for DeviceInner {
    fn drop(&mut self) {
        // SAFETY: the handle is valid and this reference is released once. Scenes and geometries hold a `Device`
        // that they drop after their own handles, so this is the last reference and destroys the device.
        unsafe { sys::rtcReleaseDevice(self.raw) }
    }
}

impl Device {
    /// A device with Embree's own defaults: all threads, the best instruction set of the processor.
    ///
    /// # Errors
    /// As [`DeviceBuilder::build`].
    pub fn new() -> Result<Self, Error> {
        Self::builder().build()
    }

    /// Options for a device.
    pub fn builder() -> DeviceBuilder {
        DeviceBuilder::default()
    }

    pub(crate) fn create(config: &CString, monitor: MemoryMonitor) -> Result<Self, Error> {
        // SAFETY: the string ends with NUL and outlives the call.
        let raw = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if raw.is_null() {
            // SAFETY: a null device asks for the error of this thread's last device creation.
            let code = unsafe { sys::rtcGetDeviceError(ptr::null_mut()) };
            return Err(Error::embree(code, "no device could be created"));
        }
        let monitor = Arc::new(monitor);
        let mut inner = DeviceInner { raw, version: (0, 0, 0), monitor };
        inner.version = version(raw);
        if inner.version.0 != 4 || inner.version.1 < 3 {
            return Err(Error::UnsupportedVersion { found: inner.version });
        }
        // SAFETY: the callback matches the type, ignores its pointer and never unwinds.
        unsafe { sys::rtcSetDeviceErrorFunction(raw, Some(on_error), ptr::null_mut()) };
        layout::check(raw)?;
        inner.monitor.install(raw);
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Version of the loaded library: major, minor, patch.
    #[must_use]
    pub fn version(&self) -> (u32, u32, u32) {
        self.inner.version
    }

    /// The widest packet (1, 4, 8 or 16 rays) that this device traces natively rather than split up.
    #[must_use]
    pub fn native_packet_width(&self) -> usize {
        use sys::RTCDeviceProperty as P;
        [
            (P::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED, 16),
            (P::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED, 8),
            (P::RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED, 4),
        ]
        .into_iter()
        // SAFETY: the handle is valid; reading a property has no precondition.
        .find(|(property, _)| unsafe { sys::rtcGetDeviceProperty(self.raw(), *property) } != 0)
        .map_or(1, |(_, width)| width)
    }

    /// The family of vector instructions in use, for messages.
    #[must_use]
    pub fn isa_description(&self) -> &'static str {
        match self.native_packet_width() {
            16 => "AVX-512",
            8 => "AVX or AVX2",
            4 => "SSE2, SSE4.2 or NEON",
            _ => "scalar",
        }
    }

    /// Bytes that Embree holds now for its own data (not the shared buffers).
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.inner.monitor.current()
    }

    /// The most bytes that Embree has held for its own data so far.
    #[must_use]
    pub fn peak_memory_bytes(&self) -> u64 {
        self.inner.monitor.peak()
    }

    /// The first panic of the memory monitor since the last call, if it panicked.
    #[must_use]
    pub fn take_panic(&self) -> Option<PanicPayload> {
        self.inner.monitor.panics.take()
    }

    pub(crate) fn raw(&self) -> sys::RTCDevice {
        self.inner.raw
    }

    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.inner, &other.inner)
    }

    /// Forgets errors that nobody asked for, before a group of calls that ends with `check`.
    pub(crate) fn clear_error(&self) {
        let _ = self.check();
    }

    /// The error that calls on this thread have caused since the last check.
    pub(crate) fn check(&self) -> Result<(), Error> {
        check(self.raw())
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (major, minor, patch) = self.version();
        write!(f, "Device(Embree {major}.{minor}.{patch}, {})", self.isa_description())
    }
}

fn version(raw: sys::RTCDevice) -> (u32, u32, u32) {
    use sys::RTCDeviceProperty as P;
    // SAFETY: the handle is valid; reading a property has no precondition.
    let part = |property| unsafe { sys::rtcGetDeviceProperty(raw, property) };
    let part = |property| u32::try_from(part(property)).unwrap_or(0);
    (
        part(P::RTC_DEVICE_PROPERTY_VERSION_MAJOR),
        part(P::RTC_DEVICE_PROPERTY_VERSION_MINOR),
        part(P::RTC_DEVICE_PROPERTY_VERSION_PATCH),
    )
}

pub(crate) fn check(raw: sys::RTCDevice) -> Result<(), Error> {
    // SAFETY: the handle is valid; the error state is per thread.
    let code = unsafe { sys::rtcGetDeviceError(raw) };
    let message = MESSAGE.with_borrow_mut(Option::take);
    if code == sys::RTCError::RTC_ERROR_NONE {
        Ok(())
    } else {
        Err(Error::embree(code, message.unwrap_or_default()))
    }
}

thread_local! {
    /// The text of the last error on this thread: Embree reports errors on the thread that made the call.
    static MESSAGE: RefCell<Option<String>> = const { RefCell::new(None) };
}

unsafe extern "C" fn on_error(_: *mut c_void, _: sys::RTCError, text: *const c_char) {
    // Nothing may unwind from here; a failed allocation of the text would only lose the text.
    let _ = std::panic::catch_unwind(|| {
        if text.is_null() {
            return;
        }
        // SAFETY: Embree hands over a NUL-terminated string that lives during the call.
        let text = unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned();
        let _ = MESSAGE.try_with(|message| {
            if let Ok(mut message) = message.try_borrow_mut() {
                *message = Some(text);
            }
        });
    });
}
