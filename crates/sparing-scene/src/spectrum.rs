//! Spectra as linear Rec.709 colours, for formats that speak in wavelengths.
//!
//! Colour matching functions are the analytic fits of Wyman, Sloan and Shirley, "Simple Analytic Approximations
//! to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013 (multi-lobe, 2° observer). Surface spectra are seen
//! under CIE D65 and divided by what a constant spectrum gives, so that a flat spectrum is exactly grey.

use glam::{DMat3, DVec3, Vec3};

/// Wavelengths of integration in nm: from, to, step.
const FROM: f64 = 380.0;
const STEP: f64 = 5.0;
const SAMPLES: usize = 81;

/// XYZ (D65 white) to linear Rec.709, IEC 61966-2-1, as columns.
const XYZ_TO_RGB: DMat3 = DMat3::from_cols_array(&[
    3.2404542, -0.969266, 0.0556434, -1.5371385, 1.8760108, -0.2040259, -0.4985314, 0.041556, 1.0572252,
]);

/// CIE standard illuminant D65, 380 to 780 nm in steps of 10 (CIE 15:2004, table T.1).
const D65: [f64; 41] = [
    49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923,
    108.811, 109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062,
    89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604,
    69.8856, 75.087, 63.5927, 46.4182, 66.8054, 63.3828,
];

/// Asymmetric Gaussian lobe: height, centre, inverse widths below and above it.
fn lobe(nm: f64, height: f64, centre: f64, below: f64, above: f64) -> f64 {
    let t = (nm - centre) * if nm < centre { below } else { above };
    height * (-0.5 * t * t).exp()
}

/// The matching functions at a wavelength in nm.
fn matching(nm: f64) -> DVec3 {
    DVec3::new(
        lobe(nm, 0.362, 442.0, 0.0624, 0.0374)
            + lobe(nm, 1.056, 599.8, 0.0264, 0.0323)
            + lobe(nm, -0.065, 501.1, 0.0490, 0.0382),
        lobe(nm, 0.821, 568.8, 0.0213, 0.0247) + lobe(nm, 0.286, 530.9, 0.0613, 0.0322),
        lobe(nm, 1.217, 437.0, 0.0845, 0.0278) + lobe(nm, 0.681, 459.0, 0.0385, 0.0725),
    )
}

fn wavelengths() -> impl Iterator<Item = f64> {
    (0..SAMPLES).map(|i| FROM + STEP * i as f64)
}

fn d65(nm: f64) -> f64 {
    let t = ((nm - FROM) / 10.0).clamp(0.0, 40.0);
    let i = (t as usize).min(39);
    D65[i] + (D65[i + 1] - D65[i]) * (t - i as f64)
}

fn xyz(spectrum: impl Fn(f64) -> f64) -> DVec3 {
    wavelengths().map(|nm| matching(nm) * spectrum(nm)).sum()
}

/// Linear interpolation in a table sorted by wavelength, constant outside.
fn lookup(table: &[[f64; 2]], nm: f64) -> f64 {
    let after = table.partition_point(|[w, _]| *w < nm);
    match (after.checked_sub(1).map(|i| table[i]), table.get(after)) {
        (None, Some([_, value])) => *value,
        (Some([_, value]), None) => value,
        (Some([w0, v0]), Some([w1, v1])) => v0 + (v1 - v0) * (nm - w0) / (w1 - w0),
        (None, None) => 0.0,
    }
}

/// Colour of a surface quantity (reflectance, index of refraction) tabulated as [nm, value], sorted.
pub(crate) fn surface_rgb(table: &[[f64; 2]]) -> Vec3 {
    let seen = XYZ_TO_RGB * xyz(|nm| lookup(table, nm) * d65(nm));
    let white = XYZ_TO_RGB * xyz(d65);
    (seen / white).max(DVec3::ZERO).as_vec3()
}

/// Colour of a light's spectrum tabulated as [nm, value], with luminance 1.
pub(crate) fn light_rgb(table: &[[f64; 2]]) -> Option<Vec3> {
    unit_luminance(xyz(|nm| lookup(table, nm)))
}

/// Colour of a black body with luminance 1; negative parts (below about 1900 K blue leaves Rec.709) become 0.
pub(crate) fn blackbody_rgb(kelvin: f64) -> Option<Vec3> {
    // Planck's law up to a factor; c2 = hc/k = 1.438777e7 nm K.
    let planck = |nm: f64| (nm / 560.0).powi(-5) / (1.438_777e7 / (nm * kelvin)).exp_m1();
    let peak = wavelengths().map(planck).fold(0.0, f64::max);
    unit_luminance(xyz(|nm| planck(nm) / peak))
}

/// Colour of a spectrum tabulated as [nm, value] as it stands: a flat spectrum of 1 has luminance 1.
pub(crate) fn plain_rgb(table: &[[f64; 2]]) -> Vec3 {
    absolute(|nm| lookup(table, nm))
}

/// Colour of a black body whose spectrum is 1 at its peak.
pub(crate) fn blackbody_by_peak(kelvin: f64) -> Vec3 {
    // Wien's displacement law: b = 2.897771955e6 nm K.
    let planck = |nm: f64| (nm / 560.0).powi(-5) / (1.438_777e7 / (nm * kelvin)).exp_m1();
    let peak = planck(2.897_771_955e6 / kelvin);
    absolute(|nm| planck(nm) / peak)
}

fn absolute(spectrum: impl Fn(f64) -> f64) -> Vec3 {
    let flat: f64 = wavelengths().map(|nm| matching(nm).y).sum();
    (XYZ_TO_RGB * (xyz(spectrum) / flat)).max(DVec3::ZERO).as_vec3()
}

/// Linear Rec.709 of an XYZ colour.
pub(crate) fn xyz_rgb(color: Vec3) -> Vec3 {
    (XYZ_TO_RGB * color.as_dvec3()).as_vec3()
}

fn unit_luminance(color: DVec3) -> Option<Vec3> {
    let rgb = (XYZ_TO_RGB * (color / color.y)).max(DVec3::ZERO).as_vec3();
    (color.y > 0.0 && rgb.is_finite()).then_some(rgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_spectra_are_grey() {
        let flat = surface_rgb(&[[400.0, 0.5], [700.0, 0.5]]);
        assert!(flat.abs_diff_eq(Vec3::splat(0.5), 1e-6), "{flat}");
    }

    #[test]
    fn illuminant_a_has_its_chromaticity() {
        // CIE illuminant A (2856 K): x 0.4476, y 0.4074, hence X 1.0987, Z 0.3559 at Y = 1.
        let rgb = blackbody_rgb(2856.0).unwrap();
        let expected = Vec3::new(1.846, 0.8262, 0.2334);
        assert!(rgb.abs_diff_eq(expected, 0.03), "{rgb}");
        let luminance = rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!((luminance - 1.0).abs() < 1e-3, "{luminance}");
    }

    #[test]
    fn daylight_is_nearly_white_and_extremes_stay_finite() {
        let day = blackbody_rgb(6504.0).unwrap();
        assert!(day.abs_diff_eq(Vec3::ONE, 0.08), "{day}");
        for kelvin in [500.0, 1e5, 1e9] {
            assert!(blackbody_rgb(kelvin).is_none_or(Vec3::is_finite));
        }
    }

    #[test]
    fn d65_itself_is_white() {
        let table: Vec<_> = (0..41).map(|i| [380.0 + 10.0 * f64::from(i), D65[i as usize]]).collect();
        assert!(light_rgb(&table).unwrap().abs_diff_eq(Vec3::ONE, 0.02));
    }

    #[test]
    fn spectra_as_they_stand() {
        let y = |v: Vec3| v.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!((y(plain_rgb(&[[400.0, 2.0], [700.0, 2.0]])) - 2.0).abs() < 0.02);
        // 5200 K peaks at 557 nm, where the eye is most sensitive: luminance close to 1; 2700 K peaks beyond red.
        assert!((y(blackbody_by_peak(5200.0)) - 0.99).abs() < 0.02);
        assert!(y(blackbody_by_peak(2700.0)) < 0.3);
    }
}
