//! Rooms of bodies and openings that the training scenes do not have.

use crate::description::TriangleMesh;
use crate::generate::gear;
use crate::generate::training::shapes::{disk, ground, merge, pitch, place, prism, quad, yaw};
use crate::generate::training::stage::Stage;
use crate::generate::turn::turn;
use glam::{Mat3, Vec3};

/// Wall panels around the y axis, facing inwards, from one angle to another, in turns.
fn round_wall(corners: u32, radius: f32, height: f32, from: f32, to: f32) -> TriangleMesh {
    let point = |i: u32| {
        let (sin, cos) = turn(from + (to - from) * i as f32 / corners as f32);
        Vec3::new(radius * cos, height / 2.0, radius * sin)
    };
    merge((0..corners).map(|i| {
        let (a, b) = (point(i), point(i + 1));
        quad((a + b) * 0.5, (b - a) * 0.5, Vec3::Y * (height / 2.0))
    }))
}

/// Half a barrel along z over the ground, facing inwards.
fn barrel(radius: f32, half_length: f32) -> TriangleMesh {
    let point = |i: u32| {
        let (sin, cos) = turn(i as f32 / 48.0);
        Vec3::new(radius * cos, radius * sin, 0.0)
    };
    merge((0..24).map(|i| {
        let (a, b) = (point(i), point(i + 1));
        quad((a + b) * 0.5, Vec3::Z * half_length, (b - a) * 0.5)
    }))
}

/// A round room with gears on plinths under a round lamp.
pub(super) fn rotunda(stage: &mut Stage) {
    stage.format(96, 96, 7);
    let (wall, floor) = (stage.matte(), stage.patterned(2.0));
    let corners = stage.random.pick([9, 12, 15]);
    stage.add(round_wall(corners, 2.2, 2.6, -0.12, 0.62), wall);
    stage.add(ground(2.6), floor);
    let ceiling = stage.grey(0.6, 0.8);
    let ceiling = stage.diffuse(ceiling);
    stage.add(quad(Vec3::Y * 2.6, Vec3::X * 2.6, Vec3::Z * 2.6), ceiling);
    for i in 0..3 {
        let x = i as f32 * 1.15 - 1.15;
        let z = stage.random.range(-0.2, 0.8);
        let height = stage.random.range(0.4, 0.9);
        let corners = stage.random.pick([3, 5, 6]);
        let plinth =
            place(prism(corners, 0.38, height, 0.8), Vec3::new(x, 1e-3, z), yaw(stage.random.unit()), 1.0);
        let material = stage.opaque();
        stage.add(plinth, material);
        let upright = pitch(0.25 + stage.random.range(-0.05, 0.05)) * yaw(stage.random.unit());
        let wheel = gear(stage.random.pick([9, 13, 17]), 0.4, 0.15);
        let material = stage.opaque();
        stage.add(place(wheel, Vec3::new(x, height + 0.42, z), upright, 1.0), material);
    }
    let radius = stage.random.octaves(0.04, 4.0);
    let radiance = stage.warmth() * (2.5 / (radius * radius));
    stage.lamp(disk(Vec3::new(0.0, 2.59, 0.0), Vec3::NEG_Y, radius), radiance);
    stage.look(Vec3::new(stage.random.range(-0.4, 0.4), 1.4, -5.0), Vec3::new(0.0, 1.0, 0.0), 42.0);
}

/// A closed room lit through the slats of a blind.
pub(super) fn blinds(stage: &mut Stage) {
    stage.format(128, 96, 8);
    let (wall, floor) = (stage.grey(0.55, 0.8), stage.patterned(2.0));
    let wall = stage.diffuse(wall);
    let (x, y, z) = (Vec3::X * 1.5, Vec3::Y * 1.2, Vec3::Z * 1.6);
    stage.add(ground(1.6), floor);
    stage.add(
        merge([quad(y * 2.0, x * 1.1, z), quad(y - x, y, z), quad(y + z, y, x), quad(y - z, x, y)]),
        wall,
    );
    let count = 8 + stage.random.below(8);
    let tilt = stage.random.range(0.05, 0.1);
    let slats = (0..count).map(|i| {
        let height = 2.4 * (i as f32 + 0.5) / count as f32;
        let (sin, cos) = turn(tilt);
        quad(Vec3::new(1.5, height, 0.0), Vec3::Z * 1.6, Vec3::new(-cos, -sin, 0.0) * (1.05 / count as f32))
    });
    let slat = stage.matte();
    stage.add(merge(slats), slat);
    for i in 0..3 {
        let r = &stage.random;
        let (height, radius) = (r.range(0.3, 1.1), r.range(0.2, 0.35));
        let at = Vec3::new(i as f32 * 0.8 - 0.9, 1e-3, r.range(0.0, 1.0));
        let body = place(prism(r.pick([3, 5, 8]), radius, height, r.range(0.0, 1.0)), at, yaw(r.unit()), 1.0);
        let material = stage.opaque();
        stage.add(body, material);
    }
    let sky = stage.random.octaves(3.0, 2.0);
    stage.environment(Vec3::new(0.8, 0.95, 1.2) * sky, None);
    if stage.random.chance(0.6) {
        stage.sun(Vec3::new(1.0, stage.random.range(0.2, 0.5), 0.1), Vec3::new(1.1, 1.0, 0.8) * (sky * 8.0));
    }
    // Half of the scenes do not see the blind itself.
    if stage.random.chance(0.5) {
        stage.look(Vec3::new(-0.9, 1.3, -1.5), Vec3::new(0.2, 0.85, 1.0), 62.0);
    } else {
        stage.look(Vec3::new(1.2, 1.4, -1.5), Vec3::new(-0.45, 0.8, 0.8), 62.0);
    }
}

/// A barrel vault whose light comes over a screen: indirect only.
pub(super) fn vault(stage: &mut Stage) {
    stage.format(96, 96, 9);
    let (stone, floor) = (stage.grey(0.6, 0.8), stage.patterned(2.0));
    let stone = stage.diffuse(stone);
    stage.add(barrel(1.8, 2.2), stone);
    stage.add(ground(2.4), floor);
    let end = stage.matte();
    stage.add(quad(Vec3::new(0.0, 1.0, 2.2), Vec3::Y, Vec3::X * 2.0), end);
    let height = stage.random.range(0.9, 1.25);
    let screen = prism(6, 0.85, height, 1.0);
    let material = stage.plastic(0.5);
    stage.add(place(screen, Vec3::new(0.0, 1e-3, 1.1), yaw(stage.random.unit()), 1.0), material);
    let radius = stage.random.octaves(0.08, 2.5);
    let radiance = stage.warmth() * (2.2 / (radius * radius));
    stage.lamp(disk(Vec3::new(0.0, height + 0.05, 1.2), Vec3::new(0.0, 1.0, 0.25), radius), radiance);
    for side in [-1.0f32, 1.0] {
        let corners = stage.random.pick([3, 7]);
        let cone =
            place(prism(corners, 0.3, 0.8, 0.1), Vec3::new(side * 1.1, 1e-3, 0.0), Mat3::IDENTITY, 1.0);
        let material = stage.opaque();
        stage.add(cone, material);
    }
    stage.look(Vec3::new(0.0, 0.8, -5.2), Vec3::new(0.0, 0.85, 0.0), 28.0);
}

/// Steps with a small lamp at the side of each.
pub(super) fn steps(stage: &mut Stage) {
    stage.format(96, 96, 6);
    let (stone, wall) = (stage.patterned(0.6), stage.matte());
    stage.add(ground(6.0), wall);
    stage.add(quad(Vec3::new(0.0, 3.0, 3.2), Vec3::Y * 3.0, Vec3::X * 6.0), wall);
    let count = 7;
    let size = stage.random.octaves(0.02, 2.0);
    for i in 0..count {
        let (low, front) = (0.25 * i as f32, 0.42 * i as f32 - 0.8);
        let rise = quad(Vec3::new(0.0, low + 0.125, front), Vec3::X * -1.4, Vec3::Y * 0.125);
        let tread = quad(Vec3::new(0.0, low + 0.25, front + 0.21), Vec3::Z * 0.21, Vec3::X * 1.4);
        let side = |x: f32| {
            let axes = (Vec3::Z * 0.21, Vec3::Y * (low / 2.0 + 0.125));
            let (a, b) = if x > 0.0 { (axes.1, axes.0) } else { axes };
            quad(Vec3::new(x, low / 2.0 + 0.125, front + 0.21), a, b)
        };
        stage.add(merge([rise, tread, side(1.4), side(-1.4)]), stone);
        let x = if i % 2 == 0 { 1.25 } else { -1.25 };
        let at = Vec3::new(x, low + 0.55, front + 0.2);
        let radiance = stage.warmth() * (0.22 / (size * size));
        stage.lamp(disk(at, Vec3::new(-x, -0.8, -0.4), size), radiance);
    }
    let material = stage.opaque();
    stage.add(place(gear(11, 0.5, 0.2), Vec3::new(0.0, 2.3, 2.3), pitch(0.22), 1.0), material);
    stage.environment(Vec3::splat(0.02), None);
    stage.look(Vec3::new(stage.random.range(-1.5, 1.5), 2.0, -5.2), Vec3::new(0.0, 1.0, 0.6), 36.0);
}
