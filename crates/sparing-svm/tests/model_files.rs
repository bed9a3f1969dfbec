//! Model files: every way to get one wrong, with the line and the message; and what is written reads back the
//! same.

use proptest::prelude::*;
use sparing_svm::model::{ModelLimits, ReadOptions};
use sparing_svm::{Kernel, Model, SvmError, SvmType};

const GOOD: &str = "svm_type c_svc\nkernel_type rbf\ngamma 0.5\nnr_class 2\ntotal_sv 3\nrho 0.25\nlabel 1 -1\n\
                    nr_sv 2 1\nSV\n1 1:0.5 3:-2\n0.5 2:1e-3\n-1.5\n";

#[test]
fn reads_a_model_with_omitted_zeros() {
    let model = Model::from_text(GOOD).unwrap();
    assert_eq!(model.svm_type, SvmType::CSvc);
    assert_eq!(model.kernel, Kernel::Rbf { gamma: 0.5 });
    assert_eq!((model.len(), model.features), (3, 3));
    assert_eq!(model.support_vectors, [0.5, 0.0, -2.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(model.coefficients, [[1.0, 0.5, -1.5]]);
    assert_eq!(
        (model.labels.as_slice(), model.class_counts.as_slice()),
        ([1, -1].as_slice(), [2, 1].as_slice())
    );
}

#[test]
fn the_number_of_features_can_be_given() {
    let options = ReadOptions { features: Some(5), ..ReadOptions::default() };
    let model = Model::read_from(GOOD.as_bytes(), "m", &options).unwrap();
    assert_eq!((model.features, model.support_vectors.len()), (5, 15));
    // And it survives writing, though the last features are zero everywhere.
    assert_eq!(Model::from_text(&model.to_text().unwrap()).unwrap(), model);
    let options = ReadOptions { features: Some(2), ..ReadOptions::default() };
    let error = Model::read_from(GOOD.as_bytes(), "m", &options).unwrap_err();
    assert_eq!(error.to_string(), "m:10:9: feature 3 is beyond the number of features, 2");
}

/// Replaces `from` in the good file and expects an error at `place` ("line" or "line:column") that contains
/// `message`.
#[track_caller]
fn wrong(from: &str, to: &str, place: &str, message: &str) {
    assert!(GOOD.contains(from), "{from:?} is not in the good file");
    wrong_text(&GOOD.replacen(from, to, 1), place, message);
}

#[track_caller]
fn wrong_text(text: &str, place: &str, message: &str) {
    let error = Model::from_text(text).expect_err(message);
    let shown = error.to_string();
    assert!(shown.starts_with(&format!("model:{place}: ")), "{shown}\nexpected at {place}");
    assert!(shown.contains(message), "{shown}\nexpected {message}");
}

#[test]
fn header_errors() {
    wrong("c_svc", "d_svc", "1:10", "unknown svm_type \"d_svc\"; known are c_svc, nu_svc, one_class");
    wrong("c_svc", "", "1", "the header has no value");
    wrong("c_svc", "c_svc 3", "1:16", "one value expected, then found \"3\"");
    wrong("rbf", "rbg", "2:13", "unknown kernel_type \"rbg\"");
    wrong("rbf", "precomputed", "2:13", "precomputed kernel hold no vectors");
    wrong("0.5", "half", "3:7", "gamma is not a number: \"half\"");
    wrong("0.5", "0x1p3", "3:7", "gamma is not a number");
    wrong("0.5", "nan", "3:7", "gamma is not finite");
    wrong("0.5", "inf", "3:7", "gamma is not finite");
    wrong("0.5", "1e999", "3:7", "gamma is too large for a double");
    wrong("0.5", "-1", "3", "gamma is negative: -1");
    wrong("gamma 0.5\n", "", "8", "the header gamma is missing; the rbf kernel needs it");
    wrong("gamma 0.5\n", "gamma 0.5\ndegree 3\n", "4", "degree has no meaning with the rbf kernel");
    wrong("gamma 0.5\n", "gamma 0.5\ncoef0 3\n", "4", "coef0 has no meaning with the rbf kernel");
    wrong(
        "rbf\ngamma 0.5",
        "polynomial\ndegree -1\ngamma 1\ncoef0 0",
        "3:8",
        "degree is out of range: \"-1\"",
    );
    wrong(
        "rbf\ngamma 0.5",
        "polynomial\ndegree 3000000000\ngamma 1\ncoef0 0",
        "3",
        "degree is beyond libSVM's",
    );
    wrong(
        "rbf\ngamma 0.5",
        "polynomial\ndegree 2.5\ngamma 1\ncoef0 0",
        "3:8",
        "degree is not a whole number",
    );
    wrong("rbf\ngamma 0.5", "polynomial\ngamma 1\ncoef0 0", "10", "the header degree is missing");
    wrong("rbf", "sigmoid", "9", "the header coef0 is missing; the sigmoid kernel needs it");
    wrong("nr_class 2", "nr_class 1", "4:10", "nr_class must be 2 or more, found 1");
    wrong("nr_class 2", "nr_class 99999", "4:10", "nr_class 99999 is beyond the limit of 1000 classes");
    wrong("nr_class 2", "nr_class -2", "4:10", "nr_class is out of range: \"-2\"");
    wrong("nr_class 2\n", "", "8", "the header nr_class is missing");
    wrong("nr_class 2", "nr_class 3", "6", "rho has 1 values instead of 3, one for each pair of classes");
    wrong("total_sv 3", "total_sv 99999999999", "5:10", "beyond the limit of 4000000 support vectors");
    wrong("total_sv 3", "total_sv 99999999999999999999999", "5:10", "total_sv is out of range");
    wrong("rho 0.25", "rho 0.25 1", "6", "rho has 2 values instead of 1");
    wrong("rho 0.25", "rho", "6", "rho has 0 values instead of 1");
    wrong("rho 0.25", "rho x", "6:5", "rho is not a number: \"x\"");
    wrong("rho 0.25\n", "", "8", "the header rho is missing");
    wrong("label 1 -1", "label 1 1", "7", "label 1 occurs twice");
    wrong("label 1 -1", "label 1 -1.5", "7:9", "the label is not a whole number: \"-1.5\"");
    wrong("label 1 -1", "label 1 3000000000", "7:9", "the label is out of range");
    wrong("label 1 -1", "label 1", "7", "label has 1 values instead of 2");
    wrong("label 1 -1\n", "", "8", "the header label is missing");
    wrong("nr_sv 2 1", "nr_sv 2 2", "8", "nr_sv does not add up to total_sv, 3");
    wrong("nr_sv 2 1", "nr_sv 2 18446744073709551615", "8", "nr_sv does not add up to total_sv, 3");
    wrong("nr_sv 2 1\n", "", "8", "the header nr_sv is missing");
    wrong("nr_sv 2 1\n", "nr_sv 2 1\nprobA 1 2\n", "9", "probA has 2 values instead of 1");
    wrong(
        "nr_sv 2 1\n",
        "nr_sv 2 1\nprob_density_marks 1 2\n",
        "9",
        "prob_density_marks has 2 values instead of 10",
    );
    wrong("label 1 -1", "weather fine", "7:1", "unknown header \"weather\"");
    wrong("rho 0.25", "gamma 0.5", "6:1", "the header gamma is there twice, first in line 3");
    wrong("rho 0.25", "", "6", "an empty line in the header");
    wrong("c_svc", "one_class", "7", "label has no meaning with one_class");
    wrong_text(
        "svm_type nu_svr\nkernel_type linear\nnr_class 3\ntotal_sv 0\nrho 1\nSV\n",
        "3",
        "nr_class is 2 for nu_svr",
    );
    wrong_text("", "1", "the file ends before the line \"SV\"");
    wrong_text("svm_type c_svc\n", "1", "the file ends before the line \"SV\"");
}

#[test]
fn vector_errors() {
    wrong("1:0.5 3:-2", "1:0.5 1:-2", "10:9", "feature 1 occurs twice");
    wrong("1:0.5 3:-2", "3:0.5 1:-2", "10:9", "feature indices must ascend within a line: 1 comes after 3");
    wrong("1:0.5 3:-2", "0:0.5 1:-2", "10:3", "feature indices begin at 1, found 0");
    wrong("1:0.5 3:-2", "-1:0.5", "10:3", "the feature index is out of range: \"-1\"");
    wrong("1:0.5 3:-2", "a:0.5", "10:3", "the feature index is not a whole number: \"a\"");
    wrong("1:0.5 3:-2", ":0.5", "10:3", "the feature index is not a whole number: \"\"");
    wrong("1:0.5 3:-2", "1000001:1", "10:3", "feature 1000001 is beyond the limit of features, 1000000");
    wrong("1:0.5 3:-2", "1:", "10:5", "the value of feature 1 is not a number: \"\"");
    wrong("1:0.5 3:-2", "1:0.5:3", "10:5", "the value of feature 1 is not a number: \"0.5:3\"");
    wrong("1:0.5 3:-2", "1:nan", "10:5", "the value of feature 1 is not finite: \"nan\"");
    wrong("1:0.5 3:-2", "1:-inf", "10:5", "the value of feature 1 is not finite");
    wrong("1:0.5 3:-2", "1:0.5 -2", "10:9", "expected index:value, found \"-2\"");
    wrong("\n0.5 2", "\nx 2", "11:1", "the coefficient is not a number: \"x\"");
    wrong("\n0.5 2", "\ninf 2", "11:1", "the coefficient is not finite");
    wrong("\n0.5 2", "\n2", "11", "0 of 1 coefficients of support vector 2");
    wrong("\n0.5 2:1e-3\n", "\n\n", "11", "0 of 1 coefficients of support vector 2");
    wrong("-1.5\n", "", "11", "the file ends after 2 of 3 support vectors");
    wrong("-1.5\n", "-1.5", "12", "the file ends in the middle of a line: it was cut short");
    wrong("-1.5\n", "-1.5\n2 1:1\n", "13", "text after the last of 3 support vectors");
    assert!(Model::from_text(&(GOOD.to_owned() + " \n\r\n")).is_ok(), "blank lines at the end");
    let mut bytes = GOOD.as_bytes().to_vec();
    bytes.extend(*b"\xff\xfe");
    let error = Model::read_from(&bytes[..], "m", &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "m:13:1: the line is not UTF-8 text");
}

#[test]
fn limits_hold_before_memory_is_taken() {
    // Each vector is short in the file and a million values in memory.
    let mut text = GOOD[..GOOD.find("total_sv").unwrap()].to_owned();
    text += "total_sv 1000\nrho 0\nlabel 1 2\nnr_sv 500 500\nSV\n";
    for _ in 0..1000 {
        text += "1 1000000:1\n";
    }
    wrong_text(
        &text,
        "144",
        "the model needs more than the limit of 134217728 values: 135 vectors of 1000000 features",
    );
    let options = ReadOptions { features: Some(usize::MAX), ..ReadOptions::default() };
    let error = Model::read_from(GOOD.as_bytes(), "m", &options).unwrap_err();
    assert!(error.to_string().contains("the model needs more than the limit"), "{error}");
    let many = GOOD.replace("rho 0.25", &format!("rho{}", " 1".repeat(600_000)));
    wrong_text(&many, "6:1000005", "more than 500000 values, too many for 1000 classes");
    let limits = ModelLimits { vectors: 2, ..ModelLimits::default() };
    let error = Model::read_from(GOOD.as_bytes(), "m", &ReadOptions { features: None, limits }).unwrap_err();
    assert_eq!(error.to_string(), "m:5:10: total_sv 3 is beyond the limit of 2 support vectors");
}

#[test]
fn small_and_large_models() {
    for (vectors, features) in [(1, 1), (1, 1000), (0, 0), (200_000, 8)] {
        let made = testkit::svm_data::blobs(vectors, features, 2, 5).with_zeros(0.1, 6);
        let model = Model {
            svm_type: SvmType::NuSvr,
            kernel: Kernel::Polynomial { degree: 0, gamma: 1e-12, coef0: -1e30 },
            labels: vec![],
            class_counts: vec![],
            rho: vec![5e-324],
            prob_a: vec![],
            prob_b: vec![],
            prob_density_marks: vec![],
            features,
            support_vectors: made.rows.iter().map(|v| v / 3.0).collect(),
            coefficients: vec![(0..vectors).map(|i| i as f64 / 7.0 - 3.3).collect()],
        };
        assert!(Model::from_text(&model.to_text().unwrap()).unwrap() == model, "{vectors} x {features}");
    }
}

#[test]
fn files_are_named_and_written_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.model");
    let error = Model::read(&path).unwrap_err();
    assert!(matches!(&error, SvmError::Io { action: "read", .. }), "{error}");
    let mut model = Model::from_text(GOOD).unwrap();
    model.write(&path).unwrap();
    assert_eq!(Model::read(&path).unwrap(), model);
    // A model that is not valid does not touch the file.
    model.rho.push(1.0);
    assert!(model.write(&path).is_err());
    model.rho.pop();
    assert_eq!(Model::read(&path).unwrap(), model);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
    std::fs::write(&path, GOOD.replace("rho", "ohr")).unwrap();
    assert_eq!(
        Model::read(&path).unwrap_err().to_string(),
        format!("{}:6:1: unknown header \"ohr\"", path.display())
    );
    assert!(model.write(folder.path()).unwrap_err().to_string().starts_with("cannot write "));
}

#[test]
fn a_hand_built_model_is_checked() {
    type Change = fn(&mut Model);
    let cases: [(Change, &str); 14] = [
        (|m| m.labels = vec![1], "a classifier has at least 2 classes, this one 1"),
        (|m| m.labels = vec![7, 7], "label 7 occurs twice"),
        (|m| m.class_counts = vec![3], "class_counts: 1 instead of 2, one for each class"),
        (|m| m.class_counts = vec![usize::MAX, 4], "class_counts do not add up to the 3 support vectors"),
        (|m| m.rho = vec![], "rho: 0 instead of 1, one for each pair of classes"),
        (|m| m.rho[0] = f64::NAN, "rho[0] is not finite: NaN"),
        (|m| m.prob_a = vec![1.0, 2.0], "prob_a: 2 instead of 1"),
        (|m| m.prob_density_marks = vec![1.0], "prob_density_marks: 1 instead of 10"),
        (|m| m.coefficients.push(vec![1.0; 3]), "coefficients: 2 instead of 1, one row less than classes"),
        (|m| m.features = 2, "support_vectors has 9 values for 3 vectors of 2 features"),
        (|m| m.support_vectors[4] = f64::INFINITY, "feature 2 of support vector 1 is not finite: inf"),
        (|m| m.coefficients[0][2] = f64::NAN, "coefficient 0 of support vector 2 is not finite: NaN"),
        (|m| m.kernel = Kernel::Rbf { gamma: -1.0 }, "gamma is negative: -1"),
        (|m| m.svm_type = SvmType::NuSvr, "nu_svr has neither labels nor class_counts"),
    ];
    for (change, message) in cases {
        let mut model = Model::from_text(GOOD).unwrap();
        change(&mut model);
        let error = model.validate().expect_err(message).to_string();
        assert!(error.contains(message), "{error}\nexpected {message}");
        assert!(model.to_text().is_err());
    }
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0_f64,
        2 => Just(0.0),
        1 => Just(-0.0),
        2 => any::<f64>().prop_filter("finite", |v| v.is_finite()),
        1 => prop_oneof![Just(f64::MAX), Just(f64::MIN_POSITIVE), Just(5e-324), Just(1e17), Just(1e-5)],
    ]
}

fn kernel() -> impl Strategy<Value = Kernel> {
    let gamma = || number().prop_map(f64::abs);
    prop_oneof![
        Just(Kernel::Linear),
        (0..9_u32, gamma(), number()).prop_map(|(degree, gamma, coef0)| Kernel::Polynomial {
            degree,
            gamma,
            coef0
        }),
        gamma().prop_map(|gamma| Kernel::Rbf { gamma }),
        (gamma(), number()).prop_map(|(gamma, coef0)| Kernel::Sigmoid { gamma, coef0 }),
    ]
}

fn model() -> impl Strategy<Value = Model> {
    let svm_type = prop_oneof![
        Just(SvmType::CSvc),
        Just(SvmType::NuSvc),
        Just(SvmType::OneClass),
        Just(SvmType::EpsilonSvr),
        Just(SvmType::NuSvr),
    ];
    (svm_type, kernel(), prop::collection::vec(0..4_usize, 2..5), 1..6_usize, any::<bool>(), any::<i32>())
        .prop_flat_map(|(svm_type, kernel, mut counts, features, probability, label)| {
            if !svm_type.is_classifier() {
                counts.truncate(2);
            }
            let (k, n) = (counts.len(), counts.iter().sum::<usize>());
            let machines = k * (k - 1) / 2;
            let list = |len| prop::collection::vec(number(), len);
            let marks = if svm_type == SvmType::OneClass && probability { 10 } else { 0 };
            let (a, b) = if probability {
                (machines, if svm_type.is_classifier() { machines } else { 0 })
            } else {
                (0, 0)
            };
            // Without vectors a file cannot say how many features there are.
            let features = if n == 0 { 0 } else { features };
            let lists = (list(machines), list(a), list(b), list(marks), list(n * features));
            (lists, prop::collection::vec(list(n), k - 1)).prop_map(move |(lists, coefficients)| Model {
                svm_type,
                kernel,
                labels: (0..if svm_type.is_classifier() { k } else { 0 })
                    .map(|i| label.wrapping_add(i as i32))
                    .collect(),
                class_counts: if svm_type.is_classifier() { counts.clone() } else { Vec::new() },
                rho: lists.0,
                prob_a: lists.1,
                prob_b: lists.2,
                prob_density_marks: lists.3,
                features,
                support_vectors: lists.4,
                coefficients,
            })
        })
}

fn bits(model: &Model) -> Vec<u64> {
    let coefficients = model.coefficients.iter().flatten();
    model.support_vectors.iter().chain(coefficients).chain(&model.rho).map(|v| v.to_bits()).collect()
}

const PIECES: &str = "(?s)(.{0,20}|svm_type c_svc\n|kernel_type rbf\n|gamma .{1,3}\n|nr_class 2\n|total_sv [0-3]\n\
                      |rho 0\n|label 0 1\n|nr_sv [0-2] [0-2]\n|SV\n|[0-9] [0-9]:[0-9]\n){0,14}";

proptest! {
    #[test]
    fn written_and_read_again_it_is_identical(model in model()) {
        let text = model.to_text().unwrap();
        let again = Model::from_text(&text).unwrap();
        prop_assert_eq!(&again, &model);
        prop_assert_eq!(bits(&again), bits(&model));
        prop_assert_eq!(again.to_text().unwrap(), text);
    }

    #[test]
    fn hostile_text_is_an_error_at_most(text in PIECES) {
        let _ = Model::from_text(&text);
    }

    #[test]
    fn a_cut_file_is_an_error(cut in 0..GOOD.len()) {
        prop_assert!(Model::from_text(&GOOD[..cut]).is_err());
    }
}
