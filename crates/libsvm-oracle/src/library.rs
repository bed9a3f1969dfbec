//! The shared library and its functions, as `svm.h` of libSVM 3.24 declares them.

use std::ffi::{c_char, c_int};
use std::sync::OnceLock;

use crate::OracleError;

/// `struct svm_node`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) index: c_int,
    pub(crate) value: f64,
}

/// `struct svm_model`, never looked into.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct RawModel {
    _private: [u8; 0],
}

/// The functions. The library is never unloaded, so they stay valid.
#[derive(Debug)]
pub(crate) struct Library {
    pub(crate) load_model: unsafe extern "C" fn(*const c_char) -> *mut RawModel,
    pub(crate) free_model: unsafe extern "C" fn(*mut *mut RawModel),
    pub(crate) nr_class: unsafe extern "C" fn(*const RawModel) -> c_int,
    pub(crate) nr_sv: unsafe extern "C" fn(*const RawModel) -> c_int,
    pub(crate) labels: unsafe extern "C" fn(*const RawModel, *mut c_int),
    pub(crate) predict_values: unsafe extern "C" fn(*const RawModel, *const Node, *mut f64) -> f64,
    pub(crate) predict: unsafe extern "C" fn(*const RawModel, *const Node) -> f64,
    version: c_int,
    /// Keeps the functions where they are.
    _library: libloading::Library,
}

/// Debian's name first; 4 is what libSVM's own Makefile has called it since 3.31.
const NAMES: [&str; 2] = ["libsvm.so.3", "libsvm.so.4"];

impl Library {
    /// The one library of this process.
    pub(crate) fn get() -> Result<&'static Self, OracleError> {
        static LIBRARY: OnceLock<Result<Library, String>> = OnceLock::new();
        LIBRARY.get_or_init(Self::open).as_ref().map_err(|message| OracleError::Library(message.clone()))
    }

    pub(crate) fn version(&self) -> i32 {
        self.version
    }

    fn open() -> Result<Self, String> {
        let mut messages = Vec::new();
        for name in NAMES {
            // SAFETY: libSVM's initialisers only set a version number and a print function.
            match unsafe { libloading::Library::new(name) } {
                Ok(library) => return Self::resolve(library).map_err(|e| e.to_string()),
                Err(e) => messages.push(e.to_string()),
            }
        }
        Err(messages.join("; "))
    }

    fn resolve(library: libloading::Library) -> Result<Self, libloading::Error> {
        // SAFETY: the types are those of svm.h, unchanged since libSVM 2.8 for these functions;
        // `libsvm_version` is an int that never changes.
        unsafe {
            Ok(Self {
                load_model: *library.get(b"svm_load_model\0")?,
                free_model: *library.get(b"svm_free_and_destroy_model\0")?,
                nr_class: *library.get(b"svm_get_nr_class\0")?,
                nr_sv: *library.get(b"svm_get_nr_sv\0")?,
                labels: *library.get(b"svm_get_labels\0")?,
                predict_values: *library.get(b"svm_predict_values\0")?,
                predict: *library.get(b"svm_predict\0")?,
                version: **library.get::<*const c_int>(b"libsvm_version\0")?,
                _library: library,
            })
        }
    }
}
