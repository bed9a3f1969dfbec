//! Support vector machines, evaluated millions of times: libSVM model files, training, and the machinery that
//! makes a decision cheap.
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`error`] | the one error, with file and line |
//! | [`evaluator`] | [`Evaluator`]: a machine compiled for speed, with proven error bounds and exact signs |
//! | [`model`] | [`Model`]: a trained machine in f64, and its decision values, the definition of all others |

mod atomic;
pub mod error;
pub mod evaluator;
pub mod model;
mod text;

pub use error::{Result, SvmError};
pub use evaluator::Evaluator;
pub use model::{Kernel, Model, SvmType};
