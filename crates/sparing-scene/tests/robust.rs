//! Whatever the bytes, loading ends, with a scene or an error: never a panic, within the limits.

use proptest::prelude::*;
use sparing_scene::{ErrorKind, LoadOptions, load_pbrt_text, load_with};
use std::path::Path;

const VALID: &str = include_str!("fixtures/everything.pbrt");
const OLDER: &str = include_str!("fixtures/older.pbrt");

fn limits() -> LoadOptions {
    LoadOptions {
        max_values: 1000,
        max_entities: 1000,
        max_nesting: 20,
        max_triangles: 20_000,
        ..LoadOptions::default()
    }
}

fn text(text: &[u8]) {
    if let Ok(scene) = load_pbrt_text(text, Path::new("tests/fixtures"), &limits()) {
        scene.validate().unwrap();
    }
}

fn obj(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, bytes).unwrap();
    std::fs::write(folder.path().join("a.mtl"), bytes).unwrap();
    if let Ok(scene) = load_with(&path, &limits()) {
        scene.validate().unwrap();
    }
}

fn ply(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, bytes).unwrap();
    if let Ok(scene) = load_with(&path, &limits()) {
        scene.validate().unwrap();
    }
}

/// A small mesh, binary (with everything) or as text.
fn valid_ply(binary: bool) -> Vec<u8> {
    let mut mesh = sparing_scene::generate::icosphere(0);
    mesh.uvs = Some(vec![[0.0; 2]; mesh.positions.len()]);
    mesh.colors = Some(vec![[0.5; 4]; mesh.positions.len()]);
    let mut bytes = Vec::new();
    sparing_scene::write_ply(&mesh, &mut bytes).unwrap();
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty double y\nproperty int z\n\
                property list uchar int more\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0 0 1 0 0 1 7 1 1 0 2 1 1 0 1 0 0 9 9 9 0\n4 0 1 2 3 5 0 1 2 3 4\n";
    if binary { bytes } else { text.as_bytes().to_vec() }
}

fn edit(bytes: &mut Vec<u8>, edits: Vec<(prop::sample::Index, u8, u8)>) {
    for (at, value, kind) in edits {
        if bytes.is_empty() {
            break;
        }
        let at = at.index(bytes.len());
        match kind {
            0 => bytes[at] = value,
            1 => drop(bytes.remove(at)),
            _ => bytes.truncate(at.max(1)),
        }
    }
}

/// A glTF file that uses most of what there is.
const GLTF: &str = r#"{"asset": {"version": "2.0"},
"buffers": [{"byteLength": 44, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA="}],
"bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
 {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
 {"componentType": 5126, "count": 3, "type": "VEC2", "sparse": {"count": 1,
  "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}}],
"images": [{"uri": "a.png"}], "samplers": [{"wrapS": 33071}], "textures": [{"source": 0, "sampler": 0}],
"materials": [{"alphaMode": "BLEND", "emissiveFactor": [1, 2, 3],
 "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "baseColorTexture": {"index": 0}},
 "extensions": {"KHR_materials_ior": {"ior": 1.5}, "KHR_materials_volume": {"thicknessFactor": 1},
  "KHR_materials_transmission": {"transmissionFactor": 0.5}}}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 2, "NORMAL": 0}, "indices": 1, "material": 0,
 "mode": 5}]}],
"cameras": [{"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 2}}],
"extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {"outerConeAngle": 1}}]}},
"nodes": [{"mesh": 0, "children": [1, 2]}, {"mesh": 0, "matrix": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]},
 {"camera": 0, "rotation": [0, 0, 0, 1], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
"scenes": [{"nodes": [0]}], "scene": 0}"#;

fn gltf(bytes: &[u8], binary: bool) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let mut file = Vec::new();
    if binary {
        file.extend(b"glTF\x02\0\0\0");
        file.extend((20 + bytes.len() as u32).to_le_bytes());
        file.extend((bytes.len() as u32).to_le_bytes());
        file.extend(b"JSON");
    }
    file.extend(bytes);
    std::fs::write(&path, file).unwrap();
    if let Ok(scene) = load_with(&path, &limits()) {
        scene.validate().unwrap();
    }
}

#[test]
fn the_valid_gltf_file_is_valid() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, GLTF).unwrap();
    let scene = sparing_scene::load(&path).unwrap_or_else(|error| panic!("{}", error.report()));
    assert!(scene.shapes.len() == 2 && scene.lights.len() == 1);
}

#[test]
fn the_valid_scene_is_valid() {
    let scene =
        load_pbrt_text(VALID.as_bytes(), Path::new("tests/fixtures"), &LoadOptions::default()).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    let older =
        load_pbrt_text(OLDER.as_bytes(), Path::new("tests/fixtures"), &LoadOptions::default()).unwrap();
    assert_eq!(older.warnings, Vec::<String>::new());
}

/// Words that a scene is made of, for texts that get further than random bytes.
fn words() -> impl Strategy<Value = String> {
    let word = prop::sample::select(
        VALID.split_ascii_whitespace().chain(OLDER.split_ascii_whitespace()).collect::<Vec<_>>(),
    );
    prop::collection::vec(word, 0..60).prop_map(|words| words.join(" "))
}

fn obj_lines() -> impl Strategy<Value = String> {
    let key = prop::sample::select(vec![
        "v", "vt", "vn", "f", "l", "p", "g", "o", "usemtl", "mtllib", "newmtl", "Kd", "Ks", "Ke", "Ns", "d",
        "illum", "map_Kd", "Tf", "Pr", "Ni", "s", "#", "map_Bump", "norm",
    ]);
    let value = prop::sample::select(vec![
        "0",
        "1",
        "2",
        "3",
        "-1",
        "-2",
        "1/1/1",
        "2//2",
        "3/3",
        "0.5",
        "1e30",
        "1e39",
        "nan",
        "a",
        "a.mtl",
        "-bm",
        "-s",
        "",
        "9223372036854775807",
        "-9223372036854775808",
        "1/9999999999999999999",
        "\\",
        "6",
    ]);
    let line = (key, prop::collection::vec(value, 0..6))
        .prop_map(|(key, values)| format!("{key} {}\n", values.join(" ")));
    prop::collection::vec(line, 0..40).prop_map(|lines| lines.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn arbitrary_bytes(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        text(&bytes);
        obj(&bytes);
    }

    #[test]
    fn mutated_scenes(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 1..8),
        older in any::<bool>(),
    ) {
        let mut bytes = if older { OLDER } else { VALID }.as_bytes().to_vec();
        edit(&mut bytes, edits);
        text(&bytes);
    }

    #[test]
    fn mutated_ply_files(
        binary in any::<bool>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 0..8)
    ) {
        let mut bytes = valid_ply(binary);
        edit(&mut bytes, edits);
        ply(&bytes);
    }

    #[test]
    fn mutated_gltf_files(
        binary in any::<bool>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0u8..3), 0..4),
        numbers in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(vec![
            "0", "1", "2", "-1", "4294967295", "1e300", "0.5", "null", "[]", "{}", "\"\"", "99999999999999999999",
        ])), 0..4)
    ) {
        // Numbers in place of others get further than random bytes.
        let mut words: Vec<String> = GLTF.split_inclusive([',', ':', '[']).map(str::to_owned).collect();
        for (at, number) in numbers {
            let word = at.get(&words).clone();
            let digits = word.trim_start_matches([' ', '\n']);
            if digits.starts_with(|c: char| c.is_ascii_digit()) {
                let end: String = digits.chars().skip_while(|c| c.is_ascii_digit() || *c == '.').collect();
                let i = at.index(words.len());
                words[i] = format!("{number}{end}");
            }
        }
        let mut bytes = words.concat().into_bytes();
        edit(&mut bytes, edits.into_iter().filter(|e| e.2 < 2).collect());
        gltf(&bytes, binary);
    }

    #[test]
    fn shuffled_words(words in words()) {
        text(words.as_bytes());
        text(format!("WorldBegin {words}").as_bytes());
    }

    #[test]
    fn shuffled_obj_lines(lines in obj_lines()) {
        obj(format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n{lines}").as_bytes());
    }
}

#[test]
fn every_limit_names_itself() {
    let sphere = "Shape \"sphere\"\n";
    let mesh = "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]\n";
    let folder = tempfile::tempdir().unwrap();
    for i in 0..40 {
        let next = format!("Include \"{}.pbrt\"\n{sphere}", i + 1);
        std::fs::write(folder.path().join(format!("{i}.pbrt")), next).unwrap();
    }
    std::fs::write(folder.path().join("40.pbrt"), sphere).unwrap();
    let small = LoadOptions {
        max_values: 8,
        max_entities: 5,
        max_nesting: 3,
        max_triangles: 2,
        ..LoadOptions::default()
    };
    let cases = [
        ("max_values", mesh.to_owned(), small.clone()),
        ("max_entities", sphere.repeat(9), small.clone()),
        ("max_nesting", "AttributeBegin ".repeat(9), small.clone()),
        ("max_triangles", mesh.repeat(3), LoadOptions { max_values: 9, ..small }),
        ("max_vertices", mesh.repeat(3), LoadOptions { max_vertices: 5, ..LoadOptions::default() }),
        (
            "max_params",
            "Option \"bool a\" true \"bool b\" true".to_owned(),
            LoadOptions { max_params: 1, ..LoadOptions::default() },
        ),
        ("max_include_depth", "Include \"0.pbrt\"".to_owned(), LoadOptions::default()),
        (
            "max_file_bytes",
            "Include \"40.pbrt\"".to_owned(),
            LoadOptions { max_file_bytes: 3, ..LoadOptions::default() },
        ),
        (
            "max_total_bytes",
            "Include \"40.pbrt\"".to_owned(),
            LoadOptions { max_total_bytes: 9, ..LoadOptions::default() },
        ),
    ];
    for (name, scene, options) in cases {
        let error =
            load_pbrt_text(format!("WorldBegin {scene}").as_bytes(), folder.path(), &options).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Limit, "{error}");
        assert!(error.message().contains(name), "{error}");
    }
}

#[test]
fn warnings_are_bounded() {
    let scene = format!("WorldBegin {}", "Shape \"sphere\" \"float raduis\" 1\n".repeat(1000));
    let scene = load_pbrt_text(scene.as_bytes(), Path::new("."), &LoadOptions::default()).unwrap();
    assert_eq!(scene.warnings.len(), 201);
    assert_eq!(scene.warnings[0], "text:1:27: parameter `raduis` of shape `sphere` is not known and ignored");
    assert_eq!(scene.warnings[200], "801 more warnings");
}
