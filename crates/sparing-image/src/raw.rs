//! A film as it is, in an OpenEXR file, and back bit for bit.
//!
//! The file has the layers of a picture, so that any viewer shows it, and besides the sums themselves. An f64 takes two channels of
//! 32 bits, `high` and `low`:
//!
//! | channels | meaning |
//! | --- | --- |
//! | `Raw.Block0.R.high` .. `Raw.Block7.B.low` | sums of the eight blocks |
//! | `Raw.Squares.R.high` .. | sums of the squared samples |
//! | `Raw.Luminance.high`, `.low` | sums of the squared Y of XYZ, if kept |
//! | `Raw.Albedo.R` .., `Raw.Normal.X` .., `Raw.Depth`, `Raw.Hits` | sums at the first hit, if kept |
//! | `Raw.Shapes.Count`, `Raw.Shape0` .. `Raw.Shape3` | shapes met, if kept; the fifth and further ones of a pixel are text |
//!
//! The attributes `sparing.raw`, `sparing.raw.invalid` and `sparing.raw.shapes` hold what is no number a pixel.

use crate::exr::{ExrAttribute, ExrImage, ExrType, film_layers};
use crate::film::{AuxiliarySums, BLOCKS, Film, FilmOptions, Pixel, Tile};
use glam::{DVec3, Vec3};
use openexr_core::{Channel, Image, Samples, Window};
use std::fmt::Write as _;

/// Most samples of a pixel that are believed.
const MAX_COUNT: u32 = 1 << 30;

/// The film and its layers, with these attributes and further channels of one value a pixel.
#[must_use]
pub fn image_of(film: &Film, attributes: Vec<(String, ExrAttribute)>, further: Vec<Channel>) -> Image {
    let ExrImage { width, height, data_origin, display_size, channels, attributes } =
        film_layers(film, attributes);
    let mut image = Image {
        display: Window { origin: [0, 0], size: display_size },
        data: Window { origin: data_origin, size: [width, height] },
        channels: channels.into_iter().map(|c| channel(&c.name, layer(c.kind, c.data))).collect(),
        attributes,
    };
    for (block, c) in (0..BLOCKS).flat_map(|b| (0..3).map(move |c| (b, c))) {
        let name = format!("Raw.Block{block}.{}", RGB[c]);
        push_f64(&mut image, &name, film, |t, i| t.pixels[i].block_sums()[block][c]);
    }
    for (c, rgb) in RGB.iter().enumerate() {
        push_f64(&mut image, &format!("Raw.Squares.{rgb}"), film, |t, i| t.pixels[i].squares()[c]);
    }
    if film.options.luminance {
        push_f64(&mut image, "Raw.Luminance", film, |t, i| t.luminance_squares[i]);
    }
    if film.options.auxiliary {
        for (name, value) in AUXILIARY {
            let samples = Samples::F32(film.map(|t, i| value(&mut t.auxiliary[i].clone(), None)));
            image.channels.push(channel(name, samples));
        }
        image.channels.push(channel("Raw.Hits", Samples::U32(film.map(|t, i| t.auxiliary[i].hits))));
    }
    if film.options.shapes {
        image.channels.push(channel("Raw.Shapes.Count", Samples::U32(film.map(|t, i| t.shapes[i].len()))));
        for k in 0..4 {
            let id = film.map(|t, i| t.shapes[i].ids().nth(k).unwrap_or(0));
            image.channels.push(channel(&format!("Raw.Shape{k}"), Samples::U32(id)));
        }
    }
    image.channels.extend(further);
    let texts = [("sparing.raw", "2".to_owned()), (INVALID, invalid(film)), (SHAPES, more_shapes(film))];
    image.attributes.extend(texts.map(|(key, text)| (key.to_owned(), ExrAttribute::String(text))));
    image
}

/// The film of an image that [`image_of`] made. Its correction is what the picture has beyond the means.
///
/// # Errors
/// What is missing, or cannot be.
pub fn film_of(image: &Image) -> Result<Film, String> {
    if text(image, "sparing.raw") != Some("2") {
        return Err("it holds no raw film of this version".to_owned());
    }
    let has = |name: &str| image.channel(name).is_some();
    let options = FilmOptions {
        auxiliary: has("Raw.Hits"),
        shapes: has("Raw.Shapes.Count"),
        luminance: has("Raw.Luminance.high"),
    };
    let mut film = Film::new(image.display.size, crop(image)?, options);
    let counts = u32s(image, "SampleCount.Y")?;
    if counts.iter().any(|n| *n > MAX_COUNT) {
        return Err("a pixel has more samples than are possible".to_owned());
    }
    let mut sums = vec![[DVec3::ZERO; BLOCKS]; counts.len()];
    for (block, c) in (0..BLOCKS).flat_map(|b| (0..3).map(move |c| (b, c))) {
        let values = f64s(image, &format!("Raw.Block{block}.{}", RGB[c]))?;
        sums.iter_mut().zip(values).for_each(|(s, v)| s[block][c] = v);
    }
    let mut squares = vec![DVec3::ZERO; counts.len()];
    for (c, rgb) in RGB.iter().enumerate() {
        let values = f64s(image, &format!("Raw.Squares.{rgb}"))?;
        squares.iter_mut().zip(values).for_each(|(s, v)| s[c] = v);
    }
    fill(&mut film, |tile, i, at| tile.pixels[i] = Pixel::from_sums(sums[at], squares[at], counts[at]));
    if options.luminance {
        let values: Vec<f64> = f64s(image, "Raw.Luminance")?.collect();
        fill(&mut film, |tile, i, at| tile.luminance_squares[i] = values[at]);
    }
    if options.auxiliary {
        for (name, value) in AUXILIARY {
            let Some(Channel { samples: Samples::F32(values), .. }) = image.channel(name) else {
                return Err(format!("the channel {name} is missing"));
            };
            fill(&mut film, |tile, i, at| {
                value(&mut tile.auxiliary[i], Some(values[at]));
            });
        }
        let hits = u32s(image, "Raw.Hits")?;
        fill(&mut film, |tile, i, at| tile.auxiliary[i].hits = hits[at]);
    }
    if options.shapes {
        read_shapes(image, &mut film)?;
    }
    read_invalid(image, &mut film)?;
    Ok(film)
}

const RGB: [&str; 3] = ["R", "G", "B"];
const INVALID: &str = "sparing.raw.invalid";
const SHAPES: &str = "sparing.raw.shapes";

/// Sets a sum if there is a value, and gives it.
type Access = fn(&mut AuxiliarySums, Option<f32>) -> f32;

const AUXILIARY: [(&str, Access); 7] = [
    ("Raw.Albedo.R", |a, v| component(&mut a.albedo, 0, v)),
    ("Raw.Albedo.G", |a, v| component(&mut a.albedo, 1, v)),
    ("Raw.Albedo.B", |a, v| component(&mut a.albedo, 2, v)),
    ("Raw.Normal.X", |a, v| component(&mut a.normal, 0, v)),
    ("Raw.Normal.Y", |a, v| component(&mut a.normal, 1, v)),
    ("Raw.Normal.Z", |a, v| component(&mut a.normal, 2, v)),
    ("Raw.Depth", |a, v| {
        a.depth = v.unwrap_or(a.depth);
        a.depth
    }),
];

fn component(of: &mut Vec3, axis: usize, value: Option<f32>) -> f32 {
    of[axis] = value.unwrap_or(of[axis]);
    of[axis]
}

fn channel(name: &str, samples: Samples) -> Channel {
    Channel { name: name.to_owned(), samples }
}

fn layer(kind: ExrType, data: Vec<f32>) -> Samples {
    // Counts are exact below 2^24; beyond, the integers of a film are written by others.
    if kind == ExrType::Uint {
        Samples::U32(data.iter().map(|v| *v as u32).collect())
    } else {
        Samples::F32(data)
    }
}

fn push_f64(image: &mut Image, name: &str, film: &Film, value: impl Fn(&Tile, usize) -> f64) {
    let bits = film.map(|t, i| value(t, i).to_bits());
    let part = |shift: u32| Samples::U32(bits.iter().map(|b| (b >> shift) as u32).collect());
    image.channels.push(channel(&format!("{name}.high"), part(32)));
    image.channels.push(channel(&format!("{name}.low"), part(0)));
}

/// The integers of a channel.
///
/// # Errors
/// It is missing or of another type.
pub fn u32s<'a>(image: &'a Image, name: &str) -> Result<&'a [u32], String> {
    match image.channel(name) {
        Some(Channel { samples: Samples::U32(values), .. }) => Ok(values),
        _ => Err(format!("the channel {name} is missing")),
    }
}

fn f64s<'a>(image: &'a Image, name: &str) -> Result<impl Iterator<Item = f64> + use<'a>, String> {
    let (high, low) = (u32s(image, &format!("{name}.high"))?, u32s(image, &format!("{name}.low"))?);
    let join = |(h, l): (&u32, &u32)| f64::from_bits(u64::from(*h) << 32 | u64::from(*l));
    let values = high.iter().zip(low).map(join);
    // Samples that are not finite or negative never enter a film.
    if values.clone().any(|v| !v.is_finite() || v < 0.0) {
        return Err(format!("the channel {name} has values that cannot be"));
    }
    Ok(values)
}

/// The text of an attribute.
#[must_use]
pub fn text<'a>(image: &'a Image, key: &str) -> Option<&'a str> {
    match image.attribute(key) {
        Some(ExrAttribute::String(text)) => Some(text),
        _ => None,
    }
}

/// The pixel bounds x0, y0, x1, y1 of what is stored.
///
/// # Errors
/// It reaches outside of the picture.
pub fn crop(image: &Image) -> Result<[u32; 4], String> {
    let ([x, y], [width, height]) = (image.data.origin, image.data.size);
    let bounds = |first: i32, size: u32, most: u32| {
        let first = u32::try_from(first).ok()?;
        let last = first.checked_add(size)?;
        (size > 0 && last <= most).then_some((first, last))
    };
    let [w, h] = image.display.size;
    match (image.display.origin, bounds(x, width, w), bounds(y, height, h)) {
        ([0, 0], Some((x0, x1)), Some((y0, y1))) => Ok([x0, y0, x1, y1]),
        _ => Err("its pixels lie outside of its picture".to_owned()),
    }
}

/// Calls for every pixel: tile, index in it, index in rows.
fn fill(film: &mut Film, mut set: impl FnMut(&mut Tile, usize, usize)) {
    let (width, [x0, y0, ..]) = (film.width() as usize, film.crop);
    for tile in &mut film.tiles {
        for i in tile.indices() {
            let (x, y) = tile.position(i);
            set(tile, i, (y - y0) as usize * width + (x - x0) as usize);
        }
    }
}

/// A line for each tile with invalid samples: its number, how many, and index, y and x of those that are named.
fn invalid(film: &Film) -> String {
    let mut out = String::new();
    for (k, tile) in film.tiles.iter().enumerate() {
        if tile.invalid > 0 {
            let _ = write!(out, "{k} {}", tile.invalid);
            tile.named_invalid.as_flattened().iter().for_each(|v| {
                let _ = write!(out, " {v}");
            });
            out.push('\n');
        }
    }
    out
}

fn read_invalid(image: &Image, film: &mut Film) -> Result<(), String> {
    for line in text(image, INVALID).unwrap_or_default().lines() {
        let numbers: Vec<u32> = line.split(' ').filter_map(|v| v.parse().ok()).collect();
        let tile = numbers.first().and_then(|k| film.tiles.get_mut(*k as usize));
        let named = numbers.get(2..).map(<[u32]>::as_chunks::<3>);
        let (Some(tile), Some((named, []))) = (tile, named) else {
            return Err("its list of invalid samples is damaged".to_owned());
        };
        tile.invalid = numbers[1];
        tile.name_invalid(named);
    }
    Ok(())
}

/// A line for each pixel that met more than four shapes: its number in rows, and the fifth and further ones.
fn more_shapes(film: &Film) -> String {
    let mut out = String::new();
    if film.options.shapes {
        for (at, ids) in film.map(|t, i| t.shapes[i].ids().skip(4).collect::<Vec<_>>()).iter().enumerate() {
            if !ids.is_empty() {
                let _ = write!(out, "{at}");
                for id in ids {
                    let _ = write!(out, " {id}");
                }
                out.push('\n');
            }
        }
    }
    out
}

fn read_shapes(image: &Image, film: &mut Film) -> Result<(), String> {
    let counts = u32s(image, "Raw.Shapes.Count")?;
    for k in 0..4 {
        let ids = u32s(image, &format!("Raw.Shape{k}"))?;
        fill(film, |tile, i, at| {
            if counts[at] > k {
                tile.shapes[i].insert(ids[at]);
            }
        });
    }
    let mut further = std::collections::HashMap::new();
    for line in text(image, SHAPES).unwrap_or_default().lines() {
        let mut numbers = line.split(' ').map_while(|v| v.parse::<u32>().ok());
        if let Some(at) = numbers.next() {
            further.insert(at as usize, numbers.collect::<Vec<_>>());
        }
    }
    let mut whole = true;
    fill(film, |tile, i, at| {
        further.get(&at).into_iter().flatten().for_each(|id| tile.shapes[i].insert(*id));
        whole &= tile.shapes[i].len() == counts[at];
    });
    if whole { Ok(()) } else { Err("its lists of shapes are damaged".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exr::write_image;
    use openexr_core::{Compression, ImageRef, Limits};

    fn film(options: FilmOptions, crop: [u32; 4]) -> Film {
        let mut film = Film::new([40, 31], crop, options);
        for (k, tile) in film.tiles.iter_mut().enumerate() {
            for i in tile.indices() {
                for n in 0..(i * 7 + k) as u32 % 41 {
                    let v = ((n + 1) as f32 * 1.37).sin().abs() * 10_f32.powi(k as i32 % 30 - 15);
                    tile.add_sample(i, n, Vec3::new(v, 1.0 / v, if n == 5 { f32::NAN } else { 0.3 }), 1.0);
                    if options.auxiliary {
                        tile.auxiliary[i].albedo += Vec3::splat(v);
                        tile.auxiliary[i].depth -= v;
                        tile.auxiliary[i].hits += 1;
                    }
                    if options.shapes {
                        tile.shapes[i].insert(n % (1 + i as u32 % 9) + u32::MAX / 2);
                    }
                }
            }
        }
        film
    }

    fn same(a: &Film, b: &Film) -> bool {
        let everything = |f: &Film| {
            f.map(|t, i| {
                let shapes = t.shapes.get(i).map(|s| s.ids().collect::<Vec<_>>());
                let auxiliary = t.auxiliary.get(i).copied();
                (t.pixels[i].clone(), auxiliary, shapes, t.luminance_squares.get(i).copied())
            })
            .into_iter()
            .map(|v| format!("{v:?}"))
            .collect::<Vec<_>>()
        };
        let invalid = |f: &Film| (f.invalid_samples(), f.named_invalid().collect::<Vec<_>>());
        everything(a) == everything(b)
            && invalid(a) == invalid(b)
            && a.crop == b.crop
            && a.options == b.options
    }

    #[test]
    fn a_film_comes_back_from_a_file_bit_for_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        for (k, bits) in (0..8).enumerate() {
            let options =
                FilmOptions { auxiliary: bits & 1 > 0, shapes: bits & 2 > 0, luminance: bits & 4 > 0 };
            let film = film(options, if k % 2 == 0 { [0, 0, 40, 31] } else { [3, 5, 22, 31] });
            assert!(film.invalid_samples() > 0);
            let path = folder.path().join("film.exr");
            let image = image_of(&film, Vec::new(), Vec::new());
            for compression in [Compression::None, Compression::Zip] {
                write_image(&path, ImageRef { compression, ..ImageRef::from(&image) })
                    .expect("it is written");
                let bytes = std::fs::read(&path).expect("it is read");
                let read = openexr_core::read(&bytes, &Limits::default()).expect("it is an EXR");
                let back = film_of(&read).expect("it is a film");
                assert!(same(&film, &back), "{options:?}");
            }
        }
    }

    #[test]
    fn what_is_no_film_is_refused() {
        let mut image = image_of(&film(FilmOptions::default(), [0, 0, 40, 31]), Vec::new(), Vec::new());
        image.channels.retain(|c| c.name != "Raw.Block3.G.low");
        assert_eq!(
            film_of(&image).expect_err("a channel is missing"),
            "the channel Raw.Block3.G.low is missing"
        );
        let mut image = image_of(&film(FilmOptions::default(), [0, 0, 40, 31]), Vec::new(), Vec::new());
        for c in image.channels.iter_mut().filter(|c| c.name == "Raw.Squares.B.high") {
            c.samples = Samples::U32(vec![u32::MAX; 40 * 31]);
        }
        assert!(film_of(&image).expect_err("NaN").contains("cannot be"));
        for c in image.channels.iter_mut().filter(|c| c.name == "SampleCount.Y") {
            c.samples = Samples::U32(vec![MAX_COUNT + 1; 40 * 31]);
        }
        assert!(film_of(&image).expect_err("counts").contains("more samples than are possible"));
        image.attributes.clear();
        assert!(film_of(&image).expect_err("a picture").contains("no raw film"));
    }

    #[test]
    fn ranges_of_samples_add_up_to_the_whole() {
        let sample = |n: u32| Vec3::new((n as f32).sin().abs(), 1e6 / (n + 1) as f32, 1e-6 * n as f32);
        for total in [64_u32, 512, 1000, 4096] {
            let mut whole = Pixel::default();
            (0..total).for_each(|n| whole.add(sample(n)));
            let size = total.div_ceil(8).next_power_of_two();
            for parts in 1..=4 {
                let border = |k: u32| (8 * k / parts * size).min(total);
                let mut sum = Pixel::default();
                for k in 0..parts {
                    let mut part = Pixel::starting_at(border(k));
                    (border(k)..border(k + 1)).for_each(|n| part.add(sample(n)));
                    sum.append(&part);
                }
                assert_eq!(sum.block_sums(), whole.block_sums(), "{total} in {parts}");
                assert_eq!((sum.count(), sum.sum()), (whole.count(), whole.sum()));
                let error = (sum.squares() - whole.squares()).abs() / whole.squares();
                assert!(error.max_element() < 1e-13);
            }
        }
    }
}
