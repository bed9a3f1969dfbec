//! The four kernels of libSVM, in f64.

/// A kernel function K(x, y) of two feature vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// `<x, y>`
    Linear,
    /// `(gamma <x, y> + coef0)^degree`
    Polynomial {
        /// Exponent, 0 or more.
        degree: u32,
        /// Factor of the inner product.
        gamma: f64,
        /// Added to it.
        coef0: f64,
    },
    /// `exp(-gamma |x - y|^2)`
    Rbf {
        /// Inverse squared width, 0 or more.
        gamma: f64,
    },
    /// `tanh(gamma <x, y> + coef0)`
    Sigmoid {
        /// Factor of the inner product.
        gamma: f64,
        /// Added to it.
        coef0: f64,
    },
}

impl Kernel {
    /// The name that model files use.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Polynomial { .. } => "polynomial",
            Self::Rbf { .. } => "rbf",
            Self::Sigmoid { .. } => "sigmoid",
        }
    }

    /// K(x, y), with the operations and their order as in libSVM: only features beyond the end of the shorter
    /// vector, zeros, are left out.
    #[must_use]
    pub fn evaluate(&self, x: &[f64], y: &[f64]) -> f64 {
        let dot = || x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
        match *self {
            Self::Linear => dot(),
            Self::Polynomial { degree, gamma, coef0 } => power(gamma * dot() + coef0, degree),
            Self::Rbf { gamma } => {
                let distance2: f64 = x.iter().zip(y).map(|(a, b)| (a - b) * (a - b)).sum();
                (-gamma * distance2).exp()
            }
            Self::Sigmoid { gamma, coef0 } => (gamma * dot() + coef0).tanh(),
        }
    }
}

/// `base^exponent` by squaring, multiplied in libSVM's order.
fn power(base: f64, exponent: u32) -> f64 {
    let (mut square, mut result, mut left) = (base, 1.0, exponent);
    while left > 0 {
        if left % 2 == 1 {
            result *= square;
        }
        square *= square;
        left /= 2;
    }
    result
}
