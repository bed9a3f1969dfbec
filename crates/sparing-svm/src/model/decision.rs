//! Decision values in f64: the definition that every faster evaluation is held to.

use super::{Model, SvmType};

impl Model {
    /// Decision values of one query of `features` values, one for each machine. Slow and exact (f64, libSVM's order of
    /// operations): use `Evaluator` for many queries.
    ///
    /// # Panics
    /// When `query` is not `features` long or `out` not `machines()` long.
    pub fn decision_values(&self, query: &[f64], out: &mut [f64]) {
        assert_eq!(query.len(), self.features, "the query's number of features");
        assert_eq!(out.len(), self.machines(), "the number of decision values");
        let kernel = |i: usize| self.kernel.evaluate(self.support_vector(i), query);
        if !self.svm_type.is_classifier() {
            let sum: f64 = self.coefficients[0].iter().enumerate().map(|(i, c)| c * kernel(i)).sum();
            out[0] = sum - self.rho[0];
            return;
        }
        let values: Vec<f64> = (0..self.len()).map(kernel).collect();
        let mut starts = vec![0];
        for count in &self.class_counts {
            starts.push(starts[starts.len() - 1] + count);
        }
        let mut machine = 0;
        for i in 0..self.labels.len() {
            for j in i + 1..self.labels.len() {
                let mut sum = 0.0;
                for (class, row) in [(i, j - 1), (j, i)] {
                    let range = starts[class]..starts[class + 1];
                    for (coefficient, value) in
                        self.coefficients[row][range.clone()].iter().zip(&values[range])
                    {
                        sum += coefficient * value;
                    }
                }
                out[machine] = sum - self.rho[machine];
                machine += 1;
            }
        }
    }

    /// The decision value of one query of a model with one machine (two classes, one class, regression).
    ///
    /// # Panics
    /// When the model has more than one machine or `query` is not `features` long.
    #[must_use]
    pub fn decision_value(&self, query: &[f64]) -> f64 {
        let mut out = [0.0];
        self.decision_values(query, &mut out);
        out[0]
    }

    /// What libSVM predicts from the decision values of one query: a class label by votes (the first class wins a
    /// tie), +1 or -1 for one-class models, the value itself for regression.
    ///
    /// # Panics
    /// When `decision_values` is not `machines()` long.
    #[must_use]
    pub fn prediction(&self, decision_values: &[f64]) -> f64 {
        assert_eq!(decision_values.len(), self.machines(), "the number of decision values");
        match self.svm_type {
            SvmType::OneClass => return if decision_values[0] > 0.0 { 1.0 } else { -1.0 },
            SvmType::EpsilonSvr | SvmType::NuSvr => return decision_values[0],
            SvmType::CSvc | SvmType::NuSvc => {}
        }
        let k = self.labels.len();
        let mut votes = vec![0_usize; k];
        let mut machine = 0;
        for i in 0..k {
            for j in i + 1..k {
                votes[if decision_values[machine] > 0.0 { i } else { j }] += 1;
                machine += 1;
            }
        }
        let mut best = 0;
        for i in 1..k {
            if votes[i] > votes[best] {
                best = i;
            }
        }
        self.labels.get(best).map_or(f64::NAN, |&label| f64::from(label))
    }
}
