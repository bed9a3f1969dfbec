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

/// Replaces what must be there.
fn replace(text: &mut String, from: &str, to: &str) {
    assert!(text.contains(from), "{from}");
    *text = text.replacen(from, to, 1);
}

/// Replaces the first number of a list of the card.
fn first_number(card: &mut String, list: &str, number: &str) {
    let start = card.find(list).expect("the list") + list.len();
    let end = start + card[start..].find(',').expect("numbers");
    card.replace_range(start..end, number);
}

#[test]
fn models_that_do_not_fit() {
    let f = folder();
    let same = |_: &mut String| ();
    let card = |name: &str, change: fn(&mut String)| model(f.path(), name, same, change);
    card("unknown.model", |c| replace(c, "\"log-count\"", "\"shoe-size\""));
    card("fewer.model", |c| replace(c, "\"log-count\", ", ""));
    card("twice.model", |c| replace(c, "\"log-count\"", "\"lab-l\""));
    card("undefined.model", |c| first_number(c, "min = [", "nan"));
    card("infinite.model", |c| first_number(c, "max = [", "inf"));
    card("shorter.model", |c| first_number(c, "min = [-0.4465357869169648,", " -12.0"));
    card("no-scaling.model", |c| {
        let (start, end) = (c.find("[scaling]").expect("there"), c.find("[metrics]").expect("there"));
        c.replace_range(start..end, "");
    });
    card("future.model", |c| replace(c, "format = 1", "format = 99"));
    card("no-card.model", |_| ());
    fs::remove_file(f.path().join("no-card.model.toml")).expect("it goes");
    model(f.path(), "other.model", |m| m.push('\n'), same);
    model(f.path(), "garbage.model", |m| *m = "\u{1}\u{2}\u{3}".repeat(500), same);
    model(f.path(), "cut.model", |m| m.truncate(m.len() / 2), same);
    model(f.path(), "nan.model", |m| replace(m, "gamma 0.0", "gamma nan"), same);
    fs::write(f.path().join("empty.model"), "").expect("a file");
    fs::create_dir(f.path().join("folder")).expect("a folder");
    for (name, said) in [
        ("nowhere.model", "nowhere.model"),
        ("empty.model", "empty.model"),
        ("unknown.model", "\"shoe-size\" is not known"),
        ("fewer.model", "features"),
        ("twice.model", "lab-l"),
        ("undefined.model", "scaling"),
        ("infinite.model", "scaling"),
        ("shorter.model", "scaling"),
        ("no-scaling.model", "scaling"),
        ("future.model", "99"),
        ("no-card.model", "no-card.model.toml"),
        ("other.model", "another model file"),
        ("garbage.model", "garbage.model"),
        ("cut.model", "cut.model"),
        ("nan.model", "nan.model"),
        ("folder", "layer-8.model"),
    ] {
        let r = refuse(f.path(), &format!("{LINE} --policy svm --model {name}"));
        eprintln!("{name}: {}", r.stderr);
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
        eprintln!("{options}: {}", r.stderr);
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
