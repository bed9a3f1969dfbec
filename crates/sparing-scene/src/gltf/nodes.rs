//! The hierarchy: where meshes, cameras and lights are.

use super::Loader;
use super::json::Node;
use super::meshes::Primitive;
use crate::description::{Instance, ObjectDefinition};
use crate::error::SceneError;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use std::collections::HashMap;

/// A mesh with all its places.
type Uses<'a> = Vec<(usize, Node<'a>, Vec<DAffine3>)>;

impl<'a> Loader<'a> {
    /// Adds everything in the file's scene.
    pub(super) fn scene(&mut self) -> Result<(), SceneError> {
        let root = self.root.clone();
        let nodes = root.list("nodes")?;
        let mut visited = vec![false; nodes.len()];
        let mut stack: Vec<(usize, DAffine3)> =
            self.roots()?.into_iter().map(|i| (i, DAffine3::IDENTITY)).collect();
        stack.reverse();
        let mut uses: Uses<'a> = Vec::new();
        let mut known: HashMap<usize, usize> = HashMap::new();
        while let Some((index, parent)) = stack.pop() {
            let node = &nodes[index];
            if std::mem::replace(&mut visited[index], true) {
                return Err(node.error("it is a child of two nodes, or of itself"));
            }
            let to_world = parent * local_transform(node)?;
            if !to_world.is_finite() {
                return Err(node.error("its transformation is not finite"));
            }
            if let Some((mesh, place)) = node.named("mesh", &root, "meshes")? {
                let at = *known.entry(mesh).or_insert_with(|| {
                    uses.push((mesh, place, Vec::new()));
                    uses.len() - 1
                });
                uses[at].2.push(to_world);
            }
            if node.get("skin").is_some() {
                self.warnings.add("skins are not supported: meshes are as they stand".to_owned());
            }
            if let Some((_, camera)) = node.named("camera", &root, "cameras")? {
                self.camera(&camera, &to_world)?;
            }
            if let Some(light) = node.extension("KHR_lights_punctual") {
                self.light(&light, &to_world)?;
            }
            for child in node.list("children")?.iter().rev() {
                stack.push((self.node_index(child, nodes.len())?, to_world));
            }
        }
        for (_, mesh, places) in uses {
            self.place(&mesh, &places)?;
        }
        Ok(())
    }

    fn node_index(&self, node: &Node<'a>, count: usize) -> Result<usize, SceneError> {
        let index = node.as_whole()?;
        if index < count {
            Ok(index)
        } else {
            Err(node.error(format!("it is {index}, but there are {count} nodes")))
        }
    }

    /// The nodes of the scene; without scenes all that are no children.
    fn roots(&mut self) -> Result<Vec<usize>, SceneError> {
        let root = self.root.clone();
        let nodes = root.list("nodes")?;
        let scene = match root.named("scene", &root, "scenes")? {
            Some((_, scene)) => Some(scene),
            None => root.item("scenes", 0),
        };
        if let Some(scene) = scene {
            return scene.list("nodes")?.iter().map(|node| self.node_index(node, nodes.len())).collect();
        }
        let mut is_child = vec![false; nodes.len()];
        for node in &nodes {
            for child in node.list("children")? {
                is_child[self.node_index(&child, nodes.len())?] = true;
            }
        }
        Ok((0..nodes.len()).filter(|i| !is_child[*i]).collect())
    }

    /// One place: shapes of the scene. Several: an object with instances, but what emits is copied, since lights
    /// are not within objects.
    fn place(&mut self, node: &Node<'a>, places: &[DAffine3]) -> Result<(), SceneError> {
        let primitives = self.mesh(node)?;
        if let [place] = places {
            for primitive in primitives {
                self.count_entity()?;
                self.scene.shapes.push(primitive.place(place));
            }
            return Ok(());
        }
        let (lamps, others): (Vec<Primitive>, Vec<Primitive>) =
            primitives.into_iter().partition(|primitive| primitive.material.emission.is_some());
        for lamp in &lamps {
            for place in places {
                self.count_entity()?;
                self.count_copy(&lamp.mesh)?;
                self.scene.shapes.push(lamp.clone().place(place));
            }
        }
        if others.is_empty() {
            return Ok(());
        }
        let object = self.scene.objects.len() as u32;
        let mut shapes = Vec::new();
        for primitive in others {
            self.count_entity()?;
            shapes.push(primitive.into_shape());
        }
        self.scene.objects.push(ObjectDefinition { name: node.name(), shapes });
        for place in places {
            self.count_entity()?;
            let object_to_world = glam::Affine3A::from_mat4(DMat4::from(*place).as_mat4());
            if !object_to_world.is_finite() {
                return Err(node.error("it is placed beyond all bounds"));
            }
            self.scene.instances.push(Instance::still(object, object_to_world));
        }
        Ok(())
    }
}

fn local_transform(node: &Node<'_>) -> Result<DAffine3, SceneError> {
    if let Some(columns) = node.numbers::<16>("matrix")? {
        let m = DMat4::from_cols_array(&columns);
        if m.row(3) != glam::DVec4::W {
            return Err(node.require("matrix")?.error("its last row must be 0 0 0 1"));
        }
        return Ok(DAffine3::from_mat4(m));
    }
    let translation = node.numbers::<3>("translation")?.map_or(DVec3::ZERO, DVec3::from);
    let scale = node.numbers::<3>("scale")?.map_or(DVec3::ONE, DVec3::from);
    let rotation = match node.numbers::<4>("rotation")? {
        None => DQuat::IDENTITY,
        Some(q) => {
            let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !(length > 1e-9 && length.is_finite()) {
                return Err(node.require("rotation")?.error("a rotation is a unit quaternion"));
            }
            DQuat::from_array(q.map(|v| v / length))
        }
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}
