//! glTF in small: geometry, materials, cameras, lights. Pictures are checked in `sparing-render/tests/gltf.rs`.

use crate::description::{
    ColorInput, FloatInput, Geometry, Light, MaterialKind, MetallicRoughness, Projection, SceneDescription,
    Texture, TextureEncoding, TriangleMesh, UvMapping, Wrap,
};
use glam::{Vec3, Vec4, vec3};
use serde_json::{Value, json};

/// 64 characters, as in RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let word = group.iter().fold(0u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - group.len()));
        for i in 0..=group.len() {
            text.push(char::from(DIGITS[(word >> (18 - 6 * i) & 63) as usize]));
        }
    }
    text
}

/// Collects accessors and their bytes.
#[derive(Default)]
struct Data {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Data {
    fn add(&mut self, bytes: &[u8], count: usize, kind: &str, component: u32, normalized: bool) -> usize {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}));
        let view = self.views.len() - 1;
        let accessor = json!({"bufferView": view, "count": count, "type": kind, "componentType": component, "normalized": normalized});
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        self.add(&bytes, values.len(), ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N], 5126, false)
    }

    /// The rest of the file around a mesh that is at one node.
    fn file(&self, primitive: &Value, rest: &Value) -> Value {
        let mut file = json!({
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": self.bytes.len(), "uri": format!("data:application/octet-stream;base64,{}", base64(&self.bytes))}],
            "bufferViews": self.views, "accessors": self.accessors,
            "meshes": [{"primitives": [primitive]}],
            "nodes": [{"mesh": 0}],
        });
        for (key, value) in rest.as_object().expect("an object") {
            file[key] = value.clone();
        }
        file
    }
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

/// A square with a material and more.
fn square(rest: &Value) -> Value {
    let mut data = Data::default();
    let positions = data.floats(&SQUARE);
    let uvs = data.floats(&SQUARE.map(|[x, y, _]| [x, 1.0 - y]));
    let indices = data.add(&[0, 1, 2, 2, 1, 3], 6, "SCALAR", 5121, false);
    let mut primitive = json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices});
    if rest.get("materials").is_some() {
        primitive["material"] = json!(0);
    }
    data.file(&primitive, rest)
}

fn try_load(file: &Value) -> Result<SceneDescription, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, file.to_string()).unwrap();
    let prefix = format!("{}/", folder.path().display());
    crate::load(&path).map_err(|error| error.to_string().replace(&prefix, ""))
}

fn load(file: &Value) -> SceneDescription {
    try_load(file).unwrap()
}

fn mesh(scene: &SceneDescription) -> &TriangleMesh {
    match &scene.shapes[0].geometry {
        Geometry::Triangles(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn model(scene: &SceneDescription) -> &MetallicRoughness {
    match &scene.materials[0].kind {
        MaterialKind::MetallicRoughness(m) => m,
        other => panic!("{other:?}"),
    }
}

/// A 1x1 PNG with or without an alpha channel.
fn png(alpha: bool) -> Value {
    let mut bytes = std::io::Cursor::new(Vec::new());
    if alpha {
        image::RgbaImage::new(1, 1).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    } else {
        image::RgbImage::new(1, 1).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    }
    json!([{"uri": format!("data:image/png;base64,{}", base64(bytes.get_ref()))}])
}

#[test]
fn a_square_and_the_same_in_a_binary_file() {
    let file = square(&json!({}));
    let scene = load(&file);
    assert_eq!(mesh(&scene).indices, [[0, 1, 2], [2, 1, 3]]);
    // v = 0 is the bottom.
    assert_eq!(mesh(&scene).uvs.as_ref().unwrap()[..], SQUARE.map(|[x, y, _]| [x, y]));
    assert!(mesh(&scene).normals.is_none());
    assert_eq!(scene.warnings, Vec::<String>::new());
    // glTF's default is rough metal; a model without camera and light gets both.
    assert_eq!(model(&scene).metallic, FloatInput::Constant(1.0));
    assert!(matches!(scene.lights[..], [Light::Environment { .. }, Light::Distant { .. }]));

    let mut head = file;
    let uri = head["buffers"][0]["uri"].take();
    let binary = super::container::data_uri(uri.as_str().unwrap()).unwrap().unwrap().1;
    head["buffers"][0].as_object_mut().unwrap().remove("uri");
    let mut text = head.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + text.len() + binary.len()).to_le_bytes().map(|b| b).first_chunk::<4>().unwrap());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, &glb).unwrap();
    let same = crate::load(&path).unwrap();
    assert_eq!((&mesh(&same).positions, &mesh(&same).uvs), (&mesh(&scene).positions, &mesh(&scene).uvs));
    for cut in (0..glb.len()).step_by(7) {
        std::fs::write(&path, &glb[..cut]).unwrap();
        assert!(crate::load(&path).is_err(), "{cut}");
    }
}

#[test]
fn strips_fans_sparse_accessors_and_normalised_numbers() {
    let mut data = Data::default();
    let positions = data.floats(&SQUARE);
    let colors = data.add(&[255, 0, 51, 255, 255, 255, 0, 0, 0, 255, 255, 255], 4, "VEC3", 5121, true);
    // The third vertex is moved to (5, 6, 7) by a sparse accessor.
    let index = data.add(&[2], 1, "SCALAR", 5121, false);
    let value = data.floats(&[[5.0, 6.0, 7.0]]);
    data.accessors[positions]["sparse"] = json!({
        "count": 1, "indices": {"bufferView": index, "componentType": 5121}, "values": {"bufferView": value}});
    for (mode, expected) in [(5, [[0, 1, 2], [1, 3, 2]]), (6, [[1, 2, 0], [2, 3, 0]])] {
        let primitive = json!({"attributes": {"POSITION": positions, "COLOR_0": colors}, "mode": mode});
        let scene = load(&data.file(&primitive, &json!({})));
        assert_eq!(mesh(&scene).indices, expected);
        assert_eq!(mesh(&scene).positions[2], [5.0, 6.0, 7.0]);
        assert_eq!(mesh(&scene).colors.as_ref().unwrap()[0], [1.0, 0.0, 0.2, 1.0]);
        assert!(model(&scene).vertex_colors);
    }
}

#[test]
fn nodes_move_mirror_and_repeat() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // A quarter turn about y, after a shift along x: x becomes -z.
    let scene = load(&square(&json!({"nodes": [
        {"children": [1], "rotation": [0.0, half, 0.0, half]},
        {"mesh": 0, "translation": [2.0, 0.0, 0.0]}]})));
    let p = Vec3::from(mesh(&scene).positions[1]);
    assert!(p.abs_diff_eq(vec3(0.0, 0.0, -3.0), 1e-6), "{p}");
    // Mirrored space turns triangles over, so that the outside stays outside.
    let scene = load(&square(&json!({"nodes": [{"mesh": 0, "scale": [-1.0, 1.0, 1.0]}]})));
    assert_eq!(mesh(&scene).indices[0], [0, 2, 1]);
    assert_eq!(mesh(&scene).positions[1], [-1.0, 0.0, 0.0]);
    // Two places of one mesh: one object.
    let scene = load(&square(&json!({"nodes": [{"mesh": 0}, {"mesh": 0, "translation": [5.0, 0.0, 0.0]}]})));
    assert_eq!((scene.objects.len(), scene.instances.len(), scene.shapes.len()), (1, 2, 1));
    assert_eq!(Vec3::from(scene.instances[1].object_to_world.translation), vec3(5.0, 0.0, 0.0));
}

#[test]
fn cameras_and_lights() {
    let scene = load(&square(&json!({
        "extensionsUsed": ["KHR_lights_punctual"],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "aspectRatio": 0.5, "znear": 0.1}}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "color": [1.0, 0.5, 0.0], "intensity": 8.0, "range": 10.0},
            {"type": "directional", "intensity": 3.0},
            {"type": "spot", "intensity": 2.0, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.4}}]}},
        "nodes": [
            {"mesh": 0},
            {"camera": 0, "translation": [1.0, 2.0, 3.0]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0.0, 4.0, 0.0]},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}}]})));
    let m = scene.camera.camera_to_world;
    assert_eq!(m.x_axis, Vec4::X);
    assert_eq!(m.z_axis, Vec4::NEG_Z, "it looks along -z");
    assert_eq!(m.transform_point3(Vec3::ZERO), vec3(1.0, 2.0, 3.0));
    assert_eq!((scene.film.width, scene.film.height), (720, 1440));
    let Projection::Perspective { fov } = scene.camera.projection else { panic!() };
    assert!((fov.to_radians() - 2.0 * (0.5f32.tan() * 0.5).atan()).abs() < 1e-6);
    let point = Light::Point { position: vec3(0.0, 4.0, 0.0), intensity: vec3(8.0, 4.0, 0.0) };
    assert_eq!(scene.lights[0], point);
    let sun = Light::Distant { direction: Vec3::NEG_Z, irradiance: Vec3::splat(3.0) };
    assert_eq!(scene.lights[1], sun);
    let Light::Spot { direction, cone_angle, cone_delta, .. } = scene.lights[2] else { panic!() };
    assert!(direction == Vec3::NEG_Z && (cone_angle.to_radians() - 0.4).abs() < 1e-6);
    assert!((cone_delta.to_radians() - 0.3).abs() < 1e-6);
    assert_eq!(
        scene.warnings,
        [
            "extensions.KHR_lights_punctual.lights[0]: its `range` is ignored, light falls off with the square of the distance"
        ]
    );
    assert_eq!(scene.lights.len(), 3, "no further light");
}

#[test]
fn materials_and_extensions() {
    let textures = json!([{"source": 0, "sampler": 0}]);
    let info = |extension: Value| json!({"index": 0, "extensions": {"KHR_texture_transform": extension}});
    let scene = load(&square(&json!({
        "images": png(true), "textures": textures,
        "samplers": [{"wrapS": 33071, "wrapT": 33648}],
        "extensionsUsed": ["KHR_texture_transform", "EXT_nothing"],
        "materials": [{
            "name": "m", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
            "emissiveFactor": [1.0, 0.5, 0.0],
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.5, 0.5, 0.75], "baseColorTexture": info(json!({"scale": [2.0, 4.0]})),
                "metallicFactor": 0.5, "roughnessFactor": 0.25, "metallicRoughnessTexture": {"index": 0}},
            "normalTexture": {"index": 0, "scale": 0.5},
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 4.0},
                "KHR_materials_ior": {"ior": 1.25},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 2.0, 0.0]},
                "KHR_materials_transmission": {"transmissionFactor": 0.125},
                "KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatRoughnessTexture": {"index": 0}, "clearcoatRoughnessFactor": 0.5}}}]})));
    assert_eq!(scene.warnings, ["the extension `EXT_nothing` is not supported and ignored"]);
    let shape = &scene.shapes[0];
    let emission = shape.emission.as_ref().unwrap();
    assert_eq!(emission.radiance, ColorInput::Constant(vec3(4.0, 2.0, 0.0)));
    assert!(emission.two_sided && shape.alpha_cutoff == Some(0.25));
    let picture = |input: FloatInput| {
        let FloatInput::Texture(id) = input else { panic!("{input:?}") };
        let Texture::Image { image, scale, wrap, .. } = scene.textures[id.0 as usize] else { panic!() };
        assert_eq!(wrap, [Wrap::Clamp, Wrap::Mirror]);
        (scene.images[image.0 as usize].encoding, scale)
    };
    assert_eq!(picture(shape.alpha.unwrap()), (TextureEncoding::Alpha, 0.75));
    let m = model(&scene);
    assert_eq!(picture(m.metallic), (TextureEncoding::Blue, 0.5));
    assert_eq!(picture(m.roughness), (TextureEncoding::Green, 0.25));
    assert_eq!(picture(m.clearcoat_roughness), (TextureEncoding::Green, 0.5));
    let ColorInput::Texture(id) = m.base_color else { panic!() };
    let Texture::Image { mapping, scale, .. } = scene.textures[id.0 as usize] else { panic!() };
    assert_eq!(scale, 0.5);
    assert_eq!(mapping, UvMapping { scale: [2.0, 4.0], offset: [0.0, -3.0], cross: [0.0; 2] });
    assert_eq!(
        (m.eta, m.specular, m.transmission),
        (1.25, FloatInput::Constant(0.5), FloatInput::Constant(0.125))
    );
    assert_eq!(m.specular_color, ColorInput::Constant(vec3(1.0, 2.0, 0.0)));
    assert!(scene.materials[0].normal_map.is_some());
    // Brighter than white: it lights itself, and gets a camera only.
    assert!(scene.lights.is_empty());
}

#[test]
fn pictures_without_alpha_are_opaque_and_unlit_is_emission() {
    let file = |mode: &str, alpha: bool| {
        let material = json!({"alphaMode": mode, "extensions": {"KHR_materials_unlit": {}},
            "pbrMetallicRoughness": {"baseColorFactor": [1.0, 1.0, 1.0, 0.5], "baseColorTexture": {"index": 0}}});
        square(&json!({"images": png(alpha), "textures": [{"source": 0}], "materials": [material]}))
    };
    let scene = load(&file("BLEND", false));
    assert_eq!(
        (scene.shapes[0].alpha, scene.shapes[0].alpha_cutoff),
        (Some(FloatInput::Constant(0.5)), None)
    );
    assert!(matches!(load(&file("BLEND", true)).shapes[0].alpha, Some(FloatInput::Texture(_))));
    assert_eq!(load(&file("OPAQUE", true)).shapes[0].alpha, None);
    assert!(matches!(scene.shapes[0].emission.as_ref().unwrap().radiance, ColorInput::Texture(_)));
    let black = MaterialKind::Diffuse { reflectance: ColorInput::Constant(Vec3::ZERO) };
    assert_eq!(scene.materials[0].kind, black);
}

/// The corners of a picture go where the extension says: scaled, then turned, then moved, with v downwards.
#[test]
fn texture_transforms() {
    let file = |transform: Value| {
        let base = json!({"index": 0, "extensions": {"KHR_texture_transform": transform}});
        let material = json!({"pbrMetallicRoughness": {"baseColorTexture": base}});
        let scene = load(&square(
            &json!({"images": png(false), "textures": [{"source": 0}], "materials": [material]}),
        ));
        let Texture::Image { mapping, .. } = scene.textures[0] else { panic!() };
        // From coordinates of glTF to such, through ours.
        move |u: f32, v: f32| {
            let (v, UvMapping { scale, offset, cross }) = (1.0 - v, mapping);
            let (x, y) = (scale[0] * u + cross[0] * v + offset[0], cross[1] * u + scale[1] * v + offset[1]);
            glam::Vec2::new(x, 1.0 - y)
        }
    };
    let quarter = std::f32::consts::FRAC_PI_2;
    let all = file(json!({"offset": [0.25, 0.5], "rotation": quarter, "scale": [2.0, 3.0]}));
    // (1, 1) is scaled to (2, 3), turned to (3, -2) since v runs downwards, and moved.
    assert!(all(1.0, 1.0).abs_diff_eq(glam::Vec2::new(3.25, -1.5), 1e-5), "{}", all(1.0, 1.0));
    assert!(all(0.0, 0.0).abs_diff_eq(glam::Vec2::new(0.25, 0.5), 1e-5));
    let none = file(json!({}));
    assert_eq!(none(0.25, 0.75), glam::Vec2::new(0.25, 0.75));
}

#[test]
fn what_is_not_supported_is_said() {
    let message =
        try_load(&square(&json!({"extensionsRequired": ["KHR_draco_mesh_compression"]}))).unwrap_err();
    let expected = "a.gltf: extensionsRequired[0]: the file needs the extension `KHR_draco_mesh_compression`, which is not supported";
    assert_eq!(message, expected);
    let mut file = square(&json!({"animations": [{}], "skins": [{}], "nodes": [{"mesh": 0, "skin": 0}]}));
    file["meshes"][0]["primitives"][0]["targets"] = json!([{}]);
    let mut warnings = load(&file).warnings;
    warnings.sort();
    assert_eq!(
        warnings,
        [
            "animations are not supported: everything stands still",
            "morph targets are not supported: meshes are as they stand",
            "skins are not supported: meshes are as they stand",
        ]
    );
}

/// Half clear, half not: a mix whose parts bend normals as the material does, and whose clear part is glass of the file's
/// index.
#[test]
fn bodies_that_are_half_clear_keep_their_normal_map() {
    let scene = load(&square(&json!({
    "images": png(false), "textures": [{"source": 0}],
    "materials": [{
        "normalTexture": {"index": 0}, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5},
            "KHR_materials_volume": {"thicknessFactor": 1.0}, "KHR_materials_ior": {"ior": 1.3}},
    }]})));
    let material = &scene.materials[scene.shapes[0].material.0 as usize];
    let MaterialKind::Mix { materials, amount } = material.kind else { panic!("{material:?}") };
    assert_eq!(amount, FloatInput::Constant(0.5));
    for part in materials.map(|id| &scene.materials[id.0 as usize]) {
        assert!(part.normal_map.is_some() && part.normal_map == material.normal_map, "{part:?}");
    }
    let MaterialKind::Dielectric { eta, roughness, .. } = &scene.materials[materials[1].0 as usize].kind
    else {
        panic!()
    };
    assert_eq!((*eta, roughness.u), (1.3, FloatInput::Constant(0.25)));
}
