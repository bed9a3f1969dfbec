//! PLY in small: every type and byte order, gzip, polygons, what is passed over, hostile files.

use super::load;
use super::write::write_ply;
use crate::description::TriangleMesh;
use crate::generate::icosphere;
use crate::options::LoadOptions;
use crate::warnings::Warnings;
use std::io::Write;

fn read_with(bytes: &[u8], options: &LoadOptions) -> Result<(TriangleMesh, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, bytes).unwrap();
    let mut warnings = Warnings::new(10);
    let prefix = format!("{}/", folder.path().display());
    match load(&path, options, &mut warnings) {
        Ok(mesh) => Ok((mesh, warnings.into_vec())),
        Err(error) => Err(error.to_string().replace(&prefix, "")),
    }
}

fn read(bytes: &[u8]) -> Result<TriangleMesh, String> {
    read_with(bytes, &LoadOptions::default()).map(|(mesh, warnings)| {
        assert_eq!(warnings, Vec::<String>::new());
        mesh
    })
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

const HEADER: &str = "element vertex 4
property double y
property list char short trash
property float x
property short z
property float nx
property float ny
property float nz
property float texture_u
property float texture_v
property uchar red
property uchar green
property uchar blue
element trash 1
property int a
element face 2
property float quality
property list ushort uint vertex_index
property uchar flag
end_header
";

/// The same mesh as text, little and big endian.
fn three_formats() -> [Vec<u8>; 3] {
    let positions = [[0i16, 0, 1], [2, 0, 1], [2, 3, 1], [0, 3, 1]];
    let faces: [&[u32]; 2] = [&[0, 1, 2], &[0, 1, 2, 3]];
    let start = |format: &str| format!("ply\nformat {format} 1.0\ncomment made here\n{HEADER}").into_bytes();
    let mut text = start("ascii");
    let mut little = start("binary_little_endian");
    let mut big = start("binary_big_endian");
    macro_rules! put {
        ($value:expr) => {
            write!(text, "{} ", $value).unwrap();
            little.extend($value.to_le_bytes());
            big.extend($value.to_be_bytes());
        };
    }
    for (i, [x, y, z]) in positions.into_iter().enumerate() {
        put!(f64::from(y));
        put!(2i8);
        put!(7i16);
        put!(-7i16);
        put!(f32::from(x));
        put!(z);
        for value in [0.0f32, 0.0, -1.0, 0.25 * i as f32, 0.5] {
            put!(value);
        }
        for color in [0u8, 255, 188] {
            put!(color);
        }
        text.push(b'\n');
    }
    put!(9i32);
    for face in faces {
        put!(0.5f32);
        put!(face.len() as u16);
        for index in face {
            put!(*index);
        }
        put!(1u8);
    }
    [text, little, big]
}

#[test]
fn text_and_both_byte_orders_and_gzip_are_the_same() {
    for bytes in three_formats() {
        for bytes in [gzip(&bytes), bytes] {
            let mesh = read(&bytes).unwrap();
            assert_eq!(mesh.positions, [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 3.0, 1.0], [0.0, 3.0, 1.0]]);
            assert_eq!(mesh.indices, [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.normals.unwrap(), [[0.0, 0.0, -1.0]; 4]);
            assert_eq!(mesh.uvs.unwrap()[3], [0.75, 0.5]);
            // sRGB 188 is half of the light.
            let [r, g, b, a] = mesh.colors.unwrap()[1];
            assert!((r, g, a) == (0.0, 1.0, 1.0) && (b - 0.503).abs() < 1e-3, "{b}");
        }
    }
}

#[test]
fn what_is_written_reads_back_the_same() {
    let mut mesh = icosphere(4);
    mesh.uvs = Some(mesh.positions.iter().map(|p| [p[0], -p[1]]).collect());
    for colors in [None, Some(vec![[0.25, 0.5, 2.0, 0.75]; mesh.positions.len()])] {
        mesh.second_uvs = colors.as_ref().map(|_| mesh.positions.iter().map(|p| [p[1], p[2]]).collect());
        mesh.tangents = colors.as_ref().map(|_| mesh.positions.iter().map(|p| [p[2], p[0], -p[1]]).collect());
        mesh.colors = colors;
        let mut bytes = Vec::new();
        write_ply(&mesh, &mut bytes).unwrap();
        let back = read(&bytes).unwrap();
        assert_eq!((&back.positions, &back.indices), (&mesh.positions, &mesh.indices));
        assert_eq!((&back.normals, &back.uvs, &back.colors), (&mesh.normals, &mesh.uvs, &mesh.colors));
        assert_eq!((&back.second_uvs, &back.tangents), (&mesh.second_uvs, &mesh.tangents));
        for cut in (0..bytes.len()).step_by(997) {
            assert!(read(&bytes[..cut]).is_err(), "{cut}");
        }
    }
}

#[test]
fn concave_faces_are_clipped_and_odd_ones_skipped() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element face 4\nproperty list uchar int vertex_indices\nend_header\n\
        2 -1 0 .5 0 0 2 1 0 0 0 0 9 9 9\n4 0 1 2 3 2 0 1 0 3 4 0.0 1\n";
    let (mesh, warnings) = read_with(text.as_bytes(), &LoadOptions::default()).unwrap();
    assert_eq!(mesh.indices, [[3, 0, 1], [3, 1, 2], [4, 0, 1]]);
    assert_eq!(warnings, ["2 faces with fewer than three corners are left out"]);
}

#[test]
fn numbers_of_elements_are_not_believed() {
    let header = |format: &str, vertices: u64, faces: u64| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
             property float z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let options = LoadOptions { max_vertices: u64::MAX, max_triangles: u64::MAX, ..LoadOptions::default() };
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for count in [5, 4_000_000_000, u64::MAX] {
            for (vertices, faces, name) in [(count, 0, "vertex"), (0, count, "face")] {
                let text = header(format, vertices, faces);
                let expected = format!("a.ply: {count} elements `{name}` do not fit into the file");
                assert_eq!(read_with(text.as_bytes(), &options).unwrap_err(), expected);
                let packed = gzip(text.as_bytes());
                assert!(read_with(&packed, &options).is_err());
            }
        }
    }
    // A list that claims four thousand million corners.
    let mut bytes = header("binary_big_endian", 0, 1).replace("uchar", "uint").into_bytes();
    bytes.extend([0xff; 8]);
    let message = read(&bytes).unwrap_err();
    assert!(message.contains("a list of 4294967295 values does not fit"), "{message}");
}

#[test]
fn gzip_bombs_end_at_the_limit() {
    let mut text = "ply\nformat ascii 1.0\nelement vertex 2000000\nproperty float x\nproperty float y\n\
        property float z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"
        .to_owned();
    text += &"0 0 0\n".repeat(2_000_000);
    let packed = gzip(text.as_bytes());
    let many = LoadOptions { max_expansion: 1_000_000, ..LoadOptions::default() };
    assert!(read_with(&packed, &many).is_ok());
    let few = LoadOptions { max_expansion: 1_000_000, max_file_bytes: 1_000_000, ..LoadOptions::default() };
    let message = read_with(&packed, &few).unwrap_err();
    assert!(message.contains("do not fit"), "{message}");
    // Nothing but spaces where the first number should be.
    let text = text.replace("end_header\n", &format!("end_header\n{}", " ".repeat(9_000_000)));
    let text = text.replace("vertex 2000000", "vertex 1");
    let message = read_with(&gzip(text.as_bytes()), &LoadOptions::default()).unwrap_err();
    assert_eq!(message, "a.ply: the limit max_expansion = 100 is exceeded when this file is expanded");
}
