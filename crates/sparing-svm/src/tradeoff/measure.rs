//! Decisions of many queries, and the time they take.

use crate::prune::Machine;
use crate::prune::certified::CertifiedCascade;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

/// Queries of a batch that is timed; more do not make a query cheaper.
const BATCH: usize = 2048;
/// Runs that are timed; the median counts.
const RUNS: usize = 7;

/// Values with the machine's exact signs, with all threads.
pub(super) fn decisions(machine: &Machine, rows: &[f64]) -> Vec<f64> {
    batches(rows, machine.features(), |rows, out| machine.decide(rows, out))
}

/// Values of a cascade, with all threads.
pub(super) fn cascade(cascade: &CertifiedCascade, rows: &[f64]) -> Vec<f64> {
    batches(rows, cascade.features(), |rows, out| {
        cascade.decide(rows, out);
    })
}

fn batches(rows: &[f64], features: usize, decide: impl Fn(&[f64], &mut [f64]) + Sync) -> Vec<f64> {
    let mut out = vec![0.0; rows.len() / features];
    out.par_chunks_mut(512).zip(rows.par_chunks(512 * features)).for_each(|(out, rows)| decide(rows, out));
    out
}

/// Nanoseconds a query of one thread in batches; the median of several runs.
pub(super) fn nanoseconds(rows: &[f64], features: usize, mut run: impl FnMut(&[f64], &mut [f64])) -> f64 {
    let count = (rows.len() / features).min(BATCH);
    let rows = &rows[..count * features];
    let mut out = vec![0.0; count];
    run(rows, &mut out); // caches and clocks
    let mut seconds: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            run(black_box(rows), black_box(&mut out));
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[RUNS / 2] * 1e9 / count.max(1) as f64
}
