//! Writes meshes as binary PLY, little endian.

use crate::description::TriangleMesh;
use std::io::{self, BufWriter, Write};

/// Writes a mesh as binary PLY. What is read from there is the same, to the last bit.
///
/// # Errors
/// When writing fails.
pub fn write_ply(mesh: &TriangleMesh, out: impl Write) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let TriangleMesh { positions, indices, normals, uvs, colors, second_uvs, tangents } = mesh;
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", positions.len())?;
    let parts = [
        (true, "x y z"),
        (normals.is_some(), "nx ny nz"),
        (uvs.is_some(), "u v"),
        (colors.is_some(), "red green blue alpha"),
        (second_uvs.is_some(), "u2 v2"),
        (tangents.is_some(), "tx ty tz"),
    ];
    for name in parts.iter().filter(|part| part.0).flat_map(|part| part.1.split(' ')) {
        writeln!(out, "property float {name}")?;
    }
    let faces = indices.len();
    write!(out, "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n")?;
    let put = |out: &mut BufWriter<_>, values: &[f32]| {
        values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
    };
    for (i, position) in positions.iter().enumerate() {
        put(&mut out, position)?;
        normals.as_ref().map_or(Ok(()), |normals| put(&mut out, &normals[i]))?;
        uvs.as_ref().map_or(Ok(()), |uvs| put(&mut out, &uvs[i]))?;
        colors.as_ref().map_or(Ok(()), |colors| put(&mut out, &colors[i]))?;
        second_uvs.as_ref().map_or(Ok(()), |uvs| put(&mut out, &uvs[i]))?;
        tangents.as_ref().map_or(Ok(()), |tangents| put(&mut out, &tangents[i]))?;
    }
    for &[a, b, c] in indices {
        let mut row = [3; 13];
        row[1..5].copy_from_slice(&a.to_le_bytes());
        row[5..9].copy_from_slice(&b.to_le_bytes());
        row[9..].copy_from_slice(&c.to_le_bytes());
        out.write_all(&row)?;
    }
    out.flush()
}
