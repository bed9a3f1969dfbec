//! The fast colour functions against the exact ones.

use sparing_image::color::{ciede2000, fast, rgb_to_lab};

/// Numbers in 0..1, the same in every run.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1_u64 << 24) as f64
    }
}

#[test]
fn cube_roots_are_good_to_four_ulp() {
    let mut worst = 0.0_f64;
    for bits in (f32::MIN_POSITIVE.to_bits()..f32::MAX.to_bits()).step_by(1009) {
        let x = f32::from_bits(bits);
        if (1e-30..1e30).contains(&x) {
            let exact = f64::from(x).cbrt();
            worst = worst.max((f64::from(fast::cbrt(x)) / exact - 1.0).abs());
        }
    }
    assert!(worst < 4.0 * f64::from(f32::EPSILON) / 2.0, "{worst:e}");
}

#[test]
fn lab_is_good_to_two_ten_thousandths() {
    let mut next = numbers();
    for _ in 0..200_000 {
        // Dark colours as often as bright ones.
        let scale = next().powi(4);
        let rgb = [0; 3].map(|_| (next() * scale) as f32);
        let (fast, exact) = (fast::rgb_to_lab(rgb), rgb_to_lab(rgb.map(f64::from)));
        for c in 0..3 {
            assert!((f64::from(fast[c]) - exact[c]).abs() < 2e-4, "{rgb:?}: {fast:?} {exact:?}");
        }
    }
}

#[test]
fn ciede2000_of_the_published_pairs() {
    for line in include_str!("data/ciede2000.txt").lines().filter(|l| !l.starts_with('#')) {
        let v: Vec<f32> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
        let (a, b) = ([v[0], v[1], v[2]], [v[3], v[4], v[5]]);
        let exact = ciede2000(a.map(f64::from), b.map(f64::from));
        // Some pairs have opposite hues on purpose.
        let opposite = a[1] * b[1] + a[2] * b[2] < 0.0 && (a[1] * b[2] - a[2] * b[1]).abs() < 0.02;
        if !opposite {
            assert!((f64::from(fast::ciede2000(a, b)) - exact).abs() < 1e-3, "{line}");
        }
        assert_eq!(fast::ciede2000(a, a), 0.0);
    }
}

#[test]
fn ciede2000_of_displayed_colours_is_within_its_bound() {
    let mut next = numbers();
    for i in 0..1_000_000 {
        let scale = next().powi(3);
        let first = [0; 3].map(|_| next() * scale);
        // From nearly equal to unrelated.
        let step = 10_f64.powf(-4.5 * next());
        let second = first.map(|x| (x + step * (2.0 * next() - 1.0) * scale).clamp(0.0, 1.0));
        // The inputs of both are the same: what the conversion adds is tested above.
        let (a, b) = (fast::rgb_to_lab(first.map(|x| x as f32)), fast::rgb_to_lab(second.map(|x| x as f32)));
        let exact = ciede2000(a.map(f64::from), b.map(f64::from));
        let error = (f64::from(fast::ciede2000(a, b)) - exact).abs();
        let (h1, h2) = (f64::from(a[2]).atan2(a[1].into()), f64::from(b[2]).atan2(b[1].into()));
        let opposite = ((h1 - h2).abs() - std::f64::consts::PI).abs() < 2e-4;
        assert!(opposite || error < 1e-3 + 2e-4 * exact, "{i}: {first:?} {second:?} {exact} +- {error}");
    }
}

#[test]
fn greys_and_equal_colours_are_defined() {
    let (black, grey, white) = ([0.0; 3], [50.0, 0.0, 0.0], [100.0, 0.0, 0.0]);
    for (a, b) in [(black, black), (black, white), (grey, white), (grey, [50.0, 3.0, -4.0])] {
        let exact = ciede2000(a.map(f64::from), b.map(f64::from));
        assert!((f64::from(fast::ciede2000(a, b)) - exact).abs() < 1e-3, "{a:?} {b:?}");
    }
}
