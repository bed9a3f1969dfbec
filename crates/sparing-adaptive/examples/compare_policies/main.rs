//! How many samples the policies need, relative to uniform sampling, on validation scenes that no machine has seen.
//!
//!     cargo run --release -p sparing-adaptive --example compare_policies -- [--first N] [--scenes N] [--seeds N] [--scale F]
//!         [--reference SPP] [--max-spp 512] [--uniform 64] [--try GROUP ...] [MODEL[+MODEL ...][@STOP,GO_ON] ...]
//!
//! Each scene is rendered evenly to --max-spp samples per pixel with some seeds, and a reference with another one. Policies are
//! replayed on the stored layers, for many thresholds. For each figure of error, the average of samples at which a
//! policy is as good as uniform sampling with --uniform is interpolated in the mean over the seeds; geometric means over scenes.
//! Groups are `cures`, `pooling`, `units`, `layers`, `powers` and `budget`: variants of the pooled rule.

mod entries;
mod errors;
mod rule;
#[path = "../shared/stage.rs"]
mod stage;

use entries::Entry;
use errors::{Errors, FIGURES, Truth, reached};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::training::Replay;
use sparing_adaptive::view::View;
use sparing_image::film::FilmOptions;
use stage::Stage;

/// What a target that is never reached counts as, as in the experiments before.
const UNREACHED: f64 = 3.12;
const KNOBS: u32 = 20;

/// Knobs of all policies: thresholds from hardly any samples beyond the minimum to nearly the maximum, and averages.
struct Knobs {
    thresholds: Vec<f64>,
    averages: Vec<f64>,
}

impl Knobs {
    /// None if nothing in the picture shows any error.
    fn new(replay: &Replay, exposure: f32) -> Option<Self> {
        let ends = [1.1, 0.68 * f64::from(replay.bounds().max_spp) / f64::from(replay.bounds().min_spp)]
            .map(|n| n * f64::from(replay.bounds().min_spp));
        let steps = |[a, b]: [f64; 2]| {
            (0..=KNOBS).map(|k| a * (b / a).powf(f64::from(k) / f64::from(KNOBS))).collect()
        };
        Some(Self { thresholds: steps(replay.thresholds(exposure, ends)?), averages: steps(ends) })
    }

    fn goals(&self, entry: &Entry) -> Vec<Goal> {
        if entry.averages {
            self.averages.iter().map(|n| Goal::Average(*n)).collect()
        } else {
            self.thresholds.iter().map(|l| Goal::Threshold(*l)).collect()
        }
    }
}

struct Arguments {
    first: u32,
    scenes: u32,
    seeds: u64,
    scale: f64,
    reference: u32,
    max_spp: u32,
    uniform: u32,
    groups: Vec<String>,
    models: Vec<String>,
}

fn arguments() -> Result<Arguments, Box<dyn std::error::Error>> {
    let mut a = Arguments {
        first: 0,
        scenes: 11,
        seeds: 2,
        scale: 0.6,
        reference: 4096,
        max_spp: 512,
        uniform: 64,
        groups: Vec::new(),
        models: Vec::new(),
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--scenes" => a.scenes = value()?.parse()?,
            "--max-spp" => a.max_spp = value()?.parse()?,
            "--uniform" => a.uniform = value()?.parse()?,
            "--first" => a.first = value()?.parse()?,
            "--seeds" => a.seeds = value()?.parse()?,
            "--scale" => a.scale = value()?.parse()?,
            "--reference" => a.reference = value()?.parse()?,
            "--try" => a.groups.push(value()?),
            name => a.models.push(name.to_owned()),
        }
    }
    Ok(a)
}

/// All doublings of the minimum within the bounds, and for finer layers what lies half-way.
fn counts(bounds: Bounds, finer: bool) -> Vec<u32> {
    let mut counts = vec![bounds.min_spp];
    while counts[counts.len() - 1] <= bounds.max_spp / 2 {
        let last = counts[counts.len() - 1];
        counts.extend(finer.then_some(last / 2 * 3));
        counts.push(2 * last);
    }
    counts
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let a = arguments()?;
    let mut entries = entries::base();
    for group in &a.groups {
        entries.extend(entries::tries(group, a.max_spp)?);
    }
    for model in &a.models {
        entries.push(entries::machine(model)?);
        if a.groups.iter().any(|g| g == "budget") {
            entries.push(entries::machine(model)?.by_average());
        }
    }
    let bounds = Bounds { min_spp: 8, max_spp: a.max_spp };
    let counts = counts(bounds, a.groups.iter().any(|g| g == "layers"));
    let options =
        FilmOptions { auxiliary: !a.groups.is_empty(), shapes: !a.groups.is_empty(), luminance: false };
    let mut even_biases = Vec::new();
    for index in a.first..a.first.saturating_add(a.scenes) {
        let stage = Stage::new(index, a.scale)?;
        println!("{}", stage.name);
        let truth = Truth::new(&stage.reference(a.reference));
        let mut uniform = Errors::default();
        let mut knobs = None;
        for seed in 0..a.seeds {
            let settings = stage.replicate(seed);
            let replay = Replay::with_counts(&stage.scene, stage.size, settings, &counts, options);
            let exposure = View::auto_exposure(&replay.films()[0]);
            let even = |spp: u32| {
                let level = counts.iter().position(|n| *n >= spp).unwrap_or(counts.len() - 1);
                truth.errors(&replay.films()[level])
            };
            uniform.add(&even(a.uniform));
            even_biases.push(even(32).dark_bias);
            knobs = knobs.or_else(|| Knobs::new(&replay, exposure));
            let Some(knobs) = &knobs else { continue };
            for entry in &mut entries {
                let goals = knobs.goals(entry);
                entry.curve.resize(goals.len(), Errors::default());
                let capped = entry.cap.map(|cap| replay.up_to(cap));
                let replay = capped.as_ref().unwrap_or(&replay);
                for (sum, &goal) in entry.curve.iter_mut().zip(&goals) {
                    sum.add(&truth.errors(&replay.run(&mut *(entry.make)(goal), exposure, |_, _| ())));
                }
            }
        }
        uniform.divide(a.seeds);
        for entry in &mut entries {
            let mut curve = std::mem::take(&mut entry.curve);
            curve.iter_mut().for_each(|e| e.divide(a.seeds));
            entry.logs.push(std::array::from_fn(|figure| {
                let spp = reached(&curve, figure, uniform.figures[figure]);
                spp.map_or(UNREACHED, |spp| spp / uniform.spp).ln()
            }));
            let off = |e: &Errors| (e.spp / 32.0).ln().abs();
            let nearest = curve.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            entry.biases.extend(nearest.map(|e| e.dark_bias));
        }
        for entry in &entries {
            let relative = entry.logs.last().map_or([0.0; 4], |l| l.map(f64::exp));
            println!("    {:<44} {}", entry.name, joined(&relative));
        }
    }
    report(&entries, &even_biases, a.uniform);
    Ok(())
}

fn joined(values: &[f64; 4]) -> String {
    values.map(|v| format!("{v:.3}")).join(" ")
}

fn report(entries: &[Entry], even_biases: &[f64], uniform: u32) {
    println!(
        "\nspp relative to uniform {uniform} at equal {FIGURES} | against threshold | worst scene against it | "
    );
    println!("mean and lowest signed error of the darkest lit quarter at 32 spp");
    let base = &entries[0];
    for entry in entries {
        let scenes = entry.logs.len().max(1) as f64;
        let mean = |f: usize| entry.logs.iter().map(|l| l[f]).sum::<f64>() / scenes;
        let base_mean = |f: usize| base.logs.iter().map(|l| l[f]).sum::<f64>() / scenes;
        let worst = |f: usize| {
            let pairs = entry.logs.iter().zip(&base.logs);
            pairs.map(|(a, b)| (a[f] - b[f]).exp()).fold(0.0, f64::max)
        };
        println!(
            "{:<44} {} | {} | {} | {:+.2} % {:+.2} %",
            entry.name,
            joined(&std::array::from_fn(|f| mean(f).exp())),
            joined(&std::array::from_fn(|f| (mean(f) - base_mean(f)).exp())),
            joined(&std::array::from_fn(worst)),
            100.0 * entry.biases.iter().sum::<f64>() / entry.biases.len().max(1) as f64,
            100.0 * entry.biases.iter().copied().fold(f64::INFINITY, f64::min),
        );
    }
    let even = even_biases.iter().sum::<f64>() / even_biases.len().max(1) as f64;
    println!("uniform 32: {:+.2} %", 100.0 * even);
}
