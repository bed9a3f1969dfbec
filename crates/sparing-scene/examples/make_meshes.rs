//! Makes the meshes and pictures of our own scenes: `cargo run -p sparing-scene --example make_meshes -- ROOT`
//!
//! Writes ROOT/models/meshes/*.obj and ROOT/scenes/textures/*. Everything is made by formulas.

use glam::{Vec2, Vec3};
use image::codecs::hdr::HdrEncoder;
use image::{Rgb, RgbImage, Rgba, RgbaImage};
use sparing_scene::description::TriangleMesh;
use sparing_scene::generate;
use std::error::Error;
use std::fs::{self, File};
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let root = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    let meshes = Path::new(&root).join("models/meshes");
    let textures = Path::new(&root).join("scenes/textures");
    fs::create_dir_all(&meshes)?;
    fs::create_dir_all(&textures)?;
    let write = |name: &str, mesh: &TriangleMesh| -> Result<(), Box<dyn Error>> {
        println!("{name}: {} triangles", mesh.indices.len());
        Ok(generate::write_obj(mesh, File::create(meshes.join(name))?)?)
    };
    write("torus-knot.obj", &generate::torus_knot(2, 3, 240, 20, 0.45))?;
    write("vase.obj", &generate::revolve(&generate::vase_profile(36), 48))?;
    write("gear.obj", &generate::gear(24, 1.0, 0.35))?;
    write("rock.obj", &generate::rock(4, 0.55, 11))?;
    write("terrain.obj", &generate::terrain(64, 2.0, 0.35, 5))?;

    tiles().save(textures.join("tiles.png"))?;
    leaf().save(textures.join("leaf.png"))?;
    bumps().save(textures.join("bumps.png"))?;
    let (width, height) = (192, 96);
    let sky: Vec<Rgb<f32>> = (0..width * height)
        .map(|i| studio((i % width) as f32 / width as f32, (i / width) as f32 / height as f32))
        .collect();
    HdrEncoder::new(File::create(textures.join("studio.hdr"))?).encode(&sky, width, height)?;
    Ok(())
}

/// Warm floor tiles with joints.
fn tiles() -> RgbImage {
    RgbImage::from_fn(256, 256, |x, y| {
        let (tile, inside) = ((x / 64, y / 64), (x % 64, y % 64));
        let joint = inside.0 < 2 || inside.1 < 2;
        let p = Vec3::new(x as f32 / 24.0, y as f32 / 24.0, (tile.0 * 7 + tile.1 * 13) as f32);
        let tone = 0.5 + 0.12 * generate::fractal_noise(p, 4, 3) + 0.04 * ((tile.0 + tile.1) % 2) as f32;
        let color = if joint { Vec3::splat(0.25) } else { Vec3::new(1.0, 0.9, 0.78) * tone };
        Rgb((color * 255.0).to_array().map(|v| v as u8))
    })
}

/// A leaf: green with veins, transparent around it.
fn leaf() -> RgbaImage {
    RgbaImage::from_fn(128, 128, |x, y| {
        let p = Vec2::new((x as f32 + 0.5) / 64.0 - 1.0, 1.0 - (y as f32 + 0.5) / 64.0);
        let width = 0.55 * (1.0 - p.y * p.y).max(0.0) * (1.0 - 0.35 * p.y);
        let vein = p.x.abs() < 0.02 || ((p.y - 0.6 * p.x.abs()) * 14.0).fract().abs() < 0.12;
        let color = if vein { [150, 190, 90] } else { [60, 130, 40] };
        let opaque = if p.x.abs() < width { 255 } else { 0 };
        Rgba([color[0], color[1], color[2], opaque])
    })
}

/// Heights of hammered metal, grey.
fn bumps() -> image::GrayImage {
    image::GrayImage::from_fn(128, 128, |x, y| {
        // A circle in two dimensions for each axis makes the noise tile.
        let turn = |v: u32| std::f32::consts::TAU * v as f32 / 128.0;
        let (a, b) = (turn(x), turn(y));
        let p = Vec3::new(a.cos() * 2.0 + b.sin(), a.sin() * 2.0, b.cos() * 2.0);
        image::Luma([(127.5 + 120.0 * generate::fractal_noise(p, 3, 9)).clamp(0.0, 255.0) as u8])
    })
}

/// A studio: dark walls, a bright floor line, a large soft box and a strip light. u, v from the top left.
fn studio(u: f32, v: f32) -> Rgb<f32> {
    let elevation = (0.5 - v) * std::f32::consts::PI;
    let base = Vec3::new(0.16, 0.18, 0.22) * (1.0 + 0.6 * elevation.sin());
    let within = |center: f32, half: f32, value: f32, soft: f32| {
        (1.0 - ((value - center).abs() - half).max(0.0) / soft).clamp(0.0, 1.0)
    };
    let soft_box = within(0.2, 0.07, u, 0.02) * within(0.28, 0.1, v, 0.03);
    let strip = within(0.65, 0.015, u, 0.01) * within(0.35, 0.18, v, 0.03);
    let color = base + Vec3::new(6.0, 5.6, 5.0) * soft_box + Vec3::new(7.0, 8.0, 10.0) * strip;
    Rgb(color.to_array())
}
