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

#[test]
fn concave_faces_are_clipped() {
    let arrow = "v 2 -1 0\nv .5 0 0\nv 2 1 0\nv 0 0 0\nf 1 2 3 4\n";
    let scene = load(arrow, "");
    let corners = |t: &[u32; 3]| t.map(|i| mesh(&scene).positions[i as usize][0]);
    // The diagonal is from the notch (0.5) to the tip (0).
    let all: Vec<[f32; 3]> = mesh(&scene).indices.iter().map(corners).collect();
    assert!(all.iter().all(|t| t.contains(&0.5) && t.contains(&0.0)), "{all:?}");
}

#[test]
fn smoothing_groups_share_normals_and_other_faces_are_flat() {
    // Two walls that meet at a right angle along an edge, and a third in another group.
    let walls = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 1\nv 1 1 1\n";
    let scene = load(&format!("{walls}s 1\nf 1 3 4 2\nf 1 2 6 5\ns off\nf 3 7 8 4\n"), "");
    let mesh = mesh(&scene);
    let normals = mesh.normals.as_ref().unwrap();
    let at = |p: [f32; 3]| -> Vec<Vec3> {
        let all = mesh.positions.iter().zip(normals);
        all.filter(|(q, _)| **q == p).map(|(_, n)| Vec3::from(*n)).collect()
    };
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!(at([0.0, 0.0, 0.0])[0].abs_diff_eq(vec3(half, 0.0, half), 1e-6), "{:?}", at([0.0; 3]));
    assert_eq!(at([0.0, 0.0, 0.0]).len(), 1);
    // The shared edge of the flat wall has both normals.
    let mut both = at([1.0, 0.0, 0.0]);
    both.sort_by(|a, b| a.x.total_cmp(&b.x));
    both.dedup();
    assert!(both[0].abs_diff_eq(Vec3::NEG_X, 1e-6) && both[1].abs_diff_eq(Vec3::Z, 1e-6), "{both:?}");
}

#[test]
fn marks_comments_weights_and_faces_before_vertices() {
    let plain = load(&format!("{SQUARE}f 1 2 3 4\n"), "");
    let faces_first = load(&format!("f 1 2 3 4\n{SQUARE}"), "");
    let odd =
        format!("\u{feff}{}f 1 2 3 4 # a face\nl 1 2\np 1\n", SQUARE.replace("1 1 0", "2 2 0 2 # half"));
    for scene in [&faces_first, &load(&odd, "")] {
        assert_eq!(mesh(scene).positions, mesh(&plain).positions);
        assert_eq!(mesh(scene).indices, mesh(&plain).indices);
        assert_eq!(scene.warnings, Vec::<String>::new());
    }
    let skipped = load(&format!("{SQUARE}f 1 2\nf 1 2 3 4\n"), "");
    assert_eq!(skipped.warnings, ["a.obj: 1 faces with fewer than three corners are left out"]);
}

#[test]
fn groups_and_materials_that_come_again_are_one_shape() {
    let text = format!(
        "mtllib a.mtl\n{SQUARE}g one\nusemtl m\nf 1 2 3\nusemtl k\nf 1 3 4\nusemtl m\nf 2 3 4\ng two\nf 1 2 4\n"
    );
    let scene = load(&text, "newmtl m\nKd 1 0 0\nnewmtl k\nKd 0 1 0\n");
    let sizes: Vec<usize> = scene
        .shapes
        .iter()
        .map(|shape| if let Geometry::Triangles(mesh) = &shape.geometry { mesh.indices.len() } else { 0 })
        .take(3)
        .collect();
    assert_eq!(sizes, [2, 1, 1]);
}

#[test]
fn names_with_spaces_mixed_line_ends_and_map_options() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    image::RgbaImage::new(2, 2).save(path("old wood.png")).unwrap();
    let maps = "map_Kd -blendu on -s 2 3 1 -o 0.5 0.25 -t 0 0 0 -mm 0 1 -texres 64 old wood.png\r\
                map_Bump -bm 0.5 -imfchan g -clamp on old wood.png\nmap_Ke -cc on -boost 2 old wood.png\r\n";
    std::fs::write(path("my lib.mtl"), format!("\u{feff}newmtl red paint\r\nKd 1 1 1\r{maps}")).unwrap();
    let obj = format!("mtllib my lib.mtl\r\n{SQUARE}vt 0 0\nusemtl red paint\nf 1/1 2/1 3/1\n");
    std::fs::write(path("my scene.obj"), obj).unwrap();
    let scene = crate::load(&path("my scene.obj")).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    let material = &scene.materials[scene.shapes[0].material.0 as usize];
    assert_eq!(material.name, "red paint");
    let MaterialKind::Diffuse { reflectance: ColorInput::Texture(id) } = material.kind else { panic!() };
    let crate::description::Texture::Image { mapping, .. } = scene.textures[id.0 as usize] else { panic!() };
    assert_eq!((mapping.scale, mapping.offset), ([2.0, 3.0], [0.5, 0.25]));
    let bump = &scene.textures[material.bump.unwrap().0 as usize];
    let crate::description::Texture::Image { image, wrap, scale, .. } = bump else { panic!() };
    assert_eq!((*wrap, *scale), ([crate::description::Wrap::Clamp; 2], 0.5));
    assert_eq!(scene.images[image.0 as usize].encoding, crate::description::TextureEncoding::Green);
    assert!(scene.shapes[0].emission.is_some());
}

/// Colours of vertices are sRGB: 0.5 is 0.214 of the light. They count where there is no material, and a part has them
/// at all of its vertices or not at all.
#[test]
fn colours_of_vertices() {
    let colored = "v 0 0 0 1 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 0 2 0 1\n";
    let scene = load(&format!("{colored}f 1 2 3\n"), "");
    let linear = ((0.5f32 + 0.055) / 1.055).powf(2.4);
    assert!((linear - 0.214_04).abs() < 1e-5);
    let found = mesh(&scene).colors.as_ref().unwrap();
    let expected = [[1.0, 0.0, 0.0, 1.0], [linear, linear, linear, 1.0], [0.0, 1.0, 0.0, 1.0]];
    for (f, e) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((f - e).abs() < 1e-6, "{found:?}");
    }
    let MaterialKind::MetallicRoughness(m) = &scene.materials[scene.shapes[0].material.0 as usize].kind
    else {
        panic!()
    };
    assert!(m.vertex_colors && m.specular == FloatInput::Constant(0.0), "matte");
    assert_eq!(scene.warnings, Vec::<String>::new());
    // With a material, its colour counts.
    let scene = load(&format!("mtllib a.mtl\n{colored}usemtl m\nf 1 2 3\n"), "newmtl m\nKd 0.3\n");
    assert!(mesh(&scene).colors.is_none());
    // Only some have a colour.
    let scene = load(&format!("v 0 0 1\n{colored}g a\nf 2 3 4\ng b\nf 1 2 3\n"), "");
    assert!(mesh(&scene).colors.is_some());
    assert_eq!(scene.warnings, ["a.obj: some vertices of group `b` have no colour: it is grey"]);
}

#[test]
fn maps_of_metalness_and_roughness() {
    use crate::description::{Texture, TextureEncoding};
    let folder = tempfile::tempdir().unwrap();
    for name in ["metal.png", "rough.png"] {
        image::GrayImage::new(1, 1).save(folder.path().join(name)).unwrap();
    }
    // `Pm` and `Pr` give way to their maps.
    let mtl = "newmtl m\nKd 0.8 0.6 0.2\nPm 1\nPr 0.25\nmap_Pm metal.png\nmap_Pr -s 2 2 rough.png\nKs 0.04\n";
    std::fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    std::fs::write(folder.path().join("a.obj"), format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3\n"))
        .unwrap();
    let scene = crate::load(&folder.path().join("a.obj")).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    let kind = |id: crate::description::MaterialId| &scene.materials[id.0 as usize].kind;
    let MaterialKind::Mix { materials, amount } = kind(scene.shapes[0].material) else { panic!() };
    let picture = |input: &FloatInput| {
        let FloatInput::Texture(id) = input else { panic!("{input:?}") };
        let Texture::Image { image, mapping, scale, .. } = scene.textures[id.0 as usize] else { panic!() };
        let crate::description::ImageSource::File(path) = &scene.images[image.0 as usize].source else {
            panic!()
        };
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        (name, scene.images[image.0 as usize].encoding, mapping.scale, scale)
    };
    assert_eq!(picture(amount), ("metal.png".to_owned(), TextureEncoding::Red, [1.0; 2], 1.0));
    let kd = ColorInput::Constant(vec3(0.8, 0.6, 0.2));
    let MaterialKind::CoatedDiffuse { reflectance, roughness, .. } = kind(materials[0]) else { panic!() };
    assert_eq!(*reflectance, kd);
    assert_eq!(picture(&roughness.u), ("rough.png".to_owned(), TextureEncoding::Linear, [2.0; 2], 1.0));
    let MaterialKind::Conductor { conductor: Conductor::Reflectance(color), roughness } = kind(materials[1])
    else {
        panic!()
    };
    assert_eq!(*color, kd);
    assert_eq!(picture(&roughness.v).0, "rough.png");
}
