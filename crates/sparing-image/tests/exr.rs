//! Layers of a film in a file, in our reader and in an independent one; pictures read from EXR files.

use std::error::Error;

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, Vec2};
use glam::Vec3;
use proptest::prelude::*;
use sparing_image::exr::*;
use sparing_image::film::{Film, FilmOptions};
use sparing_image::picture::{Picture, Pixels};

/// A cropped film with two samples a pixel, the second of which misses in every third pixel.
fn film(options: FilmOptions) -> Film {
    let mut film = Film::new([40, 30], [5, 3, 26, 20], options);
    for tile in &mut film.tiles {
        for y in tile.y0..tile.y0 + tile.height {
            for x in tile.x0..tile.x0 + tile.width {
                let i = tile.index(x, y);
                tile.add_sample(i, 0, Vec3::new(x as f32, y as f32, 1.0), 1.0);
                tile.add_sample(i, 1, Vec3::new(x as f32 + 2.0, y as f32, 1.0), 1.0);
                let hits = if (x + y) % 3 == 0 { u32::from(x > 20) } else { 2 };
                for k in 0..hits {
                    if let Some(a) = tile.auxiliary.get_mut(i) {
                        a.albedo += Vec3::new(0.5, 0.25, 1.0);
                        a.normal += Vec3::Z;
                        a.depth += 10.0 + k as f32;
                        a.hits += 1;
                    }
                }
                if let Some(s) = tile.shapes.get_mut(i) {
                    (0..=hits).for_each(|id| s.insert(id));
                }
            }
        }
    }
    film
}

const ALL: FilmOptions = FilmOptions { auxiliary: true, shapes: true, luminance: false };

fn value(image: &ExrImage, name: &str, x: u32, y: u32) -> f32 {
    let at =
        (y as i32 - image.data_origin[1]) as u32 * image.width + (x as i32 - image.data_origin[0]) as u32;
    image.channel(name).unwrap_or_else(|| panic!("no {name}")).data[at as usize]
}

#[test]
fn layers_hold_what_the_table_says() {
    let image = film_layers(&film(ALL), vec![("sparing.seed".into(), ExrAttribute::Int(7))]);
    assert_eq!((image.width, image.height), (21, 17));
    assert_eq!((image.data_origin, image.display_size), ([5, 3], [40, 30]));
    let (x, y) = (7, 4); // two hits
    let at = |name| value(&image, name, x, y);
    assert_eq!(["R", "G", "B", "A"].map(at), [8.0, 4.0, 1.0, 1.0]);
    assert_eq!(at("SampleCount.Y"), 2.0);
    // Samples 7 and 9: variance 2, of the mean of two 1.
    assert_eq!(["Variance.R", "Variance.G", "Variance.B"].map(at), [1.0, 0.0, 0.0]);
    assert_eq!(["Albedo.R", "Albedo.G", "Albedo.B"].map(at), [0.5, 0.25, 1.0]);
    assert_eq!(["N.X", "N.Y", "N.Z"].map(at), [0.0, 0.0, 1.0]);
    assert_eq!((at("Z"), at("Shapes.Y")), (10.5, 3.0));
    // No hit, and one of two.
    assert_eq!(["Albedo.R", "N.Z", "Z"].map(|n| value(&image, n, 6, 3)), [0.0, 0.0, f32::INFINITY]);
    assert_eq!(["Albedo.R", "N.Z", "Z"].map(|n| value(&image, n, 21, 3)), [0.25, 0.5, 10.0]);
    assert_eq!(image.attribute("sparing.seed"), Some(&ExrAttribute::Int(7)));
    assert_eq!(image.attribute("sparing.samples"), Some(&ExrAttribute::Double(2.0 * 21.0 * 17.0)));
}

#[test]
fn layers_that_the_film_does_not_keep_are_absent() {
    let image = film_layers(&film(FilmOptions::default()), Vec::new());
    let names: Vec<&str> = image.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["R", "G", "B", "A", "SampleCount.Y", "Variance.R", "Variance.G", "Variance.B"]);
}

#[test]
fn a_film_survives_the_file() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("film.exr");
    let image = film_layers(&film(ALL), vec![("owner".into(), ExrAttribute::String("me".into()))]);
    write_exr(&path, &image)?;
    let mut back = read_exr(&path)?;
    let mut sorted = image;
    sorted.channels.sort_by(|a, b| a.name.cmp(&b.name));
    back.attributes.sort_by(|a, b| a.0.cmp(&b.0));
    sorted.attributes.sort_by(|a, b| a.0.cmp(&b.0));
    assert_eq!(back, sorted);

    let theirs = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(&path)?;
    let layer = &theirs.layer_data;
    assert_eq!(theirs.attributes.display_window.size, Vec2(40, 30));
    assert_eq!((layer.attributes.layer_position, layer.size), (Vec2(5, 3), Vec2(21, 17)));
    assert!(theirs.attributes.chromaticities.is_some());
    assert_eq!(layer.channel_data.list.len(), sorted.channels.len());
    for (theirs, ours) in layer.channel_data.list.iter().zip(&sorted.channels) {
        assert_eq!(theirs.name.to_string(), ours.name);
        match &theirs.sample_data {
            FlatSamples::F32(v) => assert!(ours.kind == ExrType::Float && *v == ours.data),
            FlatSamples::U32(v) => {
                assert!(
                    ours.kind == ExrType::Uint && v.iter().map(|x| *x as f32).eq(ours.data.iter().copied())
                );
            }
            FlatSamples::F16(_) => panic!("no layer is of halves"),
        }
    }
    Ok(())
}

#[test]
fn pictures_take_the_colour_of_an_exr_file() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("p.dat"); // the content tells, not the name
    let read = |image: &ExrImage| -> Result<Picture, Box<dyn Error>> {
        write_exr(&path, image)?;
        Ok(Picture::read(&path)?)
    };
    let mut image = ExrImage::new(2, 1);
    image.push_vector("Light", ["R", "G", "B"], &[[7.0; 3]; 2]);
    let p = read(&image)?;
    assert!(matches!(&p.pixels, Pixels::Rgb32F(v) if *v == [[7.0; 3]; 2]));
    image.push("Y", vec![1.0, f32::INFINITY]);
    assert!(matches!(read(&image)?.pixels, Pixels::Rgb32F(v) if v == [[1.0; 3], [f32::INFINITY; 3]]));
    image.push_vector("", ["R", "G", "B"], &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    assert_eq!(read(&image)?.to_linear(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    let mut depth = ExrImage::new(2, 1);
    depth.push("Z", vec![1.0, 2.0]);
    let message = read(&depth).unwrap_err().to_string();
    assert!(message.contains("only Z"), "{message}");
    Ok(())
}

#[test]
fn types_of_storage_round_as_documented() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("types.exr");
    let data = vec![-1.0, 0.4, 2.6, f32::NAN, 70000.0, 1.0 / 3.0];
    let mut image = ExrImage::new(3, 2);
    image.push_uint("U", data.clone());
    image.channels.push(ExrChannel { name: "H".into(), data, kind: ExrType::Half });
    write_exr(&path, &image)?;
    let back = read_exr(&path)?;
    assert_eq!(back.channel("U").unwrap().data, [0.0, 0.0, 3.0, 0.0, 70000.0, 0.0]);
    let half = &back.channel("H").unwrap().data;
    assert_eq!((half[0], half[4]), (-1.0, f32::INFINITY));
    assert!(half[3].is_nan() && (half[5] - 1.0 / 3.0).abs() < 1e-4);
    Ok(())
}

fn valid_files() -> &'static [Vec<u8>; 3] {
    static FILES: std::sync::LazyLock<[Vec<u8>; 3]> = std::sync::LazyLock::new(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        write_exr(&path, &film_layers(&film(ALL), Vec::new())).unwrap();
        let exr = std::fs::read(&path).unwrap();
        sparing_image::png::write_png(&path, 2, 2, &[[0.5; 3]; 4], 0.0).unwrap();
        let png = std::fs::read(&path).unwrap();
        let pfm = [&b"PF\n3 2\n-1.0\n"[..], &[63; 72]].concat();
        [exr, png, pfm]
    });
    &FILES
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn damaged_pictures_never_panic(
        which in 0..3usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        near_the_start in any::<bool>(),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let mut bytes = valid_files()[which].clone();
        for (at, value) in changes {
            let at = at.index(if near_the_start { bytes.len().min(400) } else { bytes.len() });
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(picture) = Picture::decode(&bytes, "x") {
            prop_assert!(picture.width > 0 && picture.height > 0);
        }
    }
}
