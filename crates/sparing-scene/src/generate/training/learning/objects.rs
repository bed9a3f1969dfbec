//! Things on a table, on a floor, in the dark.

use crate::description::TriangleMesh;
use crate::generate::torus_knot;
use crate::generate::training::pictures;
use crate::generate::training::shapes::{
    cuboid, ground, merge, pitch, place, placement, quad, sphere, tube, yaw,
};
use crate::generate::training::stage::{Stage, shape};
use crate::generate::turn::turn;
use glam::{Mat3, Vec3};

/// A ring of radius 1 in the plane y = 0.
fn torus(thickness: f32) -> TriangleMesh {
    let (around, sides) = (64, 16);
    let circle: Vec<Vec3> = (0..=around)
        .map(|i| turn((i % around) as f32 / around as f32))
        .map(|(sin, cos)| Vec3::new(cos, 0.0, sin))
        .collect();
    let mut ring = tube(&circle, thickness, sides);
    // The tube's ends are tilted by half a step: make them meet.
    let first: Vec<Vec3> = ring.positions[..sides as usize].iter().map(|p| Vec3::from(*p)).collect();
    let last = around as usize * sides as usize;
    for (k, p) in first.iter().enumerate() {
        let middle = (*p + Vec3::from(ring.positions[last + k])) * 0.5;
        ring.positions[k] = middle.to_array();
        ring.positions[last + k] = middle.to_array();
        ring.normals.iter_mut().for_each(|n| n[last + k] = n[k]);
    }
    ring
}

/// Light for things that stand free: a sky, an even surrounding with a small lamp, or a large lamp.
fn light(stage: &mut Stage) {
    match stage.random.below(3) {
        0 => {
            let sun = Vec3::new(stage.random.range(-0.8, 0.8), stage.random.range(0.3, 0.9), -0.5)
                .normalize_or(Vec3::Y);
            let (strength, sharpness) = (stage.random.octaves(5.0, 4.0), stage.random.octaves(20.0, 4.0));
            let sky =
                pictures::sky(Vec3::new(0.25, 0.4, 0.8), Vec3::new(0.7, 0.75, 0.8), sun, strength, sharpness);
            stage.environment(Vec3::ONE, Some(sky));
        }
        1 => {
            let fill = stage.random.octaves(0.02, 4.0);
            stage.environment(Vec3::splat(fill), None);
            let radius = stage.random.octaves(0.015, 3.0);
            let at = Vec3::new(stage.random.range(-2.0, 2.0), stage.random.range(2.0, 3.5), -1.5);
            let radiance = stage.warmth() * (4.0 / (radius * radius));
            stage.lamp(sphere(at, radius), radiance);
        }
        _ => {
            stage.environment(Vec3::splat(0.03), None);
            let half = stage.random.range(0.5, 1.5);
            let at = Vec3::new(stage.random.range(-1.0, 1.0), 3.5, -0.5);
            let radiance = stage.warmth() * (12.0 / (half * half));
            stage.lamp(quad(at, Vec3::X * half, Vec3::Z * half), radiance);
        }
    }
}

/// Balls and boxes of all materials on a patterned table; depth of field on half of them.
pub(super) fn table(stage: &mut Stage) {
    stage.format(128, 96, 7);
    let top = if stage.random.chance(0.7) { stage.patterned(4.0) } else { stage.plastic(0.5) };
    stage.add(ground(6.0), top);
    let columns = 3 + stage.random.below(2);
    for i in 0..columns * 2 {
        let r = &stage.random;
        let (column, row) = ((i % columns) as f32, (i / columns) as f32);
        let x = (column - (columns - 1) as f32 / 2.0) * 1.15 + r.range(-0.15, 0.15);
        let (z, radius) = (row * 1.3 + r.range(-0.2, 0.2), r.range(0.3, 0.5));
        if r.chance(0.65) {
            let material = stage.anything();
            stage.add(sphere(Vec3::new(x, radius + 1e-3, z), radius), material);
        } else {
            let box_ = place(cuboid(Vec3::splat(radius * 0.8)), Vec3::new(x, 1e-3, z), yaw(r.unit()), 1.0);
            let material = stage.opaque();
            stage.add(box_, material);
        }
    }
    light(stage);
    let eye = Vec3::new(stage.random.range(-1.5, 1.5), stage.random.range(1.3, 2.8), -5.0);
    stage.look(eye, Vec3::new(0.0, 0.35, 0.4), 34.0);
    if stage.random.chance(0.5) {
        let radius = stage.random.range(0.05, 0.15);
        stage.lens(radius, eye.distance(Vec3::new(0.0, 0.4, 0.0)));
    }
}

/// One knotted tube under a small lamp, in a dim surrounding.
pub(super) fn knot(stage: &mut Stage) {
    stage.format(96, 96, 4);
    let floor = stage.grey(0.3, 0.7);
    let floor = stage.diffuse(floor);
    stage.add(ground(8.0), floor);
    let (p, q) = stage.random.pick([(2, 3), (2, 5), (3, 4)]);
    let tube = stage.random.range(0.25, 0.45);
    let rotation = pitch(stage.random.range(0.1, 0.2)) * yaw(stage.random.unit());
    let mesh = place(torus_knot(p, q, 220, 16, tube), Vec3::new(0.0, 1.35, 0.0), rotation, 0.42);
    let material = stage.opaque();
    stage.add(mesh, material);
    let radius = stage.random.octaves(0.02, 4.0);
    let at = Vec3::new(stage.random.range(-2.5, 2.5), 4.0, stage.random.range(-3.0, 0.0));
    let radiance = stage.warmth() * (7.0 / (radius * radius));
    stage.lamp(sphere(at, radius), radiance);
    let fill = stage.random.octaves(0.01, 4.0);
    stage.environment(Vec3::splat(fill), None);
    let eye = Vec3::new(stage.random.range(-1.0, 1.0), stage.random.range(1.2, 3.0), -5.0);
    stage.look(eye, Vec3::new(0.0, 1.1, 0.0), stage.random.range(30.0, 42.0));
}

/// Glossy plates that mirror lamps of several sizes, after E. Veach (1997), section 9.3.
pub(super) fn plates(stage: &mut Stage) {
    stage.format(128, 96, 4);
    let wall = stage.grey(0.2, 0.5);
    let wall = stage.diffuse(wall);
    stage.add(merge([ground(9.0), quad(Vec3::new(0.0, 4.0, 4.0), Vec3::Y * 4.0, Vec3::X * 9.0)]), wall);
    for i in 0..4 {
        let height = 0.25 + 0.55 * i as f32;
        let tilt = pitch(-0.05 - 0.014 * i as f32);
        let plate = place(
            quad(Vec3::ZERO, Vec3::Z * 0.4, Vec3::X * 3.0),
            Vec3::new(0.0, height, -0.9 + 0.8 * i as f32),
            tilt,
            1.0,
        );
        let material = if stage.random.chance(0.7) { stage.metal(0.0) } else { stage.plastic(0.0) };
        stage.add(plate, material);
    }
    let count = 2 + stage.random.below(3);
    for i in 0..count {
        let radius = stage.random.octaves(0.03, 4.5);
        let x = (i as f32 + 0.5) / count as f32 * 6.0 - 3.0;
        let radiance = stage.color() * (0.9 / (radius * radius));
        stage.lamp(sphere(Vec3::new(x, 3.6, 1.6), radius), radiance);
    }
    stage.environment(Vec3::splat(0.02), None);
    stage.look(Vec3::new(stage.random.range(-1.0, 1.0), 2.6, -7.5), Vec3::new(0.0, 1.6, 0.0), 38.0);
}

/// Light through glass balls and rings onto the floor.
pub(super) fn caustic(stage: &mut Stage) {
    stage.format(96, 96, 8);
    let floor = stage.grey(0.5, 0.8);
    let floor = stage.diffuse(floor);
    stage.add(ground(8.0), floor);
    for i in 0..2 {
        let glass = if i == 1 && stage.random.chance(0.4) { stage.metal(1.0) } else { stage.glass(0.85) };
        let x = i as f32 * 1.7 - 0.85 + stage.random.range(-0.1, 0.1);
        if stage.random.chance(0.5) {
            let radius = stage.random.range(0.5, 0.75);
            stage.add(sphere(Vec3::new(x, radius + 0.02, 0.3), radius), glass);
        } else {
            let thickness = stage.random.range(0.25, 0.4);
            let ring = place(torus(thickness), Vec3::new(x, 0.35, 0.0), yaw(stage.random.unit()), 0.6);
            stage.add(ring, glass);
        }
    }
    let half = stage.random.range(0.25, 0.7);
    let at = Vec3::new(stage.random.range(-2.0, 2.0), 3.5, stage.random.range(0.0, 2.5));
    let toward = -at.normalize_or(Vec3::Y);
    let x = toward.any_orthonormal_vector();
    let radiance = stage.warmth() * (9.0 / (half * half));
    stage.lamp(quad(at, x * half, toward.cross(x) * half), radiance);
    let fill = stage.random.octaves(0.01, 3.0);
    stage.environment(Vec3::splat(fill), None);
    stage.look(Vec3::new(0.0, 2.6, -4.6), Vec3::new(0.0, 0.4, 0.1), 40.0);
}

/// A few small lit things; the rest of the frame is black.
pub(super) fn dark_frame(stage: &mut Stage) {
    stage.format(128, 96, 4);
    let count = 1 + stage.random.below(3);
    for i in 0..count {
        let r = &stage.random;
        let at = Vec3::new(
            (i as f32 - (count - 1) as f32 / 2.0) * 2.2 + r.range(-0.4, 0.4),
            r.range(-1.0, 1.0),
            0.0,
        );
        let size = r.range(0.25, 0.5);
        let mesh = place(cuboid(Vec3::splat(size)), at, pitch(r.unit()) * yaw(r.unit()), 1.0);
        let material = stage.opaque();
        if stage.random.chance(0.5) {
            stage.add(mesh, material);
        } else {
            stage.add(sphere(at, size), material);
        }
        let intensity = stage.warmth() * stage.random.octaves(4.0, 2.0);
        stage.point_light(at + Vec3::new(0.9, 1.3, -1.3), intensity);
    }
    stage.look(Vec3::new(0.0, 0.0, -8.0), Vec3::ZERO, 32.0);
}

/// Piles of boxes and rings, placed by instances, under coloured point lights.
pub(super) fn stacks(stage: &mut Stage) {
    stage.format(96, 96, 5);
    let floor = stage.plastic(0.5);
    stage.add(ground(10.0), floor);
    let mut kinds = Vec::new();
    for i in 0..4 {
        let material = stage.opaque();
        let mesh = if i % 2 == 0 {
            cuboid(Vec3::new(0.3, 0.15, 0.3))
        } else {
            place(torus(0.5), Vec3::Y * 0.15, Mat3::IDENTITY, 0.3)
        };
        kinds.push(stage.object(vec![shape(mesh, material)]));
    }
    for pile in 0..9 {
        let r = &stage.random;
        let x = (pile % 3) as f32 * 1.1 - 1.1 + r.range(-0.15, 0.15);
        let z = (pile / 3) as f32 * 1.2 - 0.6 + r.range(-0.15, 0.15);
        for level in 0..1 + r.below(6) {
            let object = stage.random.pick([kinds[0], kinds[1], kinds[2], kinds[3]]);
            let y = 1e-3 + 0.302 * level as f32;
            let drift = Vec3::new(stage.random.range(-0.05, 0.05), 0.0, stage.random.range(-0.05, 0.05));
            let turned = yaw(stage.random.unit());
            stage.instance(object, placement(Vec3::new(x, y, z) + drift, turned, 1.0));
        }
    }
    for _ in 0..2 + stage.random.below(3) {
        let at = Vec3::new(
            stage.random.range(-3.0, 3.0),
            stage.random.range(1.8, 4.0),
            stage.random.range(-3.0, 1.0),
        );
        let intensity = stage.color() * stage.random.range(5.0, 14.0);
        stage.point_light(at, intensity);
    }
    stage.environment(Vec3::splat(0.05), None);
    stage.look(Vec3::new(stage.random.range(-2.0, 2.0), 2.6, -5.0), Vec3::new(0.0, 0.6, 0.3), 38.0);
}
