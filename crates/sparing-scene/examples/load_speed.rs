//! How fast meshes load: `cargo run --release -p sparing-scene --example load_speed -- [CELLS]`
//!
//! Writes a terrain of 2 CELLS² triangles (10 million by default) into a folder for temporary files as PLY (binary and
//! text) and OBJ, then loads each several times on one thread. The last column compares with plainly reading the file.

use sparing_scene::generate::{terrain, write_obj};
use sparing_scene::{load, write_ply};
use std::fs::File;
use std::hint::black_box;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let cells = std::env::args().nth(1).map_or(Ok(2236), |cells| cells.parse())?;
    let mesh = terrain(cells, 10.0, 1.0, 1);
    let folder = std::env::temp_dir().join(format!("sparing-load-speed-{}", std::process::id()));
    std::fs::create_dir(&folder)?;
    let path = |name: &str| folder.join(name);
    write_ply(&mesh, File::create(path("binary.ply"))?)?;
    write_text(&mesh, &path("text.ply"))?;
    write_obj(&mesh, File::create(path("mesh.obj"))?)?;
    let triangles = mesh.indices.len() as f64;
    drop(mesh);
    println!("{triangles} triangles; medians of 5");
    for name in ["binary.ply", "text.ply", "mesh.obj"] {
        let path = path(name);
        let megabytes = std::fs::metadata(&path)?.len() as f64 / 1e6;
        let read = median(|| drop(black_box(std::fs::read(&path))));
        let loaded = median(|| drop(black_box(load(&path))));
        let rate = triangles / loaded / 1e6;
        println!(
            "{name}: {megabytes:.0} MB, read {read:.2} s, loaded {loaded:.2} s, {rate:.1} M triangles/s, {:.1} times reading",
            loaded / read
        );
    }
    std::fs::remove_dir_all(folder)?;
    Ok(())
}

fn median(work: impl Fn()) -> f64 {
    let mut times = [0; 5].map(|_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    });
    times.sort_by(f64::total_cmp);
    times[2]
}

fn write_text(mesh: &sparing_scene::description::TriangleMesh, path: &Path) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let (vertices, faces) = (mesh.positions.len(), mesh.indices.len());
    writeln!(out, "ply\nformat ascii 1.0\nelement vertex {vertices}")?;
    for name in ["x", "y", "z"] {
        writeln!(out, "property float {name}")?;
    }
    writeln!(out, "element face {faces}\nproperty list uchar int vertex_indices\nend_header")?;
    for [x, y, z] in &mesh.positions {
        writeln!(out, "{x} {y} {z}")?;
    }
    for [a, b, c] in &mesh.indices {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    out.flush()
}
