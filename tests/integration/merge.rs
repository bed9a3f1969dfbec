//! Parts of pictures, put together.

use crate::checkpoint::same;
use crate::common::{Exr, arguments, files, folder, ok, p_value, run};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Renders all parts and merges them.
fn merged(folder: &Path, line: &str, count: u32) -> Exr {
    let mut names = String::new();
    for index in (1..=count).rev() {
        ok(
            folder,
            &format!("{line} --shard {index}/{count} -o part-{index}.exr --threads {}", index % 2 + 1),
        );
        names += &format!(" part-{index}.exr");
    }
    ok(folder, &format!("merge{names} -o merged.exr -o merged.png"));
    Exr::read(&folder.join("merged.exr"))
}

#[test]
fn rows_merge_to_the_picture_bit_for_bit() {
    let exposed = "--judge-exposure 0.5 --threshold 0.15 --max-spp 256";
    for line in [
        "render @cornell-box.pbrt --size 50x45 --spp 20 --layers --progress none".to_owned(),
        "render @cornell-box.pbrt --size 50x77 --crop 3,5,44,70 --spp 8 --progress none".to_owned(),
        "render @tests/small-light.pbrt --size 40x60 --policy shapes --max-spp 32 --progress none".to_owned(),
        format!("render @tests/small-light.pbrt --size 48x160 --policy threshold --progress none {exposed}"),
        format!("render @cornell-box.pbrt --size 96x96 --policy svm --layers --progress none {exposed}"),
        format!("render @cornell-box.pbrt --size 70x66 --policy svm --unbiased --progress none {exposed}"),
    ] {
        let f = folder();
        ok(f.path(), &format!("{line} -o whole.exr"));
        let whole = Exr::read(&f.path().join("whole.exr"));
        for count in [1, 3, 5] {
            assert!(same(&merged(f.path(), &line, count), &whole), "{line} in {count}");
        }
        if line.contains("svm") {
            let n = whole.channel("SampleCount.Y");
            let spread = |r: std::ops::Range<usize>| n[r].iter().any(|v| *v != n[0]);
            assert!(spread(0..n.len() / 3) && spread(n.len() / 2..n.len()), "{line}: {:?}", &n[..64]);
        }
    }
}

#[test]
fn samples_merge_to_the_picture() {
    let f = folder();
    let line = "render @cornell-box.pbrt --size 40x30 --spp 256 --layers --progress none";
    ok(f.path(), &format!("{line} -o whole.exr"));
    let whole = Exr::read(&f.path().join("whole.exr"));
    for count in [1, 2, 5, 8] {
        let merged = merged(f.path(), &format!("{line} --shard-by samples"), count);
        assert_eq!(merged.names(), whole.names());
        for (name, values) in &whole.channels {
            let other = merged.channel(name);
            if ["R", "G", "B", "A", "SampleCount.Y", "Shapes.Y"].contains(&name.as_str()) {
                assert!(other == values, "{name} of {count}");
            } else {
                let near = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= 1e-5 * a.abs().max(1e-6);
                assert!(other.iter().zip(values).all(near), "{name} of {count}");
            }
        }
    }
}

#[test]
fn seeds_are_averaged_by_their_samples() {
    let f = folder();
    let line =
        "render @cornell-box.pbrt --size 40x40 --policy threshold --spp 32 --progress none --shard 1/1";
    let local = "--judge-exposure 0 --threshold 0.1";
    let line = line.replace("--spp 32", local);
    let mut all = Vec::new();
    for seed in 1..=4 {
        ok(f.path(), &format!("{line} --seed {seed} -o {seed}.exr"));
        all.push(Exr::read(&f.path().join(format!("{seed}.exr"))));
    }
    ok(f.path(), "merge 1.exr 2.exr 3.exr 4.exr -o m.exr");
    let m = Exr::read(&f.path().join("m.exr"));
    let mut unequal = false;
    for i in 0..1600 {
        let counts = all.iter().map(|e| f64::from(e.channel("SampleCount.Y")[i]));
        let total: f64 = counts.clone().sum();
        assert_eq!(f64::from(m.channel("SampleCount.Y")[i]), total);
        unequal |= counts.clone().any(|n| 4.0 * n != total);
        let mean = counts.zip(&all).map(|(n, e)| n * f64::from(e.channel("G")[i])).sum::<f64>() / total;
        assert!((f64::from(m.channel("G")[i]) - mean).abs() <= 1e-6 * mean.max(1e-3), "{i}");
    }
    assert!(unequal, "equal counts show nothing");
    ok(f.path(), "render @cornell-box.pbrt --size 40x40 --spp 512 -o r.exr --progress none");
    let p = p_value(m.brightness(), Exr::read(&f.path().join("r.exr")).brightness());
    assert!(p > 1e-4, "{p}");
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let f = folder();
    let line = "render @cornell-box.pbrt --size 24x32 --spp 8 --progress none";
    for i in 1..=3 {
        ok(f.path(), &format!("{line} --shard {i}/3 -o {i}.exr"));
    }
    ok(f.path(), &format!("{line} --shard 3/3 -o again.exr"));
    ok(f.path(), &format!("{line} --shard 1/2 -o half.exr"));
    ok(f.path(), &format!("{line} --seed 3 --shard 1/3 -o seed.exr"));
    ok(f.path(), &line.replace("--spp 8", "--spp 9 --shard 3/3 -o other.exr"));
    ok(f.path(), &format!("{line} -o picture.exr"));
    let long = line.replace("--spp 8", "--spp 500000");
    ok(f.path(), &format!("{long} --checkpoint unfinished.exr --time-limit 50ms -o x.exr"));
    let before = files(f.path());
    for (parts, wanted) in [
        ("1.exr 2.exr", "1 of 3 parts by rows are missing beside 1.exr: 3"),
        ("1.exr 2.exr 3.exr again.exr", "3.exr and again.exr are both part 3 of 3"),
        ("1.exr 2.exr half.exr", "they do not fit together"),
        ("1.exr 2.exr other.exr", "1.exr and other.exr are of different renders"),
        ("1.exr 2.exr 3.exr seed.exr", "2 of 3 parts by rows are missing beside seed.exr: 2, 3"),
        ("1.exr 2.exr picture.exr", "it is a picture, without the sums it was made of"),
        ("unfinished.exr", "unfinished.exr is not finished: it is a checkpoint"),
        ("1.exr 2.exr absent.exr", "cannot read absent.exr"),
    ] {
        let r = run(f.path(), &format!("merge {parts} -o m.exr"));
        assert_eq!(r.code, 1, "{parts}");
        assert!(r.stderr.contains(wanted), "{parts}: {}", r.stderr);
    }
    assert_eq!(files(f.path()), before, "nothing was written");
}

/// A part that was stopped is kept as a checkpoint, and not taken for a part until it is finished.
#[test]
fn a_part_that_was_stopped_is_not_merged_before_it_is_finished() {
    let f = folder();
    let line = "render @cornell-box.pbrt --size 24x32 --spp 200000 --progress none";
    let part = format!("{line} --shard 2/2 -o 2.exr --checkpoint c.exr");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_sparing"));
    command.current_dir(f.path()).args(arguments(&part.replace("--progress none", "--progress json")));
    let mut child = command
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut out = BufReader::new(child.stdout.take().expect("a pipe"));
    let mut line_of_progress = String::new();
    while !line_of_progress.contains("\"samples\":") || line_of_progress.contains("\"samples\":0") {
        line_of_progress.clear();
        assert!(out.read_line(&mut line_of_progress).expect("a line") > 0, "it ended");
    }
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.expect("kill").success());
    let mut rest = String::new();
    out.read_to_string(&mut rest).expect("text");
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert_eq!(files(f.path()), ["c.exr"], "a part that is not finished has no file of its own");
    let r = run(f.path(), "merge c.exr -o m.exr");
    assert_eq!((r.code, files(f.path())), (1, vec!["c.exr".to_owned()]));
    let wanted = "error: c.exr is not finished: it is a checkpoint, to go on from with --resume\n";
    assert_eq!(r.stderr, wanted);
}

#[test]
fn shards_that_cannot_be_are_refused() {
    let f = folder();
    let render = "render @cornell-box.pbrt --size 24x32 --progress none -o a.exr";
    for (more, wanted) in [
        ("--shard 0/3", "there is no part 0 of 3"),
        ("--shard 4/3", "there is no part 4 of 3"),
        ("--shard x", "expected I/N"),
        ("--shard 1/5", "4 rows of tiles cannot be split in 5"),
        ("--shard 1/2 --heat-map h.png", "for whole pictures"),
        ("--shard 1/2 --time-limit 5s", "a time limit would leave parts"),
        ("--shard 1/8 --shard-by samples --spp 64", "64 samples cannot be split in 8"),
        ("--shard 1/9 --shard-by samples --spp 4096", "there can be 8 shards at most"),
        ("--shard 1/2 --policy svm --spp 64", "give --threshold"),
        ("--shard 1/2 --policy svm --threshold 0.1", "and --judge-exposure"),
        ("--shard 1/2 --policy shapes --shard-by samples", "for the policy uniform"),
        ("--shard-by samples", "--shard"),
        ("--shard 1/2 -o b.png", "one .exr file"),
        ("--threshold 0.1", "is for adaptive policies"),
        ("--policy svm --threshold -1", "above 0"),
    ] {
        let r = run(f.path(), &format!("{render} {more}"));
        assert_eq!(r.code, 2, "{more}: {}", r.stderr);
        let said = r.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains(wanted), "{more}: {}", r.stderr);
    }
    assert!(files(f.path()).is_empty());
}

#[test]
fn parts_report_progress_for_farms() {
    let f = folder();
    let r =
        ok(f.path(), "render @cornell-box.pbrt --size 64x64 --spp 64 --shard 1/2 -o a.exr --progress alf");
    let lines: Vec<&str> = r.stdout.lines().collect();
    assert_eq!(lines.last(), Some(&"ALF_PROGRESS 100%"));
    let value = |l: &&str| l.strip_prefix("ALF_PROGRESS ")?.strip_suffix('%')?.parse::<u32>().ok();
    let values: Vec<u32> = lines.iter().map(value).collect::<Option<_>>().expect("nothing else");
    assert!(values.windows(2).all(|v| v[0] <= v[1]), "{values:?}");
}
