//! The tables of Lin and Wu (2015), measured on the generated scenes: how well the machines of each layer do, and how
//! many support vectors they have. `docs/adaptive-paper.md` has the results.
//!
//!     cargo run --release -p sparing-adaptive --example paper_table -- [--rows N]... [--median]
//!         [--scale F] [--c C,...] [--gamma G,...] [--folds N]
//!
//! The figures: share of the class +1 among the training rows, the cut in CIEDE2000, C, gamma; accuracy on the training
//! rows, on all rows collected (121,352 by default), by cross-validation, on the validation scenes; the share of the larger
//! class there; number of support vectors, and how many of them are at C.

use sparing_adaptive::policy::paper::LAYERS;
use sparing_adaptive::training::paper::{Cut, Fit, Pixel, Row, accuracy, collect, fit, ordinary};
use sparing_render::{BuildOptions, RenderSettings, Scene};
use sparing_scene::generate::training::{Split, scene};

/// Pixels of a scene: 56 scenes give the 121,324 pixels of the report, and 28 more.
const PIXELS: usize = 2167;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut sizes, mut what, mut scale) = (Vec::new(), Fit::default(), 0.5_f64);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--rows" => sizes.push(value()?.parse::<usize>()?),
            "--scale" => scale = value()?.parse()?,
            "--c" => what.grid.c = list(&value()?)?,
            "--gamma" => what.grid.gamma = list(&value()?)?,
            "--folds" => what.folds = value()?.parse()?,
            "--median" => what.cut = Cut::Median,
            _ => return Err(format!("{argument} is not an option").into()),
        }
    }
    if sizes.is_empty() {
        sizes.push(what.rows);
    }
    let training = pixels(Split::Training, scale)?;
    let validation = pixels(Split::Validation, scale)?;
    println!("{} training and {} validation pixels", training.len(), validation.len());
    for rows in sizes {
        what.rows = rows;
        println!("\n{rows} rows, cut at the {:?}", what.cut);
        println!(
            "spp share+1 cut c gamma | training all-rows cross-validation | unseen larger-class | vectors at-C"
        );
        for (layer, samples) in LAYERS.iter().enumerate() {
            let of_layer = |pixels: &[Pixel]| pixels.iter().map(|p| p[layer]).collect::<Vec<Row>>();
            let (all, unseen) = (of_layer(&training), of_layer(&validation));
            let cut = what.cut.of(&all);
            let fitted = fit(layer, &all, &what, None)?;
            let figure = |name: &str| fitted.metrics.get(name).copied().unwrap_or(f64::NAN);
            let percent = |share: f64| format!("{:.2} %", 100.0 * share);
            let score = |rows: &[Row]| accuracy(&fitted.model, &fitted.scaling, rows, cut);
            let above =
                unseen.iter().filter(|r| r.distance > cut).count() as f64 / unseen.len().max(1) as f64;
            println!(
                "{samples} {} {cut:.2} {} {} | {} {} {} | {} {} | {} {}",
                percent(figure("share of rows that go on")),
                figure("c"),
                figure("gamma"),
                percent(figure("training accuracy")),
                percent(score(&all)?),
                percent(figure("cross-validation accuracy")),
                percent(score(&unseen)?),
                percent(above.max(1.0 - above)),
                fitted.model.len(),
                percent(figure("share of support vectors at C")),
            );
        }
    }
    Ok(())
}

fn list(text: &str) -> Result<Vec<f64>, std::num::ParseFloatError> {
    text.split(',').map(str::parse).collect()
}

/// Pixels of all scenes of a split, as `sparing train --label paper --seed 1` collects them.
fn pixels(split: Split, scale: f64) -> Result<Vec<Pixel>, Box<dyn std::error::Error>> {
    let mut all = Vec::new();
    for index in 0..split.scenes() {
        let mut description = scene(index, 1, split);
        ordinary(&mut description);
        let side = |pixels: u32| (f64::from(pixels) * scale).round().max(1.0) as u32;
        let size = [side(description.film.width), side(description.film.height)];
        // The camera is built for the film's size.
        [description.film.width, description.film.height] = size;
        let settings = RenderSettings { max_depth: description.integrator.max_depth, ..Default::default() };
        let built = Scene::build(description, BuildOptions { threads: 0, robust: true })?;
        all.extend(collect(&built, size, settings, 1 + (u64::from(index) << 16), PIXELS));
    }
    Ok(all)
}
