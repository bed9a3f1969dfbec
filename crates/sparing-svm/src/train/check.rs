//! What is wrong with parameters or data, before libSVM sees them.

use std::collections::BTreeMap;

use super::{ConstantFeatures, Parameters};
use crate::data::Data;
use crate::error::{Result, SvmError};
use crate::model::validate::check_kernel;
use crate::model::{Kernel, SvmType};

impl Parameters {
    /// Checks the parameters alone.
    ///
    /// # Errors
    /// [`SvmError::Parameters`] with the first that is out of its range.
    pub fn validate(&self) -> Result<()> {
        self.check_values().map_err(SvmError::Parameters)
    }

    fn check_values(&self) -> std::result::Result<(), String> {
        check_kernel(&self.kernel)?;
        if matches!(
            self.kernel,
            Kernel::Polynomial { gamma: 0.0, .. }
                | Kernel::Rbf { gamma: 0.0 }
                | Kernel::Sigmoid { gamma: 0.0, .. }
        ) {
            return Err("gamma is 0: the kernel would be the same for all rows".to_owned());
        }
        let range = |name: &str, value: f64, inside: bool, text: &str| {
            if inside { Ok(()) } else { Err(format!("{name} must be {text}: {value}")) }
        };
        let positive = "positive, at most 1e12";
        if matches!(self.svm_type, SvmType::CSvc | SvmType::EpsilonSvr | SvmType::NuSvr) {
            range("C", self.c, self.c > 0.0 && self.c <= 1e12, positive)?;
        }
        if matches!(self.svm_type, SvmType::NuSvc | SvmType::OneClass | SvmType::NuSvr) {
            range("nu", self.nu, self.nu > 0.0 && self.nu <= 1.0, "in (0, 1]")?;
        }
        if self.svm_type == SvmType::EpsilonSvr {
            range("epsilon", self.epsilon, self.epsilon >= 0.0 && self.epsilon.is_finite(), "0 or more")?;
        }
        range("tolerance", self.tolerance, self.tolerance > 0.0 && self.tolerance < 1.0, "in (0, 1)")?;
        range(
            "cache_mib",
            self.cache_mib,
            self.cache_mib > 0.0 && self.cache_mib <= 1e6,
            "positive, at most 1e6",
        )?;
        if !self.class_weights.is_empty() && self.svm_type != SvmType::CSvc {
            return Err(format!("class weights are for c_svc, not for {}", self.svm_type.name()));
        }
        for (i, (label, weight)) in self.class_weights.iter().enumerate() {
            let name = format!("the weight of class {label}");
            range(&name, *weight, *weight > 0.0 && *weight <= 1e12, positive)?;
            if self.class_weights[..i].iter().any(|(other, _)| other == label) {
                return Err(format!("{name} is given twice"));
            }
        }
        Ok(())
    }

    /// Checks parameters and data together.
    pub(super) fn check(&self, data: &Data) -> Result<()> {
        self.validate()?;
        data.validate()?;
        let fail = |message: String| Err(SvmError::Data(message));
        if data.is_empty() {
            return fail("there is no row".to_owned());
        }
        if data.features == 0 || data.features > i32::MAX as usize {
            return fail(format!("{} features", data.features));
        }
        if data.weights.is_some() {
            return fail(
                "libSVM has no weights of rows; draw rows by their weight with Data::resampled".to_owned(),
            );
        }
        if self.constant_features == ConstantFeatures::Refuse && data.len() > 1 {
            let first = data.row(0);
            let constant: Vec<String> = (0..data.features)
                .filter(|&j| data.rows.iter().skip(j).step_by(data.features).all(|value| *value == first[j]))
                .map(|j| format!("feature {} is {} in all rows", j + 1, first[j]))
                .collect();
            if let [first, rest @ ..] = constant.as_slice() {
                let more = if rest.is_empty() {
                    String::new()
                } else {
                    format!(", and {} more are constant", rest.len())
                };
                return fail(format!("{first}{more}"));
            }
        }
        if self.svm_type.is_classifier() {
            let classes = classes(data)?;
            if let (1, Some((class, _))) = (classes.len(), classes.first_key_value()) {
                return fail(format!("all rows are of class {class}; a classifier needs two or more"));
            }
            for (label, _) in &self.class_weights {
                if !classes.contains_key(label) {
                    return fail(format!("there is a weight for class {label}, but no row of it"));
                }
            }
            if self.svm_type == SvmType::NuSvc {
                self.check_feasible(&classes)?;
            }
        }
        Ok(())
    }

    /// Each pair of classes must be able to take nu / 2 of its rows from either (libSVM's
    /// svm_check_parameter).
    fn check_feasible(&self, classes: &BTreeMap<i32, usize>) -> Result<()> {
        let list: Vec<(i32, usize)> = classes.iter().map(|(label, count)| (*label, *count)).collect();
        for (i, (a, count_a)) in list.iter().enumerate() {
            for (b, count_b) in &list[i + 1..] {
                let (smaller, both) = (*count_a.min(count_b) as f64, (count_a + count_b) as f64);
                if self.nu * both / 2.0 > smaller {
                    return Err(SvmError::Data(format!(
                        "nu = {} is too large for classes {a} ({count_a} rows) and {b} ({count_b} rows): at most {:.6}",
                        self.nu,
                        2.0 * smaller / both
                    )));
                }
            }
        }
        Ok(())
    }
}

/// Rows of each class.
pub(super) fn classes(data: &Data) -> Result<BTreeMap<i32, usize>> {
    let mut classes = BTreeMap::new();
    for (i, label) in data.labels.iter().enumerate() {
        // Saturates, and then differs.
        let class = *label as i32;
        if f64::from(class) != *label {
            return Err(SvmError::Data(format!(
                "the label of row {i} is not a class (a whole number): {label}"
            )));
        }
        *classes.entry(class).or_insert(0) += 1;
    }
    Ok(classes)
}
