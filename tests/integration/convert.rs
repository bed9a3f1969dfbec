//! `convert`: what is written renders as the original does, for every format; nothing is overwritten unasked.

use super::common::{files, folder, ok, run};
use std::path::Path;

/// A square and a tetrahedron with a picture that is not symmetric, colours of vertices and an emitter, by hand.
fn write_scenes(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("a file");
    write("picture.png", PICTURE);
    write("a.mtl", b"newmtl m\nKd 1 1 1\nmap_Kd -o 0.25 0 0 picture.png\nnewmtl k\nKs 0.5 0.5 0.5\nKd 0.1 0.5 0.2\nPr 0.3\n");
    write(
        "a.obj",
        b"mtllib a.mtl\nv -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\nusemtl k\nf 1 2 5\n",
    );
    write(
        "b.ply",
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
          property uchar green\nproperty uchar blue\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n\
          0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 255 255 255\n3 0 2 1\n3 0 1 3\n3 1 2 3\n",
    );
    let mut bytes = Vec::new();
    let corners = [[-1.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.5]];
    let uvs = [[0.0f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let normals = [[0.0f32, 0.1, 1.0], [0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.0, 0.0, 1.0]];
    bytes.extend(corners.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(uvs.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(normals.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    let colors = [255u8, 255, 255, 255, 255, 128, 0, 255, 0, 255, 255, 255, 255, 0, 255, 64];
    bytes.extend(colors);
    bytes.extend([0, 1, 2, 0, 2, 3]);
    write("c.bin", &bytes);
    write("c.gltf", GLTF.replace("@PICTURE@", &base64(PICTURE)).as_bytes());
}

/// 2 x 2 pixels: red, green, blue, white.
const PICTURE: &[u8] = include_bytes!("../../crates/sparing-scene/tests/fixtures/dots.png");

const GLTF: &str = r#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "c.bin", "byteLength": 150}],
"bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
 {"buffer": 0, "byteOffset": 80, "byteLength": 48}, {"buffer": 0, "byteOffset": 128, "byteLength": 16},
 {"buffer": 0, "byteOffset": 144, "byteLength": 6}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
 {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
 {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"},
 {"bufferView": 3, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true},
 {"bufferView": 4, "componentType": 5121, "count": 6, "type": "SCALAR"}],
"images": [{"uri": "data:image/png;base64,@PICTURE@"}], "textures": [{"source": 0, "sampler": 0}],
"samplers": [{"wrapS": 33648, "wrapT": 33071}],
"materials": [{"alphaMode": "MASK", "alphaCutoff": 0.5, "normalTexture": {"index": 0, "scale": 0.25},
 "pbrMetallicRoughness": {"metallicFactor": 0.5, "metallicRoughnessTexture": {"index": 0}, "baseColorTexture": {"index": 0,
  "extensions": {"KHR_texture_transform": {"rotation": 0.5, "scale": [2, 1]}}}}},
 {"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}, "doubleSided": true,
  "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_clearcoat": {"clearcoatFactor": 1},
  "KHR_materials_transmission": {"transmissionFactor": 0.5}}}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "NORMAL": 2, "COLOR_0": 3}, "indices": 4, "material": 0}]},
 {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 4, "material": 1}]}],
"extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 20}]}},
"nodes": [{"mesh": 0}, {"mesh": 0, "translation": [0, 1.2, 0], "rotation": [0, 0.3826834, 0, 0.9238795]},
 {"mesh": 1, "translation": [0, -1, 0], "scale": [-1, 0.5, 1]},
 {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [1, 2, 4]}]}"#;

fn prepared() -> tempfile::TempDir {
    let f = folder();
    write_scenes(f.path());
    f
}

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

#[test]
fn converted_scenes_render_as_before() {
    let f = prepared();
    for (scene, exact) in
        [("a.obj", true), ("b.ply", true), ("c.gltf", false), ("@tests/texture-alpha.pbrt", false)]
    {
        ok(f.path(), &format!("convert {scene} -o out.pbrt --force --copy-pictures"));
        for (file, name) in [(scene, "before.exr"), ("out.pbrt", "after.exr")] {
            ok(f.path(), &format!("render {file} -o {name} --spp 64 --size 48x48 --progress none"));
        }
        let error = ok(f.path(), "compare after.exr before.exr --json").json();
        let error = error["mse"].as_f64().expect("an error");
        // The same samples at the same places: bit for bit where vertices have no normals; the last bits of normals and
        // of mapped pictures send few samples elsewhere.
        assert!(if exact { error == 0.0 } else { error < 1e-5 }, "{scene}: {error}");
    }
}

#[test]
fn nothing_is_overwritten_unasked_or_left_behind() {
    let f = prepared();
    let said = ok(f.path(), "convert c.gltf -o out.pbrt").stdout;
    assert_eq!(said.trim(), "out.pbrt: 4 triangles, 2 meshes, 1 pictures written");
    let before = files(f.path());
    assert!(
        f.path().join("out-files/mesh-0.ply").is_file() && f.path().join("out-files/picture-0.png").is_file()
    );
    let again = run(f.path(), "convert a.obj -o out.pbrt");
    assert_eq!(
        (again.code, again.stderr.trim()),
        (1, "error: out.pbrt exists already: --force overwrites it")
    );
    std::fs::remove_file(f.path().join("out.pbrt")).expect("removed");
    let again = run(f.path(), "convert a.obj -o out.pbrt");
    assert_eq!(
        (again.code, again.stderr.trim()),
        (1, "error: out-files exists already: --force overwrites it")
    );
    ok(f.path(), "convert c.gltf -o out.pbrt --force");
    assert_eq!(files(f.path()), before);
    assert_eq!(run(f.path(), "convert a.obj -o out.obj").code, 2);
    assert_eq!(run(f.path(), "convert nowhere.obj -o new.pbrt").code, 1);
    assert_eq!(run(f.path(), "convert a.obj -o no/such/folder/new.pbrt").code, 1);
    assert_eq!(files(f.path()), before);
    // Pictures are named where they are, or copied.
    ok(f.path(), "convert a.obj -o named.pbrt");
    assert!(!f.path().join("named-files/picture-0.png").exists());
    ok(f.path(), "convert a.obj -o copied.pbrt --copy-pictures");
    assert!(f.path().join("copied-files/picture-0.png").is_file());
}
