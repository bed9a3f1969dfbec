//! Filters, user geometries, progress and memory callbacks, and their panics.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

use common::{device, device_builder, round, scene_of, trace, translation, triangle, triangle_at, up};
use embree4::{
    Bounds, Error, ErrorCode, FilterHit, GeometryId, INVALID_ID, Instance, QuadMesh, QueryOptions, Ray, Ray4,
    Ray8, Ray16, RayHit, RayHit4, RayHit8, RayHit16, Scene, SceneBuilder, SceneFlags, TriangleMesh,
    UserGeometry, UserHit, UserPrimitive, Valid4, Valid8, Valid16,
};

fn message(payload: &(dyn std::any::Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or(payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("?")
}

/// Accepts hits with u below a half.
fn half(hit: &FilterHit<'_>) -> bool {
    hit.u() < 0.5
}

fn half_scene() -> Scene {
    let mut builder = SceneBuilder::new(&device()).unwrap();
    builder.attach(triangle().filter(half)).unwrap();
    builder.attach(triangle_at(2.0).occlusion_filter(|_| false)).unwrap();
    builder.commit().unwrap()
}

#[test]
fn filters_reject_hits_of_their_own_geometry_and_query_kind() {
    let scene = half_scene();
    assert_eq!(trace(&scene, up(0.25, 0.25)).ray.tfar, 1.0);
    let through = trace(&scene, up(0.75, 0.125));
    assert_eq!((through.ray.tfar, through.hit.geom_id), (2.0, 1));
    // The first geometry has no occlusion filter, the second lets everything pass.
    assert!(scene.occluded(&mut up(0.75, 0.125)));
    assert!(!scene.occluded(&mut Ray::segment([0.25, 0.25, 1.5], [0.0, 0.0, 1.0], 0.0, 9.0)));
}

#[test]
fn filters_see_the_hit_and_the_ray() {
    let device = device();
    let seen = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&seen);
    let inner = scene_of(
        &device,
        triangle().filter(move |hit| {
            count.fetch_add(1, Ordering::Relaxed);
            assert_eq!((hit.org(), hit.dir()), ([0.25, 0.5, 0.0], [0.0, 0.0, 1.0]));
            assert_eq!((hit.tnear(), round(hit.tfar()), hit.time()), (0.125, 1.0, 0.75));
            assert_eq!((round(hit.u()), round(hit.v()), hit.ng()), (0.25, 0.5, [0.0, 0.0, 1.0]));
            assert_eq!((hit.prim_id(), hit.geom_id(), hit.inst_id(), hit.inst_prim_id()), (0, 0, 3, 0));
            assert_eq!((hit.ray_id(), hit.ray_mask()), (77, 9));
            true
        }),
    );
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach_with_id(Instance::new(&inner, translation(5.0, 0.0, 0.0)), GeometryId(3)).unwrap();
    let scene = builder.commit().unwrap();
    let ray = Ray { id: 77, mask: 9, time: 0.75, tnear: 0.125, ..up(5.25, 0.5) };
    assert!(trace(&scene, ray).hit.is_hit());
    let mut packet = RayHit16::new(Ray16::from_fn(|_| ray));
    scene.intersect16(&Valid16::first(5), &mut packet);
    if let Some(payload) = scene.take_panic() {
        panic!("{}", message(&*payload));
    }
    assert!(seen.load(Ordering::Relaxed) >= 6);
}

macro_rules! packet_filters {
    ($name:ident, $n:literal, $Ray:ident, $RayHit:ident, $Valid:ident, $intersect:ident, $intersect_with:ident,
     $occluded:ident) => {
        #[test]
        fn $name() {
            let asked = Arc::new(AtomicU64::new(0));
            let note = Arc::clone(&asked);
            let filter = move |hit: &FilterHit<'_>| {
                note.fetch_or(1 << hit.ray_id(), Ordering::Relaxed);
                hit.ray_id() % 2 == 0
            };
            let scene = scene_of(&device(), triangle().filter(filter.clone()).occlusion_filter(filter));
            let rays = $Ray::from_fn(|lane| Ray { id: lane as u32, ..up(0.25, 0.25) });
            let valid = $Valid::from_fn(|lane| lane % 3 != 0);
            let expected: u64 = (0..$n).filter(|lane| lane % 3 != 0).map(|lane| 1 << lane).sum();
            let (mut query, mut shadow) = ($RayHit::new(rays), rays);
            scene.$intersect(&valid, &mut query);
            assert_eq!(asked.swap(0, Ordering::Relaxed), expected, "only valid lanes are asked about");
            scene.$occluded(&valid, &mut shadow);
            assert_eq!(asked.swap(0, Ordering::Relaxed), expected);
            let mut coherent = $RayHit::new(rays);
            scene.$intersect_with(&QueryOptions::COHERENT, &valid, &mut coherent);
            assert_eq!(asked.swap(0, Ordering::Relaxed), expected);
            for lane in 0..$n {
                let accepted = lane % 3 != 0 && lane % 2 == 0;
                assert_eq!(query.hit.get(lane).is_hit(), accepted, "lane {lane}");
                assert_eq!(coherent.hit.get(lane).is_hit(), accepted, "lane {lane}");
                assert_eq!(shadow.get(lane).is_occluded(), accepted, "lane {lane}");
                assert_eq!(round(query.ray.tfar[lane]), if accepted { 1.0 } else { f32::INFINITY });
            }
        }
    };
}
packet_filters!(filters_of_4, 4, Ray4, RayHit4, Valid4, intersect4, intersect4_with, occluded4);
packet_filters!(filters_of_8, 8, Ray8, RayHit8, Valid8, intersect8, intersect8_with, occluded8);
packet_filters!(filters_of_16, 16, Ray16, RayHit16, Valid16, intersect16, intersect16_with, occluded16);

#[test]
fn a_panic_in_a_filter_rejects_the_hit_and_waits_for_the_caller() {
    let device = device();
    let inner = scene_of(&device, triangle().filter(|_| panic!("filter says no")));
    let outer = scene_of(&device, Instance::new(&inner, embree4::IDENTITY));
    for scene in [&inner, &outer] {
        assert!(scene.take_panic().is_none());
        assert!(!trace(scene, up(0.25, 0.25)).hit.is_hit());
        scene.intersect16(&Valid16::ALL, &mut RayHit16::new(Ray16::from_fn(|_| up(0.25, 0.25))));
        let payload = scene.take_panic().expect("the panic was kept");
        assert_eq!(message(&*payload), "filter says no");
        assert!(scene.take_panic().is_none(), "only once");
    }
}

#[test]
fn query_filters_borrow_and_may_panic() {
    let mut builder = SceneBuilder::new(&device()).unwrap().flags(SceneFlags::QUERY_FILTER);
    for z in 1..=4 {
        builder.attach(triangle_at(z as f32)).unwrap();
    }
    let scene = builder.commit().unwrap();
    let options = QueryOptions::default();
    let mut seen = Vec::new();
    let mut query = RayHit::new(up(0.25, 0.25));
    scene.intersect_filtered(&options, &mut query, |hit| {
        seen.push(hit.geom_id());
        hit.geom_id() >= 2
    });
    assert_eq!((round(query.ray.tfar), query.hit.geom_id), (3.0, 2));
    assert!(seen.contains(&0) && seen.contains(&1));

    let mut count = 0;
    assert!(!scene.occluded_filtered(&options, &mut up(0.25, 0.25), |_| {
        count += 1;
        false
    }));
    assert_eq!(count, 4, "a transparency filter sees every surface once");

    let thrown = catch_unwind(AssertUnwindSafe(|| {
        scene.intersect_filtered(&options, &mut RayHit::new(up(0.25, 0.25)), |_| panic!("mine"));
    }));
    assert_eq!(message(&*thrown.unwrap_err()), "mine");
    assert!(scene.take_panic().is_none());
    let mut plain = RayHit::new(up(0.25, 0.25));
    scene.intersect(&mut plain);
    assert_eq!(plain.hit.geom_id, 0, "queries without a filter are not filtered");
}

/// Unit squares facing z at height `prim_id + 1`.
struct Squares {
    bounds_asked: AtomicU32,
    flushed: AtomicBool,
}

impl UserPrimitive for Squares {
    fn bounds(&self, prim_id: u32, _: u32) -> Bounds {
        self.bounds_asked.fetch_add(1, Ordering::Relaxed);
        if std::hint::black_box(1e-38_f32) * std::hint::black_box(0.5) == 0.0 {
            self.flushed.store(true, Ordering::Relaxed);
        }
        let z = prim_id as f32 + 1.0;
        Bounds { lower: [0.0, 0.0, z], upper: [1.0, 1.0, z] }
    }

    fn intersect(&self, prim_id: u32, ray: &Ray) -> Option<UserHit> {
        let t = (prim_id as f32 + 1.0 - ray.org[2]) / ray.dir[2];
        let [u, v] = [0, 1].map(|i| ray.org[i] + t * ray.dir[i]);
        let inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
        inside.then_some(UserHit { t, ng: [0.0, 0.0, -2.0], u, v })
    }
}

fn squares() -> Arc<Squares> {
    Arc::new(Squares { bounds_asked: AtomicU32::new(0), flushed: AtomicBool::new(false) })
}

#[test]
fn user_geometries_work_alone_in_packets_and_instanced() {
    let device = device();
    let state = squares();
    let inner = scene_of(&device, UserGeometry::new(3, Arc::clone(&state)));
    assert!(state.bounds_asked.load(Ordering::Relaxed) >= 3);
    assert!(!state.flushed.load(Ordering::Relaxed), "bounds must see denormal numbers");
    assert_eq!(inner.bounds().upper, [1.0, 1.0, 3.0]);
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach_with_id(UserGeometry::new(3, state), GeometryId(2)).unwrap();
    builder.attach_with_id(Instance::new(&inner, translation(2.0, 0.0, 0.0)), GeometryId(5)).unwrap();
    let scene = builder.commit().unwrap();

    let check = |ray: Ray, hit: embree4::Hit, x: f32| {
        let expected = (1.0, [0.0, 0.0, -2.0], 0.25, 0.75, 0);
        assert_eq!((ray.tfar, hit.ng, hit.u, hit.v, hit.prim_id), expected);
        let ids = if x > 2.0 { (0, 5, 0) } else { (2, INVALID_ID, INVALID_ID) };
        assert_eq!((hit.geom_id, hit.inst_id[0], hit.inst_prim_id[0]), ids);
    };
    for x in [0.25, 2.25] {
        let found = trace(&scene, up(x, 0.75));
        check(found.ray, found.hit, x);
        assert!(scene.occluded(&mut up(x, 0.75)));
        let rest = trace(&scene, Ray::segment([x, 0.75, 0.0], [0.0, 0.0, 1.0], 1.5, 9.0));
        assert_eq!((rest.ray.tfar, rest.hit.prim_id), (2.0, 1));
    }
    assert!(!scene.occluded(&mut up(1.5, 0.5)));

    let x = |lane: usize| [0.25, 2.25, 1.5][lane % 3];
    let rays = Ray16::from_fn(|lane| up(x(lane), 0.75));
    let valid = Valid16::from_fn(|lane| lane != 7);
    let (mut query, mut shadow) = (RayHit16::new(rays), rays);
    scene.intersect16(&valid, &mut query);
    scene.occluded16(&valid, &mut shadow);
    for lane in 0..16 {
        let expected = lane % 3 != 2 && lane != 7;
        assert_eq!(query.hit.get(lane).is_hit(), expected, "lane {lane}");
        assert_eq!(shadow.get(lane).is_occluded(), expected, "lane {lane}");
        if expected {
            check(query.ray.get(lane), query.hit.get(lane), x(lane));
        }
    }
}

#[test]
fn user_geometries_respect_filters_and_masks() {
    let geometry = UserGeometry::new(3, squares())
        .mask(2)
        .filter(|hit| hit.prim_id() == 1 && hit.tfar() == 2.0)
        .occlusion_filter(|hit| hit.prim_id() == 9);
    let scene = scene_of(&device(), geometry);
    assert_eq!(trace(&scene, up(0.5, 0.5)).hit.prim_id, 1);
    assert!(!scene.occluded(&mut up(0.5, 0.5)));
    assert!(!trace(&scene, up(0.5, 0.5).with_mask(1)).hit.is_hit());
}

/// Returns hits that lie elsewhere than on the ray, or not even at a number.
struct Liar(f32);

impl UserPrimitive for Liar {
    fn bounds(&self, _: u32, _: u32) -> Bounds {
        Bounds { lower: [0.0; 3], upper: [1.0; 3] }
    }
    fn intersect(&self, _: u32, _: &Ray) -> Option<UserHit> {
        Some(UserHit { t: self.0, ..UserHit::default() })
    }
}

#[test]
fn hits_off_the_segment_are_ignored() {
    for t in [-1.0, 5.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let scene = scene_of(&device(), UserGeometry::new(1, Liar(t)));
        let found = trace(&scene, Ray::segment([0.5, 0.5, -0.5], [0.0, 0.0, 1.0], 0.0, 4.0));
        assert!(!found.hit.is_hit(), "{t}");
        assert_eq!(found.ray.tfar, 4.0);
    }
    let honest = scene_of(&device(), UserGeometry::new(1, Liar(0.75)));
    assert_eq!(trace(&honest, Ray::new([0.5, 0.5, -0.5], [0.0, 0.0, 1.0])).ray.tfar, 0.75);
}

struct Panics {
    in_bounds: bool,
}

impl UserPrimitive for Panics {
    fn bounds(&self, _: u32, _: u32) -> Bounds {
        assert!(!self.in_bounds, "no bounds");
        Bounds { lower: [0.0; 3], upper: [1.0; 3] }
    }
    fn intersect(&self, _: u32, _: &Ray) -> Option<UserHit> {
        panic!("no hit")
    }
}

#[test]
fn panics_of_user_geometries_surface_where_documented() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(UserGeometry::new(100, Panics { in_bounds: true })).unwrap();
    let thrown = catch_unwind(AssertUnwindSafe(|| builder.commit()));
    assert_eq!(message(&*thrown.unwrap_err()), "no bounds");

    let scene = scene_of(&device, UserGeometry::new(1, Panics { in_bounds: false }));
    assert!(!trace(&scene, Ray::new([0.5, 0.5, -1.0], [0.0, 0.0, 1.0])).hit.is_hit());
    assert_eq!(message(&*scene.take_panic().unwrap()), "no hit");
    assert!(!scene.occluded(&mut Ray::new([0.5, 0.5, -1.0], [0.0, 0.0, 1.0])));
    assert_eq!(message(&*scene.take_panic().unwrap()), "no hit");
}

/// Enough triangles for a build that reports progress and takes some memory.
fn many_triangles() -> TriangleMesh {
    let side = 200_u32;
    let points: Vec<_> =
        (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, (i * 7919 % 13) as f32]).collect();
    let indices: Vec<_> = (0..side * (side - 1) - 1).map(|i| [i, i + 1, i + side]).collect();
    TriangleMesh::new(points, indices)
}

#[test]
fn progress_is_reported_and_can_cancel() {
    let device = device();
    let build = |progress: Box<dyn Fn(f64) -> bool + Send + Sync>| {
        let mut builder = SceneBuilder::new(&device).unwrap().progress(progress);
        builder.attach(many_triangles()).unwrap();
        builder.commit()
    };
    let calls = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&calls);
    let scene = build(Box::new(move |done| {
        assert!((0.0..=1.0).contains(&done));
        count.fetch_add(1, Ordering::Relaxed);
        true
    }));
    assert!(scene.is_ok() && calls.load(Ordering::Relaxed) > 0);
    assert_eq!(Arc::strong_count(&calls), 1, "the closure goes with the commit");

    let cancelled = build(Box::new(|_| false)).unwrap_err();
    assert_eq!(cancelled.code(), Some(ErrorCode::Cancelled), "{cancelled}");

    let thrown = catch_unwind(AssertUnwindSafe(|| build(Box::new(|_| panic!("enough")))));
    assert_eq!(message(&*thrown.unwrap_err()), "enough");
    assert!(build(Box::new(|_| true)).is_ok(), "the device survives all that");
}

#[test]
fn memory_is_counted_and_given_back() {
    let events = Arc::new(AtomicU64::new(0));
    let count = Arc::clone(&events);
    let device = device_builder()
        .set_memory_monitor(move |event| {
            assert_ne!(event.bytes, 0);
            count.fetch_add(1, Ordering::Relaxed);
            true
        })
        .build()
        .unwrap();
    let before = device.memory_bytes();
    let scene = scene_of(&device, many_triangles());
    let during = device.memory_bytes();
    assert!(during > before + 100_000, "{before} to {during} bytes for 40,000 triangles");
    assert!(device.peak_memory_bytes() >= during);
    drop(scene);
    assert!(device.memory_bytes() < before + 100_000, "{} bytes are left", device.memory_bytes());
    assert!(events.load(Ordering::Relaxed) > 0);
    if let Some(payload) = device.take_panic() {
        panic!("{}", message(&*payload));
    }
    drop(device);
    assert_eq!(Arc::strong_count(&events), 1, "the monitor goes with the device");
}

#[test]
fn the_memory_monitor_can_refuse() {
    let limit = 1 << 20;
    let used = Arc::new(std::sync::atomic::AtomicI64::new(0));
    let device = device_builder()
        .set_memory_monitor(move |event| {
            used.fetch_add(event.bytes, Ordering::Relaxed) + event.bytes < limit || event.bytes < 0
        })
        .build()
        .unwrap();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(many_triangles()).unwrap();
    let error = builder.commit().unwrap_err();
    assert_eq!(error.code(), Some(ErrorCode::OutOfMemory), "{error}");
    assert!(matches!(error, Error::Embree { ref message, .. } if !message.is_empty()));
    // A thousand million primitives do not fit either, and nothing is allocated for them.
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(UserGeometry::new(1 << 30, squares())).unwrap();
    assert_eq!(builder.commit().unwrap_err().code(), Some(ErrorCode::OutOfMemory));
}

#[test]
fn a_panic_in_the_memory_monitor_refuses_and_waits() {
    let device = device_builder().set_memory_monitor(|_| panic!("no memory today")).build().unwrap();
    let mut builder = SceneBuilder::new(&device).unwrap();
    let attached = builder.attach(QuadMesh::new(vec![[0.0; 3]; 4], vec![[0, 1, 2, 3]; 5000]));
    let result = attached.and_then(|_| builder.commit());
    assert_eq!(result.unwrap_err().code(), Some(ErrorCode::OutOfMemory));
    assert_eq!(message(&*device.take_panic().unwrap()), "no memory today");
}
