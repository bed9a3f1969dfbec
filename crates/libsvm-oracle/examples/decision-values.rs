//! Prints libSVM's prediction and decision values for each row of a data file, with all digits:
//!
//! ```text
//! decision-values MODEL DATA
//! ```

use libsvm_oracle::{Oracle, Query};
use sparing_svm::data::{Data, DataOptions};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, data] = &arguments[..] else { panic!("decision-values MODEL DATA") };
    let oracle = Oracle::load(model).expect("a model");
    let data = Data::read(data, &DataOptions::default()).expect("data");
    let mut values = vec![0.0; oracle.machines()];
    for i in 0..data.len() {
        let prediction = oracle.evaluate(&Query::new(data.row(i)), &mut values);
        let text: Vec<String> = values.iter().map(|v| format!("{v:e}")).collect();
        println!("{prediction:e} {}", text.join(" "));
    }
}
