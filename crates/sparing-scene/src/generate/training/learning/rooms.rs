//! Rooms of flat walls.

use crate::generate::training::shapes::{cuboid, place, quad, sphere, wall_with_hole, yaw};
use crate::generate::training::stage::Stage;
use glam::{Mat3, Vec3};

/// Half the width and depth, and the height of a room that stands on the ground around the origin.
struct Room {
    half: Vec3,
}

impl Room {
    fn new(stage: &mut Stage) -> Self {
        let r = &stage.random;
        Self { half: Vec3::new(r.range(1.1, 1.6), r.range(1.0, 1.3), r.range(1.2, 1.7)) }
    }

    /// Floor, ceiling and the walls at x, -x, z, -z that are wanted, facing inwards.
    fn build(&self, stage: &mut Stage, walls: [bool; 4]) {
        let h = self.half;
        let (x, y, z) = (Vec3::X * h.x, Vec3::Y * h.y, Vec3::Z * h.z);
        let plain = stage.grey(0.6, 0.8);
        let plain = stage.diffuse(plain);
        let floor = if stage.random.chance(0.5) { stage.patterned(1.5) } else { plain };
        stage.add(quad(Vec3::ZERO, z, x), floor);
        stage.add(quad(y * 2.0, x, z), plain);
        let (left, right) = (stage.matte(), stage.matte());
        let sides = [
            (quad(y + x, z, y), right),
            (quad(y - x, y, z), left),
            (quad(y + z, y, x), plain),
            (quad(y - z, x, y), plain),
        ];
        for ((mesh, material), wanted) in sides.into_iter().zip(walls) {
            if wanted {
                stage.add(mesh, material);
            }
        }
    }

    /// Boxes and balls on the floor, away from the walls, in the half of the room at positive z.
    fn furnish(&self, stage: &mut Stage, count: u32) {
        for i in 0..count {
            let r = &stage.random;
            let size = r.range(0.18, 0.34);
            let x = self.half.x * (-0.7 + 1.4 * (i as f32 + r.range(0.3, 0.7)) / count as f32);
            let z = self.half.z * r.range(-0.25, 0.6);
            if r.chance(0.6) {
                let half = Vec3::new(size, size * r.range(0.7, 2.2), size * r.range(0.6, 1.0));
                let mesh = place(cuboid(half), Vec3::new(x, 0.0, z), yaw(r.unit()), 1.0);
                let material = stage.opaque();
                stage.add(mesh, material);
            } else {
                let material = stage.anything();
                stage.add(sphere(Vec3::new(x, size + 1e-3, z), size), material);
            }
        }
    }
}

/// A closed box seen through its open front, under a ceiling lamp from tiny to as large as the ceiling.
pub(super) fn box_room(stage: &mut Stage) {
    stage.format(96, 96, 7);
    let room = Room::new(stage);
    room.build(stage, [true, true, true, false]);
    let count = 2 + stage.random.below(3);
    room.furnish(stage, count);
    let half = stage.random.octaves(0.02, 5.2).min(0.9 * room.half.x);
    let lamp = quad(Vec3::new(0.0, 2.0 * room.half.y - 0.01, 0.0), Vec3::X * half, Vec3::Z * half);
    let radiance = stage.warmth() * (3.0 / (4.0 * half * half));
    stage.lamp(lamp, radiance);
    // Tangents of half the field of view.
    let (fov, tan) = stage.random.pick([(30.0, 0.268), (40.0, 0.364), (50.0, 0.466)]);
    let distance = room.half.y.max(room.half.x) / tan;
    let (dx, y) = (stage.random.range(-0.3, 0.3), room.half.y);
    stage.look(Vec3::new(dx, y, -room.half.z - distance), Vec3::new(0.0, y, 0.0), fov);
}

/// Inside a room, lit through a window in the right wall only.
pub(super) fn window_room(stage: &mut Stage) {
    stage.format(128, 96, 8);
    let room = Room::new(stage);
    room.build(stage, [false, true, true, true]);
    let h = room.half;
    let wall = stage.matte();
    let (u, v) = (stage.random.range(0.1, 0.4), stage.random.range(0.15, 0.35));
    let hole = [0.5 + 0.4 * u, 0.95 - 0.4 * u, 0.7 - v, 0.7 + v * 0.6];
    stage.add(wall_with_hole(Vec3::new(h.x, h.y, 0.0), Vec3::Z * h.z, Vec3::Y * h.y, hole), wall);
    room.furnish(stage, 3);
    let sky = stage.random.octaves(2.0, 3.0);
    stage.environment(Vec3::new(0.75, 0.95, 1.3) * sky, None);
    if stage.random.chance(0.6) {
        let from = Vec3::new(1.0, stage.random.range(0.5, 1.2), stage.random.range(-0.3, 0.3));
        stage.sun(from, Vec3::new(1.1, 1.0, 0.8) * (sky * 6.0));
    }
    // Half of the scenes do not see the window itself.
    if stage.random.chance(0.5) {
        let eye = Vec3::new(-0.6 * h.x, 1.1 * h.y, -0.92 * h.z);
        stage.look(eye, Vec3::new(0.15 * h.x, 0.7 * h.y, 0.6 * h.z), 62.0);
    } else {
        let eye = Vec3::new(0.8 * h.x, 1.2 * h.y, -0.92 * h.z);
        stage.look(eye, Vec3::new(-0.35 * h.x, 0.65 * h.y, 0.5 * h.z), 62.0);
    }
}

/// A lamp that shines at the ceiling from a shelf, or stands behind a screen: no direct light in view.
pub(super) fn hidden_lamp(stage: &mut Stage) {
    stage.format(96, 96, 9);
    let room = Room::new(stage);
    room.build(stage, [true, true, true, false]);
    room.furnish(stage, 3);
    let h = room.half;
    let color = stage.warmth();
    let material = stage.matte();
    if stage.random.chance(0.5) {
        let half = stage.random.range(0.1, 0.4);
        let at = Vec3::new(stage.random.range(-0.5, 0.5), 1.45 * h.y, 0.3);
        stage
            .add(place(cuboid(Vec3::new(half + 0.05, 0.03, half + 0.05)), at, Mat3::IDENTITY, 1.0), material);
        stage.lamp(quad(at + Vec3::Y * 0.07, Vec3::Z * half, Vec3::X * half), color * (5.0 / (half * half)));
    } else {
        let side = stage.random.pick([-1.0, 1.0]);
        let screen = cuboid(Vec3::new(0.03, 0.85 * h.y, 0.55 * h.z));
        stage
            .add(place(screen, Vec3::new(side * 0.55 * h.x, 0.0, 0.45 * h.z), Mat3::IDENTITY, 1.0), material);
        let radius = stage.random.octaves(0.02, 3.0);
        let center = Vec3::new(side * 0.8 * h.x, 0.5 * h.y, 0.4 * h.z);
        stage.lamp(sphere(center, radius), color * (2.5 / (radius * radius)));
    }
    let distance = h.y.max(h.x) / 0.364;
    stage.look(Vec3::new(0.0, h.y, -h.z - distance), Vec3::new(0.0, h.y, 0.0), 40.0);
}

/// From outside, through a window with or without its pane, into a lit room.
pub(super) fn behind_a_pane(stage: &mut Stage) {
    stage.format(96, 96, 7);
    let room = Room::new(stage);
    room.build(stage, [true, true, true, false]);
    room.furnish(stage, 4);
    let h = room.half;
    let wall = stage.patterned(2.0);
    let center = Vec3::new(0.0, h.y, -h.z);
    let hole =
        [stage.random.range(0.26, 0.36), stage.random.range(0.6, 0.74), 0.16, stage.random.range(0.45, 0.6)];
    stage.add(wall_with_hole(center, Vec3::X * (h.x + 1.0), Vec3::Y * h.y * 1.4, hole), wall);
    if stage.random.chance(0.7) {
        let pane = stage.material("pane", crate::description::MaterialKind::ThinDielectric { eta: 1.5 });
        stage.add(quad(center, Vec3::X * (h.x + 1.0), Vec3::Y * h.y * 1.4), pane);
    }
    let (radius, color) = (stage.random.octaves(0.03, 3.0), stage.warmth());
    let lamp = Vec3::new(stage.random.range(-0.4, 0.4), 1.6 * h.y, 0.2 * h.z);
    stage.lamp(sphere(lamp, radius), color * (1.5 / (radius * radius)));
    stage.environment(Vec3::new(0.1, 0.13, 0.2), None);
    let eye = Vec3::new(stage.random.range(-0.8, 0.8), 1.2 * h.y, -h.z - 3.2);
    stage.look(eye, Vec3::new(0.0, 0.85 * h.y, 0.0), 44.0);
}
