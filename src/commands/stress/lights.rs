//! Lights and pictures.

use super::case::{Case, Effort, Random};
use super::scenes::{Picture, SIDE, WHITE, picture, render};
use anyhow::anyhow;
use glam::{Mat3, Vec3};
use sparing_render::RenderSettings;
use sparing_render::integrator::Estimator;
use sparing_scene::description::{
    EnvironmentImage, Image, ImageId, ImageSource, Light, Texture, TextureEncoding, UvMapping, Wrap,
};
use sparing_scene::{LoadOptions, load_pbrt_text};
use std::path::Path;

const AREA: &str = "Lights and textures";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "many-decades",
        does: "A white square under 10^5 (quick 10^3) parallel lights over twelve decades, against their sum.",
        unit: "relative error of the mean",
        bound: 0.02,
        measure: many,
    },
    Case {
        area: AREA,
        name: "dark-emitters",
        does: "Emitters of no power, of no area and of 1e-38: samples that are not finite, or light from nowhere.",
        unit: "bad values and brightest pixel",
        bound: 1e-6,
        measure: |e| {
            let black =
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [0 0 0] Shape \"sphere\" AttributeEnd";
            let none = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] Shape \"trianglemesh\" \"point3 P\" [0 2 0 0 2 0 1 2 0] AttributeEnd";
            let faint = "LightSource \"point\" \"rgb I\" [1e-38 1e-38 1e-38] \"point3 from\" [0 3 -3]";
            let p =
                render(&format!("{black} {none} {faint} Shape \"disk\" \"float height\" 1"), e.of(64, 1024))?;
            Ok(p.bad() + p.max())
        },
    },
    Case {
        area: AREA,
        name: "one-bright-texel",
        does: "A white square that faces surroundings black but for one texel of 1e8, against its solid angle and cosine.",
        unit: "relative error of the mean",
        bound: 0.005,
        measure: bright_texel,
    },
    Case {
        area: AREA,
        name: "black-rows",
        does: "Surroundings with rows of 0, and all 0: samples that are not finite.",
        unit: "values",
        bound: 0.0,
        measure: |e| {
            let rows = surroundings(|_, y| if y % 3 == 0 { 1.0 } else { 0.0 }, e.of(16, 256))?;
            let none = surroundings(|_, _| 0.0, e.of(16, 256))?;
            Ok(rows.bad() + none.bad() + none.max())
        },
    },
    Case {
        area: AREA,
        name: "texels-not-finite",
        does: "Surroundings with NaN, infinite and negative texels: a clear error, or a picture that is finite.",
        unit: "values",
        bound: 0.0,
        measure: |e| {
            let mut bad = 0.0;
            for value in [f32::NAN, f32::INFINITY, -1.0] {
                let made = surroundings(|x, y| if (x, y) == (3, 2) { value } else { 1.0 }, e.of(16, 256));
                bad +=
                    made.map_or(0.0, |p| p.pixels.iter().flatten().filter(|v| !v.is_finite()).count() as f64);
            }
            Ok(bad)
        },
    },
    Case {
        area: AREA,
        name: "huge-texture-coordinates",
        does: "Checks at texture coordinates of 1e6 and 1e30, and without any area in texture space: values not finite or above 1.",
        unit: "bad values and excess",
        bound: 2e-3,
        measure: |e| {
            let mut worst: f64 = 0.0;
            for scale in [1e6, 1e30, 0.0] {
                let world = format!(
                    "{WHITE}Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 1 1] \"rgb tex2\" [0 0 0] Material \"diffuse\" \"texture reflectance\" \"c\" Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"point2 uv\" [0 0 {scale} 0 {scale} {scale} 0 {scale}] \"integer indices\" [0 2 1 0 3 2]"
                );
                let p = render(&world, e.of(16, 256))?;
                worst = worst.max(p.excess());
            }
            Ok(worst)
        },
    },
    Case {
        area: AREA,
        name: "large-texture",
        does: "A texture of 16,384 on a side (quick 2,048), of which its corners, its middle and its edges are seen texel by texel. Takes 1.4 GB.",
        unit: "largest error (a texel's step is 1/255)",
        bound: 8e-3,
        measure: |e| large_texture(e.of(2_048, 16_384), e.of(16, 64)),
    },
    Case {
        area: AREA,
        name: "texture-of-one-texel",
        does: "A texture of one texel at coordinates of 0, 0.5, 1, -1e6 and 1e30, repeated, clamped and mirrored: everywhere its value.",
        unit: "largest error",
        bound: 2e-3,
        measure: |e| one_texel(e.of(16, 64)),
    },
];

const SQUARE: &str = "Material \"diffuse\" \"rgb reflectance\" [1 1 1] Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0 9 -9 0 -9 9 0 9 9 0]\n";

fn many(effort: Effort) -> anyhow::Result<f64> {
    let mut random = Random::new(21);
    let (mut world, mut sum) = (String::from(SQUARE), 0.0);
    for _ in 0..effort.of(1_000, 100_000) {
        let power = 10_f64.powf(random.between(-9.0, 3.0)) as f32;
        world += &format!(
            "LightSource \"distant\" \"rgb L\" [{power} {power} {power}] \"point3 from\" [0 0 -1] \"point3 to\" [0 0 0]\n"
        );
        sum += f64::from(power);
    }
    let p = render(&world, effort.of(512, 4096))?;
    Ok((p.mean() / (sum / std::f64::consts::PI) - 1.0).abs() + p.bad())
}

/// Size of the pictures of surroundings.
const MAP: [usize; 2] = [16, 8];

/// The white square in surroundings from a picture.
fn surroundings(texel: impl Fn(usize, usize) -> f32, spp: u32) -> anyhow::Result<Picture> {
    let mut bytes = format!("PF\n{} {}\n-1\n", MAP[0], MAP[1]).into_bytes();
    for y in (0..MAP[1]).rev() {
        for x in 0..MAP[0] {
            (0..3).for_each(|_| bytes.extend(texel(x, y).to_le_bytes()));
        }
    }
    let text = format!(
        "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40\nFilm \"rgb\" \"integer xresolution\" {SIDE} \"integer yresolution\" {SIDE}\nPixelFilter \"box\"\nWorldBegin\n{SQUARE}"
    );
    let mut description = load_pbrt_text(text.as_bytes(), Path::new("."), &LoadOptions::default())
        .map_err(|e| anyhow!("{}", e.report()))?;
    description.images.push(Image {
        source: ImageSource::Bytes { name: "surroundings.pfm".to_owned(), bytes: bytes.into() },
        encoding: TextureEncoding::Linear,
    });
    let image = Some(EnvironmentImage::from(ImageId(description.images.len() as u32 - 1)));
    description.lights.push(Light::Environment {
        radiance: Vec3::ONE,
        image,
        light_to_world: Mat3::IDENTITY,
    });
    picture(description, spp, RenderSettings { max_depth: 8, ..RenderSettings::default() }, true)
}

/// The latitude-longitude picture has its pole along z of its own space, which is the world's. The square's normal towards the
/// camera is -z: the last rows light it.
fn bright_texel(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for x in [0, 5, 15] {
        let y = MAP[1] - 2;
        let p = surroundings(|u, v| if (u, v) == (x, y) { 1e8 } else { 0.0 }, effort.of(1024, 16_384))?;
        // Pictures are interpolated: a texel is a tent over two rows' heights d around its middle m. The integral of the tent times
        // -cos sin over the angle from +z is -sin(2 m) / 2 d (sin(d) / d)^2.
        let d = std::f64::consts::PI / MAP[1] as f64;
        let middle = (y as f64 + 0.5) * d;
        let width = std::f64::consts::TAU / MAP[0] as f64;
        let irradiance = -1e8 * width * 0.5 * (2.0 * middle).sin() * d * (d.sin() / d).powi(2);
        worst = worst.max((p.mean() / (irradiance / std::f64::consts::PI) - 1.0).abs() + p.bad());
    }
    Ok(worst)
}

/// A texture in memory, as an uncompressed file of one channel of 8 bits.
fn texture(side: u16, texel: impl Fn(u32, u32) -> u8) -> Image {
    let mut bytes = vec![0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend(side.to_le_bytes());
    bytes.extend(side.to_le_bytes());
    bytes.extend([8, 0x20]); // bits of a texel; the first row is the top
    let side = u32::from(side);
    bytes.extend((0..side).flat_map(|y| (0..side).map(move |x| (x, y))).map(|(x, y)| texel(x, y)));
    let source = ImageSource::Bytes { name: "texture.tga".to_owned(), bytes: bytes.into() };
    Image { source, encoding: TextureEncoding::Linear }
}

/// The square of a texture in white light, seen where texture coordinates are from `from` to `to`.
fn textured(image: &Image, wrap: Wrap, [from, to]: [[f64; 2]; 2], spp: u32) -> anyhow::Result<Picture> {
    let ([u0, v0], [u1, v1]) = (from, to);
    let world = format!(
        "{WHITE}Texture \"t\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"point2 uv\" [{u0} {v0} {u1} {v0} {u1} {v1} {u0} {v1}] \"integer indices\" [0 2 1 0 3 2]"
    );
    let text = format!(
        "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"orthographic\"\nFilm \"rgb\" \"integer xresolution\" {SIDE} \"integer yresolution\" {SIDE}\nPixelFilter \"box\" \"float xradius\" 1e-3 \"float yradius\" 1e-3\nWorldBegin\n{world}\n"
    );
    let mut description = load_pbrt_text(text.as_bytes(), Path::new("."), &LoadOptions::default())
        .map_err(|e| anyhow!("{}", e.report()))?;
    description.images.push(image.clone());
    let image = ImageId(description.images.len() as u32 - 1);
    let (mapping, wrap) = (UvMapping::default(), [wrap; 2]);
    description.textures.fill(Texture::Image { image, mapping, wrap, scale: 1.0, invert: false });
    // In even light, chance by the cosine leaves no noise.
    let settings = RenderSettings { estimator: Estimator::BsdfOnly, ..RenderSettings::default() };
    picture(description, spp, settings, true)
}

fn large_texture(side: u16, spp: u32) -> anyhow::Result<f64> {
    let texel = |x: u32, y: u32| (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b)).to_be_bytes()[0];
    let image = texture(side, texel);
    let last = u32::from(side) - SIDE;
    let mut worst: f64 = 0.0;
    for [x0, y0] in [[0, 0], [last, 0], [0, last], [last, last], [last / 2, last / 2], [last / 3, last]] {
        // Row 0 is the top of the picture and of the texture, where v is 1.
        let at = |n: u32| f64::from(n) / f64::from(side);
        let part = [[at(x0), 1.0 - at(y0 + SIDE)], [at(x0 + SIDE), 1.0 - at(y0)]];
        let p = textured(&image, Wrap::Clamp, part, spp)?;
        for (i, pixel) in p.pixels.iter().enumerate() {
            let (x, y) = (i as u32 % SIDE, i as u32 / SIDE);
            let want = f32::from(texel(x0 + x, y0 + y)) / 255.0;
            worst = worst.max(f64::from((pixel[0] - want).abs()));
        }
        worst += p.bad();
    }
    Ok(worst)
}

fn one_texel(spp: u32) -> anyhow::Result<f64> {
    let image = texture(1, |_, _| 102);
    let mut worst: f64 = 0.0;
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for part in [[[0.0; 2], [1.0; 2]], [[0.5; 2], [0.5; 2]], [[-1e6, 1e6], [1e30, -1e30]]] {
            let p = textured(&image, wrap, part, spp)?;
            let error = |v: &f32| f64::from((v - 0.4).abs());
            worst = p.pixels.iter().flatten().map(error).fold(worst, f64::max) + p.bad();
        }
    }
    Ok(worst)
}
