//! Training: against svm-train, determinism, folds, the time limit, and every refusal.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use sparing_svm::train::{ConstantFeatures, Control, Folds, Grid, Scores, cross_validate, grid_search};
use sparing_svm::{Data, Kernel, Model, Parameters, SvmError, SvmType};
use testkit::svm_data::{SvmData, blobs, curve, pixels};

fn data(made: SvmData) -> Data {
    Data::new(made.features, made.rows, made.labels).unwrap()
}

fn threads(count: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap()
}

fn accuracy(scores: Scores) -> f64 {
    match scores {
        Scores::Classes { accuracy, .. } => accuracy,
        Scores::Values { .. } => panic!("classes"),
    }
}

#[test]
fn learns_pixels_better_than_chance() {
    let (train, test) = (data(pixels(2000, 1)), data(pixels(1000, 2)));
    let model = Parameters::rbf(1.0, 1.0).train(&train).unwrap();
    assert!((600..1200).contains(&model.len()), "{} support vectors", model.len());
    let right = (0..test.len())
        .filter(|&i| model.prediction(&[model.decision_value(test.row(i))]) == test.labels[i])
        .count();
    assert!(right > 780, "{right} of 1000");
    assert_eq!(Model::from_text(&model.to_text().unwrap()).unwrap(), model);
}

/// svm-train on the same data: the same support vectors, coefficients and rho. Debian's svm-train rounds
/// gamma to f32, so all parameters here are exact in f32.
#[test]
fn equals_svm_train() {
    if std::process::Command::new("svm-train").output().is_err() {
        eprintln!("skipped: svm-train is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let two = pixels(600, 3).with_zeros(0.1, 4);
    let four = blobs(400, 5, 4, 5);
    let values = curve(300, 3, 6);
    let rbf = Kernel::Rbf { gamma: 0.75 };
    let polynomial = Kernel::Polynomial { degree: 3, gamma: 0.5, coef0: 0.25 };
    let sigmoid = Kernel::Sigmoid { gamma: 0.0625, coef0: -0.5 };
    let cases = [
        (&two, SvmType::CSvc, rbf, "-s 0 -t 2 -g 0.75 -w1 2"),
        (&four, SvmType::CSvc, polynomial, "-s 0 -t 1 -d 3 -g 0.5 -r 0.25 -w1 2"),
        (&four, SvmType::NuSvc, rbf, "-s 1 -t 2 -g 0.75 -n 0.25"),
        (&two, SvmType::OneClass, sigmoid, "-s 2 -t 3 -g 0.0625 -r -0.5 -n 0.25"),
        (&values, SvmType::EpsilonSvr, rbf, "-s 3 -t 2 -g 0.75 -p 0.0625"),
        (&values, SvmType::NuSvr, Kernel::Linear, "-s 4 -t 0 -n 0.25"),
    ];
    for (made, svm_type, kernel, options) in cases {
        std::fs::write(path("data"), made.to_text()).unwrap();
        let status = std::process::Command::new("svm-train")
            .args(options.split(' '))
            .args(["-q", "-m", "200"])
            .args([path("data"), path("model")])
            .status()
            .unwrap();
        assert!(status.success());
        let reference = Model::read(path("model")).unwrap();
        let mut parameters = Parameters::new(svm_type, kernel);
        (parameters.nu, parameters.epsilon) = (0.25, 0.0625);
        if options.contains("-w1") {
            parameters.class_weights = vec![(1, 2.0)];
        }
        let model = parameters.train(&data(made.clone())).unwrap();
        assert_eq!(model.len(), reference.len(), "{options}");
        assert!(model.support_vectors == reference.support_vectors, "{options}: other support vectors");
        assert_eq!(
            (&model.labels, &model.class_counts),
            (&reference.labels, &reference.class_counts),
            "{options}"
        );
        let all = |m: &Model| m.coefficients.iter().flatten().chain(&m.rho).copied().collect::<Vec<_>>();
        for (a, b) in all(&model).into_iter().zip(all(&reference)) {
            // Older versions write 8 to 17 digits.
            assert!((a - b).abs() <= 1e-6 * b.abs().max(1.0), "{options}: {a} {b}");
        }
    }
}

#[test]
fn refusals() {
    let good = || data(pixels(60, 1));
    type Change = fn(&mut Data, &mut Parameters);
    let cases: [(Change, &str); 27] = [
        (|d, _| *d = Data { features: 8, ..Data::default() }, "there is no row"),
        (|d, _| *d = Data { labels: d.labels.clone(), ..Data::default() }, "0 features"),
        (|d, _| d.rows[13] = f64::NAN, "feature 6 of row 1 is not finite: NaN"),
        (|d, _| d.labels[7] = f64::INFINITY, "the label of row 7 is not finite: inf"),
        (|d, _| d.labels[7] = 0.5, "the label of row 7 is not a class (a whole number): 0.5"),
        (|d, _| d.labels[7] = 3e9, "the label of row 7 is not a class (a whole number): 3000000000"),
        (|d, _| d.labels.fill(-1.0), "all rows are of class -1; a classifier needs two or more"),
        (|d, _| d.rows.iter_mut().skip(2).step_by(8).for_each(|v| *v = 4.0), "feature 3 is 4 in all rows"),
        (|d, _| d.rows.fill(0.0), "feature 1 is 0 in all rows, and 7 more are constant"),
        (|d, _| d.weights = Some(vec![0.0; 60]), "the weight of row 0 must be positive and finite: 0"),
        (|d, _| d.weights = Some(vec![1.0; 60]), "libSVM has no weights of rows; draw rows by their weight"),
        (|_, p| p.c = 0.0, "C must be positive, at most 1e12: 0"),
        (|_, p| p.c = 1e13, "C must be positive, at most 1e12: 10000000000000"),
        (|_, p| p.c = f64::NAN, "C must be positive, at most 1e12: NaN"),
        (
            |_, p| p.kernel = Kernel::Rbf { gamma: 0.0 },
            "gamma is 0: the kernel would be the same for all rows",
        ),
        (|_, p| p.kernel = Kernel::Rbf { gamma: -1.0 }, "gamma is negative: -1"),
        (|_, p| p.kernel = Kernel::Rbf { gamma: f64::INFINITY }, "gamma is not finite: inf"),
        (|_, p| p.kernel = Kernel::Sigmoid { gamma: 1.0, coef0: f64::NAN }, "coef0 is not finite: NaN"),
        (|_, p| (p.svm_type, p.nu) = (SvmType::NuSvc, 1.5), "nu must be in (0, 1]: 1.5"),
        (|_, p| (p.svm_type, p.epsilon) = (SvmType::EpsilonSvr, -0.1), "epsilon must be 0 or more: -0.1"),
        (|_, p| p.tolerance = 0.0, "tolerance must be in (0, 1): 0"),
        (|_, p| p.cache_mib = 0.0, "cache_mib must be positive, at most 1e6: 0"),
        (|_, p| p.class_weights = vec![(1, 0.0)], "the weight of class 1 must be positive, at most 1e12: 0"),
        (|_, p| p.class_weights = vec![(1, 1.0), (1, 2.0)], "the weight of class 1 is given twice"),
        (|_, p| p.class_weights = vec![(5, 1.0)], "there is a weight for class 5, but no row of it"),
        (
            |_, p| (p.svm_type, p.class_weights) = (SvmType::NuSvr, vec![(1, 1.0)]),
            "class weights are for c_svc, not for nu_svr",
        ),
        (
            |d, p| {
                p.svm_type = SvmType::NuSvc;
                d.labels.fill(2.0);
                d.labels[4..7].fill(1.0);
            },
            "nu = 0.5 is too large for classes 1 (3 rows) and 2 (57 rows): at most 0.1",
        ),
    ];
    for (change, message) in cases {
        let (mut data, mut parameters) = (good(), Parameters::rbf(1.0, 1.0));
        change(&mut data, &mut parameters);
        let error = parameters.train(&data).expect_err(message).to_string();
        assert!(error.contains(message), "{error}\nexpected {message}");
    }
}

#[test]
fn constant_features_can_be_allowed() {
    let mut data = data(pixels(60, 1));
    data.rows.iter_mut().skip(7).step_by(8).for_each(|v| *v = 0.0);
    let parameters = Parameters { constant_features: ConstantFeatures::Allow, ..Parameters::rbf(1.0, 1.0) };
    let model = parameters.train(&data).unwrap();
    assert_eq!(model.features, 8);
    assert_eq!(Model::from_text(&model.to_text().unwrap()).unwrap(), model);
}

#[test]
fn features_beyond_all_measure_are_an_error_or_a_valid_model() {
    let mut data = data(pixels(60, 1));
    data.rows.iter_mut().for_each(|v| *v *= 1e200);
    for kernel in
        [Kernel::Linear, Kernel::Rbf { gamma: 1.0 }, Kernel::Polynomial { degree: 5, gamma: 1.0, coef0: 0.0 }]
    {
        match Parameters::new(SvmType::CSvc, kernel).train(&data) {
            Ok(model) => model.validate().unwrap(),
            Err(error) => assert!(error.to_string().contains("scale the features first"), "{error}"),
        }
    }
}

#[test]
fn folds_are_fair() {
    let data = data(blobs(103, 2, 3, 1));
    let folds = Folds::stratified(&data, 5, 9).unwrap();
    assert_eq!(folds, Folds::stratified(&data, 5, 9).unwrap());
    assert_ne!(folds, Folds::stratified(&data, 5, 10).unwrap());
    for fold in 0..5 {
        let (train, test) = folds.split(fold);
        assert_eq!(train.len() + test.len(), 103);
        for class in 0..3 {
            let count = test.iter().filter(|&&row| data.labels[row] == f64::from(class)).count();
            assert!((6..=7).contains(&count), "{count} of class {class} in fold {fold}");
        }
    }
    let groups: Vec<u64> = (0..103).map(|i| [7, 7, 1, 2, 3, 4, 5, 6][i % 8]).collect();
    let folds = Folds::by_group(&groups, 3, 1).unwrap();
    assert_eq!(folds, Folds::by_group(&groups, 3, 1).unwrap());
    for i in 0..103 {
        for j in 0..103 {
            assert!(
                groups[i] != groups[j] || folds.of_row()[i] == folds.of_row()[j],
                "a group is in two folds"
            );
        }
    }
    for fold in 0..3 {
        assert!((25..=45).contains(&folds.split(fold).1.len()), "balanced");
    }
    assert!(Folds::by_group(&groups, 8, 1).unwrap_err().to_string().contains("8 folds for 7 groups"));
    assert!(Folds::random(&data, 104, 1).unwrap_err().to_string().contains("104 folds for 103 rows"));
    assert!(Folds::random(&data, 1, 1).unwrap_err().to_string().contains("needs 2 folds or more, not 1"));
}

#[test]
fn cross_validation_is_the_same_for_any_number_of_threads() {
    let data = data(pixels(600, 1));
    let folds = Folds::stratified(&data, 5, 1).unwrap();
    let run = |count| {
        threads(count)
            .install(|| cross_validate(&Parameters::rbf(1.0, 1.0), &data, &folds, &Control::default()))
            .unwrap()
    };
    let one = run(1);
    assert_eq!(one, run(3));
    let Scores::Classes { accuracy, auc, .. } = one.scores else { panic!("classes") };
    assert!(accuracy > 0.75 && auc.unwrap() > 0.8, "{:?}", one.scores);
    // Against the definition: train without fold 2 by hand.
    let (train, test) = folds.split(2);
    let model = Parameters::rbf(1.0, 1.0).train(&data.select(&train)).unwrap();
    for row in test {
        assert_eq!(one.predictions[row], model.prediction(&[model.decision_value(data.row(row))]));
    }
}

#[test]
fn cross_validation_of_regression_and_many_classes() {
    let values = data(curve(300, 3, 1));
    let folds = Folds::random(&values, 4, 1).unwrap();
    let parameters = Parameters::new(SvmType::EpsilonSvr, Kernel::Rbf { gamma: 1.0 });
    let result = cross_validate(&parameters, &values, &folds, &Control::default()).unwrap();
    let Scores::Values { r_squared, .. } = result.scores else { panic!("values") };
    assert!(r_squared > 0.9 && result.values.is_empty(), "{r_squared}");
    let classes = data(blobs(200, 5, 4, 1));
    let folds = Folds::stratified(&classes, 4, 1).unwrap();
    let result = cross_validate(&Parameters::rbf(1.0, 1.0), &classes, &folds, &Control::default()).unwrap();
    assert!(accuracy(result.scores) > 0.7, "{:?}", result.scores);
    // One row is a class of its own: without its fold there are still three others.
    let folds = Folds::by_group(&(0..200).map(|i| i % 4).collect::<Vec<_>>(), 4, 1).unwrap();
    cross_validate(&Parameters::rbf(1.0, 1.0), &classes, &folds, &Control::default()).unwrap();
    let two = data(blobs(40, 2, 2, 1));
    let folds = Folds::by_group(&(0..40).map(|i| i % 2).collect::<Vec<_>>(), 2, 1).unwrap();
    let error = cross_validate(&Parameters::rbf(1.0, 1.0), &two, &folds, &Control::default())
        .unwrap_err()
        .to_string();
    assert!(error.contains("without fold 0: all rows are of class"), "{error}");
    let error =
        cross_validate(&Parameters::rbf(1.0, 1.0), &classes, &folds, &Control::default()).unwrap_err();
    assert!(error.to_string().contains("folds of 40 rows for 200 rows"), "{error}");
}

#[test]
fn grid_search_finds_and_reports() {
    let data = data(pixels(300, 1));
    let folds = Folds::stratified(&data, 3, 1).unwrap();
    let grid = Grid { c: vec![1e-4, 1.0], gamma: vec![1e-6, 1.0, 1e3] };
    let calls = AtomicUsize::new(0);
    let progress = |p: sparing_svm::train::Progress| {
        assert_eq!(p.total, 18);
        calls.fetch_add(1, Ordering::Relaxed);
    };
    let control = Control { progress: Some(&progress), deadline: None };
    let run = |count, control: &Control<'_>| {
        threads(count).install(|| grid_search(&Parameters::rbf(9.0, 9.0), &grid, &data, &folds, control))
    };
    let found = run(2, &control).unwrap();
    assert_eq!(calls.load(Ordering::Relaxed), 18);
    assert_eq!(found, run(1, &Control::default()).unwrap());
    assert_eq!((found.best_point.c, found.best_point.gamma, found.missing), (1.0, 1.0, 0));
    assert_eq!(found.best, Parameters::rbf(1.0, 1.0));
    assert_eq!(found.points.len(), 6);

    let past = Control { progress: None, deadline: Some(Instant::now()) };
    let error = run(2, &past).unwrap_err();
    assert!(matches!(error, SvmError::TimeLimit { done: 0, total: 18, .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "the time limit was reached after 0 of 18 fits; missing: C = 0.0001, gamma = 0.000001; C = 0.0001, \
         gamma = 1; C = 0.0001, gamma = 1000; C = 1, gamma = 0.000001 and 2 more"
    );
    let error = cross_validate(&Parameters::rbf(1.0, 1.0), &data, &folds, &past).unwrap_err();
    assert_eq!(error.to_string(), "the time limit was reached after 0 of 3 fits; missing: folds 0, 1, 2");
    // A limit in the middle leaves whole points.
    let wait = |_: sparing_svm::train::Progress| std::thread::sleep(Duration::from_millis(20));
    let control =
        Control { progress: Some(&wait), deadline: Some(Instant::now() + Duration::from_millis(150)) };
    let part = run(1, &control).unwrap();
    assert!((1..6).contains(&part.missing), "{} missing", part.missing);

    let none = Grid { c: vec![], gamma: vec![1.0] };
    let control = Control::default();
    let error = grid_search(&Parameters::rbf(1.0, 1.0), &none, &data, &folds, &control).unwrap_err();
    assert!(error.to_string().contains("the grid is empty"));
    let linear = Parameters::new(SvmType::CSvc, Kernel::Linear);
    assert!(grid_search(&linear, &grid, &data, &folds, &control).is_err());
    let bad = Grid { c: vec![-1.0], gamma: vec![1.0] };
    let error = grid_search(&Parameters::rbf(1.0, 1.0), &bad, &data, &folds, &control).unwrap_err();
    assert!(error.to_string().contains("C must be positive"), "{error}");
}

#[test]
fn resampling_follows_the_weights() {
    let mut data = Data::new(1, vec![10.0, 20.0, 30.0], vec![1.0, 2.0, 3.0]).unwrap();
    data.weights = Some(vec![1.0, 2.5, 0.5]);
    let drawn = data.resampled(8, 1).unwrap();
    assert_eq!(drawn, data.resampled(8, 1).unwrap());
    let count = |label: f64| drawn.labels.iter().filter(|l| **l == label).count();
    assert_eq!((count(1.0), count(2.0), count(3.0), drawn.weights), (2, 5, 1, None));
    data.weights = Some(vec![1e308; 3]);
    assert!(data.resampled(8, 1).unwrap_err().to_string().contains("more than a double can hold"));
    assert!(Data::default().resampled(8, 1).is_err());
    assert!(data.select(&[0]).resampled(0, 1).unwrap().is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever is trained on: a valid model or an error.
    #[test]
    fn training_never_panics(
        svm_type in prop_oneof![Just(SvmType::CSvc), Just(SvmType::NuSvc), Just(SvmType::OneClass),
            Just(SvmType::EpsilonSvr), Just(SvmType::NuSvr)],
        kernel in prop_oneof![
            Just(Kernel::Linear),
            (0..6_u32, 0.01..10.0_f64, -2.0..2.0_f64)
                .prop_map(|(degree, gamma, coef0)| Kernel::Polynomial { degree, gamma, coef0 }),
            prop_oneof![Just(1e-12), Just(1.0), Just(1e12)].prop_map(|gamma| Kernel::Rbf { gamma }),
            (0.01..10.0_f64, -2.0..2.0_f64).prop_map(|(gamma, coef0)| Kernel::Sigmoid { gamma, coef0 }),
        ],
        (c, nu, epsilon) in (prop_oneof![Just(1e-6), Just(1.0), Just(100.0)], 0.01..1.0_f64, 0.0..1.0_f64),
        scale in prop_oneof![Just(1e-30), Just(1.0), Just(1e30), Just(1e200), Just(5e-324)],
        rows in prop::collection::vec((0..3_i32, -1.0..1.0_f64, -1.0..1.0_f64), 1..12),
    ) {
        let labels = rows.iter().map(|r| f64::from(r.0)).collect();
        let values = rows.iter().flat_map(|r| [r.1 * scale, r.2 * scale]).collect();
        let data = Data::new(2, values, labels).unwrap();
        let parameters = Parameters {
            c, nu, epsilon, constant_features: ConstantFeatures::Allow, ..Parameters::new(svm_type, kernel)
        };
        if let Ok(model) = parameters.train(&data) {
            prop_assert!(model.validate().is_ok());
        }
    }
}
