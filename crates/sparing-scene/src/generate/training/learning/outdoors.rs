//! Under the sky, and halls.

use crate::description::Shape;
use crate::generate::terrain;
use crate::generate::training::pictures;
use crate::generate::training::shapes::{cuboid, ground, merge, pitch, place, quad, sphere, tube, yaw};
use crate::generate::training::stage::{Stage, shape};
use glam::{Mat3, Vec3};

/// Sky and, most often, sun.
fn daylight(stage: &mut Stage) {
    let strength = stage.random.range(0.5, 1.2);
    if stage.random.chance(0.5) {
        let (zenith, horizon) = (Vec3::new(0.2, 0.4, 0.9), Vec3::new(0.8, 0.8, 0.75));
        stage.environment(Vec3::splat(strength), Some(pictures::sky(zenith, horizon, Vec3::Y, 0.3, 2.0)));
    } else {
        stage.environment(Vec3::new(0.6, 0.75, 1.0) * strength, None);
    }
    if stage.random.chance(0.8) {
        let from = Vec3::new(stage.random.range(-1.2, 1.2), stage.random.range(0.4, 1.2), -0.6);
        let irradiance = Vec3::new(1.1, 1.0, 0.85) * stage.random.range(2.0, 6.0);
        stage.sun(from, irradiance);
    }
}

/// Hills with cards for trees.
pub(super) fn hills(stage: &mut Stage) {
    stage.format(128, 96, 4);
    let seed = stage.random.bits() as u32;
    let height = stage.random.range(0.5, 1.1);
    let soil = stage.grey(0.2, 0.6);
    let soil = if stage.random.chance(0.5) { stage.patterned(3.0) } else { stage.diffuse(soil) };
    let land = terrain(72, 8.0, height, seed);
    let spots: Vec<Vec3> = (0..40)
        .map(|_| Vec3::from(land.positions[stage.random.below(land.positions.len() as u32) as usize]))
        .collect();
    stage.add(land, soil);
    let trees = spots.iter().flat_map(|&p| {
        let (size, turned) = (stage.random.range(0.06, 0.16), stage.random.unit());
        [0.0, 0.25].map(|more| {
            let card = quad(Vec3::Y * 1.4, Vec3::X * 0.6, Vec3::Y * 1.4);
            place(card, p, yaw(turned + more), size)
        })
    });
    let trees = merge(trees.collect::<Vec<_>>());
    let leaf = stage.leaf();
    stage.add(trees, leaf);
    daylight(stage);
    let y = stage.random.range(1.8, 3.0);
    stage.look(Vec3::new(stage.random.range(-2.0, 2.0), y, -6.5), Vec3::new(0.0, 0.0, -0.5), 36.0);
}

/// A cloud of leaves over the ground: cut by light and shadow.
pub(super) fn foliage(stage: &mut Stage) {
    stage.format(96, 96, 6);
    let soil = stage.patterned(3.0);
    stage.add(ground(8.0), soil);
    let count = 150 + stage.random.below(400);
    let size = stage.random.range(0.1, 0.22);
    for _ in 0..2 {
        let mut leaves = Vec::new();
        for _ in 0..count / 2 {
            let r = &stage.random;
            let at = Vec3::new(r.range(-1.5, 1.5), r.range(0.3, 2.6), r.range(-1.2, 1.2));
            let turned = yaw(r.unit()) * pitch(r.range(-0.2, 0.2));
            leaves.push(place(quad(Vec3::ZERO, Vec3::X * 0.6, Vec3::Z), at, turned, size));
        }
        let leaf = stage.leaf();
        let alpha = stage.random.chance(0.5).then(|| stage.leaf_shape());
        stage.scene.shapes.push(Shape { alpha, ..shape(merge(leaves), leaf) });
    }
    daylight(stage);
    stage.look(Vec3::new(stage.random.range(-1.0, 1.0), 1.6, -5.5), Vec3::new(0.0, 1.2, 0.0), 38.0);
}

/// A fence of thin wires before a few balls; the lens is on one or the other.
pub(super) fn fence(stage: &mut Stage) {
    stage.format(96, 96, 5);
    let floor = stage.patterned(4.0);
    stage.add(ground(8.0), floor);
    let (radius, spacing) = (stage.random.octaves(0.004, 2.5), stage.random.range(0.12, 0.3));
    let count = (3.2 / spacing) as u32;
    let wires: Vec<_> = (0..=count)
        .flat_map(|i| {
            let x = i as f32 * spacing - 1.6;
            let upright = tube(&[Vec3::new(x, 0.0, 0.0), Vec3::new(x, 2.4, 0.0)], radius, 6);
            let across = tube(&[Vec3::new(-1.6, x + 1.6, 0.0), Vec3::new(1.6, x + 1.6, 0.0)], radius, 6);
            [upright, across]
        })
        .collect();
    let wire = if stage.random.chance(0.5) { stage.metal(0.0) } else { stage.matte() };
    stage.add(merge(wires), wire);
    for i in 0..3 {
        let r = &stage.random;
        let size = r.range(0.4, 0.65);
        let at = Vec3::new(i as f32 * 1.3 - 1.3, size, r.range(1.0, 2.5));
        let material = stage.anything();
        stage.add(sphere(at, size), material);
    }
    daylight(stage);
    let eye = Vec3::new(stage.random.range(-0.8, 0.8), 1.3, -4.0);
    stage.look(eye, Vec3::new(0.0, 1.0, 0.0), 36.0);
    if stage.random.chance(0.7) {
        let (radius, focus) = (stage.random.range(0.03, 0.12), stage.random.pick([4.0, 5.6]));
        stage.lens(radius, focus);
    }
}

/// A hall of columns with a lamp at many of them.
pub(super) fn columns(stage: &mut Stage) {
    stage.format(128, 96, 5);
    let (floor, stone) = (stage.plastic(0.6), stage.grey(0.4, 0.75));
    let stone = stage.diffuse(stone);
    stage.add(ground(14.0), floor);
    stage.add(quad(Vec3::Y * 3.0, Vec3::X * 14.0, Vec3::Z * 14.0), stone);
    let radius = stage.random.range(0.15, 0.3);
    let mut parts = Vec::new();
    for row in 0..6 {
        for side in [-1.0f32, 1.0] {
            let at = Vec3::new(side * 1.4, 0.0, row as f32 * 1.7 - 2.0);
            parts.push(place(tube(&[Vec3::ZERO, Vec3::Y * 3.0], radius, 32), at, Mat3::IDENTITY, 1.0));
            let foot = cuboid(Vec3::new(radius * 1.4, 0.08, radius * 1.4));
            stage.add(place(foot, at, Mat3::IDENTITY, 1.0), stone);
            if stage.random.chance(0.6) {
                let size = stage.random.octaves(0.02, 2.0);
                let radiance = stage.warmth() * (stage.random.range(0.1, 0.4) / (size * size));
                let lamp = at + Vec3::new(-side * (radius + 0.25), stage.random.range(1.2, 2.4), 0.0);
                stage.lamp(sphere(lamp, size), radiance);
            }
        }
    }
    stage.add(merge(parts), stone);
    stage.point_light(Vec3::new(0.0, 2.5, -2.5), Vec3::splat(0.6));
    let x = stage.random.range(-0.7, 0.7);
    stage.look(Vec3::new(x, stage.random.range(0.9, 1.8), -5.0), Vec3::new(-x * 0.5, 1.2, 2.0), 48.0);
}
