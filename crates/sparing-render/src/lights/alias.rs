//! Choice among weighted items in constant time (A. Walker 1977, built after M. Vose 1991).

/// An alias table.
#[derive(Clone, Debug, Default)]
pub struct AliasTable {
    /// Share of the slot that keeps its own item, and the other item.
    slots: Vec<(f32, u32)>,
    probabilities: Vec<f32>,
}

impl AliasTable {
    /// From weights that are finite and not negative; empty if all are zero.
    #[must_use]
    pub fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        if total.is_nan() || total <= 0.0 {
            return Self { slots: Vec::new(), probabilities: vec![0.0; weights.len()] };
        }
        let n = weights.len();
        let mut scaled: Vec<f64> = weights.iter().map(|w| w / total * n as f64).collect();
        let mut slots = vec![(1.0f32, 0u32); n];
        for (i, s) in slots.iter_mut().enumerate() {
            s.1 = i as u32;
        }
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|i| scaled[*i] < 1.0);
        while let (Some(s), Some(l)) = (small.pop(), large.pop()) {
            slots[s] = (scaled[s] as f32, l as u32);
            scaled[l] -= 1.0 - scaled[s];
            if scaled[l] < 1.0 { small.push(l) } else { large.push(l) }
        }
        // Rounding can leave an item of weight 0 over: it must not be chosen.
        let heaviest = (0..n).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).unwrap_or(0);
        for i in small.into_iter().chain(large) {
            slots[i] = (1.0, if weights[i] > 0.0 { i } else { heaviest } as u32);
        }
        for (i, slot) in slots.iter_mut().enumerate() {
            if weights[i] == 0.0 {
                slot.0 = 0.0;
            }
        }
        Self { slots, probabilities: weights.iter().map(|w| (w / total) as f32).collect() }
    }

    /// Whether nothing can be chosen.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Item for `u` in [0, 1), and its probability. The table must not be empty.
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f32) -> (u32, f32) {
        let n = self.slots.len();
        // f64 keeps enough digits of the remainder for large tables.
        let x = f64::from(u) * n as f64;
        let i = (x as usize).min(n - 1);
        let (keep, other) = self.slots[i];
        let chosen = if ((x - i as f64) as f32) < keep { i as u32 } else { other };
        (chosen, self.probabilities[chosen as usize])
    }

    /// Probability of an item.
    #[inline]
    #[must_use]
    pub fn probability(&self, item: u32) -> f32 {
        self.probabilities[item as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_follow_the_weights() {
        for weights in
            [vec![1.0], vec![1.0, 0.0, 3.0], vec![0.1, 0.2, 0.3, 0.4, 5.0, 1e-3], vec![0.0, 1e-12, 1e12]]
        {
            let t = AliasTable::new(&weights);
            let n = 1_000_000;
            let mut counts = vec![0u32; weights.len()];
            for i in 0..n {
                let (item, p) = t.sample((i as f32 + 0.5) / n as f32);
                assert!(p > 0.0, "an item of weight zero was chosen");
                counts[item as usize] += 1;
            }
            let total: f64 = weights.iter().sum();
            for (c, w) in counts.iter().zip(&weights) {
                assert!((f64::from(*c) / f64::from(n) - w / total).abs() < 1e-4, "{weights:?} {counts:?}");
            }
        }
        assert!(AliasTable::new(&[0.0, 0.0]).is_empty());
        assert!(AliasTable::new(&[]).is_empty());
    }
}
