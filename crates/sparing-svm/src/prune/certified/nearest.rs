//! The nearest of some hundred vectors, roughly: in f32, since any vector gives a valid bound and the distance to the
//! chosen one is computed again in f64.

/// Vectors by feature, so that distances of neighbours are computed together.
#[derive(Clone, Debug)]
pub(super) struct Nearest {
    /// Centre of the vectors, taken off first: f32 keeps its digits.
    centre: Vec<f64>,
    columns: Vec<f32>,
    vectors: Vec<f64>,
    count: usize,
}

/// Distances that are computed at a time, on the stack.
const BLOCK: usize = 64;

impl Nearest {
    pub(super) fn new(vectors: &[f64], features: usize) -> Self {
        let count = vectors.len() / features;
        let mut centre = vec![0.0; features];
        for row in vectors.chunks_exact(features) {
            centre.iter_mut().zip(row).for_each(|(c, v)| *c += v / count as f64);
        }
        let padded = count.next_multiple_of(BLOCK);
        let mut columns = vec![f32::INFINITY; padded * features];
        for (i, row) in vectors.chunks_exact(features).enumerate() {
            let (block, lane) = (i / BLOCK, i % BLOCK);
            for (f, v) in row.iter().enumerate() {
                columns[(block * features + f) * BLOCK + lane] = (v - centre[f]) as f32;
            }
        }
        Self { centre, columns, vectors: vectors.to_vec(), count }
    }

    /// The squared distance, in f64, from the nearest vector or one about as near.
    pub(super) fn distance2(&self, query: &[f64]) -> f64 {
        let features = self.centre.len();
        let mut best = (0, f32::INFINITY);
        for (b, block) in self.columns.chunks_exact(BLOCK * features).enumerate() {
            let mut d = [0.0_f32; BLOCK];
            for (f, column) in block.chunks_exact(BLOCK).enumerate() {
                let x = (query[f] - self.centre[f]) as f32;
                for (d, c) in d.iter_mut().zip(column) {
                    *d += (x - c) * (x - c);
                }
            }
            let least = d.iter().copied().fold(f32::INFINITY, f32::min);
            if least < best.1 {
                best = (b * BLOCK + d.iter().position(|v| *v == least).unwrap_or(0), least);
            }
        }
        let i = best.0.min(self.count - 1);
        let row = &self.vectors[i * features..(i + 1) * features];
        row.iter().zip(query).map(|(c, x)| (c - x) * (c - x)).sum()
    }

    pub(super) fn bytes(&self) -> usize {
        4 * self.columns.len() + 8 * (self.vectors.len() + self.centre.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::Rng;

    #[test]
    fn the_nearest_is_found() {
        let mut rng = Rng::new(1, 0);
        let vectors: Vec<f64> = (0..3 * 150).map(|_| rng.uniform()).collect();
        let nearest = Nearest::new(&vectors, 3);
        for _ in 0..200 {
            let x = [rng.uniform(), rng.uniform(), rng.uniform()];
            let d = |c: &[f64]| c.iter().zip(&x).map(|(c, x)| (c - x) * (c - x)).sum::<f64>();
            let truth = vectors.chunks(3).map(d).fold(f64::INFINITY, f64::min);
            assert!((nearest.distance2(&x) - truth).abs() < 1e-6);
        }
        assert!(nearest.distance2(&[f64::NAN; 3]).is_nan());
        assert!(nearest.distance2(&[1e200; 3]) == f64::INFINITY);
    }
}
