//! The evaluator against libSVM (the installed libsvm.so.3) and the crate `ffsvm`, on a machine of about 5,000 support
//! vectors and 8 features: `cargo bench -p sparing-svm --bench evaluator`.
//!
//! Throughput is in kernel values a second: queries times support vectors, whether or not they were evaluated.
//! After the criterion runs, a table of all in ns and as ratios, measured in turns, so that a noisy machine disturbs
//! all alike.

use criterion::{BenchmarkId, Criterion, Throughput};
use ffsvm::{DenseSVM, FeatureVector, Predict};
use libsvm_oracle::{Oracle, Query};
use sparing_svm::data::Data;
use sparing_svm::evaluator::{ExpMethod, InstructionSet, Options};
use sparing_svm::range::Scaling;
use sparing_svm::train::Parameters;
use sparing_svm::{Evaluator, Model};
use std::hint::black_box;
use std::time::{Duration, Instant};
use testkit::svm_data;

/// A machine and queries that it was not trained on.
struct Setting {
    model: Model,
    queries: Vec<f64>,
}

fn setting(rows: usize, count: usize) -> Setting {
    let data = |seed, rows| {
        let made = svm_data::pixels(rows, seed);
        Data::new(made.features, made.rows, made.labels).expect("made-up data are valid")
    };
    let training = data(1, rows);
    let scaling = Scaling::fit(&training, 0.0, 1.0).expect("features vary");
    let model = Parameters::rbf(10.0, 2.0)
        .train(&scaling.apply_data(training).expect("same features"))
        .expect("the data can be trained on");
    let queries = scaling.apply_data(data(2, count)).expect("same features").rows;
    Setting { model, queries }
}

/// Something that evaluates all queries.
struct Contender<'a> {
    name: String,
    run: Box<dyn FnMut() + 'a>,
}

fn contenders(setting: &Setting) -> Vec<Contender<'_>> {
    let mut all = Vec::new();
    let queries = &setting.queries;
    let features = setting.model.features;
    let count = queries.len() / features;
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    setting.model.write(file.path()).expect("the model can be written");
    if libsvm_oracle::is_available() {
        let version = libsvm_oracle::version().expect("a version");
        let oracle = Oracle::load(file.path()).expect("libSVM reads the model");
        let nodes: Vec<Query> = queries.chunks_exact(features).map(Query::new).collect();
        let mut values = [0.0];
        let run = Box::new(move || {
            for query in &nodes {
                black_box(oracle.evaluate(query, &mut values));
            }
        });
        all.push(Contender { name: format!("libSVM {version}"), run });
    }
    let text = setting.model.to_text().expect("the model can be written");
    let svm = DenseSVM::try_from(text.as_str()).expect("ffsvm reads the model");
    let mut vector = FeatureVector::from(&svm);
    let run = Box::new(move || {
        for query in queries.chunks_exact(features) {
            for (slot, x) in vector.features().iter_mut().zip(query) {
                *slot = *x as f32;
            }
            svm.predict_value(&mut vector).expect("ffsvm evaluates");
            black_box(vector.label());
        }
    });
    all.push(Contender { name: "ffsvm 0.12".to_owned(), run });
    for set in InstructionSet::ALL.into_iter().filter(|s| s.is_available()) {
        for exp in [ExpMethod::Table, ExpMethod::Polynomial5, ExpMethod::Polynomial4, ExpMethod::CoarseTable]
        {
            let options = Options { exp, instruction_set: Some(set) };
            let evaluator = Evaluator::compile(&setting.model, &options).expect("the model is valid");
            let mut values = vec![0.0; count];
            let twin = evaluator.clone();
            let run = Box::new(move || {
                evaluator.decision_values(black_box(queries), &mut values);
                black_box(&values);
            });
            all.push(Contender { name: format!("{} {} values", set.name(), exp.name()), run });
            let mut values = vec![0.0; count];
            let run = Box::new(move || {
                twin.decide(black_box(queries), &mut values);
                black_box(&values);
            });
            all.push(Contender { name: format!("{} {} decide", set.name(), exp.name()), run });
        }
    }
    all
}

/// The median time of several turns, for each contender.
fn table(setting: &Setting) {
    let values = (setting.model.len() * setting.queries.len() / setting.model.features) as f64;
    let mut all = contenders(setting);
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); all.len()];
    for _ in 0..7 {
        for (contender, times) in all.iter_mut().zip(&mut times) {
            let start = Instant::now();
            let mut runs = 0.0;
            while runs == 0.0 || start.elapsed() < Duration::from_millis(60) {
                (contender.run)();
                runs += 1.0;
            }
            times.push(start.elapsed().as_secs_f64() / runs * 1e9 / values);
        }
    }
    let median = |t: &Vec<f64>| {
        let mut t = t.clone();
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    };
    println!(
        "\n{} support vectors, {} queries",
        setting.model.len(),
        setting.queries.len() / setting.model.features
    );
    println!("{:32} {:>12} {:>10} {:>10}", "", "ns per value", "x libSVM", "x ffsvm");
    let (first, second) = (median(&times[0]), median(&times[1.min(times.len() - 1)]));
    for (contender, times) in all.iter().zip(&times) {
        let ns = median(times);
        println!("{:32} {ns:12.4} {:10.1} {:10.1}", contender.name, first / ns, second / ns);
    }
}

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
    if std::env::args().any(|a| a == "--bench") {
        table(&setting);
    }
}
