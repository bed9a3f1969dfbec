//! What pruning refuses.

/// Why a machine cannot be pruned in the way that was asked for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PruneError {
    /// Several machines at once.
    #[error(
        "the model holds {0} machines; only models of one machine (two classes, or one class) can be pruned"
    )]
    Machines(usize),
    /// A regression model has no decision to keep.
    #[error("the model is a regression; only models that decide (two classes, or one class) can be pruned")]
    Regression,
    /// Broken sizes or numbers.
    #[error("the model's sizes do not fit together, or a number in it is not finite")]
    Invalid,
    /// No support vector.
    #[error("the model has no support vectors")]
    Empty,
    /// No vector was asked for.
    #[error("a machine of 0 vectors was asked for; at least 1 is needed")]
    Size,
    /// The method needs an inner product.
    #[error(
        "this method needs a kernel that is an inner product (rbf, linear, polynomial with gamma and coef0 of at \
         least 0), but this model's {0} kernel is none"
    )]
    NotPositiveDefinite(&'static str),
    /// The method needs K(x, x) = 1.
    #[error("the certified cascade needs an rbf kernel, but this model's kernel is {0}")]
    NotRbf(&'static str),
    /// The method needs labelled data.
    #[error("the method {0} needs labelled data")]
    NoLabels(String),
    /// The examples do not fit the model.
    #[error("the data has {found} values, which are not {rows} rows of the model's {features} features")]
    Examples {
        /// Values found.
        found: usize,
        /// Rows, one a label.
        rows: usize,
        /// Features of the model.
        features: usize,
    },
    /// The examples hold NaN or infinity.
    #[error("row {} of the data has a value or label that is not finite", .0 + 1)]
    NotFinite(usize),
    /// Not enough to fit and to measure.
    #[error("the data has {0} rows; at least 2 are needed, one half to fit and one to measure")]
    TooFewRows(usize),
    /// A label that the model does not know.
    #[error("row {} of the data has the label {label}, but the model tells {known} apart", row + 1)]
    UnknownLabel {
        /// Row, from 0.
        row: usize,
        /// The label.
        label: String,
        /// The model's labels.
        known: String,
    },
    /// No step of the fit gave finite coefficients.
    #[error("no coefficients could be fitted: the kernel's values overflow or are all zero on this data")]
    Fit,
    /// Training failed.
    #[error("training on a part of the data failed: {0}")]
    Training(String),
    /// A method's name that does not exist.
    #[error(
        "there is no method '{name}'; use a selection ({selections}) and optionally a refit ({refits}), such as kmeans-fit"
    )]
    UnknownMethod {
        /// What was asked for.
        name: String,
        /// What there is.
        selections: String,
        /// What there is.
        refits: String,
    },
    /// Stopped from outside.
    #[error("stopped")]
    Stopped,
    /// The evaluator refuses the model.
    #[error("{0}")]
    Evaluator(String),
}
