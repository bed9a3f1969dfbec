//! The loop and its policies on small renders: same bits, goals reached, bounds kept, nothing hostile undefined.

use glam::Vec3;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::layers::{Limits, Observe, Outcome, Progress, StoppedBy, Unwatched, render};
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::policy::{Barrier, Decisions, Planned, Policy, Shapes, Threshold, Uniform};
use sparing_adaptive::state::State;
use sparing_adaptive::view::{Statistics, View};
use sparing_image::film::{Film, FilmOptions, Pixel};
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 256 };

/// A scene whose camera is set for square pictures of this side.
fn scene(name: &str, side: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name);
    let mut description = sparing_scene::load(&path).expect("the scene loads");
    (description.film.width, description.film.height) = (side, side);
    Scene::build(description, BuildOptions { threads: 1, robust: true }).expect("the scene builds")
}

/// Renders a square picture, or a crop of it.
fn run(
    scene: &Scene,
    side: u32,
    crop: Option<[u32; 4]>,
    policy: &mut dyn Policy,
    limits: &Limits,
) -> (Film, Outcome) {
    let options = policy.film_options();
    let mut state = State::new(Film::new([side, side], crop.unwrap_or([0, 0, side, side]), options));
    let renderer = Renderer::new(scene, RenderSettings::default(), options);
    let outcome = render(&renderer, &mut state, policy, limits, &AtomicBool::new(false), &mut Unwatched);
    (state.film, outcome)
}

fn limits(bounds: Bounds) -> Limits {
    Limits { bounds, time: None, exposure: None }
}

fn counts(film: &Film) -> Vec<u32> {
    film.map(|t, i| t.pixels[i].count())
}

#[test]
fn threads_do_not_change_a_bit() {
    let scene = scene("tests/small-light.pbrt", 48);
    let render_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let mut policy = Threshold::new(Goal::Average(32.0));
        let (film, outcome) = pool.install(|| run(&scene, 48, None, &mut policy, &limits(BOUNDS)));
        (film.map(|t, i| t.pixels[i].clone()), outcome.decisions)
    };
    let one = render_with(1);
    for threads in [2, 3] {
        let other = render_with(threads);
        assert!(one.0 == other.0 && one.1 == other.1, "{threads} threads");
    }
}

#[test]
fn an_average_is_reached_and_bounds_hold() {
    let scene = scene("tests/small-light.pbrt", 64);
    for average in [12.0, 40.0, 100.0] {
        let (film, _) = run(&scene, 64, None, &mut Threshold::new(Goal::Average(average)), &limits(BOUNDS));
        let found = film.samples() as f64 / 4096.0;
        assert!((found / average - 1.0).abs() < 0.1, "{found} instead of {average}");
        assert!(counts(&film).iter().all(|n| (8..=256).contains(n) && n.is_power_of_two()));
    }
}

#[test]
fn a_smaller_tolerance_takes_more_samples_and_promises_less_error() {
    let scene = scene("cornell-box.pbrt", 64);
    let mut last = (0, f64::INFINITY);
    for tolerance in [3.0, 2.0, 1.4] {
        let (film, outcome) =
            run(&scene, 64, None, &mut Threshold::new(Goal::Tolerance(tolerance)), &limits(BOUNDS));
        let predicted = outcome.predicted_error.expect("the policy looks at errors");
        assert!(predicted <= tolerance * 1.1, "{predicted} for {tolerance}");
        assert!(film.samples() > last.0 && predicted < last.1, "{tolerance}");
        last = (film.samples(), predicted);
    }
}

#[test]
fn extreme_goals_do_the_obvious() {
    let scene = scene("cornell-box.pbrt", 16);
    let spp = |goal| counts(&run(&scene, 16, None, &mut Threshold::new(goal), &limits(BOUNDS)).0);
    assert!(spp(Goal::Tolerance(f64::INFINITY)).iter().all(|n| *n == 8));
    assert!(spp(Goal::Threshold(f64::INFINITY)).iter().all(|n| *n == 8));
    // Everything that shows any spread goes to the end: all but the border and the lamp.
    for goal in [Goal::Tolerance(1e-300), Goal::Threshold(0.0)] {
        let most = spp(goal).iter().filter(|n| **n == 256).count();
        assert!(most > 150, "{most} with {goal:?}");
    }
}

#[test]
fn uniform_is_what_it_was() {
    let scene = scene("tests/small-light.pbrt", 24);
    let bounds = Bounds { min_spp: 8, max_spp: 100 };
    let (film, outcome) = run(&scene, 24, None, &mut Uniform, &limits(bounds));
    assert!(counts(&film).iter().all(|n| *n == 100));
    assert_eq!(outcome.layers.iter().map(|l| l.spp).collect::<Vec<_>>(), [8, 16, 32, 64, 100]);
    assert_eq!((outcome.stopped_by, outcome.exposure), (StoppedBy::Spp, None));
}

#[test]
fn pixels_of_several_shapes_get_the_most() {
    let scene = scene("cornell-box.pbrt", 48);
    let (film, _) = run(&scene, 48, None, &mut Shapes, &limits(Bounds { min_spp: 8, max_spp: 32 }));
    for (count, shapes) in film.map(|t, i| (t.pixels[i].count(), t.shapes[i].len())) {
        assert_eq!(count, if shapes > 1 { 32 } else { 8 });
    }
    assert!(counts(&film).contains(&8) && counts(&film).contains(&32));
}

/// With threshold and exposure given, decisions are local: a crop with a margin of one pixel a barrier is the same inside.
#[test]
fn a_crop_with_a_halo_is_the_full_picture_inside() {
    let scene = scene("tests/small-light.pbrt", 48);
    let fixed = Limits { bounds: Bounds { min_spp: 8, max_spp: 64 }, time: None, exposure: Some(1.0) };
    let policy = || Threshold::new(Goal::Threshold(0.1));
    let (full, _) = run(&scene, 48, None, &mut policy(), &fixed);
    let (crop, _) = run(&scene, 48, Some([9, 5, 41, 37]), &mut policy(), &fixed);
    let all = full.map(|t, i| t.pixels[i].clone());
    let part = crop.map(|t, i| t.pixels[i].clone());
    for y in 4..28 {
        for x in 4..28 {
            assert!(part[y * 32 + x] == all[(y + 5) * 48 + x + 9], "{x},{y}");
        }
    }
}

#[test]
fn a_time_limit_and_an_interrupt_end_the_render() {
    let scene = scene("cornell-box.pbrt", 64);
    let many = Bounds { min_spp: 8, max_spp: 65_536 };
    let short = Limits { time: Some(Duration::from_millis(150)), ..limits(many) };
    let (_, outcome) = run(&scene, 64, None, &mut Threshold::new(Goal::Tolerance(1e-9)), &short);
    assert_eq!(outcome.stopped_by, StoppedBy::TimeLimit);
    assert!(outcome.seconds < 5.0);
    let mut state = State::new(Film::new([8, 8], [0, 0, 8, 8], FilmOptions::default()));
    let renderer = Renderer::new(&scene, RenderSettings::default(), FilmOptions::default());
    let interrupted = AtomicBool::new(true);
    let mut policy = Threshold::new(Goal::Tolerance(1.0));
    let outcome = render(&renderer, &mut state, &mut policy, &limits(many), &interrupted, &mut Unwatched);
    assert_eq!(outcome.stopped_by, StoppedBy::Interrupt);
}

#[test]
fn without_time_nothing_is_sampled() {
    let scene = scene("cornell-box.pbrt", 16);
    let none = Limits { time: Some(Duration::ZERO), ..limits(BOUNDS) };
    for policy in [&mut Threshold::new(Goal::Average(20.0)) as &mut dyn Policy, &mut Uniform] {
        let (film, outcome) = run(&scene, 16, None, policy, &none);
        assert_eq!((film.samples(), outcome.layers.len()), (0, 0));
        assert_eq!(outcome.stopped_by, StoppedBy::TimeLimit);
    }
}

/// Compares the view that is kept with a new one at every barrier.
struct Compare(Threshold);

impl Policy for Compare {
    fn name(&self) -> &'static str {
        "compare"
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let fresh = View::new(barrier.film, barrier.view().exposure);
        assert!(barrier.view().pixels == fresh.pixels);
        for (kept, pixel) in fresh.pixels.iter().zip(barrier.film.map(|t, i| t.pixels[i].clone())) {
            assert_eq!(
                *kept,
                Statistics::of(&pixel, 0, fresh.exposure),
                "whatever pixels it is computed with"
            );
        }
        self.0.decide(barrier)
    }
}

#[test]
fn a_kept_view_is_a_new_one() {
    let scene = scene("tests/small-light.pbrt", 48);
    let mut policy = Compare(Threshold::new(Goal::Average(32.0)));
    let (_, outcome) = run(&scene, 48, Some([3, 5, 44, 31]), &mut policy, &limits(BOUNDS));
    let active: Vec<u64> = outcome.layers.iter().map(|l| l.active_pixels).collect();
    assert!(active.len() > 4 && active[3] < active[0] / 2, "{active:?}");
}

/// Interrupts at the barrier after so many layers.
struct StopAfter<'a> {
    layers: u32,
    interrupt: &'a AtomicBool,
}

impl Observe for StopAfter<'_> {
    fn tick(&self, _progress: &Progress) {}

    fn barrier(&mut self, _film: &Film, _progress: &Progress) {
        self.layers -= 1;
        if self.layers == 0 {
            self.interrupt.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn a_render_goes_on_from_a_film_as_if_it_had_not_stopped() {
    let scene = scene("tests/small-light.pbrt", 32);
    let options = FilmOptions::default();
    let renderer = Renderer::new(&scene, RenderSettings::default(), options);
    let fixed = Limits { bounds: BOUNDS, time: None, exposure: Some(1.0) };
    let policy = || Threshold::new(Goal::Average(40.0));
    let empty = State::new(Film::new([32, 32], [0, 0, 32, 32], options));
    let on = |state: &mut State, interrupt: &AtomicBool, observer: &mut dyn Observe| {
        render(&renderer, state, &mut policy(), &fixed, interrupt, observer)
    };
    let never = AtomicBool::new(false);
    let mut at_once = empty.clone();
    on(&mut at_once, &never, &mut Unwatched);
    for layers in 1..4 {
        let (mut state, interrupt) = (empty.clone(), AtomicBool::new(false));
        let mut stop = StopAfter { layers, interrupt: &interrupt };
        let outcome = on(&mut state, &interrupt, &mut stop);
        assert_eq!((outcome.stopped_by, outcome.layers.len()), (StoppedBy::Interrupt, layers as usize));
        on(&mut state, &never, &mut Unwatched);
        assert_same(&state, &at_once);
    }
}

fn assert_same(a: &State, b: &State) {
    assert!(a.film.beauty() == b.film.beauty());
    let pixels = |s: &State| s.film.map(|t, i| t.pixels[i].clone());
    assert!(pixels(a) == pixels(b));
}

/// Keeps what is handed out for checkpoints, which are always due.
#[derive(Default)]
struct Checkpoints(Vec<State>);

impl Observe for Checkpoints {
    fn tick(&self, _progress: &Progress) {}

    fn barrier(&mut self, _film: &Film, _progress: &Progress) {}

    fn checkpoint_due(&self) -> Option<Instant> {
        // The first few within layers, the others at their ends.
        (self.0.len() < 6).then(|| Instant::now() + Duration::from_micros(300))
    }

    fn checkpoint(&mut self, state: &State, _now: bool) {
        self.0.push(state.clone());
    }
}

#[test]
fn a_render_goes_on_from_any_checkpoint() {
    let scene = scene("tests/small-light.pbrt", 48);
    let options = FilmOptions::default();
    let renderer = Renderer::new(&scene, RenderSettings::default(), options);
    let goals = [Goal::Average(40.0), Goal::Tolerance(0.4)];
    for goal in goals {
        let on = |state: &mut State, observer: &mut dyn Observe| {
            let mut policy = Threshold::new(goal);
            render(&renderer, state, &mut policy, &limits(BOUNDS), &AtomicBool::new(false), observer)
        };
        let empty = State::new(Film::new([48, 48], [0, 0, 48, 48], options));
        let (mut at_once, mut watched) = (empty.clone(), empty);
        let outcome = on(&mut at_once, &mut Unwatched);
        let mut checkpoints = Checkpoints::default();
        on(&mut watched, &mut checkpoints);
        assert_same(&watched, &at_once);
        assert!(checkpoints.0.len() > 5, "{goal:?}: {}", checkpoints.0.len());
        for mut state in checkpoints.0 {
            let again = on(&mut state, &mut Unwatched);
            assert_same(&state, &at_once);
            assert_eq!(again.exposure, outcome.exposure);
            assert!(again.decisions == outcome.decisions);
        }
    }
}

/// A film with these samples in every pixel, as a hostile scene would fill it.
fn filled(side: u32, samples: &[Vec3]) -> Film {
    let mut film = Film::new(
        [side, side],
        [0, 0, side, side],
        FilmOptions { auxiliary: false, shapes: true, luminance: false },
    );
    for tile in &mut film.tiles {
        for i in 0..tile.pixels.len() {
            for (n, s) in samples.iter().enumerate() {
                tile.add_sample(i, n as u32, *s, 1.0);
            }
            tile.shapes[i].insert(1);
        }
    }
    film
}

#[test]
fn hostile_films_give_finite_statistics_and_decisions() {
    let firefly = |value: f32| {
        let mut s = vec![Vec3::splat(0.5); 8];
        s[3] = Vec3::splat(value);
        s
    };
    let cases = [
        ("black", vec![Vec3::ZERO; 8]),
        ("constant", vec![Vec3::splat(0.3); 8]),
        ("huge", vec![Vec3::splat(f32::MAX); 8]),
        ("tiny", vec![Vec3::splat(1e-45); 8]),
        ("firefly", firefly(1e30)),
        ("largest firefly", firefly(f32::MAX)),
        ("NaN", firefly(f32::NAN)),
        ("one sample", vec![Vec3::ONE]),
        ("none", Vec::new()),
        ("odd", (0..13).map(|i| Vec3::splat(i as f32)).collect()),
    ];
    for (name, samples) in cases {
        for side in [1, 3, 9] {
            let film = filled(side, &samples);
            for exposure in [1e-6, 1.0, 1e6, View::auto_exposure(&film)] {
                let ledger = Ledger::default();
                let barrier = Barrier::new(&film, &ledger, BOUNDS, exposure);
                for p in &barrier.view().pixels {
                    let all = [p.relative_error, p.perceived_error, p.mean[0], p.error[2]];
                    assert!(
                        all.iter().all(|x| x.is_finite() && *x >= 0.0),
                        "{name} {side} {exposure}: {p:?}"
                    );
                }
                for goal in [Goal::Tolerance(1.0), Goal::Average(20.0), Goal::Threshold(0.01)] {
                    let policies: [&mut dyn Policy; 2] = [&mut Threshold::new(goal), &mut Planned { goal }];
                    for policy in policies {
                        let ledger = Ledger::default(); // plans differ
                        let d = policy.decide(&Barrier::new(&film, &ledger, BOUNDS, exposure));
                        assert_eq!(d.targets.len(), (side * side) as usize);
                        assert!(d.values.iter().all(|v| v.is_finite()), "{name}: {:?}", d.values);
                        let still = d.targets.iter().all(|t| *t as usize == samples.len());
                        // The plan's first layer is longer.
                        if matches!(name, "black" | "constant") && policy.name() == "threshold" {
                            assert!(still, "{name} is converged");
                        }
                        let threshold = policy.name() == "threshold" || side > 1; // alone, nobody plans
                        if name == "firefly" && goal == Goal::Threshold(0.01) && exposure > 1e-3 && threshold
                        {
                            assert!(!still, "a firefly goes on");
                        }
                    }
                }
            }
        }
    }
}

/// The estimate of the error is about right for independent samples, where it is unbiased in the square.
#[test]
fn block_errors_match_the_spread_of_means() {
    let mut random = testkit::svm_data::Random::new(5);
    let (mut estimated, mut means) = (0.0, Vec::new());
    for _ in 0..4000 {
        let mut pixel = Pixel::default();
        for _ in 0..64 {
            pixel.add(Vec3::splat(random.uniform() as f32));
        }
        let s = Statistics::of(&pixel, 0, 1.0);
        estimated += f64::from(s.error[0]).powi(2) / 4000.0;
        means.push(f64::from(s.mean[0]));
    }
    let mean = means.iter().sum::<f64>() / 4000.0;
    let variance = means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / 3999.0;
    assert!((estimated / variance - 1.0).abs() < 0.08, "{estimated:e} {variance:e}");
}
