//! `sparing train`, and rendering with what it made.

use super::common::{ok, run};
use std::fs;

const TINY: &str = "train --scenes 3 --rows 200 --scene-rows 100 --replicates 2 --reference 64 --max-spp 64 \
                    --size-scale 0.15 --vectors 24 --seed 5";

#[test]
fn a_tiny_run_gives_a_machine_that_renders_and_is_the_same_again() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let r = ok(folder, &format!("{TINY} --threads 1 -o a.model"));
    assert!(r.stderr.contains("3 of 3: training-02-window-room"), "{}", r.stderr);
    assert!(r.stdout.contains("cross-validation accuracy"), "{}", r.stdout);
    // From the start with other threads, and from the rows that were kept: the same bits.
    ok(folder, &format!("{TINY} --threads 2 -o b.model"));
    let bytes = |name: &str| fs::read(folder.join(name)).unwrap();
    assert!(bytes("a.model") == bytes("b.model"));
    for scene in 0..3 {
        let rows = |model: &str| bytes(&format!("{model}.model.rows/scene-{scene:04}.rows"));
        assert!(rows("a") == rows("b"));
    }
    fs::remove_file(folder.join("a.model")).unwrap();
    let r = ok(folder, &format!("{TINY} -o a.model"));
    assert_eq!(r.stderr.matches("kept").count(), 3, "{}", r.stderr);
    assert!(bytes("a.model") == bytes("b.model"));

    let card = fs::read_to_string(folder.join("a.model.toml")).unwrap();
    assert!(card.contains("--seed 5 -o a.model") && card.contains("log-gain"), "{card}");
    let picture = "render @tests/small-light.pbrt --size 24x24 --spp 16 --max-spp 64 --progress none";
    let r = ok(folder, &format!("{picture} --policy svm --model a.model -o out.exr --stats -"));
    assert_eq!(r.json()["policy"], "svm");

    // There is one in the program.
    let r = ok(folder, &format!("{picture} --policy svm -o out.exr --stats -"));
    assert_eq!(r.json()["policy"], "svm");

    // A model whose card is for another file, or not there, is refused.
    fs::write(folder.join("b.model"), [bytes("b.model"), b"\n".to_vec()].concat()).unwrap();
    let r = run(folder, &format!("{picture} --policy svm --model b.model -o out.exr"));
    assert!(r.code == 1 && r.stderr.contains("another model file"), "{r:?}");
}

#[test]
fn wrong_usage_is_said_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("train", 2, "--output"),
        ("train -o a.model --scenes 1", 2, "1 is not in 2..=10000"),
        ("train -o a.model --label shoe", 2, "is not a label"),
        ("train -o a.model --size-scale 0", 2, "not a factor"),
        ("train -o no/such/folder/a.model", 1, "no/such/folder"),
        ("render @cornell-box.pbrt --policy svm --model none.model", 1, "none.model"),
        ("render @cornell-box.pbrt --model none.model", 2, "--model is for --policy svm"),
    ];
    for (line, code, message) in cases {
        let r = run(folder.path(), line);
        assert!(r.code == code && r.stderr.contains(message), "{line}: {r:?}");
    }
}
