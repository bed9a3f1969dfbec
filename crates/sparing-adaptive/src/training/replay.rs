//! Layers of an even render, kept, so that policies can be replayed on them.

use crate::goal::{Bounds, Goal};
use crate::ledger::Ledger;
use crate::policy::{Barrier, Policy, Threshold, plan_bounds};
use crate::view::View;
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{RenderSettings, Renderer, Scene};

/// Films of one seed at some counts of samples, by default the minimum and every doubling up to the maximum. A sample is a
/// function of pixel, index and seed, so whatever a policy renders is put together from these films, bit for bit.
#[derive(Clone, Debug)]
pub struct Replay {
    films: Vec<Film>,
    bounds: Bounds,
}

impl Replay {
    /// Renders evenly to the minimum, and on by doubling as long as the maximum is not exceeded.
    #[must_use]
    pub fn new(
        scene: &Scene,
        size: [u32; 2],
        settings: RenderSettings,
        bounds: Bounds,
        options: FilmOptions,
    ) -> Self {
        let first = bounds.min_spp.max(1);
        let doublings = (0..u32::BITS).map_while(|k| first.checked_mul(1 << k));
        let counts: Vec<u32> = doublings.take_while(|n| *n <= bounds.max_spp.max(first)).collect();
        Self::with_counts(scene, size, settings, &counts, options)
    }

    /// Renders evenly to each of these counts, which rise.
    #[must_use]
    pub fn with_counts(
        scene: &Scene,
        size: [u32; 2],
        settings: RenderSettings,
        counts: &[u32],
        options: FilmOptions,
    ) -> Self {
        let renderer = Renderer::new(scene, settings, options);
        let mut film = Film::new(size, [0, 0, size[0], size[1]], options);
        let stored = |&spp: &u32| {
            renderer.run(&mut film, &Wave::default(), |_, _| spp);
            film.clone()
        };
        let films = counts.iter().map(stored).collect();
        let end = |n: Option<&u32>| n.copied().unwrap_or(1);
        Self { films, bounds: Bounds { min_spp: end(counts.first()), max_spp: end(counts.last()) } }
    }

    /// The same without the layers beyond this many samples.
    #[must_use]
    pub fn up_to(&self, max_spp: u32) -> Self {
        let count = |film: &Film| film.tiles.first().map_or(0, |t| t.pixels[0].count());
        let films: Vec<Film> = self.films.iter().take_while(|f| count(f) <= max_spp).cloned().collect();
        let most = films.last().map_or(self.bounds.min_spp, count);
        Self { films, bounds: Bounds { max_spp: most, ..self.bounds } }
    }

    /// Least and most samples that are stored.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The even films, those with the least samples first.
    #[must_use]
    pub fn films(&self) -> &[Film] {
        &self.films
    }

    /// Thresholds of the pooled rule that are expected to reach these averages of samples over the pixels that show any
    /// error, judged by the first layer. `None` if no pixel does.
    #[must_use]
    pub fn thresholds<const N: usize>(&self, exposure: f32, averages: [f64; N]) -> Option<[f64; N]> {
        let ledger = Ledger::default();
        let barrier = Barrier::new(&self.films[0], &ledger, self.bounds, exposure);
        let (view, spread) = (barrier.view(), Threshold::new(Goal::Average(1.0)).spread(&barrier));
        let lit =
            spread.values.iter().filter(|s| **s > 0.0).count() as f64 / spread.values.len().max(1) as f64;
        let least = f64::from(self.bounds.min_spp);
        let thresholds = averages.map(|average| {
            Goal::Average(least + lit * (average - least)).expected_threshold(view, &spread, self.bounds)
        });
        thresholds.iter().all(|t| t.is_finite() && *t > 0.0).then_some(thresholds)
    }

    /// Runs a policy, as the loop of layers would; a pixel that goes on gets the least stored count that reaches its target.
    /// `at_barrier` sees each barrier and the level of each pixel (its film's number). Gives the final film.
    pub fn run(
        &self,
        policy: &mut dyn Policy,
        exposure: f32,
        mut at_barrier: impl FnMut(&Barrier<'_>, &[u8]),
    ) -> Film {
        let mut film = self.films[0].clone();
        let width = film.width() as usize;
        let mut levels = vec![0_u8; width * film.height() as usize];
        let mut ledger = Ledger::default();
        let plans = plan_bounds(policy, self.bounds);
        loop {
            let barrier = Barrier::new(&film, &ledger, self.bounds, exposure);
            at_barrier(&barrier, &levels);
            let decisions = policy.decide(&barrier);
            let passed = barrier.passed(&decisions, plans);
            ledger.note(passed, &decisions);
            let targets = &decisions.targets;
            let mut any = false;
            let [x0, y0, ..] = film.crop;
            for (number, tile) in film.tiles.iter_mut().enumerate() {
                for y in tile.y0..tile.y0 + tile.height {
                    for x in tile.x0..tile.x0 + tile.width {
                        let at = (y - y0) as usize * width + (x - x0) as usize;
                        let i = tile.index(x, y);
                        let later = &self.films[usize::from(levels[at])..];
                        let count = |film: &Film| film.tiles[number].pixels[i].count();
                        let steps = later.iter().position(|film| count(film) >= targets[at]);
                        let steps = steps.unwrap_or(later.len() - 1);
                        if steps > 0 {
                            levels[at] += steps as u8;
                            let from = &later[steps].tiles[number];
                            tile.pixels[i] = from.pixels[i].clone();
                            if let (Some(to), Some(from)) = (tile.shapes.get_mut(i), from.shapes.get(i)) {
                                *to = from.clone();
                            }
                            if let (Some(to), Some(from)) =
                                (tile.luminance_squares.get_mut(i), from.luminance_squares.get(i))
                            {
                                *to = *from;
                            }
                            any = true;
                        }
                    }
                }
            }
            if !any {
                let view = View::new(&film, exposure);
                film.correction = ledger.correction(&film, &view, plans, false);
                return film;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layers::{Limits, Unwatched, render};
    use crate::state::State;
    use sparing_render::BuildOptions;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn a_replay_is_the_render() {
        let path =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/tests/small-light.pbrt");
        let mut description = sparing_scene::load(&path).expect("the scene loads");
        (description.film.width, description.film.height) = (20, 13); // the camera's size
        let scene = Scene::build(description, BuildOptions { threads: 1, robust: true }).expect("it builds");
        let bounds = Bounds { min_spp: 8, max_spp: 128 };
        let settings = RenderSettings::default();
        let replay = Replay::new(&scene, [20, 13], settings, bounds, FilmOptions::default());
        assert_eq!(replay.films().len(), 5);
        let mut corrected = false;
        for goal in [Goal::Average(24.0), Goal::Threshold(0.3), Goal::Threshold(5.0)] {
            let replayed = replay.run(&mut Threshold::new(goal), 1.5, |_, _| ());
            let mut state = State::new(Film::new([20, 13], [0, 0, 20, 13], FilmOptions::default()));
            let renderer = Renderer::new(&scene, settings, FilmOptions::default());
            let limits = Limits { bounds, time: None, exposure: Some(1.5) };
            let stop = AtomicBool::new(false);
            render(&renderer, &mut state, &mut Threshold::new(goal), &limits, &stop, &mut Unwatched);
            let lambdas = state.ledger.lambdas();
            assert!(lambdas.iter().any(|l| l.is_finite()), "{goal:?}: {lambdas:?}");
            let film = state.film;
            let pixels = |film: &Film| film.map(|t, i| t.pixels[i].clone());
            assert!(pixels(&film) == pixels(&replayed), "{goal:?}");
            assert_eq!(film.beauty(), replayed.beauty(), "{goal:?}");
            corrected |= !film.correction.is_empty();
        }
        assert!(corrected);
    }
}
