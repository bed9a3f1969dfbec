use super::*;
use crate::model::Kernel;
use crate::prune::testing::machine;
use crate::prune::{Random, samples};
use rayon::prelude::*;

/// Sum of two f64 without rounding (Knuth's two-sum), as a pair.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// Numbers of about 106 bits: an unevaluated sum of two f64 (Dekker 1971).
#[derive(Clone, Copy)]
struct Pair(f64, f64);

impl Pair {
    fn add(self, o: Self) -> Self {
        let (s, e) = two_sum(self.0, o.0);
        let (s, e) = two_sum(s, e + self.1 + o.1);
        Self(s, e)
    }

    fn mul(self, o: Self) -> Self {
        let p = self.0 * o.0;
        let e = self.0.mul_add(o.0, -p) + (self.0 * o.1 + self.1 * o.0);
        let (p, e) = two_sum(p, e);
        Self(p, e)
    }

    /// exp of a number of at most 0, by Taylor's series after 2^-k scaling and k squarings.
    fn exp(self) -> Self {
        if self.0 < -700.0 {
            return Self(0.0, 0.0);
        }
        let x = Self(self.0 / 1024.0, self.1 / 1024.0);
        let mut sum = Self(1.0, 0.0);
        for k in (1..=14).rev() {
            let q = 1.0 / f64::from(k);
            let rest = Self(-q, 0.0).mul(Self(f64::from(k), 0.0)).add(Self(1.0, 0.0));
            let inverse = Self(q, rest.0 / f64::from(k));
            sum = Self(1.0, 0.0).add(x.mul(inverse).mul(sum));
        }
        (0..10).for_each(|_| sum = sum.mul(sum));
        sum
    }
}

/// f in about 100 bits.
fn precise(model: &Model, x: &[f64]) -> Pair {
    let Kernel::Rbf { gamma } = model.kernel else { panic!("RBF only") };
    let mut sum = Pair(-model.rho[0], 0.0);
    for (i, c) in model.coefficients[0].iter().enumerate() {
        let mut d2 = Pair(0.0, 0.0);
        for (a, b) in model.support_vector(i).iter().zip(x) {
            let (s, e) = two_sum(*a, -b);
            d2 = d2.add(Pair(s, e).mul(Pair(s, e)));
        }
        sum = sum.add(Pair(-gamma, 0.0).mul(d2).exp().mul(Pair(*c, 0.0)));
    }
    sum
}

#[test]
fn precise_values_are_precise() {
    let e = Pair(-1.0, 0.0).exp();
    assert_eq!(e.0, 0.367_879_441_171_442_33);
    assert!((e.1 - -1.242_875_367_278_836_8e-17).abs() < 1e-29, "{}", e.1);
    let e = Pair(-30.0, 0.0).exp();
    assert!((e.0 / 9.357_622_968_840_175e-14 - 1.0).abs() < 1e-15);
}

/// Queries that look for trouble: in the box, at and between vectors, at the boundary, far away, not finite.
fn adversarial(model: &Model, count: usize, seed: u64) -> Vec<f64> {
    let features = model.features;
    let mut rng = Random::stream(seed, 77);
    let mut rows = samples::queries(model, count / 4, seed);
    rows.extend((0..count / 4 * features).map(|_| rng.uniform() * 1.2 - 0.1));
    rows.extend((0..model.len()).flat_map(|i| model.support_vector(i).iter().copied()));
    // Bisection to the boundary between two vectors of opposite sign: the last steps differ in the last bits.
    while rows.len() < count * features {
        let (a, b) = (rng.below(model.len()), rng.below(model.len()));
        let (mut x, mut y) = (model.support_vector(a).to_vec(), model.support_vector(b).to_vec());
        let side = model.decision_value(&x) > 0.0;
        if side == (model.decision_value(&y) > 0.0) {
            rows.extend(x.iter().map(|v| v * (1.0 + 100.0 * rng.normal())));
            continue;
        }
        for _ in 0..52 {
            let middle: Vec<f64> = x.iter().zip(&y).map(|(a, b)| 0.5 * (a + b)).collect();
            rows.extend_from_slice(&middle);
            if (model.decision_value(&middle) > 0.0) == side { x = middle } else { y = middle }
        }
    }
    for special in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e160, 1e-310, 0.0, f64::MAX] {
        rows.extend(vec![special; features]);
        rows.extend((0..features).map(|f| if f == 0 { special } else { 0.5 }));
    }
    rows
}

/// Flips against the f64 machine, and the statistics.
fn flips(model: &Model, cascade: &CertifiedCascade, queries: &[f64]) -> (usize, CascadeStatistics) {
    let features = model.features;
    queries
        .par_chunks(4096 * features)
        .map(|rows| {
            let mut out = vec![0.0; rows.len() / features];
            let statistics = cascade.decide(rows, &mut out);
            let wrong = rows.chunks_exact(features).zip(&out).filter(|(x, v)| {
                let truth = model.decision_value(x);
                (truth > 0.0) != (**v > 0.0) || truth.is_nan() != v.is_nan()
            });
            (wrong.count(), statistics)
        })
        .reduce(Default::default, |(a, mut s), (b, t)| {
            s += t;
            (a + b, s)
        })
}

#[test]
fn no_sign_differs_on_a_million_queries() {
    for (seed, features, gamma, sizes) in
        [(1, 3, 2.0, None), (2, 8, 0.5, Some(vec![16, 96])), (3, 2, 10.0, Some(vec![8, 32, 64]))]
    {
        let model = machine(250, features, gamma, 30.0, seed);
        let cascade = CertifiedCascade::new(&model, &CascadeOptions { sizes, ..Default::default() }).unwrap();
        let queries = adversarial(&model, 350_000, seed);
        let (flips, statistics) = flips(&model, &cascade, &queries);
        assert_eq!(flips, 0, "{statistics:?}");
        assert_eq!(statistics.total() as usize, queries.len() / features);
        assert!(!cascade.levels().is_empty());
        assert!(statistics.full * 2 < statistics.total(), "{statistics:?}");
    }
}

#[test]
fn extremes_flip_nothing() {
    for (gamma, c) in [
        (1e-12, 1.0),
        (1e-12, 1e6),
        (1e-6, 1e6),
        (1e12, 1.0),
        (1e3, 1e6),
        (1.0, 1e6),
        (1.0, 1e-6),
        (1e-250, 1.0),
        (1.0, 1e300),
    ] {
        let mut model = machine(120, 3, gamma, c, 6);
        // Pairs that cancel nearly.
        for i in 0..40 {
            let j = 119 - i;
            let near: Vec<f64> = model.support_vector(i).iter().map(|v| v + 1e-7).collect();
            model.support_vectors[j * 3..j * 3 + 3].copy_from_slice(&near);
            model.coefficients[0][j] = -model.coefficients[0][i] * (1.0 - 1e-9);
        }
        for sizes in [None, Some(vec![10, 60])] {
            let options = CascadeOptions { sizes, samples: 200, seed: 1 };
            let cascade = CertifiedCascade::new(&model, &options).unwrap();
            let (flips, statistics) = flips(&model, &cascade, &adversarial(&model, 10_000, 4));
            assert_eq!(flips, 0, "gamma {gamma} c {c}: {statistics:?}");
        }
    }
}

#[test]
fn the_bounds_hold_in_high_precision() {
    for (features, gamma, c) in [(3, 2.0, 30.0), (8, 0.2, 1e3), (2, 50.0, 1.0), (3, 0.01, 1e5)] {
        let model = machine(150, features, gamma, c, 5);
        let options = CascadeOptions { sizes: Some(vec![6, 24, 60]), ..Default::default() };
        let cascade = CertifiedCascade::new(&model, &options).unwrap();
        let queries = adversarial(&model, 1500, 8);
        for (level, info) in cascade.levels.iter().zip(cascade.levels()) {
            let r2 = build::difference_norm2(&model, &level.model);
            let slack = rounding::quadratic(gamma, features, rounding::mass(&model) * 2.0);
            assert!(info.bound.norm().powi(2) >= r2 - slack, "{} {r2}", info.bound.norm());
            let mut sharpest = 0.0_f64;
            for x in queries.chunks_exact(features).filter(|x| x.iter().all(|v| v.abs() < 1e100)) {
                let (f, g) = (precise(&model, x), precise(&level.model, x));
                let truth = f.add(Pair(-g.0, -g.1)).0.abs();
                assert!(truth <= info.bound.anywhere());
                for i in 0..level.model.len() {
                    let centre = level.model.support_vector(i);
                    let d2: f64 = centre.iter().zip(x).map(|(c, x)| (c - x) * (c - x)).sum();
                    assert!(truth <= info.bound.near(d2), "{truth} {}", info.bound.near(d2));
                }
                sharpest = sharpest.max(truth / info.bound.anywhere());
                assert!((model.decision_value(x) - f.0).abs() <= rounding::decision(&model));
            }
            assert!(sharpest > 1e-4, "a bound far from what happens: {sharpest}");
        }
    }
}

#[test]
fn sixteen_copies_of_one_vector_and_one_vector_alone() {
    let mut model = machine(16, 2, 1.0, 1.0, 2);
    let first = model.support_vector(0).to_vec();
    model.support_vectors.chunks_mut(2).for_each(|row| row.copy_from_slice(&first));
    let options = CascadeOptions { sizes: Some(vec![0, 4, 8, 9, 10]), ..Default::default() };
    let cascade = CertifiedCascade::new(&model, &options).unwrap();
    assert_eq!(flips(&model, &cascade, &adversarial(&model, 3000, 1)).0, 0);
    let single = machine(1, 2, 1.0, 1.0, 2);
    let cascade = CertifiedCascade::new(&single, &CascadeOptions::default()).unwrap();
    assert_eq!(cascade.levels(), []);
}

#[test]
fn other_kernels_are_refused() {
    let mut model = machine(16, 2, 1.0, 1.0, 2);
    model.kernel = Kernel::Linear;
    let result = CertifiedCascade::new(&model, &CascadeOptions::default());
    assert_eq!(result.unwrap_err(), PruneError::NotRbf("linear"));
}
