//! `Material` and `MakeNamedMaterial`.
//!
//! Types and defaults as in the pbrt-v4 file format. `dielectric` knows one more parameter, `tint`: a factor
//! on refracted light. Dispersion is not modelled: a spectral index of refraction becomes its mean.

use super::Builder;
use super::params::{ParamList, ParamType};
use super::spectrum::{self, Quantity};
use crate::description::{
    ColorInput, Conductor, FloatInput, Material, MaterialId, MaterialKind, Roughness, Texture,
    TextureEncoding, TextureId, UvMapping, Wrap,
};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;
use glam::Vec3;

const TYPES: &[&str] = &[
    "diffuse",
    "coateddiffuse",
    "conductor",
    "coatedconductor",
    "dielectric",
    "thindielectric",
    "diffusetransmission",
    "mix",
    "interface",
    "metallicroughness",
];
/// Types that a simpler material stands in for.
const STAND_INS: &[(&str, &str)] = &[("subsurface", "diffuse"), ("hair", "diffuse"), ("measured", "diffuse")];
impl Builder<'_> {
    /// Adds the material that the parameters describe; `at` is the type name.
    pub(super) fn material(
        &mut self,
        name: String,
        ty: &str,
        at: &Span,
        mut params: ParamList,
    ) -> Result<MaterialId, SceneError> {
        params.add_defaults(&self.state.material_defaults);
        let is_texture = params.get("normalmap").is_some_and(|param| param.ty == ParamType::Texture);
        let normal_map = match (is_texture, params.get("normalmap")) {
            (_, None) => None,
            // An own extension: any texture.
            (true, _) => match self.color_input(&params, "normalmap", Vec3::ZERO, Quantity::Unbounded)? {
                ColorInput::Texture(id) => Some(id),
                constant @ ColorInput::Constant(_) => {
                    let flat = Texture::Scale { a: constant, b: ColorInput::Constant(Vec3::ONE) };
                    Some(self.add_texture(flat)?)
                }
            },
            (false, Some(_)) => {
                let image = self.image(&params, "normalmap", TextureEncoding::Linear, at)?;
                let texture = Texture::Image {
                    image,
                    mapping: UvMapping::default(),
                    wrap: [Wrap::Repeat; 2],
                    scale: 1.0,
                    invert: false,
                };
                Some(self.add_texture(texture)?)
            }
        };
        // `bumpmap` before version 4.
        let height = if params.get("displacement").is_some() { "displacement" } else { "bumpmap" };
        let bump = match self.float_input(&params, height, 0.0)? {
            FloatInput::Texture(id) => Some(id),
            FloatInput::Constant(_) => None,
        };
        let before = self.scene.materials.len();
        let kind = self.material_kind(ty, at, &params)?;
        // Where the type is a mix of parts, those have the maps.
        for part in &mut self.scene.materials[before..] {
            (part.normal_map, part.bump) = (normal_map, bump);
        }
        params.warn_unused(&format!("material `{ty}`"), &mut self.warnings);
        self.add_material(name, kind, normal_map, bump)
    }

    pub(super) fn add_material(
        &mut self,
        name: String,
        kind: MaterialKind,
        normal_map: Option<TextureId>,
        bump: Option<TextureId>,
    ) -> Result<MaterialId, SceneError> {
        self.count_entity()?;
        self.scene.materials.push(Material { name, kind, normal_map, bump });
        Ok(MaterialId((self.scene.materials.len() - 1) as u32))
    }

    /// The current material, by default a grey diffuse one.
    pub(super) fn current_material(&mut self) -> Result<MaterialId, SceneError> {
        if let Some(id) = self.state.material.or(self.default_material) {
            return Ok(id);
        }
        let kind = MaterialKind::Diffuse { reflectance: ColorInput::Constant(Vec3::splat(0.5)) };
        let id = self.add_material("default".to_owned(), kind, None, None)?;
        self.default_material = Some(id);
        Ok(id)
    }

    fn material_kind(&mut self, ty: &str, at: &Span, params: &ParamList) -> Result<MaterialKind, SceneError> {
        Ok(match ty {
            "diffuse" => {
                let reflectance = self.albedo(params, "reflectance", 0.5)?;
                // `sigma` was part of version 4 before its release.
                match self.float_input(params, "sigma", 0.0)? {
                    FloatInput::Constant(0.0) => MaterialKind::Diffuse { reflectance },
                    sigma => MaterialKind::OrenNayar { reflectance, sigma },
                }
            }
            "coateddiffuse" => {
                params.ignore(&["thickness", "g", "albedo", "maxdepth", "nsamples"]);
                MaterialKind::CoatedDiffuse {
                    reflectance: self.albedo(params, "reflectance", 0.5)?,
                    roughness: self.roughness(params)?,
                    eta: self.eta(params)?,
                }
            }
            "conductor" => MaterialKind::Conductor {
                conductor: self.conductor(params)?,
                roughness: self.roughness(params)?,
            },
            "dielectric" => MaterialKind::Dielectric {
                eta: self.eta(params)?,
                roughness: self.roughness(params)?,
                tint: self.albedo(params, "tint", 1.0)?,
            },
            "thindielectric" => MaterialKind::ThinDielectric { eta: self.eta(params)? },
            "diffusetransmission" => self.diffuse_transmission(params)?,
            "coatedconductor" => self.coated_conductor(params)?,
            "mix" if params.get("namedmaterial1").is_some() => self.old_mix(at, params)?,
            "mix" => self.mix(at, params)?,
            "interface" | "none" | "" => MaterialKind::Interface,
            "metallicroughness" => self.metallic_roughness(params)?,
            other => {
                if let Some((_, stand_in)) = STAND_INS.iter().find(|(name, _)| *name == other) {
                    let message = format!("material `{other}` is not supported: `{stand_in}` instead");
                    self.warnings.at(at, message);
                    let kind = self.material_kind(stand_in, at, params)?;
                    params.params.iter().for_each(|param| param.used.set(true));
                    return Ok(kind);
                }
                if let Some(kind) = self.old_material(other, at, params)? {
                    return Ok(kind);
                }
                let error =
                    SceneError::new(ErrorKind::Unknown, format!("there is no material type `{other}`"));
                let known = TYPES.iter().chain(super::old_materials::TYPES).copied();
                return Err(error
                    .at(at)
                    .help("known are: ".to_owned() + &TYPES.join(", "))
                    .maybe_help(did_you_mean(other, known)));
            }
        })
    }

    fn albedo(&self, params: &ParamList, name: &str, default: f32) -> Result<ColorInput, SceneError> {
        self.color_input(params, name, Vec3::splat(default), Quantity::Albedo)
    }

    /// pbrt scales both albedos by `scale`.
    fn diffuse_transmission(&mut self, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let scale = params.float_where("scale", 1.0, "not negative", |s| s >= 0.0)?;
        let reflectance = self.albedo(params, "reflectance", 0.25)?;
        let transmittance = self.albedo(params, "transmittance", 0.25)?;
        Ok(MaterialKind::DiffuseTransmission {
            reflectance: self.scaled(reflectance, scale)?,
            transmittance: self.scaled(transmittance, scale)?,
        })
    }

    fn scaled(&mut self, input: ColorInput, scale: f32) -> Result<ColorInput, SceneError> {
        match input {
            ColorInput::Constant(value) => Ok(ColorInput::Constant(value * scale)),
            texture if scale == 1.0 => Ok(texture),
            texture => {
                let b = ColorInput::Constant(Vec3::splat(scale));
                self.add_texture(Texture::Scale { a: texture, b }).map(ColorInput::Texture)
            }
        }
    }

    fn roughness(&self, params: &ParamList) -> Result<Roughness, SceneError> {
        self.roughness_of(params, "", "roughness")
    }

    /// Roughness by parameters that start with `prefix`.
    fn roughness_of(&self, params: &ParamList, prefix: &str, both: &str) -> Result<Roughness, SceneError> {
        let name = |of: &str| format!("{prefix}{of}");
        let common = self.float_input(params, &name(both), 0.0)?;
        let axis = |of: &str| {
            let of = name(of);
            let value = match params.get(&of) {
                Some(_) => self.float_input(params, &of, 0.0)?,
                None => common,
            };
            match value {
                FloatInput::Constant(v) if v < 0.0 => {
                    let given = params.get(&of).or_else(|| params.get(&name(both)));
                    let message = format!("roughness must not be negative, not {v}");
                    Err(match given {
                        Some(param) => param.value_error(0, message),
                        None => SceneError::new(ErrorKind::Value, message),
                    })
                }
                value => Ok(value),
            }
        };
        let (u, v) = (axis("uroughness")?, axis("vroughness")?);
        let remap = params.bool("remaproughness")?.unwrap_or(true);
        Ok(Roughness { u, v, remap })
    }

    fn eta(&mut self, params: &ParamList) -> Result<f32, SceneError> {
        self.eta_of(params, "eta")
    }

    pub(super) fn eta_of(&mut self, params: &ParamList, name: &str) -> Result<f32, SceneError> {
        let Some(param) = params.get(name) else { return Ok(1.5) };
        let value = self.color(param, Quantity::Unbounded)?;
        let eta = value.element_sum() / 3.0;
        if !(0.1..=10.0).contains(&eta) {
            return Err(param.value_error(0, format!("`{name}` must be from 0.1 to 10, not {eta}")));
        }
        Ok(eta)
    }

    fn conductor(&mut self, params: &ParamList) -> Result<Conductor, SceneError> {
        self.conductor_of(params, "eta", "k")
    }

    fn coated_conductor(&mut self, params: &ParamList) -> Result<MaterialKind, SceneError> {
        params.ignore(&["thickness", "g", "albedo", "maxdepth", "nsamples"]);
        Ok(MaterialKind::CoatedConductor {
            conductor: self.conductor_of(params, "conductor.eta", "conductor.k")?,
            roughness: self.roughness_of(params, "conductor.", "roughness")?,
            eta: self.eta_of(params, "interface.eta")?,
            coat_roughness: self.roughness_of(params, "interface.", "roughness")?,
        })
    }

    fn conductor_of(&mut self, params: &ParamList, eta: &str, k: &str) -> Result<Conductor, SceneError> {
        if let Some(reflectance) = params.get("reflectance") {
            if params.get(eta).is_some() || params.get(k).is_some() {
                return Err(reflectance.error("a conductor has either `reflectance` or `eta` and `k`"));
            }
            return Ok(Conductor::Reflectance(self.albedo(params, "reflectance", 1.0)?));
        }
        let copper = |part: &str| spectrum::named(&format!("metal-Cu-{part}")).unwrap_or(Vec3::ONE);
        let eta = self.color_input(params, eta, copper("eta"), Quantity::Unbounded)?;
        let k = self.color_input(params, k, copper("k"), Quantity::Unbounded)?;
        Ok(Conductor::EtaK { eta, k })
    }

    fn mix(&mut self, at: &Span, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let Some(param) = params.get("materials") else {
            return Err(super::missing("materials", "string", at));
        };
        let [first, second] = param.strings() else {
            return Err(param.error("`materials` takes the names of two materials"));
        };
        let materials = [
            self.named_material(first, &param.value_span(0))?,
            self.named_material(second, &param.value_span(1))?,
        ];
        Ok(MaterialKind::Mix { materials, amount: self.float_input(params, "amount", 0.5)? })
    }

    /// The id of a material made by `MakeNamedMaterial`.
    pub(super) fn named_material(&self, name: &str, at: &Span) -> Result<MaterialId, SceneError> {
        self.named_materials.get(name).copied().ok_or_else(|| {
            let known = self.named_materials.keys().map(String::as_str);
            SceneError::new(ErrorKind::Unknown, format!("there is no material named `{name}` yet"))
                .at(at)
                .maybe_help(did_you_mean(name, known))
        })
    }
}
