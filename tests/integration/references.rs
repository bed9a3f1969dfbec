//! Whole renders against stored references of many samples.
//!
//! `tests/references/NAME.exr` hold mean and variance of the mean of each pixel, rendered with independent random
//! numbers. The tests render each scene again with another seed and fewer samples, and compare with
//! [`testkit::pictures`]: Z-tests of pixels, blocks and the whole picture. Pictures of what failed go to
//! `target/test-failures/`.
//!
//! `make references`, which is `SPARING_WRITE_REFERENCES=1 cargo test --test integration references`, renders the references again
//! (some minutes). Only a change that is meant to change pictures is a reason to; look at them before you commit.

use crate::common::{root, scene};
use sparing::image::atomic::check_writable;
use sparing::image::exr::{ExrAttribute, film_layers, read_exr, write_exr};
use sparing::image::film::{Film, FilmOptions};
use sparing::render::integrator::{Estimator, Wave};
use sparing::render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing::scene::SceneDescription;
use sparing::scene::description::{ColorInput, MaterialKind, SamplerKind};
use std::path::PathBuf;
use std::sync::Once;
use testkit::pictures::{Estimate, check, compare};

/// A scene, the size it is rendered at, samples per pixel of the test (so many that 2 % of light show) and of the
/// reference.
struct Case {
    name: &'static str,
    size: [u32; 2],
    spp: u32,
    reference_spp: u32,
}

const CASES: [Case; 11] = [
    Case { name: "cornell-box", size: [40, 40], spp: 256, reference_spp: 8192 },
    Case { name: "mesh", size: [40, 40], spp: 256, reference_spp: 8192 },
    Case { name: "demo", size: [56, 32], spp: 256, reference_spp: 8192 },
    Case { name: "tests/environment", size: [64, 24], spp: 256, reference_spp: 8192 },
    Case { name: "tests/furnace", size: [16, 16], spp: 256, reference_spp: 8192 },
    Case { name: "tests/glass", size: [56, 32], spp: 512, reference_spp: 8192 },
    Case { name: "tests/instances", size: [56, 32], spp: 256, reference_spp: 8192 },
    Case { name: "tests/many-lights", size: [56, 32], spp: 4096, reference_spp: 32_768 },
    Case { name: "tests/mis", size: [48, 36], spp: 256, reference_spp: 8192 },
    Case { name: "tests/small-light", size: [40, 40], spp: 256, reference_spp: 8192 },
    Case { name: "tests/texture-alpha", size: [40, 40], spp: 256, reference_spp: 8192 },
];
const REFERENCE_SEED: u64 = 1;
/// Chance of rejecting a right picture, a scene.
const LEVEL: f64 = 1e-3;

fn reference_path(case: &Case) -> PathBuf {
    root().join("tests/references").join(format!("{}.exr", case.name.rsplit('/').next().unwrap_or(case.name)))
}

fn failures() -> PathBuf {
    let target = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    target.parent().unwrap_or(&target).join("test-failures")
}

fn description(case: &Case) -> SceneDescription {
    let path = scene(&format!("{}.pbrt", case.name));
    let mut d = sparing::scene::load(&path).unwrap_or_else(|e| panic!("{}", e.report()));
    [d.film.width, d.film.height] = case.size;
    d.film.crop = None;
    d
}

fn settings(d: &SceneDescription, sampler: SamplerKind, seed: u64, estimator: Estimator) -> RenderSettings {
    let max_depth = d.integrator.max_depth;
    RenderSettings { sampler, seed, estimator, max_depth, ..RenderSettings::default() }
}

fn film(description: SceneDescription, settings: RenderSettings, spp: u32) -> Film {
    let size = [description.film.width, description.film.height];
    let scene = Scene::build(description, BuildOptions::default()).expect("the scene builds");
    let mut film = Film::new(size, [0, 0, size[0], size[1]], FilmOptions::default());
    let wave = Wave::default();
    Renderer::new(&scene, settings, FilmOptions::default()).run(&mut film, &wave, |_, _| spp);
    assert_eq!(film.invalid_samples(), 0, "first at {:?}", film.named_invalid().next());
    film
}

fn estimate(film: &Film, samples: u32) -> Estimate {
    Estimate {
        width: film.width(),
        height: film.height(),
        samples,
        mean: film.beauty(),
        variance: film.map(|t, i| t.pixels[i].variance_of_mean().as_vec3().to_array()),
    }
}

fn render(d: SceneDescription, sampler: SamplerKind, seed: u64, estimator: Estimator, spp: u32) -> Estimate {
    let s = settings(&d, sampler, seed, estimator);
    estimate(&film(d, s, spp), spp)
}

/// The stored reference. If the environment asks for it, the first test to come here renders all of them.
fn reference(case: &Case) -> Estimate {
    static WRITE: Once = Once::new();
    WRITE.call_once(|| {
        if std::env::var_os("SPARING_WRITE_REFERENCES").is_some_and(|v| v == "1") {
            CASES.iter().for_each(write_reference);
        }
    });
    let path = reference_path(case);
    let image = read_exr(&path).unwrap_or_else(|e| panic!("{e}; `make references` renders it"));
    let count = image.channel("SampleCount.Y").expect("a sample count");
    Estimate {
        width: image.width,
        height: image.height,
        samples: count.data[0] as u32,
        mean: image.rgb("").expect("a picture"),
        variance: image.rgb("Variance").expect("variances"),
    }
}

fn write_reference(case: &Case) {
    let path = reference_path(case);
    check_writable(&path).unwrap_or_else(|e| panic!("{e}"));
    let d = description(case);
    let settings = settings(&d, SamplerKind::Independent, REFERENCE_SEED, Estimator::Mis);
    let start = std::time::Instant::now();
    let film = film(d, settings, case.reference_spp);
    let text = |v: &str| ExrAttribute::String(v.to_owned());
    let attributes = vec![
        ("sparing.scene".to_owned(), text(case.name)),
        ("sparing.sampler".to_owned(), text("independent")),
        ("sparing.seed".to_owned(), text(&REFERENCE_SEED.to_string())),
        ("software".to_owned(), text(&format!("Sparing {}", sparing::VERSION))),
    ];
    write_exr(&path, &film_layers(&film, attributes)).unwrap_or_else(|e| panic!("{e}"));
    eprintln!("{}: {:.1} s", path.display(), start.elapsed().as_secs_f64());
}

/// All scenes in one test: the renderer uses all processors anyway.
#[test]
fn references_agree() {
    let mut wrong = Vec::new();
    for case in &CASES {
        let reference = reference(case);
        assert_eq!(reference.samples, case.reference_spp);
        let name = case.name.replace('/', "-");
        let independent = render(description(case), SamplerKind::Independent, 2, Estimator::Mis, case.spp);
        wrong.extend(check(&name, &independent, &reference, LEVEL, &failures()).err());

        // The variance of independent samples bounds the error of Sobol points from above.
        let sobol = render(description(case), SamplerKind::Sobol, 3, Estimator::Mis, case.spp);
        wrong.extend(check(&format!("{name}-sobol"), &sobol, &reference, LEVEL, &failures()).err());

        // The tests can fail: 2 % more light is found in every scene.
        let brighter = compare(&independent.scaled(1.02), &reference, LEVEL);
        if brighter.iter().all(|s| s.accepts) {
            wrong.push(format!("{name}: 2 % more light is not found: {brighter:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn case(name: &str) -> &'static Case {
    CASES.iter().find(|c| c.name == name).expect("a case")
}

fn accepts(picture: &Estimate, reference: &Estimate) -> bool {
    compare(picture, reference, LEVEL).iter().all(|s| s.accepts)
}

/// Errors that a renderer could have must be found: a material or light off by 2 %, a path cut one bounce short.
#[test]
fn references_find_errors_in_the_scene() {
    let case = case("cornell-box");
    let reference = reference(case);
    let render = |change: &dyn Fn(&mut SceneDescription)| {
        let mut d = description(case);
        change(&mut d);
        render(d, SamplerKind::Independent, 4, Estimator::Mis, case.spp)
    };
    let brighter = |c: &mut ColorInput| match c {
        ColorInput::Constant(v) => *v *= 1.02,
        ColorInput::Texture(_) => panic!("no textures here"),
    };
    let same = render(&|_| {});
    assert!(accepts(&same, &reference), "the same scene: {:?}", compare(&same, &reference, LEVEL));
    let light = render(&|d| {
        for e in d.shapes.iter_mut().filter_map(|s| s.emission.as_mut()) {
            brighter(&mut e.radiance);
        }
    });
    assert!(!accepts(&light, &reference), "a light 2 % too bright");
    assert!(!accepts(&same.scaled(1.01), &reference), "a camera 1 % too sensitive");
    let white = render(&|d| {
        for m in &mut d.materials {
            match &mut m.kind {
                MaterialKind::Diffuse { reflectance } if m.name == "white" => brighter(reflectance),
                _ => {}
            }
        }
    });
    assert!(!accepts(&white, &reference), "a wall 2 % too bright");
    let short = render(&|d| d.integrator.max_depth = 4);
    assert!(!accepts(&short, &reference), "paths of four bounces instead of eight");
}

/// Light sampling and BSDF sampling are two estimates of the same picture: any weights that sum to one are right,
/// and no others. Weights of 0.5 and 0.52 are what a wrong MIS weight does.
#[test]
fn references_find_wrong_weights() {
    let case = case("cornell-box");
    let reference = reference(case);
    let by = |estimator, seed, spp| render(description(case), SamplerKind::Independent, seed, estimator, spp);
    let light = by(Estimator::LightOnly, 5, case.spp);
    // Finding the lamp by chance is noisy.
    let bsdf = by(Estimator::BsdfOnly, 6, 4 * case.spp);
    let emitted = {
        let mut d = description(case);
        d.integrator.max_depth = 0;
        render(d, SamplerKind::Independent, 7, Estimator::Mis, case.spp)
    };
    let mixed = |w: f32| Estimate::sum(&[(w, &light), (0.5, &bsdf), (0.5 - w, &emitted)]);
    assert!(accepts(&mixed(0.5), &reference), "{:?}", compare(&mixed(0.5), &reference, LEVEL));
    assert!(!accepts(&mixed(0.52), &reference), "weights that sum to 1.02");
    assert!(!accepts(&mixed(0.48), &reference), "weights that sum to 0.98");
}
