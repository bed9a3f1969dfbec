//! Seconds of whole renders by policy, as section IV.C of Lin and Wu (2015) has them: 8 and 512 samples everywhere, and
//! 8 to 512 by the pooled rule, the machine in the program and the sampler of 2015.
//!
//!     cargo bench -p sparing-adaptive --bench adaptive_vs_uniform
//!
//! Before a scene is timed, the samples of each policy and its mean CIEDE2000 error are printed.

mod common;

use common::{SIDE, paper, scene, svm};
use criterion::{BenchmarkId, Criterion};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::layers::{Limits, Unwatched, render};
use sparing_adaptive::policy::{Policy, Threshold, Uniform};
use sparing_adaptive::state::State;
use sparing_image::film::{Film, FilmOptions};
use sparing_image::metrics::{Exposure, compare};
use sparing_render::integrator::Wave;
use sparing_render::{RenderSettings, Renderer, Scene};
use std::sync::atomic::AtomicBool;

/// Samples of the references.
const REFERENCE: u32 = 4096;

fn run(scene: &Scene, settings: RenderSettings, policy: &mut dyn Policy, max_spp: u32) -> Film {
    let options = policy.film_options();
    let mut state = State::new(Film::new([SIDE; 2], [0, 0, SIDE, SIDE], options));
    let limits = Limits { bounds: Bounds { min_spp: 8, max_spp }, time: None, exposure: None };
    let renderer = Renderer::new(scene, settings, options);
    render(&renderer, &mut state, policy, &limits, &AtomicBool::new(false), &mut Unwatched);
    state.film
}

fn main() {
    type Make = fn() -> Box<dyn Policy>;
    let policies: [(&str, u32, Make); 5] = [
        ("uniform 8", 8, || Box::new(Uniform)),
        ("uniform 512", 512, || Box::new(Uniform)),
        ("threshold", 512, || Box::new(Threshold::new(Goal::Tolerance(1.0)))),
        ("svm", 512, || Box::new(svm())),
        ("paper", 512, || Box::new(paper())),
    ];
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    for name in ["bunny-like", "teapot-like", "killeroo-like"] {
        let (scene, settings) = scene(name);
        let mut truth = Film::new([SIDE; 2], [0, 0, SIDE, SIDE], FilmOptions::default());
        let other = RenderSettings { seed: 990_001, ..settings };
        Renderer::new(&scene, other, truth.options).run(&mut truth, &Wave::default(), |_, _| REFERENCE);
        let mut group = criterion.benchmark_group(format!("adaptive_vs_uniform/{name}"));
        for (policy, max_spp, make) in policies {
            let film = run(&scene, settings, &mut *make(), max_spp);
            let spp = film.samples() as f64 / f64::from(SIDE * SIDE);
            let found = compare(&film.beauty(), &truth.beauty(), SIDE, SIDE, Exposure::Auto);
            let error = found.expect("pictures of one size").ciede2000.mean;
            println!("{name}, {policy}: {spp:.1} samples per pixel, CIEDE2000 {error:.3}");
            let mut policy_ready = make();
            group.bench_function(BenchmarkId::from_parameter(policy), |b| {
                b.iter(|| run(&scene, settings, &mut *policy_ready, max_spp));
            });
        }
        group.finish();
    }
    criterion.final_summary();
}
