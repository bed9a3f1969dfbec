//! Motion while the shutter is open, against closed forms.

mod common;

use common::{closed_box, diffuse, emitter, film_mean, render, scene_with, shape, square};
use glam::{Affine3A, Mat4, Quat, Vec3};
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::{Estimator, Wave};
use sparing_render::{BuildOptions, Needs, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::description::{
    Geometry, Instance, Light, ObjectDefinition, Projection, Shape, TriangleMesh,
};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, PI};

/// An orthographic camera at the origin that looks along +z and sees 8 x 8 units, one a pixel.
fn stage() -> SceneDescription {
    let mut d = scene_with(vec![diffuse(0.5)]);
    d.camera.projection = Projection::Orthographic;
    d.camera.screen_window = Some([-4.0, 4.0, -4.0, 4.0]);
    d
}

/// Puts a shape into the scene as an object that moves.
fn moving(d: &mut SceneDescription, shape: Shape, start: Affine3A, end: Affine3A) {
    let object = d.objects.len() as u32;
    d.objects.push(ObjectDefinition { name: String::new(), shapes: vec![shape] });
    d.instances.push(Instance { object, object_to_world: start, end: Some(end) });
}

/// A rectangle from x0 to x1 over all of y, emitting 1 towards the camera.
fn bar(x0: f32, x1: f32, z: f32) -> Shape {
    let (center, half) = (0.5 * (x0 + x1), 0.5 * (x1 - x0));
    emitter(square(Vec3::new(center, 0.0, z), Vec3::Y * 10.0, Vec3::X * half), 1.0)
}

fn along_x(x: f32) -> Affine3A {
    Affine3A::from_translation(Vec3::X * x)
}

/// Mean of the columns of a film.
fn columns(film: &Film) -> Vec<f64> {
    let means = film.map(|t, i| t.pixels[i].mean().x);
    let (w, h) = (film.width() as usize, film.height() as usize);
    assert_eq!(means.len(), w * h);
    let mut sums = vec![0.0; w];
    for (i, mean) in pixels(film) {
        sums[i[0]] += mean / h as f64;
    }
    sums
}

/// Every pixel by its place.
fn pixels(film: &Film) -> Vec<([usize; 2], f64)> {
    let mut all = Vec::new();
    for tile in &film.tiles {
        for i in tile.indices() {
            let n = sparing_image::film::TILE as usize;
            let place = [tile.x0 as usize + i % n, tile.y0 as usize + i / n];
            all.push((place, tile.pixels[i].mean().x));
        }
    }
    all
}

fn check(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() < tolerance, "{found:?}, not {expected:?}");
    }
}

/// A bar of 4 pixels moves by 4: pixel k is covered for (k + 1/2) / 4 of the time at first, then ever less.
const RAMP: [f64; 8] = [0.125, 0.375, 0.625, 0.875, 0.875, 0.625, 0.375, 0.125];

#[test]
fn a_moving_bar_is_a_linear_ramp() {
    let mut d = stage();
    moving(&mut d, bar(-4.0, 0.0, 3.0), along_x(0.0), along_x(4.0));
    check(&columns(&render(d.clone(), RenderSettings::default(), 4096)), &RAMP, 4e-3);
    // Open while the motion goes from 1/4 to 1/2: the edges go from 1 to 2 and from 5 to 6 pixels.
    d.camera.shutter = [0.25, 0.5];
    let expected = [0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0, 0.0];
    check(&columns(&render(d.clone(), RenderSettings::default(), 4096)), &expected, 4e-3);
    // Over after a quarter of the time: the bar rests on pixels 4 to 7 for the remaining three quarters.
    d.camera.shutter = [0.0, 4.0];
    let expected = RAMP.map(|part| part * 0.25);
    let expected: Vec<f64> = (0..8).map(|k| expected[k] + if k >= 4 { 0.75 } else { 0.0 }).collect();
    check(&columns(&render(d, RenderSettings::default(), 4096)), &expected, 4e-3);
}

#[test]
fn a_moving_camera_sees_the_same_ramp() {
    let mut d = stage();
    d.shapes = vec![bar(-4.0, 0.0, 3.0)];
    d.camera.end = Some(Mat4::from_translation(Vec3::NEG_X * 4.0));
    check(&columns(&render(d, RenderSettings::default(), 4096)), &RAMP, 4e-3);
}

/// A quadrant turns by 90 degrees: a point at angle a is covered for a / 90 degrees of the time, up to 90 degrees, and for
/// as much less from there to 180.
#[test]
fn a_turning_quadrant_is_a_ramp_of_angles() {
    let mut d = stage();
    let quadrant = square(Vec3::new(5.0, 5.0, 3.0), Vec3::Y * 5.0, Vec3::X * 5.0);
    let end = Affine3A::from_quat(Quat::from_rotation_z(FRAC_PI_2));
    moving(&mut d, emitter(quadrant, 1.0), Affine3A::IDENTITY, end);
    let film = render(d, RenderSettings::default(), 4096);
    for ([x, y], mean) in pixels(&film) {
        let n = 32;
        let expected: f64 = (0..n * n)
            .map(|i| {
                let at = |k: usize| (k as f64 + 0.5) / n as f64;
                let p = [x as f64 - 4.0 + at(i % n), 4.0 - y as f64 - at(i / n)];
                let quarters = p[1].atan2(p[0]) / std::f64::consts::FRAC_PI_2;
                (1.0 - (quarters - 1.0).abs()).max(0.0)
            })
            .sum::<f64>()
            / (n * n) as f64;
        assert!((mean - expected).abs() < 1.2e-2, "{x},{y}: {mean}, not {expected}");
    }
}

/// A wall turns from facing the light to 60 degrees: its brightness is rho E / pi times the mean of the cosine, which is
/// sin 60 over 60 degrees.
#[test]
fn normals_turn_with_the_surface() {
    for vertex_normals in [false, true] {
        let mut d = stage();
        d.camera.screen_window = Some([-0.5, 0.5, -0.5, 0.5]);
        let mut wall = square(Vec3::ZERO, Vec3::Y * 40.0, Vec3::X * 40.0);
        if let (Geometry::Triangles(TriangleMesh { normals, .. }), true) = (&mut wall, vertex_normals) {
            *normals = Some(vec![[0.0, 0.0, -1.0]; 4]);
        }
        let place =
            |angle: f32| Affine3A::from_rotation_translation(Quat::from_rotation_y(angle), Vec3::Z * 50.0);
        moving(&mut d, shape(wall), place(0.0), place(FRAC_PI_3));
        d.lights.push(Light::Distant { direction: Vec3::Z, irradiance: Vec3::splat(PI) });
        let settings = RenderSettings { max_depth: 1, ..RenderSettings::default() };
        let (mean, _) = film_mean(&render(d, settings, 256));
        let expected = 0.5 * f64::from(FRAC_PI_3.sin() / FRAC_PI_3);
        assert!((mean - expected).abs() < 1e-4, "{mean}, not {expected}");
    }
}

/// The shadow of a bar that moves behind the camera.
#[test]
fn shadow_rays_have_the_time_of_their_path() {
    let mut d = stage();
    d.shapes = vec![shape(square(Vec3::Z * 5.0, Vec3::Y * 10.0, Vec3::X * 10.0))];
    // Light at 45 degrees: what is at z = -20 has its shadow 25 further along x.
    let dark = Shape { emission: None, ..bar(-29.0, -25.0, -20.0) };
    moving(&mut d, dark, along_x(0.0), along_x(4.0));
    let direction = Vec3::new(1.0, 0.0, 1.0).normalize();
    d.lights.push(Light::Distant { direction, irradiance: Vec3::splat(PI * std::f32::consts::SQRT_2) });
    let settings = RenderSettings { max_depth: 1, ..RenderSettings::default() };
    let expected = RAMP.map(|shadow| 0.5 * (1.0 - shadow));
    check(&columns(&render(d, settings, 4096)), &expected, 4e-3);
}

/// A sphere that moves and grows inside of the picture covers the mean of its discs: with radius from 1 to 2 that is pi
/// times 7/3.
#[test]
fn a_growing_sphere_covers_the_mean_of_its_discs() {
    let mut d = stage();
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let ball = emitter(Geometry::Sphere { center: Vec3::ZERO, radius: 1.0, axes }, 1.0);
    let place = |x: f32, scale: f32| {
        Affine3A::from_scale_rotation_translation(Vec3::splat(scale), Quat::IDENTITY, Vec3::new(x, 0.5, 5.0))
    };
    moving(&mut d, ball, place(-2.5, 1.0), place(1.5, 2.0));
    let (mean, _) = film_mean(&render(d, RenderSettings::default(), 4096));
    let expected = f64::from(PI) * 7.0 / 3.0 / 64.0;
    assert!((mean - expected).abs() < 2e-3, "{mean}, not {expected}");
}

/// A room with a lamp, a box that moves in it and, if asked for, a lamp that moves.
fn room(lamp_moves: bool) -> SceneDescription {
    let mut d = scene_with(vec![diffuse(0.6)]);
    let mut walls = shape(closed_box(4.0));
    walls.reverse_orientation = true;
    let lamp = |y: f32| emitter(square(Vec3::new(0.0, y, 1.0), Vec3::X, Vec3::Z), 6.0);
    d.shapes = vec![walls, lamp(3.9)];
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_y(1.0), Vec3::new(1.0, -2.0, 2.0));
    moving(&mut d, shape(closed_box(0.8)), Affine3A::from_translation(Vec3::new(-1.5, 0.0, 2.5)), turned);
    if lamp_moves {
        moving(&mut d, lamp(2.0), along_x(-1.5), along_x(1.0));
    }
    d
}

#[test]
fn the_estimators_agree_where_things_move() {
    for lamp_moves in [false, true] {
        let means: Vec<(f64, f64)> = [Estimator::Mis, Estimator::LightOnly, Estimator::BsdfOnly]
            .map(|estimator| {
                let settings = RenderSettings { estimator, ..RenderSettings::default() };
                film_mean(&render(room(lamp_moves), settings, 2048))
            })
            .to_vec();
        for (mean, error) in &means[1..] {
            let error = error.hypot(means[0].1);
            assert!((mean - means[0].0).abs() < 4.0 * error, "lamp moves: {lamp_moves}, {means:?}");
            assert!(error < 0.02 * mean, "the test is too noisy: {means:?}");
        }
    }
}

fn bits(film: &Film) -> Vec<[u64; 3]> {
    film.map(|t, i| t.pixels[i].mean().to_array().map(f64::to_bits))
}

#[test]
fn what_does_not_move_renders_as_ever() {
    let mut still = room(false);
    still.instances[0].end = None;
    let first = bits(&render(still.clone(), RenderSettings::default(), 16));
    // Whatever the shutter does; and motion that is over when it opens.
    still.camera.shutter = [0.25, 3.0];
    assert_eq!(first, bits(&render(still.clone(), RenderSettings::default(), 16)));
    let start = still.instances[0].object_to_world;
    still.camera.shutter = [-2.0, -1.0];
    still.instances[0].end = Some(along_x(1.0) * start);
    assert_eq!(first, bits(&render(still.clone(), RenderSettings::default(), 16)));
    still.camera.shutter = [0.0, 1.0];
    assert_ne!(first, bits(&render(still, RenderSettings::default(), 16)));
}

#[test]
fn threads_crops_and_waves_do_not_matter() {
    let (size, options) = ([29, 21], FilmOptions::default());
    let picture = |threads: usize, crop: [u32; 4], waves: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut d = room(true);
            [d.film.width, d.film.height] = size;
            d.camera.end = Some(Mat4::from_rotation_y(0.1));
            let scene = Scene::build(d, BuildOptions { threads, robust: true }).expect("builds");
            assert!(scene.needs().contains(Needs::MOTION | Needs::CAMERA_MOTION));
            let mut film = Film::new(size, crop, options);
            let renderer = Renderer::new(&scene, RenderSettings::default(), options);
            for target in waves {
                renderer.run(&mut film, &Wave::default(), |_, _| *target);
            }
            pixels(&film)
        })
    };
    let full = picture(1, [0, 0, 29, 21], &[24]);
    assert_eq!(full, picture(3, [0, 0, 29, 21], &[8, 16, 24]));
    for (place, mean) in picture(2, [5, 3, 20, 17], &[16, 24]) {
        assert!(full.contains(&(place, mean)), "{place:?}");
    }
}
