//! What a scene does not need does not run. One test, since the counters are global to the process:
//! `cargo test -p sparing-render --features counters --test needs`.

mod common;

use common::{closed_box, diffuse, emitter, render_with, scene_with, shape, square};
use glam::Vec3;
use sparing_image::film::FilmOptions;
use sparing_render::RenderSettings;
use sparing_render::counters::{Counter, take};
use sparing_scene::SceneDescription;
use sparing_scene::description::{
    ColorInput, FloatInput, Geometry, Instance, Light, MaterialKind, MetallicRoughness, ObjectDefinition,
    Texture, TextureId, TriangleMesh, UvMapping,
};

const ALL: [Counter; 16] = [
    Counter::TextureLookup,
    Counter::TextureCoordinates,
    Counter::ShadingNormal,
    Counter::LightSample,
    Counter::LightPdf,
    Counter::Environment,
    Counter::NormalMap,
    Counter::Auxiliary,
    Counter::Shape,
    Counter::AlphaTest,
    Counter::Lens,
    Counter::Choice,
    Counter::VertexColor,
    Counter::Time,
    Counter::Motion,
    Counter::SecondUv,
];

/// Counters that ran while rendering.
fn ran(d: SceneDescription, options: FilmOptions) -> Vec<Counter> {
    for counter in ALL {
        let _ = take(counter);
    }
    render_with(d, RenderSettings::default(), 4, options);
    ALL.into_iter().filter(|c| take(*c) > 0).collect()
}

/// A wall in front of the camera, lit by one emitting square, and rays that miss both.
fn plain() -> SceneDescription {
    let mut d = scene_with(vec![diffuse(0.5)]);
    d.shapes = vec![
        shape(square(Vec3::Z * 3.0, Vec3::Y, Vec3::X)),
        emitter(square(Vec3::Z * -2.0, Vec3::Y, Vec3::NEG_X), 1.0),
        shape(square(Vec3::new(0.0, -1.0, 2.0), Vec3::Z, Vec3::X)),
    ];
    d
}

fn checker(d: &mut SceneDescription) -> TextureId {
    let (even, odd) = (ColorInput::Constant(Vec3::splat(0.4)), ColorInput::Constant(Vec3::splat(0.6)));
    d.textures.push(Texture::Checkerboard {
        mapping: UvMapping { scale: [8.0; 2], ..UvMapping::default() },
        even,
        odd,
    });
    TextureId(d.textures.len() as u32 - 1)
}

fn mesh(shape: &mut sparing_scene::description::Shape) -> &mut TriangleMesh {
    match &mut shape.geometry {
        Geometry::Triangles(m) => m,
        _ => unreachable!("the test's shapes are triangles"),
    }
}

#[test]
fn what_is_not_needed_does_not_run() {
    let none = FilmOptions::default();
    let base = vec![Counter::LightSample, Counter::LightPdf];
    assert_eq!(ran(plain(), none), base, "a diffuse scene with one light");

    // Each change to the scene starts just the code it needs.
    let mut d = plain();
    let t = checker(&mut d);
    d.materials[0].kind = MaterialKind::Diffuse { reflectance: ColorInput::Texture(t) };
    assert_eq!(
        ran(d, none),
        [&[Counter::TextureLookup, Counter::TextureCoordinates][..], &base].concat(),
        "texture"
    );

    let mut d = plain();
    let n = mesh(&mut d.shapes[0]).positions.len();
    mesh(&mut d.shapes[0]).normals = Some(vec![[0.1, 0.0, -1.0]; n]);
    assert_eq!(ran(d, none), [&[Counter::ShadingNormal][..], &base].concat(), "vertex normals");

    let mut d = plain();
    let t = checker(&mut d);
    d.materials[0].bump = Some(t);
    let expected = [
        Counter::TextureLookup,
        Counter::TextureCoordinates,
        Counter::LightSample,
        Counter::LightPdf,
        Counter::NormalMap,
    ];
    assert_eq!(ran(d, none), expected, "bump map");

    let mut d = plain();
    let t = checker(&mut d);
    d.shapes[2].alpha = Some(FloatInput::Texture(t));
    assert_eq!(
        ran(d, none),
        [&[Counter::TextureLookup][..], &base, &[Counter::AlphaTest]].concat(),
        "cut-out"
    );

    let mut d = plain();
    mesh(&mut d.shapes[0]).colors = Some(vec![[0.5, 1.0, 1.0, 1.0]; 4]);
    assert_eq!(ran(d.clone(), none), base, "colours of vertices that nothing asks for");
    d.materials[0].kind =
        MaterialKind::MetallicRoughness(MetallicRoughness { vertex_colors: true, ..Default::default() });
    let expected = [&[Counter::TextureCoordinates][..], &base, &[Counter::Choice, Counter::VertexColor]];
    assert_eq!(ran(d, none), expected.concat(), "colours of vertices");

    let mut d = plain();
    mesh(&mut d.shapes[0]).second_uvs = Some(vec![[0.5, 0.5]; 4]);
    assert_eq!(ran(d.clone(), none), base, "second texture coordinates that nothing asks for");
    let input = ColorInput::Texture(checker(&mut d));
    d.textures.push(Texture::SecondUv { input });
    let second = TextureId(d.textures.len() as u32 - 1);
    d.materials[0].kind = MaterialKind::Diffuse { reflectance: ColorInput::Texture(second) };
    let expected = [&[Counter::TextureLookup, Counter::TextureCoordinates][..], &base, &[Counter::SecondUv]];
    assert_eq!(ran(d, none), expected.concat(), "second texture coordinates");

    let mut d = plain();
    d.camera.lens_radius = 0.1;
    assert_eq!(ran(d, none), [&base[..], &[Counter::Lens]].concat(), "depth of field");

    let mut d = plain();
    d.lights.push(Light::Environment {
        radiance: Vec3::ONE,
        image: None,
        light_to_world: glam::Mat3::IDENTITY,
    });
    let expected = [Counter::LightSample, Counter::LightPdf, Counter::Environment, Counter::Choice];
    assert_eq!(ran(d, none), expected, "environment: two lights to choose from");

    let mut d = plain();
    d.shapes[1].emission = None;
    d.lights.push(Light::Point { position: Vec3::ZERO, intensity: Vec3::ONE });
    assert_eq!(ran(d, none), [Counter::LightSample], "a point light needs no weights");

    let mut d = plain();
    d.shapes[1].emission = None;
    assert_eq!(ran(d, none), [], "darkness needs nothing");

    let aux = FilmOptions { auxiliary: true, shapes: true, luminance: false };
    assert_eq!(ran(plain(), aux), [&base[..], &[Counter::Auxiliary, Counter::Shape]].concat(), "layers");

    // An instanced box: transforms are a need of their own.
    let mut d = plain();
    d.objects.push(ObjectDefinition { name: "box".into(), shapes: vec![shape(closed_box(0.3))] });
    d.instances.push(Instance::still(0, glam::Affine3A::from_translation(Vec3::Z * 2.0)));
    assert_eq!(ran(d.clone(), none), base, "instances");

    let moved = glam::Affine3A::from_translation(Vec3::new(0.5, 0.0, 2.0));
    d.instances[0].end = Some(moved);
    let ran_here = ran(d.clone(), none);
    assert!(ran_here.contains(&Counter::Time) && ran_here.contains(&Counter::Motion), "motion: {ran_here:?}");

    d.instances[0].end = None;
    d.camera.end = Some(glam::Mat4::from_translation(Vec3::X * 0.1));
    assert_eq!(ran(d, none), [&base[..], &[Counter::Time]].concat(), "a moving camera");
}
