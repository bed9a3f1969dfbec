//! Lights and pictures.

use super::case::{Case, Effort, Random};
use super::scenes::{Picture, SIDE, WHITE, render};
use anyhow::anyhow;
use glam::{Mat3, Vec3};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::description::{EnvironmentImage, Image, ImageId, ImageSource, Light, TextureEncoding};
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
    let scene = Scene::build(description, BuildOptions { threads: 0, robust: true })?;
    let mut film = Film::new([SIDE; 2], [0, 0, SIDE, SIDE], FilmOptions::default());
    let settings = RenderSettings { max_depth: 8, ..RenderSettings::default() };
    Renderer::new(&scene, settings, FilmOptions::default()).run(&mut film, &Wave::default(), |_, _| spp);
    Ok(Picture { pixels: film.beauty(), invalid: film.invalid_samples() })
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
