//! `sparing tradeoff`: what it writes, what it picks, what it refuses.

use super::common::{ok, run};
use sparing::svm::data::Data;
use sparing::svm::{Model, Parameters};
use std::fs;
use std::path::Path;
use testkit::svm_data::pixels;

/// A small machine and data of its kind, as `m.model` and `data`.
fn prepare(folder: &Path) -> Model {
    let training = pixels(500, 1);
    let data = Data::new(training.features, training.rows, training.labels).unwrap();
    let model = Parameters::rbf(10.0, 0.5).train(&data).unwrap();
    model.write(folder.join("m.model")).unwrap();
    fs::write(folder.join("data"), pixels(1500, 2).to_text()).unwrap();
    model
}

const QUICK: &str = "--methods drop,greedy-fit,kmeans-labels,retrain --sizes 8,32";

#[test]
fn everything_is_written_and_the_pick_is_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let full = prepare(folder.path());
    let r = ok(folder.path(), &format!("tradeoff m.model --data data {QUICK} -o out --max-loss 5"));
    assert!(r.stdout.contains("750 rows measured") && r.stdout.contains("picked "), "{}", r.stdout);
    let out = folder.path().join("out");
    let csv = fs::read_to_string(out.join("tradeoff.csv")).unwrap();
    assert_eq!(csv.lines().count(), 2 + 8 + 1, "{csv}");
    assert!(csv.lines().any(|l| l.starts_with("certified,") && l.split(',').nth(7) == Some("0")), "{csv}");
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("tradeoff.json")).unwrap()).unwrap();
    assert_eq!(json["source"], "data");
    assert_eq!(json["full"]["vectors"], full.len());
    let svg = fs::read_to_string(out.join("tradeoff.svg")).unwrap();
    assert!(svg.contains("accuracy on held-out rows (%)") && svg.contains("certified cascade"));
    assert!(fs::read(out.join("tradeoff.png")).unwrap().starts_with(b"\x89PNG"));
    let picked = Model::read(out.join("picked.model")).unwrap();
    assert!(picked.len() < full.len() && picked.features == full.features);
    let left: Vec<_> = fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 5, "{left:?}");
}

#[test]
fn a_model_alone_says_that_labels_were_not_given() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let r = ok(folder.path(), "tradeoff m.model --methods greedy --sizes 16 -o out --pick 16 --threads 1");
    assert!(r.stdout.contains("no labels given"), "{}", r.stdout);
    let svg = fs::read_to_string(folder.path().join("out/tradeoff.svg")).unwrap();
    assert!(svg.contains("agreement with the full machine"));
    assert!(Model::read(folder.path().join("out/picked.model")).unwrap().len() <= 16);
}

#[test]
fn mistakes_get_one_clear_line_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    fs::write(folder.path().join("labels"), "1 1:0.5\n7 1:0.1\n").unwrap();
    for (line, code, words) in [
        ("tradeoff m.model --methods kmeans-labels -o out", 2, "needs labelled data"),
        ("tradeoff m.model --methods magic -o out", 2, "there is no method 'magic'"),
        ("tradeoff m.model --sizes 0 -o out", 2, "not a number of vectors"),
        ("tradeoff m.model --pick 8 --max-loss 1 -o out", 2, "cannot be used with"),
        ("tradeoff m.model --max-loss -1 -o out", 2, "percentage points"),
        ("tradeoff m.model --range r -o out", 2, "--data"),
        ("tradeoff missing.model -o out", 1, "missing.model"),
        ("tradeoff m.model --data missing -o out", 1, "missing"),
        ("tradeoff data -o out", 1, "data:1"),
        ("tradeoff m.model --data labels -o out", 1, "label 7"),
        ("tradeoff m.model --methods drop --sizes 8 --max-loss 0 -o out", 1, "nothing was written"),
    ] {
        let r = run(folder.path(), line);
        assert_eq!(r.code, code, "{line}: {}", r.stderr);
        assert!(r.stderr.contains(words), "{line}: {}", r.stderr);
        assert!(code == 2 || r.stderr.lines().count() == 1, "{line}: {}", r.stderr);
        let written = fs::read_dir(folder.path().join("out")).map_or(0, Iterator::count);
        assert_eq!(written, 0, "{line}");
    }
}
