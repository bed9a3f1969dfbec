//! Every kind of geometry: where rays hit it, its bounds, motion and interpolation.

mod common;

use common::{device, hit_geometry, scene_of, trace, translation, triangle, triangle_at, up};
use embree4::{
    BoundaryMode, Bounds, CurveBasis, CurveShape, Curves, Discs, FeatureMask, GeometryId, IDENTITY,
    INVALID_ID, Instance, InstanceArray, OrientedDiscs, QuadMesh, Ray, Scene, SceneBuilder, SharedBuffer,
    Spheres, Subdivision, TriangleMesh, VertexData,
};

const ID: GeometryId = GeometryId(0);

#[track_caller]
fn near(a: f32, b: f32, tolerance: f32) {
    assert!((a - b).abs() <= tolerance, "{a} is not within {tolerance} of {b}");
}

fn distance(scene: &Scene, x: f32, y: f32) -> f32 {
    trace(scene, up(x, y)).ray.tfar
}

#[test]
fn quads_cover_both_halves_and_interpolate() {
    let corners = vec![[0.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 2.0, 2.0], [0.0, 2.0, 2.0]];
    let mesh = QuadMesh::new(corners, vec![[0, 1, 2, 3]])
        .vertex_attribute(0, vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let scene = scene_of(&device(), mesh);
    assert_eq!(scene.features(), FeatureMask::QUAD);
    for (x, y) in [(0.5, 0.5), (1.5, 1.75)] {
        let found = trace(&scene, up(x, y));
        assert_eq!(found.ray.tfar, 2.0);
        near(found.hit.u, x / 2.0, 1e-6);
        near(found.hit.v, y / 2.0, 1e-6);
        let uv: [f32; 2] =
            scene.interpolate(ID, 0, found.hit.u, found.hit.v, VertexData::Attribute(0)).unwrap();
        near(uv[0], x / 2.0, 1e-6);
        near(uv[1], y / 2.0, 1e-6);
    }
    assert_eq!(scene.bounds(), Bounds { lower: [0.0, 0.0, 2.0], upper: [2.0, 2.0, 2.0] });
}

#[test]
fn spheres_report_entry_and_exit() {
    let scene = scene_of(&device(), Spheres::new(vec![[0.0, 0.0, 5.0, 1.0], [3.0, 0.0, 5.0, 2.0]]));
    near(distance(&scene, 0.0, 0.0), 4.0, 1e-5);
    let second = trace(&scene, up(3.0, 0.0));
    near(second.ray.tfar, 3.0, 1e-5);
    assert_eq!(second.hit.prim_id, 1);
    assert!(second.hit.ng[2] < 0.0, "the normal points outwards");
    let inside = trace(&scene, Ray::new([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]));
    near(inside.ray.tfar, 1.0, 1e-5);
    assert_eq!(distance(&scene, 0.0, 1.5), f32::INFINITY);
    let expected = Bounds { lower: [-1.0, -2.0, 3.0], upper: [5.0, 2.0, 7.0] };
    let bounds = scene.bounds();
    for axis in 0..3 {
        near(bounds.lower[axis], expected.lower[axis], 1e-4);
        near(bounds.upper[axis], expected.upper[axis], 1e-4);
    }
}

#[test]
fn discs_face_the_ray_and_oriented_discs_do_not() {
    let device = device();
    let facing = scene_of(&device, Discs::new(vec![[0.0, 0.0, 2.0, 1.0]]));
    near(distance(&facing, 0.5, 0.0), 2.0, 1e-5);
    assert_eq!(distance(&facing, 1.1, 0.0), f32::INFINITY);

    // Tilted by 45 degrees about y: z grows with x, and the disc ends at x = 1 / sqrt 2.
    let disc = OrientedDiscs::new(vec![[0.0, 0.0, 2.0, 1.0]], vec![[1.0, 0.0, -1.0]]);
    let tilted = scene_of(&device, disc);
    near(distance(&tilted, 0.5, 0.0), 2.5, 1e-5);
    near(distance(&tilted, -0.5, 0.0), 1.5, 1e-5);
    assert_eq!(distance(&tilted, 0.8, 0.0), f32::INFINITY);
    assert_eq!(tilted.features(), FeatureMask::POINT);
}

/// Control points along x at z = 5, of radius 0.5: every basis makes the same straight curve of them.
fn straight(basis: CurveBasis, shape: CurveShape) -> Curves {
    let points: Vec<_> = (0..4).map(|i| [i as f32, 0.0, 5.0, 0.5]).collect();
    Curves::new(basis, shape, points, vec![0])
}

#[test]
fn curves_of_every_basis_and_shape() {
    let device = device();
    // The part of x that the first segment covers.
    let bases = [
        (CurveBasis::Linear, 0.0, 1.0),
        (CurveBasis::Bezier, 0.0, 3.0),
        (CurveBasis::BSpline, 1.0, 2.0),
        (CurveBasis::CatmullRom, 1.0, 2.0),
    ];
    for (basis, from, to) in bases {
        for (shape, z) in [(CurveShape::Round, 4.5), (CurveShape::Flat, 5.0)] {
            let scene = scene_of(&device, straight(basis, shape));
            let middle = (from + to) / 2.0;
            let found = trace(&scene, up(middle, 0.0));
            assert!(found.hit.is_hit(), "{basis:?} {shape:?}");
            near(found.ray.tfar, z, 0.02);
            near(found.hit.u, 0.5, 0.02);
            assert!(!trace(&scene, up(middle, 0.55)).hit.is_hit(), "{basis:?} {shape:?} is too thick");
            assert!(trace(&scene, up(middle, 0.45)).hit.is_hit(), "{basis:?} {shape:?} is too thin");
            assert!(!trace(&scene, up(to + 0.6, 0.0)).hit.is_hit(), "{basis:?} {shape:?} is too long");
            let centre: [f32; 4] = scene.interpolate(ID, 0, 0.5, 0.0, VertexData::Position(0)).unwrap();
            near(centre[0], middle, 1e-4);
            near(centre[3], 0.5, 1e-4);
        }
    }
}

#[test]
fn hermite_and_normal_oriented_curves() {
    let device = device();
    let points = vec![[0.0, 0.0, 5.0, 0.5], [3.0, 0.0, 5.0, 0.5]];
    let tangents = vec![[3.0, 0.0, 0.0, 0.0]; 2];
    let scene = scene_of(&device, Curves::hermite(CurveShape::Round, points, tangents, vec![0]));
    near(distance(&scene, 1.5, 0.0), 4.5, 0.02);

    let points: Vec<_> = (0..4).map(|i| [i as f32, 0.0, 5.0, 0.5]).collect();
    let ribbon = |normal: [f32; 3]| {
        let curves = Curves::normal_oriented(CurveBasis::Bezier, points.clone(), vec![normal; 4], vec![0]);
        scene_of(&device, curves)
    };
    let (facing, edge_on) = (ribbon([0.0, 0.0, -1.0]), ribbon([0.0, 1.0, 0.0]));
    near(distance(&facing, 1.5, 0.3), 5.0, 0.02);
    assert_eq!(distance(&edge_on, 1.5, 0.3), f32::INFINITY);
    let from_above = trace(&edge_on, Ray::new([1.5, 3.0, 5.2], [0.0, -1.0, 0.0]));
    near(from_above.ray.tfar, 3.0, 0.02);
}

/// A cube of side 2 around the origin.
fn cube() -> Subdivision {
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let corners: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Subdivision::new(corners, vec![4; 6], faces.as_flattened())
}

fn from_below(scene: &Scene, x: f32, y: f32) -> f32 {
    let found = trace(scene, Ray::new([x, y, -10.0], [0.0, 0.0, 1.0]));
    found.ray.tfar - 10.0
}

#[test]
fn subdivision_rounds_a_cube_unless_told_otherwise() {
    let device = device();
    let smooth = scene_of(&device, cube().tessellation_rate(16.0));
    let z = from_below(&smooth, 0.0, 0.0);
    assert!((-0.9..-0.5).contains(&z), "the face centre of a smooth cube is drawn in, not at {z}");
    assert_eq!(from_below(&smooth, 0.9, 0.9), f32::INFINITY, "its corners are gone");

    let edges: Vec<[u32; 2]> =
        (0..8).flat_map(|i| [1, 2, 4].map(|bit| [i, i | bit])).filter(|[a, b]| a != b).collect();
    let weights = vec![f32::INFINITY; edges.len()];
    let sharp = scene_of(&device, cube().edge_creases(edges, weights));
    near(from_below(&sharp, 0.0, 0.0), -1.0, 1e-3);
    near(from_below(&sharp, 0.9, 0.9), -1.0, 1e-3);

    let corners = cube().vertex_creases((0..8).collect::<Vec<u32>>(), vec![10.0; 8]).tessellation_rate(64.0);
    let cornered = scene_of(&device, corners);
    assert!(cornered.bounds().upper[0] > smooth.bounds().upper[0] + 0.05, "sharp corners stick out");

    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(cube().holes(vec![0]).edge_levels(vec![4.0; 24])).unwrap();
    let open = builder.commit().unwrap();
    assert!(from_below(&open, 0.0, 0.0) > 0.5, "rays pass the hole and meet the far side");
    assert_eq!(open.features(), FeatureMask::SUBDIVISION);
}

#[test]
fn the_boundary_mode_decides_about_corners_of_an_open_mesh() {
    let device = device();
    let sheet = || {
        let points: SharedBuffer<[f32; 3]> =
            (0..9).map(|i| [(i % 3) as f32 - 1.0, (i / 3) as f32 - 1.0, 0.0]).collect();
        let faces = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]];
        Subdivision::new(points, vec![4; 4], faces.as_flattened()).tessellation_rate(16.0)
    };
    let hits_corner = |mode| from_below(&scene_of(&device, sheet().boundary(mode)), 0.97, 0.97).is_finite();
    assert!(!hits_corner(BoundaryMode::None));
    assert!(!hits_corner(BoundaryMode::Smooth));
    assert!(hits_corner(BoundaryMode::PinCorners));
    assert!(hits_corner(BoundaryMode::PinBoundary));
    assert!(hits_corner(BoundaryMode::PinAll));
}

#[test]
fn derivatives_describe_the_surface() {
    let scene = scene_of(&device(), cube().tessellation_rate(8.0));
    let at = |u, v| scene.interpolate_derivatives::<3>(ID, 0, u, v, VertexData::Position(0)).unwrap();
    let (middle, aside) = (at(0.5, 0.5), at(0.502, 0.5));
    for axis in 0..3 {
        near((aside.value[axis] - middle.value[axis]) / 0.002, middle.du[axis], 0.02);
        near((aside.du[axis] - middle.du[axis]) / 0.002, middle.dudu[axis], 0.1);
    }
    assert!(middle.dv.iter().any(|d| d.abs() > 0.1));
    let beyond = scene.interpolate::<3>(ID, 0, 7.0, f32::NAN, VertexData::Position(0)).unwrap();
    assert_eq!(beyond, at(1.0, 0.0).value);
}

#[test]
fn instances_move_turn_and_scale() {
    let device = device();
    let inner = scene_of(&device, triangle());
    // x to y, y to -x, z doubled, then moved.
    let transform = [0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 10.0, 0.0, 1.0];
    let scene = scene_of(&device, Instance::new(&inner, transform));
    let found = trace(&scene, up(9.75, 0.5));
    assert_eq!(found.ray.tfar, 3.0);
    assert_eq!((found.hit.u, found.hit.v), (0.5, 0.25));
    assert_eq!(found.hit.inst_id, [0]);
    assert!(scene.features().contains(FeatureMask::INSTANCE | FeatureMask::TRIANGLE));
    let flat = scene_of(&device, Instance::new(&inner, [0.0; 12]));
    assert!(!trace(&flat, up(0.0, 0.0)).hit.is_hit(), "nothing is hit through a singular transform");
}

#[test]
fn instance_arrays_number_their_places_and_choose_scenes() {
    let device = device();
    let (low, high) = (scene_of(&device, triangle_at(1.0)), scene_of(&device, triangle_at(2.0)));
    let places: Vec<_> = (0..4).map(|i| translation(2.0 * i as f32, 0.0, 0.0)).collect();

    let scene = scene_of(&device, InstanceArray::new(&low, places.clone()));
    for place in 0..4 {
        let found = trace(&scene, up(2.0 * place as f32 + 0.25, 0.25));
        assert_eq!((found.ray.tfar, found.hit.inst_id, found.hit.inst_prim_id), (1.0, [0], [place]));
    }
    assert!(!trace(&scene, up(8.25, 0.25)).hit.is_hit());
    assert_eq!(scene.primitive_count(ID), Ok(4));

    let mixed = InstanceArray::of_many([low, high], vec![0, 1, 1, 0], places);
    let scene = scene_of(&device, mixed);
    let heights: Vec<_> = (0..4).map(|i| distance(&scene, 2.0 * i as f32 + 0.25, 0.25)).collect();
    assert_eq!(heights, [1.0, 2.0, 2.0, 1.0]);
}

#[test]
fn motion_moves_vertices_instances_and_curves() {
    let device = device();
    let corners = |z: f32| vec![[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
    let at = |scene: &Scene, time| trace(scene, up(0.25, 0.25).at_time(time)).ray.tfar;

    let mesh = || TriangleMesh::new(corners(1.0), vec![[0, 1, 2]]).time_steps([corners(3.0), corners(4.0)]);
    let scene = scene_of(&device, mesh());
    assert!(scene.features().contains(FeatureMask::MOTION_BLUR));
    for (time, z) in [(0.0, 1.0), (0.25, 2.0), (0.5, 3.0), (0.75, 3.5), (1.0, 4.0)] {
        near(at(&scene, time), z, 1e-5);
    }
    let linear = scene.linear_bounds();
    assert!(linear.start.lower[2] <= 1.0 && linear.end.upper[2] >= 4.0 && linear.end.lower[2] > 2.0);

    let late = scene_of(&device, mesh().time_range(0.5, 1.0));
    near(at(&late, 0.75), 3.0, 1e-4);

    let inner = scene_of(&device, triangle());
    let instance = Instance::new(&inner, IDENTITY).time_steps([translation(0.0, 0.0, 2.0)]);
    near(at(&scene_of(&device, instance), 0.5), 2.0, 1e-5);
    let array = InstanceArray::new(&inner, vec![IDENTITY]).time_steps([vec![translation(0.0, 0.0, 2.0)]]);
    near(at(&scene_of(&device, array), 0.5), 2.0, 1e-5);

    let spheres = Spheres::new(vec![[0.25, 0.25, 5.0, 1.0]]).time_steps([vec![[0.25, 0.25, 7.0, 1.0]]]);
    near(at(&scene_of(&device, spheres), 0.5), 5.0, 1e-4);
    let discs = OrientedDiscs::new(vec![[0.25, 0.25, 5.0, 1.0]], vec![[0.0, 0.0, 1.0]])
        .time_step(vec![[0.25, 0.25, 7.0, 1.0]], vec![[0.0, 0.0, 1.0]]);
    near(at(&scene_of(&device, discs), 0.5), 6.0, 1e-4);
    let line = |z| vec![[-1.0, 0.25, z, 0.5], [1.0, 0.25, z, 0.5]];
    let curve = Curves::new(CurveBasis::Linear, CurveShape::Flat, line(5.0), vec![0]).time_steps([line(7.0)]);
    near(at(&scene_of(&device, curve), 0.5), 6.0, 1e-3);
}

#[test]
fn several_geometries_keep_their_ids_apart() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    let low = builder.attach(triangle()).unwrap();
    let high = builder.attach(triangle_at(2.0)).unwrap();
    let far = GeometryId(40);
    builder.attach_with_id(triangle_at(3.0), far).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(scene.geometry_ids().collect::<Vec<_>>(), [low, high, far]);
    assert_eq!(hit_geometry(&scene, up(0.25, 0.25)), Some(low));
    assert_eq!(trace(&scene, up(0.25, 0.25)).hit.inst_id, [INVALID_ID]);

    let mut builder = scene.try_into_builder().unwrap();
    builder.set_enabled(low, false).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(hit_geometry(&scene, up(0.25, 0.25)), Some(high));
    let mut builder = scene.try_into_builder().unwrap();
    builder.detach(high).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(hit_geometry(&scene, up(0.25, 0.25)), Some(far));
    let mut builder = scene.try_into_builder().unwrap();
    builder.set_enabled(low, true).unwrap();
    builder.update_vertices(low, 0, vec![[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]]).unwrap();
    let scene = builder.commit().unwrap();
    assert_eq!(distance(&scene, 0.25, 0.25), 0.5);
}

#[test]
fn an_instance_can_be_moved_between_commits() {
    let device = device();
    let inner = scene_of(&device, triangle());
    let scene = scene_of(&device, Instance::new(&inner, IDENTITY));
    assert_eq!(distance(&scene, 0.25, 0.25), 1.0);
    let mut builder = scene.try_into_builder().unwrap();
    builder.set_transform(ID, translation(0.0, 0.0, 6.0)).unwrap();
    assert_eq!(distance(&builder.commit().unwrap(), 0.25, 0.25), 7.0);
}
