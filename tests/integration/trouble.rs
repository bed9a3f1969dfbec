//! Checkpoints where disks, folders and clocks fail: what was there survives, and the render can go on from it.

use crate::checkpoint::same;
use crate::common::{Exr, arguments, files, folder, ok, run};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Its checkpoints take 0.6 MB.
const LINE: &str = "render @cornell-box.pbrt --size 48x40 --spp 800 --progress none";

/// Starts one that takes some seconds: with one thread.
fn start(folder: &Path, line: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sparing"));
    command.current_dir(folder).args(arguments(line)).args(["--threads", "1"]).stdin(Stdio::null());
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts")
}

/// Exit code and standard error.
fn end(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!said.contains("panicked"), "{said}");
    (output.status.code(), said)
}

fn terminate(child: &Child) {
    let status = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(status.expect("kill").success());
}

fn wait_for(file: &Path, child: &mut Child) {
    let begin = Instant::now();
    while !file.exists() {
        assert!(child.try_wait().expect("a status").is_none(), "it ended without {}", file.display());
        assert!(begin.elapsed() < Duration::from_secs(60), "no {}", file.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// A disk of its own, in memory.
struct Disk(PathBuf);

impl Disk {
    /// `None`, said on standard error, where this user may not mount.
    fn new(path: PathBuf, size: &str) -> Option<Self> {
        std::fs::create_dir(&path).expect("a folder");
        let options = format!("size={size}");
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &options, "none"]).arg(&path).output();
        if mounted.is_ok_and(|o| o.status.success()) {
            return Some(Self(path));
        }
        eprintln!("SKIPPED: a small disk cannot be mounted here");
        None
    }

    fn remount(&self, options: &str) {
        let options = format!("remount,{options}");
        let status = Command::new("mount").args(["-o", &options]).arg(&self.0).status();
        assert!(status.expect("mount").success(), "{options}");
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

/// The picture of a render that nothing happens to.
fn undisturbed(folder: &Path) -> Exr {
    ok(folder, &format!("{LINE} -o whole.exr"));
    Exr::read(&folder.join("whole.exr"))
}

#[test]
fn a_disk_that_fills_up_keeps_the_checkpoint_before() {
    let f = folder();
    // Room for one checkpoint, but not for the next one beside it.
    let Some(disk) = Disk::new(f.path().join("disk"), "900k") else { return };
    let whole = undisturbed(f.path());
    let line = format!("{LINE} -o a.exr --checkpoint disk/c.exr --checkpoint-interval 50ms");
    let mut child = start(f.path(), &line);
    wait_for(&f.path().join("disk/c.exr"), &mut child);
    std::thread::sleep(Duration::from_millis(150));
    let first = std::fs::metadata(disk.0.join("c.exr")).expect("a checkpoint").modified().expect("a time");
    terminate(&child);
    let (code, said) = end(child);
    // The end without a checkpoint of it is an error, and the picture so far is there.
    assert_eq!(code, Some(1), "{said}");
    let warning = "warning: no checkpoint: cannot write disk/c.exr: No space left on device (os error 28)";
    assert_eq!(said.matches(warning).count(), 1, "{said}");
    assert!(said.ends_with("error: the checkpoint could not be written\n"), "{said}");
    assert!(f.path().join("a.exr").exists());
    assert_eq!(files(&disk.0), ["c.exr"]);
    let now = std::fs::metadata(disk.0.join("c.exr")).expect("a checkpoint").modified().expect("a time");
    assert_eq!(first, now, "the first one is still there");
    disk.remount("size=8m");
    let r = ok(f.path(), &format!("{line} --resume"));
    assert!(!r.stderr.contains("from the beginning"), "{}", r.stderr);
    assert!(same(&Exr::read(&f.path().join("a.exr")), &whole));
    assert!(files(&disk.0).is_empty());
}

#[test]
fn a_disk_that_becomes_read_only_keeps_the_checkpoint() {
    let f = folder();
    let Some(disk) = Disk::new(f.path().join("disk"), "8m") else { return };
    let whole = undisturbed(f.path());
    let line = format!("{LINE} -o a.exr --checkpoint disk/c.exr --checkpoint-interval 50ms");
    // From the start.
    disk.remount("ro");
    let r = run(f.path(), &line);
    assert_eq!(r.code, 1, "{}", r.stderr);
    assert_eq!(r.stderr, "error: cannot write disk/c.exr.lock: Read-only file system (os error 30)\n");
    disk.remount("rw");
    // Between two runs: files that are open for writing keep a disk from becoming read-only.
    let mut child = start(f.path(), &line);
    wait_for(&f.path().join("disk/c.exr"), &mut child);
    terminate(&child);
    let (code, said) = end(child);
    assert_eq!(code, Some(130), "{said}");
    disk.remount("ro");
    let r = run(f.path(), &format!("{line} --resume"));
    assert_eq!((r.code, r.stderr.contains("Read-only file system")), (1, true), "{}", r.stderr);
    assert_eq!(files(&disk.0), ["c.exr"]);
    disk.remount("rw");
    ok(f.path(), &format!("{line} --resume"));
    assert!(same(&Exr::read(&f.path().join("a.exr")), &whole));
}

/// As a network folder that is lost: checkpoints stop, the render does not.
#[test]
fn a_folder_that_is_lost_does_not_end_the_render() {
    let f = folder();
    let whole = undisturbed(f.path());
    let away = f.path().join("away");
    std::fs::create_dir(&away).expect("a folder");
    let line = format!("{LINE} -o a.exr --checkpoint away/c.exr --checkpoint-interval 30ms");
    let mut child = start(f.path(), &line);
    wait_for(&away.join("c.exr"), &mut child);
    std::fs::rename(&away, f.path().join("lost")).expect("it is moved");
    let (code, said) = end(child);
    assert_eq!(code, Some(0), "{said}");
    let warning = "warning: no checkpoint: cannot write away/c.exr: No such file or directory (os error 2)";
    assert_eq!(said.matches(warning).count(), 1, "{said}");
    assert!(same(&Exr::read(&f.path().join("a.exr")), &whole));
    // What was there when the folder was lost can be gone on from.
    std::fs::remove_file(f.path().join("a.exr")).expect("a picture");
    ok(f.path(), &format!("{} --resume", line.replace("away/", "lost/")));
    assert!(same(&Exr::read(&f.path().join("a.exr")), &whole));
}

/// The folder of the picture is lost: an error, and all of the render is in the checkpoint.
#[test]
fn a_picture_that_cannot_be_written_leaves_a_checkpoint_of_the_end() {
    let f = folder();
    let whole = undisturbed(f.path());
    let away = f.path().join("away");
    std::fs::create_dir(&away).expect("a folder");
    let line = format!("{LINE} -o away/a.exr --checkpoint c.exr --checkpoint-interval 1h --stats s.json");
    let mut child = start(f.path(), &line);
    wait_for(&f.path().join("c.exr.lock"), &mut child);
    std::thread::sleep(Duration::from_millis(100));
    std::fs::remove_dir(&away).expect("it is empty");
    let (code, said) = end(child);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot write away/a.exr: No such file or directory"), "{said}");
    assert!(said.contains("the render is in c.exr: --resume goes on from it"), "{said}");
    let kept = Exr::read(&f.path().join("c.exr"));
    assert!(kept.channel("SampleCount.Y").iter().all(|n| *n == 800.0), "not all samples are kept");
    std::fs::create_dir(&away).expect("a folder");
    ok(f.path(), &format!("{line} --resume"));
    assert!(same(&Exr::read(&away.join("a.exr")), &whole));
    let text = std::fs::read_to_string(f.path().join("s.json")).expect("statistics");
    let statistics: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(statistics["samples"], 48 * 40 * 800, "nothing was rendered again: {statistics}");
    assert!(!f.path().join("c.exr").exists());
}

#[test]
fn the_second_process_takes_nothing_from_the_first() {
    let f = folder();
    let whole = undisturbed(f.path());
    let line = format!("{LINE} -o a.exr --checkpoint c.exr --checkpoint-interval 30ms --resume");
    let mut first = start(f.path(), &line);
    wait_for(&f.path().join("c.exr"), &mut first);
    for _ in 0..3 {
        let r = run(f.path(), &line.replace("a.exr", "b.exr"));
        assert_eq!(r.code, 1);
        assert_eq!(r.stderr, "error: another process renders with the checkpoint c.exr\n");
    }
    first.kill().expect("it dies");
    end(first);
    assert!(f.path().join("c.exr").exists());
    ok(f.path(), &line);
    assert!(same(&Exr::read(&f.path().join("a.exr")), &whole));
    assert!(!f.path().join("b.exr").exists());
}

/// Wall clock times that jump by a year at every look, there and back.
const JUMPING_CLOCK: &str = r#"
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>
static long jump(void) { static long n; return (++n & 1 ? 1 : -1) * 31536000L; }
int clock_gettime(clockid_t clock, struct timespec *t) {
    int status = syscall(SYS_clock_gettime, clock, t);
    if (clock != CLOCK_MONOTONIC) t->tv_sec += jump();
    return status;
}
time_t time(time_t *out) {
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    if (out) *out = t.tv_sec;
    return t.tv_sec;
}
int gettimeofday(struct timeval *restrict t, void *restrict zone) {
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    t->tv_sec = now.tv_sec;
    t->tv_usec = now.tv_nsec / 1000;
    return 0;
}
"#;

#[test]
fn a_clock_that_jumps_changes_nothing() {
    let f = folder();
    std::fs::write(f.path().join("clock.c"), JUMPING_CLOCK).expect("a file");
    let mut compiler = Command::new("cc");
    compiler.current_dir(f.path()).args(["-shared", "-fPIC", "-o", "clock.so", "clock.c"]);
    if !compiler.status().is_ok_and(|s| s.success()) {
        eprintln!("SKIPPED: no C compiler here");
        return;
    }
    let library = f.path().join("clock.so");
    let year = |preload: &str| {
        let output = Command::new("date").arg("+%s").env("LD_PRELOAD", preload).output().expect("date");
        String::from_utf8_lossy(&output.stdout).trim().parse::<i64>().expect("seconds") / 15_000_000
    };
    let preload = library.to_str().expect("a name");
    assert_ne!(year(preload), year(""), "the clock does not jump");
    let whole = undisturbed(f.path());
    let go = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sparing"));
        command.current_dir(f.path()).args(arguments(line)).env("LD_PRELOAD", preload);
        let begin = Instant::now();
        let output = command.output().expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{said}");
        begin.elapsed()
    };
    // Neither at once nor a year later.
    let long = LINE.replace("--spp 800", "--spp 1000000");
    let line = format!("{long} -o b.exr --checkpoint d.exr --checkpoint-interval 200ms --time-limit 1s");
    let took = go(&line);
    assert!(took > Duration::from_millis(900) && took < Duration::from_secs(30), "{took:?}");
    let count = Exr::read(&f.path().join("d.exr")).channel("SampleCount.Y").iter().sum::<f32>();
    assert!(count > 1000.0, "{count} samples");
    // Checkpoints come neither all the time nor never, and the picture is the same.
    go(&format!("{LINE} -o a.exr --checkpoint c.exr --checkpoint-interval 20ms"));
    assert!(same(&Exr::read(&f.path().join("a.exr")), &whole));
}
