//! The installed libSVM as a reference: for tests and benches only.
//!
//! The library is loaded at run time (`libsvm.so.3` of Debian's package `libsvm3`), so nothing needs its
//! headers, and what does not ask for an [`Oracle`] builds and runs without it.

mod library;

use std::ffi::{CString, c_int};
use std::path::Path;
use std::ptr::NonNull;
use std::sync::{Mutex, PoisonError};

use library::{Library, Node, RawModel};
use sparing_svm::{Model, SvmError, SvmType};

/// Why there is no oracle.
#[derive(Debug, thiserror::Error)]
pub enum OracleError {
    /// libSVM is not installed, or is not what it should be.
    #[error("libSVM cannot be loaded; on Debian and Ubuntu it is the package libsvm3: {0}")]
    Library(String),
    /// The model file is not valid: libSVM's own reader does not check, and must not see it.
    #[error(transparent)]
    Model(#[from] SvmError),
    /// libSVM refuses the model file.
    #[error("libSVM cannot read {0}")]
    Refused(String),
}

/// Whether libSVM is installed.
#[must_use]
pub fn is_available() -> bool {
    Library::get().is_ok()
}

/// libSVM's version, 324 for 3.24.
///
/// # Errors
/// libSVM is not installed.
pub fn version() -> Result<i32, OracleError> {
    Ok(Library::get()?.version())
}

/// A query as libSVM wants it: sparse, zeros left out. Prepare it once, and timing measures only libSVM.
#[derive(Debug)]
pub struct Query(Vec<Node>);

impl Query {
    /// Features in order; a value that is zero is left out, as libSVM's file readers do.
    ///
    /// # Panics
    /// With more than `i32::MAX` features.
    #[must_use]
    pub fn new(features: &[f64]) -> Self {
        let index = |j: usize| i32::try_from(j + 1).expect("fewer than 2^31 features");
        let present = features.iter().enumerate().filter(|(_, value)| **value != 0.0);
        let nodes = present.map(|(j, &value)| Node { index: index(j), value });
        Self(nodes.chain([Node { index: -1, value: 0.0 }]).collect())
    }
}

/// A model in libSVM's memory.
#[derive(Debug)]
pub struct Oracle {
    library: &'static Library,
    model: NonNull<RawModel>,
    labels: Vec<i32>,
    machines: usize,
}

// SAFETY: the model is owned, and libSVM keeps nothing about it per thread.
unsafe impl Send for Oracle {}
// SAFETY: the functions called through `&self` take the model as const; they allocate what they need
// themselves and have no static state.
unsafe impl Sync for Oracle {}

impl Oracle {
    /// Loads a model file. It is read by [`Model::read`] first, because libSVM's reader trusts what it reads.
    ///
    /// # Errors
    /// libSVM is not installed, or the file is not a valid model, or libSVM does not know something in it.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, OracleError> {
        let path = path.as_ref();
        let library = Library::get()?;
        let checked = Model::read(path)?;
        let refused = || OracleError::Refused(path.display().to_string());
        let name = CString::new(path.as_os_str().as_encoded_bytes()).map_err(|_| refused())?;
        // libSVM's reader uses static buffers and changes the locale for a moment.
        static READER: Mutex<()> = Mutex::new(());
        let guard = READER.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: `name` is a terminated string, the file was found to be a valid model, and no other call to
        // the reader runs.
        let raw = unsafe { (library.load_model)(name.as_ptr()) };
        drop(guard);
        let model = NonNull::new(raw).ok_or_else(refused)?;
        let mut oracle = Self { library, model, labels: Vec::new(), machines: checked.machines() };
        // SAFETY: the model is valid.
        let classes = unsafe { (library.nr_class)(model.as_ptr()) };
        let expected = if checked.svm_type.is_classifier() { checked.labels.len() } else { 2 };
        if usize::try_from(classes) != Ok(expected) {
            return Err(refused());
        }
        if matches!(checked.svm_type, SvmType::CSvc | SvmType::NuSvc) {
            oracle.labels = vec![0; expected];
            // SAFETY: the model is a classifier of `expected` classes, and there is room for as many labels.
            unsafe { (library.labels)(model.as_ptr(), oracle.labels.as_mut_ptr()) };
        }
        Ok(oracle)
    }

    /// The classes' labels in libSVM's order; empty for one-class and regression models.
    #[must_use]
    pub fn labels(&self) -> &[i32] {
        &self.labels
    }

    /// Decision values of a query: one for each pair of classes.
    #[must_use]
    pub fn machines(&self) -> usize {
        self.machines
    }

    /// libSVM's decision values of one query.
    #[must_use]
    pub fn decision_values(&self, features: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.machines];
        self.evaluate(&Query::new(features), &mut values);
        values
    }

    /// `svm_predict_values` and nothing else: fills `values` and returns the prediction.
    ///
    /// # Panics
    /// When `values` is not `machines()` long.
    pub fn evaluate(&self, query: &Query, values: &mut [f64]) -> f64 {
        assert_eq!(values.len(), self.machines, "the number of decision values");
        // SAFETY: the model is valid, a query ends with index -1, and there is room for all decision values.
        unsafe { (self.library.predict_values)(self.model.as_ptr(), query.0.as_ptr(), values.as_mut_ptr()) }
    }

    /// libSVM's prediction: a label, +1 or -1, or a value.
    #[must_use]
    pub fn predict(&self, features: &[f64]) -> f64 {
        // SAFETY: the model is valid and a query ends with index -1.
        unsafe { (self.library.predict)(self.model.as_ptr(), Query::new(features).0.as_ptr()) }
    }

    /// Support vectors, as libSVM counts them.
    #[must_use]
    pub fn support_vectors(&self) -> usize {
        // SAFETY: the model is valid.
        let count: c_int = unsafe { (self.library.nr_sv)(self.model.as_ptr()) };
        usize::try_from(count).unwrap_or(0)
    }
}

impl Drop for Oracle {
    fn drop(&mut self) {
        let mut model = self.model.as_ptr();
        // SAFETY: the model came from `svm_load_model`, is freed once, and nothing refers to it any more.
        unsafe { (self.library.free_model)(&raw mut model) };
    }
}
