//! Are the parts of a model consistent?

use super::{Kernel, Model};
use crate::error::{Result, SvmError};

/// libSVM's number of density marks.
pub(super) const DENSITY_MARKS: usize = 10;

impl Model {
    /// Checks a model that was put together by hand: lengths that fit each other, distinct labels, finite
    /// numbers, gamma not negative. Models that were read have passed.
    ///
    /// # Errors
    /// [`SvmError::Model`] with the first contradiction.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(SvmError::Model)
    }

    fn check(&self) -> std::result::Result<(), String> {
        check_kernel(&self.kernel)?;
        let classes = if self.svm_type.is_classifier() { self.labels.len() } else { 2 };
        if self.svm_type.is_classifier() {
            if classes < 2 {
                return Err(format!("a classifier has at least 2 classes, this one {classes}"));
            }
            let mut sorted = self.labels.clone();
            sorted.sort_unstable();
            if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
                return Err(format!("label {} occurs twice", pair[0]));
            }
            expect("class_counts", self.class_counts.len(), classes, "one for each class")?;
            let sum = self.class_counts.iter().try_fold(0_usize, |sum, count| sum.checked_add(*count));
            if sum != Some(self.len()) {
                return Err(format!("class_counts do not add up to the {} support vectors", self.len()));
            }
        } else if !self.labels.is_empty() || !self.class_counts.is_empty() {
            return Err(format!("{} has neither labels nor class_counts", self.svm_type.name()));
        }
        let machines = classes * (classes - 1) / 2;
        expect("rho", self.rho.len(), machines, "one for each pair of classes")?;
        for (name, values) in [("prob_a", &self.prob_a), ("prob_b", &self.prob_b)] {
            if !values.is_empty() {
                expect(name, values.len(), machines, "one for each pair of classes, or none")?;
            }
        }
        if !self.prob_density_marks.is_empty() {
            expect(
                "prob_density_marks",
                self.prob_density_marks.len(),
                DENSITY_MARKS,
                "as in libSVM, or none",
            )?;
        }
        expect("coefficients", self.coefficients.len(), classes - 1, "one row less than classes")?;
        for row in &self.coefficients {
            expect("a row of coefficients", row.len(), self.len(), "one for each support vector")?;
        }
        if self.len().checked_mul(self.features) != Some(self.support_vectors.len()) {
            return Err(format!(
                "support_vectors has {} values for {} vectors of {} features",
                self.support_vectors.len(),
                self.len(),
                self.features
            ));
        }
        let lists = [
            ("rho", &self.rho),
            ("prob_a", &self.prob_a),
            ("prob_b", &self.prob_b),
            ("prob_density_marks", &self.prob_density_marks),
        ];
        for (name, values) in lists {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                return Err(format!("{name}[{i}] is not finite: {}", values[i]));
            }
        }
        for (j, row) in self.coefficients.iter().enumerate() {
            if let Some(i) = row.iter().position(|v| !v.is_finite()) {
                return Err(format!("coefficient {j} of support vector {i} is not finite: {}", row[i]));
            }
        }
        if let Some(i) = self.support_vectors.iter().position(|v| !v.is_finite()) {
            let (vector, feature) = (i / self.features, i % self.features + 1);
            let value = self.support_vectors[i];
            return Err(format!("feature {feature} of support vector {vector} is not finite: {value}"));
        }
        Ok(())
    }
}

/// Kernel parameters that libSVM accepts, and finite.
pub(crate) fn check_kernel(kernel: &Kernel) -> std::result::Result<(), String> {
    let (gamma, coef0, degree) = match *kernel {
        Kernel::Linear => (0.0, 0.0, 0),
        Kernel::Polynomial { degree, gamma, coef0 } => (gamma, coef0, degree),
        Kernel::Rbf { gamma } => (gamma, 0.0, 0),
        Kernel::Sigmoid { gamma, coef0 } => (gamma, coef0, 0),
    };
    if !gamma.is_finite() {
        return Err(format!("gamma is not finite: {gamma}"));
    }
    if gamma < 0.0 {
        return Err(format!("gamma is negative: {gamma}"));
    }
    if !coef0.is_finite() {
        return Err(format!("coef0 is not finite: {coef0}"));
    }
    if degree > i32::MAX.unsigned_abs() {
        return Err(format!("degree is beyond libSVM's {}: {degree}", i32::MAX));
    }
    Ok(())
}

fn expect(what: &str, found: usize, wanted: usize, why: &str) -> std::result::Result<(), String> {
    if found == wanted { Ok(()) } else { Err(format!("{what}: {found} instead of {wanted}, {why}")) }
}
