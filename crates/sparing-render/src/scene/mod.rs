//! A scene that is ready to render.

mod build;
mod emitters;
mod motion;
pub mod surface;

pub use build::BuildOptions;
pub use motion::Way;

use crate::camera::Camera;
use crate::filter::FilterSampler;
use crate::lights::{Emission, LightContext, LightTable};
use crate::materials::MaterialTable;
use crate::needs::Needs;
use crate::texture::TextureTable;
use embree4::INVALID_ID;
use glam::{Affine3A, Mat3A, Vec3};
use sparing_image::picture::PictureError;
use surface::{FaceLights, ShapeRecord, SurfaceHit};

/// Why a scene could not be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Embree refused.
    #[error("Embree: {0}")]
    Embree(#[from] embree4::Error),
    /// A picture could not be read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The description contradicts itself.
    #[error("{0}")]
    Invalid(String),
}

/// Where an object is.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Object space to world space.
    pub object_to_world: Affine3A,
    /// Its inverse.
    pub world_to_object: Affine3A,
    /// Inverse transpose, up to a positive factor.
    pub normal_to_world: Mat3A,
    /// -1 if the placement mirrors.
    pub handedness: f32,
    /// Largest coordinate of the translation.
    pub magnitude: f32,
}

/// A placed object.
#[derive(Clone, Debug)]
pub struct InstanceRecord {
    /// Where it is; if it moves, when the shutter opens.
    pub place: Placement,
    /// Its way while the shutter is open, if it moves.
    pub way: Option<Way>,
    /// Index of the object's first shape.
    pub first_shape: u32,
    /// Shape id, for counting, of the object's first shape in this placement.
    pub first_id: u32,
    /// Lights of each shape of the object in this placement.
    pub lights: Vec<FaceLights>,
}

/// A scene that is ready to render.
#[derive(Debug)]
pub struct Scene {
    pub(crate) embree: embree4::Scene,
    pub(crate) shapes: Vec<ShapeRecord>,
    pub(crate) instances: Vec<InstanceRecord>,
    top_level_shapes: u32,
    pub(crate) materials: MaterialTable,
    pub(crate) textures: TextureTable,
    pub(crate) emissions: Vec<Emission>,
    pub(crate) lights: LightTable,
    pub(crate) camera: Camera,
    pub(crate) filter: FilterSampler,
    /// Factor on radiance: exposure of the scene's film.
    pub(crate) film_scale: f32,
    pub(crate) features: embree4::FeatureMask,
    needs: Needs,
    /// What was left out or looks wrong, one sentence each.
    pub warnings: Vec<String>,
    /// Sizes, for people.
    pub statistics: SceneStatistics,
}

/// Sizes of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneStatistics {
    /// Triangles, each object once.
    pub triangles: u64,
    /// Quads, each object once.
    pub quads: u64,
    /// Shapes, each object once.
    pub shapes: u64,
    /// Placed objects.
    pub instances: u64,
    /// Lights that can be sampled, triangles counted singly.
    pub lights: u64,
    /// Materials.
    pub materials: u64,
    /// Bytes of vertices, indices, normals and texture coordinates.
    pub geometry_bytes: u64,
    /// Bytes of decoded pictures.
    pub texture_bytes: u64,
    /// Bytes that Embree holds.
    pub embree_bytes: u64,
}

impl Scene {
    /// What rendering this scene takes.
    #[must_use]
    pub fn needs(&self) -> Needs {
        self.needs
    }

    /// The Embree scene, for replays.
    #[must_use]
    pub fn embree(&self) -> &embree4::Scene {
        &self.embree
    }

    /// Lights.
    #[must_use]
    pub fn lights(&self) -> &LightTable {
        &self.lights
    }

    /// What lights look things up in.
    #[inline]
    #[must_use]
    pub fn light_context(&self) -> LightContext<'_> {
        LightContext { emissions: &self.emissions, textures: &self.textures }
    }

    /// Embree's ids as ours; `None` for a miss.
    #[inline]
    #[must_use]
    pub fn hit(&self, geom_id: u32, inst_id: u32, face: u32, u: f32, v: f32) -> Option<SurfaceHit> {
        if geom_id == INVALID_ID {
            return None;
        }
        if inst_id == INVALID_ID {
            return Some(SurfaceHit { shape: geom_id, instance: None, face, u, v });
        }
        let instance = inst_id - self.top_level_shapes;
        let shape = self.instances[instance as usize].first_shape + geom_id;
        Some(SurfaceHit { shape, instance: Some(instance), face, u, v })
    }

    /// Number of the shape of a hit, every placement of an object's shape being a shape of its own; 0 is the
    /// background.
    #[inline]
    #[must_use]
    pub fn shape_id(&self, hit: &SurfaceHit) -> u32 {
        match hit.instance {
            None => hit.shape + 1,
            Some(i) => {
                let record = &self.instances[i as usize];
                record.first_id + (hit.shape - record.first_shape)
            }
        }
    }

    /// Light of a hit face, if it emits.
    #[inline]
    #[must_use]
    pub fn light_of(&self, hit: &SurfaceHit) -> Option<u32> {
        match hit.instance {
            None => self.shapes[hit.shape as usize].lights.get(hit),
            Some(i) => {
                let record = &self.instances[i as usize];
                record.lights[(hit.shape - record.first_shape) as usize].get(hit)
            }
        }
    }

    /// Radiance emitted at a point towards `wo`.
    #[inline]
    #[must_use]
    pub fn emitted(&self, hit: &SurfaceHit, ng: Vec3, uv: [f32; 2], wo: Vec3) -> Vec3 {
        match self.shapes[hit.shape as usize].emission {
            Some(e) => {
                let e = &self.emissions[e as usize];
                if e.two_sided || ng.dot(wo) > 0.0 { e.radiance(&self.textures, uv) } else { Vec3::ZERO }
            }
            None => Vec3::ZERO,
        }
    }
}
