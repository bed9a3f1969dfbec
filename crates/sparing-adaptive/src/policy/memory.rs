//! What a machine said of pixels around which nothing has changed since: most of them, at late barriers.

use crate::view::View;

/// Thresholds whose decision values are kept.
const PAGES: usize = 8;

/// Decision values at the thresholds that were asked last. Within a render, the statistics of a pixel are a function of its count.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    exposure: f32,
    /// The one in use at the end.
    pages: Vec<Page>,
}

#[derive(Clone, Debug)]
struct Page {
    lambda: f64,
    pixels: Vec<Said>,
}

/// What the machine said of a pixel when it and its neighbours had so many samples. Counts only grow: if none changes, their sum stays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Said {
    samples: u32,
    value: f32,
}

impl Memory {
    /// What was said at a threshold, of all pixels.
    pub(super) fn recall(&mut self, view: &View, lambda: f64) -> &mut [Said] {
        let other = |page: &Page| page.pixels.len() != view.pixels.len();
        if self.exposure != view.exposure || self.pages.iter().any(other) {
            self.exposure = view.exposure;
            self.pages.clear();
        }
        let mut page = match self.pages.iter().position(|p| p.lambda == lambda) {
            Some(known) => self.pages.remove(known),
            None if self.pages.len() == PAGES => self.pages.remove(0),
            None => Page { lambda: f64::NAN, pixels: vec![Said::NOTHING; view.pixels.len()] },
        };
        if page.lambda != lambda {
            page.lambda = lambda;
            page.pixels.fill(Said::NOTHING);
        }
        self.pages.push(page);
        self.pages.last_mut().map_or(&mut [], |page| &mut page.pixels)
    }
}

impl Said {
    const NOTHING: Self = Self { samples: u32::MAX, value: 0.0 };

    /// The value if there were as many samples around.
    pub(super) fn with(self, samples: u32) -> Option<f32> {
        (self.samples == samples).then_some(self.value)
    }

    /// Notes what is said with so many.
    pub(super) fn note(&mut self, samples: u32, value: f32) {
        *self = Self { samples, value };
    }
}
