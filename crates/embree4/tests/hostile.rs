//! Input that makes no sense must do no harm. Run under valgrind, these tests look for reads and writes out of bounds.

mod common;

use common::{device, scene_of, trace, translation};
use embree4::{
    Bounds, CurveBasis, CurveShape, Curves, Device, Discs, Instance, InstanceArray, OrientedDiscs, QuadMesh,
    Ray, Ray4, Ray8, Ray16, RayHit4, RayHit8, RayHit16, Scene, SceneBuilder, SceneFlags, Spheres,
    Subdivision, TriangleMesh, UserGeometry, UserHit, UserPrimitive, Valid4, Valid8, Valid16, VertexData,
};
use proptest::prelude::*;

const ODD: [f32; 12] = [
    0.0,
    -0.0,
    1.0,
    -0.7,
    1e-42,
    f32::MIN_POSITIVE,
    3e38,
    -3e38,
    1e19,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

/// A small generator, so that every run sees the same numbers.
struct Odd(u64);

impl Odd {
    fn next(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % below
    }

    /// Mostly sensible, sometimes odd.
    fn number(&mut self) -> f32 {
        match self.next(8) {
            0 => ODD[self.next(ODD.len())],
            n => (n as f32 - 4.0) * 0.37 + self.next(100) as f32 * 0.01,
        }
    }

    fn floats<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.number())
    }

    fn many<const N: usize>(&mut self, count: usize) -> Vec<[f32; N]> {
        (0..count).map(|_| self.floats()).collect()
    }

    fn ray(&mut self) -> Ray {
        let (org, dir) = (self.floats(), self.floats());
        let (tnear, tfar) = (self.number(), self.number() + 2.0);
        Ray { time: self.number(), flags: 0xFFFF_FFFF, ..Ray::segment(org, dir, tnear, tfar) }
    }
}

fn scaling(s: f32) -> [f32; 12] {
    [s, 0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, s, 1.0, 2.0, 3.0]
}

struct Anything;

impl UserPrimitive for Anything {
    fn bounds(&self, prim_id: u32, time_step: u32) -> Bounds {
        let mut odd = Odd(u64::from(prim_id * 7 + time_step));
        Bounds { lower: odd.floats(), upper: odd.floats() }
    }
    fn intersect(&self, prim_id: u32, _: &Ray) -> Option<UserHit> {
        let mut odd = Odd(u64::from(prim_id));
        Some(UserHit { t: odd.number(), ng: odd.floats(), u: odd.number(), v: odd.number() })
    }
}

/// All kinds of geometries with `steps` time steps, made of sensible and senseless numbers.
fn zoo(device: &Device, flags: SceneFlags, steps: usize, seed: u64) -> Scene {
    const N: usize = 24;
    let odd = &mut Odd(seed);
    let index = |odd: &mut Odd| odd.next(N) as u32;
    let mut builder = SceneBuilder::new(device).unwrap().flags(flags);
    macro_rules! later {
        ($n:literal) => {
            (1..steps).map(|_| odd.many::<$n>(N)).collect::<Vec<_>>()
        };
    }
    let triangles: Vec<[u32; 3]> = (0..20).map(|_| std::array::from_fn(|_| index(odd))).collect();
    builder.attach(TriangleMesh::new(odd.many(N), triangles).time_steps(later!(3))).unwrap();
    let quads: Vec<[u32; 4]> = (0..20).map(|_| std::array::from_fn(|_| index(odd))).collect();
    builder.attach(QuadMesh::new(odd.many(N), quads).time_steps(later!(3))).unwrap();
    builder.attach(Spheres::new(odd.many(N)).time_steps(later!(4))).unwrap();
    builder.attach(Discs::new(odd.many(N)).time_steps(later!(4))).unwrap();
    let mut discs = OrientedDiscs::new(odd.many(N), odd.many(N));
    for _ in 1..steps {
        discs = discs.time_step(odd.many(N), odd.many(N));
    }
    builder.attach(discs).unwrap();
    let starts: Vec<u32> = (0..10).map(|i| i * 2).collect();
    for basis in [CurveBasis::Linear, CurveBasis::Bezier, CurveBasis::BSpline, CurveBasis::CatmullRom] {
        for shape in [CurveShape::Round, CurveShape::Flat] {
            let curves = Curves::new(basis, shape, odd.many(N), starts.clone()).time_steps(later!(4));
            builder.attach(curves).unwrap();
        }
    }
    let hermite = Curves::hermite(CurveShape::Round, odd.many(N), odd.many(N), starts.clone());
    builder.attach(hermite.time_steps(later!(4)).tangent_steps(later!(4))).unwrap();
    let ribbons = Curves::normal_oriented(CurveBasis::BSpline, odd.many(N), odd.many(N), starts);
    builder.attach(ribbons.time_steps(later!(4)).normal_steps(later!(3))).unwrap();
    let (sizes, corners) = faces(odd, 12, N);
    let mesh = Subdivision::new(odd.many(N), sizes, corners).tessellation_rate(3.0);
    builder.attach(mesh.time_steps(later!(3))).unwrap();
    builder.attach(UserGeometry::new(30, Anything).time_step_count(steps)).unwrap();
    builder.commit().unwrap()
}

/// Faces of 3 to 15 corners at random vertices, in any order and as often as may be.
fn faces(odd: &mut Odd, count: usize, vertices: usize) -> (Vec<u32>, Vec<u32>) {
    let mut corners = Vec::new();
    let sizes = (0..count).map(|_| {
        let size = if odd.next(4) == 0 { 3 + odd.next(13) } else { 4 }.min(vertices);
        let mut face: Vec<u32> = Vec::new();
        while face.len() < size {
            let vertex = odd.next(vertices) as u32;
            if !face.contains(&vertex) {
                face.push(vertex);
            }
        }
        corners.extend(face);
        size as u32
    });
    (sizes.collect(), corners)
}

fn exercise(scene: &Scene, seed: u64, rays: usize) {
    let odd = &mut Odd(seed);
    for _ in 0..rays {
        trace(scene, odd.ray());
        scene.occluded(&mut odd.ray());
        let valid = odd.next(1 << 16);
        let lane = |lane| valid >> lane & 1 == 1;
        scene.intersect4(&Valid4::from_fn(lane), &mut RayHit4::new(Ray4::from_fn(|_| odd.ray())));
        scene.intersect8(&Valid8::from_fn(lane), &mut RayHit8::new(Ray8::from_fn(|_| odd.ray())));
        scene.intersect16(&Valid16::from_fn(lane), &mut RayHit16::new(Ray16::from_fn(|_| odd.ray())));
        scene.occluded4(&Valid4::from_fn(lane), &mut Ray4::from_fn(|_| odd.ray()));
        scene.occluded8(&Valid8::from_fn(lane), &mut Ray8::from_fn(|_| odd.ray()));
        scene.occluded16(&Valid16::from_fn(lane), &mut Ray16::from_fn(|_| odd.ray()));
        scene.point_query(odd.floats(), odd.number(), odd.number(), |candidate| {
            let radius = odd.number();
            candidate.shrink(radius);
        });
    }
    for id in scene.geometry_ids() {
        for prim_id in 0..scene.primitive_count(id).unwrap() {
            let (u, v) = (odd.number(), odd.number());
            let _ = scene.interpolate::<3>(id, prim_id, u, v, VertexData::Position(0));
            let _ = scene.interpolate_derivatives::<3>(id, prim_id, u, v, VertexData::Position(2));
        }
    }
    assert!(scene.take_panic().is_none());
}

#[test]
fn rays_of_nothing_but_nan_hit_nothing() {
    let device = device();
    let moving = TriangleMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]])
        .time_steps(vec![vec![[0.0; 3], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]; 4]);
    let scene = scene_of(&device, moving);
    let nan = Ray { time: f32::NAN, ..Ray::segment([f32::NAN; 3], [f32::NAN; 3], f32::NAN, f32::NAN) };
    assert!(!trace(&scene, nan).hit.is_hit());
    assert!(!scene.occluded(&mut { nan }));
    // Only the time is not a number: such a ray is traced at time 0.
    let ray = Ray::new([0.2, 0.2, -1.0], [0.0, 0.0, 1.0]).at_time(f32::NAN);
    assert!((trace(&scene, ray).ray.tfar - 1.0).abs() < 1e-6);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// All kinds of geometries, alone and in instances.
    #[test]
    fn odd_numbers_in_rays_and_vertices_do_no_harm(seed in any::<u64>(), steps in 1..5_usize, flags in 0..8_u32) {
        let device = device();
        let flags = SceneFlags::from_bits_truncate(flags);
        let scene = zoo(&device, flags, steps, seed);
        exercise(&scene, seed, 20);
        let mut builder = SceneBuilder::new(&device).unwrap().flags(flags);
        let places: Vec<[f32; 12]> =
            (0..5).map(|i| translation(i as f32, 0.0, 0.0).map(|x| x * (i as f32 - 2.0))).collect();
        builder.attach(Instance::new(&scene, translation(1e30, 0.0, 1.0))).unwrap();
        prop_assert!(builder.attach(Instance::new(&scene, [f32::MAX; 12])).is_err());
        prop_assert!(builder.attach(InstanceArray::new(&scene, places.clone())).is_err());
        let small: Vec<[f32; 12]> = [1.0, -1e-8, 1e-8, 1e8].iter().map(|&s| scaling(s)).collect();
        builder.attach(InstanceArray::new(&scene, small.clone()).time_steps([small])).unwrap();
        let triangles = TriangleMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        let triangles = scene_of(&device, triangles);
        builder.attach(Instance::new(&triangles, [f32::MAX; 12])).unwrap();
        builder.attach(Instance::new(&triangles, [0.0; 12])).unwrap();
        builder.attach(InstanceArray::new(&triangles, places.clone()).time_steps([places])).unwrap();
        exercise(&builder.commit().unwrap(), seed ^ 1, 10);
    }

    /// Meshes without any order: shared, repeated and lonely vertices, non-manifold edges, creases anywhere.
    #[test]
    fn subdivision_meshes_of_any_topology_do_no_harm(seed in any::<u64>(), vertices in 3..30_usize, count in 1..20_usize) {
        let odd = &mut Odd(seed);
        let (sizes, corners) = faces(odd, count, vertices);
        let points: Vec<[f32; 3]> = (0..vertices).map(|_| std::array::from_fn(|_| odd.next(100) as f32 * 0.02 - 1.0)).collect();
        let edges: Vec<[u32; 2]> = (0..6).map(|_| std::array::from_fn(|_| odd.next(vertices) as u32)).collect();
        let weights: Vec<f32> = (0..6).map(|_| [0.0, 0.5, 3.0, f32::INFINITY, -1.0, 1e30][odd.next(6)]).collect();
        let levels: Vec<f32> = corners.iter().map(|_| [0.0, 1.0, 2.0, 5.5, -4.0, 9.0][odd.next(6)]).collect();
        let sharp: Vec<u32> = (0..6).map(|_| odd.next(vertices) as u32).collect();
        let mesh = Subdivision::new(points, sizes, corners)
            .edge_levels(levels)
            .edge_creases(edges, weights.clone())
            .vertex_creases(sharp, weights)
            .holes(vec![odd.next(count) as u32]);
        let mut builder = SceneBuilder::new(&device()).unwrap();
        match builder.attach(mesh) {
            Ok(id) => {
                let scene = builder.commit().unwrap();
                exercise(&scene, seed, 4);
                prop_assert!(scene.interpolate::<3>(id, 0, 0.3, 0.6, VertexData::Position(0)).is_ok());
            }
            Err(embree4::Error::TooLarge { .. }) => {}
            Err(error) => prop_assert!(false, "{}", error),
        }
    }
}
