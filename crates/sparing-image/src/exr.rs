//! OpenEXR pictures: the layers that Sparing writes, and any that it can read.
//!
//! One part, scan lines, ZIP, 32-bit float unless said otherwise. The data window is the crop, the display window
//! the full picture. Layers of [`film_layers`]:
//!
//! | channels | unit | meaning |
//! | --- | --- | --- |
//! | `R G B` | radiance, linear Rec.709 | mean of the samples |
//! | `A` | 1 | the picture has no transparency |
//! | `SampleCount.Y` | samples (unsigned integer) | samples taken, invalid ones included as black |
//! | `Variance.R G B` | radiance squared | variance of the pixel mean, [`Pixel::variance_of_mean`](crate::film::Pixel::variance_of_mean) |
//! | `Albedo.R G B` | 1 | mean reflectance at the first hit; a miss counts as 0 |
//! | `N.X Y Z` | 1 | mean shading normal at the first hit in world space, not normalised; a miss counts as 0 |
//! | `Z` | scene units | mean depth along the camera's axis over the rays that hit; `+inf` where none did |
//! | `Shapes.Y` | shapes (unsigned integer) | distinct shapes that the camera rays met; the background is one |
//!
//! The last four are there if the film kept them ([`FilmOptions`](crate::film::FilmOptions)). `+inf` for "no hit"
//! keeps depth compositing by minimum right and cannot be taken for a distance.

use std::path::Path;

use openexr_core::{Channel, Compression, ImageRef, Limits, Samples, SamplesRef, Window};

pub use openexr_core::Attribute as ExrAttribute;

use crate::atomic::{OutputError, write_atomic};
use crate::film::{AuxiliarySums, Film};
use crate::picture::PictureError;

/// How a channel is stored in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrType {
    /// 32-bit floating point.
    #[default]
    Float,
    /// 16-bit floating point: values are rounded to nearest, beyond 65504 to infinity.
    Half,
    /// 32-bit unsigned: values are rounded, negative ones and NaN become 0.
    Uint,
}

/// One channel in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct ExrChannel {
    /// Full name with its layer, for example `Variance.R`.
    pub name: String,
    /// One value a pixel, in rows from the top.
    pub data: Vec<f32>,
    /// How it is (to be) stored.
    pub kind: ExrType,
}

/// A single-part picture with any channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrImage {
    /// Columns stored.
    pub width: u32,
    /// Rows stored.
    pub height: u32,
    /// Column and row of the first stored pixel in the full picture.
    pub data_origin: [i32; 2],
    /// Columns and rows of the full picture, which begins at (0, 0).
    pub display_size: [u32; 2],
    /// Channels, sorted by name when read.
    pub channels: Vec<ExrChannel>,
    /// Header attributes besides those that describe the file's layout.
    pub attributes: Vec<(String, ExrAttribute)>,
}

impl ExrImage {
    /// No channels and no attributes yet; not a crop.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, display_size: [width, height], ..Self::default() }
    }

    /// Adds a 32-bit float channel.
    pub fn push(&mut self, name: &str, data: Vec<f32>) {
        self.channels.push(ExrChannel { name: name.to_owned(), data, kind: ExrType::Float });
    }

    /// Adds a channel of unsigned integers.
    pub fn push_uint(&mut self, name: &str, data: Vec<f32>) {
        self.channels.push(ExrChannel { name: name.to_owned(), data, kind: ExrType::Uint });
    }

    /// Adds the three channels `layer.R`, ... or bare ones if `layer` is empty; `components` names them.
    pub fn push_vector(&mut self, layer: &str, components: [&str; 3], data: &[[f32; 3]]) {
        for (i, component) in components.into_iter().enumerate() {
            self.push(&full_name(layer, component), data.iter().map(|p| p[i]).collect());
        }
    }

    /// The channel of this exact name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&ExrChannel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// The attribute of this exact name.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&ExrAttribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, a)| a)
    }

    /// R, G and B of a layer (bare channels if `layer` is empty), or its Y three times; `None` if it has neither.
    #[must_use]
    pub fn rgb(&self, layer: &str) -> Option<Vec<[f32; 3]>> {
        let named = |component| self.channel(&full_name(layer, component)).map(|c| &c.data);
        let [r, g, b] = match (named("R"), named("G"), named("B"), named("Y")) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (.., Some(y)) => [y, y, y],
            _ => return None,
        };
        Some(r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect())
    }

    /// Names of the layers that [`ExrImage::rgb`] can give, the bare one first, as an empty name.
    #[must_use]
    pub fn rgb_layers(&self) -> Vec<&str> {
        let mut layers: Vec<&str> =
            self.channels.iter().map(|c| c.name.rsplit_once('.').map_or("", |(layer, _)| layer)).collect();
        layers.sort_unstable();
        layers.dedup();
        let has = |layer: &str, component| self.channel(&full_name(layer, component)).is_some();
        layers.retain(|layer| has(layer, "Y") || ["R", "G", "B"].iter().all(|c| has(layer, c)));
        layers
    }
}

fn full_name(layer: &str, component: &str) -> String {
    if layer.is_empty() { component.to_owned() } else { format!("{layer}.{component}") }
}

/// Writes a picture. The file appears under its name only when it is complete.
///
/// # Errors
/// The disk or folder refuses; channels of a wrong length, double or empty names.
pub fn write_exr(path: &Path, image: &ExrImage) -> Result<(), OutputError> {
    // Float channels are borrowed; the others are converted first.
    let converted: Vec<Option<Samples>> = image
        .channels
        .iter()
        .map(|c| match c.kind {
            ExrType::Float => None,
            ExrType::Half => {
                Some(Samples::Half(c.data.iter().map(|x| openexr_core::half::from_f32(*x)).collect()))
            }
            // The cast saturates and takes NaN to 0.
            ExrType::Uint => Some(Samples::U32(c.data.iter().map(|x| x.round() as u32).collect())),
        })
        .collect();
    let channels = image.channels.iter().zip(&converted).map(|(c, converted)| {
        (c.name.as_str(), converted.as_ref().map_or(SamplesRef::F32(&c.data), SamplesRef::from))
    });
    let view = ImageRef {
        display: Window { origin: [0, 0], size: image.display_size },
        data: Window { origin: image.data_origin, size: [image.width, image.height] },
        channels: channels.collect(),
        attributes: &image.attributes,
        compression: Compression::Zip,
    };
    write_image(path, view)
}

/// Writes an image in the library's own terms, for exact integers and other uses that [`ExrImage`] does not cover.
///
/// # Errors
/// As [`write_exr`].
pub fn write_image<'a>(path: &Path, image: impl Into<ImageRef<'a>>) -> Result<(), OutputError> {
    write_atomic(path, |file| {
        openexr_core::write(&mut *file, image).map_err(|error| match error {
            openexr_core::Error::Io(source) => OutputError::io(path)(source),
            other => OutputError::encode(path, other.to_string()),
        })
    })
}

/// Reads a file: single part, flat, lossless compression.
///
/// # Errors
/// Unreadable, of another kind, damaged, or larger than [`Limits`] of
/// [`MAX_SIDE`](crate::picture::MAX_SIDE) a side.
pub fn read_exr(path: &Path) -> Result<ExrImage, PictureError> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|source| PictureError::Io { name: name.clone(), source })?;
    decode_exr(&bytes, &name)
}

/// Decodes a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read_exr`].
pub fn decode_exr(bytes: &[u8], name: &str) -> Result<ExrImage, PictureError> {
    let limits = Limits { max_side: crate::picture::MAX_SIDE, ..Limits::default() };
    let image = openexr_core::read(bytes, &limits)
        .map_err(|e| PictureError::Decode { name: name.to_owned(), reason: e.to_string() })?;
    // Windows may begin anywhere; ours begin at the display window's corner.
    let origin = [0, 1].map(|i| image.data.origin[i].saturating_sub(image.display.origin[i]));
    Ok(ExrImage {
        width: image.data.size[0],
        height: image.data.size[1],
        data_origin: origin,
        display_size: image.display.size,
        channels: image.channels.into_iter().map(from_channel).collect(),
        attributes: image.attributes,
    })
}

fn from_channel(channel: Channel) -> ExrChannel {
    let kind = match channel.samples {
        Samples::F32(_) => ExrType::Float,
        Samples::Half(_) => ExrType::Half,
        Samples::U32(_) => ExrType::Uint,
    };
    ExrChannel { name: channel.name, data: channel.samples.into_f32(), kind }
}

/// The layers of a film (see the module's table), with `attributes` and a few of its own: `chromaticities`
/// (Rec.709 and D65), `sparing.samples`, `sparing.invalidSamples` and `sparing.layers`, a text that defines the
/// layers. An attribute given here replaces one of the same name.
#[must_use]
pub fn film_layers(film: &Film, attributes: Vec<(String, ExrAttribute)>) -> ExrImage {
    let [x0, y0, ..] = film.crop;
    let mut image = ExrImage {
        width: film.width(),
        height: film.height(),
        data_origin: [x0 as i32, y0 as i32],
        display_size: film.full_size,
        channels: Vec::new(),
        attributes: Vec::new(),
    };
    let beauty = film.beauty();
    image.push_vector("", ["R", "G", "B"], &beauty);
    image.push("A", vec![1.0; beauty.len()]);
    image.push_uint("SampleCount.Y", film.map(|t, i| t.pixels[i].count() as f32));
    let variance = film.map(|t, i| t.pixels[i].variance_of_mean().as_vec3().to_array());
    image.push_vector("Variance", ["R", "G", "B"], &variance);
    if film.options.auxiliary {
        // A miss adds nothing to the sums but counts as a sample.
        let per_sample = |f: fn(&AuxiliarySums) -> [f32; 3]| {
            film.map(|t, i| {
                let n = t.pixels[i].count().max(1) as f32;
                t.auxiliary.get(i).map_or([0.0; 3], f).map(|sum| sum / n)
            })
        };
        image.push_vector("Albedo", ["R", "G", "B"], &per_sample(|a| a.albedo.to_array()));
        image.push_vector("N", ["X", "Y", "Z"], &per_sample(|a| a.normal.to_array()));
        let depth = |a: &AuxiliarySums| if a.hits > 0 { a.depth / a.hits as f32 } else { f32::INFINITY };
        image.push("Z", film.map(|t, i| t.auxiliary.get(i).map_or(f32::INFINITY, depth)));
    }
    if film.options.shapes {
        image.push_uint("Shapes.Y", film.map(|t, i| t.shapes.get(i).map_or(0.0, |s| s.len() as f32)));
    }
    image.attributes = attributes;
    let own = [
        ("chromaticities", ExrAttribute::Chromaticities([0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329])),
        ("sparing.samples", ExrAttribute::Double(film.samples() as f64)),
        ("sparing.invalidSamples", ExrAttribute::Double(film.invalid_samples() as f64)),
        ("sparing.layers", ExrAttribute::String(LAYERS.to_owned())),
    ];
    for (key, value) in own {
        if image.attribute(key).is_none() {
            image.attributes.push((key.to_owned(), value));
        }
    }
    image
}

const LAYERS: &str = "R,G,B: mean radiance, linear Rec.709. SampleCount.Y: samples taken. \
    Variance.R,G,B: unbiased variance of the pixel mean, samples taken as independent. \
    Albedo.R,G,B: mean over samples, miss = 0. N.X,Y,Z: mean world-space shading normal over samples, miss = 0, \
    not normalised. Z: mean depth along the camera axis over hits, +inf without any. \
    Shapes.Y: distinct shapes met by camera rays, background included.";
