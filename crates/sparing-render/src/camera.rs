//! Perspective camera with a thin lens, orthographic and spherical cameras (C. Kolb et al. 1995 for the lens;
//! conventions of "Physically Based Rendering", 4th ed., chapter 5).

use crate::lights::square_to_equal_area;
use crate::sampling::concentric_disk;
use crate::scene::Way;
use glam::{Affine3A, Mat4, Vec3};
use sparing_scene::description::{self as d, Projection};
use std::f32::consts::PI;

/// A camera for a picture of a given size.
#[derive(Clone, Debug)]
pub struct Camera {
    camera_to_world: Mat4,
    /// Its way while the shutter is open, if it moves.
    way: Option<Way>,
    /// Image plane at z = 1 (perspective) or z = 0 (orthographic): position of raster (0, 0) and step a pixel.
    plane_origin: [f32; 2],
    plane_step: [f32; 2],
    projection: Projection,
    /// 1 / width and height of the picture in pixels.
    inverse_size: [f32; 2],
    lens_radius: f32,
    focal_distance: f32,
}

/// A ray from the camera; `direction` is unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// World space.
    pub origin: Vec3,
    /// World space, unit.
    pub direction: Vec3,
    /// Cosine between the ray and the camera's axis: depth = distance * cos.
    pub cos_axis: f32,
}

impl Camera {
    /// Prepares a camera for a picture of `width` x `height`.
    #[must_use]
    pub fn new(camera: &d::Camera, width: u32, height: u32) -> Self {
        let aspect = width as f32 / height as f32;
        let [x0, x1, y0, y1] = camera.screen_window.unwrap_or(if aspect > 1.0 {
            [-aspect, aspect, -1.0, 1.0]
        } else {
            [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
        });
        let (scale, lens_radius) = match camera.projection {
            Projection::Perspective { fov } => ((fov.to_radians() * 0.5).tan(), camera.lens_radius),
            Projection::Orthographic => (1.0, camera.lens_radius),
            Projection::EqualArea | Projection::Equirectangular => (1.0, 0.0),
        };
        let mut camera_to_world = camera.camera_to_world;
        let motion = camera
            .end
            .and_then(|end| d::Motion::new(Affine3A::from_mat4(camera_to_world), Affine3A::from_mat4(end)));
        let steps = motion.map(|motion| motion.steps(camera.shutter));
        if let Some(first) = steps.as_ref().and_then(|steps| steps.first()) {
            camera_to_world = Mat4::from(*first);
        }
        Self {
            camera_to_world,
            way: steps.and_then(Way::new),
            plane_origin: [x0 * scale, y1 * scale],
            plane_step: [(x1 - x0) * scale / width as f32, (y0 - y1) * scale / height as f32],
            projection: camera.projection,
            inverse_size: [1.0 / width as f32, 1.0 / height as f32],
            lens_radius,
            focal_distance: camera.focal_distance,
        }
    }

    /// Whether rays need a lens sample.
    #[must_use]
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Whether rays need a time.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.way.is_some()
    }

    /// The camera when a ray at a time in 0..=1 of the shutter starts.
    #[must_use]
    pub fn at(&self, time: f32) -> Self {
        let camera_to_world = self.way.as_ref().map_or(self.camera_to_world, |way| Mat4::from(way.at(time)));
        Self { camera_to_world, way: None, ..*self }
    }

    /// The ray through raster position (`x`, `y`), pixels from the upper left corner of the picture; `lens`
    /// is uniform in the unit square and ignored by a pinhole.
    #[inline]
    #[must_use]
    pub fn ray(&self, x: f32, y: f32, lens: [f32; 2]) -> CameraRay {
        let px = self.plane_origin[0] + x * self.plane_step[0];
        let py = self.plane_origin[1] + y * self.plane_step[1];
        let (mut origin, mut direction) = match self.projection {
            Projection::Perspective { .. } => (Vec3::ZERO, Vec3::new(px, py, 1.0)),
            Projection::Orthographic => (Vec3::new(px, py, 0.0), Vec3::Z),
            _ => return self.spherical_ray([x * self.inverse_size[0], y * self.inverse_size[1]]),
        };
        if self.lens_radius > 0.0 {
            let focus = origin + direction * self.focal_distance;
            let disk = concentric_disk(lens) * self.lens_radius;
            origin += Vec3::new(disk.x, disk.y, 0.0);
            direction = focus - origin;
        }
        let cos_axis = direction.z / direction.length();
        CameraRay {
            origin: self.camera_to_world.transform_point3(origin),
            direction: self.camera_to_world.transform_vector3(direction).normalize(),
            cos_axis,
        }
    }

    /// The ray of a camera that sees all around; depth is distance then.
    #[cold]
    fn spherical_ray(&self, uv: [f32; 2]) -> CameraRay {
        let d = if self.projection == Projection::EqualArea {
            square_to_equal_area(wrap_square(uv))
        } else {
            let (sin_theta, cos_theta) = (PI * uv[1]).sin_cos();
            let (sin_phi, cos_phi) = (2.0 * PI * uv[0]).sin_cos();
            Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
        };
        // The pole is up, which is y.
        let direction = self.camera_to_world.transform_vector3(Vec3::new(d.x, d.z, d.y)).normalize();
        CameraRay { origin: self.camera_to_world.transform_point3(Vec3::ZERO), direction, cos_axis: 1.0 }
    }
}

/// Where the octahedral map goes on over an edge of the square: at the mirrored place of the same edge.
fn wrap_square([mut u, mut v]: [f32; 2]) -> [f32; 2] {
    for turn in [false, true] {
        let (a, b) = if turn { (&mut v, &mut u) } else { (&mut u, &mut v) };
        if *a < 0.0 || *a > 1.0 {
            *a = if *a < 0.0 { -*a } else { 2.0 - *a };
            *b = 1.0 - *b;
        }
    }
    [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::sobol::owen_sobol_2d;

    fn pinhole(fov: f32) -> d::Camera {
        d::Camera { projection: Projection::Perspective { fov }, ..d::Camera::default() }
    }

    #[test]
    fn field_of_view_is_of_the_shorter_axis() {
        let c = Camera::new(&pinhole(90.0), 200, 100);
        let top = c.ray(100.0, 0.0, [0.0; 2]).direction;
        assert!(top.abs_diff_eq(Vec3::new(0.0, 1.0, 1.0).normalize(), 1e-6), "{top}");
        let left = c.ray(0.0, 50.0, [0.0; 2]).direction;
        assert!(left.abs_diff_eq(Vec3::new(-2.0, 0.0, 1.0).normalize(), 1e-6));
        let c = Camera::new(&pinhole(90.0), 100, 200);
        let right = c.ray(100.0, 100.0, [0.0; 2]).direction;
        assert!(right.abs_diff_eq(Vec3::new(1.0, 0.0, 1.0).normalize(), 1e-6));
    }

    /// A point at distance z projects, through a lens of radius r focused at f, onto the plane in focus as a
    /// disk of radius r |z - f| / z: the circle of confusion.
    #[test]
    fn circle_of_confusion() {
        let (r, f, z) = (0.1f32, 4.0f32, 2.5f32);
        let camera = d::Camera { lens_radius: r, focal_distance: f, ..pinhole(60.0) };
        let c = Camera::new(&camera, 64, 64);
        let n = 1 << 14;
        let (mut radii, mut largest) = (0.0f64, 0.0f32);
        for i in 0..n {
            let u = owen_sobol_2d(i, 1).map(|b| (b >> 8) as f32 / 16_777_216.0);
            let ray = c.ray(20.0, 40.0, u);
            let centre = c.ray(20.0, 40.0, [0.5, 0.5]);
            // Where the ray crosses depth z, relative to the ray through the centre of the lens.
            let at = |ray: &CameraRay, z: f32| ray.origin + ray.direction * (z / ray.direction.z);
            let blur = (at(&ray, z) - at(&centre, z)).length();
            radii += f64::from(blur * blur) / f64::from(n);
            largest = largest.max(blur);
            assert!((at(&ray, f) - at(&centre, f)).length() < 1e-5, "the plane in focus is sharp");
        }
        let expected = r * (f - z) / f;
        assert!((largest - expected).abs() < 1e-3 * expected, "{largest} {expected}");
        // Uniform on the disk: mean square radius is half the squared radius.
        assert!((radii - f64::from(expected * expected) / 2.0).abs() < 1e-3 * f64::from(expected * expected));
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let camera = d::Camera { projection: Projection::Orthographic, ..d::Camera::default() };
        let c = Camera::new(&camera, 100, 100);
        let ray = c.ray(75.0, 25.0, [0.0; 2]);
        assert_eq!(ray.direction, Vec3::Z);
        assert!(ray.origin.abs_diff_eq(Vec3::new(0.5, 0.5, 0.0), 1e-6));
    }

    #[test]
    fn latitude_and_longitude_are_even_steps() {
        let camera = d::Camera { projection: Projection::Equirectangular, ..d::Camera::default() };
        let c = Camera::new(&camera, 8, 4);
        let at = |x: f32, y: f32| c.ray(x, y, [0.0; 2]).direction;
        // The left edge looks along x, a quarter of the width further is z; the top is up.
        for (x, y, expected) in [
            (0.0, 2.0, Vec3::X),
            (2.0, 2.0, Vec3::Z),
            (4.0, 2.0, Vec3::NEG_X),
            (6.0, 2.0, Vec3::NEG_Z),
            (3.0, 0.0, Vec3::Y),
            (5.0, 4.0, Vec3::NEG_Y),
            (1.0, 1.0, Vec3::new(0.5, 0.5f32.sqrt(), 0.5)),
        ] {
            assert!(at(x, y).abs_diff_eq(expected, 1e-6), "{x} {y}: {}", at(x, y));
        }
    }

    #[test]
    fn equal_areas_of_the_picture_are_equal_solid_angles() {
        let camera = d::Camera { projection: Projection::EqualArea, ..d::Camera::default() };
        let c = Camera::new(&camera, 64, 64);
        let at = |x: f32, y: f32| c.ray(x, y, [0.0; 2]).direction;
        assert!(at(32.0, 32.0).abs_diff_eq(Vec3::Y, 1e-6), "the middle is up");
        assert!(at(0.0, 0.0).abs_diff_eq(Vec3::NEG_Y, 1e-3), "corners are down");
        assert!(at(64.0, 32.0).abs_diff_eq(Vec3::X, 1e-3));
        assert!(at(32.0, 64.0).abs_diff_eq(Vec3::Z, 1e-3));
        // The cap within 60 degrees of up is a quarter of the sphere.
        let pixels = || (0..64 * 64).map(|i| ((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5));
        let cap = pixels().filter(|p| at(p.0, p.1).y > 0.5).count();
        assert!((cap as f32 / 4096.0 - 0.25).abs() < 0.01, "{cap}");
        // Over the edges it goes on without a seam.
        for i in 1..64 {
            let t = i as f32;
            for (a, b) in [([-0.01, t], [0.01, t]), ([t, 64.01], [t, 63.99])] {
                assert!(at(a[0], a[1]).angle_between(at(b[0], b[1])) < 2e-2, "{a:?}");
            }
        }
    }

    #[test]
    fn transforms_apply() {
        let mut camera = pinhole(60.0);
        camera.camera_to_world =
            Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)) * Mat4::from_scale(Vec3::splat(5.0));
        let ray = Camera::new(&camera, 10, 10).ray(5.0, 5.0, [0.0; 2]);
        assert!(ray.origin.abs_diff_eq(Vec3::new(1.0, 2.0, 3.0), 1e-6));
        assert!((ray.direction.length() - 1.0).abs() < 1e-6);
    }
}
