//! Adaptive policies on the command line.

use crate::common::{Exr, folder, ok};

#[test]
fn a_policy_spends_its_average_and_shows_where() {
    let f = folder();
    let line = "render @cornell-box.pbrt --size 64x64 --policy threshold --spp 24 --max-spp 128 -o a.exr --progress none";
    let r = ok(f.path(), &format!("{line} --heat-map heat.png --stats -"));
    let s = r.json();
    let average = s["average_spp"].as_f64().expect("a number");
    assert!((20.0..28.0).contains(&average), "{average}");
    assert_eq!(s["policy"], "threshold");
    assert!(s["predicted_error"].as_f64().is_some_and(|e| e > 0.0) && s["exposure"].as_f64().is_some());
    assert_eq!(s["audit_samples"], 0, "an average needs no audit");
    let picture = Exr::read(&f.path().join("a.exr"));
    let counts = picture.channel("SampleCount.Y");
    assert!(counts.iter().all(|n| (8.0..=128.0).contains(n)));
    assert!(counts.contains(&8.0) && counts.iter().any(|n| *n > 24.0));
    // The last decision is negative where a pixel stopped before the end.
    let decisions = picture.channel("Decision.Y");
    assert!(decisions.iter().zip(counts).all(|(d, n)| *d <= 0.0 || *n >= 128.0));
    assert!(f.path().join("heat.png").exists());
}

#[test]
fn seeds_and_threads_are_what_they_are_without_a_policy() {
    let f = folder();
    let line = "render @tests/small-light.pbrt --size 40x40 --policy threshold --tolerance 1 --progress none";
    for (name, more) in [("a", "--threads 1"), ("b", "--threads 2"), ("c", "--threads 2 --seed 9")] {
        let s = ok(f.path(), &format!("{line} {more} -o {name}.exr --stats -")).json();
        let (audit, samples) = (s["audit_samples"].as_u64(), s["samples"].as_u64());
        assert!(audit.zip(samples).is_some_and(|(a, n)| 0 < a && 4 * a < n), "{audit:?} of {samples:?}");
    }
    let [a, b, c] = ["a", "b", "c"].map(|n| Exr::read(&f.path().join(format!("{n}.exr"))));
    for channel in ["R", "SampleCount.Y", "Decision.Y"] {
        assert!(a.channel(channel) == b.channel(channel), "{channel}");
    }
    assert!(a.channel("R") != c.channel("R"));
}

#[test]
fn pixels_of_several_shapes_get_more() {
    let f = folder();
    ok(
        f.path(),
        "render @cornell-box.pbrt --size 32x32 --policy shapes --max-spp 32 -o a.exr --progress none",
    );
    let picture = Exr::read(&f.path().join("a.exr"));
    for (n, shapes) in picture.channel("SampleCount.Y").iter().zip(picture.channel("Shapes.Y")) {
        assert_eq!(*n, if *shapes > 1.0 { 32.0 } else { 8.0 });
    }
}
