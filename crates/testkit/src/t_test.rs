//! Student's t-test in Welch's form: whether two sets of numbers could have the same mean, variances unknown.

use crate::special::normal_two_sided;

/// Mean of some numbers and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its variance (not that of the numbers).
    pub variance: f64,
    /// Degrees of freedom of that variance.
    pub dof: f64,
}

impl Mean {
    /// Of independent numbers of one distribution.
    #[must_use]
    pub fn of(numbers: &[f64]) -> Self {
        let n = numbers.len() as f64;
        let value = numbers.iter().sum::<f64>() / n;
        let squares: f64 = numbers.iter().map(|x| (x - value).powi(2)).sum();
        Self { value, variance: squares / (n - 1.0) / n, dof: n - 1.0 }
    }
}

/// Two-sided p-value of the hypothesis that both have the same expected value.
///
/// The tail of Student's distribution is taken from the normal one through the transformation of D. Wallace
/// 1959 ("Bounds on normal approximations to Student's and the chi-square distributions", Ann. Math. Stat. 30), good to a
/// tenth of the p-value from five degrees of freedom on.
#[must_use]
pub fn t_test(a: Mean, b: Mean) -> f64 {
    let variance = a.variance + b.variance;
    let difference = a.value - b.value;
    if difference == 0.0 {
        return 1.0;
    }
    if variance <= 0.0 {
        return 0.0;
    }
    let t2 = difference * difference / variance;
    // Welch and Satterthwaite.
    let dof = variance * variance / (a.variance.powi(2) / a.dof + b.variance.powi(2) / b.dof);
    if dof.is_infinite() {
        return normal_two_sided(t2.sqrt());
    }
    let z = (8.0 * dof + 1.0) / (8.0 * dof + 3.0) * (dof * (t2 / dof).ln_1p()).sqrt();
    normal_two_sided(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_match_tables_of_student() {
        // Two-sided 5 % and 0.1 % points of Student's t.
        for (dof, five, tenth) in
            [(5.0, 2.571, 6.869), (10.0, 2.228, 4.587), (30.0, 2.042, 3.646), (1e9, 1.960, 3.291)]
        {
            let exact = Mean { value: 0.0, variance: 0.0, dof: 1e300 };
            let p = |t: f64| t_test(Mean { value: t, variance: 1.0, dof }, exact);
            assert!((p(five) / 0.05 - 1.0).abs() < 0.01, "{dof}: {}", p(five));
            assert!((p(tenth) / 0.001 - 1.0).abs() < 0.1, "{dof}: {}", p(tenth));
        }
    }

    #[test]
    fn means_and_their_variance() {
        let m = Mean::of(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!((m.value, m.dof), (2.5, 3.0));
        assert!((m.variance - 5.0 / 12.0).abs() < 1e-15);
        assert_eq!(t_test(m, m), 1.0);
        assert_eq!(t_test(Mean { variance: 0.0, ..m }, Mean { value: 2.6, variance: 0.0, ..m }), 0.0);
    }
}
