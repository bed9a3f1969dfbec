//! Support vector machines, evaluated millions of times: libSVM model files, training, and the machinery that
//! makes a decision cheap.
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`model`] | [`Model`]: a trained machine in f64, and its decision values, the definition of all others |
//! | [`prune`] | fewer vectors: exact simplification, reduced machines, and a cascade whose signs are certified |

pub mod model;
pub mod prune;

pub use model::{Kernel, Model, SvmType};
