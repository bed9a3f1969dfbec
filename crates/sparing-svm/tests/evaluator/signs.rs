//! Ten million decisions, most of them where they are hardest, and no sign that differs from the definition's.

use crate::models::{Recipe, machine, queries, same_side};
use rayon::prelude::*;
use sparing_svm::evaluator::{Effort, InstructionSet, Options};
use sparing_svm::{Evaluator, Kernel, Model};
use testkit::svm_data::Random;

/// The point between two queries of opposite sign where the decision value is zero, to the last bit.
fn boundary(model: &Model, a: &[f64], b: &[f64]) -> Option<Vec<f64>> {
    let positive = |q: &[f64]| model.decision_value(q) > 0.0;
    if positive(a) == positive(b) {
        return None;
    }
    let at = |w: f64| -> Vec<f64> { a.iter().zip(b).map(|(x, y)| x + w * (y - x)).collect() };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..54 {
        let middle = 0.5 * (low + high);
        if positive(&at(middle)) == positive(a) { low = middle } else { high = middle }
    }
    Some(at(low))
}

/// A sixth random queries, the others on the boundary or off it by 1e-16 to 1 of its size.
fn hard_queries(model: &Model, count: usize, seed: u64) -> Vec<f64> {
    let features = model.features;
    let mut all = queries(model, count / 6, seed);
    let pairs = queries(model, 2000, seed + 1);
    let points: Vec<Vec<f64>> = pairs
        .chunks_exact(2 * features)
        .filter_map(|pair| boundary(model, &pair[..features], &pair[features..]))
        .collect();
    assert!(points.len() > 100, "only {} points on the boundary", points.len());
    let mut random = Random::new(seed + 2);
    for i in 0..count - count / 6 {
        let size = 10_f64.powf(-17.0 * random.uniform());
        all.extend(points[i % points.len()].iter().map(|x| x + x * size * random.normal()));
    }
    all
}

fn flips(model: &Model, evaluator: &Evaluator, queries: &[f64]) -> (usize, Effort) {
    let features = model.features;
    let parts = queries.par_chunks(1000 * features).map(|part| {
        let mut values = vec![0.0; part.len() / features];
        let effort = evaluator.decide(part, &mut values);
        let differs = |(value, query): (&f64, &[f64])| !same_side(*value, model.decision_value(query));
        (values.iter().zip(part.chunks_exact(features)).filter(|&p| differs(p)).count(), effort)
    });
    parts.reduce(Default::default, |(flips, mut effort), (more, e)| {
        effort += e;
        (flips + more, effort)
    })
}

#[test]
fn no_sign_of_ten_million_differs() {
    let rbf = |gamma| Kernel::Rbf { gamma };
    let recipes = [
        // kernel, vectors, coefficient
        (rbf(0.5), 64, 1.0),
        (rbf(0.05), 200, 1e6),
        (rbf(0.001), 100, 1e6),
        (rbf(5.0), 100, 1e3),
        (rbf(300.0), 100, 1.0),
        (Kernel::Linear, 50, 1e4),
        (Kernel::Polynomial { degree: 3, gamma: 0.5, coef0: 1.0 }, 60, 10.0),
        (Kernel::Sigmoid { gamma: 0.2, coef0: -0.3 }, 60, 10.0),
    ];
    let count = 10_000_000 / recipes.len() + 1;
    let mut total = Effort::default();
    for (seed, &(kernel, vectors, coefficient)) in recipes.iter().enumerate() {
        let model = machine(Recipe { kernel, vectors, coefficient, seed: seed as u64, ..Recipe::default() });
        let sets: Vec<_> = InstructionSet::ALL.into_iter().filter(|s| s.is_available()).collect();
        // Each instruction set takes its share.
        for (i, &set) in sets.iter().enumerate() {
            let options = Options { instruction_set: Some(set), ..Options::default() };
            let evaluator = Evaluator::compile(&model, &options).expect("compiles");
            let hard = hard_queries(&model, count / sets.len() + 1, (10 * seed + i) as u64);
            let (flipped, effort) = flips(&model, &evaluator, &hard);
            assert_eq!(flipped, 0, "{kernel:?} {set:?}: {effort:?}");
            total += effort;
        }
    }
    println!("{total:?}");
    assert!(total.total() >= 10_000_000);
    // All levels were put to the test.
    assert!(total.single > 1_000_000 && total.double > 1_000_000 && total.definition > 100_000, "{total:?}");
}

#[test]
fn sums_that_cancel_ten_thousandfold() {
    // A wide kernel and coefficients up to a million: the sum of magnitudes is more than 1e4 times the value.
    let kernel = Kernel::Rbf { gamma: 1e-3 };
    let model = machine(Recipe { kernel, vectors: 1000, coefficient: 1e6, ..Recipe::default() });
    let all = queries(&model, 2000, 5);
    let magnitude: f64 = model.coefficients[0].iter().map(|c| c.abs()).sum();
    let mut values: Vec<f64> = all.chunks_exact(8).map(|q| model.decision_value(q).abs()).collect();
    values.sort_by(f64::total_cmp);
    assert!(values[1000] * 1e4 < magnitude, "{} {magnitude}", values[1000]);
    let evaluator = Evaluator::new(&model).expect("compiles");
    let (flipped, effort) = flips(&model, &evaluator, &hard_queries(&model, 20_000, 6));
    assert_eq!(flipped, 0, "{effort:?}");
}
