//! `sparing study`: what it writes, what it keeps, what it refuses.

use super::common::{arguments, files, folder, ok, run};
use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

const TINY: &str = "study @cornell-box.pbrt --size 24x24 --levels 8 --max-spp 16 --reference-spp 64 -o out";

#[test]
fn everything_is_written_and_found_again() {
    let folder = folder();
    let r = ok(folder.path(), &format!("{TINY} --threads 1"));
    assert!(
        r.stdout.contains("at the error of uniform 8 spp") && r.stdout.contains("half-buffer"),
        "{}",
        r.stdout
    );
    assert!(r.stderr.contains("reference of 64 spp rendered") && r.stderr.contains("left"), "{}", r.stderr);
    let out = folder.path().join("out");
    let expected = [
        "index.html",
        "pictures",
        "plots",
        "references",
        "renders",
        "study.csv",
        "study.json",
        "summary.csv",
        "summary.png",
        "summary.svg",
    ];
    assert_eq!(files(&out), expected);
    assert_eq!(files(&out.join("plots")).len(), 10);

    let csv = fs::read_to_string(out.join("study.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let spp = |policy: &str| -> Vec<f64> {
        rows.iter().filter(|r| r[3] == policy).map(|r| r[9].parse().unwrap()).collect()
    };
    assert_eq!(spp("uniform"), [8.0, 16.0]);
    assert!(spp("half-buffer").iter().all(|n| *n == 16.0), "{csv}");
    assert!(spp("shapes")[1] < 16.0 && spp("threshold").len() >= 3);

    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("study.json")).unwrap()).unwrap();
    assert_eq!(json["scenes"][0]["renders"].as_array().unwrap().len(), rows.len() - 1);
    assert_eq!(json["summary"][0]["policy"], "uniform");
    // In samples: two renders of milliseconds may well take the same time.
    let own = json["summary"][0]["spp"][0]["value"].as_f64().unwrap();
    assert!((own - 1.0).abs() < 1e-9, "uniform over itself: {own}");

    // One file: nothing is loaded from anywhere else.
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert_eq!((page.matches("<svg").count(), page.matches("data:image/png;base64,").count()), (6, 2));
    for foreign in ["src=\"http", "href=", "<script", "url("] {
        assert!(!page.contains(foreign), "{foreign}");
    }

    // Again: the reference is found anyway, renders on request.
    let again = ok(folder.path(), &format!("{TINY} --threads 1 --resume"));
    assert!(again.stderr.contains("reference of 64 spp found"), "{}", again.stderr);
    assert_eq!(again.stderr.matches(", found").count(), rows.len() - 1, "{}", again.stderr);
    assert_eq!(again.stdout, r.stdout, "the same renders, the same numbers");
    let other = ok(folder.path(), &format!("{TINY} --threads 1 --resume --seed 1 --policies uniform"));
    assert!(other.stderr.contains("reference of 64 spp rendered") && !other.stderr.contains(", found"));
}

#[test]
fn several_seeds_are_averaged() {
    let folder = folder();
    let out = folder.path().join("out");
    let errors = |seeds: u32| -> Vec<f64> {
        ok(folder.path(), &format!("{TINY} --policies uniform --seeds {seeds}"));
        let text = fs::read_to_string(out.join("study.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["seeds"], seeds);
        let renders = json["scenes"][0]["renders"].as_array().unwrap();
        assert_eq!(
            renders.iter().map(|r| r["average_spp"].as_f64().unwrap()).collect::<Vec<_>>(),
            [8.0, 16.0]
        );
        renders.iter().map(|r| r["rel_mse"].as_f64().unwrap()).collect()
    };
    let picture = || fs::read(out.join("renders/cornell-box/uniform-spp-16.exr")).unwrap();
    let (one, first) = (errors(1), picture());
    let (two, same) = (errors(2), picture());
    assert!(first == same, "the picture is that of the first seed");
    assert!(one.iter().zip(&two).all(|(a, b)| a != b && *b > 0.5 * a), "{one:?} {two:?}");
}

#[test]
fn a_broken_cache_is_rendered_again() {
    let folder = folder();
    let line = format!("{TINY} --policies uniform");
    ok(folder.path(), &line);
    let out = folder.path().join("out");
    fs::write(out.join("references/cornell-box.exr"), b"not a picture").unwrap();
    fs::write(out.join("renders/cornell-box/uniform-spp-8.json"), b"{").unwrap();
    let r = ok(folder.path(), &format!("{line} --resume"));
    assert!(r.stderr.contains("reference of 64 spp rendered"), "{}", r.stderr);
    assert_eq!(r.stderr.matches(", found").count(), 1, "{}", r.stderr);
}

#[test]
fn an_interrupt_keeps_what_is_finished() {
    let folder = folder();
    let line = TINY.replace("--max-spp 16", "--max-spp 1000000 --resume");
    let mut child = Command::new(env!("CARGO_BIN_EXE_sparing"))
        .current_dir(folder.path())
        .args(arguments(&line))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut text = String::new();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    while !text.contains("uniform spp-16 ") {
        assert!(stderr.read_line(&mut text).unwrap() > 0, "it ended early: {text}");
    }
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    while stderr.read_line(&mut text).unwrap() > 0 {}
    assert_eq!(child.wait().unwrap().code(), Some(130), "{text}");
    assert!(text.contains("--resume goes on"), "{text}");
    let out = folder.path().join("out");
    assert!(!out.join("index.html").exists());
    let kept = files(&out.join("renders/cornell-box"));
    assert!(kept.contains(&"uniform-spp-16.json".to_owned()), "{kept:?}");
    assert!(kept.iter().all(|f| !f.ends_with(".tmp")), "{kept:?}");
}

#[test]
fn mistakes_get_one_clear_line() {
    let folder = folder();
    for (line, code, part) in [
        (
            "study @cornell-box.pbrt -o out --levels 4",
            2,
            "the level 4 must lie between 8 samples and --max-spp 4096",
        ),
        ("study @cornell-box.pbrt -o out --max-spp 128", 2, "the level 256 must lie between"),
        ("study @cornell-box.pbrt -o out --seeds 0", 2, "--seeds"),
        ("study missing.pbrt -o out", 1, "missing.pbrt"),
        ("study @cornell-box.pbrt -o out --policies best", 2, "half-buffer"),
        ("study -o out", 2, "SCENES"),
    ] {
        let r = run(folder.path(), line);
        assert_eq!(r.code, code, "{line}: {}", r.stderr);
        assert!(r.stderr.contains(part), "{line}: {}", r.stderr);
        assert!(!folder.path().join("out").exists(), "{line}");
    }
    fs::write(folder.path().join("file"), "").unwrap();
    let r = run(folder.path(), &TINY.replace("-o out", "-o file"));
    assert!(r.code == 1 && r.stderr.contains("cannot make the folder"), "{}", r.stderr);
}
