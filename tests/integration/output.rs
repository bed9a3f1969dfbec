//! What `sparing render` writes: pictures, layers, headers, statistics, progress.

use crate::common::{Exr, files, folder, ok, p_value, run};
use exr::meta::attribute::AttributeValue;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpListener;

const LAYERS: [&str; 16] = [
    "A",
    "Albedo.B",
    "Albedo.G",
    "Albedo.R",
    "B",
    "G",
    "N.X",
    "N.Y",
    "N.Z",
    "R",
    "SampleCount.Y",
    "Shapes.Y",
    "Variance.B",
    "Variance.G",
    "Variance.R",
    "Z",
];

#[test]
fn another_reader_sees_every_layer() {
    let f = folder();
    ok(f.path(), "render @tests/environment.pbrt --size 64x24 --spp 16 --layers -o a.exr --progress none");
    let picture = Exr::read(&f.path().join("a.exr"));
    assert_eq!((picture.size, picture.origin, picture.display), ([64, 24], [0, 0], [64, 24]));
    assert_eq!(picture.names(), LAYERS);
    let info = ok(f.path(), "info a.exr --json").json();
    assert_eq!(info["channels"], serde_json::json!(LAYERS));
    assert_eq!((&info["width"], &info["height"]), (&64.into(), &24.into()));

    // The same numbers as our own reader's.
    let own = sparing::image::exr::read_exr(&f.path().join("a.exr")).expect("our reader reads it");
    for (name, values) in &picture.channels {
        let same = own.channel(name).expect("the channel").data.iter().zip(values);
        assert!(same.into_iter().all(|(a, b)| a.to_bits() == b.to_bits()), "{name}");
    }

    // Values that make sense. Some pixels see only the sky, which is 64 units away from no sphere.
    let all =
        |name: &str, test: fn(f32) -> bool| assert!(picture.channel(name).iter().all(|v| test(*v)), "{name}");
    for c in ["R", "G", "B", "Variance.R", "Variance.G", "Variance.B"] {
        all(c, |v| v.is_finite() && v >= 0.0);
    }
    for c in ["Albedo.R", "Albedo.G", "Albedo.B"] {
        all(c, |v| (0.0..=1.0).contains(&v));
    }
    for c in ["N.X", "N.Y", "N.Z"] {
        all(c, |v| v.abs() <= 1.00001);
    }
    all("A", |v| v == 1.0);
    all("SampleCount.Y", |v| v == 16.0);
    all("Shapes.Y", |v| (1.0..=2.0).contains(&v));
    all("Z", |v| v == f32::INFINITY || (6.9..8.1).contains(&v));
    // The middle sphere's centre faces the camera at -z; the corners are sky.
    let at = |name: &str, x: usize, y: usize| picture.channel(name)[y * 64 + x];
    assert!((at("Z", 32, 12) - 7.0).abs() < 0.05 && at("N.Z", 32, 12) < -0.95, "{}", at("N.Z", 32, 12));
    assert_eq!((at("Z", 0, 0), at("N.Z", 0, 0), at("Albedo.R", 0, 0)), (f32::INFINITY, 0.0, 0.0));
    assert!(picture.channel("Shapes.Y").contains(&2.0), "an edge has two shapes");
    assert!(picture.channel("Variance.G").iter().filter(|v| **v > 0.0).count() > 500);
}

#[test]
fn the_header_says_how_it_was_made() {
    let f = folder();
    ok(
        f.path(),
        "render @cornell-box.pbrt --size 24x24 --spp 4 --seed 77 --max-depth 3 -o a.exr --progress none",
    );
    let picture = Exr::read(&f.path().join("a.exr"));
    assert_eq!(
        picture.names(),
        ["A", "B", "G", "R", "SampleCount.Y", "Variance.B", "Variance.G", "Variance.R"]
    );
    let find = |name: &str| {
        let found = picture.attributes.iter().find(|a| a.0 == name);
        &found.unwrap_or_else(|| panic!("no {name} among {:?}", picture.attributes)).1
    };
    let text = |name: &str| match find(name) {
        AttributeValue::Text(t) => t.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert!(text("software").starts_with("Sparing 0."));
    assert!(text("sparing.scene").ends_with("cornell-box.pbrt"));
    let texts = [("policy", "uniform"), ("sampler", "sobol"), ("seed", "77"), ("stoppedBy", "spp")];
    for (name, value) in texts {
        assert_eq!(text(&format!("sparing.{name}")), value, "{name}");
    }
    assert!(text("sparing.embree").starts_with("4."));
    assert!(
        matches!(find("worldToCamera"), AttributeValue::Matrix4x4(m) if m[14] == 800.0),
        "{:?}",
        find("worldToCamera")
    );
    assert_eq!(find("sparing.maxDepth"), &AttributeValue::I32(3));
    assert_eq!(find("sparing.spp"), &AttributeValue::I32(4));
    assert_eq!(find("sparing.samples"), &AttributeValue::F64(2304.0));
    assert_eq!(find("sparing.invalidSamples"), &AttributeValue::F64(0.0));
    assert_eq!(find("sparing.averageSpp"), &AttributeValue::F64(4.0));
    assert!(matches!(find("sparing.renderSeconds"), AttributeValue::F64(s) if *s > 0.0 && *s < 100.0));
    // The text form of `info` has them all.
    let info = ok(f.path(), "info a.exr").stdout;
    for line in [
        "pixels     24x24 at 0,0 of 24x24",
        "sparing.seed: 77",
        "sparing.averageSpp: 4",
        "channels   A B G R",
    ] {
        assert!(info.contains(line), "{line} in {info}");
    }
}

#[test]
fn statistics_are_complete_and_add_up() {
    let f = folder();
    let line = "render @tests/texture-alpha.pbrt --size 40x30 --spp 20 --seed 5 --threads 2 -o a.exr --progress none";
    let r = ok(f.path(), &format!("{line} --stats s.json"));
    assert_eq!(r.stdout, "");
    let text = std::fs::read_to_string(f.path().join("s.json")).expect("statistics");
    let s: Value = serde_json::from_str(&text).expect("JSON");
    assert!(s["scene"].as_str().is_some_and(|n| n.ends_with("texture-alpha.pbrt")));
    for (key, value) in [("width", 40), ("height", 30), ("seed", 5), ("threads", 2), ("samples", 24_000)] {
        assert_eq!(s[key], Value::from(value), "{key}");
    }
    assert_eq!((&s["policy"], &s["model"]), (&"uniform".into(), &Value::Null));
    assert_eq!(
        (&s["average_spp"], &s["stopped_by"], &s["invalid_samples"]),
        (&20.0.into(), &"spp".into(), &0.into())
    );
    let number = |v: &Value| v.as_f64().unwrap_or_else(|| panic!("{v} is not a number"));
    for key in ["load_seconds", "build_seconds", "render_seconds"] {
        assert!((1e-9..100.0).contains(&number(&s[key])), "{key}");
    }
    let rays = ["camera", "bounce", "shadow"].map(|k| number(&s["rays"][k]));
    assert_eq!(rays[0], 24_000.0);
    assert!(rays[1] > 5_000.0 && rays[2] > 5_000.0, "{rays:?}");
    let per_second = rays.iter().sum::<f64>() / number(&s["render_seconds"]);
    assert!((number(&s["rays_per_second"]) / per_second - 1.0).abs() < 1e-9);

    let layers = s["layers"].as_array().expect("layers");
    let spp: Vec<_> = layers.iter().map(|l| number(&l["spp"])).collect();
    assert_eq!(spp, [8.0, 16.0, 20.0]);
    assert!(layers.iter().all(|l| l["active_pixels"] == 1200 && number(&l["decide_seconds"]) < 1.0));
    let sampling: f64 = layers.iter().map(|l| number(&l["sample_seconds"])).sum();
    assert!(sampling > 0.0 && sampling <= number(&s["render_seconds"]));

    for key in [
        "peak_memory_bytes",
        "resident_bytes",
        "film_bytes",
        "embree_bytes",
        "geometry_bytes",
        "texture_bytes",
    ] {
        assert!(number(&s[key]) > 0.0, "{key}");
    }
    assert!(number(&s["peak_memory_bytes"]) >= number(&s["resident_bytes"]));
    assert!(s["embree_version"].as_str().is_some_and(|v| v.starts_with("4.")));
    let names = |key: &str| -> Vec<String> { serde_json::from_value(s[key].clone()).expect("names") };
    let (needs, skipped) = (names("needs"), names("skipped"));
    let mut both = [needs.clone(), skipped].concat();
    both.sort();
    let mut known: Vec<String> = sparing::render::Needs::describe().iter().map(|d| d.0.to_owned()).collect();
    known.sort();
    assert_eq!(both, known, "every need is in exactly one of the lists");
    assert!(needs.contains(&"texture-coordinates".to_owned()), "{needs:?}");

    let r = ok(f.path(), &format!("{line} --stats -"));
    assert_eq!((&r.json()["samples"], r.stderr.as_str()), (&24_000.into(), ""));
}

#[test]
fn progress_is_json_lines_that_grow() {
    let f = folder();
    let r =
        ok(f.path(), "render @cornell-box.pbrt --size 128x128 --spp 100 -o a.exr --progress json --stats -");
    assert_eq!(r.stderr, "");
    let lines: Vec<Value> = r.stdout.lines().map(|l| serde_json::from_str(l).expect(l)).collect();
    let (done, rest) = lines.split_last().expect("lines");
    assert_eq!(*done, serde_json::json!({ "event": "done", "stopped_by": "spp" }));
    let (statistics, events) = rest.split_last().expect("lines");
    assert_eq!(statistics["samples"], 128 * 128 * 100);
    let mut last = 0.0;
    for e in events {
        assert_eq!(
            (&e["event"], &e["phase"], &e["active_pixels"]),
            (&"progress".into(), &"sampling".into(), &16384.into())
        );
        let fraction = e["fraction"].as_f64().expect("a fraction");
        assert!(fraction >= last && fraction <= 1.0, "{fraction} after {last}");
        let samples = e["samples"].as_f64().expect("a count");
        assert!((samples / 1_638_400.0 - fraction).abs() < 1e-12);
        assert!(e["spp"].as_u64().is_some() && e["seconds"].as_f64().is_some());
        last = fraction;
    }
    assert_eq!(last, 1.0, "the last wave ends at 1");
    assert!(events.len() >= 5, "one for each wave at least");
    let r = ok(f.path(), "render @cornell-box.pbrt --size 8x8 --spp 9 -o a.exr");
    assert!(r.stderr.contains("89 %  8 spp  64 pixels active"), "{}", r.stderr);
    assert!(r.stderr.contains("a.exr: 8x8, 9.0 samples per pixel"), "{}", r.stderr);
}

#[test]
fn crops_are_the_same_bits() {
    let f = folder();
    let line = "render @tests/glass.pbrt --size 61x35 --spp 6 --layers --progress none";
    ok(f.path(), &format!("{line} -o full.exr -o full.png"));
    ok(f.path(), &format!("{line} -o part.exr -o part.png --crop 13,9,50,21 --stats s.json"));
    let [full, part] = ["full.exr", "part.exr"].map(|n| Exr::read(&f.path().join(n)));
    assert_eq!((part.size, part.origin, part.display), ([37, 12], [13, 9], [61, 35]));
    for (name, values) in &part.channels {
        for (i, v) in values.iter().enumerate() {
            let at = (9 + i / 37) * 61 + 13 + i % 37;
            assert_eq!(v.to_bits(), full.channel(name)[at].to_bits(), "{name} at {i}");
        }
    }
    let info = ok(f.path(), "info part.exr --json").json();
    assert_eq!(info["data_origin"], serde_json::json!([13, 9]));
    assert_eq!(info["display_size"], serde_json::json!([61, 35]));
    let read =
        |n: &str| sparing::image::picture::Picture::read(&f.path().join(n)).expect("a PNG").to_linear();
    let (full, part) = (read("full.png"), read("part.png"));
    assert_eq!((full.len(), part.len()), (61 * 35, 37 * 12));
    assert!(part.iter().enumerate().all(|(i, v)| *v == full[(9 + i / 37) * 61 + 13 + i % 37]));
}

/// Everything in a picture but the times in its header.
fn bits(picture: &Exr) -> Vec<(String, Vec<u32>)> {
    picture.channels.iter().map(|(n, v)| (n.clone(), v.iter().map(|x| x.to_bits()).collect())).collect()
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let f = folder();
    let render = |name: &str, rest: &str| {
        let line =
            format!("render @tests/instances.pbrt --size 45x27 --spp 12 --layers --progress none {rest}");
        ok(f.path(), &format!("{line} -o {name}.exr -o {name}.png"));
        let mut header = Exr::read(&f.path().join(format!("{name}.exr")));
        header.attributes.retain(|a| a.0 != "sparing.renderSeconds");
        header
    };
    let one = render("one", "--threads 1");
    for threads in [2, 5] {
        let name = format!("threads-{threads}");
        let other = render(&name, &format!("--threads {threads}"));
        assert!(bits(&other) == bits(&one), "{threads} threads");
        assert_eq!(other.attributes, one.attributes, "{threads} threads");
        let png = |n: &str| std::fs::read(f.path().join(n)).expect("a PNG");
        assert!(png(&format!("{name}.png")) == png("one.png"), "{threads} threads");
    }
    for rest in ["--seed 1", "--sampler independent", "--max-depth 1"] {
        assert!(bits(&render("other", rest)) != bits(&one), "{rest}");
    }
    assert!(bits(&render("same", "--seed 0 --sampler sobol")) == bits(&one));
}

#[test]
fn options_do_what_they_say() {
    let f = folder();
    let render = |rest: &str| {
        ok(f.path(), &format!("render @cornell-box.pbrt --size 30x30 -o a.exr --progress none {rest}"));
        Exr::read(&f.path().join("a.exr"))
    };
    // Deeper paths bring more light; none at all, only the lamp: 17, 12, 4 or nothing.
    let depth = [0, 1, 2, 8].map(|d| render(&format!("--spp 64 --max-depth {d}")));
    let lamp = depth[0].channel("R").iter().filter(|v| **v > 0.0).count();
    assert!((5..50).contains(&lamp), "{lamp} pixels see the lamp");
    let rgb = depth[0].channel("R").iter().zip(depth[0].channel("G")).zip(depth[0].channel("B"));
    for ((r, g), b) in rgb {
        assert!(
            *r <= 17.0 && (r * 12.0 - g * 17.0).abs() < 1e-3 && (g * 4.0 - b * 12.0).abs() < 1e-3,
            "{r} {g} {b}"
        );
    }
    for d in 1..4 {
        assert!(depth[d].brightness().0 > 1.05 * depth[d - 1].brightness().0, "depth {d}");
    }

    // All estimators estimate the same, with samples of their own.
    let means = [("mis", 1), ("light", 2), ("bsdf", 3)].map(|(e, seed)| {
        let rest = format!("--sampler independent --spp 256 --estimator {e} --seed {seed}");
        render(&rest).brightness()
    });
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        assert!(p_value(means[i], means[j]) > 1e-4, "{means:?}");
    }
    assert!(means[2].1 > 1.5 * means[0].1, "bsdf sampling alone is noisier: {means:?}");

    // One stop more light in the PNG is the other's exposure.
    let exposed = |ev: &str| {
        ok(
            f.path(),
            &format!(
                "render @cornell-box.pbrt --size 30x30 --spp 4 -o a.png --exposure {ev} --progress none"
            ),
        );
        sparing::image::picture::Picture::read(&f.path().join("a.png")).expect("a PNG").to_linear()
    };
    let (dark, bright) = (exposed("-1"), exposed("0"));
    let pairs = dark.iter().flatten().zip(bright.iter().flatten()).filter(|(_, b)| **b < 1.0 && **b > 0.1);
    let ratios: Vec<f32> = pairs.map(|(d, b)| b / d).collect();
    assert!(ratios.len() > 100 && ratios.iter().all(|r| (1.9..2.1).contains(r)), "{ratios:?}");
}

#[test]
fn a_time_limit_stops_and_says_so() {
    let f = folder();
    let start = std::time::Instant::now();
    let r = ok(
        f.path(),
        "render @cornell-box.pbrt --size 64x64 --spp 1000000 --time-limit 700ms -o a.exr --stats s.json",
    );
    assert!(start.elapsed().as_secs_f64() < 30.0);
    assert!(r.stderr.contains("stopped by time-limit; the picture so far is saved"), "{}", r.stderr);
    let s: Value =
        serde_json::from_slice(&std::fs::read(f.path().join("s.json")).expect("statistics")).expect("JSON");
    assert_eq!(s["stopped_by"], "time-limit");
    assert!(s["render_seconds"].as_f64().is_some_and(|t| (0.7..20.0).contains(&t)));
    let picture = Exr::read(&f.path().join("a.exr"));
    let counts = picture.channel("SampleCount.Y");
    let total: f64 = counts.iter().map(|c| f64::from(*c)).sum();
    assert_eq!(Some(total), s["samples"].as_f64());
    assert!(total > 0.0 && counts.iter().all(|c| *c < 1e6));
    // A limit that is not reached changes nothing.
    ok(f.path(), "render @cornell-box.pbrt --size 8x8 --spp 2 --time-limit 1h -o b.exr --stats s.json");
    let s: Value =
        serde_json::from_slice(&std::fs::read(f.path().join("s.json")).expect("statistics")).expect("JSON");
    assert_eq!(s["stopped_by"], "spp");
}

#[test]
fn pictures_are_named_after_the_scene() {
    let f = folder();
    ok(f.path(), "render @cornell-box.pbrt --size 8x8 --spp 1 --progress none");
    assert_eq!(files(f.path()), ["cornell-box.exr"]);
    // Dots in the name stay; a scene without a film name lends its own.
    let text = "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\nShape \"sphere\"\n";
    std::fs::write(f.path().join("my.scene.v2.pbrt"), text).expect("a scene");
    ok(f.path(), "render my.scene.v2.pbrt --size 8x8 --spp 1 --progress none");
    assert_eq!(files(f.path()), ["cornell-box.exr", "my.scene.v2.exr", "my.scene.v2.pbrt"]);
    // Several outputs at once, with whatever case.
    ok(f.path(), "render my.scene.v2.pbrt --size 8x8 --spp 1 --progress none -o x.EXR -o y.png -o z.exr");
    for name in ["x.EXR", "z.exr"] {
        assert_eq!(Exr::read(&f.path().join(name)).size, [8, 8]);
    }
    let same = |a: &str, b: &str| bits(&Exr::read(&f.path().join(a))) == bits(&Exr::read(&f.path().join(b)));
    assert!(same("x.EXR", "z.exr"));
    assert!(std::fs::read(f.path().join("y.png")).expect("a PNG").starts_with(b"\x89PNG"));
    assert!(files(f.path()).iter().all(|n| !n.contains("tmp")), "no temporary file stays");
}

/// A viewer of our own on a port of this machine.
#[test]
fn a_viewer_gets_the_picture() {
    let f = folder();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let viewer = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a client");
        let mut all = Vec::new();
        stream.read_to_end(&mut all).expect("bytes");
        all
    });
    ok(
        f.path(),
        &format!("render @cornell-box.pbrt --size 16x16 --spp 16 -o a.exr --progress none --tev {address}"),
    );
    let bytes = viewer.join().expect("the viewer lives");
    let mut packets = Vec::new();
    let mut rest = &bytes[..];
    while let Some(head) = rest.first_chunk::<4>() {
        let n = u32::from_le_bytes(*head) as usize;
        packets.push(&rest[4..n]);
        rest = &rest[n..];
    }
    let kinds: Vec<u8> = packets.iter().map(|p| p[0]).collect();
    assert_eq!(kinds, [4, 6, 6], "one creation, two waves of a picture of one band");
    let floats: Vec<f32> = packets[2][packets[2].len() - 16 * 16 * 16..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    let picture = Exr::read(&f.path().join("a.exr"));
    for (c, name) in ["R", "G", "B", "SampleCount.Y"].into_iter().enumerate() {
        let seen: Vec<f32> = floats.iter().skip(c).step_by(4).copied().collect();
        assert_eq!(seen, picture.channel(name), "{name}");
    }
}

#[test]
fn a_viewer_that_leaves_does_not_end_the_render() {
    let f = folder();
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let viewer = std::thread::spawn(move || drop(listener.accept().expect("a client")));
    let r =
        ok(f.path(), &format!("render @cornell-box.pbrt --size 64x64 --spp 256 -o a.exr --tev {address}"));
    viewer.join().expect("the viewer lived");
    assert!(r.stderr.contains("warning: the viewer is gone"), "{}", r.stderr);
    assert_eq!(Exr::read(&f.path().join("a.exr")).size, [64, 64]);
}

#[test]
fn nobody_listening_is_an_error_before_rendering() {
    let f = folder();
    // A port that was free a moment ago.
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").port();
    let line = "render @cornell-box.pbrt --size 2000x2000 --spp 4000 -o a.exr";
    let r = run(f.path(), &format!("{line} --tev 127.0.0.1:{port}"));
    let said = format!("error: cannot reach a viewer at 127.0.0.1:{port}: Connection refused");
    assert!(r.code == 1 && r.stderr.starts_with(&said), "{}", r.stderr);
    let r = run(f.path(), &format!("{line} --tev nonsense"));
    assert!(
        r.code == 1 && r.stderr.starts_with("error: cannot reach a viewer at nonsense: "),
        "{}",
        r.stderr
    );
    assert!(files(f.path()).is_empty());
}

/// A sample of the picture can be replayed alone.
#[test]
fn one_sample_replays() {
    let f = folder();
    ok(f.path(), "render @cornell-box.pbrt --size 20x20 --spp 1 --layers -o a.exr --progress none");
    let picture = Exr::read(&f.path().join("a.exr"));
    let replay = ok(f.path(), "render @cornell-box.pbrt --size 20x20 --pixel 7,11 --sample 0").json();
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let value = replay["radiance"][c].as_f64().expect("a number") as f32;
        assert_eq!(value, picture.channel(name)[11 * 20 + 7], "{name}");
    }
    let r = run(f.path(), "render @cornell-box.pbrt --size 20x20 --pixel 20,0 --sample 0");
    assert_eq!((r.code, r.stderr.as_str()), (1, "error: pixel 20,0 is outside the picture of 20x20\n"));
}

/// Replayed samples add up to the pixel, and every sample that the statistics call invalid shows what is wrong.
#[test]
fn invalid_samples_are_named_and_replay() {
    let f = folder();
    // Emission and what is reflected are finite each, and too much together.
    let scene = "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40\n\
        Film \"rgb\" \"integer xresolution\" 20 \"integer yresolution\" 20\nWorldBegin\n\
        LightSource \"infinite\" \"rgb L\" [ 3e38 3e38 3e38 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ 1 1 1 ]\n\
        AreaLightSource \"diffuse\" \"rgb L\" [ 2e38 2e38 2e38 ]\nShape \"sphere\" \"float radius\" 1\n";
    std::fs::write(f.path().join("bright.pbrt"), scene).expect("a scene");
    let line = "render bright.pbrt --spp 16 -o a.exr --stats s.json --progress none";
    let said = ok(f.path(), line).stderr;
    let text = std::fs::read_to_string(f.path().join("s.json")).expect("statistics");
    let statistics: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let named = statistics["invalid"].as_array().expect("a list");
    let invalid = statistics["invalid_samples"].as_u64().expect("a number");
    assert!(invalid > 64 && named.len() == 64, "{invalid} {}", named.len());
    let first = format!("the first: --pixel {},{} --sample {}", named[0][0], named[0][1], named[0][2]);
    assert!(said.contains(&first), "{said}");
    assert!(Exr::read(&f.path().join("a.exr")).channel("R").iter().all(|v| v.is_finite()));
    for at in named.iter().step_by(5) {
        let replay = ok(f.path(), &format!("{line} --pixel {},{} --sample {}", at[0], at[1], at[2])).json();
        assert_eq!((&replay["invalid"], &replay["radiance"][0]), (&true.into(), &"inf".into()), "{replay}");
        let path = replay["path"].as_array().expect("a list");
        assert!(path[0]["hit"]["position"].is_array() && path[0]["radiance"][0].is_f64(), "{replay}");
        assert!(path.len() >= 2 && path.iter().any(|v| v["radiance"][0] == "inf"), "{replay}");
    }

    let line = "render @cornell-box.pbrt --size 20x20 --spp 24 -o b.exr --progress none";
    ok(f.path(), line);
    let picture = Exr::read(&f.path().join("b.exr"));
    let mut sum = [0.0; 3];
    for n in 0..24 {
        let replay = ok(f.path(), &format!("{line} --pixel 9,13 --sample {n}")).json();
        let value = |c: usize| replay["radiance"][c].as_f64().expect("a number");
        sum = [0, 1, 2].map(|c| sum[c] + value(c));
    }
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert_eq!((sum[c] / 24.0) as f32, picture.channel(name)[13 * 20 + 9], "{name}");
    }
}

/// Existing pictures are replaced whole.
#[test]
fn an_old_picture_is_replaced() {
    let f = folder();
    let path = f.path().join("a.exr");
    let mut old = std::fs::File::create(&path).expect("a file");
    old.write_all(&[7; 1_000_000]).expect("bytes");
    ok(f.path(), "render @cornell-box.pbrt --size 8x8 --spp 1 --progress none -o a.exr");
    assert_eq!(Exr::read(&path).size, [8, 8]);
    assert_eq!(files(f.path()), ["a.exr"]);
}
