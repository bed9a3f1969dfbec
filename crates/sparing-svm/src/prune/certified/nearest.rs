//! The nearest of some hundred vectors, roughly: in f32, since any vector gives a valid bound and the distance
//! to the chosen one is computed again in f64.

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
        let i = search(&self.columns, &self.centre, query).min(self.count - 1);
        let features = self.centre.len();
        let row = &self.vectors[i * features..(i + 1) * features];
        row.iter().zip(query).map(|(c, x)| (c - x) * (c - x)).sum()
    }

    pub(super) fn bytes(&self) -> usize {
        4 * self.columns.len() + 8 * (self.vectors.len() + self.centre.len())
    }
}

/// The place of the smallest distance in f32: each lane keeps its own best, joined at the end.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2+fma"))]
fn search(columns: &[f32], centre: &[f64], query: &[f64]) -> usize {
    let (mut least, mut place) = ([f32::INFINITY; BLOCK], [0_u32; BLOCK]);
    for (b, block) in columns.chunks_exact(BLOCK * centre.len()).enumerate() {
        let mut d = [0.0_f32; BLOCK];
        for ((column, x), c) in block.as_chunks::<BLOCK>().0.iter().zip(query).zip(centre) {
            let x = (x - c) as f32;
            for lane in 0..BLOCK {
                let difference = x - column[lane];
                d[lane] += difference * difference;
            }
        }
        for lane in 0..BLOCK {
            let nearer = d[lane] < least[lane];
            least[lane] = if nearer { d[lane] } else { least[lane] };
            place[lane] = if nearer { b as u32 } else { place[lane] };
        }
    }
    let mut best = 0;
    for lane in 1..BLOCK {
        best = if least[lane] < least[best] { lane } else { best };
    }
    place[best] as usize * BLOCK + best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prune::Random;

    #[test]
    fn the_nearest_is_found() {
        let mut rng = Random::stream(1, 0);
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
