//! What can go wrong with adaptive policies on the command line: models that do not fit, goals that cannot be.

use crate::bad_input::refuse;
use crate::common::{Exr, folder, ok, root};
use std::fs;
use std::path::Path;

const LINE: &str = "render @tests/small-light.pbrt --size 8x8 --progress none -o out.exr";

/// A copy of the shipped model and its card, changed.
fn model(folder: &Path, name: &str, change: impl Fn(&mut String), change_card: impl Fn(&mut String)) {
    let shipped = root().join("models/svm/default.model");
    let text = |path: &Path| fs::read_to_string(path).expect("the shipped model");
    let (mut model, mut card) = (text(&shipped), text(&shipped.with_extension("model.toml")));
    change(&mut model);
    change_card(&mut card);
    fs::write(folder.join(name), model).expect("a file");
    fs::write(folder.join(format!("{name}.toml")), card).expect("a file");
}

/// Replaces what follows this, up to the end mark.
fn replace_after(text: &mut String, this: &str, end: &str, new: &str) {
    let start = text.find(this).expect("it is there") + this.len();
    let end = start + text[start..].find(end).expect("an end");
    text.replace_range(start..end, new);
}

#[test]
fn models_that_do_not_fit() {
    let f = folder();
    let same = |_: &mut String| ();
    let card = |name: &str, change: fn(&mut String)| model(f.path(), name, same, change);
    card("unknown.model", |c| replace_after(c, "features = [", ",", "\"shoe-size\""));
    card("more.model", |c| replace_after(c, "features = [", "\"", "\"shoe-size\", "));
    card("undefined.model", |c| replace_after(c, "min = [", ",", "nan"));
    card("infinite.model", |c| replace_after(c, "max = [", ",", "inf"));
    card("no-scaling.model", |c| replace_after(c, "\n\n", "[metrics", ""));
    card("future.model", |c| replace_after(c, "format = ", "\n", "99"));
    card("no-card.model", |_| ());
    fs::remove_file(f.path().join("no-card.model.toml")).expect("it goes");
    model(f.path(), "other.model", |m| m.push('\n'), same);
    model(f.path(), "garbage.model", |m| *m = "\u{1}\u{2}\u{3}".repeat(500), same);
    model(f.path(), "cut.model", |m| m.truncate(m.len() / 2), same);
    model(f.path(), "nan.model", |m| replace_after(m, "gamma ", "\n", "nan"), same);
    fs::write(f.path().join("empty.model"), "").expect("a file");
    fs::create_dir(f.path().join("folder")).expect("a folder");
    for (name, said) in [
        ("nowhere.model", "nowhere.model"),
        ("empty.model", "empty.model"),
        ("unknown.model", "\"shoe-size\" is not known"),
        ("more.model", "scaling.min has"),
        ("undefined.model", "is not finite"),
        ("infinite.model", "is not finite"),
        ("no-scaling.model", "no scaling"),
        ("future.model", "99"),
        ("no-card.model", "no-card.model.toml"),
        ("other.model", "another model file"),
        ("garbage.model", "garbage.model"),
        ("cut.model", "cut.model"),
        ("nan.model", "nan.model"),
        ("folder", "layer-8.model"),
    ] {
        let r = refuse(f.path(), &format!("{LINE} --policy svm --model {name}"));
        assert!(r.code == 1 && r.stderr.contains(said), "{name}: {} {}", r.code, r.stderr);
    }
}

#[test]
fn options_that_cannot_be_together() {
    let f = folder();
    for (options, said) in [
        ("--model paper", "--model is for --policy svm"),
        ("--policy threshold --model paper", "--model is for --policy svm"),
        ("--policy shapes --model nowhere.model", "--model is for --policy svm"),
        ("--unbiased", "--unbiased is for --policy threshold and svm"),
        ("--policy shapes --unbiased", "--unbiased is for --policy threshold and svm"),
        ("--policy svm --model paper --unbiased", "--unbiased asks no model: leave out --model"),
        ("--policy shapes --tolerance 1", "--tolerance: the policy shapes has no goal to set"),
        ("--policy shapes --spp 16", "--spp: the policy shapes has no goal to set"),
        ("--policy svm --tolerance inf", "above 0 and finite"),
        ("--policy svm --tolerance -1", "above 0 and finite"),
        ("--policy svm --tolerance nan", "above 0 and finite"),
        ("--policy svm --min-spp 0", "0 samples per pixel are not possible"),
        ("--policy svm --max-spp 0", "0 samples per pixel are not possible"),
        ("--policy svm --max-spp -8", "'-8' is not a number of samples"),
        ("--policy svm --spp 1000", "an average must lie between least and most, 8 to 512"),
        ("--policy svm --time-limit 0s", "no time at all would render nothing"),
        ("--max-spp 16", "--max-spp is for adaptive policies"),
        ("--policy svm --judge-exposure nan", "between -60 and 60 stops"),
    ] {
        let r = refuse(f.path(), &format!("{LINE} {options}"));
        assert!(r.code == 2 && r.stderr.contains(said), "{options}: {} {}", r.code, r.stderr);
    }
}

/// Least is most, an average at either bound, hardly any time: pictures all the same.
#[test]
fn goals_at_their_limits() {
    let f = folder();
    let spp = |options: &str| {
        let s = ok(f.path(), &format!("{LINE} {options} --stats -")).json();
        let picture = Exr::read(&f.path().join("out.exr"));
        for (name, values) in &picture.channels {
            assert!(values.iter().all(|v| v.is_finite()), "{options}: {name}");
        }
        s["average_spp"].as_f64().expect("a number")
    };
    for policy in ["threshold", "svm", "svm --unbiased"] {
        assert_eq!(spp(&format!("--policy {policy} --min-spp 16 --max-spp 16")), 16.0, "{policy}");
        assert_eq!(spp(&format!("--policy {policy} --max-spp 4 --spp 4")), 4.0, "{policy}");
        assert_eq!(spp(&format!("--policy {policy} --min-spp 16 --spp 16")), 16.0, "{policy}");
        assert_eq!(spp(&format!("--policy {policy} --min-spp 1 --max-spp 1")), 1.0, "{policy}");
        assert!(spp(&format!("--policy {policy} --tolerance 1e300")) <= 16.0, "{policy}");
        assert!(spp(&format!("--policy {policy} --tolerance 1e-300 --max-spp 64")) > 48.0, "{policy}");
        assert!(spp(&format!("--policy {policy} --time-limit 1ms --max-spp 1048576")) < 1e6, "{policy}");
    }
}
