//! OBJ and MTL in small: indices, fans, materials, framing.

use crate::description::{
    ColorInput, Conductor, FloatInput, Geometry, Light, MaterialKind, SceneDescription, TriangleMesh,
};
use glam::{Vec3, vec3};

fn load(obj: &str, mtl: &str) -> SceneDescription {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, obj).unwrap();
    let mut scene = crate::load(&path).unwrap();
    let prefix = format!("{}/", folder.path().display());
    scene.warnings.iter_mut().for_each(|warning| *warning = warning.replace(&prefix, ""));
    scene
}

fn mesh(scene: &SceneDescription) -> &TriangleMesh {
    match &scene.shapes[0].geometry {
        Geometry::Triangles(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn quads_polygons_negative_indices_and_continued_lines_with_crlf() {
    let plain = load(&format!("{SQUARE}f 1 2 3 4\n"), "");
    let odd = load(&format!("{SQUARE}f -4 -3 \\\n-2 -1\n").replace('\n', "\r\n"), "");
    for scene in [&plain, &odd] {
        assert_eq!(mesh(scene).indices, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh(scene).positions[2], [1.0, 1.0, 0.0]);
        assert!(mesh(scene).normals.is_none());
    }
    let pentagon = load(&format!("{SQUARE}v -1 0.5 0\nf 1 2 3 4 5\n"), "");
    assert_eq!(mesh(&pentagon).indices.len(), 3);
}

#[test]
fn incomplete_normals_are_dropped_with_a_warning() {
    let scene = load(&format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3\n"), "");
    assert!(mesh(&scene).normals.is_none());
    assert_eq!(
        scene.warnings,
        ["a.obj: some vertices of group `unnamed_object` have no normal: it is shaded flat"]
    );
}

fn kind(mtl: &str) -> MaterialKind {
    let scene = load(&format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3\n"), &format!("newmtl m\n{mtl}\n"));
    assert_eq!(scene.warnings, Vec::<String>::new());
    scene.materials[scene.shapes[0].material.0 as usize].kind.clone()
}

#[test]
fn materials_become_what_they_mean() {
    let grey = |v: f32| ColorInput::Constant(Vec3::splat(v));
    assert_eq!(kind("Kd 0.3 0.3 0.3\nKs 0 0 0"), MaterialKind::Diffuse { reflectance: grey(0.3) });
    // One number is a grey: tobj alone would panic on it.
    assert_eq!(kind("Kd 0.3"), MaterialKind::Diffuse { reflectance: grey(0.3) });
    let MaterialKind::CoatedDiffuse { roughness, eta, .. } =
        kind("Kd .5 .5 .5\nKs .04 .04 .04\nNs 198\nillum 2")
    else {
        panic!()
    };
    let FloatInput::Constant(alpha) = roughness.u else { panic!() };
    assert!((alpha - 0.1).abs() < 1e-6 && eta == 1.5 && !roughness.remap);
    let MaterialKind::Conductor { conductor: Conductor::Reflectance(color), .. } =
        kind("Kd 0 0 0\nKs .9 .9 .9\nillum 3\nPm 1\nPr 0.1")
    else {
        panic!()
    };
    assert_eq!(color, grey(0.9));
    let MaterialKind::Dielectric { eta, tint, .. } = kind("Ni 1.33\nillum 7\nTf 0.25 1 1\nNs 200") else {
        panic!()
    };
    assert_eq!((eta, tint), (1.33, ColorInput::Constant(vec3(0.5, 1.0, 1.0))));
}

#[test]
fn missing_libraries_materials_and_pictures_are_warnings() {
    let scene = load(&format!("mtllib b.mtl\n{SQUARE}usemtl m\nf 1 2 3\n"), "");
    assert_eq!(
        scene.warnings,
        [
            "b.mtl: there is no such file: its materials are grey",
            "a.obj:6:1: there is no material `m`: grey instead"
        ]
    );
    let scene = load(
        &format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3\n"),
        "newmtl m\nKd 1 0 0\nmap_Kd wood.png\nNs high\n",
    );
    assert_eq!(
        scene.warnings,
        [
            "a.mtl:4:1: `Ns high` is not understood here and ignored",
            "there is no picture `wood.png`: it is left out"
        ]
    );
}

#[test]
fn models_without_light_get_some_and_rooms_keep_their_own() {
    let scene = load(&format!("{SQUARE}f 1 2 3 4\n"), "");
    assert!(matches!(scene.lights[..], [Light::Environment { .. }, Light::Distant { .. }]));
    // The camera looks at the centre, and right in the picture is right of the view direction.
    let m = scene.camera.camera_to_world;
    let to_center = (vec3(0.5, 0.5, 0.0) - m.transform_point3(Vec3::ZERO)).normalize();
    let forward = m.transform_vector3(Vec3::Z);
    assert!(forward.abs_diff_eq(to_center, 1e-5));
    assert!(forward.cross(Vec3::Y).dot(m.transform_vector3(Vec3::X)) > 0.0);

    let room = load(&format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3 4\n"), "newmtl m\nKe 5 5 5\n");
    assert!(room.lights.is_empty() && room.shapes.len() == 1);
    assert!(room.shapes[0].emission.as_ref().is_some_and(|emission| emission.two_sided));
}

#[test]
fn pictures_with_options_and_alpha() {
    let folder = tempfile::tempdir().unwrap();
    image::RgbaImage::new(2, 2).save(folder.path().join("leaf 1.png")).unwrap();
    let mtl = "newmtl m\nKd 1 1 1\nmap_Kd -s 2 3 1 -clamp on leaf 1.png\n";
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    let obj = format!("mtllib a.mtl\n{SQUARE}vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    std::fs::write(folder.path().join("a.obj"), obj).unwrap();
    let scene = crate::load(&folder.path().join("a.obj")).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert!(matches!(scene.shapes[0].alpha, Some(FloatInput::Texture(_))));
    assert_eq!(scene.images.len(), 2);
    let crate::description::Texture::Image { mapping, .. } = scene.textures[0] else { panic!() };
    assert_eq!(mapping.scale, [2.0, 3.0]);
}
