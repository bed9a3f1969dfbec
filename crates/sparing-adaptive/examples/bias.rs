//! How much light policies lose: signed error of the picture and of its darkest lit quarter, with standard errors.
//!
//!     cargo run --release -p sparing-adaptive --example bias -- [--first N] [--scenes N] [--seeds N] [--reference SPP] [MODEL]
//!
//! Validation scenes of about 3,700 pixels, rendered evenly to 512 samples with many seeds; policies are replayed on the stored
//! layers with an average of 32 and of 64 samples. The truth is a reference of another seed joined with the even
//! renders: the policies' samples are a small part of it.

#[path = "shared/stage.rs"]
mod stage;

use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{Planned, Policy, Svm, Threshold};
use sparing_adaptive::training::Replay;
use sparing_adaptive::view::View;
use sparing_image::color::luminance;
use sparing_image::film::{Film, FilmOptions};
use stage::Stage;

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 512 };
const SCALE: f64 = 0.6;

/// Makes a policy of an average.
type Make<'a> = &'a dyn Fn(f64) -> Box<dyn Policy>;

/// Luminance in rows.
fn luminances(film: &Film) -> Vec<f64> {
    film.beauty().iter().map(|c| luminance(*c)).collect()
}

/// The quarter of the lit pixels that is darkest.
fn dark(truth: &[f64]) -> Vec<usize> {
    let mut lit: Vec<usize> = (0..truth.len()).filter(|&i| truth[i] > 0.0).collect();
    lit.sort_by(|&a, &b| truth[a].total_cmp(&truth[b]));
    lit.truncate(lit.len() / 4);
    lit
}

/// Mean and standard error in per cent.
fn summary(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0).max(1.0);
    format!("{:+6.2} +- {:.2}", 100.0 * mean, 100.0 * (variance / n).sqrt())
}

/// The threshold at which `planned` takes this average of samples: by bisection of its logarithm.
fn threshold_of(replay: &Replay, average: f64) -> f64 {
    let exposure = View::auto_exposure(&replay.films()[0]);
    let (mut low, mut high) = (1e-4_f64.ln(), 1e4_f64.ln());
    for _ in 0..20 {
        let middle = 0.5 * (low + high);
        let film = replay.run(&mut Planned { goal: Goal::Threshold(middle.exp()) }, exposure, |_, _| ());
        let pixels = f64::from(film.width()) * f64::from(film.height());
        if film.samples() as f64 > average * pixels { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).exp()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut first, mut scenes, mut seeds, mut reference) = (0_u32, 11_u32, 12_u64, 4096_u32);
    let mut model = "models/svm/default.model".to_owned();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--first" => first = value()?.parse()?,
            "--scenes" => scenes = value()?.parse()?,
            "--seeds" => seeds = value()?.parse()?,
            "--reference" => reference = value()?.parse()?,
            path => path.clone_into(&mut model),
        }
    }
    let machine = Machine::read(std::path::Path::new(&model))?;
    let policies: [(&str, Make<'_>); 3] = [
        ("threshold", &|n| Box::new(Threshold::new(Goal::Average(n)))),
        ("svm", &|n| Box::new(Svm::new(Goal::Average(n), machine.clone()))),
        ("planned", &|n| Box::new(Planned { goal: Goal::Average(n) })),
    ];
    println!("signed error in per cent: all pixels | darkest lit quarter");
    for index in first..first.saturating_add(scenes) {
        let stage = Stage::new(index, SCALE)?;
        let film = stage.reference(reference);
        let replays: Vec<Replay> = (0..seeds)
            .map(|k| {
                Replay::new(&stage.scene, stage.size, stage.replicate(k), BOUNDS, FilmOptions::default())
            })
            .collect();
        let mut truth: Vec<f64> = luminances(&film).iter().map(|y| y * f64::from(reference)).collect();
        for replay in &replays {
            let Some(last) = replay.films().last() else { continue };
            truth.iter_mut().zip(luminances(last)).for_each(|(t, y)| *t += y * f64::from(BOUNDS.max_spp));
        }
        let quarter = dark(&truth);
        let share = 1.0 / (f64::from(reference) + f64::from(BOUNDS.max_spp) * seeds as f64);
        let errors = |film: &Film| {
            let ys = luminances(film);
            let of = |pixels: &mut dyn Iterator<Item = usize>| {
                let (y, t) = pixels.fold((0.0, 0.0), |(y, t), i| (y + ys[i], t + truth[i] * share));
                y / t - 1.0
            };
            [of(&mut (0..ys.len())), of(&mut quarter.iter().copied())]
        };
        println!("{}", stage.name);
        let row = |name: &str, all: &[[f64; 2]]| {
            let column = |k: usize| summary(&all.iter().map(|e| e[k]).collect::<Vec<_>>());
            println!("    {name:<14} {} | {}", column(0), column(1));
        };
        let other =
            Replay::new(&stage.scene, stage.size, stage.replicate(seeds), BOUNDS, FilmOptions::default());
        for (average, level) in [(32.0, 2), (64.0, 3)] {
            row(
                &format!("uniform {average}"),
                &replays.iter().map(|r| errors(&r.films()[level])).collect::<Vec<_>>(),
            );
            for (name, make) in policies {
                let run = |r: &Replay| {
                    let exposure = View::auto_exposure(&r.films()[0]);
                    errors(&r.run(&mut *make(average), exposure, |_, _| ()))
                };
                row(&format!("{name} {average}"), &replays.iter().map(run).collect::<Vec<_>>());
            }
            // With a threshold that no sample of these renders has a part in.
            let goal = Goal::Threshold(threshold_of(&other, average));
            let run = |r: &Replay| {
                let exposure = View::auto_exposure(&other.films()[0]);
                errors(&r.run(&mut Planned { goal }, exposure, |_, _| ()))
            };
            row(&format!("planned, fixed {average}"), &replays.iter().map(run).collect::<Vec<_>>());
        }
    }
    Ok(())
}
