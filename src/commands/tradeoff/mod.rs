//! `sparing tradeoff`.

mod plot;

use super::Usage;
use super::options::threads;
use crate::plot::write_text;
use crate::session::console::{note, print};
use crate::session::progress::clock;
use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use sparing_image::atomic::check_writable;
use sparing_svm::data::{Data, DataOptions};
use sparing_svm::model::ReadOptions;
use sparing_svm::prune::{Method, PruneError};
use sparing_svm::range::Scaling;
use sparing_svm::tradeoff::{Labelled, Point, Source, Tradeoff, TradeoffOptions, tradeoff};
use sparing_svm::{Card, Model};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Arguments of `sparing tradeoff`.
#[derive(Debug, Args)]
pub(super) struct TradeoffArguments {
    /// A libSVM model of two classes (or one class).
    model: PathBuf,
    /// Labelled data in libSVM's format: a random half is fitted, the other measured. Without, queries are
    /// sampled around the model's support vectors, and agreement with the full machine stands for accuracy.
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    /// A range file of svm-scale that scales the data as the model was trained.
    #[arg(long, value_name = "FILE", requires = "data")]
    range: Option<PathBuf>,
    /// Ways to prune: drop, random, kmeans, cholesky or greedy, and after a dash how coefficients are found:
    /// keep, rkhs, fit, labels or logistic; or retrain. Default: a choice of them.
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = method)]
    methods: Vec<Method>,
    /// Numbers of vectors.
    #[arg(long, value_name = "N,..", value_delimiter = ',', default_value = "16,32,64,128,256,512",
        value_parser = vectors, allow_negative_numbers = true)]
    sizes: Vec<usize>,
    /// Leave out the certified cascade.
    #[arg(long)]
    no_certified: bool,
    /// Seed of all random choices.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// Folder, made if missing, for tradeoff.csv, tradeoff.json, tradeoff.svg and tradeoff.png.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write the best machine of at most this many vectors as picked.model, with a card if the model has one.
    #[arg(long, value_name = "SIZE", value_parser = vectors, conflicts_with = "max_loss", allow_negative_numbers = true)]
    pick: Option<usize>,
    /// Write the smallest machine that loses at most so many percentage points of accuracy (without data: of
    /// agreement) as picked.model.
    #[arg(long, value_name = "POINTS", value_parser = loss, allow_negative_numbers = true)]
    max_loss: Option<f64>,
    /// Threads, at most 1024; 0 is all.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: usize,
}

/// Most vectors of a reduced machine: its fit takes memory for this number times the model's vectors or the
/// data's rows.
const MOST_VECTORS: usize = 4096;

fn vectors(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(n @ 1..=MOST_VECTORS) => Ok(n),
        _ => Err(format!("'{text}' is not a number of vectors from 1 to {MOST_VECTORS}")),
    }
}

fn loss(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..=100.0).contains(&v) => Ok(v),
        _ => Err(format!("'{text}' is not a number of percentage points from 0 to 100")),
    }
}

fn method(text: &str) -> Result<Method, String> {
    text.trim().parse().map_err(|e: PruneError| e.to_string())
}

/// Names of what is written.
const FILES: [&str; 4] = ["tradeoff.csv", "tradeoff.json", "tradeoff.svg", "tradeoff.png"];
const PICKED: &str = "picked.model";

pub(super) fn run(a: &TradeoffArguments) -> anyhow::Result<ExitCode> {
    let methods = if a.methods.is_empty() { Method::defaults(a.data.is_some()) } else { a.methods.clone() };
    if let Some(method) = methods.iter().find(|m| m.needs_labels() && a.data.is_none()) {
        return Err(Usage::error(format!("the method {method} needs labelled data: give --data")));
    }
    // While the flag is set, a signal ends the process: nothing has been written then.
    let armed = Arc::new(AtomicBool::new(true));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&armed))?;
    }
    let start = Instant::now();
    let (model, data) = read(a)?;
    let card = if Card::path(&a.model).is_file() { Some(Card::read(&a.model)?) } else { None };
    std::fs::create_dir_all(&a.output)
        .with_context(|| format!("cannot make the folder {}", a.output.display()))?;
    let picks = a.pick.is_some() || a.max_loss.is_some();
    for name in FILES.into_iter().chain(picks.then_some(PICKED)) {
        check_writable(&a.output.join(name))?;
    }
    let mut sizes = a.sizes.clone();
    sizes.extend(a.pick.filter(|n| *n < model.len()));
    sizes.sort_unstable();
    sizes.dedup();
    let options = TradeoffOptions { methods, sizes, seed: a.seed, certified: !a.no_certified };
    let labelled = data.as_ref().map(|d| Labelled { rows: &d.rows, labels: &d.labels });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(a.threads).build()?;
    let bar = bar();
    let result = pool.install(|| {
        tradeoff(&model, labelled, &options, &mut |p| {
            if let Some(bar) = &bar {
                bar.set_length(p.total as u64);
                bar.set_position(p.done as u64);
                bar.set_message(p.next.to_owned());
            }
            ControlFlow::Continue(())
        })
    });
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let result = result.with_context(|| format!("cannot prune {}", a.model.display()))?;
    let picked = pick(&result, a)?;
    armed.store(false, Ordering::SeqCst); // from here on it takes a moment, and is finished
    write(&result, picked, card, &a.output)?;
    print(table(&result))?;
    for s in &result.skipped {
        note(format_args!("warning: {} with {} vectors left out: {}", s.method, s.size, s.reason));
    }
    if let Some(p) = picked {
        print(format_args!(
            "picked {} with {} vectors: {}",
            p.method,
            p.vectors,
            a.output.join(PICKED).display()
        ))?;
    }
    note(format_args!("{} in {}", a.output.display(), clock(start.elapsed().as_secs_f64())));
    Ok(ExitCode::SUCCESS)
}

/// The model and the scaled data, with as many features as the one that has most: files leave zeros out.
fn read(a: &TradeoffArguments) -> anyhow::Result<(Model, Option<Data>)> {
    let mut model = Model::read(&a.model)?;
    let Some(path) = &a.data else { return Ok((model, None)) };
    let mut data = Data::read(path, &DataOptions::default())?;
    let mut features = model.features.max(data.features);
    let scaling = match &a.range {
        Some(range) => {
            features = features.max(Scaling::read(range, None)?.features.len());
            Some(Scaling::read(range, Some(features))?)
        }
        None => None,
    };
    if model.features < features {
        model = Model::read_with(&a.model, &ReadOptions { features: Some(features), ..Default::default() })?;
    }
    if data.features < features {
        data = Data::read(path, &DataOptions { features: Some(features), ..Default::default() })?;
    }
    if let Some(scaling) = scaling {
        data = scaling.apply_data(data).with_context(|| format!("cannot scale {}", path.display()))?;
    }
    Ok((model, Some(data)))
}

/// A progress bar on a terminal.
fn bar() -> Option<ProgressBar> {
    std::io::stderr().is_terminal().then(|| {
        let bar = ProgressBar::new(1);
        let style = ProgressStyle::with_template("{bar:40} {percent:>3}%  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar
    })
}

/// The machine that was asked for.
fn pick<'t>(t: &'t Tradeoff, a: &TradeoffArguments) -> anyhow::Result<Option<&'t Point>> {
    match (a.pick, a.max_loss) {
        (Some(size), _) => match t.pick_size(size) {
            None => bail!("no method gave a machine of at most {size} vectors; nothing was written"),
            found => Ok(found),
        },
        (None, Some(loss)) => match t.pick_loss(loss) {
            None => bail!(
                "no machine loses at most {loss} percentage points of {:.2} %; nothing was written. Try larger --sizes \
                 or other --methods",
                t.full.score() * 100.0
            ),
            found => Ok(found),
        },
        (None, None) => Ok(None),
    }
}

/// Writes all files. The picked model gets the card of the full one, if that has one, with the new figures.
fn write(t: &Tradeoff, picked: Option<&Point>, card: Option<Card>, folder: &Path) -> anyhow::Result<()> {
    for (name, text) in [(FILES[0], t.to_csv()), (FILES[1], t.to_json()?)] {
        write_text(&folder.join(name), &text)?;
    }
    crate::plot::write(&plot::draw(t), &folder.join(FILES[2]), &folder.join(FILES[3]))?;
    if let Some((point, model)) = picked.and_then(|p| Some((p, p.model.as_ref()?))) {
        let path = folder.join(PICKED);
        model.write(&path)?;
        if let Some(mut card) = card {
            let pruned = format!("pruned by sparing tradeoff: {}, {} vectors", point.method, point.vectors);
            card.command = format!("{}; {pruned}, seed {}", card.command, t.seed);
            card.metrics.clear();
            card.metrics.insert("agreement".into(), point.agreement);
            if let Some(quality) = point.quality {
                card.metrics.insert("accuracy".into(), quality.accuracy);
            }
            card.write(&path)?;
        }
    }
    Ok(())
}

/// The measurements for people. Pareto points have a star.
fn table(t: &Tradeoff) -> String {
    let mut lines = vec![match t.source {
        Source::Data => {
            format!("{} rows measured, {} other rows to fit", t.measured_rows, t.fit_rows)
        }
        Source::Samples => format!(
            "no labels given: {} queries sampled around the support vectors, {} others to fit",
            t.measured_rows, t.fit_rows
        ),
    }];
    lines.push(format!(
        "{:<18}{:>8}{:>10}{:>10}{:>8}{:>12}{:>8}{:>13}{:>11}",
        "method", "vectors", "accuracy", "balanced", "AUC", "agreement", "flips", "ns a query", "bytes"
    ));
    let percent = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{:.2} %", v * 100.0));
    for p in std::iter::once(&t.full).chain(&t.points) {
        let q = p.quality;
        let auc = q.and_then(|q| q.auc).map_or("-".to_owned(), |v| format!("{v:.4}"));
        lines.push(format!(
            "{:<18}{:>8}{:>10}{:>10}{auc:>8}{:>12}{:>8}{:>13.1}{:>11}{}",
            p.method,
            p.vectors,
            percent(q.map(|q| q.accuracy)),
            percent(q.and_then(|q| q.balanced_accuracy)),
            percent(Some(p.agreement)),
            p.flips,
            p.ns_per_query,
            p.bytes,
            if p.pareto { " *" } else { "" }
        ));
    }
    lines.push("* on the Pareto front: no other machine is both faster and at least as good".into());
    lines.join("\n")
}
