//! Counts Embree's memory and lets a closure veto allocations.

use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use embree4_sys as sys;

use crate::panics::PanicStash;

type Veto = Box<dyn Fn(MemoryEvent) -> bool + Send + Sync>;

/// One allocation or release by Embree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryEvent {
    /// Bytes allocated, or released when negative.
    pub bytes: i64,
    /// Whether it has happened already.
    pub done: bool,
}

#[derive(Default)]
pub(crate) struct MemoryMonitor {
    current: AtomicI64,
    peak: AtomicI64,
    veto: Option<Veto>,
    pub(crate) panics: PanicStash,
}

impl MemoryMonitor {
    pub(crate) fn new(veto: Option<Veto>) -> Self {
        Self { veto, ..Self::default() }
    }

    pub(crate) fn current(&self) -> u64 {
        u64::try_from(self.current.load(Ordering::Relaxed)).unwrap_or(0)
    }

    pub(crate) fn peak(&self) -> u64 {
        u64::try_from(self.peak.load(Ordering::Relaxed)).unwrap_or(0)
    }

    /// Registers with the device, which must not outlive this count of the monitor.
    pub(crate) fn install(self: &Arc<Self>, device: sys::RTCDevice) {
        let this = Arc::as_ptr(self).cast_mut().cast::<c_void>();
        // SAFETY: `DeviceInner` drops its count after the device. The callback only makes shared references of the
        // pointer, and the type is Sync.
        unsafe { sys::rtcSetDeviceMemoryMonitorFunction(device, Some(on_memory), this) }
    }

    fn on_event(&self, bytes: i64, done: bool) -> bool {
        let now = self.current.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if bytes > 0 {
            self.peak.fetch_max(now, Ordering::Relaxed);
        }
        let Some(veto) = &self.veto else { return true };
        let allowed = self.panics.guard_in_build(false, || veto(MemoryEvent { bytes, done }));
        if !allowed && bytes > 0 && !done {
            // The allocation will not happen, so no release will be reported for it.
            self.current.fetch_sub(bytes, Ordering::Relaxed);
        }
        allowed
    }
}

unsafe extern "C" fn on_memory(monitor: *mut c_void, bytes: isize, post: bool) -> bool {
    if monitor.is_null() {
        return true;
    }
    // SAFETY: the pointer is the one given in `install`, alive until after the device.
    let monitor = unsafe { &*monitor.cast_const().cast::<MemoryMonitor>() };
    monitor.on_event(bytes as i64, post)
}
