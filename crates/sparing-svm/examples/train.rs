//! Searches C and gamma, trains, and writes a model that libSVM's tools read, with its ranges.
//!
//!     cargo run -p sparing-svm --release --example train -- [DATA] MODEL
//!
//! Without DATA (a libSVM data file) it makes data up.

use sparing_svm::data::DataOptions;
use sparing_svm::train::{Control, Folds, Grid, Parameters, grid_search};
use sparing_svm::{Data, Evaluator, Scaling};

fn main() -> sparing_svm::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (data, file) = match &arguments[..] {
        [data, model] => (Data::read(data, &DataOptions::default())?, model),
        [model] => {
            let made = testkit::svm_data::pixels(1500, 1);
            (Data::new(made.features, made.rows, made.labels)?, model)
        }
        _ => {
            eprintln!("usage: train [DATA] MODEL");
            std::process::exit(2);
        }
    };
    let scaling = Scaling::fit(&data, 0.0, 1.0)?;
    let data = scaling.apply_data(data)?;
    let folds = Folds::stratified(&data, 5, 1)?;
    let grid = Grid { c: vec![0.1, 1.0, 10.0], gamma: vec![0.25, 1.0, 4.0] };
    let found = grid_search(&Parameters::rbf(1.0, 1.0), &grid, &data, &folds, &Control::default())?;
    println!("C = {}, gamma = {}: {:?}", found.best_point.c, found.best_point.gamma, found.best_point.scores);
    let model = found.best.train(&data)?;
    model.write(file)?;
    scaling.write(format!("{file}.range"))?;
    println!("{}: {} support vectors; {file}.range", file, model.len());
    println!("compiled: {} bytes", Evaluator::new(&model)?.bytes());
    Ok(())
}
