//! Writes made-up data for support vector machines to standard output, as a libSVM data file:
//!
//! ```text
//! svm-data pixels ROWS SEED
//! svm-data blobs ROWS FEATURES CLASSES SEED
//! svm-data curve ROWS FEATURES SEED
//! ```
//!
//! A share of zeros may follow, for example 0.2.

use testkit::svm_data::{blobs, curve, pixels};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let kind = arguments.first().map_or("", String::as_str);
    let numbers: Vec<f64> = arguments.iter().skip(1).map(|a| a.parse().expect("a number")).collect();
    let whole = |i: usize| numbers[i] as usize;
    let (data, used) = match (kind, numbers.len()) {
        ("pixels", 2..=3) => (pixels(whole(0), whole(1) as u64), 2),
        ("blobs", 4..=5) => (blobs(whole(0), whole(1), whole(2), whole(3) as u64), 4),
        ("curve", 3..=4) => (curve(whole(0), whole(1), whole(2) as u64), 3),
        _ => panic!(
            "svm-data pixels ROWS SEED | blobs ROWS FEATURES CLASSES SEED | curve ROWS FEATURES SEED [ZEROS]"
        ),
    };
    let data = numbers.get(used).map_or(data.clone(), |share| data.with_zeros(*share, 1));
    print!("{}", data.to_text());
}
