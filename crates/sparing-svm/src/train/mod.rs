//! Training with libSVM's algorithm, cross-validation, and the search for C and gamma. The crate `libsvm-rs` does the
//! work: the C-SVC models that were compared are bit for bit those of `svm-train` (`docs/svm.md`).
//!
//! ```
//! use sparing_svm::{Data, Parameters};
//! let data = Data::new(1, vec![-2.0, -1.0, 1.0, 2.0], vec![-1.0, -1.0, 1.0, 1.0])?;
//! let model = Parameters::rbf(1.0, 0.5).train(&data)?;
//! assert_eq!(model.prediction(&[model.decision_value(&[1.5])]), 1.0);
//! # Ok::<(), sparing_svm::SvmError>(())
//! ```

mod check;
mod control;
mod cross_validation;
mod folds;
mod grid;
mod resample;
mod scores;

pub use control::{Control, Progress};
pub use cross_validation::{CrossValidation, cross_validate};
pub use folds::Folds;
pub use grid::{Grid, GridPoint, GridSearch, grid_search};
pub use scores::Scores;

use libsvm_rs::{KernelType, SvmNode, SvmParameter, SvmProblem};

use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::model::{Kernel, Model, SvmType};

/// What to do about a feature that has one value in all rows: it cannot help, and is most often a mistake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ConstantFeatures {
    /// An error that names the feature.
    #[default]
    Refuse,
    /// Train with it.
    Allow,
}

/// What to train. Probabilities are not trained: a decision needs none.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// What the machine is for.
    pub svm_type: SvmType,
    /// The kernel; its gamma must be positive.
    pub kernel: Kernel,
    /// Penalty of an error, C: positive, at most 1e12. For C-SVC and both regressions.
    pub c: f64,
    /// Share of errors and support vectors, in (0, 1]. For nu-SVC, one-class and nu-SVR.
    pub nu: f64,
    /// Width of the tube without penalty, in units of the label, 0 or more. For epsilon-SVR.
    pub epsilon: f64,
    /// Factors of C for classes by label, positive; 1 for the others. For C-SVC.
    pub class_weights: Vec<(i32, f64)>,
    /// Constant features.
    pub constant_features: ConstantFeatures,
    /// Violation of the optimality conditions at which training ends, in (0, 1). libSVM's default is 0.001.
    pub tolerance: f64,
    /// Memory of the kernel cache of one fit, in MiB. The models do not depend on it. At most 1e6.
    pub cache_mib: f64,
    /// libSVM's shrinking heuristic. Its default is on.
    pub shrinking: bool,
}

impl Parameters {
    /// libSVM's defaults: C = 1, nu = 0.5, epsilon = 0.1, no class weights.
    #[must_use]
    pub fn new(svm_type: SvmType, kernel: Kernel) -> Self {
        Self {
            svm_type,
            kernel,
            c: 1.0,
            nu: 0.5,
            epsilon: 0.1,
            class_weights: Vec::new(),
            constant_features: ConstantFeatures::default(),
            tolerance: 1e-3,
            cache_mib: 200.0,
            shrinking: true,
        }
    }

    /// Classification with the penalty C and the RBF kernel.
    #[must_use]
    pub fn rbf(c: f64, gamma: f64) -> Self {
        Self { c, ..Self::new(SvmType::CSvc, Kernel::Rbf { gamma }) }
    }

    /// Trains. The result depends on the data, their order and the parameters only.
    ///
    /// # Errors
    /// Parameters out of range; data with no rows, values that are not finite (which row and feature),
    /// constant features (which), one class only (which), labels that are no whole numbers (which row),
    /// instance weights, which libSVM does not know (see [`Data::resampled`]); an infeasible nu (for which
    /// classes); features so large that kernel values are not finite.
    pub fn train(&self, data: &Data) -> Result<Model> {
        self.check(data)?;
        self.fit(data)
    }

    /// Trains on data that were checked.
    fn fit(&self, data: &Data) -> Result<Model> {
        // The library prints to stderr otherwise. Nobody sets it back, so the order of calls does not matter.
        libsvm_rs::set_quiet(true);
        let trained = libsvm_rs::train::svm_train(&problem(data), &self.to_libsvm());
        let mut support_vectors = vec![0.0; trained.sv.len() * data.features];
        for (i, vector) in trained.sv.iter().enumerate() {
            for node in vector {
                // Indices are those of `problem`, from 1.
                support_vectors[i * data.features + node.index as usize - 1] = node.value;
            }
        }
        let model = Model {
            svm_type: self.svm_type,
            kernel: self.kernel,
            labels: trained.label,
            class_counts: trained.n_sv,
            rho: trained.rho,
            prob_a: Vec::new(),
            prob_b: Vec::new(),
            prob_density_marks: Vec::new(),
            features: data.features,
            support_vectors,
            coefficients: trained.sv_coef,
        };
        model.validate().map_err(|error| {
            SvmError::Data(format!(
                "training gave numbers that are not finite; scale the features first ({error})"
            ))
        })?;
        Ok(model)
    }

    fn to_libsvm(&self) -> SvmParameter {
        let (kernel_type, degree, gamma, coef0) = match self.kernel {
            Kernel::Linear => (KernelType::Linear, 0, 1.0, 0.0),
            Kernel::Polynomial { degree, gamma, coef0 } => (KernelType::Polynomial, degree, gamma, coef0),
            Kernel::Rbf { gamma } => (KernelType::Rbf, 0, gamma, 0.0),
            Kernel::Sigmoid { gamma, coef0 } => (KernelType::Sigmoid, 0, gamma, coef0),
        };
        SvmParameter {
            svm_type: match self.svm_type {
                SvmType::CSvc => libsvm_rs::SvmType::CSvc,
                SvmType::NuSvc => libsvm_rs::SvmType::NuSvc,
                SvmType::OneClass => libsvm_rs::SvmType::OneClass,
                SvmType::EpsilonSvr => libsvm_rs::SvmType::EpsilonSvr,
                SvmType::NuSvr => libsvm_rs::SvmType::NuSvr,
            },
            kernel_type,
            // `check` holds it below 2^31.
            degree: degree as i32,
            gamma,
            coef0,
            cache_size: self.cache_mib,
            eps: self.tolerance,
            c: self.c,
            weight: self.class_weights.clone(),
            nu: self.nu,
            p: self.epsilon,
            shrinking: self.shrinking,
            probability: false,
        }
    }
}

fn problem(data: &Data) -> SvmProblem {
    let nodes = |i: usize| {
        let present = data.row(i).iter().enumerate().filter(|(_, value)| **value != 0.0);
        // `check` holds the number of features below 2^31.
        present.map(|(j, &value)| SvmNode { index: (j + 1) as i32, value }).collect()
    };
    SvmProblem { labels: data.labels.clone(), instances: (0..data.len()).map(nodes).collect() }
}
