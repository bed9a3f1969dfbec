//! Rules for stopping, at their limits: they do the obvious.

use crate::common::{MACHINE, PAPER, Stage, average, counts, guard, limits, policies};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::layers::{Limits, Observe, Progress, StoppedBy, render};
use sparing_adaptive::policy::{Planned, Policy, Svm, Threshold};
use sparing_adaptive::state::State;
use sparing_image::film::{Film, Pixel};
use sparing_render::Renderer;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 64 };

/// Noise in every pixel: those without would stop whatever the goal.
fn stage() -> Stage {
    Stage::new(guard("caustic", 24))
}

#[test]
fn without_time_no_policy_samples() {
    let stage = stage();
    let none = Limits { time: Some(Duration::ZERO), ..limits(BOUNDS) };
    for mut policy in policies(Goal::Average(16.0)) {
        let (film, outcome) = stage.render(0, None, &mut *policy, &none);
        assert_eq!((film.samples(), outcome.stopped_by), (0, StoppedBy::TimeLimit), "{}", policy.name());
        assert!(film.beauty().iter().flatten().all(|c| *c == 0.0));
    }
}

#[test]
fn least_equal_to_most_is_uniform() {
    let stage = stage();
    let bounds = Bounds { min_spp: 16, max_spp: 16 };
    for goal in [Goal::Tolerance(1.0), Goal::Average(16.0), Goal::Threshold(0.0)] {
        for mut policy in policies(goal) {
            let (film, outcome) = stage.render(0, None, &mut *policy, &limits(bounds));
            assert!(counts(&film).iter().all(|n| *n == 16), "{} {goal:?}", policy.name());
            assert_eq!(outcome.stopped_by, StoppedBy::Spp, "{} {goal:?}", policy.name());
            assert!(film.correction.iter().flatten().all(|c| *c == 0.0), "{}", policy.name());
        }
    }
}

#[test]
fn goals_out_of_reach_end_at_a_bound() {
    let stage = stage();
    let infinity = f64::INFINITY;
    let least =
        [Goal::Tolerance(infinity), Goal::Average(0.0), Goal::Average(8.0), Goal::Threshold(infinity)];
    let most = [Goal::Tolerance(0.0), Goal::Average(64.0), Goal::Average(infinity), Goal::Threshold(0.0)];
    for (goals, bound) in [(least, 8), (most, 64)] {
        for goal in goals {
            // Those that have a goal.
            for mut policy in policies(goal).into_iter().take(3) {
                let name = policy.name();
                let wanted = f64::from(bound.max(policy.first_target(BOUNDS)));
                let found = average(&stage.render(0, None, &mut *policy, &limits(BOUNDS)).0);
                if goal == Goal::Average(64.0) {
                    // A threshold below the gains of all pixels but above 0: the machine may still stop one near to it.
                    assert!((0.99 * wanted..=wanted).contains(&found), "{name} {found}");
                } else {
                    assert_eq!(found, wanted, "{name} {goal:?}");
                }
            }
        }
    }
}

/// Interrupts at the barrier after so many layers.
struct StopAfter<'a> {
    layers: u32,
    interrupt: &'a AtomicBool,
}

impl Observe for StopAfter<'_> {
    fn tick(&self, _progress: &Progress) {}

    fn barrier(&mut self, _film: &Film, _progress: &Progress) {
        self.layers = self.layers.saturating_sub(1);
        self.interrupt.store(self.layers == 0, Ordering::Relaxed);
    }
}

fn pixels(film: &Film) -> Vec<Pixel> {
    film.map(|t, i| t.pixels[i].clone())
}

/// Renders; if `stops` is given, is interrupted after so many layers and taken up by a new policy with the same
/// state.
fn resumed(stage: &Stage, policy: fn() -> Box<dyn Policy>, stops: Option<u32>) -> (Film, Vec<f32>) {
    let options = policy().film_options();
    let renderer = Renderer::new(&stage.scene, stage.settings(4), options);
    let fixed = Limits { exposure: Some(1.0), ..limits(BOUNDS) };
    let mut state = State::new(Film::new(stage.size, [0, 0, stage.size[0], stage.size[1]], options));
    let mut run = |layers| {
        let interrupt = AtomicBool::new(false);
        let mut observer = StopAfter { layers, interrupt: &interrupt };
        render(&renderer, &mut state, &mut *policy(), &fixed, &interrupt, &mut observer)
    };
    if let Some(layers) = stops {
        assert_eq!(run(layers).stopped_by, StoppedBy::Interrupt);
    }
    let outcome = run(u32::MAX);
    (state.film, outcome.decisions)
}

#[test]
fn every_policy_goes_on_as_if_it_had_not_stopped() {
    let stage = stage();
    let policies: [fn() -> Box<dyn Policy>; 4] = [
        || Box::new(Threshold::new(Goal::Average(24.0))),
        || Box::new(Svm::new(Goal::Average(24.0), MACHINE.clone())),
        || Box::new(Planned { goal: Goal::Average(24.0) }),
        || Box::new(PAPER.clone()),
    ];
    for (k, policy) in policies.into_iter().enumerate() {
        let (wanted, decisions) = resumed(&stage, policy, None);
        let n = counts(&wanted);
        assert!(n.iter().min() < n.iter().max(), "{k}: something is decided");
        for stops in 1..3 {
            let (film, again) = resumed(&stage, policy, Some(stops));
            assert!(pixels(&film) == pixels(&wanted), "{k} {stops}");
            assert!(film.beauty() == wanted.beauty(), "{k} {stops}");
            // The sampler of 2015 asks nobody twice: what it said to pixels that had stopped is not in the film.
            assert!(again == decisions || k == 3, "{k} {stops}");
        }
    }
}
