//! Hand-computed checks of conventions: transformations, orientation, photometry.

use crate::description::{
    Emission, Geometry, Light, PixelFilter, Projection, SamplerKind, SceneDescription, Shape, TriangleMesh,
};
use crate::{LoadOptions, load_pbrt_text};
use glam::{Vec3, vec3};
use std::f32::consts::PI;
use std::path::Path;

fn load(text: &str) -> SceneDescription {
    load_pbrt_text(text.as_bytes(), Path::new("tests/fixtures"), &LoadOptions::default()).unwrap()
}

fn world(text: &str) -> SceneDescription {
    load(&format!("Camera \"perspective\"\nWorldBegin\n{text}"))
}

fn radiance(shape: &Shape) -> Vec3 {
    match shape.emission {
        Some(Emission { radiance: crate::description::ColorInput::Constant(value), .. }) => value,
        _ => panic!("no constant emission"),
    }
}

fn mesh(shape: &Shape) -> &TriangleMesh {
    match &shape.geometry {
        Geometry::Triangles(mesh) => mesh,
        other => panic!("not triangles: {other:?}"),
    }
}

/// The outside of a triangle as the renderer sees it.
fn outside(shape: &Shape, triangle: usize) -> Vec3 {
    let mesh = mesh(shape);
    let [a, b, c] = mesh.indices[triangle].map(|i| Vec3::from(mesh.positions[i as usize]));
    (b - a).cross(c - a).normalize() * if shape.reverse_orientation { -1.0 } else { 1.0 }
}

#[test]
fn the_camera_sits_at_the_eye_and_looks_forward() {
    let scene = load(
        "LookAt 1 2 3  1 2 10  0 1 0\nCamera \"perspective\" \"float fov\" 30\nWorldBegin Shape \"sphere\"",
    );
    let m = scene.camera.camera_to_world;
    assert!(m.transform_point3(Vec3::ZERO).abs_diff_eq(vec3(1.0, 2.0, 3.0), 1e-5));
    assert!(m.transform_vector3(Vec3::Z).abs_diff_eq(Vec3::Z, 1e-6));
    assert!(m.transform_vector3(Vec3::X).abs_diff_eq(Vec3::X, 1e-6));
    assert_eq!(scene.camera.projection, Projection::Perspective { fov: 30.0 });
    // Scale -1 1 1 before LookAt mirrors the picture: right in the picture is now -x.
    let scene =
        load("Scale -1 1 1 LookAt 0 0 0 0 0 1 0 1 0\nCamera \"perspective\"\nWorldBegin Shape \"sphere\"");
    assert!(scene.camera.camera_to_world.transform_vector3(Vec3::X).abs_diff_eq(-Vec3::X, 1e-6));
}

#[test]
fn matrices_are_written_column_by_column() {
    let scene = load(
        "Transform [ 1 0 0 0  0 1 0 0  0 0 1 0  0 0 -5 1 ]\nCamera \"perspective\"\nWorldBegin Shape \"sphere\"",
    );
    // World to camera moves by -5 along z: the camera is at z = 5.
    assert!(scene.camera.camera_to_world.transform_point3(Vec3::ZERO).abs_diff_eq(vec3(0.0, 0.0, 5.0), 1e-6));
}

#[test]
fn world_begin_resets_and_the_camera_space_can_be_recalled() {
    let scene = load(
        "Translate 0 0 -5\nCamera \"perspective\"\nWorldBegin\nLightSource \"point\"\n\
         CoordSysTransform \"camera\"\nLightSource \"point\"",
    );
    let Light::Point { position, .. } = scene.lights[0] else { panic!() };
    assert_eq!(position, Vec3::ZERO);
    let Light::Point { position, .. } = scene.lights[1] else { panic!() };
    assert!(position.abs_diff_eq(vec3(0.0, 0.0, 5.0), 1e-6));
}

#[test]
fn the_last_transformation_acts_first() {
    let scene =
        world("Translate 1 0 0 Rotate 90 0 0 1 Scale 2 2 2 LightSource \"point\" \"point3 from\" [ 1 0 0 ]");
    let Light::Point { position, .. } = scene.lights[0] else { panic!() };
    assert!(position.abs_diff_eq(vec3(1.0, 2.0, 0.0), 1e-6), "{position}");
}

#[test]
fn blocks_restore_what_they_should() {
    let scene = world(
        "AttributeBegin Translate 9 0 0 ReverseOrientation Material \"interface\" AttributeEnd\n\
         TransformBegin Translate 5 0 0 ReverseOrientation TransformEnd Shape \"sphere\"",
    );
    let shape = &scene.shapes[0];
    assert!(shape.reverse_orientation, "TransformEnd keeps the orientation");
    assert!(matches!(shape.geometry, Geometry::Sphere { center: Vec3::ZERO, radius: 1.0, .. }));
    assert_eq!(scene.materials[shape.material.0 as usize].name, "default");
}

#[test]
fn patches_are_put_in_order_around() {
    let scene = world("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0  1 1 0 ]");
    let Geometry::Quads(quads) = &scene.shapes[0].geometry else { panic!() };
    let corner = |i: usize| quads.positions[quads.indices[0][i] as usize];
    assert_eq!(
        [0, 1, 2, 3].map(corner),
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(quads.uvs.as_deref(), Some(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][..]));
}

#[test]
fn spheres_keep_their_poles_or_become_meshes() {
    let scene = world("Translate 1 2 3 Rotate 90 1 0 0 Scale 2 2 2 Shape \"sphere\" \"float radius\" 1.5");
    let Geometry::Sphere { center, radius, axes } = scene.shapes[0].geometry else { panic!() };
    assert_eq!(center, vec3(1.0, 2.0, 3.0));
    assert!((radius - 3.0).abs() < 1e-6);
    // Turning by 90 degrees about x takes the pole z to -y.
    assert!(axes[2].abs_diff_eq(-Vec3::Y, 1e-6) && axes[0].abs_diff_eq(Vec3::X, 1e-6));
    let scene = world("Scale 1 2 1 Shape \"sphere\"");
    let ellipsoid = mesh(&scene.shapes[0]);
    assert!(ellipsoid.positions.iter().all(|p| {
        let [x, y, z] = *p;
        (x * x + y * y / 4.0 + z * z - 1.0).abs() < 1e-5
    }));
    assert!((0..ellipsoid.indices.len()).all(|i| {
        outside(&scene.shapes[0], i).dot(Vec3::from(ellipsoid.positions[ellipsoid.indices[i][0] as usize]))
            > 0.0
    }));
}

#[test]
fn disks_face_along_z() {
    let scene = world("Rotate 90 1 0 0 Scale 2 2 2 Shape \"disk\" \"float height\" 1");
    let Geometry::Disk { center, normal, tangent, radius } = scene.shapes[0].geometry else { panic!() };
    assert!(center.abs_diff_eq(vec3(0.0, -2.0, 0.0), 1e-6) && normal.abs_diff_eq(-Vec3::Y, 1e-6));
    assert!(tangent.abs_diff_eq(Vec3::X, 1e-6) && (radius - 2.0).abs() < 1e-6);
}

const TRIANGLE: &str = "\"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]";

#[test]
fn the_outside_follows_winding_mirroring_and_reversal() {
    let side = |before: &str, normals: &str| {
        let scene = world(&format!("{before} Shape \"trianglemesh\" {TRIANGLE} {normals}"));
        outside(&scene.shapes[0], 0).z
    };
    assert_eq!(side("", ""), 1.0);
    assert_eq!(side("ReverseOrientation", ""), -1.0);
    // Mirroring x leaves z alone: the outside stays at +z.
    assert_eq!(side("Scale -1 1 1", ""), 1.0);
    assert_eq!(side("Scale 1 1 -1", ""), -1.0);
    let down = "\"normal N\" [ 0 0 -1 0 0 -1 0 0 -1 ]";
    assert_eq!(side("", down), -1.0);
    assert_eq!(side("ReverseOrientation", down), 1.0);
    assert_eq!(side("Scale -1 1 1", down), -1.0);
}

#[test]
fn triangles_without_area_are_dropped_with_a_count() {
    let scene = world(
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 2 0 0 ] \"integer indices\" [ 0 1 2 0 1 3 0 0 1 ]",
    );
    assert_eq!(mesh(&scene.shapes[0]).indices, [[0, 1, 2]]);
    assert_eq!(scene.warnings, ["text:3:7: 2 of 3 triangles have no area and are dropped"]);
}

#[test]
fn area_lights_scale_and_spread_their_power() {
    let light = |parameters: &str, shape: &str| {
        let scene = world(&format!("AreaLightSource \"diffuse\" {parameters} {shape}"));
        radiance(&scene.shapes[0])
    };
    assert_eq!(light("\"rgb L\" [ 1 2 3 ] \"float scale\" 2", "Shape \"sphere\""), vec3(2.0, 4.0, 6.0));
    // Power = pi A L: a triangle of area 1/2.
    let triangle = format!("Shape \"trianglemesh\" {TRIANGLE}");
    let l = light("\"float power\" 10", &triangle);
    assert!((l.x * PI * 0.5 - 10.0).abs() < 1e-5);
    // Two sides, sphere of radius 2 after scaling: 2 pi 4 pi 4 L.
    let l = light("\"float power\" 10 \"bool twosided\" true", "Scale 2 2 2 Shape \"sphere\"");
    assert!((l.x * 2.0 * PI * 16.0 * PI - 10.0).abs() < 1e-5);
    // A colour stays a factor.
    let l = light("\"float power\" 10 \"rgb L\" [ 0 0.5 0 ]", &triangle);
    assert!((l.y * PI * 0.5 - 5.0).abs() < 1e-5 && l.x == 0.0);
}

#[test]
fn point_spot_distant_and_infinite_photometry() {
    let light = |text: &str| world(&format!("LightSource {text}")).lights[0].clone();
    let Light::Point { intensity, .. } = light("\"point\" \"float power\" 100") else { panic!() };
    assert!((intensity.x * 4.0 * PI - 100.0).abs() < 1e-4);
    // Blackbody colours have luminance 1 before the scale.
    let Light::Point { intensity, .. } = light("\"point\" \"blackbody I\" 3000 \"float scale\" 5") else {
        panic!()
    };
    assert!((intensity.dot(vec3(0.2126, 0.7152, 0.0722)) - 5.0).abs() < 0.01);
    assert!(intensity.x > intensity.y && intensity.y > intensity.z);
    // A cone without fall-off of half-angle 60 degrees covers 2 pi (1 - 1/2) = pi.
    let text = "\"spot\" \"float power\" 10 \"float coneangle\" 60 \"float conedeltaangle\" 0 \"point3 to\" [ 0 -2 0 ]";
    let Light::Spot { intensity, direction, .. } = light(text) else { panic!() };
    assert!((intensity.x * PI - 10.0).abs() < 1e-4);
    assert_eq!(direction, -Vec3::Y);
    let text = "\"distant\" \"point3 from\" [ 0 5 0 ] \"point3 to\" [ 0 0 0 ] \"float illuminance\" 3 \"float scale\" 2";
    let Light::Distant { direction, irradiance } = light(text) else { panic!() };
    assert_eq!((direction, irradiance), (-Vec3::Y, Vec3::splat(6.0)));
    let Light::Environment { radiance, .. } = light("\"infinite\" \"float illuminance\" 3") else { panic!() };
    assert!((radiance.x * PI - 3.0).abs() < 1e-5);
}

#[test]
fn environments_keep_rotation_and_mirroring() {
    let scene = world("Rotate -90 1 0 0 Scale 3 3 3 LightSource \"infinite\"");
    let Light::Environment { light_to_world, .. } = scene.lights[0] else { panic!() };
    assert!((light_to_world * Vec3::Z).abs_diff_eq(Vec3::Y, 1e-6));
    let scene = world("Scale -1 1 1 LightSource \"infinite\"");
    let Light::Environment { light_to_world, .. } = scene.lights[0] else { panic!() };
    assert_eq!(light_to_world.determinant(), -1.0);
}

#[test]
fn settings() {
    let scene = load(
        "Integrator \"path\"\nSampler \"independent\" \"integer pixelsamples\" 4\nPixelFilter \"sinc\"\n\
         Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 50 \"integer pixelbounds\" [ 10 20 5 15 ]\n\
         \"float iso\" 50 \"float exposuretime\" 4\n\
         Camera \"orthographic\" \"float screenwindow\" [ -2 2 -1 1 ]\nWorldBegin Shape \"sphere\"",
    );
    assert_eq!(scene.integrator.max_depth, 5);
    assert_eq!((scene.sampler.kind, scene.sampler.spp), (SamplerKind::Independent, Some(4)));
    assert_eq!(scene.filter, PixelFilter::BlackmanHarris { radius: [4.0; 2] });
    assert_eq!((scene.film.crop, scene.film.scale), (Some([10, 5, 20, 15]), 2.0));
    assert_eq!(scene.camera.screen_window, Some([-2.0, 2.0, -1.0, 1.0]));
    assert_eq!(scene.warnings.len(), 1);
}

#[test]
fn instances_place_definitions_with_their_own_transformation() {
    let scene = world(
        "ObjectBegin \"a\" Translate 1 0 0 Shape \"sphere\" ObjectEnd\n\
         Scale 2 2 2 ObjectInstance \"a\"",
    );
    assert!(scene.shapes.is_empty());
    let Geometry::Sphere { center, .. } = scene.objects[0].shapes[0].geometry else { panic!() };
    assert_eq!(center, Vec3::X);
    assert_eq!(scene.instances[0].object_to_world.transform_point3(center), vec3(2.0, 0.0, 0.0));
    assert_eq!(scene.bounds(), Some((vec3(0.0, -2.0, -2.0), vec3(4.0, 2.0, 2.0))));
}

#[test]
fn included_files_share_attributes_and_imported_ones_keep_them() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.pbrt"), "Translate 1 0 0\n").unwrap();
    let text = "WorldBegin Import \"a.pbrt\" LightSource \"point\" Include \"a.pbrt\" LightSource \"point\"";
    let scene = load_pbrt_text(text.as_bytes(), folder.path(), &LoadOptions::default()).unwrap();
    let x = |i: usize| match scene.lights[i] {
        Light::Point { position, .. } => position.x,
        _ => panic!(),
    };
    assert_eq!((x(0), x(1)), (0.0, 1.0));
}

#[test]
fn attributes_are_defaults_and_unknown_parameters_warn() {
    let scene = world(
        "Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" Shape \"sphere\" \"float radius\" 2 \"float raduis\" 1",
    );
    let radius = |i: usize| match scene.shapes[i].geometry {
        Geometry::Sphere { radius, .. } => radius,
        _ => panic!(),
    };
    assert_eq!((radius(0), radius(1)), (3.0, 2.0));
    assert_eq!(scene.warnings, ["text:3:83: parameter `raduis` of shape `sphere` is not known and ignored"]);
}
