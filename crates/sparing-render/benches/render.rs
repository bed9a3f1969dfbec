//! Criterion benches: whole renders, what each skipped need saves, random numbers.
//!
//!     cargo bench -p sparing-render --bench render

#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::sampler::{Dimension, PixelSampler, SamplerKind};
use sparing_render::{BuildOptions, Needs, RenderSettings, Renderer, Scene};
use std::hint::black_box;
use std::path::Path;

const SIZE: u32 = 64;
const SPP: u32 = 16;

fn scene(name: &str) -> (Scene, RenderSettings) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let mut d = sparing_scene::load(&path).unwrap_or_else(|e| panic!("{}", e.report()));
    (d.film.width, d.film.height) = (SIZE, SIZE);
    let settings = RenderSettings { max_depth: d.integrator.max_depth, ..RenderSettings::default() };
    (Scene::build(d, BuildOptions::default()).expect("the scene builds"), settings)
}

fn run(renderer: &Renderer<'_>) -> Film {
    let mut film = Film::new([SIZE, SIZE], [0, 0, SIZE, SIZE], FilmOptions::default());
    renderer.run(&mut film, &Wave::default(), |_, _| SPP);
    film
}

fn scenes(c: &mut Criterion) {
    let mut group = c.benchmark_group("render");
    group.sample_size(20).throughput(Throughput::Elements(u64::from(SIZE * SIZE * SPP)));
    for name in ["cornell-box.pbrt", "mesh.pbrt", "demo.pbrt", "tests/glass.pbrt", "tests/instances.pbrt"] {
        let (scene, settings) = scene(name);
        let renderer = Renderer::new(&scene, settings, FilmOptions::default());
        group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter(|| run(&renderer)));
    }
    group.finish();
}

/// The Cornell box needs little: each bench adds the code of one need that it does not have.
fn needs(c: &mut Criterion) {
    let (scene, settings) = scene("cornell-box.pbrt");
    let mut group = c.benchmark_group("needs");
    group.sample_size(30);
    let own = Renderer::with_needs(&scene, settings, Needs::empty());
    group.bench_function("own only", |b| b.iter(|| run(&own)));
    let extras = Needs::TEXTURE_COORDINATES | Needs::SHADING_NORMALS | Needs::CHOICE;
    for (name, flag) in [
        ("with texture coordinates and tangents", Needs::TEXTURE_COORDINATES | Needs::TANGENTS),
        ("with shading normals and instances", Needs::SHADING_NORMALS | Needs::INSTANCES),
        ("with choice", Needs::CHOICE),
        ("with all of these", extras | Needs::TANGENTS | Needs::INSTANCES),
    ] {
        let renderer = Renderer::with_needs(&scene, settings, flag);
        group.bench_function(name, |b| b.iter(|| run(&renderer)));
    }
    group.finish();
}

fn random_numbers(c: &mut Criterion) {
    let mut group = c.benchmark_group("sampler");
    group.throughput(Throughput::Elements(16));
    for (name, kind) in [("sobol", SamplerKind::Sobol), ("independent", SamplerKind::Independent)] {
        let s = PixelSampler::new(kind, 1, 2, 3);
        group.bench_function(format!("{name}, packet of 16"), |b| {
            b.iter(|| black_box(s.get_2d_packet(black_box(32), 3, Dimension::Light)));
        });
        group.bench_function(format!("{name}, one by one"), |b| {
            b.iter(|| {
                std::array::from_fn::<_, 16, _>(|i| s.get_2d(black_box(32) + i as u32, 3, Dimension::Light))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, scenes, needs, random_numbers);
criterion_main!(benches);
