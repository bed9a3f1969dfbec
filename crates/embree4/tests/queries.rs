//! Single rays and packets: values, masks, canaries behind the structures that Embree writes.

mod common;

use common::{device, round, scene_of, trace, translation, triangle, triangle_at, up};
use embree4::{
    FeatureMask, GeometryId, INVALID_ID, Instance, QueryOptions, Ray, Ray4, Ray8, Ray16, RayHit, RayHit4,
    RayHit8, RayHit16, Scene, SceneBuilder, Valid4, Valid8, Valid16,
};

/// Two triangles by themselves (id 0 at z = 1, id 7 at z = 3) and an instance of one (id 3, moved to x = 2).
fn mixed_scene() -> Scene {
    let device = device();
    let inner = scene_of(&device, triangle());
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach_with_id(triangle(), GeometryId(0)).unwrap();
    builder.attach_with_id(triangle_at(3.0), GeometryId(7)).unwrap();
    builder.attach_with_id(Instance::new(&inner, translation(2.0, 0.0, 0.5)), GeometryId(3)).unwrap();
    builder.commit().unwrap()
}

#[test]
fn a_single_ray_reports_where_and_what_it_hit() {
    let scene = mixed_scene();
    let found = trace(&scene, up(0.25, 0.5));
    assert_eq!(found.ray.tfar, 1.0);
    assert_eq!((found.hit.u, found.hit.v), (0.25, 0.5));
    assert_eq!(found.hit.ng, [0.0, 0.0, 1.0]);
    assert_eq!((found.hit.geom_id, found.hit.prim_id, found.hit.inst_id), (0, 0, [INVALID_ID]));
    assert_eq!((found.hit.geometry(), found.hit.instance()), (Some(GeometryId(0)), None));

    let beyond = trace(&scene, Ray::segment([0.25, 0.5, 0.0], [0.0, 0.0, 1.0], 1.5, 10.0));
    assert_eq!((beyond.ray.tfar, beyond.hit.geom_id), (3.0, 7));

    let instanced = trace(&scene, up(2.25, 0.25));
    assert_eq!((instanced.ray.tfar, instanced.hit.geom_id), (1.5, 0));
    assert_eq!((instanced.hit.inst_id, instanced.hit.inst_prim_id), ([3], [0]));
    assert_eq!(instanced.hit.instance(), Some(GeometryId(3)));

    let miss = trace(&scene, up(-1.0, 0.0));
    assert_eq!((miss.ray.tfar, miss.hit), (f32::INFINITY, embree4::Hit::NONE));
}

#[test]
fn occlusion_marks_the_ray_and_respects_the_segment() {
    let scene = mixed_scene();
    let mut ray = up(0.25, 0.5);
    assert!(scene.occluded(&mut ray));
    assert_eq!(ray.tfar, f32::NEG_INFINITY);
    let mut short = Ray::segment([0.25, 0.5, 0.0], [0.0, 0.0, 1.0], 0.0, 0.9);
    assert!(!scene.occluded(&mut short));
    assert_eq!(short.tfar, 0.9);
    let options = QueryOptions { feature_mask: scene.features(), ..QueryOptions::COHERENT };
    assert!(scene.occluded_with(&options, &mut up(0.25, 0.5)));
    assert!(!scene.occluded_with(&options, &mut up(-0.25, 0.5)));
}

#[test]
fn masks_choose_what_rays_see() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(triangle().mask(0b01)).unwrap();
    builder.attach(triangle_at(2.0).mask(0x8000_0002)).unwrap();
    builder.attach(triangle_at(4.0)).unwrap();
    let scene = builder.commit().unwrap();
    assert!(scene.features().contains(FeatureMask::WIDE_RAY_MASK));
    let seen = |mask| trace(&scene, up(0.2, 0.2).with_mask(mask)).hit.geom_id;
    assert_eq!((seen(u32::MAX), seen(1), seen(2), seen(0x8000_0000)), (0, 0, 1, 1));
    assert_eq!((seen(4), seen(0)), (INVALID_ID, INVALID_ID));
    let mut builder = scene.try_into_builder().unwrap();
    builder.set_mask(GeometryId(0), 4).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(trace(&scene, up(0.2, 0.2).with_mask(1)).hit.geom_id, 2, "the default mask is 1");
    assert_eq!(trace(&scene, up(0.2, 0.2).with_mask(4)).hit.geom_id, 0);
}

const CANARY: u64 = 0x5AFE_C0DE_5AFE_C0DE;

/// A structure that Embree writes, with room behind it that it must not touch.
#[repr(C)]
struct Guarded<T> {
    before: [u64; 8],
    value: T,
    after: [u64; 32],
}

impl<T> Guarded<T> {
    fn new(value: T) -> Self {
        Self { before: [CANARY; 8], value, after: [CANARY; 32] }
    }

    #[track_caller]
    fn check(&self) {
        assert_eq!(self.before, [CANARY; 8], "bytes before the structure were written");
        assert_eq!(self.after, [CANARY; 32], "bytes behind the structure were written");
    }
}

#[test]
fn nothing_is_written_behind_single_rays() {
    let scene = mixed_scene();
    for (ray, instance) in [(up(0.2, 0.2), INVALID_ID), (up(2.2, 0.2), 3)] {
        for options in [QueryOptions::COHERENT, QueryOptions::INCOHERENT] {
            let mut query = Guarded::new(RayHit::new(ray));
            scene.intersect_with(&options, &mut query.value);
            query.check();
            assert!(query.value.hit.is_hit());
            assert_eq!(query.value.hit.inst_id, [instance]);
            let mut shadow = Guarded::new(ray);
            assert!(scene.occluded_with(&options, &mut shadow.value));
            shadow.check();
        }
    }
}

macro_rules! packet_tests {
    ($name:ident, $n:literal, $Ray:ident, $RayHit:ident, $Valid:ident, $intersect:ident, $intersect_with:ident,
     $occluded:ident, $occluded_with:ident) => {
        #[test]
        fn $name() {
            let scene = mixed_scene();
            // Lanes alternate between the plain triangle, the instance and nothing; every fifth is switched off.
            let x = |lane: usize| [0.2, 2.2, -3.0][lane % 3];
            let rays = $Ray::from_fn(|lane| Ray { id: lane as u32, ..up(x(lane), 0.25) });
            let valid = $Valid::from_fn(|lane| lane % 5 != 4);
            for options in [None, Some(QueryOptions::COHERENT), Some(QueryOptions::INCOHERENT)] {
                let mut query = Guarded::new($RayHit::new(rays));
                let mut shadow = Guarded::new(rays);
                match options {
                    None => {
                        scene.$intersect(&valid, &mut query.value);
                        scene.$occluded(&valid, &mut shadow.value);
                    }
                    Some(options) => {
                        scene.$intersect_with(&options, &valid, &mut query.value);
                        scene.$occluded_with(&options, &valid, &mut shadow.value);
                    }
                }
                query.check();
                shadow.check();
                for lane in 0..$n {
                    let before = rays.get(lane);
                    let (ray, hit) = (query.value.ray.get(lane), query.value.hit.get(lane));
                    if !valid.get(lane) {
                        assert_eq!((ray, hit), (before, embree4::Hit::NONE), "lane {lane} is off");
                        assert_eq!(shadow.value.get(lane), before);
                        continue;
                    }
                    let single = trace(&scene, before);
                    assert_eq!(Ray { tfar: round(ray.tfar), ..ray }, single.ray, "lane {lane}");
                    assert_eq!(hit.is_hit(), lane % 3 != 2, "lane {lane}");
                    assert_eq!(
                        (hit.geom_id, hit.prim_id, hit.inst_id, hit.inst_prim_id, hit.ng),
                        (
                            single.hit.geom_id,
                            single.hit.prim_id,
                            single.hit.inst_id,
                            single.hit.inst_prim_id,
                            single.hit.ng
                        ),
                    );
                    assert_eq!(shadow.value.get(lane).is_occluded(), lane % 3 != 2, "lane {lane}");
                }
            }
        }
    };
}

packet_tests!(packets_of_4, 4, Ray4, RayHit4, Valid4, intersect4, intersect4_with, occluded4, occluded4_with);
packet_tests!(packets_of_8, 8, Ray8, RayHit8, Valid8, intersect8, intersect8_with, occluded8, occluded8_with);
packet_tests!(
    packets_of_16,
    16,
    Ray16,
    RayHit16,
    Valid16,
    intersect16,
    intersect16_with,
    occluded16,
    occluded16_with
);

#[test]
fn the_mask_types_say_what_they_were_told() {
    let mut valid = Valid8::first(3);
    assert_eq!((0..8).filter(|&i| valid.get(i)).count(), 3);
    valid.set(0, false);
    valid.set(7, true);
    assert_eq!(valid, Valid8::from_fn(|i| matches!(i, 1 | 2 | 7)));
    assert_eq!(Valid16::first(99), Valid16::ALL);
}

#[test]
fn an_empty_scene_hits_nothing() {
    let scene = SceneBuilder::new(&device()).unwrap().commit().unwrap();
    assert!(!trace(&scene, up(0.0, 0.0)).hit.is_hit());
    assert!(!scene.occluded(&mut up(0.0, 0.0)));
    assert!(scene.bounds().is_empty());
}
