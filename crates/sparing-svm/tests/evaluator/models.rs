//! Machines made by hand, and queries that are hard for them.

use sparing_svm::evaluator::{InstructionSet, Options};
use sparing_svm::{Evaluator, Kernel, Model, SvmType};
use testkit::svm_data::Random;

/// What a machine is made of.
#[derive(Clone, Copy)]
pub struct Recipe {
    pub kernel: Kernel,
    pub vectors: usize,
    pub features: usize,
    /// Features are uniform in `[-size, size]`.
    pub size: f64,
    /// Coefficients are uniform in `[-coefficient, coefficient]`.
    pub coefficient: f64,
    pub seed: u64,
}

impl Default for Recipe {
    fn default() -> Self {
        let kernel = Kernel::Rbf { gamma: 0.5 };
        Self { kernel, vectors: 100, features: 8, size: 1.0, coefficient: 1.0, seed: 1 }
    }
}

/// A machine of two classes whose decision values are about as often positive as negative.
pub fn machine(recipe: Recipe) -> Model {
    let Recipe { kernel, vectors, features, size, coefficient, seed } = recipe;
    let mut random = Random::new(seed);
    let support_vectors: Vec<f64> =
        (0..vectors * features).map(|_| size * (2.0 * random.uniform() - 1.0)).collect();
    let first = vectors.div_ceil(2);
    let sign = |i: usize| if i < first { 1.0 } else { -1.0 };
    let coefficients: Vec<f64> =
        (0..vectors).map(|i| sign(i) * coefficient * random.uniform().max(1e-9)).collect();
    let mut model = Model {
        svm_type: SvmType::CSvc,
        kernel,
        labels: vec![1, -1],
        class_counts: vec![first, vectors - first],
        rho: vec![0.0],
        prob_a: Vec::new(),
        prob_b: Vec::new(),
        prob_density_marks: Vec::new(),
        features,
        support_vectors,
        coefficients: vec![coefficients],
    };
    let mut values: Vec<f64> =
        queries(&model, 33, seed + 1).chunks_exact(features).map(|q| model.decision_value(q)).collect();
    values.sort_by(f64::total_cmp);
    if values[16].is_finite() {
        model.rho[0] = values[16];
    }
    model.validate().expect("a machine made by hand is valid");
    model
}

/// Mixtures of two support vectors, each with a little noise.
pub fn queries(model: &Model, count: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed ^ 0x5eed);
    let mut queries = Vec::with_capacity(count * model.features);
    for _ in 0..count {
        let pick = |random: &mut Random| (random.uniform() * model.len() as f64) as usize;
        let (a, b, w) = (pick(&mut random), pick(&mut random), random.uniform());
        for (x, y) in model.support_vector(a).iter().zip(model.support_vector(b)) {
            queries.push((w * x + (1.0 - w) * y) * (1.0 + 0.01 * random.normal()));
        }
    }
    queries
}

/// Evaluators of all instruction sets of this machine.
pub fn evaluators(model: &Model) -> Vec<Evaluator> {
    let sets = InstructionSet::ALL.into_iter().filter(|s| s.is_available());
    sets.map(|set| {
        let options = Options { instruction_set: Some(set), ..Options::default() };
        Evaluator::compile(model, &options).expect("compiles")
    })
    .collect()
}

/// Whether two decision values are on the same side; NaN is with NaN, zero with zero.
pub fn same_side(a: f64, b: f64) -> bool {
    (a > 0.0) == (b > 0.0) && (a < 0.0) == (b < 0.0) && a.is_nan() == b.is_nan()
}

/// Compares the evaluators of a model with the definition for these queries; gives how many values went beyond f32.
pub fn check(model: &Model, queries: &[f64], name: &str) -> usize {
    let count = queries.len() / model.features;
    let machines = model.machines();
    let mut expected = vec![0.0; count * machines];
    for (query, out) in queries.chunks_exact(model.features).zip(expected.chunks_exact_mut(machines)) {
        model.decision_values(query, out);
    }
    let mut beyond = 0;
    for evaluator in evaluators(model) {
        let name = format!("{name}, {}", evaluator.instruction_set().name());
        let mut values = vec![0.0; count * machines];
        let mut bounds = vec![0.0; count * machines];
        evaluator.decision_values_with_bounds(queries, &mut values, &mut bounds);
        for (i, ((v, b), e)) in values.iter().zip(&bounds).zip(&expected).enumerate() {
            let holds = (v - e).abs() <= *b || v == e || (v.is_nan() && e.is_nan());
            assert!(holds, "{name}: value {i} is {v:e}, should be {e:e} within {b:e}");
        }
        let effort = evaluator.decide(queries, &mut values);
        assert_eq!(effort.total(), count * machines, "{name}");
        for (i, (v, e)) in values.iter().zip(&expected).enumerate() {
            assert!(same_side(*v, *e), "{name}: value {i} is {v:e}, should be {e:e}");
        }
        beyond += effort.double + effort.definition;
    }
    beyond
}
