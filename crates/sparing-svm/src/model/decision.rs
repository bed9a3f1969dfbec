//! Decision values in f64: the definition that every faster evaluation is held to.

use super::{Model, SvmType};

impl Model {
    /// Decision values of one query of `features` values, one for each machine. Slow and exact (f64, libSVM's order of
    /// operations): use [`crate::Evaluator`] for many queries.
    ///
    /// # Panics
    /// When `query` is not `features` long or `out` not `machines()` long.
    pub fn decision_values(&self, query: &[f64], out: &mut [f64]) {
        assert_eq!(query.len(), self.features, "the query's number of features");
        assert_eq!(out.len(), self.machines(), "the number of decision values");
        for (machine, out) in out.iter_mut().enumerate() {
            *out = self.machine_value(machine, query);
        }
    }

    /// The decision value of one machine.
    pub(crate) fn machine_value(&self, machine: usize, query: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (i, coefficient) in self.terms(machine) {
            sum += coefficient * self.kernel.evaluate(self.support_vector(i), query);
        }
        sum - self.rho[machine]
    }

    /// Support vectors and coefficients of one machine, in libSVM's order.
    pub(crate) fn terms(&self, machine: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (a, b) = self.classes_of(machine);
        let start = |class: usize| self.class_counts.iter().take(class).sum::<usize>();
        let range = |class: usize| match self.class_counts.get(class) {
            Some(count) => start(class)..start(class) + count,
            None if class == 0 => 0..self.len(), // one-class and regression
            None => 0..0,
        };
        let first = range(a).map(move |i| (i, self.coefficients[b - 1][i]));
        first.chain(range(b).map(move |i| (i, self.coefficients[a][i])))
    }

    /// The two classes that a machine tells apart; (0, 1) for one-class and regression.
    fn classes_of(&self, machine: usize) -> (usize, usize) {
        let mut left = machine;
        let k = self.labels.len().max(2);
        for a in 0..k {
            let pairs = k - 1 - a;
            if left < pairs {
                return (a, a + 1 + left);
            }
            left -= pairs;
        }
        (0, 1)
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
