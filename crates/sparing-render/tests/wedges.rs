//! Paths into sharp wedges of closed meshes stay there.

mod common;

use common::{diffuse, scene_with, shape, wedge};
use embree4::{Ray, RayHit};
use glam::{EulerRot, Quat, Vec3};
use sparing_render::{BuildOptions, Needs, Scene};
use sparing_scene::description::Geometry;
use std::f32::consts::TAU;

/// Numbers from 0 to 1, by a hash of a counter.
struct Numbers(u32);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9);
        let h = (self.0 ^ self.0 >> 16).wrapping_mul(0x85eb_ca6b);
        let h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
        ((h ^ h >> 16) >> 8) as f32 / 16_777_216.0
    }

    /// A direction by the cosine around a normal; any for 0.
    fn around(&mut self, normal: Vec3) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let (sin, cos) = (TAU * self.next()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        (normal + Vec3::new(r * cos, r * sin, z)).normalize_or(Vec3::X)
    }
}

/// Rays of diffuse paths of 64 bounces that start within, and how many of these left. Every second ray is aimed at a face
/// from 3e-8 to 1 of its width off the sharp edge.
fn walks(degrees: f32, paths: u32, place: impl Fn(Vec3) -> Vec3) -> (u32, u32) {
    let Geometry::Triangles(mut mesh) = wedge(degrees) else { panic!("a mesh") };
    mesh.positions.iter_mut().for_each(|p| *p = place(Vec3::from(*p)).to_array());
    let mut d = scene_with(vec![diffuse(1.0)]);
    d.shapes = vec![shape(Geometry::Triangles(mesh))];
    let scene = Scene::build(d, BuildOptions::default()).expect("the scene builds");
    let edge = (place(Vec3::Y) - place(Vec3::ZERO)).normalize();
    let at = |part: f32, x: f32, y: f32| {
        let (sin, cos) = (part * degrees.to_radians()).sin_cos();
        place(Vec3::new(x * cos, y, x * sin))
    };
    let mut n = Numbers(degrees.to_bits());
    let (mut rays, mut out) = (0, 0);
    for _ in 0..paths {
        let mut origin = at(0.1 + 0.8 * n.next(), 0.05 + 0.6 * n.next(), n.next() - 0.5);
        let mut normal = Vec3::ZERO;
        for bounce in 0..64 {
            let mut w = n.around(normal);
            let aim = at(n.next().round(), 10_f32.powf(-7.5 * n.next()), 2.0 * n.next() - 1.0);
            let aimed = (aim - origin).normalize_or_zero();
            if bounce % 2 == 0 && (normal == Vec3::ZERO || aimed.dot(normal) > 1e-4) {
                w = aimed;
            }
            // Within a thousandth along the edge, Embree's own tests may miss both faces.
            if w.dot(edge).abs() > 1.0 - 1e-6 {
                continue;
            }
            let mut query = RayHit::new(Ray::new(origin.to_array(), w.to_array()));
            scene.embree().intersect(&mut query);
            rays += 1;
            let (hit, t) = (query.hit, query.ray.tfar);
            let hit = scene.hit(hit.geom_id, hit.inst_id[0], hit.prim_id, hit.u, hit.v);
            let point = hit.map(|h| scene.surface_point::<{ Needs::all().bits() }>(&h, origin, w, t, 0.0));
            // Out is what hits nothing, or the outer side of a face.
            let Some(point) = point.filter(|p| p.ng.dot(w) > 0.0) else {
                out += 1;
                break;
            };
            normal = -point.ng;
            origin = point.ray_origin(normal);
        }
    }
    (rays, out)
}

#[test]
fn paths_stay_in_sharp_wedges() {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.4, 1.1, -0.7);
    for degrees in [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 60.0, 90.0] {
        for scale in [1.0, 1e-3] {
            let (rays, out) = walks(degrees, 5_000, |p| (turn * p + Vec3::new(0.3, -0.2, 0.1)) * scale);
            assert!(rays > 300_000, "{rays} rays");
            assert_eq!(out, 0, "{degrees} degrees, scale {scale}: of {rays} rays");
        }
    }
}
