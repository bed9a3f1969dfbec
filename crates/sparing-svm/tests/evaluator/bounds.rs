//! Bounds hold for every kernel, method, number of features; results do not depend on how queries are batched.

use crate::models::{Recipe, check, evaluators, machine, queries};
use proptest::prelude::*;
use sparing_svm::evaluator::{ExpMethod, InstructionSet, Options};
use sparing_svm::{Evaluator, Kernel, Model, SvmType};
use testkit::svm_data::Random;

fn kernels() -> impl Strategy<Value = Kernel> {
    let gamma = (-6.0..6.0_f64).prop_map(f64::exp2);
    prop_oneof![
        Just(Kernel::Linear),
        gamma.clone().prop_map(|gamma| Kernel::Rbf { gamma }),
        (gamma.clone(), 0_u32..6, -2.0..2.0_f64).prop_map(|(gamma, degree, coef0)| Kernel::Polynomial {
            degree,
            gamma,
            coef0
        }),
        (gamma, -2.0..2.0_f64).prop_map(|(gamma, coef0)| Kernel::Sigmoid { gamma, coef0 }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn any_kernel_is_within_its_bounds(
        kernel in kernels(),
        vectors in 1_usize..120,
        features in 1_usize..21,
        size in -3.0..3.0_f64,
        coefficient in -3.0..6.0_f64,
        seed in 0_u64..1000,
    ) {
        let (size, coefficient) = (10_f64.powf(size), 10_f64.powf(coefficient));
        let model = machine(Recipe { kernel, vectors, features, size, coefficient, seed });
        let mut hard = queries(&model, 40, seed);
        // Some far away.
        for x in &mut hard[..features * 10] {
            *x *= 30.0;
        }
        check(&model, &hard, &format!("{kernel:?}"));
    }
}

#[test]
fn the_bound_of_the_model_covers_all_values() {
    for (gamma, coefficient) in [(0.01, 1.0), (0.5, 1e6), (20.0, 10.0)] {
        let kernel = Kernel::Rbf { gamma };
        let model = machine(Recipe { kernel, vectors: 700, coefficient, ..Recipe::default() });
        let mut many = queries(&model, 2000, 3);
        for (i, x) in many.iter_mut().enumerate() {
            *x *= 1.0 + (i % 40) as f64 / 10.0;
        }
        for evaluator in evaluators(&model) {
            let mut values = vec![0.0; 2000];
            let mut bounds = vec![0.0; 2000];
            evaluator.decision_values_with_bounds(&many, &mut values, &mut bounds);
            let bound = evaluator.error_bound();
            assert!(bound < 2e-4 * coefficient * 700.0, "{bound:e} is of no use");
            for (query, value) in many.chunks_exact(8).zip(&values) {
                let error = (value - model.decision_value(query)).abs();
                assert!(error <= bound, "gamma {gamma}: {error:e} > {bound:e}");
            }
        }
    }
}

#[test]
fn all_exponential_methods_keep_their_bounds_and_signs() {
    let model = machine(Recipe { vectors: 500, coefficient: 100.0, ..Recipe::default() });
    let many = queries(&model, 1000, 7);
    let expected: Vec<f64> = many.chunks_exact(8).map(|q| model.decision_value(q)).collect();
    let mut errors = Vec::new();
    for set in InstructionSet::ALL.into_iter().filter(|s| s.is_available()) {
        for exp in ExpMethod::ALL {
            let options = Options { exp, instruction_set: Some(set) };
            let evaluator = Evaluator::compile(&model, &options).expect("compiles");
            let (mut values, mut bounds) = (vec![0.0; 1000], vec![0.0; 1000]);
            evaluator.decision_values_with_bounds(&many, &mut values, &mut bounds);
            let mut worst = 0.0_f64;
            for ((v, b), e) in values.iter().zip(&bounds).zip(&expected) {
                assert!((v - e).abs() <= *b, "{set:?} {exp:?}: {v} {e} {b}");
                worst = worst.max((v - e).abs());
            }
            evaluator.decide(&many, &mut values);
            assert!(values.iter().zip(&expected).all(|(v, e)| (*v > 0.0) == (*e > 0.0)), "{set:?} {exp:?}");
            errors.push((exp, worst));
        }
    }
    // The methods really differ.
    let error = |method| errors.iter().find(|e| e.0 == method).map(|e| e.1).unwrap();
    assert!(error(ExpMethod::Polynomial3) > 10.0 * error(ExpMethod::Polynomial4));
    assert!(error(ExpMethod::Polynomial4) > 2.0 * error(ExpMethod::Polynomial6));
}

#[test]
fn batches_do_not_change_a_bit() {
    for (vectors, features) in [(5, 3), (1000, 8), (300, 17), (40, 200)] {
        let model = machine(Recipe { vectors, features, ..Recipe::default() });
        let mut all = queries(&model, 700, 9);
        for (i, query) in all.chunks_exact_mut(features).enumerate() {
            // Near, far and beyond f32 in one batch.
            let factor = [1.0, 1.0, 12.0, 1e4][i % 4];
            query.iter_mut().for_each(|x| *x *= factor);
        }
        for evaluator in evaluators(&model) {
            let mut whole = vec![0.0; 700];
            evaluator.decision_values(&all, &mut whole);
            let mut decided = vec![0.0; 700];
            evaluator.decide(&all, &mut decided);
            let mut random = Random::new(4);
            let mut at = 0;
            while at < 700 {
                let n = (1 + (random.uniform() * 90.0) as usize).min(700 - at);
                let mut part = vec![0.0; n];
                evaluator.decision_values(&all[at * features..(at + n) * features], &mut part);
                assert!(part.iter().zip(&whole[at..]).all(|(a, b)| a.to_bits() == b.to_bits()));
                evaluator.decide(&all[at * features..(at + n) * features], &mut part);
                assert!(part.iter().zip(&decided[at..]).all(|(a, b)| a.to_bits() == b.to_bits()));
                at += n;
            }
        }
    }
}

/// Four classes, six machines, with vectors whose coefficients are zero in some of them.
#[test]
fn many_classes_and_other_types() {
    let two = machine(Recipe { vectors: 80, ..Recipe::default() });
    let mut random = Random::new(3);
    let mut row = || (0..80).map(|i| if i % 7 == 0 { 0.0 } else { random.normal() }).collect::<Vec<f64>>();
    let four = Model {
        labels: vec![3, 1, 4, -5],
        class_counts: vec![30, 20, 20, 10],
        rho: vec![0.1, -0.2, 0.3, 0.0, 0.2, -0.1],
        coefficients: vec![row(), row(), row()],
        ..two.clone()
    };
    four.validate().expect("valid");
    assert_eq!(Evaluator::new(&four).expect("compiles").machines(), 6);
    check(&four, &queries(&four, 500, 1), "four classes");
    for svm_type in [SvmType::OneClass, SvmType::EpsilonSvr, SvmType::NuSvr] {
        let one = Model { svm_type, labels: Vec::new(), class_counts: Vec::new(), ..two.clone() };
        one.validate().expect("valid");
        check(&one, &queries(&one, 500, 1), svm_type.name());
    }
}
