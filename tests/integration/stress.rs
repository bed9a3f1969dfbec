//! The stress suite in its quick form.

use crate::common::{folder, ok, run};

#[test]
fn all_cases_hold() {
    let f = folder();
    let r = ok(f.path(), "stress --quick --report out");
    assert!(r.stderr.contains("cases hold"), "{}", r.stderr);
    let csv = std::fs::read_to_string(f.path().join("out/stability.csv")).expect("a table");
    assert!(csv.lines().count() > 45, "{csv}");
    assert!(csv.lines().skip(1).all(|l| l.ends_with(",true")), "{csv}");
    let page = std::fs::read_to_string(f.path().join("out/stability.md")).expect("a page");
    assert!(page.starts_with("# Numerical stability") && page.contains("| leaks-robust |"), "{page}");
}

#[test]
fn a_part_can_be_chosen_and_nothing_is_not_a_success() {
    let f = folder();
    let r = ok(f.path(), "stress --quick --only ciede2000-published");
    assert!(r.stderr.contains("all 1 cases hold"), "{}", r.stderr);
    let r = run(f.path(), "stress --quick --only nonsense");
    assert_eq!(r.code, 1);
    assert!(r.stderr.contains("no case has a name with \"nonsense\""), "{}", r.stderr);
}
