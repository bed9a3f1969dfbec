//! Metrics on values that can be computed by hand, and FLIP against its authors' program.

use super::*;

const ONE: Exposure = Exposure::Scale(1.0);

fn flat(value: [f32; 3], pixels: usize) -> Vec<[f32; 3]> {
    vec![value; pixels]
}

#[test]
fn equal_pictures_have_no_error() {
    let picture: Vec<[f32; 3]> = (0..24 * 16).map(|i| [i as f32, (i % 7) as f32, 0.25]).collect();
    let c = compare(&picture, &picture, 24, 16, Exposure::Auto).unwrap();
    let zero = Summary { mean: 0.0, p95: 0.0, p99: 0.0, max: 0.0 };
    assert_eq!((c.mse, c.rel_mse, c.signed_bias, c.signed_bias_dark), (0.0, 0.0, 0.0, 0.0));
    assert_eq!((c.ciede2000, c.flip), (zero, zero));
    assert_eq!(c.psnr, f64::INFINITY);
    assert_eq!((c.compared, c.non_finite_image, c.non_finite_reference), (24 * 16, 0, 0));
}

#[test]
fn constant_pictures_by_hand() {
    // I = 0.75, R = 0.5 after an exposure of 2.
    let (i, r) = (flat([0.375; 3], 12), flat([0.25; 3], 12));
    let c = compare(&i, &r, 4, 3, Exposure::Ev(1.0)).unwrap();
    assert_eq!(c.scale, 2.0);
    assert!((c.mse - 0.0625).abs() < 1e-15);
    assert!((c.rel_mse - 0.0625 / 0.26).abs() < 1e-15);
    assert!((c.signed_bias - 0.5).abs() < 1e-12);
    assert!((c.signed_bias_dark - 0.5).abs() < 1e-12);
    // sRGB 0.880825 and 0.735357: -20 log10 of their difference.
    assert!((c.psnr - 16.7446).abs() < 1e-3, "{}", c.psnr);
    // Lab lightness 89.4 and 76.1; CIEDE2000 of greys is dL / S_L.
    let l = [0.75f64, 0.5].map(|y| 116.0 * y.cbrt() - 16.0);
    let mean = (l[0] + l[1]) / 2.0 - 50.0;
    let want = (l[0] - l[1]) / (1.0 + 0.015 * mean * mean / (20.0 + mean * mean).sqrt());
    assert!((c.ciede2000.mean - want).abs() < 1e-5 && c.ciede2000.max == c.ciede2000.p95);
}

#[test]
fn bias_hides_in_the_dark_quarter() {
    // Four pixels of 1, 2, 3, 4; only the darkest is wrong, by half. One unlit pixel is not among the lit.
    let r: Vec<[f32; 3]> = [0.0f32, 4.0, 3.0, 1.0, 2.0].map(|x| [x; 3]).to_vec();
    let mut i = r.clone();
    i[3] = [0.5; 3];
    let c = compare(&i, &r, 5, 1, ONE).unwrap();
    assert!((c.signed_bias + 0.05).abs() < 1e-12);
    assert!((c.signed_bias_dark + 0.5).abs() < 1e-12);
    let black = flat([0.0; 3], 4);
    let c = compare(&black, &black, 2, 2, Exposure::Auto).unwrap();
    assert!(c.signed_bias == 0.0 && c.signed_bias_dark.is_nan());
}

#[test]
fn non_finite_pixels_are_counted_and_left_out() {
    let r = flat([1.0; 3], 6);
    let mut i = flat([0.5; 3], 6);
    i[0][1] = f32::NAN;
    i[4][2] = f32::INFINITY;
    let mut bad_reference = r.clone();
    bad_reference[5] = [f32::NEG_INFINITY; 3];
    let c = compare(&i, &bad_reference, 3, 2, ONE).unwrap();
    assert_eq!((c.compared, c.non_finite_image, c.non_finite_reference), (3, 2, 1));
    assert_eq!(c.mse, 0.25);
    assert!(c.ciede2000.max.is_finite() && c.flip.max.is_finite());
    let c = compare(&flat([f32::NAN; 3], 6), &r, 3, 2, Exposure::Auto).unwrap();
    assert_eq!(c.compared, 0);
    assert!(c.mse.is_nan() && c.rel_mse.is_nan() && c.flip.mean.is_nan() && c.signed_bias.is_nan());
}

#[test]
fn sizes_must_fit() {
    let p = flat([0.0; 3], 6);
    assert!(compare(&p, &p[..5], 3, 2, ONE).is_err());
    assert!(compare(&p, &p, 2, 2, ONE).is_err());
    assert!(error_map(&p, &p, 7, 1, ONE, ErrorKind::Flip).is_err());
    assert!(z_test(&p, &p, &p, &p[1..], 0.01).is_err());
    assert!(compare(&[], &[], 0, 5, Exposure::Auto).unwrap().mse.is_nan());
}

#[test]
fn summaries_use_the_nearest_rank() {
    let s = Summary::of((1..=100).rev().map(f64::from).collect());
    assert_eq!(s, Summary { mean: 50.5, p95: 95.0, p99: 99.0, max: 100.0 });
    assert_eq!(Summary::of(vec![3.0]), Summary { mean: 3.0, p95: 3.0, p99: 3.0, max: 3.0 });
}

fn flip(a: [f32; 3], b: [f32; 3]) -> f64 {
    let map = flip_map(&flat(a, 24 * 24), &flat(b, 24 * 24), 24, 24, ONE, &FlipOptions::default()).unwrap();
    assert!(map.iter().all(|x| (x - map[0]).abs() < 1e-5));
    f64::from(map[0])
}

#[test]
fn flip_of_constant_pictures_by_hand() {
    let (black, white) = ([0.0; 3], [1.0; 3]);
    assert_eq!(flip(white, white), 0.0);
    // Without features the error is the compressed colour difference. The maximum is between green and blue,
    // whose Hunt-adjusted L*a*b* are (87.73, -75.61, 72.97) and (32.30, 25.58, -34.84): HyAB 203.29. Black to white
    // is 100: 100^0.7 = 25.119 of 41.27, beyond the bend at 0.4 * 41.27 = 16.51.
    assert!((flip(black, white) - (0.95 + 0.05 * (25.119 - 16.508) / (41.27 - 16.508))).abs() < 1e-4);
    assert!((flip([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 1e-6);
    // Below the bend: 0.95 / 16.508 times the distance to the power 0.7. Greys differ in lightness alone.
    let lightness = |y: f64| 116.0 * y.cbrt() - 16.0;
    let want = 0.95 / 16.508 * (lightness(0.5) - lightness(0.4)).powf(0.7);
    assert!((flip([0.4; 3], [0.5; 3]) - want).abs() < 1e-4);
}

/// Two pictures with edges, points and colour changes.
fn pattern(changed: bool) -> Vec<[f32; 3]> {
    let pixel = |i: usize| {
        let (xi, yi) = (i % 64, i / 64);
        let (x, y) = (xi as f64, yi as f64);
        let mut p = [0.5 + 0.5 * (x * 0.37 + y * 0.11).sin(), 0.5 + 0.5 * (x * 0.05 * y * 0.3).cos(), 0.0];
        p[2] = ((xi / 5 + yi / 7) % 2) as f64 * 0.8;
        if changed {
            p[0] *= 0.9;
            if (x - 30.0).powi(2) + (y - 20.0).powi(2) < 64.0 {
                p[1] *= 0.3;
            }
            if xi == 40 {
                p[2] = 1.0;
            }
        }
        p.map(|v| v as f32)
    };
    (0..64 * 48).map(pixel).collect()
}

#[test]
fn flip_agrees_with_its_authors_program() {
    // Values of the authors' flip_evaluator 1.7 on the same linear pictures, 67.02 pixels per degree.
    let (reference, test) = (pattern(false), pattern(true));
    let map = flip_map(&test, &reference, 64, 48, ONE, &FlipOptions::default()).unwrap();
    let mean = map.iter().map(|x| f64::from(*x)).sum::<f64>() / map.len() as f64;
    assert!((mean - 0.214_456).abs() < 2e-4, "{mean}");
    let at = [(0, 0, 0.17300), (30, 20, 0.65194), (40, 10, 0.20392), (63, 47, 0.15552), (5, 24, 0.05636)];
    for (x, y, want) in at {
        let got = map[y * 64 + x];
        assert!((got - want).abs() < 1e-3, "({x}, {y}): {got}, want {want}");
    }
    assert!((flip([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]) - 0.986_667).abs() < 1e-4);
    assert!((flip([0.5; 3], [0.6, 0.5, 0.5]) - 0.199_509).abs() < 1e-4);
}

#[test]
fn flip_is_symmetric_bounded_and_transposes() {
    let (a, b) = (pattern(false), pattern(true));
    let map =
        |a: &[[f32; 3]], b: &[[f32; 3]], w, h| flip_map(a, b, w, h, ONE, &FlipOptions::default()).unwrap();
    let forth = map(&a, &b, 64, 48);
    assert_eq!(forth, map(&b, &a, 64, 48));
    assert!(forth.iter().all(|x| (0.0..=1.0).contains(x)));
    let turn = |p: &[[f32; 3]]| (0..64 * 48).map(|i| p[(i % 48) * 64 + i / 48]).collect::<Vec<_>>();
    let turned = map(&turn(&a), &turn(&b), 48, 64);
    assert!((0..64 * 48).all(|i| (turned[i] - forth[(i % 48) * 64 + i / 48]).abs() < 1e-4));
}

#[test]
fn p_values_of_the_normal_distribution() {
    // Two-sided, from tables to ten digits; 1.959964 is the usual 5 % bound.
    let table = [(0.0, 1.0), (1.0, 0.317_310_507_9), (2.0, 0.045_500_263_9), (3.0, 0.002_699_796_063)];
    let more = [(1.959_963_985, 0.05), (5.0, 5.733_031_438e-7), (10.0, 1.523_970_605e-23)];
    for (z, p) in table.into_iter().chain(more) {
        assert!((normal_p_value(z) / p - 1.0).abs() < 1e-8, "{z}: {}", normal_p_value(z));
        assert_eq!(normal_p_value(z), normal_p_value(-z));
    }
    assert_eq!(normal_p_value(f64::INFINITY), 0.0);
    assert!(normal_p_value(f64::NAN).is_nan());
    // The two expansions meet.
    let z = 2.0 * std::f64::consts::SQRT_2;
    assert!((normal_p_value(z * (1.0 - 1e-15)) / normal_p_value(z * (1.0 + 1e-15)) - 1.0).abs() < 1e-11);
}

#[test]
fn z_tests_accept_noise_and_reject_a_shift() {
    let n = 4096;
    // Normal noise by the sum of twelve uniform numbers; variance 0.01 of each mean.
    let mut state = 1u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut noisy = |mean: f32| -> Vec<[f32; 3]> {
        let mut value = || mean + 0.1 * ((0..12).map(|_| uniform()).sum::<f32>() - 6.0);
        (0..n).map(|_| [value(), value(), value()]).collect()
    };
    let (a, b, shifted) = (noisy(1.0), noisy(1.0), noisy(2.0));
    let v = flat([0.01; 3], n);
    let same = z_test(&a, &v, &b, &v, 0.01).unwrap();
    assert!(same.passed() && same.accepted == 1.0 && same.tests == 3 * n as u64, "{same:?}");
    let other = z_test(&a, &v, &shifted, &v, 0.01).unwrap();
    assert!(!other.passed() && other.accepted < 0.999, "{other:?}");
    // 1 - 0.99^(1/12288)
    assert!((same.threshold / 8.179_14e-7 - 1.0).abs() < 1e-4, "{}", same.threshold);
}

#[test]
fn z_tests_without_variance_want_equality() {
    let (a, zero) = (flat([1.0, 2.0, 3.0], 2), flat([0.0; 3], 2));
    assert!(z_test(&a, &zero, &a, &zero, 0.01).unwrap().passed());
    let mut b = a.clone();
    b[1][2] = 3.0001;
    let t = z_test(&a, &zero, &b, &zero, 0.01).unwrap();
    assert!(!t.passed() && t.min_p == 0.0 && (t.accepted - 5.0 / 6.0).abs() < 1e-12);
    b[0] = [f32::NAN, f32::INFINITY, 0.0];
    assert_eq!(z_test(&a, &zero, &b, &zero, 0.01).unwrap().skipped, 2);
    assert!(!z_test(&[], &[], &[], &[], 0.01).unwrap().passed());
}

#[test]
fn false_colours_get_brighter_all_the_way() {
    let l: Vec<f64> = (0..=100).map(|i| luminance(false_color(i as f32 / 100.0))).collect();
    assert!(l.windows(2).all(|w| w[1] > w[0]), "{l:?}");
    assert!(l[0] < 1e-6 && l[100] > 0.85);
    assert_eq!(false_color(f32::NAN), false_color(-1.0));
    assert_eq!(false_color(7.0), false_color(1.0));
}

#[test]
fn error_maps_show_where() {
    let r = flat([0.5; 3], 9);
    let mut i = r.clone();
    i[4] = [0.9, 0.5, 0.5];
    i[8] = [f32::NAN; 3];
    for kind in [ErrorKind::Flip, ErrorKind::Ciede2000, ErrorKind::Relative] {
        let map = error_map(&i, &r, 3, 3, ONE, kind).unwrap();
        assert_eq!(map[8], [0.0, 1.0, 0.0], "{kind:?}");
        assert!(luminance(map[4]) > 0.01, "{kind:?}");
        assert!(kind == ErrorKind::Flip || map[0] == false_color(0.0));
    }
}

/// 3x3 pixels in blocks of 2: four, two, two and one of them.
#[test]
fn blocks_are_means_of_the_pixels_that_there_are() {
    let pixels: Vec<[f32; 3]> =
        (0..9).map(|i| [i as f32, 1.0, if i == 8 { f32::NAN } else { 0.5 }]).collect();
    let (blocks, size) = block_means(&pixels, 3, 3, 2);
    assert_eq!(size, [2, 2]);
    assert_eq!(blocks[..3], [[2.0, 1.0, 0.5], [3.5, 1.0, 0.5], [6.5, 1.0, 0.5]]);
    assert!(blocks[3][0] == 8.0 && blocks[3][2].is_nan());
    assert_eq!(block_means(&pixels[..6], 3, 2, 100), (vec![[2.5, 1.0, 0.5]], [1, 1]));
    assert_eq!(block_means(&pixels[..6], 3, 2, 1), (pixels[..6].to_vec(), [3, 2]));
}

/// Luminance 0.5 against 0.4: a relative difference of 0.1 / sqrt(0.16 + 0.01) = 0.2425.
#[test]
fn signed_differences_are_red_where_too_bright_and_blue_where_too_dark() {
    let reference = [[0.4; 3], [0.4; 3], [0.4; 3], [0.4; 3], [f32::NAN; 3]];
    let image = [[0.5; 3], [0.3; 3], [0.4; 3], [40.0; 3], [0.4; 3]];
    let one = Exposure::Scale(1.0);
    let map = signed_difference(&image, &reference, 5, 1, one, 0.5).expect("sizes fit");
    let rest = 1.0 - 0.1 / 0.17f32.sqrt() / 0.5;
    let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
    assert!(close(map[0], [1.0, rest, rest]), "{:?}", map[0]);
    assert!(close(map[1], [rest, rest, 1.0]), "{:?}", map[1]);
    assert!(close(map[2], [1.0; 3]), "{:?}", map[2]);
    assert_eq!(map[3], [1.0, 0.0, 0.0]);
    assert_eq!(map[4], [0.0, 1.0, 0.0]);
    assert!(signed_difference(&image, &reference, 2, 2, one, 0.5).is_err());
}
