//! The evaluator against libSVM (the installed libsvm.so.3) and the crate `ffsvm`, on a machine of about 5,000 support
//! vectors and 8 features: `cargo bench -p sparing-svm --bench evaluator`.
//!
//! Throughput is in kernel values a second: queries times support vectors, whether or not they were evaluated. For
//! ratios on a noisy machine use the bench `comparison`.

mod common;

use common::{contenders, setting};
use criterion::{BenchmarkId, Criterion, Throughput};
use std::time::Duration;

fn main() {
    let setting = setting(12_000, 1024);
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    let values = setting.model.len() * setting.queries.len() / setting.model.features;
    let mut group = criterion.benchmark_group("evaluator");
    group.throughput(Throughput::Elements(values as u64)).measurement_time(Duration::from_secs(1));
    for contender in &mut contenders(&setting) {
        let id = BenchmarkId::new(&contender.name, setting.model.len());
        group.bench_function(id, |b| b.iter(|| (contender.run)()));
    }
    group.finish();
    criterion.final_summary();
}
