//! A trained machine, in f64, as libSVM's model files describe it.

mod decision;
mod header;
mod kernel;
mod read;
pub(crate) mod validate;
mod write;

pub use kernel::Kernel;
pub use read::{ModelLimits, ReadOptions};

/// What the machine was trained for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SvmType {
    /// Classification with the penalty C.
    CSvc,
    /// Classification with the share nu of margin errors.
    NuSvc,
    /// One class: is a point like those of the training set?
    OneClass,
    /// Regression with the tolerance epsilon.
    EpsilonSvr,
    /// Regression with the share nu.
    NuSvr,
}

impl SvmType {
    /// The name that model files use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::CSvc => "c_svc",
            Self::NuSvc => "nu_svc",
            Self::OneClass => "one_class",
            Self::EpsilonSvr => "epsilon_svr",
            Self::NuSvr => "nu_svr",
        }
    }

    /// Whether the machine tells classes apart (one-class and regression machines do not).
    #[must_use]
    pub fn is_classifier(self) -> bool {
        matches!(self, Self::CSvc | Self::NuSvc)
    }
}

/// A trained support vector machine.
///
/// With `k` classes there are `k (k - 1) / 2` machines, one for each pair of classes in the order (0,1), (0,2) ..
/// (1,2) ..; one-class and regression models have one machine and count as `k = 2` here, as in libSVM.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// What it was trained for.
    pub svm_type: SvmType,
    /// The kernel and its parameters.
    pub kernel: Kernel,
    /// The classes' labels, `k` of them in the order of the machines; empty for one-class and regression.
    pub labels: Vec<i32>,
    /// Support vectors of each class, `k` counts; empty for one-class and regression.
    pub class_counts: Vec<usize>,
    /// The threshold of each machine: its decision value is `sum of coefficients times kernel - rho`.
    pub rho: Vec<f64>,
    /// Parameter A of Platt's probabilities of each machine; empty where there are none. Never used for decisions.
    pub prob_a: Vec<f64>,
    /// Parameter B of Platt's probabilities of each machine; empty where there are none.
    pub prob_b: Vec<f64>,
    /// Density marks of one-class probabilities (libSVM 3.3 and later); empty where there are none.
    pub prob_density_marks: Vec<f64>,
    /// Features of a vector.
    pub features: usize,
    /// Support vectors, row by row: `n * features` values, sorted by class.
    pub support_vectors: Vec<f64>,
    /// Coefficients (label times alpha), `n` for each of the `k - 1` rows: row `j` of a vector of class `i` belongs to
    /// the machine of `i` and the `j`-th other class.
    pub coefficients: Vec<Vec<f64>>,
}

impl Model {
    /// Number of support vectors.
    #[must_use]
    pub fn len(&self) -> usize {
        self.coefficients.first().map_or(0, Vec::len)
    }

    /// Whether there is no support vector: the decision values are then `-rho`.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Support vector `i`, `features` values.
    #[must_use]
    pub fn support_vector(&self, i: usize) -> &[f64] {
        &self.support_vectors[i * self.features..(i + 1) * self.features]
    }

    /// Number of machines, and of decision values of a query.
    #[must_use]
    pub fn machines(&self) -> usize {
        self.rho.len()
    }
}
