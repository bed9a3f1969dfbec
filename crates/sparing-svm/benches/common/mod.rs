//! The machine and the programs that the benches compare.

use ffsvm::{DenseSVM, FeatureVector, Predict};
use libsvm_oracle::{Oracle, Query};
use sparing_svm::data::Data;
use sparing_svm::evaluator::{ExpMethod, InstructionSet, Options};
use sparing_svm::range::Scaling;
use sparing_svm::train::Parameters;
use sparing_svm::{Evaluator, Model};
use std::hint::black_box;
use testkit::svm_data;

/// A machine and queries that it was not trained on.
pub struct Setting {
    pub model: Model,
    pub queries: Vec<f64>,
}

pub fn setting(rows: usize, count: usize) -> Setting {
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
pub struct Contender<'a> {
    pub name: String,
    pub run: Box<dyn FnMut() + 'a>,
}

pub fn contenders(setting: &Setting) -> Vec<Contender<'_>> {
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
    // ffsvm refuses files that leave zeros out: give it numbers that are zero in its f32.
    let mut dense = setting.model.clone();
    dense.support_vectors.iter_mut().filter(|x| **x == 0.0).for_each(|x| *x = 1e-300);
    let text = dense.to_text().expect("the model can be written");
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
        for exp in [ExpMethod::Table, ExpMethod::Polynomial5] {
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
