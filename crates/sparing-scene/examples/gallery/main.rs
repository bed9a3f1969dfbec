//! Makes the meshes of the gallery: `cargo run --release -p sparing-scene --example gallery -- [FOLDER]`
//!
//! Writes FOLDER/*.ply and FOLDER/*.pbrt (scenes/gallery/made by default), which the scenes in scenes/gallery include.
//! Everything is made by formulas.

mod city;
mod hair;
mod tree;

use image::{Rgb, RgbImage};
use sparing_scene::description::TriangleMesh;
use sparing_scene::generate;
use std::error::Error;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    make(&PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "scenes/gallery/made".to_owned())))
}

/// Writes all files; a test of the renderer calls this, too.
pub fn make(folder: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let mesh = |name: &str, mesh: &TriangleMesh| -> Result<(), Box<dyn Error>> {
        println!("{name}.ply: {} triangles", mesh.indices.len());
        Ok(sparing_scene::write_ply(mesh, File::create(folder.join(name).with_extension("ply"))?)?)
    };
    mesh("teapot", &generate::teapot(24))?;
    mesh("knot", &generate::torus_knot(2, 3, 600, 60, 0.42))?;
    mesh("knot-thin", &generate::torus_knot(3, 5, 900, 40, 0.2))?;
    mesh("gear", &generate::gear(24, 1.0, 0.35))?;
    mesh("gear-small", &generate::gear(12, 1.0, 0.7))?;
    mesh("vase", &generate::revolve(&generate::vase_profile(120), 160))?;
    mesh("rock", &generate::rock(5, 0.45, 4))?;
    mesh("mountains", &generate::terrain(500, 2.0, 0.5, 21))?;
    mesh("sweep", &sweep())?;
    heights().save(folder.join("heights.png"))?;
    let (wood, leaves) = tree::tree(7);
    mesh("wood", &wood)?;
    mesh("leaves", &leaves)?;
    for (name, text) in [("city", city::blocks(5)), ("hair", hair::ball(9000, 3))] {
        println!("{name}.pbrt: {} lines", text.lines().count());
        fs::write(folder.join(name).with_extension("pbrt"), text)?;
    }
    Ok(())
}

/// A photographer's sweep: a floor that bends up to a wall. Texture coordinates are lengths.
fn sweep() -> TriangleMesh {
    const HALF: f32 = 40.0;
    const FLOOR: f32 = 30.0;
    const BEND: f32 = 7.0;
    const STEPS: u32 = 48;
    let arc = |i: u32| {
        let angle = std::f32::consts::FRAC_PI_2 * i as f32 / STEPS as f32;
        (BEND * (1.0 - angle.cos()), BEND * angle.sin(), BEND * angle)
    };
    // Height, depth, length.
    let mut line = vec![(0.0, -FLOOR, 0.0)];
    line.extend((0..=STEPS).map(arc).map(|(y, z, length)| (y, z, FLOOR + length)));
    line.push((BEND + 20.0, BEND, FLOOR + arc(STEPS).2 + 20.0));
    let mut mesh = TriangleMesh::default();
    let mut uvs = Vec::new();
    for (y, z, length) in line {
        for x in [-HALF, HALF] {
            mesh.positions.push([x, y, z]);
            uvs.push([x, length]);
        }
    }
    for i in (0..mesh.positions.len() as u32 - 2).step_by(2) {
        mesh.indices.extend([[i, i + 2, i + 1], [i + 1, i + 2, i + 3]]);
    }
    generate::smooth_normals(&mut mesh);
    mesh.uvs = Some(uvs);
    mesh
}

/// Colours by height, from the bottom: shore, meadow, rock, snow.
fn heights() -> RgbImage {
    let colors = [[120, 110, 80], [72, 88, 40], [84, 92, 48], [96, 86, 76], [112, 104, 98], [236, 240, 246]];
    RgbImage::from_fn(4, 512, |_, y| {
        let t = (511 - y) as f32 / 512.0 * colors.len() as f32;
        let (i, part) = (t as usize, (t.fract() * 3.0 - 2.0).max(0.0));
        let (a, b) = (colors[i.min(5)], colors[(i + 1).min(5)]);
        Rgb([0, 1, 2].map(|k| (a[k] as f32 * (1.0 - part) + b[k] as f32 * part) as u8))
    })
}

/// Numbers in 0..1 that are the same on every machine (SplitMix64, G. Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    /// Between two numbers.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }
}
