//! Smooth normals on coarse meshes make no black edges and let no light through.

mod common;

use common::{diffuse, render, scene_with, shape, square};
use glam::{Mat3, Mat4, Vec3};
use sparing_render::RenderSettings;
use sparing_scene::description::{Geometry, Light};
use sparing_scene::generate::{icosphere, smooth_normals};

/// A white ball of 80 triangles with smooth normals under light of radiance 1 from everywhere reflects nearly all
/// of it, silhouettes included.
#[test]
fn silhouettes_are_not_black() {
    let mut d = scene_with(vec![diffuse(1.0)]);
    (d.film.width, d.film.height) = (48, 48);
    let mut ball = icosphere(1);
    smooth_normals(&mut ball);
    assert_eq!(ball.indices.len(), 80);
    d.shapes = vec![shape(Geometry::Triangles(ball))];
    d.camera.camera_to_world = Mat4::from_translation(Vec3::Z * -1.6);
    d.lights = vec![Light::Environment { radiance: Vec3::ONE, image: None, light_to_world: Mat3::IDENTITY }];
    let film = render(d, RenderSettings { max_depth: 20, ..RenderSettings::default() }, 256);
    let darkest = film.beauty().iter().map(|p| p[0]).fold(f32::MAX, f32::min);
    let brightest = film.beauty().iter().map(|p| p[0]).fold(0.0, f32::max);
    // Light from below the facet but above the shading horizon is refused: at most a few tenths at the rim.
    assert!(darkest > 0.6, "{darkest}");
    assert!(brightest < 1.1, "{brightest}");
}

/// A wall whose vertex normals lean by up to 80 degrees, lit only from behind.
#[test]
fn no_light_leaks_through_a_wall() {
    let mut d = scene_with(vec![diffuse(1.0)]);
    let mut wall = square(Vec3::Z * 2.0, Vec3::Y * 50.0, Vec3::X * 50.0);
    if let Geometry::Triangles(m) = &mut wall {
        let lean = 80f32.to_radians();
        m.normals = Some([1.0, -1.0, 1.0, -1.0].map(|s: f32| [s * lean.sin(), 0.0, -lean.cos()]).to_vec());
    }
    d.shapes = vec![shape(wall)];
    d.lights = vec![
        Light::Point { position: Vec3::new(3.0, 1.0, 4.0), intensity: Vec3::splat(1e4) },
        Light::Distant { direction: Vec3::new(-0.6, 0.1, -0.8).normalize(), irradiance: Vec3::splat(10.0) },
    ];
    let film = render(d, RenderSettings::default(), 64);
    assert!(film.beauty().iter().all(|p| *p == [0.0; 3]));
}
