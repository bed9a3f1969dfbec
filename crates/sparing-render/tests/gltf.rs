//! What a glTF file says against what is rendered, in closed form: orientation, units, opacity, colours of vertices.
//! The same for the texture coordinates of OBJ.

mod common;

use common::{film_mean, render};
use glam::DVec3;
use sparing_render::{BuildOptions, RenderSettings, Scene};
use sparing_scene::SceneDescription;
use std::f64::consts::PI;
use std::path::Path;

/// A square from (-1, -1, 0) to (1, 1, 0) that faces +z: positions, texture
/// coordinates, colours and indices.
fn buffer(colors: [f32; 4]) -> Vec<u8> {
    let positions = [[-1.0f32, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let uvs = [[0.0f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let mut bytes: Vec<u8> = positions.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(uvs.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend([colors; 4].as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend([0, 1, 2, 0, 2, 3]);
    bytes
}

/// A 2x2 picture: red, green above blue, white; its alpha is 255, 255 above 51, 102.
fn write_picture(folder: &Path) {
    let rows = [[[255, 0, 0, 255], [0, 255, 0, 255]], [[0, 0, 255, 51], [255, 255, 255, 102]]];
    let picture = image::RgbaImage::from_fn(2, 2, |x, y| image::Rgba(rows[y as usize][x as usize]));
    picture.save(folder.join("picture.png")).expect("a picture");
}

/// The square with a material, seen from +z by an orthographic camera that it fills.
fn load(material: &str, nodes: &str, rest: &str, colors: [f32; 4]) -> SceneDescription {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.bin"), buffer(colors)).expect("a buffer");
    write_picture(folder.path());
    let color = if colors == [1.0; 4] { "" } else { ", \"COLOR_0\": 2" };
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"uri": "a.bin", "byteLength": 150}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 32}},
            {{"buffer": 0, "byteOffset": 80, "byteLength": 64}}, {{"buffer": 0, "byteOffset": 144, "byteLength": 6}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC4"}},
            {{"bufferView": 3, "componentType": 5121, "count": 6, "type": "SCALAR"}}],
        "images": [{{"uri": "picture.png"}}], "textures": [{{"source": 0, "sampler": 0}}],
        "samplers": [{{"wrapS": 33071, "wrapT": 33071}}],
        "materials": [{{{material}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1{color}}}, "indices": 3, "material": 0}}]}}],
        "cameras": [{{"type": "orthographic", "orthographic": {{"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}}}],
        "nodes": [{{"camera": 0, "translation": [0, 0, 5]}}, {{"mesh": 0}}{nodes}]{rest}}}"#
    );
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, text).expect("a file");
    let mut scene = sparing_scene::load(&path).unwrap_or_else(|error| panic!("{}", error.report()));
    assert_eq!(scene.warnings, Vec::<String>::new());
    prepare(&mut scene);
    // The picture is gone with the folder: carry it along.
    for image in &mut scene.images {
        if let sparing_scene::description::ImageSource::File(path) = &image.source {
            let bytes = std::fs::read(path).expect("the picture").into();
            let name = "picture.png".to_owned();
            image.source = sparing_scene::description::ImageSource::Bytes { name, bytes };
        }
    }
    scene
}

fn prepare(scene: &mut SceneDescription) {
    (scene.film.width, scene.film.height) = (8, 8);
    scene.filter = sparing_scene::description::PixelFilter::Box { radius: [0.5, 0.5] };
    scene.integrator.max_depth = 1;
}

/// Means of the middle of each quarter: top left, top right, bottom left, bottom right.
fn quarters(mut scene: SceneDescription, spp: u32) -> [DVec3; 4] {
    // A file without lights gets a sky.
    scene.lights.clear();
    let settings = RenderSettings { max_depth: 1, ..RenderSettings::default() };
    let film = render(scene, settings, spp);
    let means: Vec<DVec3> = film.map(|t, i| t.pixels[i].mean());
    let at = |x: usize, y: usize| means[y * 8 + x];
    [at(1, 1), at(6, 1), at(1, 6), at(6, 6)]
}

const UNLIT: &str = r#""extensions": {"KHR_materials_unlit": {}}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}"#;

#[test]
fn pictures_are_upright_and_not_mirrored() {
    let corners = quarters(load(UNLIT, "", "", [1.0; 4]), 16);
    for (found, expected) in corners.iter().zip([DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE]) {
        assert!(found.abs_diff_eq(expected, 1e-3), "{corners:?}");
    }
    // A quarter turn of the coordinates, counter-clockwise, turns the picture clockwise (about its top left corner,
    // hence the offset).
    let turned = UNLIT.replace(
        r#""index": 0"#,
        r#""index": 0, "extensions": {"KHR_texture_transform": {"rotation": 1.5707963, "offset": [0, 1]}}"#,
    );
    let corners = quarters(load(&turned, "", "", [1.0; 4]), 16);
    for (found, expected) in corners.iter().zip([DVec3::Z, DVec3::X, DVec3::ONE, DVec3::Y]) {
        assert!(found.abs_diff_eq(expected, 1e-3), "{corners:?}");
    }
}

#[test]
fn pictures_on_obj_files_are_upright() {
    let folder = tempfile::tempdir().expect("a folder");
    write_picture(folder.path());
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a file");
    // v = 0 is the bottom, and what emits shows the picture as it is.
    write("a.mtl", "newmtl m\nKd 0 0 0\nKe 1 1 1\nmap_Ke -clamp on picture.png\n");
    write(
        "a.obj",
        "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n",
    );
    let mut scene = sparing_scene::load(&folder.path().join("a.obj")).expect("it loads");
    prepare(&mut scene);
    scene.camera.projection = sparing_scene::description::Projection::Orthographic;
    scene.camera.screen_window = None;
    let corners = quarters(scene, 16);
    for (found, expected) in corners.iter().zip([DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE]) {
        assert!(found.abs_diff_eq(expected, 1e-3), "{corners:?}");
    }
}

/// Opacity is right in expectation where it blends, and a threshold where it masks. It is dark behind.
#[test]
fn opacity_blends_and_masks() {
    let blend = format!(r#"{UNLIT}, "alphaMode": "BLEND""#);
    let corners = quarters(load(&blend, "", "", [1.0; 4]), 4096);
    // One deviation of the mean is below 0.5 / 64 if samples were independent.
    for (found, expected) in corners.iter().zip([1.0, 1.0, 0.2, 0.4]) {
        assert!((found.max_element() - expected).abs() < 0.02, "{corners:?}");
    }
    let mask = format!(r#"{UNLIT}, "alphaMode": "MASK", "alphaCutoff": 0.3"#);
    let corners = quarters(load(&mask, "", "", [1.0; 4]), 16);
    for (found, expected) in corners.iter().zip([1.0, 1.0, 0.0, 1.0]) {
        assert!((found.max_element() - expected).abs() < 1e-3, "{corners:?}");
    }
    // The opacity of vertices is a factor: 0.7 * 102 / 255 is below the threshold.
    let material = r#""alphaMode": "MASK", "alphaCutoff": 0.3, "emissiveFactor": [1, 1, 1],
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}"#;
    let lights = r#", {"extensions": {"KHR_lights_punctual": {"light": 0}}}"#;
    let dark = r#", "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 0}]}}"#;
    let corners = quarters(load(material, lights, dark, [1.0, 1.0, 1.0, 0.7]), 16);
    for (found, expected) in corners.iter().zip([1.0, 1.0, 0.0, 0.0]) {
        assert!((found.max_element() - expected).abs() < 1e-3, "{corners:?}");
    }
}

/// A matte square: the dielectric's reflection is off.
const MATTE: &str = r#""extensions": {"KHR_materials_specular": {"specularFactor": 0}},
    "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.5, 0.25, 1, 1]}"#;

fn lit(light: &str, colors: [f32; 4], place: &str) -> DVec3 {
    let node = format!(r#", {{"extensions": {{"KHR_lights_punctual": {{"light": 0}}}}{place}}}"#);
    let light = format!(r#", "extensions": {{"KHR_lights_punctual": {{"lights": [{light}]}}}}"#);
    let mut scene = load(MATTE, &node, &light, colors);
    scene.film.crop = Some([3, 3, 5, 5]);
    let film = render(scene, RenderSettings { max_depth: 1, ..RenderSettings::default() }, 64);
    film.map(|t, i| t.pixels[i].mean()).into_iter().sum::<DVec3>() / 4.0
}

#[test]
fn candela_and_lux() {
    let albedo = DVec3::new(0.5, 0.25, 1.0);
    // 3 lx straight on: radiance albedo * 3 / pi.
    let sun = lit(r#"{"type": "directional", "intensity": 3}"#, [1.0; 4], "");
    assert!(sun.abs_diff_eq(albedo * 3.0 / PI, 1e-3), "{sun}");
    // 8 cd at a distance of 20: 8 / 400 lx; the middle of the square is nearly right below.
    let far = r#", "translation": [0, 0, 20]"#;
    let point = lit(r#"{"type": "point", "intensity": 8000, "color": [1, 1, 0]}"#, [1.0; 4], far);
    assert!(point.abs_diff_eq(albedo * DVec3::new(20.0, 20.0, 0.0) / PI, 0.01), "{point}");
    // A spot looks along -z of its node and has its whole intensity within the inner cone.
    let spot =
        r#"{"type": "spot", "intensity": 8000, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.5}}"#;
    let spot = lit(spot, [1.0; 4], far);
    assert!(spot.abs_diff_eq(albedo * 20.0 / PI, 0.01), "{spot}");
    // Between the cones its strength is the square of t, from the cosines: the axis turned by 0.4 from straight down.
    let turned = r#", "translation": [0, 0, 20], "rotation": [0.19866933, 0, 0, 0.98006658]"#;
    let edge =
        r#"{"type": "spot", "intensity": 8000, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.5}}"#;
    let edge = lit(edge, [1.0; 4], turned);
    let t = (0.4f64.cos() - 0.5f64.cos()) / (0.3f64.cos() - 0.5f64.cos());
    assert!(edge.abs_diff_eq(albedo * (20.0 * t * t / PI), 0.02), "{edge}, t = {t}");
    // Colours of vertices are a factor.
    let tinted = lit(r#"{"type": "directional", "intensity": 3}"#, [0.5, 1.0, 0.25, 1.0], "");
    assert!(tinted.abs_diff_eq(albedo * DVec3::new(0.5, 1.0, 0.25) * 3.0 / PI, 1e-3), "{tinted}");
}

#[test]
fn emissive_strength_is_radiance() {
    let material = r#""emissiveFactor": [1, 0.5, 0.25], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}},
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}"#;
    let corners = quarters(load(material, "", "", [1.0; 4]), 16);
    assert!(corners.iter().all(|c| c.abs_diff_eq(DVec3::new(8.0, 4.0, 2.0), 1e-3)), "{corners:?}");
    // Without doubleSided only the front emits: from behind it is dark.
    let turned = load(material, r#", {"name": "nothing"}"#, "", [1.0; 4]);
    let mut behind = turned.clone();
    behind.camera.camera_to_world =
        glam::Mat4::from_rotation_y(std::f32::consts::PI) * turned.camera.camera_to_world;
    let (mean, _) =
        film_mean(&render(behind, RenderSettings { max_depth: 0, ..RenderSettings::default() }, 16));
    assert!(mean.abs() < 1e-6, "{mean}");
}

/// What a file does not use is not needed.
#[test]
fn opaque_scenes_need_no_filters() {
    let scene = load(UNLIT, "", "", [1.0; 4]);
    let built = Scene::build(scene, BuildOptions::default()).expect("it builds");
    assert!(!built.needs().contains(sparing_render::Needs::ALPHA | sparing_render::Needs::VERTEX_COLORS));
}

/// The square with two sets of texture coordinates, the second mirrored, and tangents that point up; lit by 1 lx times pi
/// from 45 degrees above the camera. `picture.png` is texture 0, a normal map that leans along its x axis texture 1.
fn two_sets(material: &str, attributes: &str) -> (SceneDescription, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = buffer([1.0; 4])[..80].to_vec();
    let mirrored = [[1.0f32, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]];
    bytes.extend(mirrored.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    let up = [[0.0f32, 1.0, 0.0, 1.0]; 4];
    bytes.extend(up.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend([0, 1, 2, 0, 2, 3]);
    std::fs::write(folder.path().join("a.bin"), bytes).expect("a buffer");
    write_picture(folder.path());
    let lean = image::RgbImage::from_pixel(1, 1, image::Rgb([204, 128, 230]));
    lean.save(folder.path().join("lean.png")).expect("a picture");
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"uri": "a.bin", "byteLength": 182}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 176}}, {{"buffer": 0, "byteOffset": 176, "byteLength": 6}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"bufferView": 0, "byteOffset": 80, "componentType": 5126, "count": 4, "type": "VEC2"}},
            {{"bufferView": 0, "byteOffset": 112, "componentType": 5126, "count": 4, "type": "VEC4"}},
            {{"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"}}],
        "images": [{{"uri": "picture.png"}}, {{"uri": "lean.png"}}],
        "textures": [{{"source": 0, "sampler": 0}}, {{"source": 1}}], "samplers": [{{"wrapS": 33071, "wrapT": 33071}}],
        "materials": [{{{material}, "extensions": {{"KHR_materials_specular": {{"specularFactor": 0}}}}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0{attributes}}}, "indices": 4, "material": 0}}]}}],
        "cameras": [{{"type": "orthographic", "orthographic": {{"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}}}],
        "extensions": {{"KHR_lights_punctual": {{"lights": [{{"type": "directional", "intensity": 3.14159265}}]}}}},
        "nodes": [{{"camera": 0, "translation": [0, 0, 5]}}, {{"mesh": 0}},
            {{"rotation": [-0.38268343, 0, 0, 0.92387953], "extensions": {{"KHR_lights_punctual": {{"light": 0}}}}}}]}}"#
    );
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, text).expect("a file");
    let mut scene = sparing_scene::load(&path).unwrap_or_else(|error| panic!("{}", error.report()));
    assert_eq!(scene.warnings, Vec::<String>::new());
    prepare(&mut scene);
    // The folder has the pictures.
    (scene, folder)
}

/// Corners as in [`quarters`], with the scene's own light.
fn lit_corners((scene, _folder): (SceneDescription, tempfile::TempDir)) -> [DVec3; 4] {
    let settings = RenderSettings { max_depth: 1, ..RenderSettings::default() };
    let means: Vec<DVec3> = render(scene, settings, 64).map(|t, i| t.pixels[i].mean());
    [9, 14, 49, 54].map(|i: usize| means[i])
}

/// Emission reads the first set and shows the picture as it is, the base colour the second and shows it mirrored.
#[test]
fn textures_have_their_own_set_of_coordinates() {
    let material = r#""emissiveFactor": [0.5, 0.5, 0.5], "emissiveTexture": {"index": 0}, "pbrMetallicRoughness":
        {"metallicFactor": 0, "baseColorTexture": {"index": 0, "texCoord": 1}}"#;
    let corners = lit_corners(two_sets(material, r#", "TEXCOORD_0": 1, "TEXCOORD_1": 2"#));
    let [red, green, blue, white] = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
    // pi lx at 45 degrees on white: the root of 1/2.
    let half = 0.5f64.sqrt();
    let expected = [
        red * 0.5 + green * half,
        green * 0.5 + red * half,
        blue * 0.5 + white * half,
        white * 0.5 + blue * half,
    ];
    for (found, expected) in corners.iter().zip(expected) {
        // Each sample chooses between the light and the square itself.
        assert!(found.abs_diff_eq(expected, 0.03), "{corners:?}, not {expected:?}");
    }
}

/// The normal map leans by (0.6, 0, 0.8) along its x axis: to the right by the texture coordinates, up with the file's
/// tangents. The light comes from above at 45 degrees.
#[test]
fn tangents_of_the_file_turn_normal_maps() {
    let material = r#""normalTexture": {"index": 1}, "pbrMetallicRoughness": {"metallicFactor": 0}"#;
    let [x, y, z] = [204.0, 128.0, 230.0].map(|v: f64| v / 127.5 - 1.0);
    let length = (x * x + y * y + z * z).sqrt();
    let right = (y + z) / length * 0.5f64.sqrt();
    let up = (x + z) / length * 0.5f64.sqrt();
    assert!((right - 0.5694).abs() < 1e-4 && (up - 0.9896).abs() < 1e-4, "{right} {up}");
    for (tangent, expected) in [("", right), (r#", "TANGENT": 3"#, up)] {
        let corners = lit_corners(two_sets(material, &format!(r#", "TEXCOORD_0": 1{tangent}"#)));
        assert!((corners[0].x - expected).abs() < 2e-3, "{tangent}: {corners:?}, not {expected}");
    }
}
