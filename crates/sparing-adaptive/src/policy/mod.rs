//! Policies: who gets more samples. One file each.

mod half_buffer;
pub mod paper;
mod shapes;
mod svm;
mod threshold;
mod uniform;

pub use half_buffer::HalfBuffer;
pub use paper::Paper;
pub use shapes::Shapes;
pub use svm::{Band, Svm};
pub(crate) use threshold::{PERCEIVED_PER_RELATIVE, own_spread};
pub use threshold::{Pooling, Threshold};
pub use uniform::Uniform;

use crate::goal::Bounds;
use crate::view::View;
use sparing_image::film::{Film, FilmOptions};
use std::cell::OnceCell;

/// What a policy may look at, at a barrier.
pub struct Barrier<'a> {
    /// The film so far.
    pub film: &'a Film,
    /// Least and most samples.
    pub bounds: Bounds,
    exposure: f32,
    view: OnceCell<View>,
}

impl<'a> Barrier<'a> {
    /// A barrier of a render with this exposure.
    #[must_use]
    pub fn new(film: &'a Film, bounds: Bounds, exposure: f32) -> Self {
        Self { film, bounds, exposure, view: OnceCell::new() }
    }

    /// Statistics of all pixels; made when first asked for.
    pub fn view(&self) -> &View {
        self.view.get_or_init(|| View::new(self.film, self.exposure))
    }
}

/// What a policy decided.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decisions {
    /// Samples that each pixel of the picture shall have, in rows; pixels that already have them stop.
    pub targets: Vec<u32>,
    /// The decision values, positive where a pixel goes on: how much it is worth. Empty if the policy has none.
    pub values: Vec<f32>,
}

/// Decides at every barrier which pixels get more samples.
pub trait Policy: Send {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// What the film must keep for it.
    fn film_options(&self) -> FilmOptions {
        FilmOptions::default()
    }

    /// Whether it looks at radiance, so that the exposure matters.
    fn uses_exposure(&self) -> bool {
        true
    }

    /// Samples that every pixel gets before the first barrier.
    fn first_target(&self, bounds: Bounds) -> u32 {
        bounds.min_spp.min(bounds.max_spp)
    }

    /// Who goes on, and how far. All pixels are asked, those that stopped before as well.
    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions;
}

/// Twice the samples, within the bounds.
pub(crate) fn doubled(count: u32, bounds: Bounds) -> u32 {
    count.max(1).saturating_mul(2).clamp(bounds.min_spp.min(bounds.max_spp), bounds.max_spp.max(count))
}
