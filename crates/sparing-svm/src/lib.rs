//! Support vector machines, evaluated millions of times: libSVM model files, training, and the machinery that
//! makes a decision cheap.
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`card`] | [`Card`]: what a model's numbers mean, in a file beside it |
//! | [`data`] | [`Data`]: labelled rows, and libSVM's data files |
//! | [`error`] | the one error, with file and line |
//! | [`evaluator`] | [`Evaluator`]: a machine compiled for speed, with proven error bounds and exact signs |
//! | [`model`] | [`Model`]: a trained machine in f64, and its decision values, the definition of all others |
//! | [`prune`] | fewer vectors: exact simplification, reduced machines, and a cascade whose signs are certified |
//! | [`range`] | [`Scaling`]: features brought to one range, as `svm-scale` does |
//! | [`tradeoff`] | what each way to prune costs and keeps, measured |
//! | [`train`] | [`Parameters`]: training, cross-validation, the search for C and gamma |

mod atomic;
pub mod card;
pub mod data;
pub mod error;
pub mod evaluator;
pub mod model;
pub mod prune;
mod random;
pub mod range;
mod text;
pub mod tradeoff;
pub mod train;

pub use card::Card;
pub use data::Data;
pub use error::{Result, SvmError};
pub use evaluator::Evaluator;
pub use model::{Kernel, Model, SvmType};
pub use range::Scaling;
pub use train::Parameters;
