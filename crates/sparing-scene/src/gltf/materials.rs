//! Materials: metallic-roughness with extensions, emission, opacity.

use super::Loader;
use super::json::Node;
use super::textures::FIRST_UVS;
use crate::description::{
    ColorInput, Emission, FloatInput, Material, MaterialId, MaterialKind, MetallicRoughness, Roughness,
    TextureEncoding,
};
use crate::error::SceneError;
use glam::Vec3;

/// A material with what belongs to the shapes that have it.
#[derive(Clone, Debug)]
pub(super) struct BuiltMaterial {
    pub id: MaterialId,
    pub emission: Option<Emission>,
    pub alpha: Option<FloatInput>,
    pub alpha_cutoff: Option<f32>,
    /// The set of texture coordinates that its textures read.
    pub uv_set: usize,
    /// A second one that some of them read.
    pub second_uv_set: Option<usize>,
    /// Whether the colours of vertices matter.
    pub uses_colors: bool,
}

impl<'a> Loader<'a> {
    /// The material of a primitive; with colours of vertices it is one of its own.
    pub(super) fn material(
        &mut self,
        primitive: &Node<'a>,
        colors: bool,
    ) -> Result<BuiltMaterial, SceneError> {
        let named = primitive.named("material", &self.root, "materials")?;
        let key = (named.as_ref().map(|(index, _)| *index), colors);
        if let Some(known) = self.materials.get(&key) {
            return Ok(known.clone());
        }
        let built = match named {
            Some((_, node)) => self.build_material(&node, colors)?,
            None => {
                let base = MetallicRoughness {
                    metallic: FloatInput::Constant(1.0),
                    vertex_colors: colors,
                    ..MetallicRoughness::default()
                };
                let kind = MaterialKind::MetallicRoughness(base);
                let id = self.add_material(Material {
                    name: "default".to_owned(),
                    kind,
                    normal_map: None,
                    bump: None,
                })?;
                BuiltMaterial {
                    id,
                    emission: None,
                    alpha: None,
                    alpha_cutoff: None,
                    uv_set: 0,
                    second_uv_set: None,
                    uses_colors: colors,
                }
            }
        };
        self.materials.insert(key, built.clone());
        Ok(built)
    }

    fn add_material(&mut self, material: Material) -> Result<MaterialId, SceneError> {
        self.count_entity()?;
        self.scene.materials.push(material);
        Ok(MaterialId(self.scene.materials.len() as u32 - 1))
    }

    fn build_material(&mut self, node: &Node<'a>, colors: bool) -> Result<BuiltMaterial, SceneError> {
        let empty = Node::root(&serde_json::Value::Null);
        let pbr = node.get("pbrMetallicRoughness").unwrap_or_else(|| empty.clone());
        let (uv_set, second_uv_set) = self.uv_sets(node, &pbr)?;
        self.second_uv_set = second_uv_set;
        let factor = pbr.numbers::<4>("baseColorFactor")?.unwrap_or([1.0; 4]).map(|v| v as f32);
        let base_factor = Vec3::from_slice(&factor[..3]).clamp(Vec3::ZERO, Vec3::ONE);
        let base = self.texture(&pbr, "baseColorTexture")?;
        let base_color = self.color(base_factor, base.as_ref())?;
        let (alpha, alpha_cutoff) = match node.text("alphaMode")?.unwrap_or("OPAQUE") {
            "OPAQUE" => (None, None),
            mode @ ("MASK" | "BLEND") => {
                let channel = base.filter(|texture| self.has_alpha(texture));
                let alpha =
                    self.float(factor[3].clamp(0.0, 1.0), channel.as_ref(), TextureEncoding::Alpha)?;
                let cutoff = node.number("alphaCutoff", 0.5)?;
                (Some(alpha), (mode == "MASK").then_some(cutoff))
            }
            _ => return Err(node.require("alphaMode")?.error("alpha modes are OPAQUE, MASK and BLEND")),
        };
        let unlit = node.extension("KHR_materials_unlit").is_some();
        let two_sided = unlit || node.flag("doubleSided")?;
        let normal_map = match node.get("normalTexture").filter(|_| !unlit) {
            None => None,
            Some(info) => {
                let scale = info.number("scale", 1.0)?.max(0.0);
                let texture = self.texture(node, "normalTexture")?;
                texture.map(|texture| self.normal_map(&texture, scale)).transpose()?
            }
        };
        let before = self.scene.materials.len();
        let (kind, radiance) = if unlit {
            if colors {
                self.warnings.add(format!("{}: colours of vertices are not used where `unlit`", node.path));
            }
            (MaterialKind::Diffuse { reflectance: ColorInput::Constant(Vec3::ZERO) }, base_color)
        } else {
            (self.scattering(node, &pbr, base_color, colors)?, self.emission(node)?)
        };
        // A body that is not all clear is a mix of two: those have the map.
        self.scene.materials[before..].iter_mut().for_each(|part| part.normal_map = normal_map);
        let id = self.add_material(Material { name: node.name(), kind, normal_map, bump: None })?;
        let emission =
            (radiance != ColorInput::Constant(Vec3::ZERO)).then_some(Emission { radiance, two_sided });
        let uses_colors = colors && (!unlit || alpha.is_some());
        Ok(BuiltMaterial { id, emission, alpha, alpha_cutoff, uv_set, second_uv_set, uses_colors })
    }

    fn emission(&mut self, node: &Node<'a>) -> Result<ColorInput, SceneError> {
        let strength = match node.extension("KHR_materials_emissive_strength") {
            Some(extension) => extension.number("emissiveStrength", 1.0)?.max(0.0),
            None => 1.0,
        };
        let factor = node.color("emissiveFactor", Vec3::ZERO)? * strength;
        self.lit_by_itself |= factor.max_element() > 1.0;
        if !factor.is_finite() {
            return Err(node.error("its emission is not finite"));
        }
        let texture = self.texture(node, "emissiveTexture")?;
        self.color(factor, texture.as_ref())
    }

    fn scattering(
        &mut self,
        node: &Node<'a>,
        pbr: &Node<'a>,
        base_color: ColorInput,
        vertex_colors: bool,
    ) -> Result<MaterialKind, SceneError> {
        let unit = |node: &Node<'a>, key: &str, default: f32| Ok(node.number(key, default)?.clamp(0.0, 1.0));
        let rough = self.texture(pbr, "metallicRoughnessTexture")?;
        let (metallic, roughness) = (unit(pbr, "metallicFactor", 1.0)?, unit(pbr, "roughnessFactor", 1.0)?);
        let mut m = MetallicRoughness {
            base_color,
            metallic: self.float(metallic, rough.as_ref(), TextureEncoding::Blue)?,
            roughness: self.float(roughness, rough.as_ref(), TextureEncoding::Green)?,
            vertex_colors,
            ..MetallicRoughness::default()
        };
        if let Some(e) = node.extension("KHR_materials_ior") {
            m.eta = e.number("ior", 1.5)?;
            if m.eta != 0.0 && !(1.0..=10.0).contains(&m.eta) {
                return Err(e.error(format!("`ior` must be 0 or from 1 to 10, not {}", m.eta)));
            }
        }
        if let Some(e) = node.extension("KHR_materials_specular") {
            let (map, color_map) =
                (self.texture(&e, "specularTexture")?, self.texture(&e, "specularColorTexture")?);
            m.specular =
                self.float(unit(&e, "specularFactor", 1.0)?, map.as_ref(), TextureEncoding::Alpha)?;
            m.specular_color = self.color(e.color("specularColorFactor", Vec3::ONE)?, color_map.as_ref())?;
        }
        if let Some(e) = node.extension("KHR_materials_transmission") {
            let map = self.texture(&e, "transmissionTexture")?;
            m.transmission =
                self.float(unit(&e, "transmissionFactor", 0.0)?, map.as_ref(), TextureEncoding::Red)?;
        }
        if let Some(e) = node.extension("KHR_materials_clearcoat") {
            let map = self.texture(&e, "clearcoatTexture")?;
            m.clearcoat =
                self.float(unit(&e, "clearcoatFactor", 0.0)?, map.as_ref(), TextureEncoding::Red)?;
            let map = self.texture(&e, "clearcoatRoughnessTexture")?;
            let roughness = unit(&e, "clearcoatRoughnessFactor", 0.0)?;
            m.clearcoat_roughness = self.float(roughness, map.as_ref(), TextureEncoding::Green)?;
            if e.get("clearcoatNormalTexture").is_some() {
                self.warnings.add(format!("{}: the coat has the normals of what is below", node.path));
            }
        }
        let thick = match node.extension("KHR_materials_volume") {
            Some(e) => e.number("thicknessFactor", 0.0)? > 0.0,
            None => false,
        };
        if thick && m.transmission != FloatInput::Constant(0.0) {
            return self.body(node, m);
        }
        Ok(MaterialKind::MetallicRoughness(m))
    }

    /// KHR_materials_volume: light is bent where it enters a closed body.
    fn body(&mut self, node: &Node<'a>, mut m: MetallicRoughness) -> Result<MaterialKind, SceneError> {
        self.warnings.add(format!("{}: light is bent, but not absorbed within a body", node.path));
        let alpha = self.squared(m.roughness)?;
        let roughness = Roughness { u: alpha, v: alpha, remap: false };
        let eta = if m.eta == 0.0 { 1.5 } else { m.eta };
        let clear = MaterialKind::Dielectric { eta, roughness, tint: m.base_color };
        let constant = |input| if let FloatInput::Constant(v) = input { v } else { 0.0 };
        let amount = match m.transmission {
            FloatInput::Constant(v) => FloatInput::Constant(v * (1.0 - constant(m.metallic))),
            texture => texture,
        };
        if amount == FloatInput::Constant(1.0) {
            return Ok(clear);
        }
        m.transmission = FloatInput::Constant(0.0);
        let mut add = |kind, part: &str| {
            let name = format!("{} ({part})", node.name());
            self.add_material(Material { name, kind, normal_map: None, bump: None })
        };
        let materials = [add(MaterialKind::MetallicRoughness(m), "surface")?, add(clear, "body")?];
        Ok(MaterialKind::Mix { materials, amount })
    }

    /// The sets of texture coordinates of a material. The first one is that of what decides opacity, emits or bends normals.
    fn uv_sets(&mut self, node: &Node<'a>, pbr: &Node<'a>) -> Result<(usize, Option<usize>), SceneError> {
        let cuts = node.text("alphaMode")?.is_some_and(|mode| mode != "OPAQUE")
            || node.extension("KHR_materials_unlit").is_some();
        let mut sets = Vec::new();
        if cuts {
            sets.extend(self.uv_set(pbr, "baseColorTexture")?);
        }
        for key in FIRST_UVS {
            sets.extend(self.uv_set(node, key)?);
        }
        let bound = sets.len();
        for key in ["baseColorTexture", "metallicRoughnessTexture"] {
            sets.extend(self.uv_set(pbr, key)?);
        }
        for (name, keys) in [
            ("KHR_materials_specular", &["specularTexture", "specularColorTexture"][..]),
            ("KHR_materials_transmission", &["transmissionTexture"]),
            ("KHR_materials_clearcoat", &["clearcoatTexture", "clearcoatRoughnessTexture"]),
        ] {
            let Some(extension) = node.extension(name) else { continue };
            for key in keys {
                sets.extend(self.uv_set(&extension, key)?);
            }
        }
        let first = sets.first().copied().unwrap_or(0);
        let second = sets.iter().copied().find(|set| *set != first);
        let rest = |set: &usize| *set != first && Some(*set) != second;
        if sets[..bound].iter().any(|set| *set != first) || sets.iter().any(rest) {
            self.warnings.add(format!(
                "{}: opacity, emission and normals use the coordinates TEXCOORD_{first}, and there may be one set more",
                node.path
            ));
        }
        Ok((first, second))
    }
}
