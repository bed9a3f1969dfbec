//! Time of a decision at each layer's barrier, features included, for the sampler of 2015 and the machine in the program:
//! `cargo bench -p sparing-adaptive --bench svm_decide`.
//!
//! Throughput is in pixels of the picture a second. The machine in the program is asked only near the rule's threshold.

mod common;

use common::{SIDE, paper, scene, svm};
use criterion::{BatchSize, BenchmarkId, Criterion, Throughput};
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::policy::paper::LAYERS;
use sparing_adaptive::policy::{Barrier, Policy};
use sparing_adaptive::view::View;
use sparing_image::film::Film;
use sparing_render::Renderer;
use sparing_render::integrator::Wave;

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(20);
    let (scene, settings) = scene("bunny-like");
    let (paper, svm) = (paper(), svm());
    let options = paper.film_options();
    let renderer = Renderer::new(&scene, settings, options);
    let mut film = Film::new([SIDE; 2], [0, 0, SIDE, SIDE], options);
    let bounds = Bounds { min_spp: 8, max_spp: 512 };
    let mut group = criterion.benchmark_group("svm_decide");
    group.throughput(Throughput::Elements(u64::from(SIDE * SIDE)));
    for samples in LAYERS {
        renderer.run(&mut film, &Wave::default(), |_, _| samples);
        let exposure = View::auto_exposure(&film);
        let fresh = |name| -> Box<dyn Policy> {
            if name == "paper" { Box::new(paper.clone()) } else { Box::new(svm.clone()) }
        };
        for name in ["paper", "svm"] {
            group.bench_function(BenchmarkId::new(name, samples), |b| {
                let decide = |mut policy: Box<dyn Policy>| {
                    policy.decide(&Barrier::new(&film, &Ledger::default(), bounds, exposure))
                };
                // A policy that was asked before remembers.
                b.iter_batched(|| fresh(name), decide, BatchSize::SmallInput);
            });
        }
    }
    group.finish();
    criterion.final_summary();
}
