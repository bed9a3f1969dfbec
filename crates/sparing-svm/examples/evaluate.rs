//! Evaluates a model fast: values, bounds, effort and speed.
//!
//!     cargo run -p sparing-svm --release --example evaluate -- [MODEL DATA]
//!
//! Without arguments it trains on made-up data first.

use sparing_svm::train::Parameters;
use sparing_svm::{Data, Evaluator, Model};
use std::time::Instant;

fn main() -> sparing_svm::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (model, data) = match &arguments[..] {
        [model, data] => {
            let model = Model::read(model)?;
            let options =
                sparing_svm::data::DataOptions { features: Some(model.features), ..Default::default() };
            (model, Data::read(data, &options)?)
        }
        _ => {
            let made = |seed, rows| {
                let made = testkit::svm_data::pixels(rows, seed);
                Data::new(made.features, made.rows, made.labels)
            };
            (Parameters::rbf(1.0, 1.0).train(&made(1, 3000)?)?, made(2, 10_000)?)
        }
    };
    let evaluator = Evaluator::new(&model)?;
    println!("{} support vectors, {} features", model.len(), model.features);
    println!("{}, error at most {:.1e}", evaluator.instruction_set().name(), evaluator.error_bound());

    let mut values = vec![0.0; data.len() * evaluator.machines()];
    let mut bounds = values.clone();
    evaluator.decision_values_with_bounds(&data.rows, &mut values, &mut bounds);
    for (value, bound) in values.iter().zip(&bounds).take(3) {
        println!("decision value {value:.6} +- {bound:.1e}");
    }
    let start = Instant::now();
    let effort = evaluator.decide(&data.rows, &mut values);
    let ns = start.elapsed().as_secs_f64() * 1e9;
    println!(
        "{} decisions, {:.0} ns each; {} settled in f32, {} in f64, {} by the definition",
        effort.total(),
        ns / effort.total() as f64,
        effort.single,
        effort.double,
        effort.definition
    );
    if model.machines() == 1 {
        let right = values.iter().zip(&data.labels).filter(|(v, l)| model.prediction(&[**v]) == **l);
        println!("{:.2} % right", 100.0 * right.count() as f64 / data.len() as f64);
    }
    Ok(())
}
