//! Gives callbacks of a build the floating-point state that Rust code relies on.
//!
//! While Embree builds, it flushes denormal numbers to zero (flags of MXCSR). Rust assumes that these flags are never
//! set, so closures must not run like that. Queries leave the state alone, and so does everything else in this crate.

/// Runs `callback`, which must not unwind, with the default floating-point state.
#[cfg(target_arch = "x86_64")]
pub(crate) fn with_default_floats<F: FnOnce() -> R, R>(callback: F) -> R {
    use std::ffi::c_void;

    struct Call<F, R> {
        callback: Option<F>,
        result: Option<R>,
    }

    unsafe extern "sysv64" fn run<F: FnOnce() -> R, R>(call: *mut c_void) {
        // SAFETY: the pointer is to the call below, which nothing else uses meanwhile.
        let call = unsafe { &mut *call.cast::<Call<F, R>>() };
        call.result = call.callback.take().map(|callback| callback());
    }

    const DEFAULT: u32 = 0x1F80; // all exceptions masked, round to nearest, denormals kept
    let mut call = Call { callback: Some(callback), result: None };
    let (default, mut saved) = (DEFAULT, 0_u32);
    // SAFETY: the state is the same after the block as before it. The called function has the ABI whose registers
    // are declared as clobbered and does not unwind; the three registers that must survive it are preserved by that
    // ABI. The stack is aligned for a call, since `nostack` is absent.
    unsafe {
        std::arch::asm!(
            "stmxcsr dword ptr [r12]",
            "ldmxcsr dword ptr [r13]",
            "call r14",
            "ldmxcsr dword ptr [r12]",
            in("r12") &raw mut saved,
            in("r13") &raw const default,
            in("r14") run::<F, R>,
            inout("rdi") &raw mut call => _,
            clobber_abi("sysv64"),
        );
    }
    call.result.expect("the block above calls the function")
}

/// Runs `callback`.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn with_default_floats<F: FnOnce() -> R, R>(callback: F) -> R {
    callback()
}

#[cfg(test)]
mod tests {
    use super::with_default_floats;

    #[test]
    fn runs_once_and_returns_what_the_callback_returns() {
        let mut runs = 0;
        let text = with_default_floats(|| {
            runs += 1;
            format!("{}", std::hint::black_box(1e-38_f32) * std::hint::black_box(0.5))
        });
        assert_eq!((runs, text.parse::<f32>()), (1, Ok(0.5e-38)));
    }
}
