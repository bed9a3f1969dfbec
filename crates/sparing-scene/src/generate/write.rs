//! Writes meshes as OBJ.

use crate::description::TriangleMesh;
use std::io::{self, BufWriter, Write};

/// Writes a mesh as OBJ text with five decimals.
///
/// # Errors
/// When writing fails.
pub fn write_obj(mesh: &TriangleMesh, out: impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(out);
    writeln!(out, "# {} triangles", mesh.indices.len())?;
    for [x, y, z] in &mesh.positions {
        writeln!(out, "v {x:.5} {y:.5} {z:.5}")?;
    }
    for [u, v] in mesh.uvs.iter().flatten() {
        writeln!(out, "vt {u:.4} {v:.4}")?;
    }
    for [x, y, z] in mesh.normals.iter().flatten() {
        writeln!(out, "vn {x:.4} {y:.4} {z:.4}")?;
    }
    for triangle in &mesh.indices {
        write!(out, "f")?;
        for i in triangle.map(|i| i + 1) {
            match (mesh.uvs.is_some(), mesh.normals.is_some()) {
                (true, true) => write!(out, " {i}/{i}/{i}")?,
                (true, false) => write!(out, " {i}/{i}")?,
                (false, true) => write!(out, " {i}//{i}")?,
                (false, false) => write!(out, " {i}")?,
            }
        }
        writeln!(out)?;
    }
    out.flush()
}
