//! A camera and light for models that come without.
//!
//! The camera has a field of view of 40 degrees and fits the bounding sphere with a margin. A model without
//! emitters is seen from the front right, 20 degrees from above, on a grey ground, under a constant sky and a
//! distant key light from the upper left. A model with emitters is taken for a room, open towards +z as the
//! common Cornell boxes are: it is seen straight from there, by its own light only. y is up.

use super::Framing;
use crate::description::{
    ColorInput, Geometry, Light, Material, MaterialId, MaterialKind, Projection, QuadMesh, SceneDescription,
    Shape,
};
use glam::{Mat3, Mat4, Vec3};

const FOV: f32 = 40.0;

/// Adds camera, ground and lights to a scene that has shapes.
pub(super) fn frame(scene: &mut SceneDescription, framing: Framing) {
    let Some((low, high)) = scene.bounds() else { return };
    let center = (low + high) * 0.5;
    let radius = (low.distance(high) * 0.5).max(f32::MIN_POSITIVE);
    if framing.camera {
        let (azimuth, elevation) = if framing.room { (0.0f32, 0.0f32) } else { (35f32, 20f32) };
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        let towards =
            Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
        let distance = 1.05 * radius / (FOV / 2.0).to_radians().sin();
        let camera = &mut scene.camera;
        camera.projection = Projection::Perspective { fov: FOV };
        camera.camera_to_world = camera_at(center + towards * distance, -towards);
        camera.focal_distance = distance;
    }
    if !framing.light {
        return;
    }
    if framing.camera {
        add_ground(scene, center.with_y(low.y - 1e-3 * radius), 10.0 * radius);
    }
    scene.lights.push(Light::Environment {
        radiance: Vec3::splat(0.5),
        image: None,
        light_to_world: Mat3::IDENTITY,
    });
    scene.lights.push(Light::Distant {
        direction: Vec3::new(0.5, -1.0, -0.4).normalize(),
        irradiance: Vec3::splat(2.0),
    });
}

/// Camera to world in a right-handed world with y up: camera space is x right, y up, z forward.
fn camera_at(eye: Vec3, forward: Vec3) -> Mat4 {
    let right = forward.cross(Vec3::Y).normalize();
    let up = right.cross(forward);
    Mat4::from_cols(right.extend(0.0), up.extend(0.0), forward.extend(0.0), eye.extend(1.0))
}

fn add_ground(scene: &mut SceneDescription, center: Vec3, half: f32) {
    scene.materials.push(Material {
        name: "ground".to_owned(),
        kind: MaterialKind::Diffuse { reflectance: ColorInput::Constant(Vec3::splat(0.4)) },
        normal_map: None,
        bump: None,
    });
    let corner = |x: f32, z: f32| (center + Vec3::new(x, 0.0, z) * half).to_array();
    scene.shapes.push(Shape {
        geometry: Geometry::Quads(QuadMesh {
            positions: vec![corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)],
            indices: vec![[0, 1, 2, 3]],
            normals: None,
            uvs: None,
        }),
        material: MaterialId((scene.materials.len() - 1) as u32),
        emission: None,
        alpha: None,
        alpha_cutoff: None,
        reverse_orientation: false,
    });
}
