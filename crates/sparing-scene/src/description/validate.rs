//! Checks and measures of a whole scene.

use super::{
    ColorInput, Conductor, FloatInput, Geometry, ImageId, Light, Material, MaterialKind, SceneDescription,
    Shape, Texture, TextureId,
};
use crate::error::{ErrorKind, SceneError};
use glam::Vec3;

impl SceneDescription {
    /// Checks what the renderer relies on: ids in range, textures that refer backwards, numbers that are finite,
    /// sizes that are positive. Loaders guarantee it; scenes made by a program should be checked before use.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`], naming the first thing that is wrong.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.check_settings()?;
        for (i, texture) in self.textures.iter().enumerate() {
            self.check_texture(texture, i).map_err(|what| invalid(format!("texture {i}: {what}")))?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            self.check_material(material).map_err(|what| invalid(format!("material {i}: {what}")))?;
        }
        self.check_mixes()?;
        let objects = self.objects.iter().flat_map(|object| &object.shapes);
        for (i, shape) in self.shapes.iter().chain(objects).enumerate() {
            self.check_shape(shape).map_err(|what| invalid(format!("shape {i}: {what}")))?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            if instance.object as usize >= self.objects.len() {
                return Err(invalid(format!("instance {i}: there is no object {}", instance.object)));
            }
            if !instance.object_to_world.is_finite() {
                return Err(invalid(format!("instance {i}: its transformation is not finite")));
            }
        }
        for (i, light) in self.lights.iter().enumerate() {
            self.check_light(light).map_err(|what| invalid(format!("light {i}: {what}")))?;
        }
        Ok(())
    }

    fn check_settings(&self) -> Result<(), SceneError> {
        let camera = &self.camera;
        let lens = camera.lens_radius.is_finite() && camera.lens_radius >= 0.0;
        let focus = camera.focal_distance.is_finite() && camera.focal_distance > 0.0;
        if !(camera.camera_to_world.is_finite() && lens && focus) {
            return Err(invalid("the camera's numbers are out of range".to_owned()));
        }
        let film = &self.film;
        let inside = |[x0, y0, x1, y1]: [u32; 4]| x0 < x1 && y0 < y1 && x1 <= film.width && y1 <= film.height;
        if film.width == 0 || film.height == 0 || !film.crop.is_none_or(inside) || !film.scale.is_finite() {
            return Err(invalid("the picture's size, crop or scale is out of range".to_owned()));
        }
        Ok(())
    }

    fn color(&self, input: ColorInput, below: usize) -> Result<(), String> {
        match input {
            ColorInput::Constant(value) if value.is_finite() => Ok(()),
            ColorInput::Constant(value) => Err(format!("colour {value} is not finite")),
            ColorInput::Texture(id) => texture_below(id, below),
        }
    }

    fn float(&self, input: FloatInput, below: usize) -> Result<(), String> {
        match input {
            FloatInput::Constant(value) if value.is_finite() => Ok(()),
            FloatInput::Constant(value) => Err(format!("value {value} is not finite")),
            FloatInput::Texture(id) => texture_below(id, below),
        }
    }

    fn image(&self, id: ImageId) -> Result<(), String> {
        let count = self.images.len();
        if (id.0 as usize) < count { Ok(()) } else { Err(format!("image {} of {count}", id.0)) }
    }

    fn check_texture(&self, texture: &Texture, index: usize) -> Result<(), String> {
        match texture {
            Texture::Constant(value) => self.color(ColorInput::Constant(*value), index),
            Texture::Image { image, mapping, scale, .. } => {
                let numbers = mapping.scale.iter().chain(&mapping.offset).chain([scale]);
                if !numbers.copied().all(f32::is_finite) {
                    return Err("its mapping is not finite".to_owned());
                }
                self.image(*image)
            }
            Texture::Checkerboard { even, odd, .. } => {
                self.color(*even, index).and_then(|()| self.color(*odd, index))
            }
            Texture::Scale { a, b } => self.color(*a, index).and_then(|()| self.color(*b, index)),
            Texture::Mix { a, b, amount } => {
                self.color(*a, index)?;
                self.color(*b, index)?;
                self.float(*amount, index)
            }
        }
    }

    fn check_material(&self, material: &Material) -> Result<(), String> {
        let all = self.textures.len();
        for id in [material.normal_map, material.bump].into_iter().flatten() {
            texture_below(id, all)?;
        }
        let index_of_refraction = |eta: f32| {
            if eta.is_finite() && eta > 0.0 { Ok(()) } else { Err(format!("index of refraction {eta}")) }
        };
        let rough = |roughness: &super::Roughness| {
            self.float(roughness.u, all)?;
            self.float(roughness.v, all)
        };
        match &material.kind {
            MaterialKind::Diffuse { reflectance } => self.color(*reflectance, all),
            MaterialKind::Conductor { conductor, roughness } => {
                rough(roughness)?;
                match conductor {
                    Conductor::EtaK { eta, k } => self.color(*eta, all).and_then(|()| self.color(*k, all)),
                    Conductor::Reflectance(color) => self.color(*color, all),
                }
            }
            MaterialKind::Dielectric { eta, roughness, tint } => {
                index_of_refraction(*eta)?;
                rough(roughness)?;
                self.color(*tint, all)
            }
            MaterialKind::ThinDielectric { eta } => index_of_refraction(*eta),
            MaterialKind::CoatedDiffuse { reflectance, roughness, eta } => {
                index_of_refraction(*eta)?;
                rough(roughness)?;
                self.color(*reflectance, all)
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance } => {
                self.color(*reflectance, all).and_then(|()| self.color(*transmittance, all))
            }
            MaterialKind::Mix { materials, amount } => {
                for id in materials {
                    if id.0 as usize >= self.materials.len() {
                        return Err(format!("there is no material {}", id.0));
                    }
                }
                self.float(*amount, all)
            }
            MaterialKind::Interface => Ok(()),
        }
    }

    /// Mixes may be nested but not circular: here each refers only to materials before it.
    fn check_mixes(&self) -> Result<(), SceneError> {
        for (i, material) in self.materials.iter().enumerate() {
            if let MaterialKind::Mix { materials, .. } = &material.kind
                && let Some(id) = materials.iter().find(|id| id.0 as usize >= i)
            {
                return Err(invalid(format!(
                    "material {i}: it mixes material {}, which is not before it",
                    id.0
                )));
            }
        }
        Ok(())
    }

    fn check_shape(&self, shape: &Shape) -> Result<(), String> {
        let all = self.textures.len();
        if shape.material.0 as usize >= self.materials.len() {
            return Err(format!("there is no material {}", shape.material.0));
        }
        if let Some(emission) = &shape.emission {
            self.color(emission.radiance, all)?;
        }
        if let Some(alpha) = shape.alpha {
            self.float(alpha, all)?;
        }
        match &shape.geometry {
            Geometry::Triangles(mesh) => {
                let indices = mesh.indices.as_flattened();
                check_mesh(&mesh.positions, indices, mesh.normals.as_deref(), mesh.uvs.as_deref())
            }
            Geometry::Quads(mesh) => {
                let indices = mesh.indices.as_flattened();
                check_mesh(&mesh.positions, indices, mesh.normals.as_deref(), mesh.uvs.as_deref())
            }
            Geometry::Sphere { center, radius, axes } => {
                let finite =
                    center.is_finite() && radius.is_finite() && axes.iter().all(|axis| axis.is_finite());
                if finite && *radius > 0.0 { Ok(()) } else { Err("its sphere is out of range".to_owned()) }
            }
            Geometry::Disk { center, normal, tangent, radius } => {
                let finite =
                    center.is_finite() && normal.is_finite() && tangent.is_finite() && radius.is_finite();
                if finite && *radius > 0.0 { Ok(()) } else { Err("its disk is out of range".to_owned()) }
            }
        }
    }

    fn check_light(&self, light: &Light) -> Result<(), String> {
        let finite = match light {
            Light::Point { position, intensity } => position.is_finite() && intensity.is_finite(),
            Light::Spot { position, direction, intensity, cone_angle, cone_delta } => {
                position.is_finite()
                    && direction.is_finite()
                    && intensity.is_finite()
                    && *cone_angle > 0.0
                    && (0.0..=*cone_angle).contains(cone_delta)
            }
            Light::Distant { direction, irradiance } => direction.is_finite() && irradiance.is_finite(),
            Light::Environment { radiance, image, light_to_world } => {
                image.map_or(Ok(()), |id| self.image(id))?;
                radiance.is_finite() && light_to_world.is_finite()
            }
        };
        if finite { Ok(()) } else { Err("its numbers are out of range".to_owned()) }
    }

    /// The box around all shapes and instances: lowest and highest corner. `None` if there are none.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds = None;
        self.shapes.iter().for_each(|shape| extend(&mut bounds, &shape.geometry, |p| p));
        for instance in &self.instances {
            let Some(object) = self.objects.get(instance.object as usize) else { continue };
            let matrix = instance.object_to_world;
            for shape in &object.shapes {
                extend(&mut bounds, &shape.geometry, |p| matrix.transform_point3(p));
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

fn invalid(message: String) -> SceneError {
    SceneError::new(ErrorKind::Invalid, message)
}

fn texture_below(id: TextureId, below: usize) -> Result<(), String> {
    if (id.0 as usize) < below { Ok(()) } else { Err(format!("texture {} is not before it", id.0)) }
}

fn check_mesh(
    positions: &[[f32; 3]],
    indices: &[u32],
    normals: Option<&[[f32; 3]]>,
    uvs: Option<&[[f32; 2]]>,
) -> Result<(), String> {
    let count = positions.len();
    if normals.is_some_and(|n| n.len() != count) || uvs.is_some_and(|uv| uv.len() != count) {
        return Err("normals or texture coordinates do not match the vertices".to_owned());
    }
    if let Some(index) = indices.iter().find(|&&i| i as usize >= count) {
        return Err(format!("index {index} of {count} vertices"));
    }
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
    if !finite(positions.as_flattened())
        || !normals.is_none_or(|n| finite(n.as_flattened()))
        || !uvs.is_none_or(|uv| finite(uv.as_flattened()))
    {
        return Err("a vertex is not finite".to_owned());
    }
    Ok(())
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
