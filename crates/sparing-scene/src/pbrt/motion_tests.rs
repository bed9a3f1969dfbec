//! Hand-computed checks of what moves.

use crate::description::{Motion, SceneDescription};
use crate::{LoadOptions, load_pbrt_text};
use glam::{Affine3A, Vec3, vec3};
use std::path::Path;

fn load(text: &str) -> SceneDescription {
    load_pbrt_text(text.as_bytes(), Path::new("tests/fixtures"), &LoadOptions::default()).unwrap()
}

fn world(text: &str) -> SceneDescription {
    load(&format!("Camera \"perspective\"\nWorldBegin\n{text}"))
}

/// Start and end of a point of an object.
fn way(scene: &SceneDescription, instance: usize, p: Vec3) -> [Vec3; 2] {
    let instance = &scene.instances[instance];
    [instance.object_to_world, instance.end.expect("it moves")].map(|m| m.transform_point3(p))
}

#[test]
fn active_transforms_change_one_end() {
    let scene = world(
        "AttributeBegin Translate 0 0 5
           ActiveTransform EndTime Translate 2 0 0 ActiveTransform StartTime Scale 3 3 3 ActiveTransform All
           Translate 0 1 0 Shape \"sphere\" AttributeEnd
         Shape \"sphere\"",
    );
    assert_eq!(way(&scene, 0, Vec3::X), [vec3(3.0, 3.0, 5.0), vec3(3.0, 1.0, 5.0)]);
    assert_eq!(scene.shapes.len(), 1, "the block has ended: the other sphere is at rest");
    assert!(scene.camera.end.is_none());
    // `ActiveTransform` is part of what blocks save, and systems of coordinates have both ends.
    let scene = world(
        "TransformBegin ActiveTransform EndTime Translate 2 0 0 CoordinateSystem \"there\" TransformEnd
         Translate 0 7 0 Shape \"sphere\" CoordSysTransform \"there\" Shape \"disk\"",
    );
    assert_eq!((scene.shapes.len(), scene.instances.len()), (1, 1));
    assert_eq!(way(&scene, 0, Vec3::ZERO), [Vec3::ZERO, vec3(2.0, 0.0, 0.0)]);
}

#[test]
fn objects_move_as_wholes_and_in_parts() {
    let scene = world(
        "ObjectBegin \"o\" Shape \"sphere\"
           AttributeBegin ActiveTransform EndTime Translate 1 0 0 Shape \"disk\" AttributeEnd ObjectEnd
         AttributeBegin Scale 2 2 2 ObjectInstance \"o\" AttributeEnd
         ActiveTransform EndTime Translate 0 3 0 ObjectInstance \"o\"",
    );
    // Twice the sphere and the disk; the first sphere is at rest.
    assert_eq!(scene.instances.len(), 4);
    assert!(scene.instances[0].end.is_none());
    assert_eq!(way(&scene, 1, Vec3::ZERO), [Vec3::ZERO, vec3(2.0, 0.0, 0.0)]);
    assert_eq!(way(&scene, 2, Vec3::ZERO), [Vec3::ZERO, vec3(0.0, 3.0, 0.0)]);
    assert_eq!(way(&scene, 3, Vec3::ZERO), [Vec3::ZERO, vec3(1.0, 3.0, 0.0)]);
}

#[test]
fn the_shutter_is_measured_in_times_of_the_motion() {
    let scene = load(
        "TransformTimes 2 6 ActiveTransform EndTime Translate 0 0 1 ActiveTransform All
         Camera \"perspective\" \"float shutteropen\" 3 \"float shutterclose\" 4
         WorldBegin Shape \"sphere\"",
    );
    assert_eq!(scene.camera.shutter, [0.25, 0.5]);
    // The matrix before the camera goes from the world to the camera.
    assert_eq!(scene.camera.end.expect("it moves").transform_point3(Vec3::ZERO), vec3(0.0, 0.0, -1.0));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(world("Shape \"sphere\"").camera.shutter, [0.0, 1.0]);
}

#[test]
fn what_emits_may_move_but_lights_without_shape_stand_still() {
    let scene = world(
        "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Scale 2 2 2
         AreaLightSource \"diffuse\" \"float power\" 6 Shape \"sphere\" LightSource \"point\"",
    );
    let emission = scene.objects[0].shapes[0].emission.as_ref().expect("it emits");
    // 6 W over pi times the area of a sphere of radius 2.
    let expected = 6.0 / (std::f32::consts::PI * 16.0 * std::f32::consts::PI);
    let crate::description::ColorInput::Constant(radiance) = emission.radiance else { panic!("a colour") };
    let luminance = radiance.dot(vec3(0.2126, 0.7152, 0.0722));
    assert!((luminance / expected - 1.0).abs() < 1e-3, "{luminance}, not {expected}");
    assert_eq!(scene.warnings.len(), 1);
    assert!(scene.warnings[0].contains("stands still"), "{:?}", scene.warnings);
}

#[test]
fn what_moves_is_written_and_read_back() {
    let scene = load(
        "ActiveTransform EndTime Rotate 5 0 1 0 ActiveTransform All
         Camera \"perspective\" \"float shutterclose\" 0.5
         WorldBegin
         ObjectBegin \"o\" Shape \"sphere\" ObjectEnd
         AttributeBegin ActiveTransform EndTime Rotate 90 0 0 1 ObjectInstance \"o\" AttributeEnd
         ActiveTransform StartTime Translate 0 2 0 Scale 1 2 3 AreaLightSource \"diffuse\" Shape \"disk\"",
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("moving.pbrt");
    crate::save_pbrt(&scene, &path).unwrap();
    let back = crate::load(&path).unwrap();
    assert!(back.warnings.is_empty(), "{:?}", back.warnings);
    assert_eq!(back.camera.shutter, [0.0, 0.5]);
    let close = |a: Affine3A, b: Affine3A| a.abs_diff_eq(b, 1e-5);
    let ends = |s: &SceneDescription, i: usize| (s.instances[i].object_to_world, s.instances[i].end.unwrap());
    assert_eq!(back.instances.len(), 2);
    for i in 0..2 {
        let ((a, b), (c, d)) = (ends(&scene, i), ends(&back, i));
        assert!(close(a, c) && close(b, d), "{a} {b} {c} {d}");
        assert!(Motion::new(c, d).is_some());
    }
    let emits = |s: &SceneDescription| s.objects[s.instances[1].object as usize].shapes[0].emission.is_some();
    assert!(emits(&scene) && emits(&back));
    assert!(back.camera.end.unwrap().abs_diff_eq(scene.camera.end.unwrap(), 1e-5));
}
