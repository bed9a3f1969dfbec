//! How many samples the policies need, relative to uniform sampling, on validation scenes that no machine has seen.
//!
//!     cargo run --release -p sparing-adaptive --example compare_policies -- [--first N] [--scenes N] [--seeds N] [--scale F]
//!         [--reference SPP] [--max-spp 512] [--uniform 64] [MODEL[@STOP,GO_ON] ...]
//!
//! Each scene is rendered evenly to --max-spp samples per pixel with some seeds, and a reference with another one. Policies are
//! replayed on the stored layers, for many thresholds. For each figure of error, the average of samples at which a
//! policy is as good as uniform sampling with --uniform is interpolated in the mean over the seeds; geometric means over scenes.

use sparing_adaptive::features::display_lab;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::machine::Machine;
use sparing_adaptive::policy::{Band, Planned, Policy, Svm, Threshold};
use sparing_adaptive::training::Replay;
use sparing_adaptive::view::View;
use sparing_image::color::{auto_exposure, ciede2000, luminance};
use sparing_image::film::{Film, FilmOptions};
use sparing_image::metrics::REL_MSE_EPSILON;
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::generate::training::{Split, scene};

const FIGURES: &str = "relMSE, p99 dE, p95 dE, mean dE";
/// What a target that is never reached counts as, as in the experiments before.
const UNREACHED: f64 = 3.12;
const THRESHOLDS: u32 = 20;

/// Renders against their reference: the mean of some seeds.
#[derive(Clone, Copy, Default)]
struct Errors {
    spp: f64,
    figures: [f64; 4],
    /// Signed relative error of the darkest lit quarter.
    dark_bias: f64,
}

impl Errors {
    fn add(&mut self, other: &Self) {
        self.spp += other.spp;
        self.dark_bias += other.dark_bias;
        self.figures.iter_mut().zip(other.figures).for_each(|(a, b)| *a += b);
    }

    fn divide(&mut self, count: u64) {
        let count = count.max(1) as f64;
        self.spp /= count;
        self.dark_bias /= count;
        self.figures.iter_mut().for_each(|f| *f /= count);
    }
}

/// Thresholds from hardly any samples beyond the minimum to nearly the maximum; none if nothing shows any error.
fn thresholds(replay: &Replay, exposure: f32) -> Vec<f64> {
    let most = 0.68 * f64::from(replay.bounds().max_spp);
    let Some([largest, smallest]) = replay.thresholds(exposure, [9.0, most]) else { return Vec::new() };
    (0..=THRESHOLDS)
        .map(|k| largest * (smallest / largest).powf(f64::from(k) / f64::from(THRESHOLDS)))
        .collect()
}

struct Truth {
    exposure: f64,
    colours: Vec<[f64; 3]>,
    labs: Vec<[f64; 3]>,
    dark: Vec<usize>,
}

impl Truth {
    fn new(film: &Film) -> Self {
        let exposure = f64::from(auto_exposure(&film.beauty()));
        let colours = film.map(|t, i| (t.pixels[i].mean() * exposure).to_array());
        let y = |i: usize| luminance(colours[i].map(|v| v as f32));
        let mut dark: Vec<usize> = (0..colours.len()).filter(|&i| y(i) > 1e-4).collect();
        dark.sort_by(|&a, &b| y(a).total_cmp(&y(b)));
        dark.truncate(dark.len() / 4);
        let labs = colours.iter().map(|c| display_lab(*c)).collect();
        Self { exposure, colours, labs, dark }
    }

    fn errors(&self, film: &Film) -> Errors {
        let exposed = |p: &[f32; 3]| p.map(|v| f64::from(v) * self.exposure);
        let colours: Vec<[f64; 3]> = film.beauty().iter().map(exposed).collect();
        let pixels = colours.len() as f64;
        let square = |(c, t): (&[f64; 3], &[f64; 3])| {
            (0..3).map(|k| (c[k] - t[k]).powi(2) / (t[k].powi(2) + REL_MSE_EPSILON)).sum::<f64>() / 3.0
        };
        let rel_mse = colours.iter().zip(&self.colours).map(square).sum::<f64>() / pixels;
        let mut perceived: Vec<f64> =
            colours.iter().zip(&self.labs).map(|(c, lab)| ciede2000(display_lab(*c), *lab)).collect();
        perceived.sort_by(f64::total_cmp);
        let rank = |share: f64| perceived[((pixels * share) as usize).min(perceived.len() - 1)];
        let sum = |of: &[[f64; 3]]| {
            self.dark.iter().map(|&i| luminance(of[i].map(|v| v as f32))).sum::<f64>().max(1e-12)
        };
        Errors {
            spp: film.samples() as f64 / pixels,
            figures: [rel_mse, rank(0.99), rank(0.95), perceived.iter().sum::<f64>() / pixels],
            dark_bias: sum(&colours) / sum(&self.colours) - 1.0,
        }
    }
}

/// The average of samples at which a curve reaches a target, interpolated log-log.
fn reached(curve: &[Errors], figure: usize, target: f64) -> Option<f64> {
    let log = |e: f64| e.max(1e-12).ln();
    if curve.first()?.figures[figure] <= target {
        return Some(curve[0].spp);
    }
    curve.windows(2).find_map(|pair| {
        let (a, b) = (log(pair[0].figures[figure]), log(pair[1].figures[figure]));
        let t = (log(target) - a) / (b - a);
        (0.0..=1.0).contains(&t).then(|| (pair[0].spp.ln() + t * (pair[1].spp / pair[0].spp).ln()).exp())
    })
}

/// Makes a policy of a threshold.
type Make = Box<dyn Fn(f64) -> Box<dyn Policy>>;

/// A policy and what was found of it.
struct Entry {
    name: String,
    make: Make,
    /// Logarithms of relative spp, a row a scene.
    logs: Vec<[f64; 4]>,
    /// At about 32 samples on average, one a scene.
    biases: Vec<f64>,
}

impl Entry {
    fn new(name: &str, make: Make) -> Self {
        Self { name: name.to_owned(), make, logs: Vec::new(), biases: Vec::new() }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut scenes, mut seeds, mut scale, mut reference) = (11_u32, 2_u64, 0.6_f64, 4096_u32);
    let mut first = 0_u32;
    let (mut max_spp, mut uniform_spp) = (512_u32, 64_u32);
    let mut entries = vec![
        Entry::new("threshold", Box::new(|l| Box::new(Threshold::new(Goal::Threshold(l))))),
        Entry::new("planned", Box::new(|l| Box::new(Planned { goal: Goal::Threshold(l) }))),
    ];
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--scenes" => scenes = value()?.parse()?,
            "--max-spp" => max_spp = value()?.parse()?,
            "--uniform" => uniform_spp = value()?.parse()?,
            "--first" => first = value()?.parse()?,
            "--seeds" => seeds = value()?.parse()?,
            "--scale" => scale = value()?.parse()?,
            "--reference" => reference = value()?.parse()?,
            name => {
                let (path, band) = name.split_once('@').unwrap_or((name, ""));
                let machine = Machine::read(path)?;
                let band = match band.split_once(',') {
                    Some((stop, go_on)) => Band { stop: stop.parse()?, go_on: go_on.parse()? },
                    None => Band::default(),
                };
                let make: Make = Box::new(move |l| {
                    let mut svm = Svm::new(Goal::Threshold(l), machine.clone());
                    svm.band = band;
                    Box::new(svm)
                });
                entries.push(Entry::new(name, make));
            }
        }
    }
    let bounds = Bounds { min_spp: 8, max_spp };
    let level = (uniform_spp / bounds.min_spp).max(1).ilog2() as usize;
    let mut even_biases = Vec::new();
    for index in first..first.saturating_add(scenes) {
        let mut description = scene(index, 1, Split::Validation);
        let side = |pixels: u32| (f64::from(pixels) * scale).round().max(1.0) as u32;
        let size = [side(description.film.width), side(description.film.height)];
        // The camera is built for the film's size.
        [description.film.width, description.film.height] = size;
        let settings = RenderSettings { max_depth: description.integrator.max_depth, ..Default::default() };
        println!("{}", description.name);
        let built = Scene::build(description, BuildOptions { threads: 0, robust: true })?;
        let mut film = Film::new(size, [0, 0, size[0], size[1]], FilmOptions::default());
        let best = RenderSettings { seed: 990_001, ..settings };
        let renderer = Renderer::new(&built, best, FilmOptions::default());
        renderer.run(&mut film, &Wave::default(), |_, _| reference);
        let truth = Truth::new(&film);
        let mut uniform = Errors::default();
        let mut curves: Vec<Vec<Errors>> = vec![Vec::new(); entries.len()];
        let mut lambdas = Vec::new();
        for seed in 0..seeds {
            let settings = RenderSettings { seed: 7000 + seed, ..settings };
            let replay = Replay::new(&built, size, settings, bounds, FilmOptions::default());
            let exposure = View::auto_exposure(&replay.films()[0]);
            uniform.add(&truth.errors(&replay.films()[level]));
            even_biases.push(truth.errors(&replay.films()[2]).dark_bias);
            if lambdas.is_empty() {
                lambdas = thresholds(&replay, exposure);
            }
            for (entry, curve) in entries.iter().zip(&mut curves) {
                curve.resize(lambdas.len(), Errors::default());
                for (sum, &lambda) in curve.iter_mut().zip(&lambdas) {
                    sum.add(&truth.errors(&replay.run(&mut *(entry.make)(lambda), exposure, |_, _| ())));
                }
            }
        }
        uniform.divide(seeds);
        for (entry, curve) in entries.iter_mut().zip(&mut curves) {
            curve.iter_mut().for_each(|e| e.divide(seeds));
            entry.logs.push(std::array::from_fn(|figure| {
                let spp = reached(curve, figure, uniform.figures[figure]);
                spp.map_or(UNREACHED, |spp| spp / uniform.spp).ln()
            }));
            let off = |e: &Errors| (e.spp / 32.0).ln().abs();
            let nearest = curve.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            entry.biases.extend(nearest.map(|e| e.dark_bias));
        }
        for entry in &entries {
            println!(
                "    {:<44} {}",
                entry.name,
                joined(&entry.logs.last().map_or([0.0; 4], |l| l.map(f64::exp)))
            );
        }
    }
    report(&entries, &even_biases, uniform_spp);
    Ok(())
}

fn joined(values: &[f64; 4]) -> String {
    values.map(|v| format!("{v:.3}")).join(" ")
}

fn report(entries: &[Entry], even_biases: &[f64], uniform_spp: u32) {
    println!(
        "\nspp relative to uniform {uniform_spp} at equal {FIGURES} | against threshold | worst scene against it | "
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
