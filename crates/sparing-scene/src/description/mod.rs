//! What a scene is, as plain data: the contract between the loaders and the renderer.
//!
//! Lengths are in scene units, angles in degrees, radiance in W/(m² sr) per linear Rec.709 channel. The world
//! is right-handed or left-handed as the file says; only [`Camera::camera_to_world`] needs to know.

mod bounds;
mod camera;
mod fingerprint;
mod light;
mod material;
mod motion;
mod procedural;
mod shape;
mod texture;
mod validate;

pub use camera::{
    Camera, FilmSettings, IntegratorSettings, PixelFilter, Projection, SamplerKind, SamplerSettings,
};
pub use light::{EnvironmentImage, Light, SphereMapping, SpotEdge};
pub use material::{Conductor, Material, MaterialKind, MetallicRoughness, Roughness};
pub use motion::Motion;
pub use procedural::{Noise, Projection as TextureProjection, ScalarFunction};
pub use shape::{Emission, Geometry, Instance, ObjectDefinition, QuadMesh, Shape, TriangleMesh};
pub use texture::{ColorInput, FloatInput, Image, ImageSource, Texture, TextureEncoding, UvMapping, Wrap};

/// Index of a [`Material`] in [`SceneDescription::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Index of a [`Texture`] in [`SceneDescription::textures`]. A texture refers only to textures before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

/// Index of an [`Image`] in [`SceneDescription::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImageId(pub u32);

/// A whole scene. Ids are indices into its own vectors; loaders guarantee that they are in range.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// Name for people: the file it came from.
    pub name: String,
    /// View and projection.
    pub camera: Camera,
    /// Picture size and crop.
    pub film: FilmSettings,
    /// Pixel reconstruction filter.
    pub filter: PixelFilter,
    /// Sampler kind, samples per pixel, seed.
    pub sampler: SamplerSettings,
    /// Path depth.
    pub integrator: IntegratorSettings,
    /// Image files or bytes that textures and lights refer to.
    pub images: Vec<Image>,
    /// Textures, in an order in which each refers only to earlier ones.
    pub textures: Vec<Texture>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Shapes in world space.
    pub shapes: Vec<Shape>,
    /// Named groups of shapes that instances place.
    pub objects: Vec<ObjectDefinition>,
    /// Placements of objects.
    pub instances: Vec<Instance>,
    /// Lights that are not shapes.
    pub lights: Vec<Light>,
    /// What the loader ignored or changed, one sentence each, with the place where there is one.
    pub warnings: Vec<String>,
}
