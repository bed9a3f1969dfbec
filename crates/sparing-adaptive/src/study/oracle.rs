//! What a sampler could save that knows the variance of every pixel.

use crate::goal::Bounds;

/// Samples per pixel of the best allocation, over `level`, at the error that `level` samples everywhere give.
///
/// `variances` are what one sample adds to the error: pixel i with n_i samples errs by v_i / n_i. The sum of the errors
/// falls fastest where v_i / n_i^2 is largest, so the best allocation spends until that is the same everywhere: n_i is
/// proportional to the root of v_i, cut to the bounds, and not rounded. Samples count as independent. `None` if there
/// is no error, or the bounds do not hold `level`.
#[must_use]
pub fn oracle_ratio(variances: &[f64], level: f64, bounds: Bounds) -> Option<f64> {
    let (least, most) = (f64::from(bounds.min_spp), f64::from(bounds.max_spp));
    if !(least..=most).contains(&level) || least <= 0.0 {
        return None;
    }
    let roots: Vec<f64> =
        variances.iter().filter(|v| **v >= 0.0 && v.is_finite()).map(|v| v.sqrt()).collect();
    let target = roots.iter().map(|r| r * r).sum::<f64>() / level;
    if !(target > 0.0 && target.is_finite()) {
        return None;
    }
    let spp = |root: f64, lambda: f64| (root / lambda).clamp(least, most);
    let error = |lambda: f64| roots.iter().map(|r| r * r / spp(*r, lambda)).sum::<f64>();
    // Below the low end everything with variance gets the most, above the high end the least.
    let largest = roots.iter().copied().fold(0.0, f64::max);
    let smallest = roots.iter().copied().filter(|r| *r > 0.0).fold(largest, f64::min);
    let (mut low, mut high) = ((smallest / most).ln() - 1.0, (largest / least).ln() + 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if error(middle.exp()) > target { high = middle } else { low = middle }
    }
    let lambda = low.exp();
    Some(roots.iter().map(|r| spp(*r, lambda)).sum::<f64>() / roots.len() as f64 / level)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDE: Bounds = Bounds { min_spp: 1, max_spp: 1 << 20 };

    #[test]
    fn nothing_is_saved_where_all_pixels_are_alike() {
        let r = oracle_ratio(&[2.0; 10], 64.0, WIDE).unwrap();
        assert!((r - 1.0).abs() < 1e-9);
    }

    #[test]
    fn two_kinds_of_pixels_have_a_closed_form() {
        // Without bounds: (mean of sigma)^2 / mean of sigma^2.
        let v = [1.0, 1.0, 1.0, 81.0];
        let r = oracle_ratio(&v, 64.0, WIDE).unwrap();
        assert!((r - 3.0 * 3.0 / 21.0).abs() < 1e-9, "{r}");
    }

    #[test]
    fn bounds_take_from_the_gain() {
        let v = [1.0, 1.0, 1.0, 81.0];
        // At least 32: 3 / 32 + 81 / n = 84 / 64.
        let n = 81.0 / (84.0 / 64.0 - 3.0 / 32.0);
        let r = oracle_ratio(&v, 64.0, Bounds { min_spp: 32, max_spp: 1 << 20 }).unwrap();
        assert!((r - (96.0 + n) / 4.0 / 64.0).abs() < 1e-9, "{r}");
        assert_eq!(oracle_ratio(&v, 64.0, Bounds { min_spp: 8, max_spp: 32 }), None);
        let r = oracle_ratio(&v, 64.0, Bounds { min_spp: 8, max_spp: 64 }).unwrap();
        assert!((r - 1.0).abs() < 1e-6, "no way to do it but uniform: {r}");
        // Pixels without variance get the least.
        let r = oracle_ratio(&[0.0, 0.0, 0.0, 1.0], 64.0, Bounds { min_spp: 8, max_spp: 4096 }).unwrap();
        assert!((r - (24.0 + 64.0) / 4.0 / 64.0).abs() < 1e-9);
    }

    #[test]
    fn no_variance_no_ratio() {
        assert_eq!(oracle_ratio(&[0.0; 4], 64.0, WIDE), None);
        assert_eq!(oracle_ratio(&[], 64.0, WIDE), None);
        assert_eq!(oracle_ratio(&[f64::NAN, f64::INFINITY], 64.0, WIDE), None);
    }
}
