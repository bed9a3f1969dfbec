//! Primitives become triangle meshes.

use super::json::Node;
use super::materials::BuiltMaterial;
use super::{Loader, MAX_UV_SETS};
use crate::description::{Geometry, Shape, TriangleMesh};
use crate::error::{ErrorKind, SceneError};
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Triangles with what they are made of.
#[derive(Clone)]
pub(super) struct Primitive {
    pub mesh: TriangleMesh,
    pub material: BuiltMaterial,
}

impl Primitive {
    /// The shape of a primitive that is used once, moved to its place.
    pub fn place(mut self, to_world: &DAffine3) -> Shape {
        transform(&mut self.mesh, to_world);
        self.into_shape()
    }

    pub fn into_shape(self) -> Shape {
        let BuiltMaterial { id, emission, alpha, alpha_cutoff, .. } = self.material;
        let geometry = Geometry::Triangles(self.mesh);
        Shape { geometry, material: id, emission, alpha, alpha_cutoff, reverse_orientation: false }
    }
}

/// Moves a mesh. Where space is mirrored the triangles are turned over, as glTF asks for (section 3.7.4).
fn transform(mesh: &mut TriangleMesh, m: &DAffine3) {
    for p in &mut mesh.positions {
        *p = m.transform_point3(Vec3::from(*p).as_dvec3()).as_vec3().to_array();
    }
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = m.matrix3;
    let mirrors = m.matrix3.determinant() < 0.0;
    let sign = if mirrors { -1.0 } else { 1.0 };
    let normals = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
    for n in mesh.normals.iter_mut().flatten() {
        *n = (normals * Vec3::from(*n).as_dvec3()).normalize_or_zero().as_vec3().to_array();
    }
    for t in mesh.tangents.iter_mut().flatten() {
        *t = m.transform_vector3(Vec3::from(*t).as_dvec3()).normalize_or_zero().as_vec3().to_array();
    }
    if mirrors {
        mesh.indices.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

impl<'a> Loader<'a> {
    /// All primitives of a mesh that have triangles.
    pub(super) fn mesh(&mut self, node: &Node<'a>) -> Result<Vec<Primitive>, SceneError> {
        let mut all = Vec::new();
        for primitive in node.list("primitives")? {
            all.extend(self.primitive(&primitive)?);
        }
        Ok(all)
    }

    fn primitive(&mut self, node: &Node<'a>) -> Result<Option<Primitive>, SceneError> {
        let mode = node.whole("mode")?.unwrap_or(4);
        if mode < 4 {
            self.warnings.add(format!("{}: points and lines are not rendered", node.path));
            return Ok(None);
        }
        if mode > 6 {
            return Err(node.error(format!("there is no mode {mode}")));
        }
        if node.get("targets").is_some() {
            self.warnings.add("morph targets are not supported: meshes are as they stand".to_owned());
        }
        let attributes = node.require("attributes")?;
        let Some(positions) = self.attribute::<3>(&attributes, "POSITION", None)? else {
            self.warnings.add(format!("{}: without POSITION there is nothing to render", node.path));
            return Ok(None);
        };
        let count = positions.len();
        self.count_vertices(count)?;
        let indices = match node.named("indices", &self.root, "accessors")? {
            Some((_, accessor)) => self.reader.open(accessor, &mut self.buffers)?.indices()?,
            None => (0..u32::try_from(count).map_err(|_| node.error("too many vertices"))?).collect(),
        };
        // An index of all ones restarts nothing in glTF; it is out of range like any other.
        if let Some(index) = indices.iter().find(|&&i| i as usize >= count) {
            return Err(node.require("indices")?.error(format!("index {index} of {count} vertices")));
        }
        let indices = triangles(mode, &indices);
        self.count_triangles(indices.len())?;
        let has_colors = attributes.get("COLOR_0").is_some();
        let material = self.material(node, has_colors)?;
        let normals = self.attribute::<3>(&attributes, "NORMAL", Some(count))?;
        let mut coordinates = |set: usize| {
            let name = format!("TEXCOORD_{}", if set < MAX_UV_SETS { set } else { MAX_UV_SETS });
            let mut uvs = self.attribute::<2>(&attributes, &name, Some(count))?;
            // In glTF v = 0 is the top of a picture.
            uvs.iter_mut().flatten().for_each(|uv| uv[1] = 1.0 - uv[1]);
            Ok::<_, SceneError>(uvs)
        };
        let uvs = coordinates(material.uv_set)?;
        let second_uvs = material.second_uv_set.map_or(Ok(None), &mut coordinates)?;
        // The side of the second tangent follows from the texture coordinates, as its sign (w) does.
        let mut tangents = None;
        if self.scene.materials[material.id.0 as usize].normal_map.is_some() {
            tangents = self.attribute::<3>(&attributes, "TANGENT", Some(count))?;
        }
        let mut colors = None;
        if material.uses_colors {
            colors = self.attribute::<4>(&attributes, "COLOR_0", Some(count))?;
            colors.iter_mut().flatten().for_each(|c| *c = c.map(|v| v.max(0.0)));
            colors.iter_mut().flatten().for_each(|c| c[3] = c[3].min(1.0));
        }
        let mesh = compact(TriangleMesh { positions, indices, normals, uvs, colors, second_uvs, tangents });
        let mesh = self.without_slivers(mesh, node);
        Ok((!mesh.indices.is_empty()).then_some(Primitive { mesh, material }))
    }

    /// An attribute of all vertices; components that it lacks are 1.
    fn attribute<const N: usize>(
        &mut self,
        attributes: &Node<'a>,
        name: &str,
        count: Option<usize>,
    ) -> Result<Option<Vec<[f32; N]>>, SceneError> {
        let Some((_, accessor)) = attributes.named(name, &self.root, "accessors")? else { return Ok(None) };
        let accessor = self.reader.open(accessor, &mut self.buffers)?;
        let least = if name == "COLOR_0" { 3 } else { N };
        if accessor.components() < least {
            return Err(accessor.error(format!("{name} needs vectors of {least} numbers")));
        }
        if let Some(count) = count.filter(|count| *count != accessor.count()) {
            let message = format!("{name} is for {} vertices instead of {count}", accessor.count());
            return Err(accessor.error(message));
        }
        accessor.vectors(1.0).map(Some)
    }

    fn count_vertices(&mut self, count: usize) -> Result<(), SceneError> {
        self.vertices += count as u64;
        let most = self.options.max_vertices;
        if self.vertices > most {
            Err(self.options.exceeded("max_vertices", most, self.vertices))
        } else {
            Ok(())
        }
    }

    fn count_triangles(&mut self, count: usize) -> Result<(), SceneError> {
        self.triangles += count as u64;
        self.options.count_triangles(count as u64);
        let most = self.options.max_triangles;
        if self.triangles > most {
            Err(self.options.exceeded("max_triangles", most, self.triangles))
        } else {
            Ok(())
        }
    }

    /// Counts a mesh that is copied.
    pub(super) fn count_copy(&mut self, mesh: &TriangleMesh) -> Result<(), SceneError> {
        self.count_vertices(mesh.positions.len())?;
        self.count_triangles(mesh.indices.len())
    }

    fn without_slivers(&mut self, mut mesh: TriangleMesh, node: &Node<'a>) -> TriangleMesh {
        let before = mesh.indices.len();
        let corner = |i: u32| Vec3::from(mesh.positions[i as usize]).as_dvec3();
        mesh.indices.retain(|&[a, b, c]| {
            let cross: DVec3 = (corner(b) - corner(a)).cross(corner(c) - corner(a));
            cross.length_squared() > 0.0
        });
        let dropped = before - mesh.indices.len();
        if dropped > 0 {
            let place = &node.path;
            self.warnings
                .add(format!("{place}: {dropped} of {before} triangles have no area and are dropped"));
        }
        mesh
    }

    /// Counts a shape, instance, light, material or texture against the limit.
    pub(super) fn count_entity(&mut self) -> Result<(), SceneError> {
        self.entities += 1;
        let most = self.options.max_entities;
        if self.entities > most {
            return Err(SceneError::new(
                ErrorKind::Limit,
                format!("the limit max_entities = {most} is exceeded by {}", self.entities),
            ));
        }
        Ok(())
    }
}

/// Lists, strips and fans as triangles (section 3.7.2.1).
fn triangles(mode: usize, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        5 => {
            let windows = indices.windows(3).enumerate();
            windows.map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] }).collect()
        }
        6 => indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], indices[0]]).collect(),
        _ => indices.as_chunks::<3>().0.to_vec(),
    }
}

/// Keeps only the vertices that are used, where that is less than half: primitives often share their buffers.
fn compact(mesh: TriangleMesh) -> TriangleMesh {
    let count = mesh.positions.len();
    if mesh.indices.len() >= count / 2 {
        return mesh;
    }
    let mut new = vec![u32::MAX; count];
    let mut old = Vec::new();
    let mut indices = mesh.indices;
    for i in indices.as_flattened_mut() {
        let place = &mut new[*i as usize];
        if *place == u32::MAX {
            *place = old.len() as u32;
            old.push(*i as usize);
        }
        *i = *place;
    }
    fn pick<T: Copy>(all: &[T], old: &[usize]) -> Vec<T> {
        old.iter().map(|&i| all[i]).collect()
    }
    TriangleMesh {
        positions: pick(&mesh.positions, &old),
        normals: mesh.normals.map(|all| pick(&all, &old)),
        uvs: mesh.uvs.map(|all| pick(&all, &old)),
        colors: mesh.colors.map(|all| pick(&all, &old)),
        second_uvs: mesh.second_uvs.map(|all| pick(&all, &old)),
        tangents: mesh.tangents.map(|all| pick(&all, &old)),
        indices,
    }
}
