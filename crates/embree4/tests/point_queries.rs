//! Point queries against a search through everything.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};

use common::{device, scene_of, translation};
use embree4::{
    Bounds, CurveBasis, CurveShape, Curves, GeometryId, INVALID_ID, Instance, QuadMesh, Ray, Scene,
    SceneBuilder, Spheres, Subdivision, TriangleMesh, UserGeometry, UserHit, UserPrimitive,
};

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1]).hypot(a[2] - b[2])
}

/// Scattered points, as triangles of almost no size.
fn cloud() -> Vec<[f32; 3]> {
    let part = |i: u32, k: u32| (i.wrapping_mul(k) % 1009) as f32 / 1009.0;
    (0..500).map(|i| [part(i, 571), part(i, 887), part(i, 331)]).collect()
}

fn cloud_scene() -> Scene {
    let corners = |p: [f32; 3]| [p, [p[0] + 1e-6, p[1], p[2]], [p[0], p[1] + 1e-6, p[2]]];
    let vertices: Vec<_> = cloud().into_iter().flat_map(corners).collect();
    let indices: Vec<_> = (0..500).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    scene_of(&device(), TriangleMesh::new(vertices, indices))
}

#[test]
fn the_nearest_point_is_found_without_looking_at_all() {
    let points = cloud();
    let scene = cloud_scene();
    for query in &points[..50] {
        let at = [query[1], query[2], query[0]];
        let expected = points.iter().map(|&p| distance(at, p)).fold(f32::INFINITY, f32::min);
        let mut visits = 0;
        let found = scene.point_query(at, 10.0, 0.0, |candidate| {
            visits += 1;
            assert_eq!((candidate.geom_id, candidate.inst_id), (0, INVALID_ID));
            assert!(candidate.instance_to_world.is_none());
            let d = distance(at, points[candidate.prim_id as usize]);
            candidate.shrink(d);
            candidate.shrink(d + 1.0);
            assert!(candidate.radius() <= d);
        });
        assert!((found - expected).abs() < 1e-6, "{found} instead of {expected}");
        assert!(visits < points.len(), "shrinking the radius spares visits");
    }
}

struct Cube;
impl UserPrimitive for Cube {
    fn bounds(&self, _: u32, _: u32) -> Bounds {
        Bounds { lower: [0.0; 3], upper: [1.0; 3] }
    }
    fn intersect(&self, _: u32, _: &Ray) -> Option<UserHit> {
        None
    }
}

/// Embree does not look at points, curves and subdivision surfaces in point queries. If that changes, so should the documentation.
#[test]
fn kinds_of_geometry_that_are_visited() {
    let device = device();
    let visits = |scene: Scene| {
        let mut visits = 0;
        scene.point_query([0.2, 0.2, 0.2], 2.0, 0.0, |_| visits += 1);
        visits > 0
    };
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert!(visits(scene_of(&device, QuadMesh::new(corners.clone(), vec![[0, 1, 2, 3]]))));
    assert!(visits(scene_of(&device, UserGeometry::new(1, Cube))));
    assert!(!visits(scene_of(&device, Subdivision::new(corners, vec![4], vec![0, 1, 2, 3]))));
    let balls = vec![[0.0, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.5]];
    assert!(!visits(scene_of(&device, Spheres::new(balls.clone()))));
    assert!(!visits(scene_of(&device, Curves::new(CurveBasis::Linear, CurveShape::Round, balls, vec![0]))));
}

#[test]
fn what_is_near_is_visited_and_instances_are_told() {
    let device = device();
    let corners = |x: f32| vec![[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
    let far = scene_of(&device, TriangleMesh::new(corners(0.0), vec![[0, 1, 2]]));
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach_with_id(TriangleMesh::new(corners(0.0), vec![[0, 1, 2]]), GeometryId(4)).unwrap();
    let place = translation(10.0, 0.0, 0.0);
    builder.attach_with_id(Instance::new(&far, place), GeometryId(6)).unwrap();
    let scene = builder.commit().unwrap();
    let around = |x: f32, radius: f32| {
        let mut seen = Vec::new();
        let left = scene.point_query([x, 0.2, 0.2], radius, 0.0, |c| {
            assert!(c.point == [x, 0.2, 0.2]);
            seen.push((c.geom_id, c.inst_id, c.instance_to_world));
        });
        assert_eq!(left.to_bits(), radius.to_bits());
        seen.sort_by_key(|s| s.1);
        seen
    };
    // Embree may visit what is farther away, too.
    assert!(around(0.2, 1.0).contains(&(4, INVALID_ID, None)));
    assert!(around(10.2, 1.0).contains(&(0, 6, Some(place))));
    assert_eq!(around(5.0, 20.0).len(), 2);
    assert!(around(0.2, -1.0).is_empty() && around(0.2, f32::NAN).is_empty());
    assert!(around(f32::NAN, 1.0).is_empty());
}

#[test]
fn a_panic_of_the_visitor_continues() {
    let scene = cloud_scene();
    let mut visits = 0;
    let thrown = catch_unwind(AssertUnwindSafe(|| {
        scene.point_query([0.5; 3], 10.0, 0.0, |_| {
            visits += 1;
            panic!("seen enough");
        })
    }));
    assert_eq!(thrown.unwrap_err().downcast_ref::<&str>(), Some(&"seen enough"));
    assert_eq!(visits, 1);
}
