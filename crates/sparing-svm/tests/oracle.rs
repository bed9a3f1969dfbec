//! Decision values and scaling against libSVM's own: stored ones everywhere (written by
//! `scripts/svm-test-data.sh`), the installed library where there is one.
//!
//! Values must agree to 1e-10: absolutely where libSVM's value is below 1 in magnitude, relative to it above.
//! Never relative to the sum of the terms, which would hide cancellation.

use std::path::{Path, PathBuf};
use std::process::Command;

use libsvm_oracle::{Oracle, Query};
use sparing_svm::data::DataOptions;
use sparing_svm::model::ReadOptions;
use sparing_svm::{Data, Model, Scaling};
use testkit::svm_data::{SvmData, blobs, curve, pixels};

const KERNELS: [&str; 4] = ["linear", "polynomial", "rbf", "sigmoid"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

/// The name of every stored model, and its queries.
fn stored() -> Vec<(String, &'static str)> {
    let mut names = Vec::new();
    for kernel in KERNELS {
        for svm_type in ["c_svc", "nu_svc"] {
            names.extend([2, 4].map(|classes| (format!("{svm_type}-{kernel}-{classes}"), "blobs.queries")));
        }
        names.push((format!("one_class-{kernel}"), "blobs.queries"));
        names.extend(["epsilon_svr", "nu_svr"].map(|t| (format!("{t}-{kernel}"), "curve.queries")));
    }
    names
}

#[track_caller]
fn close(ours: f64, theirs: f64, what: &str) {
    let error = (ours - theirs).abs() / theirs.abs().max(1.0);
    assert!(error <= 1e-10, "{what}: {ours} instead of {theirs}, off by {error:e}");
}

#[test]
fn decision_values_equal_the_stored_ones() {
    for (name, queries) in stored() {
        let queries = Data::read(folder().join(queries), &DataOptions::default()).unwrap();
        let options = ReadOptions { features: Some(queries.features), ..ReadOptions::default() };
        let model = Model::read_with(folder().join(format!("{name}.model")), &options).unwrap();
        let values = std::fs::read_to_string(folder().join(format!("{name}.values"))).unwrap();
        assert_eq!(values.lines().count(), queries.len());
        let mut out = vec![0.0; model.machines()];
        for (row, line) in values.lines().enumerate() {
            let theirs: Vec<f64> = line.split(' ').map(|v| v.parse().unwrap()).collect();
            model.decision_values(queries.row(row), &mut out);
            assert_eq!(theirs.len(), out.len() + 1);
            for (ours, theirs) in out.iter().zip(&theirs[1..]) {
                close(*ours, *theirs, &format!("{name}, row {row}"));
            }
            close(model.prediction(&out), theirs[0], &format!("prediction of {name}, row {row}"));
        }
    }
}

#[test]
fn stored_models_survive_a_round_trip() {
    for (name, _) in stored() {
        let model = Model::read(folder().join(format!("{name}.model"))).unwrap();
        let text = model.to_text().unwrap();
        assert_eq!(Model::from_text(&text).unwrap(), model);
    }
}

/// svm-scale's output has six digits, and leaves zeros out.
#[test]
fn scaling_equals_svm_scale() {
    let read = |name: &str, features| {
        Data::read(folder().join(name), &DataOptions { features, ..DataOptions::default() }).unwrap()
    };
    let (input, output) = (read("scale-input.txt", None), read("scale-output.txt", Some(9)));
    let first = input.select(&(0..20).collect::<Vec<_>>());
    let fitted = Scaling::fit(&first, -1.0, 1.0).unwrap().with_target(&first, 0.0, 1.0).unwrap();
    let stored = Scaling::read(folder().join("scale-range.txt"), Some(9)).unwrap();
    assert_eq!(fitted, stored);
    assert_eq!(stored.features[8], None);
    let ours = stored.apply_data(input).unwrap();
    for (i, (a, b)) in ours.rows.iter().zip(&output.rows).enumerate() {
        assert!((a - b).abs() <= 0.5e-5 * b.abs().max(0.1), "row {} feature {}: {a} {b}", i / 9, i % 9 + 1);
    }
    assert_eq!(ours.labels, output.labels);
}

fn installed() -> bool {
    let installed = libsvm_oracle::is_available() && Command::new("svm-train").output().is_ok();
    if !installed {
        eprintln!("skipped: libSVM is not installed");
    }
    installed
}

fn check_live(made: &SvmData, queries: &SvmData, options: &str, work: &Path) {
    let (data, path) = (work.join("data"), work.join("model"));
    std::fs::write(&data, made.to_text()).unwrap();
    let status =
        Command::new("svm-train").args(["-q"]).args(options.split(' ')).args([&data, &path]).status();
    assert!(status.unwrap().success(), "{options}");
    let read = ReadOptions { features: Some(made.features), ..ReadOptions::default() };
    let model = Model::read_with(&path, &read).unwrap();
    // What we write is what libSVM reads: both files give the same values.
    let again = work.join("again");
    model.write(&again).unwrap();
    let (oracle, rewritten) = (Oracle::load(&path).unwrap(), Oracle::load(&again).unwrap());
    assert_eq!(oracle.labels(), model.labels);
    assert_eq!(oracle.support_vectors(), model.len());
    let (mut ours, mut theirs, mut second) =
        (vec![0.0; model.machines()], vec![0.0; model.machines()], vec![0.0; model.machines()]);
    for i in 0..queries.len() {
        let query = Query::new(queries.row(i));
        model.decision_values(queries.row(i), &mut ours);
        let prediction = oracle.evaluate(&query, &mut theirs);
        for (a, b) in ours.iter().zip(&theirs) {
            close(*a, *b, options);
        }
        close(model.prediction(&ours), prediction, options);
        assert_eq!(rewritten.evaluate(&query, &mut second), prediction);
        assert_eq!(second, theirs, "{options}: libSVM reads something else from what we wrote");
    }
}

#[test]
fn decision_values_equal_the_installed_library() {
    if !installed() {
        return;
    }
    let work = tempfile::tempdir().unwrap();
    let two = blobs(150, 6, 2, 11).with_zeros(0.3, 1);
    let four = blobs(200, 6, 4, 12).with_zeros(0.3, 2);
    let values = curve(150, 6, 13).with_zeros(0.3, 3);
    let queries = blobs(300, 6, 2, 14).with_zeros(0.3, 4);
    for kernel in 0..4 {
        let common = format!("-t {kernel} -g 0.75 -r 0.5 -d 4 -n 0.25 -c 2");
        for svm_type in 0..5 {
            let options = format!("-s {svm_type} {common}");
            check_live(if svm_type < 3 { &two } else { &values }, &queries, &options, work.path());
            if svm_type < 2 {
                check_live(&four, &queries, &options, work.path());
            }
        }
    }
    // Probabilities in the file do not change decisions.
    check_live(&four, &queries, "-b 1 -g 0.75", work.path());
    check_live(&values, &queries, "-s 3 -b 1 -g 0.75", work.path());
}

#[test]
fn large_coefficients_and_extreme_gammas() {
    if !installed() {
        return;
    }
    let work = tempfile::tempdir().unwrap();
    let (data, queries) = (pixels(400, 21), pixels(300, 22));
    for options in
        ["-g 1 -c 100000 -e 0.1", "-g 1e-12 -c 1", "-g 1000000000000 -c 1", "-t 1 -g 8 -d 9 -c 1e-6 -e 0.1"]
    {
        check_live(&data, &queries, options, work.path());
    }
}
