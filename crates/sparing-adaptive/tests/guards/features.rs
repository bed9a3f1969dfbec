//! What uniform sampling shows, every policy shows.
//!
//! Pictures are compared with a reference, and with uniform ones of the same seed and the same average, within the
//! feature's region, over several seeds. That a feature's light is there is proven; its errors are not proven to be worse
//! than those of uniform sampling. The level of each test is [`LEVEL`], one in a hundred for all; the seeds are fixed.

use crate::common::{BOUNDS, MACHINE, PAPER, Stage, average, counts, guard, limits};
use crate::measure::{Measures, Reference};
use crate::scenes::FEATURES;
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::policy::{Planned, Policy, Shapes, Svm, Threshold, Uniform};
use sparing_image::film::Film;
use std::collections::BTreeMap;
use std::fmt::Write;
use testkit::t_test::{Mean, t_test};

const WIDTH: u32 = 48;
const AVERAGE: f64 = 32.0;
const SEEDS: u64 = 12;
const REFERENCE_SPP: u32 = 1024;
const REFERENCE_SEED: u64 = 1 << 40;

/// 13 features, 3 policies, 3 claims.
const LEVEL: f64 = 0.01 / 117.0;
/// With less of the reference's light, which uniform sampling finds on average, the picture is nearer to one without the
/// feature: it is lost.
const LOST: f64 = 0.5;
/// Colour differences up to one are hardly noticed: a definition of the unit.
const NOTICEABLE: f64 = 1.0;
/// Relative errors below a tenth are no loss.
const SMALL_REL_MSE: f64 = 0.01;

/// Those that promise to lose nothing.
fn policies() -> [(&'static str, Box<dyn Policy>); 3] {
    let goal = Goal::Average(AVERAGE);
    [
        ("threshold", Box::new(Threshold::new(goal))),
        ("svm", Box::new(Svm::new(goal, MACHINE.clone()))),
        ("planned", Box::new(Planned { goal })),
    ]
}

/// Rules of others, which stop by a pixel's own samples with no cure for it.
fn yardsticks() -> [(&'static str, Box<dyn Policy>); 2] {
    [("paper", Box::new(PAPER.clone())), ("shapes", Box::new(Shapes))]
}

fn uniform(spp: u32) -> Bounds {
    Bounds { min_spp: spp.min(8), max_spp: spp }
}

/// A policy's measures and those of uniform sampling, by feature and seed.
struct Trial {
    policy: &'static str,
    spp: f64,
    pairs: Vec<Vec<[Measures; 2]>>,
}

impl Trial {
    /// Something of each pair of measures of a feature.
    fn values(&self, feature: usize, of: impl Fn(&[Measures; 2]) -> f64) -> Vec<f64> {
        self.pairs[feature].iter().map(of).collect()
    }
}

/// Whether the expected value is proven to be above 0.
fn proven_positive(values: &[f64]) -> bool {
    let zero = Mean { value: 0.0, variance: 0.0, dof: f64::INFINITY };
    let mean = Mean::of(values);
    mean.value > 0.0 && t_test(mean, zero) < LEVEL
}

fn trials(scene: &str, policies: Vec<(&'static str, Box<dyn Policy>)>) -> Vec<Trial> {
    let stage = Stage::new(guard(scene, WIDTH));
    let (film, _) = stage.render(REFERENCE_SEED, None, &mut Uniform, &limits(uniform(REFERENCE_SPP)));
    let reference = Reference::new(stage.size, film.beauty());
    let features: Vec<_> = FEATURES.iter().filter(|f| f.scene == scene).collect();
    let measure = |film: &Film| {
        let picture = film.beauty();
        features.iter().map(|f| reference.measure(f, &picture)).collect::<Vec<_>>()
    };
    let mut even = BTreeMap::new();
    let trial = |(name, mut policy): (_, Box<dyn Policy>)| {
        let mut trial = Trial { policy: name, spp: 0.0, pairs: vec![Vec::new(); features.len()] };
        for seed in 0..SEEDS {
            let (ours, _) = stage.render(seed, None, &mut *policy, &limits(BOUNDS));
            let spp = average(&ours);
            trial.spp += spp / SEEDS as f64;
            let even = even.entry((seed, spp.round() as u32)).or_insert_with_key(|(seed, spp)| {
                measure(&stage.render(*seed, None, &mut Uniform, &limits(uniform(*spp))).0)
            });
            for ((pairs, ours), even) in trial.pairs.iter_mut().zip(measure(&ours)).zip(even) {
                pairs.push([ours, *even]);
            }
        }
        trial
    };
    policies.into_iter().map(trial).collect()
}

/// One line a feature: policy's mean, its standard error, uniform sampling's, for every measure.
fn report(scene: &str, trial: &Trial) -> String {
    let mut text = String::new();
    for (f, feature) in FEATURES.iter().filter(|f| f.scene == scene).enumerate() {
        let _ = write!(text, "{scene}, {}: {} {:.1} spp", feature.name, trial.policy, trial.spp);
        for (name, get) in MEASURES {
            let [a, b] = [0, 1].map(|k| Mean::of(&trial.values(f, |m| get(&m[k]))));
            let [da, db] = [a, b].map(|m| m.variance.sqrt());
            let _ = write!(text, "; {name} {:.4} +- {da:.4}, uniform {:.4} +- {db:.4}", a.value, b.value);
        }
        text.push('\n');
    }
    text
}

type Get = fn(&Measures) -> f64;
const MEASURES: [(&str, Get); 3] =
    [("light", |m| m.light), ("relMSE", |m| m.rel_mse), ("CIEDE2000", |m| m.ciede2000)];

fn nothing_is_lost(scene: &str) {
    for trial in trials(scene, policies().into()) {
        let text = report(scene, &trial);
        eprint!("{text}");
        assert!((0.6 * AVERAGE..1.1 * AVERAGE).contains(&trial.spp), "{text}");
        for f in 0..trial.pairs.len() {
            let kept = trial.values(f, |[ours, _]| ours.light - LOST);
            assert!(proven_positive(&kept), "light is lost: {text}");
            let worse = trial.values(f, |[ours, even]| ours.ciede2000 - even.ciede2000 - NOTICEABLE);
            assert!(!proven_positive(&worse), "visibly worse than uniform: {text}");
            let worse = trial.values(f, |[ours, even]| ours.rel_mse - even.rel_mse - SMALL_REL_MSE);
            assert!(!proven_positive(&worse), "more error than uniform: {text}");
        }
    }
}

#[test]
fn black_beside_bright() {
    nothing_is_lost("black-and-bright");
}

#[test]
fn caustics() {
    nothing_is_lost("caustic");
}

#[test]
fn squares_finer_than_a_pixel() {
    nothing_is_lost("fine-checkerboard");
}

#[test]
fn fireflies() {
    nothing_is_lost("fireflies");
}

#[test]
fn a_light_through_a_hole() {
    nothing_is_lost("light-through-hole");
}

#[test]
fn one_lit_block_in_a_black_frame() {
    nothing_is_lost("lit-block");
}

#[test]
fn thin_wires() {
    nothing_is_lost("thin-wire");
}

#[test]
fn motion_blur() {
    nothing_is_lost("motion-blur");
}

/// Nothing to decide: all stop at once, with one value.
#[test]
fn a_constant_colour() {
    let stage = Stage::new(guard("constant-colour", 24));
    for (name, mut policy) in policies() {
        let first = policy.first_target(BOUNDS);
        let (film, outcome) = stage.render(1, None, &mut *policy, &limits(BOUNDS));
        assert!(counts(&film).iter().all(|n| *n == first), "{name}");
        assert_eq!(outcome.predicted_error, Some(0.0), "{name}");
        let even = [0.2, 0.4, 0.6_f32];
        for pixel in film.beauty() {
            assert!(pixel.iter().zip(even).all(|(p, e)| (p - e).abs() < 1e-5), "{name} {pixel:?}");
        }
    }
}

/// The measure can tell: these do lose the light that few samples find.
#[test]
fn yardsticks_lose_the_glowing_wire() {
    let scene = "thin-wire";
    let wire = FEATURES.iter().filter(|f| f.scene == scene).position(|f| f.name == "glowing wire");
    for trial in trials(scene, yardsticks().into()) {
        let text = report(scene, &trial);
        eprint!("{text}");
        let lost = trial.values(wire.expect("a feature"), |[ours, _]| LOST - ours.light);
        assert!(proven_positive(&lost), "{text}");
    }
}
