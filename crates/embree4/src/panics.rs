//! Keeps panics of user callbacks from crossing C code.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::float_env::with_default_floats;

/// What a panicking callback threw, as from `std::thread::JoinHandle::join`.
pub type PanicPayload = Box<dyn Any + Send + 'static>;

/// Holds the first panic of a group of callbacks until someone asks for it.
#[derive(Default)]
pub(crate) struct PanicStash {
    any: AtomicBool,
    first: Mutex<Option<PanicPayload>>,
}

impl PanicStash {
    /// Runs a callback; if it panics, keeps the panic and returns the fallback.
    pub(crate) fn guard<R>(&self, fallback: R, callback: impl FnOnce() -> R) -> R {
        match catch_unwind(AssertUnwindSafe(callback)) {
            Ok(value) => value,
            Err(payload) => {
                self.keep(payload);
                fallback
            }
        }
    }

    /// [`guard`](Self::guard) for callbacks of a build. After a panic the build is lost and nothing is called.
    pub(crate) fn guard_in_build<R>(&self, fallback: R, callback: impl FnOnce() -> R) -> R {
        if self.any.load(Ordering::Acquire) {
            return fallback;
        }
        with_default_floats(|| self.guard(fallback, callback))
    }

    fn keep(&self, payload: PanicPayload) {
        let mut first = self.first.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if first.is_none() {
            *first = Some(payload);
            self.any.store(true, Ordering::Release);
        } else {
            drop(first);
            // Dropping a payload may run user code that panics again.
            if let Err(again) = catch_unwind(AssertUnwindSafe(|| drop(payload))) {
                std::mem::forget(again);
            }
        }
    }

    pub(crate) fn take(&self) -> Option<PanicPayload> {
        if !self.any.load(Ordering::Acquire) {
            return None;
        }
        let mut first = self.first.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        self.any.store(false, Ordering::Release);
        first.take()
    }
}
