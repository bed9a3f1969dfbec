//! Objects may be dropped in any order, on any thread, and used from many.

mod common;

use std::sync::Arc;
use std::thread;

use common::{device, device_builder, scene_of, trace, translation, triangle, triangle_at, up};
use embree4::{
    Bounds, Device, GeometryId, IDENTITY, Instance, Ray, Scene, SceneBuilder, SceneFlags, SharedBuffer,
    TriangleMesh, UserGeometry, UserHit, UserPrimitive, VertexData,
};

#[test]
fn everything_is_send_and_sync() {
    fn shared<T: Send + Sync + Clone>() {}
    fn sent<T: Send>() {}
    shared::<Device>();
    shared::<Scene>();
    shared::<SharedBuffer<[f32; 3]>>();
    sent::<SceneBuilder>();
    sent::<TriangleMesh>();
    sent::<Instance>();
    sent::<embree4::Error>();
}

#[test]
fn a_scene_outlives_its_device_and_its_buffers() {
    // Compact scenes read the shared buffers while tracing.
    for flags in [SceneFlags::empty(), SceneFlags::COMPACT, SceneFlags::ROBUST | SceneFlags::COMPACT] {
        let scene = {
            let device = device();
            let vertices: SharedBuffer<[f32; 3]> = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]].into();
            let indices = SharedBuffer::from(vec![[0, 1, 2]]);
            let mut builder = SceneBuilder::new(&device).unwrap().flags(flags);
            builder.attach(TriangleMesh::new(vertices.clone(), indices)).unwrap();
            drop(device);
            let scene = builder.commit().unwrap();
            drop(vertices);
            scene
        };
        assert_eq!(trace(&scene, up(0.25, 0.25)).ray.tfar, 1.0);
        let position = scene.interpolate(GeometryId(0), 0, 0.25, 0.25, VertexData::Position(0));
        assert_eq!(position, Ok([0.25, 0.25, 1.0]));
        assert_eq!(scene.device().version().0, 4);
    }
}

#[test]
fn an_instanced_scene_may_be_dropped_before_the_one_around_it() {
    let kept_by_filter = Arc::new(());
    let witness = Arc::clone(&kept_by_filter);
    let outer = {
        let device = device();
        let inner = scene_of(
            &device,
            triangle().filter(move |_| {
                let _ = &witness;
                true
            }),
        );
        let outer = scene_of(&device, Instance::new(&inner, translation(0.0, 0.0, 1.0)));
        assert!(inner.clone().try_into_builder().is_err(), "an instanced scene cannot be edited");
        drop((inner, device));
        outer
    };
    assert_eq!(trace(&outer, up(0.25, 0.25)).ray.tfar, 2.0);
    assert_eq!(Arc::strong_count(&kept_by_filter), 2);
    drop(outer);
    assert_eq!(Arc::strong_count(&kept_by_filter), 1, "callbacks go with the last scene that needs them");
}

#[test]
fn replaced_buffers_and_detached_geometries_are_freed() {
    struct Empty(#[allow(dead_code, reason = "counted")] Arc<()>);
    impl UserPrimitive for Empty {
        fn bounds(&self, _: u32, _: u32) -> Bounds {
            Bounds::EMPTY
        }
        fn intersect(&self, _: u32, _: &Ray) -> Option<UserHit> {
            None
        }
    }
    let token = Arc::new(());
    let mut builder = SceneBuilder::new(&device()).unwrap();
    let id = builder.attach(UserGeometry::new(3, Empty(Arc::clone(&token)))).unwrap();
    builder.attach(triangle()).unwrap();
    let scene = builder.commit().unwrap();
    assert!(trace(&scene, up(0.25, 0.25)).hit.is_hit());
    let mut builder = scene.try_into_builder().unwrap();
    builder.detach(id).unwrap();
    assert_eq!(Arc::strong_count(&token), 1);
    assert!(trace(&builder.commit().unwrap(), up(0.25, 0.25)).hit.is_hit());
}

#[test]
fn builders_and_failed_builds_can_be_dropped() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(triangle()).unwrap();
    drop(builder);
    let mut builder = SceneBuilder::new(&device).unwrap();
    assert!(builder.attach(TriangleMesh::new(vec![[0.0; 3]], vec![[0, 0, 9]])).is_err());
    builder.attach(triangle()).unwrap();
    assert!(trace(&builder.commit().unwrap(), up(0.25, 0.25)).hit.is_hit());
}

#[test]
fn sixty_four_scenes_are_built_in_parallel() {
    let device = device();
    let instanced = scene_of(&device, triangle());
    let scenes: Vec<Scene> = thread::scope(|scope| {
        let build = |number: u32| {
            let (device, instanced) = (device.clone(), instanced.clone());
            scope.spawn(move || {
                let mut builder = SceneBuilder::new(&device).unwrap();
                builder.attach(triangle_at(2.0 + number as f32)).unwrap();
                builder.attach(Instance::new(&instanced, translation(9.0, 0.0, number as f32))).unwrap();
                builder.commit().unwrap()
            })
        };
        let threads: Vec<_> = (0..64).map(build).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    for (number, scene) in scenes.iter().enumerate() {
        assert_eq!(trace(scene, up(0.25, 0.25)).ray.tfar, 2.0 + number as f32);
        assert_eq!(trace(scene, up(9.25, 0.25)).ray.tfar, 1.0 + number as f32);
    }
    drop((device, instanced));
    thread::spawn(move || drop(scenes)).join().unwrap();
}

#[test]
fn one_scene_is_traced_from_many_threads() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    for z in 0..50 {
        builder.attach(triangle_at(z as f32 + 1.0).mask(1 << (z % 8)).filter(|hit| hit.u() < 0.5)).unwrap();
    }
    let scene = builder.commit().unwrap();
    thread::scope(|scope| {
        for worker in 0..8_u32 {
            let scene = scene.clone();
            scope.spawn(move || {
                for _ in 0..500 {
                    let found = trace(&scene, up(0.25, 0.25).with_mask(1 << worker));
                    assert_eq!(found.ray.tfar, worker as f32 + 1.0);
                    assert!(!trace(&scene, up(0.75, 0.125)).hit.is_hit());
                }
            });
        }
    });
    assert!(scene.take_panic().is_none());
}

fn grid() -> TriangleMesh {
    let side = 100_u32;
    let points: Vec<_> = (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, 1.0]).collect();
    TriangleMesh::new(points, (0..side * (side - 1) - 1).map(|i| [i, i + 1, i + side]).collect::<Vec<_>>())
}

#[test]
fn threads_of_the_caller_can_build() {
    let device = device_builder().config("threads=2,user_threads=2").build().unwrap();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(grid()).unwrap();
    let scene = builder
        .commit_with(|joiner| {
            thread::scope(|scope| {
                for _ in 0..2 {
                    scope.spawn(|| joiner.join());
                }
            });
        })
        .unwrap();
    assert_eq!(trace(&scene, up(50.25, 50.25)).ray.tfar, 1.0);
}

#[test]
fn a_joined_commit_works_without_help_and_reports_errors() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(grid()).unwrap();
    let scene = builder.commit_with(|_| ()).unwrap();
    assert!(trace(&scene, up(50.25, 50.25)).hit.is_hit());
    let mut builder = scene.try_into_builder().unwrap().progress(|_| false);
    builder.attach(grid()).unwrap();
    let error = builder.commit_with(|joiner| joiner.join()).unwrap_err();
    assert_eq!(error.code(), Some(embree4::ErrorCode::Cancelled));
}

#[test]
fn clones_block_edits_until_they_are_gone() {
    let scene = scene_of(&device(), triangle());
    let clone = scene.clone();
    let scene = scene.try_into_builder().unwrap_err();
    assert!(trace(&scene, up(0.25, 0.25)).hit.is_hit(), "the scene comes back unharmed");
    drop(clone);
    let mut builder = scene.try_into_builder().unwrap();
    builder.attach(Instance::new(&scene_of(&device(), triangle()), IDENTITY)).unwrap_err();
    assert!(builder.commit().is_ok());
}
