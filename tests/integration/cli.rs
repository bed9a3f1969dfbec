//! `compare`, `info`, `completions`, `man`, help, and readers that close the pipe.

use crate::common::{Run, arguments, files, folder, ok, run};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};

/// Two pictures of one scene, `a.exr` and the noisier `b.exr`, and `a.png`.
fn pictures() -> tempfile::TempDir {
    let f = folder();
    ok(f.path(), "render @cornell-box.pbrt --size 32x24 --spp 64 -o a.exr -o a.png --progress none");
    ok(f.path(), "render @cornell-box.pbrt --size 32x24 --spp 4 --seed 3 -o b.exr --progress none");
    f
}

#[test]
fn equal_pictures_have_no_error() {
    let f = pictures();
    let c = ok(f.path(), "compare a.exr a.exr --json").json();
    for key in ["rel_mse", "mse", "signed_bias", "signed_bias_dark"] {
        assert_eq!(c[key], 0.0, "{key}");
    }
    for kind in ["ciede2000", "flip"] {
        for key in ["mean", "p95", "p99", "max"] {
            assert_eq!(c[kind][key], 0.0, "{kind} {key}");
        }
    }
    // Infinite decibels: JSON has no number for that.
    assert_eq!(c.get("psnr"), Some(&Value::Null));
    assert_eq!((&c["compared_pixels"], &c["non_finite_image"]), (&768.into(), &0.into()));
    let text = ok(f.path(), "compare a.exr a.exr").stdout;
    assert!(text.contains("PSNR        inf dB") && text.contains("relMSE      0.000000e0"), "{text}");
}

#[test]
fn noise_has_an_error() {
    let f = pictures();
    let c = ok(f.path(), "compare b.exr a.exr --json").json();
    let number = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{v} in {c}"));
    assert!((1e-3..1.0).contains(&number(&c["rel_mse"])));
    assert!((10.0..40.0).contains(&number(&c["psnr"])));
    assert!(number(&c["flip"]["mean"]) > 0.01 && number(&c["flip"]["max"]) <= 1.0);
    let p = |key: &str| number(&c["ciede2000"][key]);
    assert!(0.0 < p("mean") && p("mean") < p("p95") && p("p95") <= p("p99") && p("p99") <= p("max"));
    // The exposure is the caller's if given, and errors scale with it.
    let brighter = |ev: &str| ok(f.path(), &format!("compare b.exr a.exr --json --exposure {ev}")).json();
    let (one, two) = (brighter("0"), brighter("1"));
    assert_eq!((&one["exposure_scale"], &two["exposure_scale"]), (&1.0.into(), &2.0.into()));
    assert!((number(&two["mse"]) / number(&one["mse"]) - 4.0).abs() < 1e-4);
    // A PNG is compared by its linear values.
    let c = ok(f.path(), "compare a.png a.exr --exposure 0 --json").json();
    assert!(number(&c["psnr"]) > 45.0, "{c}");
}

#[test]
fn error_maps_are_pictures() {
    let f = pictures();
    for kind in ["flip", "ciede2000", "relative"] {
        ok(f.path(), &format!("compare b.exr a.exr --error-map {kind}.png --error-kind {kind}"));
        let map =
            sparing::image::picture::Picture::read(&f.path().join(format!("{kind}.png"))).expect("a PNG");
        assert_eq!((map.width, map.height), (32, 24));
        assert!(map.to_linear().iter().flatten().any(|v| *v > 0.05), "{kind}");
    }
    ok(f.path(), "compare a.exr a.exr --error-map none.png");
    let map = sparing::image::picture::Picture::read(&f.path().join("none.png")).expect("a PNG");
    assert!(map.to_linear().iter().flatten().all(|v| *v == 0.0), "no error is black");
}

#[test]
fn compare_refuses_what_it_cannot_compare() {
    let f = pictures();
    ok(f.path(), "render @cornell-box.pbrt --size 24x32 --spp 1 -o c.exr --progress none");
    std::fs::write(f.path().join("bad.exr"), "no picture").expect("a file");
    let bytes = std::fs::read(f.path().join("a.exr")).expect("a picture");
    std::fs::write(f.path().join("cut.exr"), &bytes[..bytes.len() / 2]).expect("a file");
    let before = files(f.path());
    let says = |line: &str, code: i32, text: &str| {
        let r = run(f.path(), line);
        assert!(r.code == code && r.stderr.starts_with(text), "{line}: {} {}", r.code, r.stderr);
        assert_eq!(r.stdout, "", "{line}");
    };
    says("compare c.exr a.exr", 1, "error: c.exr is 24x32 but a.exr is 32x24\n");
    says("compare no.exr a.exr", 1, "error: cannot read no.exr: No such file or directory (os error 2)\n");
    says("compare a.exr bad.exr", 1, "error: cannot decode bad.exr: ");
    says("compare cut.exr a.exr", 1, "error: cannot decode cut.exr: ");
    says("compare a.exr b.exr --exposure nan", 2, "error: the exposure must be a finite number\n");
    says("compare a.exr b.exr --error-map map.exr", 2, "error: map.exr: error maps are written as .png\n");
    says("compare a.exr b.exr --error-map no/map.png", 1, "error: cannot write no/map.png: No such file");
    says("compare a.exr", 2, "error: the following required arguments were not provided:");
    assert_eq!(files(f.path()), before);
}

#[test]
fn info_of_a_scene() {
    let f = folder();
    let i = ok(f.path(), "info @tests/texture-alpha.pbrt --json").json();
    for (key, value) in
        [("width", 96), ("height", 96), ("spp", 16), ("max_depth", 4), ("instances", 4), ("warnings", 0)]
    {
        assert_eq!(i[key], value, "{key}");
    }
    let names = |key: &str| -> Vec<String> { serde_json::from_value(i[key].clone()).expect("names") };
    assert!(names("needs").contains(&"texture-coordinates".to_owned()));
    assert!(!names("skipped").is_empty());
    assert_eq!((&i["camera"]["projection"], &i["ignored"]), (&"perspective".into(), &serde_json::json!([])));
    for key in [
        "quads",
        "lights",
        "materials",
        "vertices",
        "textures",
        "geometry_bytes",
        "texture_bytes",
        "embree_bytes",
    ] {
        assert!(i[key].as_u64().is_some_and(|n| n > 0), "{key}");
    }
    let text = ok(f.path(), "info @tests/texture-alpha.pbrt").stdout;
    let (needs, skipped) = text.split_once("\nskipped\n").expect("a list of what is skipped");
    assert!(needs.contains("picture    96x96, 16 spp, depth 4\n") && needs.contains("\nneeds\n"));
    for (list, key) in [(needs, "needs"), (skipped, "skipped")] {
        for name in names(key) {
            assert!(
                list.contains(&format!("\n  {name} ")) || list.starts_with(&format!("  {name} ")),
                "{name} in {list}"
            );
        }
    }
}

#[test]
fn completions_and_manual() {
    let f = folder();
    let script = ok(f.path(), "completions bash").stdout;
    assert!(script.contains("complete -F _sparing") && script.contains("--time-limit"));
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        assert!(ok(f.path(), &format!("completions {shell}")).stdout.contains("sparing"), "{shell}");
    }
    assert_eq!(run(f.path(), "completions tcsh").code, 2);
    assert_eq!(ok(f.path(), "man pages/of/mine").stdout, "pages/of/mine\n");
    let pages = files(&f.path().join("pages/of/mine"));
    for page in ["sparing.1", "sparing-render.1", "sparing-compare.1", "sparing-info.1"] {
        assert!(pages.contains(&page.to_owned()), "{page} in {pages:?}");
    }
    let page = std::fs::read_to_string(f.path().join("pages/of/mine/sparing-render.1")).expect("a page");
    assert!(page.contains("time\\-limit"));
    std::fs::write(f.path().join("file"), "").expect("a file");
    let r = run(f.path(), "man file/man");
    assert!(
        r.code == 1 && r.stderr.starts_with("error: cannot write manual pages into file/man: "),
        "{}",
        r.stderr
    );
}

#[test]
fn help_and_version() {
    let f = folder();
    let help = ok(f.path(), "--help").stdout;
    for word in ["render", "compare", "info", "completions", "man", "Exit codes: 0 done"] {
        assert!(help.contains(word), "{word}");
    }
    assert!(ok(f.path(), "--version").stdout.starts_with("sparing 0."));
    assert_eq!(run(f.path(), "").code, 2);
}

/// Runs with standard output (or error) going to something else than a pipe that is read.
fn run_with(folder: &Path, line: &str, out: Stdio, err: Stdio) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sparing"));
    command.current_dir(folder).args(arguments(line)).stdin(Stdio::null()).stdout(out).stderr(err);
    let output = command.output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!stderr.contains("panicked"), "{line}: {stderr}");
    Run { code: output.status.code().expect("no signal"), stdout: String::new(), stderr }
}

/// The writing end of a pipe that nobody reads.
fn closed_pipe() -> Stdio {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

const TALKATIVE: [&str; 9] = [
    "compare a.exr b.exr",
    "compare a.exr b.exr --json",
    "info a.exr",
    "info a.exr --json",
    "info @cornell-box.pbrt",
    "completions bash",
    "man man",
    "render @cornell-box.pbrt --size 8x8 --spp 1 -o c.exr --stats -",
    "render @cornell-box.pbrt --size 8x8 --pixel 1,1 --sample 0",
];

#[test]
fn a_reader_may_leave_early() {
    let f = pictures();
    for line in TALKATIVE {
        let r = run_with(f.path(), line, closed_pipe(), Stdio::piped());
        assert_eq!(r.code, 0, "{line}: {}", r.stderr);
    }
    let line = "render @cornell-box.pbrt --size 8x8 --spp 64 -o d.exr --progress json";
    assert_eq!(run_with(f.path(), line, closed_pipe(), closed_pipe()).code, 0);
    assert_eq!(run_with(f.path(), "render no.pbrt", closed_pipe(), closed_pipe()).code, 1);
    assert!(f.path().join("d.exr").exists());
}

#[test]
fn a_full_disk_behind_standard_output_is_an_error() {
    let f = pictures();
    let full = || match std::fs::OpenOptions::new().write(true).open("/dev/full") {
        Ok(file) => Some(Stdio::from(file)),
        Err(e) => {
            eprintln!("SKIPPED: no /dev/full here: {e}");
            None
        }
    };
    for line in TALKATIVE {
        let Some(out) = full() else { return };
        let r = run_with(f.path(), line, out, Stdio::piped());
        assert_eq!(r.code, 1, "{line}");
        assert!(
            r.stderr.contains("error: cannot write to standard output: No space left"),
            "{line}: {}",
            r.stderr
        );
    }
    // Messages that cannot be written are no reason to lose the picture.
    let Some(err) = full() else { return };
    let r = run_with(f.path(), "render @cornell-box.pbrt --size 8x8 --spp 64 -o d.exr", Stdio::null(), err);
    assert_eq!(r.code, 0);
}
