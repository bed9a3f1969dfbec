//! Colours and figures of error.

use super::case::{Case, Effort, Random};
use sparing_image::color::{
    auto_exposure, ciede2000, fast, lab_to_xyz, rgb_to_lab, srgb_decode, srgb_encode, xyz_to_lab,
};
use sparing_image::metrics::{Exposure, compare};
use sparing_image::picture::{Picture, Pixels};
use sparing_image::png::write_png;

const AREA: &str = "Colour and figures of error";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "ciede2000-published",
        does: "CIEDE2000 against the 34 pairs of Sharma, Wu and Dalal (2005, table 1), both ways round.",
        unit: "largest error (published to 4 digits)",
        bound: 5e-5,
        measure: |_| published(),
    },
    Case {
        area: AREA,
        name: "ciede2000-continuity",
        does: "The jump of CIEDE2000 where the mean hue jumps by 180 degrees, between colours 1e-9 apart that are no opposites.",
        unit: "largest step",
        bound: 1e-6,
        measure: |e| Ok(continuity(e)),
    },
    Case {
        area: AREA,
        name: "ciede2000-fast",
        does: "The single-precision CIEDE2000 that decisions use against the exact one, differences of 0.01 to 100.",
        unit: "largest error over 0.02 + 1 % of the value",
        bound: 1.0,
        measure: |e| Ok(fast_against_exact(e)),
    },
    Case {
        area: AREA,
        name: "lab-extremes",
        does: "L*a*b* of colours negative, 0, denormal and up to 1e30, and back: values not finite.",
        unit: "values",
        bound: 0.0,
        measure: |_| Ok(extremes()),
    },
    Case {
        area: AREA,
        name: "lab-round-trip",
        does: "XYZ to L*a*b* and back, around the join of cube root and line too.",
        unit: "largest relative error",
        bound: 1e-11,
        measure: |e| Ok(round_trip(e)),
    },
    Case {
        area: AREA,
        name: "srgb",
        does: "sRGB encoding of 0, the joint and 1, and the round trip.",
        unit: "largest error",
        bound: 1e-6,
        measure: |_| Ok(srgb()),
    },
    Case {
        area: AREA,
        name: "flip-reference",
        does: "FLIP of gradients with noise, edges, blocks and points against flip-evaluator 1.7, the program of its authors: means and single pixels.",
        unit: "largest difference",
        bound: 1e-4,
        measure: |_| super::reference::flip(),
    },
    Case {
        area: AREA,
        name: "relmse-exact",
        does: "relMSE of the same pictures against exact fractions.",
        unit: "largest relative difference",
        bound: 1e-12,
        measure: |_| super::reference::rel_mse(),
    },
    Case {
        area: AREA,
        name: "tone-mapping",
        does: "8-bit pictures of 0, negative, NaN, infinite, least and largest values at exposures of -40 to 40 stops: bytes other than those of the curve.",
        unit: "bytes",
        bound: 0.0,
        measure: |_| tone_mapping(),
    },
    Case {
        area: AREA,
        name: "exposure-40-stops",
        does: "Figures of error of a picture and its reference scaled by 2^-40 to 2^40 with the exposure that takes it back.",
        unit: "largest relative change",
        bound: 1e-4,
        measure: |_| exposure(),
    },
    Case {
        area: AREA,
        name: "hostile-pictures",
        does: "Figures of error of pictures with NaN, infinities and 1e38: pixels that are not counted as such.",
        unit: "pixels",
        bound: 0.0,
        measure: |_| hostile(),
    },
];

const PAIRS: &str = include_str!("../../../crates/sparing-image/tests/data/ciede2000.txt");

fn published() -> anyhow::Result<f64> {
    let (mut worst, mut pairs): (f64, u32) = (0.0, 0);
    for line in PAIRS.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty()) {
        let v: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let (a, b) = ([v[0], v[1], v[2]], [v[3], v[4], v[5]]);
        worst = worst.max((ciede2000(a, b) - v[6]).abs()).max((ciede2000(b, a) - v[6]).abs());
        pairs += 1;
    }
    anyhow::ensure!(pairs == 34, "{pairs} pairs");
    Ok(worst)
}

fn continuity(effort: Effort) -> f64 {
    let mut random = Random::new(31);
    let mut worst: f64 = 0.0;
    for _ in 0..effort.of(20_000, 1_000_000) {
        // Hues that differ by less than 170 degrees: at opposite ones the formula itself jumps (Sharma et al. 2005, 3).
        let (hue, between) = (random.between(0.0, std::f64::consts::TAU), random.between(-2.9, 2.9));
        let colour = |h: f64, c: f64, l: f64| [l, c * h.cos(), c * h.sin()];
        let (c1, c2) = (random.between(1.0, 100.0), random.between(1.0, 100.0));
        let a = colour(hue, c1, 50.0);
        let b = colour(hue + between, c2, 60.0);
        let near = colour(hue + between + 1e-9 / c2, c2, 60.0);
        worst = worst.max((ciede2000(a, b) - ciede2000(a, near)).abs());
    }
    worst
}

fn fast_against_exact(effort: Effort) -> f64 {
    let mut random = Random::new(32);
    let mut worst: f64 = 0.0;
    for _ in 0..effort.of(20_000, 2_000_000) {
        let a: [f64; 3] = std::array::from_fn(|_| random.uniform());
        let reach = 10_f64.powf(random.between(-4.0, 0.0));
        let b = a.map(|v| (v + reach * random.between(-1.0, 1.0)).clamp(0.0, 1.0));
        let exact = ciede2000(rgb_to_lab(a), rgb_to_lab(b));
        let single = |c: [f64; 3]| fast::rgb_to_lab(c.map(|v| v as f32));
        let found = f64::from(fast::ciede2000(single(a), single(b)));
        worst = worst.max((found - exact).abs() / (0.02 + 0.01 * exact));
    }
    worst
}

fn extremes() -> f64 {
    let values = [-1e30, -1.0, -1e-320, 0.0, 5e-324, 1e-10, 0.008_856, 0.5, 1.0, 1e10, 1e30];
    let mut wrong = 0;
    for x in values {
        for y in values {
            for z in values {
                let lab = xyz_to_lab([x, y, z]);
                let back = lab_to_xyz(lab);
                let difference = ciede2000(lab, [50.0, 0.0, 0.0]);
                wrong += lab.iter().chain(&back).chain([&difference]).filter(|v| !v.is_finite()).count();
            }
        }
    }
    wrong as f64
}

fn round_trip(effort: Effort) -> f64 {
    let mut random = Random::new(33);
    let mut worst: f64 = 0.0;
    for k in 0..effort.of(20_000, 1_000_000) {
        let joint = (6.0_f64 / 29.0).powi(3);
        let value = |r: &mut Random| match k % 2 {
            0 => 10_f64.powf(r.between(-6.0, 3.0)),
            _ => joint * (1.0 + 1e-9 * r.between(-1.0, 1.0)),
        };
        let xyz: [f64; 3] = std::array::from_fn(|_| value(&mut random));
        let back = lab_to_xyz(xyz_to_lab(xyz));
        for (a, b) in xyz.iter().zip(back) {
            // The line takes differences of L*: relative to the joint below it.
            worst = worst.max((a - b).abs() / a.max(joint));
        }
    }
    worst
}

fn srgb() -> f64 {
    let mut worst: f64 = 0.0;
    for k in 0..=100_000 {
        let x = f64::from(k) / 1e5;
        worst = worst.max((srgb_decode(srgb_encode(x)) - x).abs());
    }
    // Both pieces meet.
    worst = worst.max((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_801)).abs() - 2e-8);
    worst = worst.max(srgb_encode(0.0).abs()).max((srgb_encode(1.0) - 1.0).abs());
    worst
}

fn pictures() -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let mut random = Random::new(34);
    let reference: Vec<[f32; 3]> = (0..32 * 32).map(|_| [0; 3].map(|_| random.uniform() as f32)).collect();
    let image =
        reference.iter().map(|p| p.map(|v| v * (1.0 + 0.1 * random.between(-1.0, 1.0) as f32))).collect();
    (image, reference)
}

fn exposure() -> anyhow::Result<f64> {
    let (image, reference) = pictures();
    let figures = |scale: i32| -> anyhow::Result<[f64; 5]> {
        let factor = 2_f32.powi(scale);
        let scaled = |p: &[[f32; 3]]| p.iter().map(|c| c.map(|v| v * factor)).collect::<Vec<_>>();
        let exposure = Exposure::Scale(2_f32.powi(-scale));
        let c = compare(&scaled(&image), &scaled(&reference), 32, 32, exposure)?;
        Ok([c.mse, c.rel_mse, c.ciede2000.mean, c.ciede2000.p99, c.flip.mean])
    };
    let truth = figures(0)?;
    let mut worst: f64 = 0.0;
    for scale in [-40, -20, -1, 1, 20, 40] {
        for (a, b) in figures(scale)?.iter().zip(truth) {
            worst = worst.max((a / b - 1.0).abs());
        }
    }
    Ok(worst)
}

fn tone_mapping() -> anyhow::Result<f64> {
    let folder = std::env::temp_dir().join(format!("sparing-tone-mapping-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("a.png");
    let wrong = tone_mapped(&file);
    std::fs::remove_dir_all(&folder)?;
    wrong
}

fn tone_mapped(file: &std::path::Path) -> anyhow::Result<f64> {
    let values = [0.0, -0.0, 1e-45, 1e-38, 1e-12, 1e-6, 0.002, 0.18, 0.5, 1.0, 3.0, 1e6, 1e12, f32::MAX];
    let bad = [f32::NAN, f32::NEG_INFINITY, f32::INFINITY, -1e-45, -1.0, f32::MIN];
    let pixels: Vec<[f32; 3]> = values.iter().chain(&bad).map(|v| [*v; 3]).collect();
    let mut wrong = 0;
    for stops in -40_i32..=40 {
        write_png(file, pixels.len() as u32, 1, &pixels, stops as f32)?;
        let Pixels::Rgba8 { data, .. } = Picture::read(file)?.pixels else {
            anyhow::bail!("a picture of bytes was written")
        };
        for ([value, ..], [byte, g, b, _]) in pixels.iter().zip(data) {
            // A product of a power of two is exact in f64, and NaN and negative values are black.
            let shown = (f64::from(*value) * 2_f64.powi(stops)).clamp(0.0, 1.0);
            let want = if value.is_nan() { 0.0 } else { (255.0 * srgb_encode(shown)).round() };
            wrong += u32::from(f64::from(byte) != want || g != byte || b != byte);
        }
    }
    Ok(f64::from(wrong))
}

fn hostile() -> anyhow::Result<f64> {
    let (mut image, mut reference) = pictures();
    for (k, v) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].into_iter().enumerate() {
        image[3 * k] = [v; 3];
        reference[100 + k][1] = v;
    }
    image[500] = [1e38; 3];
    let c = compare(&image, &reference, 32, 32, Exposure::Scale(1.0))?;
    let figures = [c.mse, c.rel_mse, c.ciede2000.max, c.flip.max, c.signed_bias];
    let wrong = figures.iter().filter(|v| !v.is_finite()).count() as u64;
    let exposure = auto_exposure(&image);
    let wrong = wrong + u64::from(!(exposure.is_finite() && exposure > 0.0));
    Ok((wrong + c.non_finite_image.abs_diff(3) + c.non_finite_reference.abs_diff(3)) as f64)
}
