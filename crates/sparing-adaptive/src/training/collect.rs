//! Rows from one scene.

use super::label::{Doubling, Label};
use super::random::Random;
use super::replay::Replay;
use crate::features::{Feature, FeatureMatrix, Query, log_gain};
use crate::goal::{Bounds, Goal, planned};
use crate::policy::{Band, Threshold};
use crate::view::View;
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{RenderSettings, Renderer, Scene};

/// What to collect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collection {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Independent renders, at least 1.
    pub replicates: u32,
    /// Samples per pixel of the reference.
    pub reference_spp: u32,
    /// Least and most samples of a policy.
    pub bounds: Bounds,
    /// Rows at most.
    pub rows: usize,
    /// Only pixels in this band become rows.
    pub band: Band,
}

impl Default for Collection {
    fn default() -> Self {
        Self {
            seed: 1,
            replicates: 3,
            reference_spp: 2048,
            bounds: Bounds { min_spp: 8, max_spp: 512 },
            rows: 2000,
            band: Band::default(),
        }
    }
}

/// One pixel at one barrier.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// [`Feature::ALL`] of it.
    pub features: Vec<f64>,
    /// What doubling gained for one sample, over the square of the threshold, by each [`Label`].
    pub gains: [f64; 3],
}

/// Averages of samples, over the pixels that show any error, that thresholds are drawn between.
fn averages(bounds: Bounds) -> [f64; 2] {
    // Nearly all pixels at the maximum would leave nothing to decide.
    [1.25 * f64::from(bounds.min_spp), (0.4 * f64::from(bounds.max_spp)).min(200.0)]
}

/// Thresholds that each replicate is replayed with.
const TRIALS: usize = 6;

/// Renders a scene, which must be built for this size, and collects rows: the pooled rule is replayed with random thresholds, and of the pixels that it sees
/// within the band, random ones are kept. The same for the same seed, whatever the threads.
#[must_use]
pub fn collect(scene: &Scene, size: [u32; 2], settings: RenderSettings, what: &Collection) -> Vec<Row> {
    let options = FilmOptions::default();
    let replicates = what.replicates.max(1);
    // The seeds of the sampler differ in more than a bit: they are hashed anyway, but need not be close.
    let seed = |k: u32| Random::new(what.seed ^ u64::from(k) << 40).bits();
    let replays: Vec<Replay> = (0..replicates)
        .map(|k| {
            let settings = RenderSettings { seed: seed(k), ..settings };
            Replay::new(scene, size, settings, what.bounds, options)
        })
        .collect();
    let mut reference = Film::new(size, [0, 0, size[0], size[1]], options);
    let renderer = Renderer::new(scene, RenderSettings { seed: seed(replicates), ..settings }, options);
    renderer.run(&mut reference, &Wave::default(), |_, _| what.reference_spp);

    let mut random = Random::new(seed(replicates + 1));
    let mut rows = Vec::new();
    let layers: Vec<Vec<Vec<[f64; 3]>>> =
        replays.iter().map(|r| r.films().iter().map(means).collect()).collect();
    let truth = means(&reference);
    for (own, replay) in replays.iter().enumerate() {
        let exposure = View::auto_exposure(&replay.films()[0]);
        let Some(ends) = replay.thresholds(exposure, averages(what.bounds)) else {
            continue; // nothing in the picture shows any error
        };
        for _ in 0..TRIALS {
            let lambda = (ends[1].ln() + random.uniform() * (ends[0] / ends[1]).ln()).exp();
            let mut rule = Threshold::new(Goal::Threshold(lambda));
            let shared = rule;
            replay.run(&mut rule, exposure, |barrier, levels| {
                let view = barrier.view();
                let spread = shared.spread(barrier);
                let plan = &barrier.plan(1).values;
                let queries: Vec<Query> = (0..view.pixels.len())
                    .map(|i| Query {
                        pixel: i,
                        log_gain: log_gain(spread.values[i], view.pixels[i].count, lambda),
                        plan_gain: log_gain(plan[i], view.pixels[i].count, lambda),
                    })
                    .filter(|q| {
                        let more = usize::from(levels[q.pixel]) + 1 < replay.films().len();
                        let open = view.pixels[q.pixel].count >= planned(plan[q.pixel], lambda, what.bounds);
                        what.band.contains(q.log_gain) && more && open && spread.values[q.pixel] > 0.0
                    })
                    .collect();
                let chosen = random.some_of(queries.len(), per_barrier(what, replays.len()));
                let queries: Vec<Query> = chosen.into_iter().map(|i| queries[i]).collect();
                let matrix = FeatureMatrix::new(view, &queries, &Feature::ALL);
                for (query, features) in queries.iter().zip(matrix.values.chunks(Feature::ALL.len())) {
                    let level = usize::from(levels[query.pixel]);
                    let scaled = |c: [f64; 3]| c.map(|v| v * f64::from(exposure));
                    let doublings: Vec<Doubling> = layers
                        .iter()
                        .map(|films| Doubling {
                            at_n: scaled(films[level][query.pixel]),
                            at_2n: scaled(films[level + 1][query.pixel]),
                        })
                        .collect();
                    let n = view.pixels[query.pixel].count;
                    let gains = Label::ALL.map(|label| {
                        label.gain(&doublings, own, scaled(truth[query.pixel]), n) / (lambda * lambda)
                    });
                    if gains.iter().all(|g| g.is_finite()) {
                        rows.push(Row { features: features.to_vec(), gains });
                    }
                }
            });
        }
    }
    let chosen = random.some_of(rows.len(), what.rows);
    chosen.into_iter().map(|i| rows[i].clone()).collect()
}

/// Rows that a barrier may give: enough that some barriers may have none.
fn per_barrier(what: &Collection, replicates: usize) -> usize {
    let barriers = (what.bounds.max_spp / what.bounds.min_spp.max(1)).max(2).ilog2() as usize;
    2 * what.rows.div_ceil(TRIALS * replicates * barriers)
}

fn means(film: &Film) -> Vec<[f64; 3]> {
    film.map(|t, i| t.pixels[i].mean().to_array())
}
