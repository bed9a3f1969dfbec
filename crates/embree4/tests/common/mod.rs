//! Shared by the tests: a device that honours `EMBREE4_TEST_CONFIG`, and small scenes.
#![allow(dead_code, reason = "not every test uses everything")]

use embree4::{Device, DeviceBuilder, Geometry, GeometryId, Ray, RayHit, Scene, SceneBuilder, TriangleMesh};

/// A builder with the options that the test run asks for, such as `isa=sse2`.
pub fn device_builder() -> DeviceBuilder {
    let builder = Device::builder().config("threads=2");
    match std::env::var("EMBREE4_TEST_CONFIG") {
        Ok(config) => builder.config(&config),
        Err(_) => builder,
    }
}

pub fn device() -> Device {
    device_builder().build().expect("a device")
}

/// A scene of one geometry.
pub fn scene_of(device: &Device, geometry: impl Geometry) -> Scene {
    let mut builder = SceneBuilder::new(device).expect("a scene");
    builder.attach(geometry).expect("a good geometry");
    builder.commit().expect("a commit")
}

/// One triangle at z = 1 over the unit corner.
pub fn triangle() -> TriangleMesh {
    triangle_at(1.0)
}

pub fn triangle_at(z: f32) -> TriangleMesh {
    TriangleMesh::new(vec![[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]], vec![[0, 1, 2]])
}

/// A transform that only moves.
pub fn translation(x: f32, y: f32, z: f32) -> [f32; 12] {
    let mut t = embree4::IDENTITY;
    t[9..].copy_from_slice(&[x, y, z]);
    t
}

/// A ray along +z from z = 0.
pub fn up(x: f32, y: f32) -> Ray {
    Ray::new([x, y, 0.0], [0.0, 0.0, 1.0])
}

/// To the nearest multiple of 1 / 4096. Most kernels multiply with a reciprocal that is off by a bit.
pub fn round(x: f32) -> f32 {
    (x * 4096.0).round() / 4096.0
}

/// Traces a ray and rounds distance and coordinates.
pub fn trace(scene: &Scene, ray: Ray) -> RayHit {
    let mut query = RayHit::new(ray);
    scene.intersect(&mut query);
    query.ray.tfar = round(query.ray.tfar);
    (query.hit.u, query.hit.v) = (round(query.hit.u), round(query.hit.v));
    query
}

pub fn hit_geometry(scene: &Scene, ray: Ray) -> Option<GeometryId> {
    trace(scene, ray).hit.geometry()
}
