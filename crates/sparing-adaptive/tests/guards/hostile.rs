//! Films that no honest scene makes: all policies decide, within the bounds, with finite values.

use crate::common::{BOUNDS, MACHINE, PAPER, Stage, counts, guard, limits, policies};
use glam::Vec3;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::ledger::Ledger;
use sparing_adaptive::policy::{Barrier, Policy, Svm};
use sparing_adaptive::view::View;
use sparing_image::film::{Film, FilmOptions};
use sparing_scene::description::Light;
use testkit::svm_data::Random;

const SAMPLES: [f32; 12] =
    [0.0, 1e-45, 1e-30, 1e-6, 0.3, 1.0, 1e6, 1e30, f32::MAX, f32::NAN, f32::INFINITY, -1.0];

/// What samples a pixel gets.
#[derive(Clone, Copy, Debug)]
enum Filling {
    /// Each is one of [`SAMPLES`].
    Wild,
    /// One in seven is this, the others are 0.3.
    Firefly(f32),
}

fn film(full: [u32; 2], crop: [u32; 4], filling: Filling, count: u32) -> Film {
    let options = FilmOptions { auxiliary: false, shapes: true, luminance: true };
    let mut film = Film::new(full, crop, options);
    let mut random = Random::new(u64::from(count) + 1);
    for tile in &mut film.tiles {
        for i in tile.indices() {
            for n in 0..count {
                let value = match filling {
                    Filling::Wild => SAMPLES[(random.uniform() * SAMPLES.len() as f64) as usize],
                    Filling::Firefly(value) if random.uniform() < 1.0 / 7.0 => value,
                    Filling::Firefly(_) => 0.3,
                };
                tile.add_sample(i, n, Vec3::new(value, 0.5 * value, value), 1.0);
                tile.shapes[i].insert(n % 3);
            }
        }
    }
    film
}

#[test]
fn hostile_films_are_decided_within_the_bounds() {
    let fillings =
        [Filling::Wild, Filling::Firefly(f32::MAX), Filling::Firefly(1e30), Filling::Firefly(f32::NAN)];
    // One pixel, less than a neighbourhood, crops in the corners of a larger picture.
    let crops =
        [([1, 1], [0, 0, 1, 1]), ([3, 3], [0, 0, 3, 3]), ([20, 9], [0, 0, 7, 2]), ([20, 9], [13, 7, 20, 9])];
    let goals = [1.0, 0.0, -1.0, f64::INFINITY, f64::NAN]
        .map(|x| [Goal::Tolerance(x), Goal::Average(x), Goal::Threshold(x)])
        .concat();
    for filling in fillings {
        for (full, crop) in crops {
            for count in [1, 8, 13, 64, 512] {
                let film = film(full, crop, filling, count);
                for exposure in [1e-6, 1e6, f32::MIN_POSITIVE, f32::MAX, View::auto_exposure(&film)] {
                    for goal in &goals {
                        decide(&film, *goal, exposure, &format!("{filling:?} {crop:?} {count} {exposure:e}"));
                    }
                }
            }
        }
    }
}

fn decide(film: &Film, goal: Goal, exposure: f32, what: &str) {
    for mut policy in policies(goal) {
        let ledger = Ledger::default();
        let barrier = Barrier::new(film, &ledger, BOUNDS, exposure);
        let d = policy.decide(&barrier);
        let what = format!("{} {goal:?} {what}", policy.name());
        assert!(d.values.iter().all(|v| v.is_finite()), "{what}: {:?}", d.values);
        for (target, count) in d.targets.iter().zip(counts(film)) {
            assert!((count..=BOUNDS.max_spp).contains(target), "{what}: {count} to {target}");
        }
    }
}

/// An undefined threshold stops nobody who has a spread: what is not known goes on.
#[test]
fn an_undefined_goal_goes_on() {
    let film = film([9, 9], [0, 0, 9, 9], Filling::Firefly(1.0), 8);
    for goal in [Goal::Threshold(f64::NAN), Goal::Tolerance(f64::NAN), Goal::Average(f64::NAN)] {
        for mut policy in policies(goal).into_iter().take(2) {
            let d = policy.decide(&Barrier::new(&film, &Ledger::default(), BOUNDS, 1.0));
            assert_eq!(d.targets, [16; 81], "{} {goal:?}", policy.name());
        }
    }
}

/// The shipped machines are never asked about what is not finite.
#[test]
fn nothing_undefined_reaches_a_machine() {
    let mut asked = 0;
    for count in [8, 64] {
        let film = film([24, 24], [0, 0, 24, 24], Filling::Wild, count);
        for exposure in [1e-6, 1.0, 1e6] {
            let mut svm = Svm::new(Goal::Average(100.0), MACHINE.clone());
            let mut paper = PAPER.clone();
            let ledger = Ledger::default();
            let barrier = Barrier::new(&film, &ledger, BOUNDS, exposure);
            svm.decide(&barrier);
            paper.decide(&barrier);
            asked += svm.decided + paper.decided;
            assert_eq!((svm.undefined, paper.undefined), (0, 0), "{count} {exposure:e}");
        }
    }
    assert!(asked > 1000, "{asked}");
}

/// What is put back may exceed what a float holds.
#[test]
fn a_correction_does_not_overflow() {
    let mut film = film([9, 9], [0, 0, 9, 9], Filling::Firefly(f32::MAX), 1);
    for correction in [f32::MAX, -f32::MAX] {
        film.correction = vec![[correction; 3]; 81];
        assert!(film.beauty().iter().flatten().all(|c| (0.0..=f32::MAX).contains(c)), "{correction:e}");
    }
}

/// Whole renders of light near the end of f32: samples overflow here and there, the picture does not.
#[test]
fn scenes_near_overflow_give_finite_pictures() {
    let bounds = Bounds { min_spp: 8, max_spp: 64 };
    let mut corrected = 0;
    for radiance in [1e37, 3e38] {
        let mut description = guard("fine-checkerboard", 24);
        for light in &mut description.lights {
            if let Light::Environment { radiance: r, .. } = light {
                *r = Vec3::splat(radiance);
            }
        }
        let stage = Stage::new(description);
        for exposure in [None, Some(1e-6), Some(1.0), Some(1e6)] {
            for mut policy in policies(Goal::Threshold(0.5)) {
                let limits = sparing_adaptive::layers::Limits { exposure, ..limits(bounds) };
                let (film, outcome) = stage.render(3, None, &mut *policy, &limits);
                let what = format!("{} {radiance:e} {exposure:?}", policy.name());
                corrected += usize::from(!film.correction.is_empty());
                let finite = |p: &[f32; 3]| p.iter().all(|c| c.is_finite());
                assert!(film.correction.iter().all(finite), "{what}: correction");
                assert!(film.beauty().iter().all(|p| finite(p) && p.iter().all(|c| *c >= 0.0)), "{what}");
                assert!(outcome.predicted_error.is_none_or(f64::is_finite), "{what}");
                assert!(counts(&film).iter().all(|n| (8..=64).contains(n)), "{what}");
            }
        }
    }
    assert!(corrected > 0, "some policy puts something back");
}
