//! Bad input is an error, never a panic or worse.

mod common;

use common::{device, scene_of, trace, triangle, up};
use embree4::{
    CurveBasis, CurveShape, Curves, Device, Error, Geometry, GeometryId, IDENTITY, Instance, InstanceArray,
    Isa, OrientedDiscs, QuadMesh, SceneBuilder, Spheres, Subdivision, TriangleMesh, VertexData,
};

#[track_caller]
fn refused(geometry: impl Geometry) -> Error {
    let mut builder = SceneBuilder::new(&device()).unwrap();
    let error = builder.attach(geometry).expect_err("this geometry is bad");
    let scene = builder.commit().expect("the builder is still good");
    assert_eq!(scene.geometry_ids().count(), 0);
    error
}

fn points(count: usize) -> Vec<[f32; 3]> {
    (0..count).map(|i| [i as f32, (i * i) as f32, 1.0]).collect()
}

fn balls(count: usize) -> Vec<[f32; 4]> {
    (0..count).map(|i| [i as f32, 0.0, 0.0, 1.0]).collect()
}

#[test]
fn indices_out_of_range() {
    let error = refused(TriangleMesh::new(points(3), vec![[0, 1, 2], [0, 3, 1]]));
    assert_eq!(error, Error::IndexOutOfRange { what: "vertex index", position: 4, index: 3, limit: 3 });
    assert_eq!(error.to_string(), "vertex index 3 at position 4 is out of range, only 3 exist");
    let out_of_range = |error| matches!(error, Error::IndexOutOfRange { .. });
    assert!(out_of_range(refused(TriangleMesh::new(vec![], vec![[0, 0, 0]]))));
    assert!(out_of_range(refused(TriangleMesh::new(points(3), vec![[0, 1, u32::MAX]]))));
    assert!(out_of_range(refused(QuadMesh::new(points(4), vec![[0, 1, 2, 4]]))));
    let curve = |basis, last| Curves::new(basis, CurveShape::Round, balls(5), vec![0, last]);
    assert!(out_of_range(refused(curve(CurveBasis::Bezier, 2))));
    assert!(out_of_range(refused(curve(CurveBasis::Linear, 4))));
    assert!(out_of_range(refused(Curves::new(CurveBasis::BSpline, CurveShape::Flat, balls(3), vec![0]))));
    scene_of(&device(), curve(CurveBasis::Bezier, 1));
    scene_of(&device(), curve(CurveBasis::Linear, 3));
    assert!(out_of_range(refused(Subdivision::new(points(4), vec![4], vec![0, 1, 2, 4]))));
    let sheet = || Subdivision::new(points(4), vec![4], vec![0, 1, 2, 3]);
    assert!(out_of_range(refused(sheet().holes(vec![1]))));
    assert!(out_of_range(refused(sheet().edge_creases(vec![[0, 4]], vec![1.0]))));
    assert!(out_of_range(refused(sheet().vertex_creases(vec![9], vec![1.0]))));
    let inner = scene_of(&device(), triangle());
    let device = inner.device().clone();
    let mut builder = SceneBuilder::new(&device).unwrap();
    let array = InstanceArray::of_many([inner], vec![0, 1], vec![IDENTITY; 2]);
    assert!(out_of_range(builder.attach(array).unwrap_err()));
}

#[test]
fn lengths_that_do_not_fit() {
    let wrong = |error| matches!(error, Error::LengthMismatch { .. });
    assert!(wrong(refused(triangle().time_steps([points(4)]))));
    assert!(wrong(refused(triangle().vertex_attribute(0, vec![1.0_f32; 2]))));
    assert!(wrong(refused(OrientedDiscs::new(balls(2), points(3)))));
    assert!(wrong(refused(Curves::hermite(CurveShape::Flat, balls(2), balls(3), vec![0]))));
    assert!(wrong(refused(Curves::normal_oriented(CurveBasis::Bezier, balls(4), points(3), vec![0]))));
    assert!(wrong(refused(Subdivision::new(points(4), vec![4, 3], vec![0, 1, 2, 3]))));
    assert!(wrong(refused(Subdivision::new(points(4), vec![4], vec![0, 1, 2, 3]).edge_levels(vec![1.0; 3]))));
    // Normals of one time step, points of two.
    let discs = Curves::normal_oriented(CurveBasis::Bezier, balls(4), points(4), vec![0]);
    assert!(wrong(refused(discs.time_steps([balls(4)]))));
}

#[test]
fn numbers_that_make_no_sense() {
    let inner = scene_of(&device(), triangle());
    let mut builder = SceneBuilder::new(inner.device()).unwrap();
    let mut bad = IDENTITY;
    bad[7] = f32::NAN;
    let error = builder.attach(Instance::new(&inner, bad)).unwrap_err();
    assert_eq!(error, Error::NotFinite { what: "instance transform", position: 7 });
    bad[7] = f32::INFINITY;
    assert!(builder.attach(Instance::new(&inner, IDENTITY).time_steps([bad])).is_err());
    assert!(builder.attach(InstanceArray::new(&inner, vec![bad])).is_err());
    let id = builder.attach(Instance::new(&inner, IDENTITY)).unwrap();
    assert!(builder.set_transform(id, bad).is_err());

    // A transform without an inverse is fine for triangles, but not for spheres.
    let flat = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    builder.attach(Instance::new(&inner, flat)).unwrap();
    let spheres = scene_of(inner.device(), Spheres::new(balls(3)));
    let error = builder.attach(Instance::new(&spheres, flat)).unwrap_err();
    assert!(matches!(error, Error::InvalidOption { .. }), "{error}");
    assert!(builder.attach(InstanceArray::new(&spheres, vec![IDENTITY, flat])).is_err());
    let half_turn = [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    assert!(builder.attach(Instance::new(&spheres, IDENTITY).time_steps([half_turn])).is_err());
    let id = builder.attach(Instance::new(&spheres, half_turn)).unwrap();
    assert!(builder.set_transform(id, flat).is_err());

    for (start, end) in [(1.0, 0.0), (0.5, 0.5), (f32::NAN, 1.0), (0.0, f32::INFINITY), (-3e38, 3e38)] {
        assert!(matches!(refused(triangle().time_range(start, end)), Error::InvalidOption { .. }));
    }
    // Steps outside of the scene's time, in which Embree read past the buffers: found by fuzzing.
    let steps = |start, end| triangle().time_steps([points(3), points(3)]).time_range(start, end);
    for (start, end) in
        [(-3.97, -3.625), (-1.0, 0.0), (-1.0, 1e-9), (1.0, 2.0), (1.0 - 6e-8, 9.0), (1e30, 2e30)]
    {
        assert!(matches!(refused(steps(start, end)), Error::InvalidOption { .. }), "{start} to {end}");
    }
    for (start, end) in [(-9.0, 0.001), (0.999, 9.0), (-1e30, 1e30), (0.5, 0.500_001), (-1e-30, 1e-30)] {
        scene_of(inner.device(), steps(start, end));
    }
    let sheet = || Subdivision::new(points(4), vec![4], vec![0, 1, 2, 3]);
    assert!(matches!(refused(sheet().tessellation_rate(f32::NAN)), Error::NotFinite { .. }));
    assert!(matches!(refused(sheet().edge_levels(vec![f32::INFINITY; 4])), Error::NotFinite { .. }));
    assert!(matches!(refused(sheet().vertex_creases(vec![0], vec![f32::NAN])), Error::NotFinite { .. }));
    assert!(matches!(refused(Subdivision::new(points(4), vec![2], vec![0, 1])), Error::InvalidOption { .. }));
    let folded = Subdivision::new(points(4), vec![3, 4], vec![0, 1, 2, 0, 1, 3, 1]);
    assert!(matches!(refused(folded), Error::InvalidOption { .. }));
    let gap = triangle().vertex_attribute(0, vec![1.0_f32; 3]).vertex_attribute(2, vec![1.0_f32; 3]);
    assert!(matches!(refused(gap), Error::InvalidOption { .. }));
    let ribbon = Curves::normal_oriented(CurveBasis::Linear, balls(4), points(4), vec![0]);
    assert!(matches!(refused(ribbon), Error::Unsupported(_)));
}

#[test]
fn counts_beyond_the_limits() {
    let too_large = |error| matches!(error, Error::TooLarge { .. });
    assert!(too_large(refused(triangle().time_steps(vec![points(3); 129]))));
    scene_of(&device(), triangle().time_steps(vec![points(3); 128]));
    let attributes = (0..17).fold(triangle(), |mesh, slot| mesh.vertex_attribute(slot, vec![0.0_f32; 3]));
    assert!(too_large(refused(attributes)));
    let user_count = embree4::UserGeometry::new(u32::MAX, Nothing);
    assert!(too_large(refused(user_count)));
    // A fan of 64 triangles around one vertex.
    let fan: Vec<u32> = (1..65).flat_map(|i| [0, i, i + 1]).collect();
    assert!(too_large(refused(Subdivision::new(points(66), vec![3; 64], fan))));
    let fan: Vec<u32> = (0..10).flat_map(|f| std::iter::once(0).chain(1 + 14 * f..15 + 14 * f)).collect();
    assert!(too_large(refused(Subdivision::new(points(141), vec![15; 10], fan))));
}

struct Nothing;
impl embree4::UserPrimitive for Nothing {
    fn bounds(&self, _: u32, _: u32) -> embree4::Bounds {
        embree4::Bounds::EMPTY
    }
    fn intersect(&self, _: u32, _: &embree4::Ray) -> Option<embree4::UserHit> {
        None
    }
}

#[test]
fn geometries_without_primitives_are_fine() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    builder.attach(TriangleMesh::new(vec![], vec![])).unwrap();
    builder.attach(TriangleMesh::new(points(3), vec![])).unwrap();
    builder.attach(QuadMesh::new(vec![], vec![])).unwrap();
    builder.attach(Spheres::new(vec![])).unwrap();
    builder.attach(Curves::new(CurveBasis::Bezier, CurveShape::Round, vec![], vec![])).unwrap();
    builder.attach(Subdivision::new(vec![], vec![], vec![])).unwrap();
    builder.attach(embree4::UserGeometry::new(0, Nothing)).unwrap();
    let empty = builder.commit().unwrap();
    assert!(empty.bounds().is_empty());
    assert!(!trace(&empty, up(0.0, 0.0)).hit.is_hit());
    let outer = scene_of(&device, Instance::new(&empty, IDENTITY));
    assert!(!trace(&outer, up(0.0, 0.0)).hit.is_hit());
    let array = scene_of(&device, InstanceArray::new(&empty, vec![]));
    assert!(!trace(&array, up(0.0, 0.0)).hit.is_hit());
}

#[test]
fn instances_of_instances_and_of_other_devices() {
    let inner = scene_of(&device(), triangle());
    let outer = scene_of(inner.device(), Instance::new(&inner, IDENTITY));
    let mut builder = SceneBuilder::new(inner.device()).unwrap();
    assert_eq!(builder.attach(Instance::new(&outer, IDENTITY)).unwrap_err(), Error::NestedInstance);
    let array = InstanceArray::new(&outer, vec![IDENTITY]);
    assert_eq!(builder.attach(array).unwrap_err(), Error::NestedInstance);
    assert_eq!(refused(Instance::new(&inner, IDENTITY)), Error::DifferentDevice);
}

#[test]
fn ids_that_do_not_exist_or_are_taken() {
    let device = device();
    let mut builder = SceneBuilder::new(&device).unwrap();
    let id = GeometryId(4);
    builder.attach_with_id(triangle(), id).unwrap();
    assert_eq!(builder.attach_with_id(triangle(), id), Err(Error::GeometryIdUnavailable(id)));
    for bad in [GeometryId(GeometryId::MAX.0 + 1), GeometryId(u32::MAX)] {
        assert_eq!(builder.attach_with_id(triangle(), bad), Err(Error::GeometryIdUnavailable(bad)));
    }
    let missing = GeometryId(3);
    assert_eq!(builder.detach(missing), Err(Error::NoSuchGeometry(missing)));
    assert_eq!(builder.set_mask(missing, 1), Err(Error::NoSuchGeometry(missing)));
    assert_eq!(builder.set_enabled(missing, true), Err(Error::NoSuchGeometry(missing)));
    assert!(builder.set_transform(id, IDENTITY).is_err(), "a mesh has no transform");
    assert!(builder.update_vertices(id, 0, points(4)).is_err(), "another length");
    assert!(builder.update_vertices(id, 1, points(3)).is_err(), "no such time step");
    assert!(builder.update_vertices(id, 0, balls(3)).is_err(), "another type");
    let scene = builder.commit().unwrap();
    let position = VertexData::Position(0);
    assert!(scene.interpolate::<3>(missing, 0, 0.1, 0.1, position).is_err());
    assert!(scene.interpolate::<3>(id, 1, 0.1, 0.1, position).is_err(), "only one triangle");
    assert!(scene.interpolate::<4>(id, 0, 0.1, 0.1, position).is_err(), "only three components");
    assert!(scene.interpolate::<0>(id, 0, 0.1, 0.1, position).is_err());
    assert!(scene.interpolate::<3>(id, 0, 0.1, 0.1, VertexData::Position(1)).is_err());
    assert!(scene.interpolate::<1>(id, 0, 0.1, 0.1, VertexData::Attribute(0)).is_err());
    let balls = scene_of(&device, Spheres::new(balls(1)));
    assert!(balls.interpolate::<3>(GeometryId(0), 0, 0.1, 0.1, position).is_err());
    let outer = scene_of(&device, Instance::new(&scene, IDENTITY));
    assert!(outer.interpolate::<3>(GeometryId(0), 0, 0.1, 0.1, position).is_err());
}

#[test]
fn device_options_that_do_not_exist() {
    for bad in [
        "isa=avx9",
        "threads=many",
        "threads=-1",
        "thread=2",
        "verbose",
        "threads=1\0",
        "threads=99999",
        "hugepages=2",
    ] {
        let error = Device::builder().config(bad).build().unwrap_err();
        assert!(matches!(error, Error::InvalidConfig { .. }), "{bad:?}: {error}");
    }
    let device = Device::builder()
        .config(" threads=1 , ,isa=sse2")
        .threads(2)
        .user_threads(0)
        .isa(Isa::Sse42)
        .verbose(0)
        .set_affinity(false)
        .start_threads(true)
        .build()
        .unwrap();
    assert_eq!(device.native_packet_width(), 4);
    assert!(format!("{device:?}").contains("SSE"));
}
