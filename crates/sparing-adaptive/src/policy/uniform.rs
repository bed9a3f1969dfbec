//! Every pixel the same.

use super::{Barrier, Decisions, Policy};
use crate::goal::Bounds;

/// Largest number of samples between two barriers, so that progress, previews and stops are not far apart.
const MAX_WAVE: u32 = 64;

/// All pixels get the most that is allowed: doubling from 8, in steps of at most 64.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uniform;

fn next(count: u32, max: u32) -> u32 {
    count.saturating_add(count.clamp(8, MAX_WAVE)).min(max)
}

impl Policy for Uniform {
    fn name(&self) -> &'static str {
        "uniform"
    }

    fn uses_exposure(&self) -> bool {
        false
    }

    fn first_target(&self, bounds: Bounds) -> u32 {
        next(0, bounds.max_spp)
    }

    fn decide(&mut self, barrier: &Barrier<'_>) -> Decisions {
        let max = barrier.bounds.max_spp;
        let targets = barrier.film.map(|t, i| next(t.pixels[i].count(), max));
        Decisions { targets, ..Decisions::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_double_and_end_at_the_target() {
        let steps = |max| {
            let mut all = vec![next(0, max)];
            while all[all.len() - 1] < max {
                all.push(next(all[all.len() - 1], max));
            }
            all
        };
        assert_eq!(steps(1), [1]);
        assert_eq!(steps(8), [8]);
        assert_eq!(steps(100), [8, 16, 32, 64, 100]);
        assert_eq!(steps(256), [8, 16, 32, 64, 128, 192, 256]);
    }
}
