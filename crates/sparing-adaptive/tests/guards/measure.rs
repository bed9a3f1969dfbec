//! How much of a feature a picture has, and how far it is from the truth there.

use crate::scenes::{Around, Feature};
use sparing_adaptive::features::display_lab;
use sparing_image::color::{auto_exposure, ciede2000, luminance};

type Picture = Vec<[f32; 3]>;

/// What is known of the truth.
pub struct Reference {
    pub size: [u32; 2],
    pub picture: Picture,
    exposure: f64,
    median: f64,
}

/// One picture within a feature's region.
#[derive(Clone, Copy, Debug)]
pub struct Measures {
    /// Light of the feature over that of the reference: unbiased if the picture is.
    pub light: f64,
    /// Mean squared error over the squared reference plus 0.01, in exposed units.
    pub rel_mse: f64,
    /// Mean colour difference on a display.
    pub ciede2000: f64,
}

impl Reference {
    pub fn new(size: [u32; 2], picture: Picture) -> Self {
        let mut values: Vec<f64> = picture.iter().map(|p| luminance(*p)).collect();
        values.sort_by(f64::total_cmp);
        let exposure = f64::from(auto_exposure(&picture));
        Self { size, exposure, median: values[values.len() / 2], picture }
    }

    pub fn measure(&self, feature: &Feature, picture: &[[f32; 3]]) -> Measures {
        let around = if matches!(feature.around, Around::Black) { 0.0 } else { self.median };
        let pixels = feature.pixels(self.size);
        let mut m = Measures { light: 0.0, rel_mse: 0.0, ciede2000: 0.0 };
        let mut light = 0.0;
        for &i in &pixels {
            m.light += luminance(picture[i]) - around;
            light += luminance(self.picture[i]) - around;
            let [p, r] = [picture[i], self.picture[i]].map(|p| p.map(|c| f64::from(c) * self.exposure));
            let squares = p.iter().zip(r).map(|(p, r)| (p - r) * (p - r) / (r * r + 0.01));
            m.rel_mse += squares.sum::<f64>() / 3.0 / pixels.len() as f64;
            m.ciede2000 += ciede2000(display_lab(p), display_lab(r)) / pixels.len() as f64;
        }
        m.light /= light;
        m
    }
}
