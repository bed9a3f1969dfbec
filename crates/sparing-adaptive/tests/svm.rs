//! Machines as policies: hand-made models, what is refused, and a small training run.

use glam::Vec3;
use sparing_adaptive::features::{Feature, FeatureMatrix};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{Band, Barrier, Policy, Svm, Threshold};
use sparing_adaptive::training::{Collection, Fit, Label, collect, fit};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::{BuildOptions, RenderSettings, Scene};
use sparing_scene::generate::training::{Split, scene};
use sparing_svm::card::{CARD_FORMAT, CardScaling};
use sparing_svm::train::Grid;
use sparing_svm::{Card, Kernel, Model, SvmType};
use std::collections::BTreeMap;

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 256 };

/// A linear machine: `weight` times the scaled feature, less `rho`.
fn linear(weight: f64, rho: f64) -> Model {
    Model {
        svm_type: SvmType::CSvc,
        kernel: Kernel::Linear,
        labels: vec![1, -1],
        class_counts: vec![1, 1],
        rho: vec![rho],
        prob_a: Vec::new(),
        prob_b: Vec::new(),
        prob_density_marks: Vec::new(),
        features: 1,
        support_vectors: vec![0.5, -0.5],
        coefficients: vec![vec![weight, -weight]],
    }
}

fn card(features: &[&str], half_range: f64) -> Card {
    Card {
        format: CARD_FORMAT,
        sha256: "0".repeat(64),
        features: features.iter().map(|&f| f.to_owned()).collect(),
        label: "made by hand".to_owned(),
        data: Vec::new(),
        licence: "MIT OR Apache-2.0".to_owned(),
        command: String::new(),
        seed: 0,
        scaling: Some(CardScaling {
            lower: -4.0,
            upper: 4.0,
            min: vec![-half_range; features.len()],
            max: vec![half_range; features.len()],
        }),
        metrics: BTreeMap::new(),
    }
}

/// Pixels of growing spread.
fn film() -> Film {
    let mut film = Film::new([8, 8], [0, 0, 8, 8], FilmOptions::default());
    for i in 0..64 {
        for n in 0..8 {
            let wave = if n % 2 == 0 { 1.0 } else { -1.0 };
            film.tiles[0].add_sample(i, n, Vec3::splat(0.4 + wave * 0.004 * i as f32), 1.0);
        }
    }
    film
}

#[test]
fn the_gain_as_the_only_feature_is_the_rule() {
    let machine = Machine::new(&linear(1.0, 0.0), &card(&["log-gain"], 4.0)).unwrap();
    let (film, ledger) = (film(), Ledger::default());
    let barrier = Barrier::new(&film, &ledger, BOUNDS, 1.0);
    for goal in [Goal::Threshold(1.0), Goal::Average(12.0), Goal::Tolerance(1.0), Goal::Threshold(0.0)] {
        let mut svm = Svm::new(goal, machine.clone());
        let (ours, aimed) = (svm.decide(&barrier), Threshold::new(goal).decide(&barrier).lambda.unwrap());
        // The threshold of a goal is rounded.
        let lambda = ours.lambda.unwrap();
        assert!(lambda == aimed || (aimed / lambda).ln().abs() < 0.06, "{goal:?}: {lambda} {aimed}");
        let rule = Threshold::new(Goal::Threshold(lambda)).decide(&barrier);
        assert_eq!(ours.targets, rule.targets, "{goal:?}");
        assert!(ours.values.iter().all(|v| v.is_finite()));
        assert_eq!(svm.undefined, 0);
        assert!(svm.decided < 40, "{}", svm.decided);
    }
}

#[test]
fn the_machine_decides_inside_the_band_only() {
    let (film, ledger) = (film(), Ledger::default());
    let barrier = Barrier::new(&film, &ledger, BOUNDS, 1.0);
    let goal = Goal::Threshold(0.8);
    let targets = |rho: f64| {
        let mut svm = Svm::new(goal, Machine::new(&linear(0.0, rho), &card(&["log-gain"], 4.0)).unwrap());
        (svm.decide(&barrier).targets, svm.decided)
    };
    let ((stop, decided), (go_on, _)) = (targets(100.0), targets(-100.0));
    let changed = stop.iter().zip(&go_on).filter(|(a, b)| a != b).count() as u64;
    assert!(decided == changed && changed > 5, "{decided} {changed}");
    assert!(stop.contains(&16) && go_on.contains(&8));
}

/// Asked again after a change of one pixel, the machine computes nine values anew and says what a new one says.
#[test]
fn what_has_not_changed_is_not_asked_again() {
    let mut film = film();
    let machine = Machine::new(&linear(1.0, 0.1), &card(&["log-spread-mean3"], 4.0)).unwrap();
    let policy = || {
        let mut svm = Svm::new(Goal::Threshold(20.0), machine.clone());
        svm.band = Band { stop: -30.0, go_on: 30.0 };
        svm
    };
    let mut svm = policy();
    svm.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
    let first = svm.decided;
    for n in 8..16 {
        film.tiles[0].add_sample(27, n, Vec3::splat(0.1 * n as f32), 1.0);
    }
    for asked in [9, 0] {
        let before = svm.decided;
        let decisions = svm.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
        assert_eq!(decisions, policy().decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0)));
        assert_eq!(svm.decided - before, asked, "of {first}");
    }
    svm.rule.goal = Goal::Threshold(30.0);
    svm.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
    assert_eq!(svm.decided, 2 * first + 9);
    // Back at the first threshold; then far more thresholds than are kept.
    svm.rule.goal = Goal::Threshold(20.0);
    svm.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
    assert_eq!(svm.decided, 2 * first + 9);
    for k in 0..20 {
        let goal = Goal::Threshold(21.0 + f64::from(k));
        svm.rule.goal = goal;
        let decisions = svm.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
        let mut fresh = policy();
        fresh.rule.goal = goal;
        assert_eq!(decisions, fresh.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0)));
    }
    let before = svm.decided;
    svm.rule.goal = Goal::Threshold(20.0);
    svm.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
    assert_eq!(svm.decided - before, first, "forgotten by now");
}

#[test]
fn labels_in_the_other_order_mean_the_same() {
    let mut model = linear(1.0, 0.25);
    let matrix = || FeatureMatrix { features: 1, values: vec![-9.0, 0.0, 0.5, 1.0, 9.0] };
    let values = Machine::new(&model, &card(&["lab-l"], 4.0)).unwrap().classifier().decide(matrix());
    // Features are clipped to the scaling's range.
    assert_eq!(values, [-4.25, -0.25, 0.25, 0.75, 3.75]);
    model.labels = vec![-1, 1];
    let values = Machine::new(&model, &card(&["lab-l"], 4.0)).unwrap().classifier().decide(matrix());
    assert_eq!(values[0], 4.25);
}

#[test]
fn what_is_undefined_goes_on_and_is_counted() {
    let mut model = linear(1.0, 0.0);
    model.kernel = Kernel::Polynomial { degree: 2, gamma: 1e200, coef0: 0.0 };
    let Ok(machine) = Machine::new(&model, &card(&["log-gain"], 4.0)) else { return };
    let (film, ledger) = (film(), Ledger::default());
    let barrier = Barrier::new(&film, &ledger, BOUNDS, 1.0);
    let mut svm = Svm::new(Goal::Threshold(0.5), machine);
    let decisions = svm.decide(&barrier);
    assert!(svm.undefined > 0, "infinity less infinity");
    assert!(decisions.values.iter().all(|v| v.is_finite()));
}

#[test]
fn machines_that_do_not_fit_are_refused() {
    let message = |model: &Model, card: &Card| Machine::new(model, card).unwrap_err().to_string();
    let model = linear(1.0, 0.0);
    assert!(message(&model, &card(&["shoe size"], 1.0)).contains("\"shoe size\" is not known"));
    assert!(message(&model, &card(&["lab-l", "lab-a"], 1.0)).contains("1 features, its card names 2"));
    let without = Card { scaling: None, ..card(&["lab-l"], 1.0) };
    assert!(message(&model, &without).contains("no scaling"));
    let other = Model { labels: vec![1, 2], ..linear(1.0, 0.0) };
    assert!(message(&other, &card(&["lab-l"], 1.0)).contains("+1 and -1"));
    assert!(Machine::read("no/such/file.model").unwrap_err().to_string().contains("no/such/file.model"));
}

#[test]
fn files_are_read_with_their_card() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.model");
    linear(1.0, 0.0).write(&path).unwrap();
    card(&["lab-b"], 2.0).write(&path).unwrap();
    let machine = Machine::read(&path).unwrap();
    assert_eq!((machine.features(), machine.classifier().vectors()), (&[Feature::BlueYellow][..], 2));
    let text = |p: &std::path::Path| std::fs::read_to_string(p).unwrap();
    let same = Machine::from_text(&text(&path), &text(&Card::path(&path))).unwrap();
    assert_eq!(same.features(), machine.features());
    linear(2.0, 0.0).write(&path).unwrap();
    assert!(Machine::read(&path).unwrap_err().to_string().contains("another model file"));
}

/// Rows and the machine fitted to them are the same whatever the threads; the machine is fit to decide.
#[test]
fn training_is_deterministic_and_gives_a_machine() {
    let train = |threads: usize, label| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let rows: Vec<_> = [0, 1, 3]
                .map(|index| {
                    let mut scene = scene(index, 1, Split::Training);
                    (scene.film.width, scene.film.height) = (16, 12);
                    let depth = scene.integrator.max_depth;
                    let scene = Scene::build(scene, BuildOptions { threads: 1, robust: true }).unwrap();
                    let settings = RenderSettings { max_depth: depth, ..RenderSettings::default() };
                    let what = Collection {
                        replicates: 2,
                        reference_spp: 128,
                        bounds: Bounds { min_spp: 8, max_spp: 64 },
                        rows: 150,
                        ..Collection::default()
                    };
                    collect(&scene, [16, 12], settings, &what)
                })
                .into();
            let what = Fit {
                label,
                rows: 200,
                grid: Grid { c: vec![1.0], gamma: vec![1.0, 2.0] },
                folds: 3,
                vectors: 32,
                ..Fit::default()
            };
            let fitted = fit(&rows, &what, None).unwrap();
            (rows, fitted.model, fitted.scaling)
        })
    };
    for label in [Label::Realised, Label::Conditional, Label::Expected] {
        let (rows, model, scaling) = train(1, label);
        assert!(rows.iter().all(|r| r.len() > 50), "{:?}", rows.iter().map(Vec::len).collect::<Vec<_>>());
        assert!(rows.iter().flatten().flat_map(|r| &r.features).all(|v| v.is_finite()));
        assert!(model.len() <= 32);
        let names: Vec<&str> = Feature::DEFAULT.iter().map(|f| f.name()).collect();
        let card = Card { scaling: Some(CardScaling::from(&scaling)), ..card(&names, 1.0) };
        Machine::new(&model, &card).unwrap();
        if label == Label::Realised {
            assert!(train(3, label) == (rows, model, scaling), "3 threads");
        }
    }
}
