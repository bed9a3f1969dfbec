//! Rocks, grass and coils of wire.

use crate::description::TriangleMesh;
use crate::generate::training::pictures;
use crate::generate::training::shapes::{ground, place, prism, quad, tube, yaw};
use crate::generate::training::stage::Stage;
use crate::generate::turn::turn;
use crate::generate::{rock, smooth_normals};
use glam::{Mat3, Vec3};

/// Sand in ripples: a square of `cells` by `cells`.
fn ripples(cells: u32, half: f32, waves: f32, height: f32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let at = |i: u32| half * (2.0 * i as f32 / cells as f32 - 1.0);
    for row in 0..=cells {
        for column in 0..=cells {
            let (x, z) = (at(column), at(row));
            let y =
                height * (turn(waves * (z + 0.15 * turn(x * 0.23).0)).0 + 0.5 * turn(0.31 * x + 0.12 * z).1);
            mesh.positions.push([x, y, z]);
        }
    }
    for row in 0..cells {
        for column in 0..cells {
            let a = row * (cells + 1) + column;
            let (b, c, d) = (a + cells + 1, a + cells + 2, a + 1);
            mesh.indices.extend([[a, b, c], [a, c, d]]);
        }
    }
    smooth_normals(&mut mesh);
    mesh
}

/// A low or a high sun with its sky.
fn evening(stage: &mut Stage) {
    let strength = stage.random.range(0.3, 0.9);
    let sun = Vec3::new(
        stage.random.range(-1.0, 1.0),
        stage.random.range(0.25, 0.8),
        stage.random.range(-0.8, 0.2),
    );
    let sun = sun.normalize_or(Vec3::Y);
    match stage.random.below(3) {
        0 => {
            stage.environment(Vec3::new(0.7, 0.75, 0.95) * strength, None);
            stage.sun(sun, Vec3::new(1.3, 1.0, 0.6) * stage.random.range(2.0, 5.0));
        }
        1 => stage.environment(Vec3::new(0.9, 1.0, 1.1) * strength, None),
        _ => {
            let (zenith, horizon) = (Vec3::new(0.15, 0.25, 0.55), Vec3::new(0.9, 0.6, 0.4));
            let glow = stage.random.octaves(20.0, 3.0);
            stage.environment(Vec3::splat(strength), Some(pictures::sky(zenith, horizon, sun, glow, 300.0)));
        }
    }
}

/// Rocks on rippled sand.
pub(super) fn rocks(stage: &mut Stage) {
    stage.format(128, 96, 4);
    let sand = stage.matte();
    let waves = stage.random.range(1.0, 2.5);
    stage.add(ripples(96, 5.0, waves, 0.06), sand);
    for i in 0..5 {
        let seed = stage.random.bits() as u32;
        let size = stage.random.range(0.25, 0.7);
        let at = Vec3::new(i as f32 * 1.1 - 2.2, size * 0.5, stage.random.range(-1.0, 1.5));
        let mesh = rock(4, stage.random.range(0.3, 0.7), seed);
        let material = if stage.random.chance(0.6) { stage.matte() } else { stage.opaque() };
        stage.add(place(mesh, at, yaw(stage.random.unit()), size), material);
    }
    evening(stage);
    let eye = Vec3::new(stage.random.range(-1.5, 1.5), stage.random.range(1.4, 2.4), -5.0);
    stage.look(eye, Vec3::new(0.0, 0.2, 0.0), 36.0);
}

/// Blades of grass before a brick wall.
pub(super) fn grass(stage: &mut Stage) {
    stage.format(96, 96, 6);
    let soil = stage.matte();
    stage.add(ground(8.0), soil);
    let wall = stage.patterned(3.0);
    stage.add(quad(Vec3::new(0.0, 2.0, 2.2), Vec3::Y * 2.0, Vec3::X * 4.0), wall);
    let count = 500 + stage.random.below(1000);
    let mut blades = TriangleMesh::default();
    for _ in 0..count {
        let r = &stage.random;
        let root = Vec3::new(r.range(-2.2, 2.2), 0.0, r.range(-1.5, 1.8));
        let (sin, cos) = turn(r.unit());
        let side = Vec3::new(cos, 0.0, sin) * r.range(0.015, 0.04);
        let tip = root + Vec3::new(r.range(-0.3, 0.3), r.range(0.4, 1.2), r.range(-0.3, 0.3));
        let first = blades.positions.len() as u32;
        blades.positions.extend([root - side, root + side, tip].map(|p| p.to_array()));
        blades.indices.push([first, first + 1, first + 2]);
    }
    let leaf = stage.leaf();
    stage.add(blades, leaf);
    evening(stage);
    stage.look(Vec3::new(stage.random.range(-1.0, 1.0), 1.3, -4.8), Vec3::new(0.0, 0.75, 0.0), 34.0);
    if stage.random.chance(0.6) {
        stage.lens(0.08, 4.6);
    }
}

/// Coils of thin wire, sharp or not, under the sky.
pub(super) fn coils(stage: &mut Stage) {
    stage.format(96, 96, 5);
    let floor = stage.patterned(3.0);
    stage.add(ground(8.0), floor);
    for i in 0..4 {
        let r = &stage.random;
        let (radius, turns, wire) = (r.range(0.25, 0.5), r.range(5.0, 11.0), r.octaves(0.008, 2.0));
        let points: Vec<Vec3> = (0..=220)
            .map(|k| k as f32 / 220.0)
            .map(|t| (t, turn(t * turns)))
            .map(|(t, (sin, cos))| Vec3::new(radius * cos, 0.02 + 1.9 * t, radius * sin))
            .collect();
        let at = Vec3::new(i as f32 * 0.95 - 1.4, 0.0, r.range(-0.4, 1.2));
        let material = if r.chance(0.6) { stage.metal(0.1) } else { stage.matte() };
        stage.add(place(tube(&points, wire, 5), at, Mat3::IDENTITY, 1.0), material);
    }
    let block = stage.opaque();
    stage.add(place(prism(7, 0.6, 0.7, 0.7), Vec3::new(0.3, 1e-3, 2.2), Mat3::IDENTITY, 1.0), block);
    evening(stage);
    stage.look(Vec3::new(stage.random.range(-0.8, 0.8), 1.5, -4.6), Vec3::new(0.0, 0.95, 0.0), 40.0);
    if stage.random.chance(0.6) {
        let focus = stage.random.pick([4.6, 5.8]);
        stage.lens(0.08, focus);
    }
}
