//! What models that come without a scene (OBJ, PLY) get: a material, a camera, light.

mod framing;

use crate::description::{
    ColorInput, FloatInput, Geometry, Material, MaterialId, MaterialKind, MetallicRoughness,
    SceneDescription, Shape, TriangleMesh,
};
use crate::error::{ErrorKind, SceneError};
use crate::warnings::Warnings;
use glam::Vec3;
use std::path::Path;

/// The material of faces that name none.
pub(crate) fn add_default_material(scene: &mut SceneDescription) -> MaterialId {
    scene.materials.push(Material {
        name: "default".to_owned(),
        kind: MaterialKind::Diffuse { reflectance: ColorInput::Constant(Vec3::splat(0.5)) },
        normal_map: None,
        bump: None,
    });
    MaterialId((scene.materials.len() - 1) as u32)
}

/// A matte material that has the colours of vertices.
pub(crate) fn add_colored_material(scene: &mut SceneDescription) -> MaterialId {
    let kind = MaterialKind::MetallicRoughness(MetallicRoughness {
        specular: FloatInput::Constant(0.0),
        vertex_colors: true,
        ..MetallicRoughness::default()
    });
    scene.materials.push(Material { name: "vertex colours".to_owned(), kind, normal_map: None, bump: None });
    MaterialId((scene.materials.len() - 1) as u32)
}

/// Adds an opaque, dark shape.
pub(crate) fn add_shape(scene: &mut SceneDescription, mesh: TriangleMesh, material: MaterialId) {
    scene.shapes.push(Shape {
        geometry: Geometry::Triangles(mesh),
        material,
        emission: None,
        alpha: None,
        alpha_cutoff: None,
        reverse_orientation: false,
    });
}

/// Drops triangles without area; `None` if none is left.
pub(crate) fn without_slivers(
    mut mesh: TriangleMesh,
    warnings: &mut Warnings,
    path: &Path,
) -> Option<TriangleMesh> {
    let before = mesh.indices.len();
    let positions = &mesh.positions;
    mesh.indices.retain(|t| {
        let [a, b, c] = t.map(|i| Vec3::from(positions[i as usize]).as_dvec3());
        (b - a).cross(c - a).length_squared() > 0.0
    });
    let dropped = before - mesh.indices.len();
    if dropped > 0 {
        let place = path.display();
        warnings
            .add(format!("{place}: {dropped} of {before} triangles of a group have no area and are dropped"));
    }
    (!mesh.indices.is_empty()).then_some(mesh)
}

/// What a model gets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Framing {
    /// A camera.
    pub camera: bool,
    /// Sky and sun; with a camera also a ground.
    pub light: bool,
    /// Whether it is a room, seen from its open side.
    pub room: bool,
}

/// Gives a model camera and light; one that emits is taken for a room. One without triangles is an error.
pub(crate) fn finish(
    scene: SceneDescription,
    warnings: Warnings,
    path: &Path,
) -> Result<SceneDescription, SceneError> {
    let lit = scene.shapes.iter().any(|shape| shape.emission.is_some());
    finish_with(scene, warnings, path, Framing { camera: true, light: !lit, room: lit })
}

/// [`finish`] with a choice.
pub(crate) fn finish_with(
    mut scene: SceneDescription,
    warnings: Warnings,
    path: &Path,
    framing: Framing,
) -> Result<SceneDescription, SceneError> {
    if scene.shapes.is_empty() && scene.instances.is_empty() {
        let error = SceneError::new(ErrorKind::Invalid, "nothing to render: no triangles with an area");
        return Err(error.in_file(path));
    }
    framing::frame(&mut scene, framing);
    scene.warnings = warnings.into_vec();
    Ok(scene)
}
