//! All contenders in turns, so that a noisy machine disturbs all alike: ns a kernel value, and how many times faster
//! than libSVM and ffsvm. `cargo bench -p sparing-svm --bench comparison`

mod common;

use common::{Setting, contenders, setting};
use std::time::{Duration, Instant};

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
    // `cargo test` builds and runs benches without this.
    if std::env::args().any(|a| a == "--bench") {
        table(&setting(12_000, 1024));
    }
}
