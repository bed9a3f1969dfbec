//! Checks of a whole scene.

use super::{
    ColorInput, Conductor, FloatInput, Geometry, ImageId, Light, Material, MaterialKind, SceneDescription,
    Shape, Texture, TextureId, TriangleMesh,
};
use crate::error::{ErrorKind, SceneError};

/// Texture nodes that one lookup may visit.
const MAX_LOOKUPS: u64 = 256;
/// Octaves of noise in one texture.
const MAX_OCTAVES: u32 = 64;
/// Mixes of mixes.
const MAX_MIXES: u32 = 16;

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
        self.check_nesting()?;
        let objects = self.objects.iter().flat_map(|object| &object.shapes);
        for (i, shape) in self.shapes.iter().chain(objects).enumerate() {
            self.check_shape(shape).map_err(|what| invalid(format!("shape {i}: {what}")))?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            if instance.object as usize >= self.objects.len() {
                return Err(invalid(format!("instance {i}: there is no object {}", instance.object)));
            }
            if !(instance.object_to_world.is_finite() && instance.end.is_none_or(|end| end.is_finite())) {
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
        let [open, close] = camera.shutter;
        let shutter = open.is_finite() && close.is_finite() && open <= close;
        let view = camera.camera_to_world.is_finite() && camera.end.is_none_or(|end| end.is_finite());
        if !(view && lens && focus && shutter) {
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
                let numbers =
                    mapping.scale.iter().chain(&mapping.offset).chain(&mapping.cross).chain([scale]);
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
            Texture::Projected { from_world, .. } | Texture::Cubes { from_world, .. }
                if !from_world.is_finite() =>
            {
                Err("its mapping is not finite".to_owned())
            }
            Texture::Noise { from_world, noise } => {
                let octaves = noise.octaves();
                if octaves > MAX_OCTAVES {
                    return Err(format!("{octaves} octaves of noise, more than {MAX_OCTAVES}"));
                }
                if from_world.is_finite() { Ok(()) } else { Err("its mapping is not finite".to_owned()) }
            }
            other => other.inputs().into_iter().try_for_each(|input| self.color(input, index)),
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
            MaterialKind::OrenNayar { reflectance, sigma } => {
                self.color(*reflectance, all).and_then(|()| self.float(*sigma, all))
            }
            MaterialKind::Mirror { reflectance } => self.color(*reflectance, all),
            MaterialKind::Uber { diffuse, specular, mirror, transmission, roughness, eta } => {
                index_of_refraction(*eta)?;
                rough(roughness)?;
                [diffuse, specular, mirror, transmission].into_iter().try_for_each(|c| self.color(*c, all))
            }
            MaterialKind::Substrate { diffuse, specular, roughness } => {
                rough(roughness)?;
                self.color(*diffuse, all).and_then(|()| self.color(*specular, all))
            }
            MaterialKind::CoatedConductor { conductor, roughness, eta, coat_roughness } => {
                index_of_refraction(*eta)?;
                rough(roughness)?;
                rough(coat_roughness)?;
                match conductor {
                    Conductor::EtaK { eta, k } => self.color(*eta, all).and_then(|()| self.color(*k, all)),
                    Conductor::Reflectance(color) => self.color(*color, all),
                }
            }
            MaterialKind::MetallicRoughness(m) => {
                if !(m.eta.is_finite() && m.eta >= 0.0) {
                    return Err(format!("index of refraction {}", m.eta));
                }
                [m.base_color, m.specular_color].into_iter().try_for_each(|color| self.color(color, all))?;
                let numbers = [m.metallic, m.roughness, m.specular, m.transmission, m.clearcoat];
                numbers.into_iter().chain([m.clearcoat_roughness]).try_for_each(|n| self.float(n, all))
            }
        }
    }

    /// Textures and mixes may be nested, but a lookup must stay cheap: one texture stands for at most
    /// [`MAX_LOOKUPS`] nodes with all it refers to, a mix for at most [`MAX_MIXES`] others below each other.
    fn check_nesting(&self) -> Result<(), SceneError> {
        let mut lookups: Vec<u64> = Vec::with_capacity(self.textures.len());
        for (i, texture) in self.textures.iter().enumerate() {
            let of = |id: TextureId| lookups.get(id.0 as usize).copied().unwrap_or(0);
            let color = |input: ColorInput| if let ColorInput::Texture(id) = input { of(id) } else { 0 };
            let nodes = 1 + texture.inputs().into_iter().map(color).sum::<u64>();
            if nodes > MAX_LOOKUPS {
                return Err(invalid(format!("texture {i}: it is made of more than {MAX_LOOKUPS} textures")));
            }
            lookups.push(nodes);
        }
        let mut depths: Vec<u32> = Vec::with_capacity(self.materials.len());
        for (i, material) in self.materials.iter().enumerate() {
            let mut depth = 0;
            if let MaterialKind::Mix { materials, .. } = &material.kind {
                for id in materials {
                    let Some(below) = depths.get(id.0 as usize) else {
                        let message =
                            format!("material {i}: it mixes material {}, which is not before it", id.0);
                        return Err(invalid(message));
                    };
                    depth = depth.max(below + 1);
                }
            }
            if depth > MAX_MIXES {
                return Err(invalid(format!("material {i}: mixes are nested deeper than {MAX_MIXES}")));
            }
            depths.push(depth);
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
        if shape.alpha_cutoff.is_some_and(|cutoff| !cutoff.is_finite()) {
            return Err("its cut-off is not finite".to_owned());
        }
        match &shape.geometry {
            Geometry::Triangles(mesh) => {
                let indices = mesh.indices.as_flattened();
                check_colors(mesh.colors.as_deref(), mesh.positions.len())?;
                check_rare(mesh)?;
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
            Light::Spot { position, direction, intensity, cone_angle, cone_delta, .. } => {
                position.is_finite()
                    && direction.is_finite()
                    && intensity.is_finite()
                    && *cone_angle > 0.0
                    && (0.0..=*cone_angle).contains(cone_delta)
            }
            Light::Distant { direction, irradiance } => direction.is_finite() && irradiance.is_finite(),
            Light::Environment { radiance, image, light_to_world } => {
                image.map_or(Ok(()), |map| self.image(map.image))?;
                radiance.is_finite() && light_to_world.is_finite()
            }
            Light::Goniometric { position, intensity, image, light_to_world, .. } => {
                image.map_or(Ok(()), |id| self.image(id))?;
                position.is_finite() && intensity.is_finite() && light_to_world.is_finite()
            }
            Light::Projection { position, intensity, image, fov, light_to_world, .. } => {
                image.map_or(Ok(()), |id| self.image(id))?;
                let numbers = position.is_finite() && intensity.is_finite() && light_to_world.is_finite();
                numbers && *fov > 0.0 && *fov < 180.0
            }
        };
        if finite { Ok(()) } else { Err("its numbers are out of range".to_owned()) }
    }
}

fn invalid(message: String) -> SceneError {
    SceneError::new(ErrorKind::Invalid, message)
}

fn texture_below(id: TextureId, below: usize) -> Result<(), String> {
    if (id.0 as usize) < below { Ok(()) } else { Err(format!("texture {} is not before it", id.0)) }
}

fn check_colors(colors: Option<&[[f32; 4]]>, count: usize) -> Result<(), String> {
    let Some(colors) = colors else { return Ok(()) };
    if colors.len() != count {
        return Err("vertex colours do not match the vertices".to_owned());
    }
    let fine = |v: &f32| v.is_finite() && *v >= 0.0;
    if colors.as_flattened().iter().all(fine) {
        Ok(())
    } else {
        Err("a vertex colour is out of range".to_owned())
    }
}

/// Second texture coordinates and tangents.
fn check_rare(mesh: &TriangleMesh) -> Result<(), String> {
    let count = mesh.positions.len();
    let fits = |found: Option<usize>, flat: &[f32]| {
        found.is_none_or(|found| found == count) && flat.iter().all(|v| v.is_finite())
    };
    let uvs = mesh.second_uvs.as_deref();
    let tangents = mesh.tangents.as_deref();
    if fits(uvs.map(<[_]>::len), uvs.unwrap_or_default().as_flattened())
        && fits(tangents.map(<[_]>::len), tangents.unwrap_or_default().as_flattened())
    {
        Ok(())
    } else {
        Err("second texture coordinates or tangents do not match the vertices".to_owned())
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load_pbrt_text;
    use glam::Vec3;
    use std::path::Path;

    fn refused(text: &str) -> String {
        let text = format!("WorldBegin Shape \"sphere\"\n{text}");
        load_pbrt_text(text.as_bytes(), Path::new("."), &crate::LoadOptions::default())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn textures_that_double_and_mixes_that_nest_are_refused() {
        let mut textures = "Texture \"t0\" \"float\" \"checkerboard\"\n".to_owned();
        let mut mixes = "MakeNamedMaterial \"m0\" \"string type\" \"interface\"\n".to_owned();
        for i in 0..40 {
            let next = i + 1;
            textures += &format!(
                "Texture \"t{next}\" \"float\" \"scale\" \"texture tex\" \"t{i}\" \"texture scale\" \"t{i}\"\n"
            );
            mixes += &format!(
                "MakeNamedMaterial \"m{next}\" \"string type\" \"mix\" \"string materials\" [ \"m{i}\" \"m{i}\" ]\n"
            );
        }
        assert_eq!(refused(&textures), "texture 8: it is made of more than 256 textures");
        assert_eq!(refused(&mixes), "material 18: mixes are nested deeper than 16");
    }

    #[test]
    fn ids_and_numbers_are_checked() {
        let scene = || {
            let text = b"WorldBegin Shape \"sphere\" LightSource \"point\"";
            load_pbrt_text(text, Path::new("."), &crate::LoadOptions::default()).unwrap()
        };
        assert!(scene().validate().is_ok());
        let mut broken = scene();
        broken.shapes[0].material.0 = 7;
        assert_eq!(broken.validate().unwrap_err().to_string(), "shape 0: there is no material 7");
        let mut broken = scene();
        broken.lights[0] = Light::Point { position: Vec3::NAN, intensity: Vec3::ONE };
        assert!(broken.validate().is_err());
        let mut broken = scene();
        broken.film.crop = Some([0, 0, 5000, 10]);
        assert!(broken.validate().is_err());
        let mut broken = scene();
        broken.textures.push(Texture::Scale {
            a: ColorInput::Texture(TextureId(0)),
            b: ColorInput::Constant(Vec3::ONE),
        });
        assert_eq!(broken.validate().unwrap_err().to_string(), "texture 0: texture 0 is not before it");
    }
}
