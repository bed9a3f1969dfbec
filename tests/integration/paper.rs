//! The sampler of Lin and Wu (2015) on the command line.

use crate::common::{Exr, folder, ok, run};
use std::fs;

#[test]
fn the_sampler_of_2015_renders_and_threads_do_not_matter() {
    let f = folder();
    let line =
        "render @paper/bunny-like.pbrt --size 24x24 --policy svm --model paper --max-spp 64 --progress none";
    for threads in [1, 2] {
        let r = ok(f.path(), &format!("{line} --threads {threads} -o {threads}.exr --stats -"));
        let s = r.json();
        assert_eq!((&s["policy"], &s["model"]), (&"svm".into(), &"paper".into()));
        assert!(s["exposure"].is_null(), "it looks at radiance as it is");
    }
    let [one, two] = ["1.exr", "2.exr"].map(|name| Exr::read(&f.path().join(name)));
    for channel in ["R", "SampleCount.Y", "Decision.Y"] {
        assert!(one.channel(channel) == two.channel(channel), "{channel}");
    }
    let counts = one.channel("SampleCount.Y");
    assert!(counts.iter().all(|n| [8.0, 16.0, 32.0, 64.0].contains(n)));
    assert!(one.channel("Decision.Y").iter().zip(counts).all(|(d, n)| *d <= 0.0 || *n >= 64.0));
}

#[test]
fn a_tiny_training_run_gives_a_folder_that_renders_and_is_the_same_again() {
    let f = folder();
    let tiny = "train --label paper --scenes 3 --rows 120 --scene-rows 60 --size-scale 0.15 --seed 5";
    let r = ok(f.path(), &format!("{tiny} --threads 1 -o a"));
    assert!(r.stdout.contains("layer of 256 samples"), "{}", r.stdout);
    ok(f.path(), &format!("{tiny} --threads 2 -o b"));
    let bytes = |name: &str| fs::read(f.path().join(name)).expect("a file");
    for layer in [8, 16, 32, 64, 128, 256] {
        assert!(bytes(&format!("a/layer-{layer}.model")) == bytes(&format!("b/layer-{layer}.model")));
    }
    fs::remove_dir_all(f.path().join("a")).expect("the folder goes");
    let r = ok(f.path(), &format!("{tiny} -o a"));
    assert_eq!(r.stderr.matches("kept").count(), 3, "{}", r.stderr);
    assert!(bytes("a/layer-64.model") == bytes("b/layer-64.model"));

    let picture =
        "render @tests/small-light.pbrt --size 16x16 --policy svm --max-spp 32 --progress none -o o.png";
    ok(f.path(), &format!("{picture} --model a"));
    for end in ["", ".toml"] {
        fs::copy(
            f.path().join(format!("a/layer-8.model{end}")),
            f.path().join(format!("a/layer-16.model{end}")),
        )
        .expect("a copy");
    }
    let r = run(f.path(), &format!("{picture} --model a"));
    assert!(r.code == 1 && r.stderr.contains("samples = 8, not 16"), "{r:?}");
    let r = run(f.path(), &format!("{picture} --model a/layer-8.model"));
    assert!(r.code == 1 && r.stderr.contains("\"shapes\" is not known"), "{r:?}");
}

#[test]
fn options_without_a_use_are_refused() {
    let f = folder();
    for (options, message) in [
        ("--spp 32", "--spp: the sampler of 2015 has no goal"),
        ("--tolerance 1", "--tolerance: the sampler of 2015 has no goal"),
        ("--min-spp 12", "not 12 to 512"),
        ("--max-spp 1024", "not 8 to 1024"),
    ] {
        let r = run(f.path(), &format!("render @cornell-box.pbrt --policy svm --model paper {options}"));
        assert!(r.code == 2 && r.stderr.contains(message), "{options}: {r:?}");
    }
}
