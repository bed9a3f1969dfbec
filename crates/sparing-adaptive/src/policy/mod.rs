//! Policies: who gets more samples. One file each.

mod approach;
mod half_buffer;
mod memory;
pub mod paper;
mod planned;
mod shapes;
mod svm;
mod threshold;
mod uniform;

pub use half_buffer::HalfBuffer;
pub use paper::Paper;
pub use planned::Planned;
pub use shapes::Shapes;
pub use svm::{Band, Svm};
pub use threshold::Threshold;
pub use threshold::{PERCEIVED_PER_RELATIVE, own_spread};
pub use uniform::Uniform;

use crate::goal::Bounds;
use crate::ledger::{Ledger, Passed};
use crate::pooling::Plane;
use crate::view::View;
use sparing_image::film::{Film, FilmOptions};
use std::cell::{Cell, OnceCell};

/// What a policy may look at, at a barrier.
pub struct Barrier<'a> {
    /// The film so far.
    pub film: &'a Film,
    /// Least and most samples.
    pub bounds: Bounds,
    exposure: f32,
    ledger: &'a Ledger,
    view: OnceCell<View>,
    earlier: Cell<Option<View>>,
}

impl<'a> Barrier<'a> {
    /// A barrier of a render with this exposure.
    #[must_use]
    pub fn new(film: &'a Film, ledger: &'a Ledger, bounds: Bounds, exposure: f32) -> Self {
        Self { film, bounds, exposure, ledger, view: OnceCell::new(), earlier: Cell::new(None) }
    }

    /// The same with the view of an earlier barrier of this render: pixels that have stopped are not computed again.
    #[must_use]
    pub fn with_view(
        film: &'a Film,
        ledger: &'a Ledger,
        bounds: Bounds,
        exposure: f32,
        earlier: Option<View>,
    ) -> Self {
        let earlier = earlier.filter(|v| v.exposure == exposure);
        Self { earlier: Cell::new(earlier), ..Self::new(film, ledger, bounds, exposure) }
    }

    /// Statistics of all pixels; made when first asked for.
    pub fn view(&self) -> &View {
        self.view.get_or_init(|| match self.earlier.take() {
            Some(mut view) => {
                view.update(self.film);
                view
            }
            None => View::new(self.film, self.exposure),
        })
    }

    /// Statistics with what an audit found.
    pub(crate) fn set_error_scale(&mut self, scale: f64) {
        self.view();
        if let Some(view) = self.view.get_mut() {
            view.error_scale = scale;
        }
    }

    /// The view, for the next barrier; if nobody asked for it, the earlier one.
    #[must_use]
    pub fn into_view(self) -> Option<View> {
        self.view.into_inner().or(self.earlier.into_inner())
    }

    /// The pixels that these decisions send on though their plan, within `bounds`, does not ask for it.
    pub(crate) fn passed(&self, decisions: &Decisions, bounds: Bounds) -> Vec<Passed> {
        if decisions.lambda.is_none() {
            return Vec::new();
        }
        self.ledger.passing(self.view(), decisions, bounds)
    }

    /// The spread of each pixel's neighbours within this radius at the first barrier: what a pixel's plan comes from
    /// (see [`Ledger`]). The radius must be the same in the whole render.
    pub fn plan(&self, radius: usize) -> &Plane {
        self.plan_by(|| self.view().plane(own_spread).others(radius))
    }

    /// A plan by another rule, which must leave out a pixel's own samples and be the same in the whole render.
    pub fn plan_by(&self, spread: impl FnOnce() -> Plane) -> &Plane {
        self.ledger.plan(spread)
    }
}

/// What a policy decided.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decisions {
    /// Samples that each pixel of the picture shall have, in rows; pixels that already have them stop.
    pub targets: Vec<u32>,
    /// The decision values, positive where a pixel goes on: how much it is worth. Empty if the policy has none.
    pub values: Vec<f32>,
    /// The threshold that plans are carried out by, if the policy has plans. Infinite if nobody goes on, or not all that should.
    pub lambda: Option<f64>,
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

    /// Whether a second render of few pixels shall tell how large the error is.
    fn wants_audit(&self) -> bool {
        false
    }

    /// Samples that every pixel gets before the first barrier.
    fn first_target(&self, bounds: Bounds) -> u32 {
        bounds.min_spp.min(bounds.max_spp)
    }

    /// Who goes on, and how far. All pixels are asked, those that stopped before as well.
    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions;
}

/// The bounds of a policy's plans.
pub(crate) fn plan_bounds(policy: &dyn Policy, bounds: Bounds) -> Bounds {
    Bounds { min_spp: policy.first_target(bounds), ..bounds }
}

/// Twice the samples, within the bounds.
pub(crate) fn doubled(count: u32, bounds: Bounds) -> u32 {
    count.max(1).saturating_mul(2).clamp(bounds.min_spp.min(bounds.max_spp), bounds.max_spp.max(count))
}
