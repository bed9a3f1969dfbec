//! Sizes and numbers at the ends of their ranges.

use crate::models::{Recipe, check, evaluators, machine, queries};
use sparing_svm::evaluator::{InstructionSet, Options};
use sparing_svm::{Evaluator, Kernel};

#[test]
fn one_vector_and_two_hundred_thousand() {
    for (vectors, count) in [(1, 100), (2, 100), (16, 100), (17, 100), (33, 100), (200_000, 6)] {
        let model = machine(Recipe { vectors, ..Recipe::default() });
        check(&model, &queries(&model, count, 2), &format!("{vectors} vectors"));
    }
}

#[test]
fn one_feature_and_a_thousand() {
    for features in [1, 2, 3, 4, 5, 7, 8, 9, 12, 15, 16, 31, 100, 1000] {
        let gamma = 1.0 / features as f64;
        for kernel in [Kernel::Rbf { gamma }, Kernel::Sigmoid { gamma, coef0: 0.1 }] {
            let model = machine(Recipe { kernel, features, ..Recipe::default() });
            check(&model, &queries(&model, 60, 2), &format!("{features} features"));
        }
    }
}

#[test]
fn more_features_than_the_scratch_holds() {
    let kernel = Kernel::Rbf { gamma: 1e-4 };
    let model = machine(Recipe { kernel, features: 5000, vectors: 10, ..Recipe::default() });
    check(&model, &queries(&model, 20, 2), "5000 features");
}

#[test]
fn gamma_from_tiny_to_huge() {
    for exponent in -12..=12 {
        let gamma = 10_f64.powi(exponent);
        let model = machine(Recipe { kernel: Kernel::Rbf { gamma }, ..Recipe::default() });
        let mut all = queries(&model, 200, 2);
        // Right at the support vectors and within the kernel's width of them.
        for i in 0..model.len() {
            all.extend_from_slice(model.support_vector(i));
            all.extend(model.support_vector(i).iter().map(|x| x + 0.3 / gamma.sqrt()));
        }
        check(&model, &all, &format!("gamma {gamma:e}"));
    }
    let model = machine(Recipe { kernel: Kernel::Rbf { gamma: 0.0 }, ..Recipe::default() });
    check(&model, &queries(&model, 100, 2), "gamma 0");
}

#[test]
fn features_from_tiny_to_huge() {
    for size in [1e-300_f64, 1e-160, 1e-30, 1e30, 1e150, 1e300] {
        for gamma in [1.0 / (8.0 * size * size), 1.0_f64] {
            if !gamma.is_finite() {
                continue;
            }
            let model = machine(Recipe { kernel: Kernel::Rbf { gamma }, size, ..Recipe::default() });
            check(&model, &queries(&model, 100, 2), &format!("size {size:e}, gamma {gamma:e}"));
        }
    }
    for size in [1e-30, 1e30] {
        for kernel in [
            Kernel::Linear,
            Kernel::Polynomial { degree: 3, gamma: 1.0, coef0: 0.0 },
            Kernel::Sigmoid { gamma: 1.0, coef0: 0.0 },
        ] {
            let model = machine(Recipe { kernel, size, ..Recipe::default() });
            check(&model, &queries(&model, 100, 2), &format!("{kernel:?} size {size:e}"));
        }
    }
}

#[test]
fn a_cluster_far_from_the_origin() {
    let mut model = machine(Recipe::default());
    for x in &mut model.support_vectors {
        *x += 1e6;
    }
    let beyond = check(&model, &queries(&model, 500, 2), "far cluster");
    println!("{beyond} beyond f32");
}

#[test]
fn coefficients_of_all_sizes() {
    let mut model = machine(Recipe { vectors: 400, ..Recipe::default() });
    for (i, c) in model.coefficients[0].iter_mut().enumerate() {
        *c *= 10_f64.powi((i % 80) as i32 * 4 - 300);
    }
    check(&model, &queries(&model, 300, 2), "coefficients from 1e-300 to 1e16");
    model.coefficients[0].fill(0.0);
    check(&model, &queries(&model, 300, 2), "all coefficients zero");
}

#[test]
fn queries_that_are_not_finite_or_denormal() {
    for kernel in [
        Kernel::Rbf { gamma: 0.5 },
        Kernel::Linear,
        Kernel::Polynomial { degree: 2, gamma: 1.0, coef0: 1.0 },
        Kernel::Sigmoid { gamma: 1.0, coef0: 0.0 },
    ] {
        let model = machine(Recipe { kernel, ..Recipe::default() });
        let hostile =
            [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1e-40, -0.0];
        let mut all = queries(&model, 64, 3);
        for (i, query) in all.chunks_exact_mut(8).enumerate() {
            query[i % 7] = hostile[i % hostile.len()];
        }
        check(&model, &all, &format!("{kernel:?}"));
        for evaluator in evaluators(&model) {
            let mut values = vec![0.0; 64];
            let effort = evaluator.decide(&all, &mut values);
            assert!(effort.not_a_number >= 8, "{kernel:?}: {effort:?}");
            assert_eq!(effort.not_a_number, values.iter().filter(|v| v.is_nan()).count());
        }
    }
}

#[test]
fn features_without_spread_and_empty_batches() {
    let mut model = machine(Recipe { features: 9, ..Recipe::default() });
    for vector in model.support_vectors.chunks_exact_mut(9) {
        vector[0] = 0.25;
        vector[4] = -3.0;
    }
    check(&model, &queries(&model, 500, 2), "two constant features");
    for evaluator in evaluators(&model) {
        assert_eq!(evaluator.decide(&[], &mut []).total(), 0);
        assert_eq!(evaluator.decision_values(&[], &mut []).total(), 0);
    }
}

#[test]
fn an_instruction_set_that_is_not_there_is_refused() {
    let model = machine(Recipe::default());
    for set in InstructionSet::ALL {
        let options = Options { instruction_set: Some(set), ..Options::default() };
        assert_eq!(Evaluator::compile(&model, &options).is_ok(), set.is_available(), "{set:?}");
    }
}

#[test]
fn a_model_whose_parts_contradict_each_other_is_refused() {
    let mut model = machine(Recipe::default());
    model.support_vectors.pop();
    assert!(Evaluator::new(&model).is_err());
}

#[test]
fn threads_share_an_evaluator() {
    fn shared<T: Send + Sync>() {}
    shared::<Evaluator>();
}
