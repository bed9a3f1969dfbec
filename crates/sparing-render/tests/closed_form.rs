//! Direct light against closed forms, agreement of the estimators, and self-intersection at all scales.

mod common;

use common::{closed_box, diffuse, emitter, film_mean, render, scene_with, shape, square};
use glam::{Mat4, Vec3};
use sparing_render::RenderSettings;
use sparing_render::integrator::Estimator;
use sparing_scene::SceneDescription;
use sparing_scene::description::{
    ColorInput, Conductor, FloatInput, Geometry, Light, MaterialKind, Projection, Roughness, SamplerKind,
    SpotEdge,
};

/// An orthographic camera that looks straight down at the origin and sees next to nothing else.
fn look_down(d: &mut SceneDescription, height: f32, window: f32) {
    d.camera.projection = Projection::Orthographic;
    d.camera.screen_window = Some([-window, window, -window, window]);
    // Camera z is world -y.
    d.camera.camera_to_world = Mat4::from_cols(
        Vec3::X.extend(0.0),
        Vec3::Z.extend(0.0),
        Vec3::NEG_Y.extend(0.0),
        Vec3::new(0.0, height, 0.0).extend(1.0),
    );
}

fn floor(scale: f32) -> Geometry {
    square(Vec3::ZERO, Vec3::Z * 5.0 * scale, Vec3::X * 5.0 * scale)
}

fn direct(estimator: Estimator) -> RenderSettings {
    RenderSettings { max_depth: 1, estimator, ..RenderSettings::default() }
}

const ESTIMATORS: [Estimator; 3] = [Estimator::Mis, Estimator::LightOnly, Estimator::BsdfOnly];

/// A disk of radius r at height h above a point, parallel to its surface, gives irradiance
/// pi L r² / (r² + h²); an albedo of a sends back a / pi of it.
#[test]
fn disk_light() {
    let (r, h, radiance, albedo) = (0.7f32, 1.5f32, 3.0f32, 0.5f32);
    for estimator in ESTIMATORS {
        let mut d = scene_with(vec![diffuse(albedo)]);
        look_down(&mut d, 0.5, 1e-3);
        let disk = Geometry::Disk { center: Vec3::Y * h, normal: Vec3::NEG_Y, tangent: Vec3::X, radius: r };
        d.shapes = vec![shape(floor(1.0)), emitter(disk, radiance)];
        let (mean, error) = film_mean(&render(d, direct(estimator), 1024));
        let expected = f64::from(albedo * radiance * r * r / (r * r + h * h));
        assert!(
            (mean - expected).abs() < 4.0 * error + 2e-4 * expected,
            "{estimator:?}: {mean} +- {error}, {expected}"
        );
    }
}

/// A sphere of radius r whose centre is at distance c straight above: E = pi L (r / c)².
#[test]
fn sphere_light() {
    let (r, c, radiance, albedo) = (0.5f32, 2.0f32, 3.0f32, 0.8f32);
    for estimator in ESTIMATORS {
        let mut d = scene_with(vec![diffuse(albedo)]);
        look_down(&mut d, 0.5, 1e-3);
        let sphere = Geometry::Sphere { center: Vec3::Y * c, radius: r, axes: [Vec3::X, Vec3::Y, Vec3::Z] };
        d.shapes = vec![shape(floor(1.0)), emitter(sphere, radiance)];
        let (mean, error) = film_mean(&render(d, direct(estimator), 1024));
        let expected = f64::from(albedo * radiance * (r / c).powi(2));
        assert!(
            (mean - expected).abs() < 4.0 * error + 2e-4 * expected,
            "{estimator:?}: {mean} +- {error}, {expected}"
        );
    }
}

/// Point, spot, distant and constant environment light on a floor seen from above.
#[test]
fn other_lights() {
    let albedo = 0.6f32;
    let pi = std::f32::consts::PI;
    let one = Vec3::ONE;
    let cases = [
        ("point", Light::Point { position: Vec3::Y * 2.0, intensity: one * 8.0 }, albedo / pi * 2.0),
        (
            "spot",
            Light::Spot {
                position: Vec3::Y * 2.0,
                direction: Vec3::NEG_Y,
                intensity: one * 8.0,
                cone_angle: 30.0,
                cone_delta: 5.0,
                edge: SpotEdge::Smooth,
            },
            albedo / pi * 2.0,
        ),
        (
            "distant",
            Light::Distant { direction: Vec3::new(1.0, -1.0, 0.0).normalize(), irradiance: one * 3.0 },
            albedo / pi * 3.0 / 2f32.sqrt(),
        ),
        (
            "constant",
            Light::Environment { radiance: one * 2.0, image: None, light_to_world: glam::Mat3::IDENTITY },
            albedo * 2.0,
        ),
    ];
    for (name, light, expected) in cases {
        let mut d = scene_with(vec![diffuse(albedo)]);
        look_down(&mut d, 0.5, 1e-3);
        d.shapes = vec![shape(floor(1.0))];
        d.lights = vec![light];
        let (mean, error) = film_mean(&render(d, direct(Estimator::Mis), 256));
        let expected = f64::from(expected);
        assert!(
            (mean - expected).abs() < 4.0 * error + 3e-4 * expected,
            "{name}: {mean} +- {error}, {expected}"
        );
    }
}

/// A small bright and a large dim light over a glossy floor: each estimator is good at one of them, all agree
/// (Welch's t-test on the mean of the picture, independent samples, level 1e-6).
#[test]
fn estimators_agree_on_small_bright_and_large_dim_lights() {
    let glossy = MaterialKind::Conductor {
        conductor: Conductor::Reflectance(ColorInput::Constant(Vec3::splat(0.7))),
        roughness: Roughness { u: FloatInput::Constant(0.2), v: FloatInput::Constant(0.2), remap: false },
    };
    let results: Vec<(f64, f64)> = ESTIMATORS
        .iter()
        .enumerate()
        .map(|(seed, estimator)| {
            let mut d = scene_with(vec![glossy.clone()]);
            look_down(&mut d, 1.0, 1.0);
            let small = Geometry::Sphere {
                center: Vec3::new(-1.0, 2.0, 0.0),
                radius: 0.05,
                axes: [Vec3::X, Vec3::Y, Vec3::Z],
            };
            let large = square(Vec3::new(1.0, 3.0, 0.0), Vec3::X * 1.5, Vec3::Z * 1.5);
            d.shapes = vec![shape(floor(1.0)), emitter(small, 400.0), emitter(large, 1.0)];
            let settings = RenderSettings {
                max_depth: 2,
                estimator: *estimator,
                sampler: SamplerKind::Independent,
                seed: seed as u64,
                ..RenderSettings::default()
            };
            film_mean(&render(d, settings, 16_384))
        })
        .collect();
    for (i, a) in results.iter().enumerate() {
        for b in &results[..i] {
            let t = (a.0 - b.0) / (a.1 * a.1 + b.1 * b.1).sqrt();
            assert!(testkit::special::normal_two_sided(t) > 1e-6, "{results:?}: t = {t}");
        }
    }
    // MIS must be the best of the three by far, or its weights are wrong.
    assert!(results[0].1 < 0.7 * results[2].1, "{results:?}");
}

/// A closed white box with a lamp inside, scaled: self-intersections would darken it, leaks brighten nothing.
#[test]
fn the_same_picture_at_every_scale() {
    let at = |scale: f32, shift: Vec3| {
        let mut d = scene_with(vec![diffuse(0.7)]);
        let place = |g: Geometry| match g {
            Geometry::Triangles(mut m) => {
                m.positions.iter_mut().for_each(|p| *p = (Vec3::from(*p) * scale + shift).to_array());
                Geometry::Triangles(m)
            }
            Geometry::Sphere { center, radius, axes } => {
                Geometry::Sphere { center: center * scale + shift, radius: radius * scale, axes }
            }
            other => other,
        };
        let mut room = shape(place(closed_box(2.0)));
        room.reverse_orientation = true;
        let ball = Geometry::Sphere {
            center: Vec3::new(0.3, -0.8, 1.0),
            radius: 0.6,
            axes: [Vec3::X, Vec3::Y, Vec3::Z],
        };
        let lamp = square(Vec3::new(0.0, 1.9, 0.0), Vec3::X * 0.5, Vec3::Z * 0.5);
        d.shapes = vec![room, shape(place(ball)), emitter(place(lamp), 5.0)];
        d.camera.camera_to_world = Mat4::from_translation(shift)
            * Mat4::from_scale(Vec3::splat(scale))
            * Mat4::from_translation(Vec3::Z * -1.5);
        let settings = RenderSettings { max_depth: 6, ..RenderSettings::default() };
        film_mean(&render(d, settings, 256)).0
    };
    let reference = at(1.0, Vec3::ZERO);
    for scale in [1e-4, 1e-2, 1e3, 1e6] {
        let mean = at(scale, Vec3::ZERO);
        assert!((mean / reference - 1.0).abs() < 2e-3, "scale {scale}: {mean} {reference}");
    }
    // Far from the origin coordinates have fewer digits: 1e4 sizes away, an ulp is 1/4096 of the box, and points are kept up to
    // a sixteenth of the box off its edges.
    let mean = at(1.0, Vec3::new(1e4, -1e4, 1e4));
    assert!((mean / reference - 1.0).abs() < 3e-2, "shifted: {mean} {reference}");
}
