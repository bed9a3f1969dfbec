//! Data files and range files: every way to get one wrong, and what is written reads back the same.

use proptest::prelude::*;
use sparing_svm::data::{DataLimits, DataOptions, DataReader, DataWriter};
use sparing_svm::range::{Interval, Scaling, TargetScaling};
use sparing_svm::{Data, SvmError};

fn data(text: &str) -> Result<Data, SvmError> {
    Data::read_from(text.as_bytes(), "d", &DataOptions::default())
}

fn range(text: &str) -> Result<Scaling, SvmError> {
    Scaling::read_from(text.as_bytes(), "r", None)
}

#[test]
fn reads_data_with_comments_and_omitted_zeros() {
    let text = "# a comment\n+1 1:0.5 3:-2 # more\n\n-1\n2.5\t2:1e-3\r\n0 3:0";
    let data = data(text).unwrap();
    assert_eq!((data.len(), data.features), (4, 3));
    assert_eq!(data.labels, [1.0, -1.0, 2.5, 0.0]);
    assert_eq!(data.rows, [0.5, 0.0, -2.0, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 0.0]);
    let rows: Vec<_> =
        DataReader::new(text.as_bytes(), "d", &DataOptions::default()).map(Result::unwrap).collect();
    assert_eq!(rows[0].features, [(1, 0.5), (3, -2.0)]);
    assert_eq!(rows.len(), 4);
}

#[test]
fn data_errors() {
    let cases = [
        ("1 1:1\nx 1:1\n", "d:2:1: the label is not a number: \"x\""),
        ("1 1:1\nnan\n", "d:2:1: the label is not finite: \"nan\""),
        ("1:1 2:2\n", "d:1:1: the line has no label"),
        ("1 qid:3 1:1\n", "d:1:3: qid is for ranking, which is not supported; remove it"),
        ("1 1:1 1:2\n", "d:1:7: feature 1 occurs twice"),
        ("1 2:1 1:2\n", "d:1:7: feature indices must ascend within a line: 1 comes after 2"),
        ("1 0:1\n", "d:1:3: feature indices begin at 1, found 0"),
        ("1 1:inf\n", "d:1:5: the value of feature 1 is not finite: \"inf\""),
        ("1 1:1e400\n", "d:1:5: the value of feature 1 is too large for a double: \"1e400\""),
        ("1 1:\n", "d:1:5: the value of feature 1 is not a number: \"\""),
        ("1 1\n", "d:1:3: expected index:value, found \"1\""),
        ("1 9999999:1\n", "d:1:3: feature 9999999 is beyond the limit of features, 1000000"),
        ("1 99999999999999999999:1\n", "d:1:3: the feature index is out of range: \"99999999999999999999\""),
    ];
    for (text, message) in cases {
        assert_eq!(data(text).expect_err(message).to_string(), message);
        let mut reader = DataReader::new(text.as_bytes(), "d", &DataOptions::default());
        assert_eq!(reader.find_map(Result::err).expect(message).to_string(), message);
        assert!(reader.next().is_none(), "nothing after an error");
    }
    let limits = DataLimits { rows: 1, ..DataLimits::default() };
    let error =
        Data::read_from(&b"1 1:1\n1 1:1\n"[..], "d", &DataOptions { features: None, limits }).unwrap_err();
    assert_eq!(error.to_string(), "d:2: more rows than the limit of 1");
    let limits = DataLimits { values: 5, ..DataLimits::default() };
    let error =
        Data::read_from(&b"1 1:1\n1 3:1\n"[..], "d", &DataOptions { features: None, limits }).unwrap_err();
    assert_eq!(error.to_string(), "d:2: the data need more than the limit of 5 values: 2 rows of 3 features");
    let options = DataOptions { features: Some(2), ..DataOptions::default() };
    let error = Data::read_from(&b"1 1:1\n1 3:1\n"[..], "d", &options).unwrap_err();
    assert_eq!(error.to_string(), "d:2:3: feature 3 is beyond the number of features, 2");
}

#[test]
fn hand_built_data_are_checked() {
    let cases = [
        (Data::new(2, vec![0.0; 3], vec![1.0]), "3 values for 1 rows of 2 features"),
        (Data::new(2, vec![0.0, 0.0, f64::NAN, 0.0], vec![1.0; 2]), "feature 1 of row 1 is not finite: NaN"),
        (Data::new(1, vec![0.0], vec![f64::INFINITY]), "the label of row 0 is not finite: inf"),
        (Data::new(usize::MAX, vec![0.0], vec![0.0; 2]), "1 values for 2 rows of"),
    ];
    for (result, message) in cases {
        let error = result.expect_err(message).to_string();
        assert!(error.contains(message), "{error}");
    }
    for (weights, message) in [
        (vec![1.0], "1 weights for 2 rows"),
        (vec![1.0, 0.0], "the weight of row 1 must be positive and finite: 0"),
        (vec![-1.0, 1.0], "the weight of row 0 must be positive and finite: -1"),
        (vec![1.0, f64::NAN], "the weight of row 1 must be positive and finite: NaN"),
    ] {
        let data = Data { features: 0, rows: vec![], labels: vec![1.0, 2.0], weights: Some(weights) };
        let error = data.validate().expect_err(message).to_string();
        assert!(error.contains(message), "{error}");
    }
    let mut writer = DataWriter::new(Vec::new(), "w", 2);
    assert!(
        writer.write_row(1.0, &[1.0]).unwrap_err().to_string().contains("row 0 has 1 values instead of 2")
    );
    assert!(writer.write_row(f64::NAN, &[1.0, 1.0]).is_err());
    assert!(writer.write_row(1.0, &[1.0, f64::NAN]).is_err());
    writer.write_row(1.0, &[1.0, 0.0]).unwrap();
    writer.write_row(2.0, &[0.0, 0.0]).unwrap();
    assert_eq!(writer.into_inner(), b"1 1:1 2:0\n2\n");
}

#[test]
fn reads_and_applies_a_range() {
    let scaling = range("y\n0 1\n-5 5\nx\n-1 1\n1 0 10\n3 -2 2\n").unwrap();
    assert_eq!((scaling.lower, scaling.upper), (-1.0, 1.0));
    assert_eq!(scaling.features[1], None);
    let mut row = [2.5, 7.0, 2.0];
    scaling.apply(&mut row).unwrap();
    assert_eq!(row, [-0.5, 0.0, 1.0]);
    assert_eq!(scaling.apply_target(0.0), 0.5);
    assert_eq!(scaling.restore_target(0.5), 0.0);
    let error = scaling.apply(&mut [0.0; 2]).unwrap_err();
    assert!(error.to_string().contains("a row of 2 features, and the scaling is for 3"), "{error}");
    assert!(scaling.apply_data(Data::new(1, vec![0.0], vec![0.0]).unwrap()).is_err());
    let longer = Scaling::read_from(&b"x\n-1 1\n1 0 10\n"[..], "r", Some(3)).unwrap();
    assert_eq!(longer.features, [Some(Interval { min: 0.0, max: 10.0 }), None, None]);
}

#[test]
fn range_errors() {
    let cases = [
        ("", "r:1: the file ends where \"x\" or \"y\" is expected"),
        ("z\n", "r:1: expected \"x\" or \"y\", found \"z\""),
        ("x\n", "r:1: the file ends before the lower end"),
        ("x\n0\n", "r:2: expected the lower end and the upper end, found 1 numbers"),
        ("x\n1 0\n", "r:2: the range [1, 0] is empty or not finite"),
        ("x\n1 1\n", "r:2: the range [1, 1] is empty or not finite"),
        ("x\n0 inf\n", "r:2:3: the upper end is not finite: \"inf\""),
        ("x\n0 1\n1 2\n", "r:3: expected index, smallest and largest value, found 2 words"),
        ("x\n0 1\n0 2 3\n", "r:3:1: feature indices begin at 1, found 0"),
        ("x\n0 1\n2 2 3\n2 2 3\n", "r:4:1: feature 2 comes after feature 2"),
        ("x\n0 1\n2 2 3\n1 2 3\n", "r:4:1: feature 1 comes after feature 2"),
        ("x\n0 1\n1 3 2\n", "r:3: feature 1: the smallest value, 3, is above the largest, 2"),
        ("x\n0 1\n1 -1e308 1e308\n", "r:3: feature 1 spans more than a double can hold"),
        ("x\n0 1\n1 a 2\n", "r:3:3: the smallest value is not a number: \"a\""),
        ("x\n0 1\n1000001 1 2\n", "r:3:1: feature 1000001 is beyond the limit of features, 1000000"),
        ("x\n0 1\n1 1 2", "r:3: the file ends in the middle of a line: it was cut short"),
        ("x\n0 1\n\n", "r:3: expected index, smallest and largest value, found 0 words"),
        ("y\n0 1\n", "r:2: the file ends before the smallest label"),
        ("y\n0 1\n2 1\nx\n0 1\n", "r:3: the label: the smallest value, 2, is above the largest, 1"),
        ("y\n0 1\n1 2\n", "r:3: the file ends where \"x\" is expected"),
        ("y\n0 1\n1 2\ny\n0 1\n", "r:4: expected the line \"x\", found \"y\""),
    ];
    for (text, message) in cases {
        let error = range(text).expect_err(message).to_string();
        assert!(error.starts_with(message), "{error}\nexpected {message}");
    }
    let error = Scaling::read_from(&b"x\n0 1\n3 1 2\n"[..], "r", Some(2)).unwrap_err();
    assert_eq!(error.to_string(), "r:3:1: feature 3 is beyond the number of features, 2");
    assert!(Scaling::read_from(&b"x\n0 1\n"[..], "r", Some(usize::MAX)).is_err());
}

#[test]
fn fits() {
    let data = Data::new(2, vec![1.0, 5.0, 3.0, 5.0, 2.0, 5.0], vec![1.0, 2.0, 4.0]).unwrap();
    let scaling = Scaling::fit(&data, 0.0, 1.0).unwrap().with_target(&data, -1.0, 1.0).unwrap();
    assert_eq!(scaling.features, [Some(Interval { min: 1.0, max: 3.0 }), None]);
    let scaled = scaling.apply_data(data.clone()).unwrap();
    assert_eq!(scaled.rows, [0.0, 0.0, 1.0, 0.0, 0.5, 0.0]);
    assert_eq!(scaled.labels[0], -1.0);
    assert!(Scaling::fit(&data, 1.0, 1.0).is_err());
    assert!(Scaling::fit(&Data::default(), 0.0, 1.0).unwrap_err().to_string().contains("there is no row"));
    let wide = Data::new(1, vec![1e308, -1e308], vec![0.0, 1.0]).unwrap();
    let error = Scaling::fit(&wide, 0.0, 1.0).unwrap_err();
    assert!(error.to_string().contains("feature 1 spans more than a double can hold"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.range");
    scaling.write(&path).unwrap();
    assert_eq!(Scaling::read(&path, Some(2)).unwrap(), scaling);
    let path = folder.path().join("a.data");
    data.write(&path).unwrap();
    assert_eq!(Data::read(&path, &DataOptions::default()).unwrap(), data);
    assert!(Data::read(folder.path().join("none"), &DataOptions::default()).is_err());
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![-5.0..5.0_f64, Just(0.0), Just(-0.0), any::<f64>().prop_filter("finite", |v| v.is_finite())]
}

fn interval() -> impl Strategy<Value = Interval> {
    (-1e300..1e300_f64, -300..300_i32).prop_map(|(min, exponent)| {
        let max = min + 10_f64.powi(exponent);
        Interval { min, max }
    })
}

/// Rows of 1 to 4 features with their labels.
fn table() -> impl Strategy<Value = (usize, Vec<(f64, Vec<f64>)>)> {
    let rows = |features| prop::collection::vec((finite(), prop::collection::vec(finite(), features)), 1..6);
    (1..5_usize).prop_flat_map(move |features| (Just(features), rows(features)))
}

const PIECES: &str = "(?s)(.{0,12}|[xy]\n|[0-9]+ [0-9]:[0-9.e-]{1,3}\n|[0-9] [0-9] [0-9]\n){0,8}";

proptest! {
    #[test]
    fn data_round_trip((features, rows) in table()) {
        let labels = rows.iter().map(|r| r.0).collect();
        let data = Data::new(features, rows.into_iter().flat_map(|r| r.1).collect(), labels).unwrap();
        let text = data.to_text().unwrap();
        let again = Data::read_from(text.as_bytes(), "d", &DataOptions::default()).unwrap();
        let bits = |d: &Data| d.rows.iter().chain(&d.labels).map(|v| v.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&again), bits(&data));
        prop_assert_eq!(again.features, features);
    }

    #[test]
    fn range_round_trip(
        target in prop::option::of(interval()),
        features in prop::collection::vec(prop::option::of(interval()), 0..6),
    ) {
        let features: Vec<_> = features.into_iter().map(|r| r.filter(|r| r.min != r.max)).collect();
        let count = features.len();
        let target = target.map(|data| TargetScaling { lower: -1e-300, upper: 0.1, data });
        let scaling = Scaling { lower: -1.0, upper: 1.0 / 3.0, features, target };
        let text = scaling.to_text().unwrap();
        prop_assert_eq!(Scaling::read_from(text.as_bytes(), "r", Some(count)).unwrap(), scaling);
    }

    #[test]
    fn hostile_text_is_an_error_at_most(text in PIECES) {
        let _ = data(&text);
        let _ = range(&text);
    }
}
