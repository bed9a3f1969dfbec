//! Signals: what is there is saved, and nothing half-done stays.

use crate::common::{Exr, Run, arguments, files, folder};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A render of hours.
const LONG: &str = "render @cornell-box.pbrt --size 96x96 --spp 1000000 -o a.exr -o a.png --stats s.json";
/// The same with a machine that decides.
const LONG_SVM: &str = "render @cornell-box.pbrt --size 96x96 --policy svm --tolerance 1e-9 --max-spp 1000000 -o a.exr -o a.png --stats s.json";

fn start(folder: &Path, line: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sparing"));
    command.current_dir(folder).args(arguments(line)).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
}

/// Sends a signal by name, by the shell's own `kill`.
fn signal(child: &Child, name: &str) {
    let command = format!("kill -{name} {}", child.id());
    assert!(Command::new("sh").args(["-c", &command]).status().expect("a shell").success());
}

/// Waits until a progress line reports samples.
fn wait_for_samples(child: &mut Child) -> BufReader<std::process::ChildStdout> {
    let mut out = BufReader::new(child.stdout.take().expect("a pipe"));
    loop {
        let mut line = String::new();
        assert!(out.read_line(&mut line).expect("a line") > 0, "it ended before it began");
        let event: serde_json::Value = serde_json::from_str(&line).expect("JSON");
        if event["samples"].as_u64().is_some_and(|n| n > 0) {
            return out;
        }
    }
}

/// Waits for the end, for a minute at most.
fn end(mut child: Child, mut out: impl Read) -> Run {
    let begin = Instant::now();
    while child.try_wait().expect("a status").is_none() {
        if begin.elapsed() > Duration::from_secs(60) {
            child.kill().expect("it dies");
            panic!("it does not stop");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let (mut stdout, mut stderr) = (String::new(), String::new());
    out.read_to_string(&mut stdout).expect("text");
    child.stderr.take().expect("a pipe").read_to_string(&mut stderr).expect("text");
    assert!(!stderr.contains("panicked"), "{stderr}");
    // -1: ended by a signal.
    Run { code: child.wait().expect("a status").code().unwrap_or(-1), stdout, stderr }
}

#[test]
fn interrupted_renders_save_what_they_have() {
    for (name, line) in [("INT", LONG), ("TERM", LONG), ("INT", LONG_SVM)] {
        let f = folder();
        let mut child = start(f.path(), &format!("{line} --progress json"));
        let out = wait_for_samples(&mut child);
        let begin = Instant::now();
        signal(&child, name);
        let r = end(child, out);
        assert!(begin.elapsed() < Duration::from_secs(20), "{name}: it took {:?}", begin.elapsed());
        assert_eq!(r.code, 130, "{name}: {}", r.stderr);
        let last = r.stdout.lines().last().expect("lines");
        assert_eq!(last, r#"{"event":"done","stopped_by":"interrupt"}"#, "{name}");

        assert_eq!(files(f.path()), ["a.exr", "a.png", "s.json"], "{name}");
        let text = std::fs::read_to_string(f.path().join("s.json")).expect("statistics");
        let s: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(s["stopped_by"], "interrupt", "{name}");
        let picture = Exr::read(&f.path().join("a.exr"));
        let counts = picture.channel("SampleCount.Y");
        let total: f64 = counts.iter().map(|c| f64::from(*c)).sum();
        assert_eq!(s["samples"].as_f64(), Some(total), "{name}");
        assert!(total > 0.0 && counts.iter().all(|c| *c < 1e6), "{name}");
        assert!(picture.channel("R").iter().all(|v| v.is_finite()), "{name}");
        assert!(picture.brightness().0 > 0.01, "{name}");
    }
}

#[test]
fn people_are_told() {
    let f = folder();
    let mut child = start(f.path(), LONG);
    let mut err = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    err.read_line(&mut line).expect("a line of progress");
    assert!(line.contains("pixels active"), "{line}");
    signal(&child, "INT");
    let mut rest = String::new();
    err.read_to_string(&mut rest).expect("text");
    assert!(rest.ends_with("stopped by interrupt; the picture so far is saved\n"), "{rest}");
    assert_eq!(child.wait().expect("a status").code(), Some(130));
}

#[test]
fn a_killed_render_leaves_the_old_picture() {
    let f = folder();
    std::fs::write(f.path().join("a.exr"), "old").expect("a file");
    let mut child = start(f.path(), &format!("{LONG} --progress json"));
    let out = wait_for_samples(&mut child);
    child.kill().expect("it dies");
    assert_eq!(end(child, out).code, -1);
    assert_eq!(files(f.path()), ["a.exr"]);
    assert_eq!(std::fs::read(f.path().join("a.exr")).expect("a file"), b"old");
}

/// Killed while it writes: the name holds nothing, or all of it.
#[test]
fn a_kill_while_writing_leaves_no_partial_picture() {
    let f = folder();
    // Nothing but emission, to write soon; large, to write long.
    let line = "render @cornell-box.pbrt --size 1800x1800 --spp 1 --max-depth 0 -o a.exr --progress json";
    let mut child = start(f.path(), line);
    let out = child.stdout.take().expect("a pipe");
    let begin = Instant::now();
    let finished = loop {
        // Those of the check before rendering are empty.
        let growing = std::fs::read_dir(f.path()).expect("a folder").flatten().any(|e| {
            e.file_name().to_string_lossy().ends_with(".tmp") && e.metadata().is_ok_and(|m| m.len() > 0)
        });
        if growing {
            child.kill().expect("it dies");
            break false;
        }
        if child.try_wait().expect("a status").is_some() {
            break true;
        }
        assert!(begin.elapsed() < Duration::from_secs(60), "nothing is written");
    };
    let r = end(child, out);
    if f.path().join("a.exr").exists() {
        // The machine was faster than the test.
        assert_eq!(Exr::read(&f.path().join("a.exr")).size, [1800, 1800]);
    } else {
        assert!(!finished && r.code == -1, "{} {}", r.code, r.stderr);
        assert!(
            files(f.path()).iter().all(|n| n.starts_with(".a.exr.") && n.ends_with(".tmp")),
            "{:?}",
            files(f.path())
        );
    }
}
