//! Error over cost as a curve through measured renders.

/// A policy's error over its cost (seconds or samples per pixel), linear between renders in the logarithms of both.
///
/// Measured errors wobble, and a dip must not count as an error that was reached. So the curve is the decreasing one that
/// is nearest to the points (least squares of the logarithms, pool adjacent violators: Barlow et al. 1972): renders that
/// cost more and err more are joined with those before them, at their geometric mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Logarithms of cost and error: costs rise and errors fall strictly.
    points: Vec<[f64; 2]>,
    /// Cost of the dearest render.
    dearest: f64,
}

/// What an error costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cost {
    /// So much.
    Exactly(f64),
    /// At most so much: the cheapest render is better already.
    AtMost(f64),
    /// More than this: the dearest render is not good enough.
    MoreThan(f64),
}

/// Renders joined into one point: sums of the logarithms, and how many.
struct Group {
    cost: f64,
    error: f64,
    n: f64,
}

impl Curve {
    /// A curve through (cost, error), in any order. Points that are not positive and finite are left out.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let usable = |v: f64| v > 0.0 && v.is_finite();
        let mut logs: Vec<[f64; 2]> = points
            .into_iter()
            .filter(|(c, e)| usable(*c) && usable(*e))
            .map(|(c, e)| [c.ln(), e.ln()])
            .collect();
        logs.sort_by(|a, b| a[0].total_cmp(&b[0]).then(b[1].total_cmp(&a[1])));
        let dearest = logs.last().map_or(0.0, |p| p[0].exp());
        let mut groups: Vec<Group> = Vec::new();
        for [cost, error] in logs {
            let mut group = Group { cost, error, n: 1.0 };
            while let Some(last) = groups.pop() {
                let falls = group.error / group.n < last.error / last.n;
                let rises = group.cost / group.n > last.cost / last.n;
                if falls && rises {
                    groups.push(last);
                    break;
                }
                group = Group {
                    cost: group.cost + last.cost,
                    error: group.error + last.error,
                    n: group.n + last.n,
                };
            }
            groups.push(group);
        }
        Self { points: groups.iter().map(|g| [g.cost / g.n, g.error / g.n]).collect(), dearest }
    }

    /// The error at a cost; `None` outside of what was measured.
    #[must_use]
    pub fn error_at(&self, cost: f64) -> Option<f64> {
        interpolate_sorted(&self.points, cost.ln()).map(f64::exp)
    }

    /// The cost of an error; `None` of an empty curve or for an error that is not positive.
    #[must_use]
    pub fn cost_at(&self, error: f64) -> Option<Cost> {
        let (first, last) = (self.points.first()?, self.points.last()?);
        let target = error.ln();
        if !target.is_finite() {
            None
        } else if target > first[1] {
            Some(Cost::AtMost(first[0].exp()))
        } else if target < last[1] {
            Some(Cost::MoreThan(self.dearest))
        } else {
            // Errors fall strictly: with the axes swapped, and in rising order, the same interpolation.
            let swapped: Vec<[f64; 2]> = self.points.iter().rev().map(|p| [p[1], p[0]]).collect();
            interpolate_sorted(&swapped, target).map(|c| Cost::Exactly(c.exp()))
        }
    }
}

/// Linear between points of rising first coordinate.
fn interpolate_sorted(points: &[[f64; 2]], x: f64) -> Option<f64> {
    // One point stands for itself, up to rounding.
    let [first, .., last] = points else {
        return points.first().filter(|p| (p[0] - x).abs() < 1e-9).map(|p| p[1]);
    };
    if x < first[0] - 1e-9 || x > last[0] + 1e-9 {
        return None;
    }
    let i = points.partition_point(|p| p[0] < x).clamp(1, points.len() - 1);
    let ([x0, y0], [x1, y1]) = (points[i - 1], points[i]);
    let t = if x1 > x0 { ((x - x0) / (x1 - x0)).clamp(0.0, 1.0) } else { 0.0 };
    Some(y0 + t * (y1 - y0))
}

/// A signed quantity at a cost, linear in the logarithm of the cost between the two nearest renders: for biases, which
/// need not fall. `None` outside of what was measured.
#[must_use]
pub fn interpolate(points: impl IntoIterator<Item = (f64, f64)>, cost: f64) -> Option<f64> {
    let mut points: Vec<[f64; 2]> = points
        .into_iter()
        .filter(|(c, v)| *c > 0.0 && c.is_finite() && v.is_finite())
        .map(|(c, v)| [c.ln(), v])
        .collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    interpolate_sorted(&points, cost.ln())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// error = factor / cost, at costs 8, 16 ... 1024
    fn inverse(factor: f64) -> Curve {
        Curve::new((3..=10).map(|k| f64::from(1 << k)).map(|c| (c, factor / c)))
    }

    fn exactly(cost: Option<Cost>) -> f64 {
        match cost {
            Some(Cost::Exactly(c)) => c,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn power_laws_are_met_exactly() {
        let (a, b) = (inverse(1.0), inverse(0.4));
        for cost in [20.0, 64.0, 256.0, 333.3] {
            let error = a.error_at(cost).unwrap();
            assert!((error * cost - 1.0).abs() < 1e-12);
            assert!((exactly(a.cost_at(error)) / cost - 1.0).abs() < 1e-12);
            assert!((exactly(b.cost_at(error)) / cost - 0.4).abs() < 1e-12, "the known ratio");
        }
        // A slope of -1/2 needs the square.
        let slow = Curve::new((0..=12).map(|k| f64::from(1 << k)).map(|c| (c, c.powf(-0.5))));
        assert!((exactly(slow.cost_at(1.0 / 32.0)) - 1024.0).abs() < 1e-9);
    }

    #[test]
    fn what_was_not_measured_is_not_made_up() {
        let a = inverse(1.0);
        assert_eq!((a.error_at(7.0), a.error_at(1025.0)), (None, None));
        let Some(Cost::AtMost(c)) = a.cost_at(0.2) else { panic!() };
        assert!((c - 8.0).abs() < 1e-12);
        let Some(Cost::MoreThan(c)) = a.cost_at(1e-4) else { panic!() };
        assert!((c - 1024.0).abs() < 1e-9);
        assert_eq!((a.cost_at(0.0), a.cost_at(f64::NAN)), (None, None));
        assert_eq!(Curve::new([]).cost_at(1.0), None);
        assert_eq!(Curve::new([(1.0, 0.0), (f64::NAN, 1.0), (2.0, f64::INFINITY)]).error_at(1.0), None);
        let one = Curve::new([(8.0, 0.5)]);
        assert!((exactly(one.cost_at(0.5)) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn wobbles_are_joined_and_order_does_not_matter() {
        // The dip at 16 is no error that was reached: 16 and 64 join at 32, error 0.2.
        let wobble = [(8.0, 1.0), (16.0, 0.1), (64.0, 0.4), (256.0, 0.05)];
        let curve = Curve::new(wobble);
        assert!((exactly(curve.cost_at(0.2)) - 32.0).abs() < 1e-9);
        assert!((curve.error_at(32.0).unwrap() - 0.2).abs() < 1e-12);
        let mut reversed = wobble;
        reversed.reverse();
        assert_eq!(curve, Curve::new(reversed));
        let flat = Curve::new([(8.0, 1.0), (64.0, 1.1), (512.0, 1.2)]).cost_at(0.5);
        assert!(matches!(flat, Some(Cost::MoreThan(c)) if (c - 512.0).abs() < 1e-9), "the dearest: {flat:?}");
        // Equal costs are one point.
        assert!(
            (Curve::new([(8.0, 1.0), (8.0, 4.0), (16.0, 0.5)]).error_at(8.0).unwrap() - 2.0).abs() < 1e-12
        );
    }

    #[test]
    fn signed_values_are_interpolated_in_the_logarithm_of_cost() {
        let points = [(64.0, -0.02), (16.0, 0.02)];
        assert!(interpolate(points, 32.0).unwrap().abs() < 1e-12);
        assert!((interpolate(points, 16.0).unwrap() - 0.02).abs() < 1e-12);
        assert_eq!(interpolate(points, 65.0), None);
        assert_eq!(interpolate([(8.0, f64::NAN)], 8.0), None);
    }
}
