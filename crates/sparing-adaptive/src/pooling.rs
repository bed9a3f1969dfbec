//! Neighbourhoods of 3 by 3 pixels, cut at the picture's border.

use rayon::prelude::*;

/// One number a pixel, in rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height`
    pub values: Vec<f32>,
}

impl Plane {
    /// The larger of the own value and the root mean square of the neighbourhood: one lucky pixel does not stop early where its
    /// neighbours are noisy.
    #[must_use]
    pub fn pooled(&self) -> Self {
        let means = self.mean_square();
        let values = self.values.iter().zip(means).map(|(own, mean)| own.max(mean.sqrt() as f32));
        Self { width: self.width, height: self.height, values: values.collect() }
    }

    /// The mean square of the neighbourhood.
    #[must_use]
    pub fn mean_square(&self) -> Vec<f64> {
        self.neighbourhoods(|_, values| {
            let squares: f64 = values.clone().map(|v| f64::from(v) * f64::from(v)).sum();
            squares / values.count() as f64
        })
    }

    /// The root mean square of the others in the square of this radius: not one bit of it depends on the own value. 0 for
    /// a pixel that is alone.
    #[must_use]
    pub fn others(&self, radius: usize) -> Self {
        let Self { width, height, values } = self;
        let mut out = vec![0.0; values.len()];
        out.par_chunks_mut((*width).max(1)).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let (mut squares, mut count) = (0.0, 0);
                for v in y.saturating_sub(radius)..(y + radius + 1).min(*height) {
                    for u in x.saturating_sub(radius)..(x + radius + 1).min(*width) {
                        if (u, v) != (x, y) {
                            let value = f64::from(values[v * width + u]);
                            squares += value * value;
                            count += 1;
                        }
                    }
                }
                *out = (squares / f64::from(count.max(1))).sqrt() as f32;
            }
        });
        Self { width: *width, height: *height, values: out }
    }

    /// The largest value of the neighbourhood.
    #[must_use]
    pub fn dilated(&self) -> Self {
        let values = self.neighbourhoods(|own, values| values.fold(own, f32::max));
        Self { width: self.width, height: self.height, values }
    }

    fn neighbourhoods<T: Default + Clone + Send>(
        &self,
        f: impl Fn(f32, NeighbourValues<'_>) -> T + Sync,
    ) -> Vec<T> {
        let Self { width, height, values } = self;
        let mut out = vec![T::default(); values.len()];
        out.par_chunks_mut((*width).max(1)).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let around = NeighbourValues {
                    values,
                    width: *width,
                    columns: (x.saturating_sub(1), (x + 2).min(*width)),
                    at: (x.saturating_sub(1), y.saturating_sub(1)),
                    last: (y + 2).min(*height),
                };
                *out = f(values[y * width + x], around);
            }
        });
        out
    }
}

/// Values of a neighbourhood in rows.
#[derive(Clone)]
struct NeighbourValues<'a> {
    values: &'a [f32],
    width: usize,
    columns: (usize, usize),
    at: (usize, usize),
    last: usize,
}

impl Iterator for NeighbourValues<'_> {
    type Item = f32;

    fn next(&mut self) -> Option<f32> {
        if self.at.0 == self.columns.1 {
            self.at = (self.columns.0, self.at.1 + 1);
        }
        if self.at.1 >= self.last {
            return None;
        }
        let value = self.values[self.at.1 * self.width + self.at.0];
        self.at.0 += 1;
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(width: usize, height: usize, values: &[f32]) -> Plane {
        Plane { width, height, values: values.to_vec() }
    }

    #[test]
    fn one_pixel_is_its_own_neighbourhood() {
        assert_eq!(plane(1, 1, &[3.0]).pooled().values, [3.0]);
        assert_eq!(plane(1, 1, &[3.0]).dilated().values, [3.0]);
    }

    #[test]
    fn borders_cut_the_neighbourhood() {
        let p = plane(3, 3, &[9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let pooled = p.pooled().values;
        assert_eq!(pooled[0], 9.0);
        assert!((pooled[1] - (81.0_f32 / 6.0).sqrt()).abs() < 1e-5);
        assert!((pooled[4] - 3.0).abs() < 1e-6);
        assert_eq!(pooled[8], 0.0);
        assert_eq!(p.dilated().values, [9.0, 9.0, 0.0, 9.0, 9.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn others_leave_the_own_value_out() {
        for own in [0.0, 5.0, 1e30, f32::MAX] {
            let p = plane(3, 2, &[own, 3.0, 1.0, 3.0, 3.0, 1.0]);
            assert_eq!(p.others(1).values[0], 3.0);
            assert_eq!(p.others(2).values[0], (29.0_f64 / 5.0).sqrt() as f32);
        }
        assert_eq!(plane(1, 1, &[7.0]).others(1).values, [0.0]);
    }

    #[test]
    fn huge_values_do_not_overflow() {
        assert_eq!(plane(2, 1, &[f32::MAX, f32::MAX]).pooled().values, [f32::MAX, f32::MAX]);
    }
}
