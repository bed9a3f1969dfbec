//! Model cards: round trip, and every refusal.

use std::collections::BTreeMap;
use std::path::PathBuf;

use proptest::prelude::*;
use sparing_svm::card::{CARD_FORMAT, Card, CardScaling};
use sparing_svm::range::{Interval, Scaling};
use sparing_svm::{Model, SvmError};

const MODEL: &str = "svm_type c_svc\nkernel_type rbf\ngamma 0.5\nnr_class 2\ntotal_sv 1\nrho 0\nlabel 1 2\n\
                     nr_sv 1 0\nSV\n1 1:1 \n";

fn card() -> Card {
    Card {
        format: CARD_FORMAT,
        sha256: "0".repeat(64),
        features: ["mean", "variance", "depth"].map(String::from).to_vec(),
        label: "the error is above its median".to_owned(),
        data: vec!["three scenes at 8 samples".to_owned()],
        licence: "CC0-1.0".to_owned(),
        command: "train --c 1 \"quoted\"".to_owned(),
        seed: 7,
        scaling: Some(CardScaling {
            lower: 0.0,
            upper: 1.0,
            min: vec![0.0, 1e-300, 2.0],
            max: vec![1.0, 0.1 + 0.2, 2.0],
        }),
        metrics: BTreeMap::from([("accuracy".to_owned(), 1.0 / 3.0), ("support vectors".to_owned(), 1.0)]),
    }
}

fn files() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.model");
    std::fs::write(&path, MODEL).unwrap();
    (folder, path)
}

#[test]
fn written_and_read_again() {
    let (_folder, path) = files();
    let mut written = card();
    written.write(&path).unwrap();
    assert!(path.with_extension("model.toml").is_file());
    let (model, read) = Model::read_with_card(&path, &["mean", "variance", "depth"]).unwrap();
    assert_eq!(read, written);
    // Feature 3 is zero in all vectors: the card knows of it.
    assert_eq!((model.features, model.support_vectors), (3, vec![1.0, 0.0, 0.0]));
    let scaling = read.scaling().unwrap();
    assert_eq!(scaling.features[1], Some(Interval { min: 1e-300, max: 0.1 + 0.2 }));
    assert_eq!(scaling.features[2], None);
    assert_eq!(CardScaling::from(&Scaling { features: vec![None], ..scaling }).min, [0.0]);
}

#[test]
fn another_model_file_is_refused() {
    let (_folder, path) = files();
    card().write(&path).unwrap();
    std::fs::write(&path, MODEL.replace("1:1", "1:2")).unwrap();
    let error = Card::read(&path).unwrap_err();
    assert!(error.to_string().contains("the card is for another model file: its sha256 is "), "{error}");
    std::fs::remove_file(Card::path(&path)).unwrap();
    assert!(matches!(Card::read(&path), Err(SvmError::Io { action: "read", .. })));
    assert!(card().write(path.with_extension("none")).is_err());
}

#[test]
fn other_features_are_refused() {
    let cases: [(&[&str], &str); 6] = [
        (&["mean", "variance"], "the model needs depth"),
        (&["mean", "variance", "depth", "normal"], "it does not know normal"),
        (&["mean", "variance", "normal"], "the model needs depth; it does not know normal"),
        (
            &["variance", "mean", "depth"],
            "feature 1 is \"mean\" in the model and \"variance\" here: the order differs",
        ),
        (&["mean", "variance", "depth", "depth"], "the model has 3 features, here are 4"),
        (&[], "the model needs mean, variance, depth"),
    ];
    for (names, message) in cases {
        let error = card().check_features(names).expect_err(message).to_string();
        assert!(error.contains(&format!("the features differ: {message}")), "{error}");
    }
    let (_folder, path) = files();
    card().write(&path).unwrap();
    assert!(Model::read_with_card(&path, &["mean"]).unwrap_err().to_string().contains("the features differ"));
}

#[test]
fn malformed_cards() {
    let good = card().to_text().unwrap();
    let hash = "0".repeat(64);
    let cases = [
        ("format = 1", "format = 2", "c: format 2 is not known; this version reads 1"),
        ("format = 1", "format = -1", "c:1:10: "),
        ("format = 1", "format = ", "c:1:10: "),
        ("format = 1", "format = 1\nformat = 1", "c:2:1: duplicate key"),
        ("format = 1", "format = 1\nweather = 1", "c:2:1: unknown field `weather`"),
        ("seed = 7\n", "", "c:1:1: missing field `seed`"),
        (hash.as_str(), "ABC", "c: sha256 must be 64 lower-case hexadecimal digits"),
        ("\"depth\"", "\"mean\"", "c: feature \"mean\" occurs twice"),
        ("\"depth\"", "\" \"", "c: a feature has no name"),
        ("[\"mean\", \"variance\", \"depth\"]", "[]", "c: there are no features"),
        ("accuracy = 0.3333333333333333", "accuracy = nan", "c: the metric \"accuracy\" is not finite: NaN"),
        ("upper = 1.0", "upper = 0.0", "c: scaling: the data cannot be used: the range [0, 0] is empty"),
        ("min = [0.0, ", "min = [", "c: scaling.min has 2 values for 3 features"),
        ("min = [0.0, ", "min = [inf, ", "c: scaling.min of \"mean\" is not finite: inf"),
        (
            "min = [0.0, ",
            "min = [3.0, ",
            "c: scaling: the data cannot be used: feature 1: the smallest value, 3",
        ),
    ];
    for (from, to, message) in cases {
        assert!(good.contains(from), "{from:?} is not in\n{good}");
        let error = Card::from_text(&good.replacen(from, to, 1), "c").expect_err(message).to_string();
        assert!(error.starts_with(message), "{error}\nexpected {message}");
    }
    let mut large = card();
    large.seed = u64::MAX;
    assert!(large.to_text().unwrap_err().to_string().contains("the seed is beyond what TOML can hold"));
}

fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("finite", |v| v.is_finite())
}

proptest! {
    #[test]
    fn text_round_trip(
        label in any::<String>(),
        names in prop::collection::btree_set("[ -~äβ]{0,6}x", 1..5),
        metrics in prop::collection::btree_map(any::<String>(), finite(), 0..4),
        seed in 0..=i64::MAX as u64,
    ) {
        let card = Card { label, features: names.into_iter().collect(), metrics, seed, scaling: None, ..card() };
        prop_assert_eq!(Card::from_text(&card.to_text().unwrap(), "c").unwrap(), card);
    }
}
