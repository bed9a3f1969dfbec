//! Rays that start at the edges and corners of closed meshes do not leave them.

mod common;

use common::{closed_box, diffuse, quad_box, scene_with, shape, wedge};
use embree4::{Ray, RayHit};
use glam::{Affine3A, Mat4, Quat, Vec3};
use sparing_render::scene::surface::SurfaceHit;
use sparing_render::{BuildOptions, Needs, Scene};
use sparing_scene::description::{Geometry, Instance, ObjectDefinition};
use sparing_scene::generate::icosphere;

/// Directions all around, by the golden angle.
fn directions(n: u32) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f32 / n as f32;
        let (sin, cos) = (k as f32 * 2.399_963).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z)
    })
}

/// Embree's coordinates on and near the edges and corners.
fn places() -> Vec<[f32; 2]> {
    let along = [0.0, 1e-9, 1e-7, 1e-3, 0.3, 0.5, 0.7, 0.999, 1.0 - 6e-8, 1.0];
    let off = [-1e-8, 0.0, 1e-9, 6e-8, 1e-6];
    let mut places = Vec::new();
    for t in along {
        for o in off {
            places.extend([[t, o], [o, t], [t - o, 1.0 - t]]);
        }
    }
    places
}

/// Rays that leave, of all that start at the inner side of edges.
fn leaks(geometry: Geometry, to_world: Option<Mat4>) -> (u32, u32) {
    let mut d = scene_with(vec![diffuse(1.0)]);
    let faces = match &geometry {
        Geometry::Triangles(m) => m.indices.len(),
        Geometry::Quads(m) => m.indices.len(),
        _ => 0,
    };
    match to_world {
        None => d.shapes = vec![shape(geometry)],
        Some(transform) => {
            d.objects = vec![ObjectDefinition { name: String::new(), shapes: vec![shape(geometry)] }];
            d.instances =
                vec![Instance { object: 0, object_to_world: Affine3A::from_mat4(transform), end: None }];
        }
    }
    let scene = Scene::build(d, BuildOptions::default()).expect("the scene builds");
    let instance = to_world.map(|_| 0);
    let (mut rays, mut out) = (0, 0);
    for face in 0..faces as u32 {
        for [u, v] in places() {
            let hit = SurfaceHit { shape: 0, instance, face, u, v };
            let point = scene.surface_point::<{ Needs::all().bits() }>(&hit, Vec3::ZERO, Vec3::Z, 1.0, 0.0);
            for w in directions(40).filter(|w| w.dot(point.ng) < -1e-3) {
                let mut query = RayHit::new(Ray::new(point.ray_origin(w).to_array(), w.to_array()));
                scene.embree().intersect(&mut query);
                rays += 1;
                out += u32::from(query.hit.geom_id == embree4::INVALID_ID);
            }
        }
    }
    (rays, out)
}

fn triangles(geometry: Geometry, change: impl Fn(Vec3) -> Vec3) -> Geometry {
    let Geometry::Triangles(mut mesh) = geometry else { return geometry };
    for p in &mut mesh.positions {
        *p = change(Vec3::from(*p)).to_array();
    }
    Geometry::Triangles(mesh)
}

#[test]
fn nothing_leaves_a_closed_mesh() {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.7);
    let thin = |p: Vec3| Vec3::new(p.x, p.y * 0.01, p.z * 0.1);
    let cases = [
        ("box", closed_box(1.0)),
        ("small box", closed_box(1e-5)),
        ("turned box", triangles(closed_box(1.0), |p| turn * p)),
        ("thin box", triangles(closed_box(1.0), |p| turn * thin(p))),
        ("box elsewhere", triangles(closed_box(1.0), |p| turn * p + Vec3::new(300.0, -70.0, 5.0))),
        ("box of quads", quad_box(1.0)),
        ("ball", Geometry::Triangles(icosphere(3))),
        ("wedge of 90 degrees", triangles(wedge(90.0), |p| turn * p)),
        ("wedge of 30 degrees", triangles(wedge(30.0), |p| turn * p)),
    ];
    for (name, geometry) in cases {
        let (rays, out) = leaks(geometry, None);
        assert!(rays > 10_000, "{name}: {rays} rays");
        assert_eq!(out, 0, "{name}: of {rays} rays");
    }
}

#[test]
fn nothing_leaves_a_placed_closed_mesh() {
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -0.7);
    for (scale, translation) in [(1.0, [0.0; 3]), (3.0, [10.0, -200.0, 1.0]), (1e-3, [0.0, 1.0, 0.0])] {
        let placed = Mat4::from_scale_rotation_translation(Vec3::splat(scale), turn, translation.into());
        let (rays, out) = leaks(closed_box(1.0), Some(placed));
        assert!(rays > 10_000, "{rays} rays");
        assert_eq!(out, 0, "scale {scale} at {translation:?}: of {rays} rays");
    }
}
