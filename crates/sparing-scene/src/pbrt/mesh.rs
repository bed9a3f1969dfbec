//! Meshes on their way into the scene: checked, transformed, cleaned of triangles without area.

use super::Builder;
use crate::description::{Geometry, QuadMesh, Shape, TriangleMesh};
use crate::error::{ErrorKind, SceneError};
use crate::source::Span;
use glam::{DMat4, DVec3, Vec3};

/// Whether a matrix mirrors.
pub(super) fn mirrors(m: &DMat4) -> bool {
    glam::DMat3::from_mat4(*m).determinant() < 0.0
}

/// Twice the area vector of a triangle.
pub(super) fn cross(p: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = p.map(|p| p.as_dvec3());
    (b - a).cross(c - a)
}

impl Builder<'_> {
    /// Applies the current transformation and puts the mesh into the scene.
    pub(super) fn add_mesh(&mut self, mut mesh: TriangleMesh, at: &Span) -> Result<(), SceneError> {
        self.transform_vertices(&mut mesh.positions, mesh.normals.as_mut(), at)?;
        for t in mesh.tangents.iter_mut().flatten() {
            let turned = self.state.ctm.transform_vector3(Vec3::from(*t).as_dvec3());
            *t = turned.normalize_or_zero().as_vec3().to_array();
        }
        let before = mesh.indices.len();
        let corner = |mesh: &TriangleMesh, t: [u32; 3]| t.map(|i| Vec3::from(mesh.positions[i as usize]));
        let keep: Vec<bool> =
            mesh.indices.iter().map(|&t| cross(corner(&mesh, t)).length_squared() > 0.0).collect();
        let mut kept = keep.iter();
        mesh.indices.retain(|_| kept.next().copied().unwrap_or(false));
        let dropped = before - mesh.indices.len();
        if dropped > 0 {
            let message = format!("{dropped} of {before} triangles have no area and are dropped");
            self.warnings.at(at, message);
        }
        if mesh.indices.is_empty() {
            return Ok(());
        }
        // Vertex normals decide which side is outside.
        if let Some(normals) = &mesh.normals {
            let mut indices = std::mem::take(&mut mesh.indices);
            for t in &mut indices {
                let outside: Vec3 = t.iter().map(|&i| Vec3::from(normals[i as usize])).sum();
                if cross(corner(&mesh, *t)).dot(outside.as_dvec3()) < 0.0 {
                    t.swap(1, 2);
                }
            }
            mesh.indices = indices;
        }
        self.count_mesh(mesh.positions.len(), mesh.indices.len())?;
        let area = mesh.indices.iter().map(|&t| cross(corner(&mesh, t)).length() / 2.0).sum();
        let flip = mesh.normals.is_none() && self.winding_flips();
        self.add_shape(Geometry::Triangles(mesh), area, flip, at)
    }

    /// [`Self::add_mesh`] for quads.
    pub(super) fn add_quads(&mut self, mut mesh: QuadMesh, at: &Span) -> Result<(), SceneError> {
        self.transform_vertices(&mut mesh.positions, mesh.normals.as_mut(), at)?;
        let before = mesh.indices.len();
        let positions = &mesh.positions;
        let halves = |q: &[u32; 4]| {
            let [a, b, c, d] = q.map(|i| Vec3::from(positions[i as usize]));
            [cross([a, b, d]), cross([c, d, b])]
        };
        mesh.indices.retain(|q| halves(q).iter().any(|half| half.length_squared() > 0.0));
        let dropped = before - mesh.indices.len();
        if dropped > 0 {
            let message = format!("{dropped} of {before} patches have no area and are dropped");
            self.warnings.at(at, message);
        }
        if mesh.indices.is_empty() {
            return Ok(());
        }
        if let Some(normals) = &mesh.normals {
            for q in &mut mesh.indices {
                let outside: Vec3 = q.iter().map(|&i| Vec3::from(normals[i as usize])).sum();
                let [one, other] = halves(q);
                if (one + other).dot(outside.as_dvec3()) < 0.0 {
                    q.swap(1, 3);
                }
            }
        }
        self.count_mesh(mesh.positions.len(), mesh.indices.len())?;
        let area = mesh.indices.iter().flat_map(halves).map(|half| half.length() / 2.0).sum();
        let flip = mesh.normals.is_none() && self.winding_flips();
        self.add_shape(Geometry::Quads(mesh), area, flip, at)
    }

    /// Whether the winding in world space is opposite to the outside.
    fn winding_flips(&self) -> bool {
        self.state.reverse_orientation != mirrors(&self.state.ctm)
    }

    fn transform_vertices(
        &self,
        positions: &mut [[f32; 3]],
        normals: Option<&mut Vec<[f32; 3]>>,
        at: &Span,
    ) -> Result<(), SceneError> {
        let m = self.state.ctm;
        for (i, p) in positions.iter_mut().enumerate() {
            let moved = m.project_point3(Vec3::from(*p).as_dvec3()).as_vec3();
            if !moved.is_finite() {
                let message = format!("vertex {i} is not finite after the transformation");
                return Err(SceneError::new(ErrorKind::Value, message).at(at));
            }
            *p = moved.to_array();
        }
        if let Some(normals) = normals {
            let Some(inverse) = super::graphics_state::invert(m) else {
                let message = "the current transformation squashes space";
                return Err(SceneError::new(ErrorKind::Value, message).at(at));
            };
            let sign = if self.state.reverse_orientation { -1.0 } else { 1.0 };
            let to_world = inverse.transpose();
            for n in normals {
                let turned = to_world.transform_vector3(Vec3::from(*n).as_dvec3());
                *n = (turned.normalize_or_zero() * sign).as_vec3().to_array();
            }
        }
        Ok(())
    }

    /// Adds a shape of the given surface area in world space, with the current material, light and opacity.
    pub(super) fn add_shape(
        &mut self,
        geometry: Geometry,
        area: f64,
        reverse_orientation: bool,
        at: &Span,
    ) -> Result<(), SceneError> {
        self.count_entity()?;
        let emission = self.emission(area, at);
        let material = match self.mesh_material {
            Some(material) => material,
            None => self.current_material()?,
        };
        let shape = Shape {
            geometry,
            material,
            emission,
            alpha: self.alpha,
            alpha_cutoff: self.alpha_cutoff,
            reverse_orientation,
        };
        match self.object.and_then(|index| self.scene.objects.get_mut(index as usize)) {
            Some(object) => object.shapes.push(shape),
            None => self.scene.shapes.push(shape),
        }
        Ok(())
    }
}
