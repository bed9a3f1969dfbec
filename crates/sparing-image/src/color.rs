//! Colour: linear Rec.709, XYZ, Lab with white D65, the sRGB transfer function, CIEDE2000, exposure.

pub mod fast;

use rayon::prelude::*;

/// XYZ of linear Rec.709 white (1, 1, 1), D65 with Y = 1: the row sums of [`rgb_to_xyz`]'s matrix.
pub const WHITE: [f64; 3] = [
    (10_135_552.0 + 8_788_810.0 + 4_435_075.0) / 24_577_794.0,
    1.0,
    (1_425_312.0 + 8_788_810.0 + 70_074_185.0) / 73_733_382.0,
];

/// Luminance of linear Rec.709 (ITU-R BT.709-6, item 3.2).
#[inline]
#[must_use]
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Linear Rec.709 to XYZ with white Y = 1. The matrix is that of IEC 61966-2-1 before its rounding to four
/// digits, in the fractions that FLIP's authors use.
#[must_use]
pub fn rgb_to_xyz(rgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = rgb;
    [
        (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0,
        (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0,
        (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0,
    ]
}

/// The inverse of [`rgb_to_xyz`].
#[must_use]
pub fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    static INVERSE: std::sync::LazyLock<glam::DMat3> = std::sync::LazyLock::new(|| {
        let column = |i: usize| {
            let mut unit = [0.0; 3];
            unit[i] = 1.0;
            glam::DVec3::from_array(rgb_to_xyz(unit))
        };
        glam::DMat3::from_cols(column(0), column(1), column(2)).inverse()
    });
    (*INVERSE * glam::DVec3::from_array(xyz)).to_array()
}

/// XYZ to CIE L*a*b* for white [`WHITE`] (CIE 15:2004, section 8.2.1). Negative XYZ follow the linear branch.
#[must_use]
pub fn xyz_to_lab(xyz: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |i: usize| {
        let t = xyz[i] / WHITE[i];
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = [f(0), f(1), f(2)];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The inverse of [`xyz_to_lab`].
#[must_use]
pub fn lab_to_xyz(lab: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let y = (lab[0] + 16.0) / 116.0;
    let f = |t: f64| if t > DELTA { t * t * t } else { 3.0 * DELTA * DELTA * (t - 4.0 / 29.0) };
    [f(y + lab[1] / 500.0) * WHITE[0], f(y) * WHITE[1], f(y - lab[2] / 200.0) * WHITE[2]]
}

/// Linear Rec.709 to L*a*b*.
#[must_use]
pub fn rgb_to_lab(rgb: [f64; 3]) -> [f64; 3] {
    xyz_to_lab(rgb_to_xyz(rgb))
}

/// Linear 0..=1 to sRGB 0..=1 (IEC 61966-2-1).
#[inline]
#[must_use]
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB 0..=1 to linear 0..=1 (IEC 61966-2-1).
#[inline]
#[must_use]
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The CIEDE2000 difference of two L*a*b* colours, parametric factors 1 (Sharma, Wu and Dalal 2005, equations 2
/// to 22; its numbered steps are kept).
#[must_use]
pub fn ciede2000(lab1: [f64; 3], lab2: [f64; 3]) -> f64 {
    let pow7_ratio = |c: f64| (c.powi(7) / (c.powi(7) + 25f64.powi(7))).sqrt();
    // Step 1: chroma and hue of the stretched a axis.
    let mean_c = (lab1[1].hypot(lab1[2]) + lab2[1].hypot(lab2[2])) / 2.0;
    let g = 0.5 * (1.0 - pow7_ratio(mean_c));
    let chroma_hue = |lab: [f64; 3]| {
        let a = (1.0 + g) * lab[1];
        let c = a.hypot(lab[2]);
        let h = if c == 0.0 { 0.0 } else { lab[2].atan2(a).to_degrees().rem_euclid(360.0) };
        (c, h)
    };
    let ((c1, h1), (c2, h2)) = (chroma_hue(lab1), chroma_hue(lab2));
    // Step 2: differences.
    let grey = c1 * c2 == 0.0;
    let dh = match h2 - h1 {
        _ if grey => 0.0,
        d if d > 180.0 => d - 360.0,
        d if d < -180.0 => d + 360.0,
        d => d,
    };
    let (d_l, d_c) = (lab2[0] - lab1[0], c2 - c1);
    let d_h = 2.0 * (c1 * c2).sqrt() * (dh / 2.0).to_radians().sin();
    // Step 3: weights at the mean colour.
    let (l, c) = ((lab1[0] + lab2[0]) / 2.0, (c1 + c2) / 2.0);
    let h = match h1 + h2 {
        sum if grey => sum,
        sum if (h1 - h2).abs() <= 180.0 => sum / 2.0,
        sum if sum < 360.0 => (sum + 360.0) / 2.0,
        sum => (sum - 360.0) / 2.0,
    };
    let cosine = |degrees: f64| degrees.to_radians().cos();
    let t = 1.0 - 0.17 * cosine(h - 30.0) + 0.24 * cosine(2.0 * h) + 0.32 * cosine(3.0 * h + 6.0)
        - 0.20 * cosine(4.0 * h - 63.0);
    let rotation = 30.0 * (-((h - 275.0) / 25.0).powi(2)).exp();
    let r_t = -(2.0 * rotation).to_radians().sin() * 2.0 * pow7_ratio(c);
    let l50 = (l - 50.0).powi(2);
    let s_l = 1.0 + 0.015 * l50 / (20.0 + l50).sqrt();
    let (s_c, s_h) = (1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let (l, c, h) = (d_l / s_l, d_c / s_c, d_h / s_h);
    // The quadratic form is not negative in exact arithmetic.
    (l * l + c * c + h * h + r_t * c * h).max(0.0).sqrt()
}

/// Luminance that [`auto_exposure`] maps the bright end of a picture to.
pub const AUTO_EXPOSURE_LEVEL: f64 = 0.9;

/// The factor that brings the 95th percentile of the luminance of lit pixels to [`AUTO_EXPOSURE_LEVEL`].
///
/// Lit pixels are those brighter than a hundredth of the mean: so it does not matter how much of the frame is black. Pixels
/// that are not finite are left out. If all are black, the factor is 1.
#[must_use]
pub fn auto_exposure(pixels: &[[f32; 3]]) -> f32 {
    let mut values: Vec<f64> = pixels.par_iter().map(|p| luminance(*p)).filter(|l| l.is_finite()).collect();
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.retain(|v| *v > mean / 100.0);
    if values.is_empty() {
        return 1.0;
    }
    let rank = (values.len() * 95).div_ceil(100) - 1;
    let (_, level, _) = values.select_nth_unstable_by(rank, f64::total_cmp);
    let scale = (AUTO_EXPOSURE_LEVEL / *level) as f32;
    if scale.is_finite() && scale > 0.0 { scale } else { 1.0 }
}
