//! L*a*b* and CIEDE2000 in f32, for decisions about millions of pixels.
//!
//! Straight-line code without calls of the maths library: loops over arrays are vectorised, and the result has the same bits on
//! every machine. For colours that displays show, [`ciede2000`] differs from [`super::ciede2000`] by less than 0.001 plus
//! 0.02 % (`tests/fast_color.rs`), but where the two hues are opposite to within a hundredth of a degree: there the mean
//! hue jumps. Metrics and studies use the exact functions.

/// Lightness, green to red, blue to yellow.
type Lab = [f32; 3];

/// The cube root of a positive normal number, to 4 ulp: a guess by dividing the exponent, two steps of Halley.
#[inline(always)]
#[must_use]
pub fn cbrt(x: f32) -> f32 {
    let halley = |y: f32| {
        let cube = y * y * y;
        y * ((cube + 2.0 * x) / (2.0 * cube + x))
    };
    // A third of the bits, plus two thirds of those of 1; the constant is tuned for the least error.
    halley(halley(f32::from_bits(x.to_bits() / 3 + 709_921_077)))
}

/// Linear Rec.709 in 0..=1 to L*a*b*, as [`super::rgb_to_lab`]; errors are below 2e-4.
#[inline(always)]
#[must_use]
pub fn rgb_to_lab([r, g, b]: [f32; 3]) -> Lab {
    // Rows of `rgb_to_xyz` over those of white.
    const X: [f32; 3] = [10_135_552.0 / 23_359_437.0, 8_788_810.0 / 23_359_437.0, 4_435_075.0 / 23_359_437.0];
    const Y: [f32; 3] = [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0];
    const Z: [f32; 3] = [1_425_312.0 / 80_288_307.0, 8_788_810.0 / 80_288_307.0, 70_074_185.0 / 80_288_307.0];
    const DELTA: f32 = 6.0 / 29.0;
    let f = |row: [f32; 3]| {
        let t = row[0] * r + row[1] * g + row[2] * b;
        let root = cbrt(t.max(DELTA * DELTA * DELTA));
        if t > DELTA * DELTA * DELTA { root } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let (x, y, z) = (f(X), f(Y), f(Z));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// sqrt(c^7 / (c^7 + 25^7))
#[inline(always)]
fn pow7_ratio(c: f32) -> f32 {
    let c7 = c * c * c * (c * c) * (c * c);
    (c7 / (c7 + 6_103_515_625.0)).sqrt()
}

/// exp(-x) for x from 0, to 1e-5: the sixteenth power of the Taylor series at x / 16.
#[inline(always)]
fn exp_minus(x: f32) -> f32 {
    let t = x.min(40.0) / 16.0;
    let e = 1.0 + t * (1.0 + t * (1.0 / 2.0 + t * (1.0 / 6.0 + t * (1.0 / 24.0 + t / 120.0))));
    let e2 = e * e;
    let e4 = e2 * e2;
    let e8 = e4 * e4;
    1.0 / (e8 * e8)
}

/// The CIEDE2000 difference, as [`super::ciede2000`], with the angles replaced by their cosines and sines: those of the mean
/// hue are the sum of the two unit vectors, those of its multiples follow by addition theorems.
#[inline(always)]
#[must_use]
pub fn ciede2000(lab1: Lab, lab2: Lab) -> f32 {
    const TINY: f32 = 1e-20;
    let length = |x: f32, y: f32| (x * x + y * y).sqrt();
    let mean_c = (length(lab1[1], lab1[2]) + length(lab2[1], lab2[2])) / 2.0;
    let stretch = 1.0 + 0.5 * (1.0 - pow7_ratio(mean_c));
    let (a1, b1, a2, b2) = (stretch * lab1[1], lab1[2], stretch * lab2[1], lab2[2]);
    let (c1, c2) = (length(a1, b1), length(a2, b2));
    let (d_l, d_c) = (lab2[0] - lab1[0], c2 - c1);
    // 2 sqrt(c1 c2) sin(dh / 2) from c1 c2 sin(dh) or from c1 c2 cos(dh), whichever does not cancel.
    let cross = a1 * (b2 - b1) - b1 * (a2 - a1);
    let dot = a1 * a2 + b1 * b2;
    let product = c1 * c2;
    let acute = std::f32::consts::SQRT_2 * cross / (product + dot).max(TINY).sqrt();
    let obtuse = (2.0 * (product - dot)).max(0.0).sqrt().copysign(cross);
    let d_h = if dot > 0.0 { acute } else { obtuse };
    // The mean hue; that of the other colour if one is grey, 0 if both are.
    let (i1, i2) = (1.0 / c1.max(TINY), 1.0 / c2.max(TINY));
    let (x, y) = (a1 * i1 + a2 * i2, b1 * i1 + b2 * i2);
    let norm = length(x, y);
    let inverse = 1.0 / norm.max(TINY);
    let (cos, sin) = (if norm > TINY { x * inverse } else { 1.0 }, y * inverse);
    let (cos2, sin2) = (cos * cos - sin * sin, 2.0 * sin * cos);
    let (cos3, sin3) = (cos2 * cos - sin2 * sin, sin2 * cos + cos2 * sin);
    let (cos4, sin4) = (cos2 * cos2 - sin2 * sin2, 2.0 * sin2 * cos2);
    // Cosine and sine of 30, 6 and 63 degrees.
    let t = 1.0 - 0.17 * (0.866_025_4 * cos + 0.5 * sin)
        + 0.24 * cos2
        + 0.32 * (0.994_521_9 * cos3 - 0.104_528_46 * sin3)
        - 0.20 * (0.453_990_5 * cos4 + 0.891_006_5 * sin4);
    // Square of the angle from 275 degrees by the series of arccos^2 at z = 1 - cos; beyond a right angle all is 0 anyway.
    let z = 1.0 - (0.087_155_74 * cos - 0.996_194_7 * sin);
    let angle2 = z * (2.0 + z * (1.0 / 3.0 + z * (4.0 / 45.0 + z * (1.0 / 35.0 + z * (16.0 / 1575.0)))));
    const WIDTH: f32 = 25.0 * std::f32::consts::PI / 180.0;
    let turn = std::f32::consts::FRAC_PI_3 * exp_minus(angle2 / (WIDTH * WIDTH));
    let turn2 = turn * turn;
    let sine = turn * (1.0 - turn2 / 6.0 * (1.0 - turn2 / 20.0 * (1.0 - turn2 / 42.0)));
    let (l, c) = ((lab1[0] + lab2[0]) / 2.0 - 50.0, (c1 + c2) / 2.0);
    let r_t = -2.0 * sine * pow7_ratio(c);
    let s_l = 1.0 + 0.015 * l * l / (20.0 + l * l).sqrt();
    let (l, h) = (d_l / s_l, d_h / (1.0 + 0.015 * c * t));
    let c = d_c / (1.0 + 0.045 * c);
    (l * l + c * c + h * h + r_t * c * h).max(0.0).sqrt()
}
