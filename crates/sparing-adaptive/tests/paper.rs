//! The sampler of Lin and Wu (2015): hand-made models, what is refused, hostile films, a small training run.

use glam::Vec3;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::paper_features::{COUNT, FILM, NAMES};
use sparing_adaptive::policy::paper::{CAP, LAYERS};
use sparing_adaptive::policy::{Barrier, Paper, Policy};
use sparing_adaptive::training::paper::{Cut, Fit, Row, collect, fit};
use sparing_image::film::Film;
use sparing_render::{BuildOptions, RenderSettings, Scene};
use sparing_scene::generate::training::{Split, scene};
use sparing_svm::card::{CARD_FORMAT, CardScaling};
use sparing_svm::train::Grid;
use sparing_svm::{Card, Kernel, Model, SvmType};

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 512 };

/// A linear machine that goes on where Y, scaled from [0, 1] to [-1, 1], is positive.
fn model() -> Model {
    let mut support_vectors = vec![0.0; 2 * COUNT];
    [support_vectors[5], support_vectors[COUNT + 5]] = [0.5, -0.5];
    Model {
        svm_type: SvmType::CSvc,
        kernel: Kernel::Linear,
        labels: vec![1, -1],
        class_counts: vec![1, 1],
        rho: vec![0.0],
        prob_a: Vec::new(),
        prob_b: Vec::new(),
        prob_density_marks: Vec::new(),
        features: COUNT,
        support_vectors,
        coefficients: vec![vec![1.0, -1.0]],
    }
}

fn card(samples: u32) -> Card {
    Card {
        format: CARD_FORMAT,
        sha256: "0".repeat(64),
        features: NAMES.map(str::to_owned).to_vec(),
        label: "made by hand".to_owned(),
        data: Vec::new(),
        licence: "MIT OR Apache-2.0".to_owned(),
        command: String::new(),
        seed: 0,
        scaling: Some(CardScaling { lower: -1.0, upper: 1.0, min: vec![0.0; COUNT], max: vec![1.0; COUNT] }),
        metrics: [("layers".to_owned(), 6.0), ("samples".to_owned(), f64::from(samples))].into(),
    }
}

type Models = Vec<(Model, Card)>;
type Change = fn(&mut Models);

fn models() -> Models {
    LAYERS.map(|samples| (model(), card(samples))).to_vec()
}

/// A film of `side` by `side` pixels; pixel `i` of a tile holds `count` samples of one radiance.
fn film(side: u32, count: u32, radiance: impl Fn(usize) -> Vec3) -> Film {
    let mut film = Film::new([side; 2], [0, 0, side, side], FILM);
    for tile in &mut film.tiles {
        for i in 0..tile.pixels.len() {
            (0..count).for_each(|n| tile.add_sample(i, n, radiance(i), 1.0));
        }
    }
    film
}

#[test]
fn pixels_go_on_as_their_layer_says_and_stop_for_good() {
    let mut paper = Paper::new(&models()).unwrap();
    // The first pixel is dark, the others are bright.
    let grey = |i: usize| Vec3::splat(if i == 0 { 0.25 } else { 0.75 });
    let mut film = film(2, 8, grey);
    let decide =
        |paper: &mut Paper, film: &Film| paper.decide(&Barrier::new(film, &Ledger::default(), BOUNDS, 1.0));
    let decisions = decide(&mut paper, &film);
    assert_eq!(decisions.targets, [8, 16, 16, 16]);
    assert!(decisions.values[0] < 0.0 && decisions.values[1] > 0.0);
    // Its neighbours go on; light that reaches the first pixel now is not looked at any more.
    for i in [1, 8, 9] {
        (8..16).for_each(|n| film.tiles[0].add_sample(i, n, grey(i), 1.0));
    }
    film.tiles[0].add_sample(0, 8, Vec3::splat(1e6), 1.0);
    assert_eq!(decide(&mut paper, &film).targets, [9, 32, 32, 32]);
    assert_eq!((paper.decided, paper.undefined), (7, 0));
}

#[test]
fn nobody_gets_more_than_the_cap_or_the_most() {
    let mut paper = Paper::new(&models()).unwrap();
    for (count, most, wanted) in
        [(256, 512, 512), (256, 9999, CAP), (512, 9999, 512), (16, 24, 24), (1, 512, 8)]
    {
        let film = film(1, count, |_| Vec3::ONE);
        let bounds = Bounds { min_spp: 8, max_spp: most };
        assert_eq!(
            paper.decide(&Barrier::new(&film, &Ledger::default(), bounds, 1.0)).targets,
            [wanted],
            "{count} {most}"
        );
    }
}

#[test]
fn hostile_films_are_decided_and_what_is_undefined_goes_on() {
    let hostile = [Vec3::ZERO, Vec3::splat(f32::MAX), Vec3::splat(f32::NAN), Vec3::NEG_ONE];
    let mut paper = Paper::new(&models()).unwrap();
    for side in [1, 3, 9] {
        for count in [0, 1, 8, 64] {
            let film = film(side, count, |i| hostile[i % 4]);
            let decisions = paper.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
            assert!(decisions.values.iter().all(|v| v.is_finite()));
            assert!(decisions.targets.iter().all(|t| (count..=BOUNDS.max_spp).contains(t)));
        }
    }
    assert_eq!(paper.undefined, 0, "features are held in their range");

    let mut models = models();
    for (model, _) in &mut models {
        model.kernel = Kernel::Polynomial { degree: 2, gamma: 1e200, coef0: 0.0 };
    }
    let mut paper = Paper::new(&models).unwrap();
    let decisions = paper.decide(&Barrier::new(&film(2, 8, |_| Vec3::ONE), &Ledger::default(), BOUNDS, 1.0));
    assert_eq!((paper.decided, paper.undefined), (4, 4), "infinity less infinity");
    assert_eq!(decisions.targets, [16; 4]);
}

#[test]
fn models_that_do_not_fit_are_refused() {
    let cases: [(&str, Change); 7] = [
        ("has 6 layers, here are 5", |m| m.truncate(5)),
        ("samples = 16, not 8", |m| m.swap(0, 1)),
        ("layers = 5, not 6", |m| m[3].1.metrics.extend([("layers".to_owned(), 5.0)])),
        ("does not say samples = 64", |m| m[3].1.metrics.retain(|name, _| name != "samples")),
        ("the model needs log-gain", |m| "log-gain".clone_into(&mut m[2].1.features[4])),
        ("not scaled to [-1.0, 1.0]", |m| m[5].1.scaling.as_mut().unwrap().lower = 0.0),
        ("no scaling", |m| m[5].1.scaling = None),
    ];
    for (wanted, change) in cases {
        let mut models = models();
        change(&mut models);
        let found = Paper::new(&models).unwrap_err().to_string();
        assert!(found.contains(wanted), "{found}");
    }
    let found = Paper::read("no/such/folder").unwrap_err().to_string();
    assert!(found.contains("layer-8.model"), "{found}");
}

/// Rows and the machines fitted to them are the same whatever the threads.
#[test]
fn training_is_deterministic() {
    let train = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut scene = scene(2, 1, Split::Training);
            (scene.film.width, scene.film.height) = (20, 14);
            let depth = scene.integrator.max_depth;
            let scene = Scene::build(scene, BuildOptions { threads: 1, robust: true }).unwrap();
            let settings = RenderSettings { max_depth: depth, ..RenderSettings::default() };
            let pixels = collect(&scene, [20, 14], settings, 7, 200);
            let grid = Grid { c: vec![1.0], gamma: vec![1.0, 8.0] };
            let what = Fit { rows: 150, folds: 3, grid, ..Fit::default() };
            let models: Vec<_> = (0..LAYERS.len())
                .map(|layer| {
                    let rows: Vec<Row> = pixels.iter().map(|p| p[layer]).collect();
                    fit(layer, &rows, &what, None).unwrap()
                })
                .collect();
            (pixels, models)
        })
    };
    let ((pixels, one), (again, two)) = (train(1), train(2));
    assert!(pixels == again && pixels.len() == 200);
    let at = |layer: usize| pixels.iter().map(|p| p[layer].distance).sum::<f64>();
    assert!(at(5) < at(0), "more samples are nearer: {} {}", at(5), at(0));
    for (one, two) in one.iter().zip(&two) {
        assert!(one.model == two.model && one.scaling == two.scaling && one.metrics == two.metrics);
        let share = one.metrics["share of rows that go on"];
        assert!((0.05..0.6).contains(&share), "{share}");
    }
    assert!(fit(6, &[], &Fit::default(), None).unwrap_err().to_string().contains("no layer 6"));
    assert!(fit(0, &[], &Fit::default(), None).is_err());
}

#[test]
fn cuts() {
    let rows: Vec<Row> = [1.0, 2.0, 9.0].map(|distance| Row { distance, ..Row::default() }).to_vec();
    assert_eq!((Cut::Mean.of(&rows), Cut::Median.of(&rows)), (4.0, 2.0));
    assert_eq!((Cut::Mean.of(&[]), Cut::Median.of(&[])), (0.0, 0.0));
}
