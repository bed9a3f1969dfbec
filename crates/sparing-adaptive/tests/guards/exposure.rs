//! How bright a scene is does not matter: the exposure of the first layer takes it out.

use crate::common::{MACHINE, Stage, counts, guard, limits};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::policy::{Planned, Policy, Shapes, Svm, Threshold};
use sparing_scene::SceneDescription;
use sparing_scene::description::{ColorInput, Light};

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 128 };

/// All lights times a factor.
fn scaled(mut description: SceneDescription, factor: f32) -> SceneDescription {
    for emission in description.shapes.iter_mut().filter_map(|s| s.emission.as_mut()) {
        match &mut emission.radiance {
            ColorInput::Constant(radiance) => *radiance *= factor,
            ColorInput::Texture(_) => panic!("the guards have no textured lamps"),
        }
    }
    for light in &mut description.lights {
        match light {
            Light::Point { intensity, .. }
            | Light::Spot { intensity, .. }
            | Light::Goniometric { intensity, .. }
            | Light::Projection { intensity, .. } => *intensity *= factor,
            Light::Distant { irradiance, .. } => *irradiance *= factor,
            Light::Environment { radiance, .. } => *radiance *= factor,
        }
    }
    description
}

/// Policies for a goal. Not the sampler of 2015, whose features are radiance as it is.
fn policies(goal: Goal) -> [Box<dyn Policy>; 4] {
    [
        Box::new(Threshold::new(goal)),
        Box::new(Svm::new(goal, MACHINE.clone())),
        Box::new(Planned { goal }),
        Box::new(Shapes),
    ]
}

/// By policy and goal, the share of pixels with as many samples in a scene as in its brighter twin.
fn shares_of_equal_counts(scene: &str, factor: f32) -> Vec<(String, f64)> {
    let [one, other] = [1.0, factor].map(|f| Stage::new(scaled(guard(scene, 32), f)));
    let mut shares = Vec::new();
    for goal in [Goal::Average(24.0), Goal::Tolerance(0.5), Goal::Threshold(0.3)] {
        for (mut a, mut b) in policies(goal).into_iter().zip(policies(goal)) {
            let (first, outcome) = one.render(2, None, &mut *a, &limits(BOUNDS));
            let (second, _) = other.render(2, None, &mut *b, &limits(BOUNDS));
            assert!(outcome.layers.len() > 1, "{} {goal:?} does not decide anything", a.name());
            let [first, second] = [counts(&first), counts(&second)];
            let equal = first.iter().zip(&second).filter(|(a, b)| a == b).count();
            shares.push((format!("{} {goal:?}", a.name()), equal as f64 / first.len() as f64));
        }
    }
    shares
}

/// Powers of two change no digit.
#[test]
fn powers_of_two_change_no_count() {
    for scene in ["fireflies", "light-through-hole"] {
        for factor in [20.0_f32.exp2(), (-20.0_f32).exp2()] {
            for (what, share) in shares_of_equal_counts(scene, factor) {
                assert_eq!(share, 1.0, "{scene} {factor:e}: {what}");
            }
        }
    }
}

/// Other factors change last digits; pixels within these of a threshold may go the other way, and their neighbours after them.
#[test]
fn a_million_times_brighter_or_darker_changes_next_to_no_count() {
    for factor in [1e6, 1e-6] {
        for (what, share) in shares_of_equal_counts("fireflies", factor) {
            assert!(share > 0.99, "{factor:e}: {what}: {share}");
        }
    }
}
