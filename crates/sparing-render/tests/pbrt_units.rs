//! From pbrt text to brightness: units of lights, handedness, orientation of pictures, transformations, each against a
//! value worked out by hand.

mod common;

use common::{film_mean, render};
use glam::Vec3;
use sparing_render::RenderSettings;
use sparing_render::integrator::Estimator;
use sparing_scene::{LoadOptions, SceneDescription, load_pbrt_text};
use std::f32::consts::PI;
use std::path::Path;

fn load(text: &str, folder: &Path) -> SceneDescription {
    load_pbrt_text(text.as_bytes(), folder, &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{}", e.report()))
}

/// Pictures of the tests: 2x2 with four colours, and an even white square.
fn pictures() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    // PFM rows go from the bottom: blue and white below, red and green above.
    let four = [[0.0f32, 0.0, 1.0], [1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for (name, side, data) in [("four.pfm", 2, four.to_vec()), ("even.pfm", 64, vec![[1.0; 3]; 64 * 64])] {
        let mut bytes = format!("PF\n{side} {side}\n-1.0\n").into_bytes();
        data.as_flattened().iter().for_each(|v: &f32| bytes.extend(v.to_le_bytes()));
        std::fs::write(folder.path().join(name), bytes).expect("a file");
    }
    folder
}

const CAMERA: &str =
    "PixelFilter \"box\"\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n";

/// Radiance of a grey floor (albedo 0.5) at the origin, seen from straight above; the light is at +y.
fn floor(lights: &str) -> f32 {
    floor_of("", lights)
}

/// The same in a scene that starts with `version`.
fn floor_of(version: &str, lights: &str) -> f32 {
    let folder = pictures();
    // `Film "rgb"` is a word of version 4.
    let camera = if version.is_empty() { CAMERA.to_owned() } else { CAMERA.replace("\"rgb\"", "\"image\"") };
    let text = format!(
        "{version}LookAt 0 1 0 0 0 0 0 0 1\nCamera \"orthographic\" \"float screenwindow\" [ -0.001 0.001 -0.001 0.001 ]\n{camera}\
         WorldBegin\nMaterial \"matte\"\nShape \"trianglemesh\" \"point3 P\" [ -9 0 -9 -9 0 9 9 0 9 9 0 -9 ]\n\
         \"integer indices\" [ 0 1 2 0 2 3 ]\n{lights}"
    );
    let settings = RenderSettings { max_depth: 1, ..RenderSettings::default() };
    film_mean(&render(load(&text, folder.path()), settings, 1024)).0 as f32
}

#[track_caller]
fn assert_close(found: f32, expected: f32) {
    assert!((found / expected - 1.0).abs() < 3e-3, "{found} {expected}");
}

/// albedo / pi times the irradiance.
#[test]
fn lights_have_the_units_of_version_4() {
    let from_irradiance = |e: f32| 0.5 / PI * e;
    // 100 W of luminance 1 in all directions, 2 away.
    let point = "AttributeBegin Translate 0 2 0 LightSource \"point\" \"float power\" 100 AttributeEnd";
    assert_close(floor(point), from_irradiance(100.0 / (4.0 * PI) / 4.0));
    let black_body = "LightSource \"point\" \"blackbody I\" 3000 \"float scale\" 8 \"point3 from\" [ 0 2 0 ]";
    // Luminance 1 however red: the mean of the channels is weighed differently.
    let c = {
        let scene = load(&format!("WorldBegin {black_body}"), Path::new("."));
        let sparing_scene::description::Light::Point { intensity, .. } = scene.lights[0] else { panic!() };
        assert!((intensity.dot(Vec3::new(0.2126, 0.7152, 0.0722)) / 8.0 - 1.0).abs() < 1e-3);
        intensity.element_sum() / 24.0
    };
    assert_close(floor(black_body), from_irradiance(c * 8.0 / 4.0));
    let sun =
        "LightSource \"distant\" \"float illuminance\" 3 \"point3 from\" [ 0 1 0 ] \"point3 to\" [ 0 0 0 ]";
    assert_close(floor(sun), from_irradiance(3.0));
    assert_close(floor("LightSource \"infinite\" \"float illuminance\" 3"), from_irradiance(3.0));
    // A picture: pbrt measures half of the illuminance, so twice as much arrives.
    let sky = "LightSource \"infinite\" \"string filename\" \"even.pfm\" \"float illuminance\" 3";
    assert_close(floor(sky), from_irradiance(6.0));
    // A spot light: its cone, with half of the ring where the smooth step is.
    let spot = "LightSource \"spot\" \"float power\" 100 \"point3 from\" [ 0 2 0 ] \"point3 to\" [ 0 0 0 ]";
    let [start, end] = [25f32, 30.0].map(|degrees| degrees.to_radians().cos());
    assert_close(floor(spot), from_irradiance(100.0 / (2.0 * PI * (1.0 - (start + end) / 2.0)) / 4.0));
    // A disk of radius 1 at height 2 with 10 W: L = 10 / pi², E = pi L / 5.
    let disk = "AttributeBegin AreaLightSource \"diffuse\" \"float power\" 10 Translate 0 2 0 Rotate 90 1 0 0 Shape \"disk\" \
                AttributeEnd";
    assert_close(floor(disk), from_irradiance(10.0 / PI / 5.0));
    // Two sides share the power.
    let both = disk.replace("\"float power\" 10", "\"float power\" 10 \"bool twosided\" true");
    assert_close(floor(&both), from_irradiance(5.0 / PI / 5.0));
    // The same disk without units, times `scale`.
    let plain = disk.replace("\"float power\" 10", "\"rgb L\" [ 3 3 3 ] \"float scale\" 2");
    assert_close(floor(&plain), from_irradiance(PI * 6.0 / 5.0));
}

/// Seen 25 degrees off the axis, with the edge from 20 to 30: t is where that cosine lies between the two others. Version 4
/// has t² (3 - 2 t), older ones t⁴.
#[test]
fn the_edge_of_a_spot_light_is_that_of_its_version() {
    let spot = format!(
        "LightSource \"spot\" \"rgb I\" [ 8 8 8 ] \"point3 from\" [ 0 2 0 ] \"point3 to\" [ {} 0 0 ] \
         \"float coneangle\" 30 \"float conedeltaangle\" 10",
        2.0 * 25f32.to_radians().tan()
    );
    let [start, at, end] = [20f32, 25.0, 30.0].map(|degrees| degrees.to_radians().cos());
    let t = (at - end) / (start - end);
    assert!((t - 0.5467).abs() < 1e-3, "{t}");
    let full = 0.5 / PI * 8.0 / 4.0;
    assert_close(floor(&spot), full * t * t * (3.0 - 2.0 * t));
    assert_close(floor(&format!("{spot} \"string falloff\" \"fourth\"")), full * t.powi(4));
    assert_close(floor(&format!("{spot} \"string falloff\" \"square\"")), full * t * t);
    assert_close(floor_of("SurfaceIntegrator \"path\"\n", &spot), full * t.powi(4));
}

/// A goniometric light with an even picture is a point light; an even slide of 90 degrees is a sixth of one, so at the
/// same power six times as strong within it (times what cos³ takes at the edge: its own integral).
#[test]
fn lights_with_pictures_have_their_power() {
    let at = "AttributeBegin Translate 0 2 0 Rotate 90 1 0 0";
    let even = format!(
        "{at} LightSource \"goniometric\" \"string filename\" \"even.pfm\" \"float power\" 100 AttributeEnd"
    );
    assert_close(floor(&even), 0.5 / PI * 100.0 / (4.0 * PI) / 4.0);
    let slide = format!(
        "{at} LightSource \"projection\" \"string filename\" \"even.pfm\" \"float power\" 100 AttributeEnd"
    );
    let found = floor(&slide);
    assert!((found / (0.5 / PI * 600.0 / (4.0 * PI) / 4.0) - 1.0).abs() < 0.02, "{found}");
}

/// What is at +x is on the right, what is at +y on top: camera space is left-handed.
#[test]
fn right_is_right_and_up_is_up() {
    let ball = |x: f32, y: f32| {
        format!(
            "AttributeBegin AreaLightSource \"diffuse\" Translate {x} {y} 5 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd\n"
        )
    };
    let text = format!("Camera \"perspective\" \"float fov\" 60\n{CAMERA}WorldBegin {}", ball(1.5, 1.5));
    let film = render(load(&text, Path::new(".")), RenderSettings::default(), 16);
    let lit: Vec<usize> =
        film.beauty().iter().enumerate().filter(|(_, c)| c[0] > 0.1).map(|(i, _)| i).collect();
    assert!(!lit.is_empty() && lit.iter().all(|i| i % 8 >= 4 && i / 8 < 4), "{lit:?}");
    // From the other side, left and right change places; mirroring changes them back.
    for (before, right) in
        [("LookAt 0 0 10 0 0 5 0 1 0", false), ("Scale -1 1 1 LookAt 0 0 10 0 0 5 0 1 0", true)]
    {
        let film = render(load(&format!("{before} {text}"), Path::new(".")), RenderSettings::default(), 16);
        let lit: Vec<usize> =
            film.beauty().iter().enumerate().filter(|(_, c)| c[0] > 0.1).map(|(i, _)| i).collect();
        assert!(
            !lit.is_empty() && lit.iter().all(|i| (i % 8 >= 4) == right && i / 8 < 4),
            "{before} {lit:?}"
        );
    }
}

/// The four corners of a picture on an emitting quad whose texture coordinates grow to the right and up.
#[test]
fn pictures_are_upright() {
    let folder = pictures();
    let quad = "Shape \"trianglemesh\" \"point3 P\" [ -1 -1 2 1 -1 2 1 1 2 -1 1 2 ] \"integer indices\" [ 0 1 2 0 2 3 ] \
                \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]";
    let camera = format!("Camera \"perspective\" \"float fov\" 53.13\n{CAMERA}WorldBegin");
    let corners = |text: &str| {
        let picture = render(load(text, folder.path()), RenderSettings::default(), 16).beauty();
        [0, 7, 56, 63].map(|i: usize| picture[i].map(|c| f32::from(c > 0.5)))
    };
    let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
    let light = format!(
        "{camera} AreaLightSource \"diffuse\" \"string filename\" \"four.pfm\" \"bool twosided\" true\n\
         Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ] {quad}"
    );
    assert_eq!(corners(&light), upright);
    // Reflected light under an even sky of 1: the colour itself.
    let matte = format!(
        "{camera} LightSource \"infinite\" Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"four.pfm\" \
         \"string wrap\" \"clamp\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\" {quad}"
    );
    assert_eq!(corners(&matte), upright);
    // Version 2 has the first row of the file at v = 0.
    let v2 = matte
        .replace("Camera", "SurfaceIntegrator \"path\" Camera")
        .replace("Film \"rgb\"", "Film \"image\"");
    let v2 = v2.replace("Material \"diffuse\" \"texture reflectance\"", "Material \"matte\" \"texture Kd\"");
    assert_eq!(corners(&v2), [upright[2], upright[3], upright[0], upright[1]]);
}

/// A textured area light: sampling lights, sampling directions and both together give the same.
#[test]
fn estimators_agree_on_a_light_with_a_picture() {
    let folder = pictures();
    let text = format!(
        "LookAt 0 1 0 0 0 0 0 0 1\nCamera \"orthographic\"\n{CAMERA}WorldBegin\n\
         Material \"conductor\" \"float roughness\" 0.2\nShape \"disk\" \"float radius\" 0.01\n\
         AttributeBegin Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 9 AttributeEnd\n\
         AreaLightSource \"diffuse\" \"string filename\" \"four.pfm\" \"bool twosided\" true\n\
         Shape \"bilinearmesh\" \"point3 P\" [ -1 2 -1 1 2 -1 -1 2 1 1 2 1 ]"
    );
    let means = [Estimator::Mis, Estimator::LightOnly, Estimator::BsdfOnly].map(|estimator| {
        let settings = RenderSettings { max_depth: 1, estimator, ..RenderSettings::default() };
        film_mean(&render(load(&text, folder.path()), settings, 2048))
    });
    for (mean, error) in means {
        assert!((mean - means[0].0).abs() < 4.0 * (error + means[0].1) + 1e-3 * means[0].0, "{means:?}");
    }
    assert!(means[0].0 > 1e-3);
}

/// Solid textures stay with the world: a cube of 2 shows the same squares after the object has moved.
#[test]
fn solid_textures_are_functions_of_the_world() {
    let text = |translate: &str| {
        format!(
            "Camera \"orthographic\"\n{CAMERA}WorldBegin LightSource \"infinite\"\n\
             Texture \"t\" \"spectrum\" \"checkerboard\" \"integer dimension\" 3\n\
             Material \"diffuse\" \"texture reflectance\" \"t\"\n{translate}\n\
             Shape \"trianglemesh\" \"point3 P\" [ -9 -9 2.5 9 -9 2.5 9 9 2.5 -9 9 2.5 ] \"integer indices\" [ 0 2 1 0 3 2 ]"
        )
    };
    let settings = RenderSettings { max_depth: 1, ..RenderSettings::default() };
    let at = |translate: &str| render(load(&text(translate), Path::new(".")), settings, 16).beauty();
    let (still, moved) = (at(""), at("Translate 0.7 0.3 0"));
    for (a, b) in still.iter().zip(&moved) {
        assert!((a[0] - b[0]).abs() < 0.05);
    }
    // Cubes: (0, 0, 2) is even, (-1, 0, 2) odd: the upper right quarter is white, the upper left black.
    assert!(still[7][0] > 0.95 && still[0][0] < 0.05, "{:?} {:?}", still[0], still[7]);
}
