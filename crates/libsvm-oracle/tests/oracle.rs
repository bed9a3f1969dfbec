//! The bridge itself: known values, errors, threads. Skipped where libSVM is not installed.

use libsvm_oracle::{Oracle, OracleError, Query, is_available, version};

const MODEL: &str = "svm_type c_svc\nkernel_type rbf\ngamma 0.5\nnr_class 2\ntotal_sv 2\nrho 0.25\nlabel 7 -3\n\
                     nr_sv 1 1\nSV\n1 1:1 \n-1 3:2 \n";

fn skip() -> bool {
    if !is_available() {
        eprintln!("skipped: libSVM is not installed");
    }
    !is_available()
}

#[test]
fn known_values() {
    if skip() {
        return;
    }
    assert!((300..400).contains(&version().unwrap()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m");
    std::fs::write(&path, MODEL).unwrap();
    let oracle = Oracle::load(&path).unwrap();
    assert_eq!((oracle.labels(), oracle.machines(), oracle.support_vectors()), ([7, -3].as_slice(), 1, 2));
    let expected = (-0.5_f64).exp() - (-2.0_f64).exp() - 0.25;
    let query = [0.0, 0.0, 0.0];
    assert!((oracle.decision_values(&query)[0] - expected).abs() < 1e-15);
    assert_eq!(oracle.predict(&query), 7.0);
    let mut values = [0.0];
    assert_eq!(oracle.evaluate(&Query::new(&[0.0, 0.0, 2.0]), &mut values), -3.0);
    // Any number of threads may ask.
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| (0..1000).for_each(|_| assert_eq!(oracle.predict(&query), 7.0)));
        }
    });
}

#[test]
fn malformed_models_do_not_reach_libsvm() {
    if skip() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m");
    std::fs::write(&path, MODEL.replace("total_sv 2", "total_sv 1000000")).unwrap();
    assert!(matches!(Oracle::load(&path), Err(OracleError::Model(_))));
    assert!(matches!(Oracle::load(folder.path().join("none")), Err(OracleError::Model(_))));
}
