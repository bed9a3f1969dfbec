//! Colour spaces, differences and exposure against published and hand-computed values.

use sparing_image::color::*;

fn near(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn ciede2000_of_the_published_pairs() {
    let mut pairs = 0;
    for line in include_str!("data/ciede2000.txt").lines().filter(|l| !l.starts_with('#')) {
        let v: Vec<f64> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
        let (a, b) = ([v[0], v[1], v[2]], [v[3], v[4], v[5]]);
        // The table has four decimals; differences must not depend on the order.
        assert!((ciede2000(a, b) - v[6]).abs() < 5.1e-5, "{line}: {}", ciede2000(a, b));
        assert!((ciede2000(b, a) - v[6]).abs() < 5.1e-5, "{line}: {}", ciede2000(b, a));
        assert_eq!(ciede2000(a, a), 0.0);
        pairs += 1;
    }
    assert_eq!(pairs, 34);
}

#[test]
fn lab_of_the_primaries() {
    assert!(near(rgb_to_lab([1.0; 3]), [100.0, 0.0, 0.0], 1e-9));
    assert!(near(rgb_to_lab([0.0; 3]), [0.0; 3], 1e-9));
    // CIE 1976 values of the sRGB primaries, as colour calculators print them.
    assert!(near(rgb_to_lab([1.0, 0.0, 0.0]), [53.24, 80.09, 67.20], 0.02));
    assert!(near(rgb_to_lab([0.0, 1.0, 0.0]), [87.73, -86.18, 83.18], 0.02));
    assert!(near(rgb_to_lab([0.0, 0.0, 1.0]), [32.30, 79.19, -107.86], 0.02));
}

#[test]
fn conversions_invert() {
    for rgb in [[0.2, 0.5, 0.9], [1.0, 0.0, 0.0], [0.001, 0.002, 0.0], [4.0, -0.5, 2.0]] {
        assert!(near(xyz_to_rgb(rgb_to_xyz(rgb)), rgb, 1e-12));
        assert!(near(lab_to_xyz(xyz_to_lab(rgb_to_xyz(rgb))), rgb_to_xyz(rgb), 1e-12));
    }
    for i in 0..=1000 {
        let x = f64::from(i) / 1000.0;
        assert!((srgb_decode(srgb_encode(x)) - x).abs() < 1e-6);
    }
}

#[test]
fn srgb_of_known_values() {
    // IEC 61966-2-1: 18 % grey is 117.6 of 255, half is 187.5, and byte 1 is linear 1 / 255 / 12.92.
    assert!((srgb_encode(0.18) * 255.0 - 117.64).abs() < 0.01);
    assert!((srgb_encode(0.5) * 255.0 - 187.52).abs() < 0.01);
    assert!((srgb_decode(1.0 / 255.0) - 1.0 / 255.0 / 12.92).abs() < 1e-15);
    assert!(srgb_encode(0.0) == 0.0 && (srgb_encode(1.0) - 1.0).abs() < 1e-15);
}

#[test]
fn luminance_is_the_middle_row() {
    for rgb in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.3, 0.6, 0.1f32]] {
        assert!((luminance(rgb) - rgb_to_xyz(rgb.map(f64::from))[1]).abs() < 1e-4);
    }
}

#[test]
fn auto_exposure_puts_the_percentile_at_its_level() {
    // Grey levels 1 to 100: the 95th is 95.
    let mut pixels: Vec<[f32; 3]> = (1..=100).map(|i| [i as f32; 3]).collect();
    assert!((auto_exposure(&pixels) - 0.9 / 95.0).abs() < 1e-7);
    pixels.extend([[f32::NAN; 3], [f32::INFINITY; 3]]);
    assert!((auto_exposure(&pixels) - 0.9 / 95.0).abs() < 1e-7);
    // A lone light in the dark is shown; nothing at all is left alone.
    let mut dark = vec![[0.0; 3]; 99];
    assert_eq!(auto_exposure(&dark), 1.0);
    dark.push([5.0; 3]);
    assert!((auto_exposure(&dark) - 0.18).abs() < 1e-6);
    assert_eq!(auto_exposure(&[]), 1.0);
    assert_eq!(auto_exposure(&[[1e-45; 3]]), 1.0);
}

#[test]
fn auto_exposure_does_not_depend_on_how_much_is_black() {
    // Levels 1 to 100 amid more and more pixels that are black, or nearly so.
    for black in [0, 10, 1000, 1900, 2100, 100_000] {
        for dark in [0.0, 1e-6] {
            let mut pixels: Vec<[f32; 3]> = (1..=100).map(|i| [i as f32; 3]).collect();
            pixels.extend(vec![[dark; 3]; black]);
            assert!((auto_exposure(&pixels) - 0.9 / 95.0).abs() < 1e-7, "{black} pixels of {dark}");
        }
    }
}
