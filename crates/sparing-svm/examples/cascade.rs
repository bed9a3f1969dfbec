//! How a certified cascade does on a model's own data: `cascade MODEL [SIZE,SIZE..]`. Queries are sampled
//! around the support vectors; prints who decided how many, nanoseconds against the full evaluator, and the
//! flips (always 0).

use sparing_svm::prune::certified::{CascadeOptions, CertifiedCascade};
use sparing_svm::prune::samples;
use sparing_svm::{Evaluator, Model};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let model = Model::read(arguments.next().ok_or("usage: cascade MODEL [SIZE,SIZE..]")?)?;
    let sizes = match arguments.next() {
        Some(list) => Some(list.split(',').map(str::parse).collect::<Result<Vec<usize>, _>>()?),
        None => None,
    };
    let start = Instant::now();
    let cascade = CertifiedCascade::new(&model, &CascadeOptions { sizes, ..Default::default() })?;
    println!("{} vectors, built in {:.2} s", model.len(), start.elapsed().as_secs_f64());
    for level in cascade.levels() {
        println!(
            "level of {}: |f - g| <= {:.4} anywhere (r {:.4}, e {:.2e}); nearest vector used: {}",
            level.size,
            level.bound.anywhere(),
            level.bound.norm(),
            level.bound.at_vectors(),
            level.nearest
        );
    }
    let queries = samples::queries(&model, 50_000, 99);
    let (mut fast, mut exact) = (vec![0.0; 50_000], vec![0.0; 50_000]);
    let full = Evaluator::new(&model)?;
    let mut scratch = cascade.scratch();
    let mut times = Vec::new();
    for _ in 0..5 {
        let start = Instant::now();
        let statistics = cascade.decide_with(&mut scratch, &queries, &mut fast);
        let middle = Instant::now();
        full.decide(&queries, &mut exact);
        times.push(((middle - start).as_nanos() as f64, middle.elapsed().as_nanos() as f64, statistics));
    }
    times.sort_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)));
    let (cascade_ns, full_ns, statistics) = times[2];
    let flips = fast.iter().zip(&exact).filter(|(a, b)| (**a > 0.0) != (**b > 0.0)).count();
    println!(
        "cascade {:.1} ns, full {:.1} ns: {:.2} times faster; flips {flips}\n{statistics:?}",
        cascade_ns / 50_000.0,
        full_ns / 50_000.0,
        full_ns / cascade_ns
    );
    Ok(())
}
