//! Renders that stop, however they stop, go on to the same picture.

use crate::common::{Exr, arguments, files, folder, ok, root, run};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Each takes a second or so.
const RENDERS: [&str; 3] = [
    "render @cornell-box.pbrt --size 64x56 --spp 1500 --layers -o a.exr --progress none",
    "render @cornell-box.pbrt --size 96x80 --policy svm --spp 300 --max-spp 4096 -o a.exr --progress none",
    "render @tests/small-light.pbrt --size 64x60 --policy threshold --tolerance 0.08 --max-spp 8192 --layers -o a.exr --progress none",
];

/// All channels, by their bits: depth is infinite where nothing is.
pub fn same(a: &Exr, b: &Exr) -> bool {
    let bits = |e: &Exr| {
        let channel =
            |(name, v): &(String, Vec<f32>)| (name.clone(), v.iter().map(|x| x.to_bits()).collect());
        e.channels.iter().map(channel).collect::<Vec<(String, Vec<u32>)>>()
    };
    (a.size, a.origin, a.display) == (b.size, b.origin, b.display) && bits(a) == bits(b)
}

/// Runs for so long and kills it, as a power cut would. Whether it had ended by itself.
fn killed(folder: &Path, line: &str, after: Duration) -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sparing"));
    command.current_dir(folder).args(arguments(line)).stdin(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().expect("it starts");
    std::thread::sleep(after);
    let ended = child.try_wait().expect("a status").is_some();
    child.kill().expect("it dies");
    child.wait().expect("a status");
    ended
}

#[test]
fn killed_renders_go_on_to_the_same_picture() {
    for (k, line) in RENDERS.into_iter().enumerate() {
        let f = folder();
        ok(f.path(), line);
        let at_once = Exr::read(&f.path().join("a.exr"));
        std::fs::remove_file(f.path().join("a.exr")).expect("it is there");
        let line = format!("{line} --checkpoint c.exr --checkpoint-interval 20ms --resume");
        let mut kept = 0;
        for attempt in 0..6 {
            // Some kills come before the first sample, some in the middle of a checkpoint.
            let ended = killed(f.path(), &line, Duration::from_millis(40 + 97 * attempt + 31 * k as u64));
            kept += u32::from(f.path().join("c.exr").exists());
            if ended {
                break;
            }
        }
        assert!(kept > 0, "{line}: no checkpoint was left behind");
        ok(f.path(), &format!("{line} --threads 1"));
        assert!(same(&Exr::read(&f.path().join("a.exr")), &at_once), "{line}");
        // Kills leave temporary files, whose names say so; checkpoint and lock are gone.
        let left: Vec<_> = files(f.path()).into_iter().filter(|n| !n.ends_with(".tmp")).collect();
        assert!(left == ["a.exr"] || left == ["a.exr", "c.exr.lock"], "{left:?}");
    }
}

#[test]
fn a_checkpoint_is_a_picture() {
    let f = folder();
    let line = format!("{} --checkpoint c.exr --time-limit 400ms", RENDERS[1].replace("300", "4000"));
    let r = ok(f.path(), &line);
    assert!(f.path().join("c.exr").exists(), "{}", r.stderr);
    let picture = Exr::read(&f.path().join("c.exr"));
    assert_eq!(picture.size, [96, 80]);
    assert!(picture.channel("R").iter().any(|v| *v > 0.1));
    assert!(picture.channel("SampleCount.Y").iter().any(|v| *v > 0.0));
    let said = run(f.path(), &format!("{} --checkpoint c.exr", RENDERS[1]));
    assert_eq!(said.code, 1);
    assert!(said.stderr.contains("c.exr is there from an earlier render: say --resume"), "{}", said.stderr);
}

#[test]
fn other_renders_are_refused_and_the_checkpoint_survives() {
    let f = folder();
    let first = "render @cornell-box.pbrt --size 32x32 --policy threshold --spp 64 -o a.exr --progress none --checkpoint c.exr";
    ok(f.path(), &format!("{first} --time-limit 30ms"));
    let before = std::fs::read(f.path().join("c.exr")).expect("a checkpoint");
    std::fs::write(f.path().join("own.model"), "svm_type c_svc\n").expect("it is written");
    for (change, wanted) in [
        (first.replace("--spp 64", "--spp 65"), "goal: Average(64.0) there, Average(65.0) here"),
        (format!("{first} --seed 7"), "seed: 0 there, 7 here"),
        (first.replace("threshold", "svm"), "policy: threshold there, svm here"),
        (format!("{first} --max-spp 128"), "max-spp: 512 there, 128 here"),
        (format!("{first} --layers"), "layers: "),
        (first.replace("32x32", "32x31"), "crop: 0,0,32,32 there, 0,0,32,31 here"),
        (first.replace("@cornell-box.pbrt", "@tests/small-light.pbrt"), "scene: "),
        (format!("{first} --max-depth 3"), "max-depth: "),
    ] {
        let r = run(f.path(), &format!("{change} --resume"));
        assert_eq!(r.code, 1, "{change}");
        assert!(r.stderr.contains("c.exr is of another render") && r.stderr.contains(wanted), "{}", r.stderr);
        assert!(before == std::fs::read(f.path().join("c.exr")).expect("it is there"), "{change}");
    }
    // A line of a comment, and another place, are the same scene.
    let text = std::fs::read_to_string(root().join("scenes/cornell-box.pbrt")).expect("the scene");
    std::fs::write(f.path().join("moved.pbrt"), format!("# a comment\n{text}")).expect("it is written");
    ok(f.path(), &format!("{} --resume", first.replace("@cornell-box.pbrt", "moved.pbrt")));
    assert!(!f.path().join("c.exr").exists());
}

#[test]
fn damaged_checkpoints_are_refused() {
    let f = folder();
    let line = "render @cornell-box.pbrt --size 32x32 --spp 6400 -o a.exr --progress none --checkpoint c.exr";
    ok(f.path(), &format!("{line} --time-limit 50ms"));
    let whole = std::fs::read(f.path().join("c.exr")).expect("a checkpoint");
    for length in [0, 3, 100, 5000, whole.len() / 2, whole.len() - 1] {
        std::fs::write(f.path().join("c.exr"), &whole[..length]).expect("it is written");
        let r = run(f.path(), &format!("{line} --resume"));
        assert_eq!(r.code, 1, "{length}");
        assert!(r.stderr.contains("c.exr"), "{}", r.stderr);
    }
    std::fs::copy(f.path().join("a.exr"), f.path().join("c.exr")).expect("it is copied");
    let r = run(f.path(), &format!("{line} --resume"));
    assert!(r.stderr.contains("it is a picture, without the sums it was made of"), "{}", r.stderr);
    let r = run(f.path(), "render @cornell-box.pbrt -o a.exr --resume");
    assert_eq!(r.code, 2, "{}", r.stderr);
    let r = run(f.path(), "render @cornell-box.pbrt -o a.exr --checkpoint c.png");
    assert_eq!(r.code, 2, "{}", r.stderr);
    let r = run(f.path(), "render @cornell-box.pbrt -o a.exr --checkpoint none/c.exr");
    assert_eq!(r.code, 1, "{}", r.stderr);
}

#[test]
fn two_processes_do_not_share_a_checkpoint() {
    let f = folder();
    let line =
        "render @cornell-box.pbrt --size 64x64 --spp 1000000 -o a.exr --progress none --checkpoint c.exr";
    let mut command = Command::new(env!("CARGO_BIN_EXE_sparing"));
    let mut first = command.current_dir(f.path()).args(arguments(line)).spawn().expect("it starts");
    while !f.path().join("c.exr.lock").exists() {
        assert!(first.try_wait().expect("a status").is_none(), "it ended");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(50)); // between the file and its lock
    let r = run(f.path(), &line.replace("a.exr", "b.exr"));
    first.kill().expect("it dies");
    first.wait().expect("a status");
    assert_eq!(r.code, 1);
    assert!(r.stderr.contains("another process renders with the checkpoint c.exr"), "{}", r.stderr);
}
