//! Errors of a render against its reference.

use sparing_adaptive::features::display_lab;
use sparing_image::color::{auto_exposure, ciede2000, luminance};
use sparing_image::film::Film;
use sparing_image::metrics::REL_MSE_EPSILON;

/// What [`Errors::figures`] are.
pub const FIGURES: &str = "relMSE, p99 dE, p95 dE, mean dE";

/// Renders against their reference: the mean of some seeds.
#[derive(Clone, Copy, Default)]
pub struct Errors {
    pub spp: f64,
    pub figures: [f64; 4],
    /// Signed relative error of the darkest lit quarter.
    pub dark_bias: f64,
}

impl Errors {
    pub fn add(&mut self, other: &Self) {
        self.spp += other.spp;
        self.dark_bias += other.dark_bias;
        self.figures.iter_mut().zip(other.figures).for_each(|(a, b)| *a += b);
    }

    pub fn divide(&mut self, count: u64) {
        let count = count.max(1) as f64;
        self.spp /= count;
        self.dark_bias /= count;
        self.figures.iter_mut().for_each(|f| *f /= count);
    }
}

/// A reference, in exposed units.
pub struct Truth {
    exposure: f64,
    colours: Vec<[f64; 3]>,
    labs: Vec<[f64; 3]>,
    dark: Vec<usize>,
}

impl Truth {
    pub fn new(film: &Film) -> Self {
        let exposure = f64::from(auto_exposure(&film.beauty()));
        let colours = film.map(|t, i| (t.pixels[i].mean() * exposure).to_array());
        let y = |i: usize| luminance(colours[i].map(|v| v as f32));
        let mut dark: Vec<usize> = (0..colours.len()).filter(|&i| y(i) > 1e-4).collect();
        dark.sort_by(|&a, &b| y(a).total_cmp(&y(b)));
        dark.truncate(dark.len() / 4);
        let labs = colours.iter().map(|c| display_lab(*c)).collect();
        Self { exposure, colours, labs, dark }
    }

    pub fn errors(&self, film: &Film) -> Errors {
        let exposed = |p: &[f32; 3]| p.map(|v| f64::from(v) * self.exposure);
        let colours: Vec<[f64; 3]> = film.beauty().iter().map(exposed).collect();
        let pixels = colours.len() as f64;
        let square = |(c, t): (&[f64; 3], &[f64; 3])| {
            (0..3).map(|k| (c[k] - t[k]).powi(2) / (t[k].powi(2) + REL_MSE_EPSILON)).sum::<f64>() / 3.0
        };
        let rel_mse = colours.iter().zip(&self.colours).map(square).sum::<f64>() / pixels;
        let mut perceived: Vec<f64> =
            colours.iter().zip(&self.labs).map(|(c, lab)| ciede2000(display_lab(*c), *lab)).collect();
        perceived.sort_by(f64::total_cmp);
        let rank = |share: f64| perceived[((pixels * share) as usize).min(perceived.len() - 1)];
        let sum = |of: &[[f64; 3]]| {
            self.dark.iter().map(|&i| luminance(of[i].map(|v| v as f32))).sum::<f64>().max(1e-12)
        };
        Errors {
            spp: film.samples() as f64 / pixels,
            figures: [rel_mse, rank(0.99), rank(0.95), perceived.iter().sum::<f64>() / pixels],
            dark_bias: sum(&colours) / sum(&self.colours) - 1.0,
        }
    }
}

/// The average of samples at which a curve reaches a target, interpolated log-log.
pub fn reached(curve: &[Errors], figure: usize, target: f64) -> Option<f64> {
    let log = |e: f64| e.max(1e-12).ln();
    if curve.first()?.figures[figure] <= target {
        return Some(curve[0].spp);
    }
    curve.windows(2).find_map(|pair| {
        let (a, b) = (log(pair[0].figures[figure]), log(pair[1].figures[figure]));
        let t = (log(target) - a) / (b - a);
        (0.0..=1.0).contains(&t).then(|| (pair[0].spp.ln() + t * (pair[1].spp / pair[0].spp).ln()).exp())
    })
}
