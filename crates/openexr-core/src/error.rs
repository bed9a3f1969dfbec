//! The error type, and the library's messages.

use std::cell::RefCell;
use std::ffi::{CStr, c_char};
use std::panic::catch_unwind;

use openexr_core_sys as sys;

/// Why an image could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The C library reported an error.
    #[error("{message} ({code})")]
    Library {
        /// Name of the code, for example `EXR_ERR_FILE_BAD_HEADER`.
        code: String,
        /// What the library said about it.
        message: String,
    },
    /// The stream could not be read or written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// A valid file that uses something this crate does not read.
    #[error("not supported: {0}")]
    Unsupported(String),
    /// Larger than the limits allow, or than a file of its length can be.
    #[error("too large: {0}")]
    TooLarge(String),
    /// The file contradicts itself.
    #[error("damaged: {0}")]
    Damaged(String),
    /// The image handed to the writer cannot be written.
    #[error("cannot be written as OpenEXR: {0}")]
    Invalid(String),
}

thread_local! {
    // The library promises to call the handler on the thread that caused the error.
    static LAST_MESSAGE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps the first message since the last [`check`]: later ones are consequences.
pub(crate) unsafe extern "C" fn keep_message(
    _context: sys::exr_const_context_t,
    _code: sys::exr_result_t,
    message: *const c_char,
) {
    if message.is_null() {
        return;
    }
    let _ = catch_unwind(|| {
        // SAFETY: not null, and the library passes a C string that lives during the call.
        let text = unsafe { CStr::from_ptr(message) }.to_string_lossy();
        // The library puts the file's name and a colon in front; callers name the file themselves.
        let text =
            text.strip_prefix(crate::context::STREAM_NAME).unwrap_or(&text).trim_start_matches([':', ' ']);
        LAST_MESSAGE.with_borrow_mut(|last| last.get_or_insert_with(|| text.to_owned()).truncate(1000));
    });
}

/// Turns a result code of the library into an error with the message that came with it.
pub(crate) fn check(code: sys::exr_result_t) -> Result<(), Error> {
    let message = LAST_MESSAGE.take();
    if code == sys::exr_error_code_t::EXR_ERR_SUCCESS.0 as sys::exr_result_t {
        return Ok(());
    }
    // SAFETY: both functions accept any code and return static C strings.
    let (name, text) = unsafe {
        (
            CStr::from_ptr(sys::exr_get_error_code_as_string(code)),
            CStr::from_ptr(sys::exr_get_default_error_message(code)),
        )
    };
    Err(Error::Library {
        code: name.to_string_lossy().into_owned(),
        message: message.unwrap_or_else(|| text.to_string_lossy().into_owned()),
    })
}
