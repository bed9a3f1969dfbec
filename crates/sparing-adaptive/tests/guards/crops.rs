//! A crop with a halo is the full picture inside, bit for bit, if threshold and exposure are given.
//!
//! Counts: each barrier looks one pixel farther, and there is one for each doubling from least to most. The correction
//! looks [`CORRECTION`] pixels farther: light is spread over 4 to each side, in shares of the sum over 4 more, of errors
//! pooled with one more.

use crate::common::{MACHINE, Stage, guard};
use sparing_adaptive::goal::{Bounds, Goal};
use sparing_adaptive::layers::Limits;
use sparing_adaptive::policy::{Policy, Svm, Threshold};
use sparing_image::film::Film;

const BOUNDS: Bounds = Bounds { min_spp: 8, max_spp: 64 };
const LIMITS: Limits = Limits { bounds: BOUNDS, time: None, exposure: Some(1.0) };
const GOAL: Goal = Goal::Threshold(0.3);
const SIDE: u32 = 64;
/// 8 to 16, to 32, to 64.
const BARRIERS: u32 = 3;
const CORRECTION: u32 = 9;

/// Distance from the crop's sides of the innermost pixel that differs, plus one; 0 if none does. Sides that are the
/// picture's do not count. Of the film, and of the picture.
fn reach(full: &Film, part: &Film) -> [u32; 2] {
    let [x0, y0, x1, y1] = part.crop;
    let (width, columns) = (x1 - x0, full.width());
    let pixels = [full, part].map(|f| f.map(|t, i| t.pixels[i].clone()));
    let pictures = [full, part].map(Film::beauty);
    let mut reach = [0, 0];
    for y in y0..y1 {
        for x in x0..x1 {
            let (i, j) = ((y * columns + x) as usize, ((y - y0) * width + x - x0) as usize);
            let sides =
                [(x - x0, x0), (y - y0, y0), (x1 - 1 - x, columns - x1), (y1 - 1 - y, full.height() - y1)];
            let distance = sides.iter().filter(|s| s.1 > 0).map(|s| s.0).min().unwrap_or(u32::MAX - 1);
            let differs = [pixels[0][i] != pixels[1][j], pictures[0][i] != pictures[1][j]];
            for (reach, differs) in reach.iter_mut().zip(differs) {
                *reach = (*reach).max(if differs { distance + 1 } else { 0 });
            }
        }
    }
    reach
}

#[test]
fn a_halo_makes_a_crop_the_full_picture_inside() {
    let stage = Stage::new(guard("caustic", SIDE));
    let policies: [fn() -> Box<dyn Policy>; 2] =
        [|| Box::new(Threshold::new(GOAL)), || Box::new(Svm::new(GOAL, MACHINE.clone()))];
    let mut farthest = [0, 0];
    for policy in policies {
        let (full, _) = stage.render(5, None, &mut *policy(), &LIMITS);
        assert!(!full.correction.is_empty());
        // Inside; in corners; off the tiles; along two sides.
        for crop in [[9, 5, 60, 51], [0, 0, 40, 40], [23, 21, 64, 64], [0, 30, 64, 64], [31, 0, 64, 33]] {
            let (part, _) = stage.render(5, Some(crop), &mut *policy(), &LIMITS);
            let found = reach(&full, &part);
            let name = policy().name();
            assert!(found[0] <= BARRIERS && found[1] <= BARRIERS + CORRECTION, "{name} {crop:?} {found:?}");
            farthest = [0, 1].map(|k| farthest[k].max(found[k]));
        }
    }
    assert!(farthest[0] > 0 && farthest[1] > CORRECTION, "the halo is needed: {farthest:?}");
}

/// A crop of one pixel, and of all, at every border.
#[test]
fn tiny_crops_render() {
    let stage = Stage::new(guard("thin-wire", 20));
    let averages = [Goal::Average(20.0), Goal::Tolerance(1.0), GOAL];
    for goal in averages {
        for crop in [[0, 0, 1, 1], [19, 19, 20, 20], [0, 19, 20, 20], [7, 7, 9, 9], [0, 0, 3, 3]] {
            for mut policy in crate::common::policies(goal) {
                let (film, outcome) =
                    stage.render(1, Some(crop), &mut *policy, &Limits { exposure: None, ..LIMITS });
                let pixels = film.beauty();
                assert_eq!(pixels.len() as u32, (crop[2] - crop[0]) * (crop[3] - crop[1]));
                assert!(
                    pixels.iter().flatten().all(|c| c.is_finite() && *c > 0.0),
                    "{} {crop:?}",
                    policy.name()
                );
                assert!(outcome.decisions.iter().all(|v| v.is_finite()), "{} {crop:?}", policy.name());
            }
        }
    }
}
