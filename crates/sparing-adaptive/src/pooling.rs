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
    /// The larger of the own value, times a weight, and the root mean square of the neighbourhood: one lucky pixel does not
    /// stop early where its neighbours are noisy.
    #[must_use]
    pub fn pooled(&self, own_weight: f32) -> Self {
        let square = |v: f32| f64::from(v) * f64::from(v);
        self.neighbourhoods(
            square,
            |a, b| a + b,
            |own, squares, n| (own_weight * own).max((squares / n).sqrt() as f32),
        )
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
        self.neighbourhoods(|v| v, f32::max, |_, largest, _| largest)
    }

    /// Joins what `of` makes of the values of each neighbourhood, first in columns, then in rows; `finish` gets a pixel's own
    /// value, what its neighbourhood gave and how many pixels that has.
    fn neighbourhoods<T: Copy + Default>(
        &self,
        of: impl Fn(f32) -> T + Sync,
        join: impl Fn(T, T) -> T + Sync,
        finish: impl Fn(f32, T, f64) -> f32 + Sync,
    ) -> Self {
        let Self { width, height, values } = self;
        let (width, height) = (*width, *height);
        let mut out = vec![0.0; values.len()];
        let line = |y: usize| &values[y * width..(y + 1) * width];
        out.par_chunks_mut(width.max(1)).enumerate().for_each_init(
            || vec![T::default(); width],
            |columns, (y, out)| {
                columns.iter_mut().zip(line(y)).for_each(|(c, v)| *c = of(*v));
                let beside = [y.checked_sub(1), Some(y + 1).filter(|y| *y < height)];
                for y in beside.iter().flatten() {
                    columns.iter_mut().zip(line(*y)).for_each(|(c, v)| *c = join(*c, of(*v)));
                }
                let rows = 1.0 + beside.iter().flatten().count() as f64;
                let own = line(y);
                // The borders apart, so that the loop in between has no conditions.
                for x in [0, width - 1] {
                    let around = &columns[x.saturating_sub(1)..(x + 2).min(width)];
                    let all = around[1..].iter().fold(around[0], |a, b| join(a, *b));
                    out[x] = finish(own[x], all, rows * around.len() as f64);
                }
                for ((out, own), c) in out.iter_mut().zip(own).skip(1).zip(columns.windows(3)) {
                    *out = finish(*own, join(join(c[0], c[1]), c[2]), rows * 3.0);
                }
            },
        );
        Self { width, height, values: out }
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
        assert_eq!(plane(1, 1, &[3.0]).pooled(1.0).values, [3.0]);
        assert_eq!(plane(1, 1, &[3.0]).dilated().values, [3.0]);
    }

    #[test]
    fn borders_cut_the_neighbourhood() {
        let p = plane(3, 3, &[9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let pooled = p.pooled(1.0).values;
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
        assert_eq!(plane(2, 1, &[f32::MAX, f32::MAX]).pooled(1.0).values, [f32::MAX, f32::MAX]);
    }
}
