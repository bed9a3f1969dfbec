//! Support vector machines.

use super::case::{Case, Effort, Random};
use crate::commands::machine::shipped;
use anyhow::Context;
use sparing_adaptive::features::FeatureMatrix;
use sparing_svm::evaluator::{Evaluator, ExpMethod, InstructionSet, Options};
use sparing_svm::prune::certified::{CascadeOptions, CertifiedCascade};
use sparing_svm::{Kernel, Model, SvmType};

const AREA: &str = "Support vector machines";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "bounds-hold",
        does: "Fast values against the f64 model, gamma 1e-12 to 1e12, coefficients that cancel to four and eight digits, queries in \
               and far outside of the vectors: error over the bound that comes with the value.",
        unit: "times the bound",
        bound: 1.0,
        measure: bounds,
    },
    Case {
        area: AREA,
        name: "signs-on-the-boundary",
        does: "Queries that bisection put on the decision boundary, to the last bit of a feature: signs that differ from the f64 \
               model's.",
        unit: "signs",
        bound: 0.0,
        measure: signs,
    },
    Case {
        area: AREA,
        name: "exponentials",
        does: "A machine of one vector by every way to compute exponentials, with every instruction set of the machine, from 0 to where \
               they are denormal and 0: error over the bound that comes with the value.",
        unit: "times the bound",
        bound: 1.0,
        measure: exponentials,
    },
    Case {
        area: AREA,
        name: "certified-pruning",
        does: "Cascades of reduced machines with certified bounds, gamma 1e-3 to 10: random queries, and those that bisection put where a \
               reduced machine's value is its bound or 0: signs that differ from the f64 model's.",
        unit: "signs",
        bound: 0.0,
        measure: certified,
    },
    Case {
        area: AREA,
        name: "denormal-kernels",
        does: "Queries so far away that kernel values are denormal or 0: values not finite, or beyond the sum of coefficients.",
        unit: "values",
        bound: 0.0,
        measure: |_| far(),
    },
    Case {
        area: AREA,
        name: "shipped-model-out-of-range",
        does: "The model in the program with features of +-1e300 and 0: decision values that are not finite.",
        unit: "values",
        bound: 0.0,
        measure: |_| shipped_far(),
    },
];

const FEATURES: usize = 12;

/// A machine of random vectors; the coefficients of both classes nearly cancel to `digits` digits.
fn model(random: &mut Random, gamma: f64, digits: i32) -> anyhow::Result<Model> {
    let half = 100;
    let vectors: Vec<f64> = (0..2 * half * FEATURES).map(|_| random.between(-4.0, 4.0)).collect();
    let mut coefficients: Vec<f64> = (0..half).map(|_| random.between(0.1, 1.0)).collect();
    let opposite: Vec<f64> =
        coefficients.iter().map(|c| -c * (1.0 + 10_f64.powi(-digits) * random.between(-1.0, 1.0))).collect();
    coefficients.extend(opposite);
    let model = Model {
        svm_type: SvmType::CSvc,
        kernel: Kernel::Rbf { gamma },
        labels: vec![1, -1],
        class_counts: vec![half, half],
        rho: vec![0.0],
        prob_a: Vec::new(),
        prob_b: Vec::new(),
        prob_density_marks: Vec::new(),
        features: FEATURES,
        support_vectors: vectors,
        coefficients: vec![coefficients],
    };
    let origin = value(&model, &[0.0; FEATURES]);
    Ok(Model { rho: vec![origin], ..model })
}

fn value(model: &Model, query: &[f64]) -> f64 {
    let mut out = [0.0];
    model.decision_values(query, &mut out);
    out[0]
}

/// The largest error of values over the bound that comes with each.
fn over_bounds(evaluator: &Evaluator, queries: &[f64], error: impl Fn(&[f64], f64) -> f64) -> f64 {
    let features = evaluator.features();
    let n = queries.len() / features;
    let (mut values, mut limits) = (vec![0.0; n], vec![0.0; n]);
    evaluator.decision_values_with_bounds(queries, &mut values, &mut limits);
    let found = queries.chunks(features).zip(values).zip(limits);
    found.fold(0.0, |worst, ((query, found), limit)| {
        let error = error(query, found);
        worst.max(if error == 0.0 { 0.0 } else { error / limit })
    })
}

/// Two random points, brought together by bisection if they are on different sides; whether they were.
fn boundary(random: &mut Random, above: impl Fn(&[f64]) -> bool) -> (bool, Vec<f64>) {
    let mut point = || -> Vec<f64> { (0..FEATURES).map(|_| random.between(-4.0, 4.0)).collect() };
    let (mut a, mut b) = (point(), point());
    let between = above(&a) != above(&b);
    for _ in 0..60 * u32::from(between) {
        let middle: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
        let same = above(&middle) == above(&a);
        *(if same { &mut a } else { &mut b }) = middle;
    }
    (between, [a, b].concat())
}

/// Decisions whose sign is not that of the model.
fn wrong_signs(model: &Model, queries: &[f64], decisions: &[f64]) -> u32 {
    let wrong = |(query, found): &(&[f64], &f64)| (**found > 0.0) != (value(model, query) > 0.0);
    queries.chunks(FEATURES).zip(decisions).filter(wrong).count() as u32
}

fn bounds(effort: Effort) -> anyhow::Result<f64> {
    let mut random = Random::new(11);
    let mut worst: f64 = 0.0;
    for exponent in -12..=12 {
        for digits in [0, 4, 8] {
            let model = model(&mut random, 10_f64.powi(exponent), digits)?;
            let evaluator = Evaluator::new(&model)?;
            let n = effort.of(64, 2048);
            let mut queries = Vec::new();
            for k in 0..n {
                let reach = 10_f64.powi(k % 7 - 3);
                let near = model.support_vector(k as usize % model.len());
                queries.extend(near.iter().map(|v| v + reach * random.between(-1.0, 1.0)));
            }
            worst = worst
                .max(over_bounds(&evaluator, &queries, |query, found| (found - value(&model, query)).abs()));
        }
    }
    Ok(worst)
}

fn signs(effort: Effort) -> anyhow::Result<f64> {
    let mut random = Random::new(12);
    let mut wrong = 0;
    for exponent in [-3, -2, -1, 0, 1] {
        let model = model(&mut random, 10_f64.powi(exponent), 0)?;
        let evaluator = Evaluator::new(&model)?;
        let mut queries = Vec::new();
        for _ in 0..effort.of(200, 20_000) {
            let (between, points) = boundary(&mut random, |q| value(&model, q) > 0.0);
            if between {
                queries.extend(points);
            }
        }
        let mut decisions = vec![0.0; queries.len() / FEATURES];
        evaluator.decide(&queries, &mut decisions);
        wrong += wrong_signs(&model, &queries, &decisions);
    }
    Ok(f64::from(wrong))
}

fn exponentials(effort: Effort) -> anyhow::Result<f64> {
    let mut random = Random::new(14);
    let base = model(&mut random, 1.0, 0)?;
    let one = Model {
        class_counts: vec![1, 1],
        rho: vec![0.0],
        features: 1,
        // The second vector is so far away that it is 0 for all queries.
        support_vectors: vec![0.0, 1e4],
        coefficients: vec![vec![1.0, -1.0]],
        ..base
    };
    let n = effort.of(2_000, 200_000);
    // exp(-800) is 0 in f64.
    let queries: Vec<f64> = (0..n).map(|k| (800.0 * f64::from(k) / f64::from(n)).sqrt()).collect();
    let mut worst: f64 = 0.0;
    for exp in ExpMethod::ALL {
        for set in InstructionSet::ALL.into_iter().filter(|s| s.is_available()) {
            let evaluator = Evaluator::compile(&one, &Options { exp, instruction_set: Some(set) })?;
            worst = worst.max(over_bounds(&evaluator, &queries, |query, found| {
                let exact = (-query[0] * query[0]).exp();
                // Definition and library may differ by an ulp.
                ((found - exact).abs() - f64::EPSILON * exact).max(0.0)
            }));
        }
    }
    Ok(worst)
}

fn certified(effort: Effort) -> anyhow::Result<f64> {
    let mut random = Random::new(15);
    let mut wrong = 0;
    for exponent in [-3, -2, -1, 0, 1] {
        let model = model(&mut random, 10_f64.powi(exponent), 0)?;
        let options = CascadeOptions { sizes: Some(vec![16, 64, 128]), ..CascadeOptions::default() };
        let cascade = CertifiedCascade::new(&model, &options)?;
        let mut queries = Vec::new();
        for (level, info) in cascade.levels().iter().enumerate() {
            let reduced = cascade.level_model(level).context("a level's machine")?;
            let edges = [0.0, info.bound.anywhere(), -info.bound.anywhere()];
            for k in 0..effort.of(60, 3_000) {
                let edge = edges[k % edges.len()];
                queries.extend(boundary(&mut random, |q| value(reduced, q) > edge).1);
            }
        }
        let mut decisions = vec![0.0; queries.len() / FEATURES];
        cascade.decide(&queries, &mut decisions);
        wrong += wrong_signs(&model, &queries, &decisions);
    }
    Ok(f64::from(wrong))
}

fn far() -> anyhow::Result<f64> {
    let mut random = Random::new(13);
    let model = model(&mut random, 1.0, 0)?;
    let evaluator = Evaluator::new(&model)?;
    let most: f64 = model.coefficients[0].iter().map(|c| c.abs()).sum::<f64>() + model.rho[0].abs();
    let mut wrong = 0;
    for k in 0..4000 {
        let distance = 2.0 + 0.01 * f64::from(k);
        let query: Vec<f64> = (0..FEATURES).map(|i| if i == 0 { distance } else { 0.1 }).collect();
        let mut found = [0.0];
        evaluator.decision_values(&query, &mut found);
        wrong += u32::from(!found[0].is_finite() || found[0].abs() > most * (1.0 + 1e-6));
    }
    Ok(f64::from(wrong))
}

fn shipped_far() -> anyhow::Result<f64> {
    let machine = shipped().context("the model in the program")?;
    let n = machine.features().len();
    let mut wrong = 0;
    for value in [0.0, 1e-300, 1e6, -1e6, 1e300, -1e300] {
        for column in 0..n {
            let mut values = vec![0.5; n];
            values[column] = value;
            let decided = machine.classifier().decide(FeatureMatrix { features: n, values });
            wrong += decided.iter().filter(|v| !v.is_finite()).count();
        }
    }
    Ok(wrong as f64)
}
