//! Turned bodies, polyhedra, a lamp in its shade.

use crate::description::TriangleMesh;
use crate::generate::training::pictures;
use crate::generate::training::shapes::{disk, ground, merge, pitch, place, placement, prism, quad, yaw};
use crate::generate::training::stage::{Stage, shape};
use crate::generate::turn::turn;
use crate::generate::{icosphere, revolve, vase_profile};
use glam::{Mat3, Vec3};

/// A profile of a glass of wall thickness `wall` with a stem.
fn goblet(wide: f32, wall: f32) -> TriangleMesh {
    let outside = [[0.45, 0.0], [0.42, 0.05], [0.1, 0.12], [0.08, 0.7]];
    let bowl = |t: f32| [0.08 + wide * turn(0.25 * t).0, 0.7 + 0.9 * t * t];
    let mut profile = vec![[0.0, 0.0]];
    profile.extend(outside);
    profile.extend((1..=16).map(|i| bowl(i as f32 / 16.0)));
    profile.extend((3..=16).rev().map(|i| bowl(i as f32 / 16.0)).map(|[r, h]| [r - wall, h + 0.3 * wall]));
    profile.push([0.0, 0.78]);
    revolve(&profile, 40)
}

/// A polyhedron of 20 or 80 flat faces.
fn polyhedron(level: u32) -> TriangleMesh {
    TriangleMesh { normals: None, ..icosphere(level) }
}

/// Vases in a studio of soft boxes.
pub(super) fn vases(stage: &mut Stage) {
    stage.format(128, 96, 6);
    let floor = if stage.random.chance(0.5) { stage.plastic(0.5) } else { stage.patterned(3.0) };
    stage.add(ground(8.0), floor);
    for i in 0..3 {
        let size = stage.random.range(0.6, 0.95);
        let at = Vec3::new(i as f32 * 1.5 - 1.5, 1e-3, stage.random.range(-0.3, 0.8));
        let vase = place(revolve(&vase_profile(30), 40), at, yaw(stage.random.unit()), size);
        let material = stage.anything();
        stage.add(vase, material);
    }
    let mut boxes = Vec::new();
    for _ in 0..2 + stage.random.below(2) {
        // The middle of the map is up.
        let center = [stage.random.range(0.3, 0.7), stage.random.range(0.3, 0.7)];
        let half = stage.random.range(0.035, 0.1);
        boxes.push((center, half, stage.warmth() * stage.random.octaves(4.0, 3.0)));
    }
    let fill = stage.random.range(0.1, 0.4);
    stage.environment(Vec3::ONE, Some(pictures::studio(Vec3::splat(fill), &boxes)));
    let eye = Vec3::new(stage.random.range(-1.5, 1.5), 1.9, -5.5);
    stage.look(eye, Vec3::new(0.0, 0.75, 0.0), 30.0);
    if stage.random.chance(0.5) {
        stage.lens(0.1, 5.6);
    }
}

/// Glasses before a lamp that is behind them: caustics on the table.
pub(super) fn goblets(stage: &mut Stage) {
    stage.format(96, 96, 10);
    let table = stage.grey(0.5, 0.8);
    let table = stage.diffuse(table);
    stage.add(ground(8.0), table);
    for i in 0..2 {
        let glass = stage.glass(0.8);
        let (wide, wall) = (stage.random.range(0.3, 0.5), stage.random.range(0.04, 0.08));
        let at = Vec3::new(i as f32 * 1.3 - 0.65, 0.01, stage.random.range(-0.2, 0.4));
        stage.add(place(goblet(wide, wall), at, Mat3::IDENTITY, 0.95), glass);
    }
    let radius = stage.random.range(0.3, 0.8);
    let at = Vec3::new(stage.random.range(-1.5, 1.5), 3.2, 2.5);
    let radiance = stage.warmth() * (8.0 / (radius * radius));
    stage.lamp(disk(at, -at, radius), radiance);
    let fill = stage.random.octaves(0.03, 3.0);
    stage.environment(Vec3::splat(fill), None);
    stage.look(Vec3::new(0.0, 2.3, -4.4), Vec3::new(0.0, 0.65, 0.0), 38.0);
}

/// A lamp in a shade with slits, in the dark.
pub(super) fn lantern(stage: &mut Stage) {
    stage.format(96, 96, 5);
    let floor = stage.matte();
    stage.add(ground(5.0), floor);
    stage.add(quad(Vec3::new(0.0, 2.5, 2.0), Vec3::Y * 2.5, Vec3::X * 5.0), floor);
    let panels = 9 + stage.random.below(10);
    let share = stage.random.range(0.55, 0.85);
    let (radius, height) = (0.6, 1.1);
    let point = |t: f32| {
        let (sin, cos) = turn(t / panels as f32);
        Vec3::new(radius * cos, 0.7, radius * sin)
    };
    let shade = (0..panels).map(|i| {
        let (a, b) = (point(i as f32), point(i as f32 + share));
        quad((a + b) * 0.5, (b - a) * 0.5, Vec3::Y * (height / 2.0))
    });
    let material = stage.metal(0.0);
    stage.add(merge(shade), material);
    let lid = place(prism(panels, radius * 1.05, 0.25, 0.2), Vec3::Y * 1.25, Mat3::IDENTITY, 1.0);
    stage.add(lid, material);
    let size = stage.random.octaves(0.03, 2.0);
    let bulb = place(polyhedron(1), Vec3::Y * 0.7, Mat3::IDENTITY, size);
    let radiance = stage.warmth() * (0.9 / (size * size));
    stage.lamp(bulb, radiance);
    let body = stage.opaque();
    let turned = yaw(stage.random.unit());
    stage.add(place(prism(5, 0.35, 0.9, 0.0), Vec3::new(1.5, 1e-3, 0.3), turned, 1.0), body);
    stage.look(Vec3::new(stage.random.range(-1.2, 1.2), 2.2, -5.0), Vec3::new(0.2, 0.7, 0.3), 38.0);
}

/// A heap of polyhedra and pyramids under coloured spot lights.
pub(super) fn heap(stage: &mut Stage) {
    stage.format(128, 96, 5);
    let floor = stage.plastic(0.5);
    stage.add(ground(10.0), floor);
    let mut kinds = Vec::new();
    for i in 0..4 {
        let mesh = match i {
            0 => place(polyhedron(0), Vec3::ZERO, Mat3::IDENTITY, 0.32),
            1 => place(polyhedron(1), Vec3::ZERO, Mat3::IDENTITY, 0.32),
            2 => place(prism(3, 0.4, 0.5, 0.0), Vec3::Y * -0.2, Mat3::IDENTITY, 1.0),
            _ => place(prism(5, 0.3, 0.4, 0.6), Vec3::Y * -0.2, Mat3::IDENTITY, 1.0),
        };
        let material = stage.opaque();
        kinds.push(stage.object(vec![shape(mesh, material)]));
    }
    for layer in 0..4 {
        let side = 4 - layer;
        for cell in 0..side * side {
            let r = &stage.random;
            let at = |i: u32, r: &crate::generate::training::random::Random| {
                (i as f32 - (side - 1) as f32 / 2.0) * 0.62 + r.range(-0.1, 0.1)
            };
            let (x, z) = (at(cell % side, r), at(cell / side, r));
            let rotation = yaw(r.unit()) * pitch(r.unit());
            let object = r.pick([kinds[0], kinds[1], kinds[2], kinds[3]]);
            stage.instance(object, placement(Vec3::new(x, 0.33 + 0.5 * layer as f32, z), rotation, 1.0));
        }
    }
    for i in 0..3 + stage.random.below(4) {
        let (sin, cos) = turn(i as f32 * 0.17 - 0.1);
        let from = Vec3::new(3.5 * cos, stage.random.range(2.0, 4.5), -3.5 * sin);
        let at = Vec3::new(stage.random.range(-0.5, 0.5), 0.8, 0.0);
        let intensity = stage.color() * stage.random.range(25.0, 60.0);
        let cone = stage.random.range(14.0, 30.0);
        stage.spot_light(from, at, cone, intensity);
    }
    stage.environment(Vec3::splat(0.04), None);
    stage.look(Vec3::new(stage.random.range(-2.0, 2.0), 2.6, -5.5), Vec3::new(0.0, 0.7, 0.0), 34.0);
}
