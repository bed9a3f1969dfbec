//! A scene in the making.

use super::Split;
use super::random::Random;
use crate::description::{
    ColorInput, Emission, Geometry, Image, ImageId, Instance, Light, Material, MaterialId, MaterialKind,
    ObjectDefinition, Projection, SceneDescription, Shape, SpotEdge, Texture, TextureId,
};
use glam::{Affine3A, Mat3, Mat4, Vec3};

/// A description with short ways to add to it, and the random numbers that decide.
pub(super) struct Stage {
    pub scene: SceneDescription,
    pub random: Random,
    pub split: Split,
}

impl Stage {
    pub fn new(split: Split, random: Random) -> Self {
        let mut scene = SceneDescription::default();
        (scene.film.width, scene.film.height) = (96, 96);
        scene.integrator.max_depth = 5;
        Self { scene, random, split }
    }

    /// Picture size and depth of paths.
    pub fn format(&mut self, width: u32, height: u32, max_depth: u32) {
        (self.scene.film.width, self.scene.film.height) = (width, height);
        self.scene.integrator.max_depth = max_depth;
    }

    pub fn material(&mut self, name: &str, kind: MaterialKind) -> MaterialId {
        self.scene.materials.push(Material { name: name.to_owned(), kind, normal_map: None, bump: None });
        MaterialId(self.scene.materials.len() as u32 - 1)
    }

    pub fn texture(&mut self, texture: Texture) -> TextureId {
        self.scene.textures.push(texture);
        TextureId(self.scene.textures.len() as u32 - 1)
    }

    pub fn image(&mut self, image: Image) -> ImageId {
        self.scene.images.push(image);
        ImageId(self.scene.images.len() as u32 - 1)
    }

    pub fn add(&mut self, geometry: impl Into<Geometry>, material: MaterialId) {
        self.scene.shapes.push(shape(geometry, material));
    }

    /// A lamp: it emits on the side of its normal and reflects nothing.
    pub fn lamp(&mut self, geometry: impl Into<Geometry>, radiance: Vec3) {
        let black = self.diffuse(Vec3::ZERO);
        let emission = Emission { radiance: ColorInput::Constant(radiance), two_sided: false };
        self.scene.shapes.push(Shape { emission: Some(emission), ..shape(geometry, black) });
    }

    /// Lambert of this colour; the same colour is the same material.
    pub fn diffuse(&mut self, albedo: Vec3) -> MaterialId {
        let kind = MaterialKind::Diffuse { reflectance: ColorInput::Constant(albedo) };
        match self.scene.materials.iter().position(|m| m.kind == kind) {
            Some(i) => MaterialId(i as u32),
            None => self.material("diffuse", kind),
        }
    }

    /// Shapes that instances place.
    pub fn object(&mut self, shapes: Vec<Shape>) -> u32 {
        let name = format!("object {}", self.scene.objects.len());
        self.scene.objects.push(ObjectDefinition { name, shapes });
        self.scene.objects.len() as u32 - 1
    }

    pub fn instance(&mut self, object: u32, object_to_world: Affine3A) {
        self.scene.instances.push(Instance::still(object, object_to_world));
    }

    pub fn point_light(&mut self, position: Vec3, intensity: Vec3) {
        self.scene.lights.push(Light::Point { position, intensity });
    }

    pub fn spot_light(&mut self, position: Vec3, at: Vec3, cone_angle: f32, intensity: Vec3) {
        let direction = (at - position).normalize_or(Vec3::NEG_Y);
        let cone_delta = cone_angle * 0.25;
        let edge = SpotEdge::Smooth;
        self.scene.lights.push(Light::Spot { position, direction, intensity, cone_angle, cone_delta, edge });
    }

    /// Parallel light from the direction `from`.
    pub fn sun(&mut self, from: Vec3, irradiance: Vec3) {
        let direction = -from.normalize_or(Vec3::Y);
        self.scene.lights.push(Light::Distant { direction, irradiance });
    }

    /// Light from everywhere: constant, or the picture times `radiance`.
    pub fn environment(&mut self, radiance: Vec3, image: Option<Image>) {
        let image = image.map(|image| self.image(image));
        let light_to_world = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
        self.scene.lights.push(Light::Environment { radiance, image: image.map(Into::into), light_to_world });
    }

    /// A pinhole camera; `fov` in degrees of the shorter side.
    pub fn look(&mut self, eye: Vec3, at: Vec3, fov: f32) {
        let forward = (at - eye).normalize_or(Vec3::Z);
        let right = Vec3::Y.cross(forward).normalize_or(Vec3::X);
        let up = forward.cross(right);
        let axes = [right.extend(0.0), up.extend(0.0), forward.extend(0.0), eye.extend(1.0)];
        self.scene.camera.camera_to_world = Mat4::from_cols(axes[0], axes[1], axes[2], axes[3]);
        self.scene.camera.projection = Projection::Perspective { fov };
    }

    /// A lens of this radius, in focus at a distance.
    pub fn lens(&mut self, radius: f32, distance: f32) {
        self.scene.camera.lens_radius = radius;
        self.scene.camera.focal_distance = distance;
    }
}

/// A shape that does not emit.
pub(super) fn shape(geometry: impl Into<Geometry>, material: MaterialId) -> Shape {
    Shape {
        geometry: geometry.into(),
        material,
        emission: None,
        alpha: None,
        alpha_cutoff: None,
        reverse_orientation: false,
    }
}
