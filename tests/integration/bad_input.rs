//! Bad input: one clear message each, the right exit code, no file under the final name.
//!
//! The messages are in `snapshots/`. What can be said about every one of them is checked by [`refuse`].

use crate::common::{Exr, Run, arguments, files, folder, ok, run, scene};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// A camera, a light and a place for a shape.
fn scene_of(shape: &str) -> String {
    format!(
        "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n\
         Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8 \"string filename\" \"out.exr\"\n\
         WorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n{shape}\n"
    )
}

/// The exit code and standard error of a command that must fail: it says `error: ` once, at the start, and writes
/// nothing. `out.exr` exists before and is as it was after.
pub fn refuse(folder: &Path, line: &str) -> Run {
    std::fs::write(folder.join("out.exr"), "old").expect("a file");
    let before = files(folder);
    let r = run(folder, line);
    assert!(r.code == 1 || r.code == 2, "{line}: {} {}", r.code, r.stderr);
    let errors = r.stderr.lines().filter(|l| l.contains("error")).count();
    assert!(r.stderr.starts_with("error: ") && errors == 1, "{line}: {}", r.stderr);
    assert!(r.stdout.is_empty() && r.stderr.ends_with('\n'), "{line}: {}", r.stdout);
    assert_eq!(files(folder), before, "{line}");
    assert_eq!(std::fs::read(folder.join("out.exr")).expect("a file"), b"old", "{line}");
    r
}

/// Exit codes and messages of many lines as one text.
fn report(folder: &Path, lines: &[&str]) -> String {
    lines.iter().fold(String::new(), |mut text, line| {
        let r = refuse(folder, line);
        // How the EXR library describes the damage changes with its version.
        let said = match r.stderr.split_once(".exr: Preparing") {
            Some((said, _)) => format!("{said}.exr: ...\n"),
            None => r.stderr,
        };
        let _ = writeln!(text, "$ sparing {line}\n{said}exit code {}\n", r.code);
        text
    })
}

#[test]
fn broken_scenes() {
    let f = folder();
    let write = |name: &str, bytes: &[u8]| std::fs::write(f.path().join(name), bytes).expect("a file");
    write("empty.pbrt", b"");
    write("empty.obj", b"");
    write(
        "garbage.pbrt",
        &(0..4096u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect::<Vec<_>>(),
    );
    write("garbage.obj", &[0xff; 512]);
    write("scene.blend", b"BLENDER");
    write("scene", b"WorldBegin");
    std::fs::create_dir(f.path().join("folder.pbrt")).expect("a folder");
    let picture = std::fs::read(scene("textures/tiles.png")).expect("a picture");
    write("cut.png", &picture[..picture.len() / 2]);
    ok(f.path(), "render @cornell-box.pbrt --size 64x64 --spp 1 -o whole.exr --progress none");
    let picture = std::fs::read(f.path().join("whole.exr")).expect("a picture");
    write("cut.exr", &picture[..picture.len() / 2]);
    let mesh = |p: &str, rest: &str| format!("Shape \"trianglemesh\" \"point3 P\" [ {p} ] {rest}");
    let texture = |file: &str| {
        format!(
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\""
        )
    };
    let scenes = [
        ("nan", mesh("0 0 0 nan 0 0 0 1 0", "")),
        ("infinite", mesh("0 0 0 1e39 0 0 0 1 0", "")),
        ("index", mesh("0 0 0 1 0 0 0 1 0", "\"integer indices\" [ 0 1 3 ]")),
        ("negative-index", mesh("0 0 0 1 0 0 0 1 0", "\"integer indices\" [ 0 1 -1 ]")),
        ("radius", "Shape \"sphere\" \"float radius\" -1".to_owned()),
        ("zero-scale", "Scale 0 1 1\nShape \"sphere\"".to_owned()),
        ("directive", "Shpae \"sphere\"".to_owned()),
        ("type", "Shape \"spere\"".to_owned()),
        ("include", "Include \"nowhere.pbrt\"".to_owned()),
        ("texture", texture("nowhere.png")),
        ("cut-png", texture("cut.png")),
        ("cut-exr", texture("cut.exr")),
        ("no-picture", texture("empty.pbrt")),
        (
            "environment",
            "LightSource \"infinite\" \"string filename\" \"cut.exr\"\nShape \"sphere\"".to_owned(),
        ),
        ("mesh", "Shape \"objmesh\" \"string filename\" \"nowhere.obj\"".to_owned()),
        ("broken-mesh", "Shape \"objmesh\" \"string filename\" \"garbage.obj\"".to_owned()),
    ];
    let mut lines: Vec<String> = [
        "nowhere.pbrt",
        "nowhere/scene.pbrt",
        "empty.pbrt",
        "empty.obj",
        "garbage.pbrt",
        "garbage.obj",
        "scene.blend",
        "scene",
        "folder.pbrt",
        "empty.pbrt/x.pbrt",
    ]
    .iter()
    .map(|name| format!("render {name}"))
    .collect();
    for (name, shape) in &scenes {
        write(&format!("{name}.pbrt"), scene_of(shape).as_bytes());
        lines.push(format!("render {name}.pbrt"));
    }
    lines.push("info nan.pbrt".to_owned());
    lines.push("info cut.exr".to_owned());
    lines.push("info nowhere.exr".to_owned());
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(report(f.path(), &lines));
}

#[test]
fn film_sizes_in_scenes() {
    let f = folder();
    let with = |w: i64, h: i64| {
        let text = scene_of("Shape \"sphere\"");
        let text = text.replace("xresolution\" 8", &format!("xresolution\" {w}"));
        let text = text.replace("yresolution\" 8", &format!("yresolution\" {h}"));
        std::fs::write(f.path().join(format!("size-{w}-{h}.pbrt")), text).expect("a scene");
    };
    let mut all = Vec::new();
    for (w, h) in [(0, 0), (100_000, 100_000), (-8, 8), (65_536, 65_536)] {
        with(w, h);
        all.push(format!("render size-{w}-{h}.pbrt --spp 1"));
    }
    let lines: Vec<&str> = all.iter().map(String::as_str).collect();
    insta::assert_snapshot!(report(f.path(), &lines));
}

#[test]
fn wrong_options() {
    let f = folder();
    std::fs::create_dir(f.path().join("folder.exr")).expect("a folder");
    let options = [
        "--size 0x0",
        "--size 0x8",
        "--size 100000x100000",
        "--size 65536x65536",
        "--size -8x8",
        "--size 8",
        "--size 8xx8",
        "--size 99999999999x1",
        "--spp 0",
        "--spp -1",
        "--spp 1.5",
        "--spp many",
        "--spp 4294967296",
        "--crop 0,0,9,8",
        "--crop 9,9,10,10",
        "--crop 4,4,4,6",
        "--crop 5,0,3,8",
        "--crop 1,2,3",
        "--crop a,b,c,d",
        "--time-limit soon",
        "--time-limit -3s",
        "--time-limit 0",
        "--time-limit nan",
        "--time-limit 5y",
        "--time-limit 1000000000000000h",
        "--exposure nan",
        "--exposure inf",
        "--exposure bright",
        "--threads 100000",
        "--threads -1",
        "--max-depth -1",
        "--max-depth 100000",
        "--seed -1",
        "--seed x",
        "--policy none",
        "--sampler halton",
        "--progress loud",
        "--pixel 1,1",
        "--sample 3",
        "--tolerance 1",
        "--min-spp 16",
        "--policy threshold --tolerance 0",
        "--policy threshold --tolerance small",
        "--policy threshold --tolerance 1 --spp 16",
        "--policy threshold --spp 4",
        "--policy threshold --min-spp 16 --max-spp 8",
        "--policy threshold --judge-exposure 100",
        "--frobnicate",
        "--output",
        "extra",
    ];
    let lines: Vec<String> =
        options.iter().map(|o| format!("render @cornell-box.pbrt --size 8x8 -o out.exr {o}")).collect();
    // --size may be given once only.
    let lines: Vec<String> = lines
        .iter()
        .map(|l| if l.matches("--size").count() > 1 { l.replacen(" --size 8x8", "", 1) } else { l.clone() })
        .chain(["", "render", "rendr", "info", "compare", "info a b"].map(str::to_owned))
        .collect();
    let mut text = String::new();
    for line in &lines {
        if line.is_empty() || line == "render" {
            assert_eq!(run(f.path(), line).code, 2, "{line}");
            continue;
        }
        let r = refuse(f.path(), line);
        assert_eq!(r.code, 2, "{line}: {}", r.stderr);
        // What clap adds about usage and help changes with its version.
        let said = r.stderr.split("\n\n").next().unwrap_or_default().trim_end();
        let _ = writeln!(text, "$ sparing {line}\n{said}\n");
    }
    insta::assert_snapshot!(text);
}

#[test]
fn outputs_that_cannot_be() {
    let f = folder();
    std::fs::create_dir(f.path().join("folder.exr")).expect("a folder");
    std::fs::create_dir(f.path().join("folder.json")).expect("a folder");
    // So many samples that a test that renders first does not end in time.
    let base = "render @cornell-box.pbrt --size 2000x2000 --spp 100000";
    let outputs = [
        "-o nowhere/a.exr",
        "-o nowhere/a.png",
        "-o folder.exr",
        "-o a.jpg",
        "-o a",
        "-o out.exr -o out.exr",
        "-o out.exr -o ./out.exr",
        "-o b.exr -o folder.exr/../b.exr",
        "-o out.exr -o a.png -o nowhere/b.png",
        "-o out.exr --stats nowhere/s.json",
        "-o out.exr --stats folder.json",
        "-o out.exr --stats out.exr",
        "-o /proc/a.exr",
    ];
    let lines: Vec<String> = outputs.iter().map(|o| format!("{base} {o}")).collect();
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    insta::assert_snapshot!(report(f.path(), &lines));
}

/// Whether permissions bind this user; says so where not.
fn skipped_for_root(folder: &Path) -> bool {
    std::fs::write(folder.join("probe"), "").expect("a file");
    set_mode(&folder.join("probe"), 0o000);
    let root = std::fs::read(folder.join("probe")).is_ok();
    std::fs::remove_file(folder.join("probe")).expect("it goes");
    if root {
        eprintln!("SKIPPED: permissions do not bind root");
    }
    root
}

fn set_mode(path: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).expect("permissions");
}

#[test]
fn permissions() {
    let f = folder();
    if skipped_for_root(f.path()) {
        return;
    }
    std::fs::write(f.path().join("secret.pbrt"), scene_of("Shape \"sphere\"")).expect("a scene");
    set_mode(&f.path().join("secret.pbrt"), 0o000);
    let r = refuse(f.path(), "render secret.pbrt");
    assert!(
        r.code == 1 && r.stderr.contains("secret.pbrt") && r.stderr.contains("ermission denied"),
        "{}",
        r.stderr
    );
    let locked = f.path().join("locked");
    std::fs::create_dir(&locked).expect("a folder");
    set_mode(&locked, 0o555);
    let r = refuse(f.path(), "render @cornell-box.pbrt --size 2000x2000 --spp 100000 -o locked/a.exr");
    set_mode(&locked, 0o755);
    assert!(
        r.code == 1 && r.stderr.starts_with("error: cannot write locked/a.exr: Permission denied"),
        "{}",
        r.stderr
    );
}

#[test]
fn full_disks() {
    let f = folder();
    if !Path::new("/dev/full").exists() {
        eprintln!("SKIPPED: no /dev/full here");
        return;
    }
    for name in ["full.exr", "full.png", "full.json"] {
        std::os::unix::fs::symlink("/dev/full", f.path().join(name)).expect("a link");
    }
    let base = "render @cornell-box.pbrt --size 8x8 --spp 1 --progress none";
    for (rest, name) in [
        ("-o full.exr", "full.exr"),
        ("-o full.png", "full.png"),
        ("-o a.exr --stats full.json", "full.json"),
    ] {
        let r = run(f.path(), &format!("{base} {rest}"));
        let said = format!("error: cannot write {name}: No space left on device (os error 28)\n");
        assert_eq!((r.code, r.stderr), (1, said), "{rest}");
        std::fs::remove_file(f.path().join("a.exr")).ok();
        assert_eq!(files(f.path()), ["full.exr", "full.json", "full.png"]);
    }
    // The same on a disk with files, where root may make one.
    let disk = f.path().join("disk");
    std::fs::create_dir(&disk).expect("a folder");
    let mount = Command::new("mount").args(["-t", "tmpfs", "-o", "size=64k", "none"]).arg(&disk).output();
    if !mount.is_ok_and(|o| o.status.success()) {
        eprintln!("SKIPPED: a small disk cannot be mounted here");
        return;
    }
    let r = run(f.path(), "render @cornell-box.pbrt --size 200x200 --spp 1 --progress none -o disk/a.exr");
    let left = files(&disk);
    assert!(Command::new("umount").arg(&disk).status().expect("umount").success());
    assert_eq!(
        (r.code, r.stderr.as_str()),
        (1, "error: cannot write disk/a.exr: No space left on device (os error 28)\n")
    );
    assert!(left.is_empty(), "{left:?}");
}

/// Memory that is not there is an error, not an abort.
#[test]
fn pictures_too_large_for_memory() {
    let f = folder();
    // A gibipixel, the most that the options allow: 350 GiB.
    let machine = sparing::session::memory::available_bytes();
    if machine.is_some_and(|free| free < 300 << 30) {
        let r = refuse(f.path(), "render @cornell-box.pbrt --size 32768x32768 --spp 1 -o out.exr --layers");
        let said = "error: a picture of 32768x32768 needs ";
        assert!(
            r.code == 1 && r.stderr.starts_with(said) && r.stderr.contains("GiB of memory"),
            "{}",
            r.stderr
        );
    } else {
        eprintln!("SKIPPED: this machine may have the memory for a picture of 32768x32768");
    }
    // A limit on the process: 2 GiB of addresses for a picture of 4.
    let words: Vec<String> = arguments("render @cornell-box.pbrt --size 4000x3000 --spp 1 -o b.exr")
        .iter()
        .map(|p| format!("'{}'", p.display()))
        .collect();
    let script = format!("ulimit -v 2000000 && exec '{}' {}", env!("CARGO_BIN_EXE_sparing"), words.join(" "));
    let output = Command::new("sh").current_dir(f.path()).args(["-c", &script]).output().expect("a shell");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.starts_with("error: a picture of 4000x3000 needs 3.9 GiB of memory"), "{stderr}");
    assert!(!f.path().join("b.exr").exists());
}

/// Odd but valid: a warning at most.
#[test]
fn odd_scenes_render() {
    let f = folder();
    let render = |name: &str, text: &str| {
        std::fs::write(f.path().join(name), text).expect("a scene");
        let r = ok(f.path(), &format!("render {name} --spp 16 -o a.exr --progress none"));
        (Exr::read(&f.path().join("a.exr")), r.stderr)
    };
    // No light at all: black, and said.
    let dark = scene_of("Shape \"sphere\"").replace("LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]", "");
    let (picture, said) = render("dark.pbrt", &dark);
    assert!(said.starts_with("warning: ") && said.contains("light") && said.lines().count() == 1, "{said}");
    assert!(picture.channel("R").iter().all(|v| *v == 0.0));
    // A triangle without area beside a good one.
    let flat = "Shape \"trianglemesh\" \"point3 P\" [ -2 -2 0  2 -2 0  0 2 0  1 1 1 ] \"integer indices\" [ 0 1 2 0 0 3 ]";
    let (picture, said) = render("flat.pbrt", &scene_of(flat));
    assert!(said.starts_with("warning: ") && said.lines().count() == 1, "{said}");
    assert!(picture.brightness().0 > 0.1);
    // The camera inside a closed mesh, a sphere, glass; on a surface.
    let shapes = [
        "Material \"diffuse\" \"rgb reflectance\" [ 0.5 0.5 0.5 ]\nShape \"sphere\" \"float radius\" 9",
        "Material \"dielectric\"\nShape \"sphere\" \"float radius\" 9",
        "Scale 9 9 9\nShape \"objmesh\" \"string filename\" \"ROCK\"",
        "Translate 0 0 -5\nShape \"disk\" \"float radius\" 3",
        "Translate 0 0 -6\nShape \"sphere\"",
    ];
    let rock = crate::common::root().join("models/meshes/rock.obj");
    std::fs::copy(rock, f.path().join("rock.obj")).expect("a copy");
    for shape in shapes {
        let (picture, said) = render("inside.pbrt", &scene_of(&shape.replace("ROCK", "rock.obj")));
        assert_eq!(said, "", "{shape}");
        for c in ["R", "G", "B"] {
            assert!(picture.channel(c).iter().all(|v| v.is_finite() && *v >= 0.0), "{shape}");
        }
    }
    // Inside glass light comes from everywhere, denser by the square of the refractive index.
    let (picture, _) = render("glass.pbrt", &scene_of(shapes[1]));
    assert!((picture.brightness().0 - 2.25).abs() < 0.01, "{}", picture.brightness().0);
    // Nothing but a light: the sky.
    let (picture, said) = render("sky.pbrt", &scene_of(""));
    assert!(picture.channel("R").iter().all(|v| (*v - 1.0).abs() < 1e-5), "{said}");
    // Limits of what is allowed.
    for rest in
        ["--size 1x1", "--threads 64", "--max-depth 10000", "--crop 7,7,8,8", "--seed 18446744073709551615"]
    {
        ok(f.path(), &format!("render sky.pbrt --spp 2 -o a.exr --progress none {rest}"));
    }
}

/// Scenes from elsewhere stay in their folder; those below the current one may use what is there.
#[test]
fn scenes_do_not_name_files_outside_of_their_folder() {
    let f = folder();
    let (scenes, meshes) = (f.path().join("scenes"), f.path().join("meshes"));
    for dir in [&scenes, &meshes] {
        std::fs::create_dir(dir).expect("a folder");
    }
    std::fs::write(meshes.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
    let shape = "Shape \"objmesh\" \"string filename\" \"../meshes/a.obj\"";
    std::fs::write(scenes.join("a.pbrt"), scene_of(shape)).expect("a file");
    // From above both: fine, unless asked to be strict.
    ok(f.path(), "info scenes/a.pbrt");
    let strict = run(f.path(), "info scenes/a.pbrt --sandbox");
    assert_eq!(strict.code, 1);
    assert!(strict.stderr.contains("is outside of the folder of the scene"), "{}", strict.stderr);
    ok(f.path(), "info scenes/a.pbrt --sandbox --allow-path meshes");
    // From beside: the scene is from elsewhere.
    let from = meshes.as_path();
    let elsewhere = run(from, "render ../scenes/a.pbrt --spp 1 -o out.png");
    assert_eq!(elsewhere.code, 1);
    assert!(elsewhere.stderr.contains("--allow-path"), "{}", elsewhere.stderr);
    assert!(!from.join("out.png").exists());
    ok(from, "render ../scenes/a.pbrt --spp 1 --policy uniform -o out.png --allow-path .");
    ok(from, "info ../scenes/a.pbrt --no-sandbox");
    assert_eq!(run(from, "info ../scenes/a.pbrt --no-sandbox --sandbox").code, 2);
}
