//! By the number of shapes: the rule of pbrt's old adaptive sampler (Pharr and Humphreys 2010, section 7.7), and a feature
//! of Lin and Wu (2015).

use super::{Barrier, Decisions, Policy, doubled};
use sparing_image::film::FilmOptions;

/// A pixel whose camera rays all met one shape stops at the minimum; the others get the maximum.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shapes;

impl Policy for Shapes {
    fn name(&self) -> &'static str {
        "shapes"
    }

    fn film_options(&self) -> FilmOptions {
        FilmOptions { auxiliary: false, shapes: true, luminance: false }
    }

    fn uses_exposure(&self) -> bool {
        false
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let bounds = barrier.bounds;
        let pixels = barrier.film.map(|t, i| (t.pixels[i].count(), t.shapes[i].len()));
        Decisions {
            targets: pixels.iter().map(|&(n, s)| if s > 1 { doubled(n, bounds) } else { n }).collect(),
            values: pixels.iter().map(|&(_, s)| s as f32 - 1.5).collect(),
            lambda: None,
        }
    }
}
