//! Measures of a whole scene.

use super::{Geometry, SceneDescription};
use glam::Vec3;

impl SceneDescription {
    /// The box around all shapes and instances: lowest and highest corner. `None` if there are none. What moves counts at
    /// both ends of its way.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds = None;
        self.shapes.iter().for_each(|shape| extend(&mut bounds, &shape.geometry, |p| p));
        for instance in &self.instances {
            let Some(object) = self.objects.get(instance.object as usize) else { continue };
            for matrix in [Some(instance.object_to_world), instance.end].into_iter().flatten() {
                for shape in &object.shapes {
                    extend(&mut bounds, &shape.geometry, |p| matrix.transform_point3(p));
                }
            }
        }
        bounds
    }

    /// Triangles (a quad counts as two, spheres and disks as none), each object once.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        let objects = self.objects.iter().flat_map(|object| &object.shapes);
        self.shapes.iter().chain(objects).map(|shape| shape.geometry.triangle_count()).sum()
    }
}

impl Geometry {
    /// Triangles; a quad counts as two, spheres and disks as none.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        match self {
            Self::Triangles(mesh) => mesh.indices.len() as u64,
            Self::Quads(mesh) => 2 * mesh.indices.len() as u64,
            Self::Sphere { .. } | Self::Disk { .. } => 0,
        }
    }
}

fn extend(bounds: &mut Option<(Vec3, Vec3)>, geometry: &Geometry, to_world: impl Fn(Vec3) -> Vec3) {
    let mut add = |p: Vec3| {
        let p = to_world(p);
        let (low, high) = bounds.unwrap_or((p, p));
        *bounds = Some((low.min(p), high.max(p)));
    };
    match geometry {
        Geometry::Triangles(mesh) => mesh.positions.iter().for_each(|&p| add(p.into())),
        Geometry::Quads(mesh) => mesh.positions.iter().for_each(|&p| add(p.into())),
        Geometry::Sphere { center, radius, .. } | Geometry::Disk { center, radius, .. } => {
            for corner in 0..8 {
                let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                add(*center + Vec3::new(sign(0), sign(1), sign(2)) * *radius);
            }
        }
    }
}
