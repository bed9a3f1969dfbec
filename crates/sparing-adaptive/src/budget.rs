//! Who goes on if the time does not suffice for all.

use crate::policy::Decisions;

/// Holds pixels back until the samples of the others fit in `budget`: those with the smallest decision values, which are
/// worths of one sample, wait. Says whether any waits. Decisions without values, where all pixels are worth the same, stay
/// as they are.
pub fn afford(decisions: &mut Decisions, counts: &[u32], budget: u64) -> bool {
    let Decisions { targets, values, .. } = decisions;
    let missing = |pixel: usize, targets: &[u32]| u64::from(targets[pixel].saturating_sub(counts[pixel]));
    let wanted: u64 = (0..targets.len()).map(|pixel| missing(pixel, targets)).sum();
    if wanted <= budget || values.len() != targets.len() {
        return false;
    }
    let mut waiting: Vec<usize> = (0..targets.len()).filter(|pixel| missing(*pixel, targets) > 0).collect();
    // Equal values: the first pixel first. The sort is stable.
    waiting.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    let mut left = budget;
    for pixel in waiting {
        match left.checked_sub(missing(pixel, targets)) {
            Some(rest) => left = rest,
            None => {
                // Nobody overtakes: what is worth less waits too.
                left = 0;
                targets[pixel] = counts[pixel];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: [u32; 5] = [8, 16, 8, 8, 32];

    fn decisions() -> Decisions {
        // Wanted: 8, 16, none, 8 and 32 samples; the best is the fourth pixel, then the second.
        Decisions { targets: vec![16, 32, 8, 16, 64], values: vec![0.5, 1.0, -1.0, 3.0, 0.5], lambda: None }
    }

    #[test]
    fn the_most_worthy_go_on_until_the_budget_is_spent() {
        for (budget, targets) in [
            (0, [8, 16, 8, 8, 32]),
            (7, [8, 16, 8, 8, 32]),
            (8, [8, 16, 8, 16, 32]),
            (23, [8, 16, 8, 16, 32]),
            (24, [8, 32, 8, 16, 32]),
            (32, [16, 32, 8, 16, 32]),
            (63, [16, 32, 8, 16, 32]),
        ] {
            let mut d = decisions();
            assert!(afford(&mut d, &COUNTS, budget));
            assert_eq!(d.targets, targets, "{budget}");
            assert_eq!(d.values, decisions().values);
        }
    }

    #[test]
    fn nobody_waits_if_all_can_go_on_or_all_are_equal() {
        for budget in [64, u64::MAX] {
            let mut d = decisions();
            assert!(!afford(&mut d, &COUNTS, budget) && d == decisions());
        }
        let mut even = Decisions { values: Vec::new(), ..decisions() };
        assert!(!afford(&mut even, &COUNTS, 1));
        assert_eq!(even.targets, decisions().targets);
    }
}
