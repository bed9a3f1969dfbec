//! Materials of pbrt before version 4: `matte`, `plastic`, `metal`, `mirror`, `glass`, `uber`, `substrate`,
//! `translucent`, `mix` and stand-ins for the rest. Defaults as in the file formats of versions 2 and 3.
//!
//! Roughness: version 3 maps it to alpha by a polynomial unless `remaproughness` is false, version 2 takes it for the
//! inverse of a Blinn exponent ([`ScalarFunction`]). `plastic` has the dielectric inside out, as both versions do: its
//! coat has an index of 1 / 1.5 and reflects all of the light beyond 42 degrees.

use super::Builder;
use super::dialect::Dialect;
use super::params::ParamList;
use super::spectrum::{self, Quantity};
use crate::description::{
    ColorInput, Conductor, FloatInput, MaterialKind, Roughness, ScalarFunction, Texture,
};
use crate::error::SceneError;
use crate::source::Span;
use glam::Vec3;

/// Types of older versions.
pub(super) const TYPES: &[&str] = &[
    "matte",
    "plastic",
    "metal",
    "mirror",
    "glass",
    "uber",
    "substrate",
    "translucent",
    "disney",
    "fourier",
    "kdsubsurface",
    "shinymetal",
];

const BLACK: ColorInput = ColorInput::Constant(Vec3::ZERO);

impl Builder<'_> {
    /// The model of an older type; `None` for other types.
    pub(super) fn old_material(
        &mut self,
        ty: &str,
        at: &Span,
        params: &ParamList,
    ) -> Result<Option<MaterialKind>, SceneError> {
        Ok(Some(match ty {
            "matte" => {
                let reflectance = self.factor(params, "Kd", 0.5)?;
                match self.float_input(params, "sigma", 0.0)? {
                    FloatInput::Constant(0.0) => MaterialKind::Diffuse { reflectance },
                    sigma => MaterialKind::OrenNayar { reflectance, sigma },
                }
            }
            "plastic" => MaterialKind::Uber {
                diffuse: self.factor(params, "Kd", 0.25)?,
                specular: self.factor(params, "Ks", 0.25)?,
                mirror: BLACK,
                transmission: BLACK,
                roughness: self.old_roughness(params, 0.1)?,
                eta: 1.0 / 1.5,
            },
            "metal" => {
                let copper = |part: &str| spectrum::named(&format!("metal-Cu-{part}")).unwrap_or(Vec3::ONE);
                let eta = self.color_input(params, "eta", copper("eta"), Quantity::Unbounded)?;
                let k = self.color_input(params, "k", copper("k"), Quantity::Unbounded)?;
                let roughness = self.old_roughness(params, 0.01)?;
                MaterialKind::Conductor { conductor: Conductor::EtaK { eta, k }, roughness }
            }
            "mirror" => MaterialKind::Mirror { reflectance: self.factor(params, "Kr", 0.9)? },
            "glass" => self.glass(at, params)?,
            "uber" => self.uber(params)?,
            "substrate" => MaterialKind::Substrate {
                diffuse: self.factor(params, "Kd", 0.5)?,
                specular: self.factor(params, "Ks", 0.5)?,
                roughness: self.old_roughness(params, 0.1)?,
            },
            "translucent" => self.translucent(at, params)?,
            "shinymetal" => {
                self.warnings
                    .at(at, "material `shinymetal` is a `conductor` here, without its mirror reflection");
                params.ignore(&["Kr"]);
                let conductor = Conductor::Reflectance(self.factor(params, "Ks", 1.0)?);
                MaterialKind::Conductor { conductor, roughness: self.old_roughness(params, 0.1)? }
            }
            "disney" => self.disney(at, params)?,
            "fourier" | "kdsubsurface" => {
                self.warnings.at(at, format!("material `{ty}` is not supported: `diffuse` instead"));
                let reflectance = self.factor(params, "Kd", 0.5)?;
                params.params.iter().for_each(|param| param.used.set(true));
                MaterialKind::Diffuse { reflectance }
            }
            _ => return Ok(None),
        }))
    }

    /// A factor such as `Kd`: older versions take any number, here it ends at 1.
    fn factor(&mut self, params: &ParamList, name: &str, default: f32) -> Result<ColorInput, SceneError> {
        let input = self.color_input(params, name, Vec3::splat(default), Quantity::Unbounded)?;
        if let (ColorInput::Constant(value), Some(param)) = (input, params.get(name))
            && value.max_element() > 1.0
        {
            self.warnings.at(&param.span, format!("`{name}` is above 1: taken as 1"));
            return Ok(ColorInput::Constant(value.min(Vec3::ONE)));
        }
        Ok(input)
    }

    /// `roughness`, or `uroughness` and `vroughness`, as alpha.
    fn old_roughness(&mut self, params: &ParamList, default: f32) -> Result<Roughness, SceneError> {
        let remap = params.bool("remaproughness")?.unwrap_or(true);
        let function = match self.dialect {
            Dialect::V2 => Some(ScalarFunction::BlinnRoughness),
            _ if remap => Some(ScalarFunction::RoughnessPolynomial),
            _ => None,
        };
        let both = self.float_input(params, "roughness", default)?;
        let mut axis = |name: &str| -> Result<FloatInput, SceneError> {
            let value = match params.get(name) {
                Some(_) => self.float_input(params, name, default)?,
                None => both,
            };
            match function {
                None => Ok(value),
                Some(function) => self.function(function, value),
            }
        };
        Ok(Roughness { u: axis("uroughness")?, v: axis("vroughness")?, remap: false })
    }

    /// A function of a number or texture.
    pub(super) fn function(
        &mut self,
        function: ScalarFunction,
        input: FloatInput,
    ) -> Result<FloatInput, SceneError> {
        match input {
            FloatInput::Constant(value) => Ok(FloatInput::Constant(function.apply(value))),
            FloatInput::Texture(_) => {
                self.add_texture(Texture::Function { input, function }).map(FloatInput::Texture)
            }
        }
    }

    /// The product of two colours or textures.
    fn product(&mut self, a: ColorInput, b: ColorInput) -> Result<ColorInput, SceneError> {
        match (a, b) {
            (ColorInput::Constant(a), ColorInput::Constant(b)) => Ok(ColorInput::Constant(a * b)),
            (ColorInput::Constant(Vec3::ONE), other) | (other, ColorInput::Constant(Vec3::ONE)) => Ok(other),
            _ => self.add_texture(Texture::Scale { a, b }).map(ColorInput::Texture),
        }
    }

    /// The index of refraction, called `eta` or `index`.
    fn index(&mut self, params: &ParamList) -> Result<f32, SceneError> {
        for name in ["eta", "index"] {
            let Some(param) = params.get(name) else { continue };
            if param.ty == super::params::ParamType::Texture {
                self.warnings.at(&param.span, format!("a textured `{name}` is not supported: 1.5 instead"));
                continue;
            }
            return self.eta_of(params, name);
        }
        Ok(1.5)
    }

    fn glass(&mut self, at: &Span, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let mirror = self.factor(params, "Kr", 1.0)?;
        let tint = self.factor(params, "Kt", 1.0)?;
        let eta = self.index(params)?;
        let given = |name: &str| -> Result<bool, SceneError> {
            Ok(self.float_input(params, name, 0.0)? != FloatInput::Constant(0.0))
        };
        let rough = given("uroughness")? || given("vroughness")? || given("roughness")?;
        let roughness = if rough {
            self.old_roughness(params, 0.0)?
        } else {
            params.bool("remaproughness").map(|_| Roughness::SMOOTH)?
        };
        if mirror == ColorInput::Constant(Vec3::ONE) {
            return Ok(MaterialKind::Dielectric { eta, roughness, tint });
        }
        if rough {
            self.warnings.at(at, "`Kr` of rough glass is not supported: 1 instead");
            return Ok(MaterialKind::Dielectric { eta, roughness, tint });
        }
        Ok(MaterialKind::Uber { diffuse: BLACK, specular: BLACK, mirror, transmission: tint, roughness, eta })
    }

    /// `opacity` lets the rest of the light straight through: a mix with nothing.
    fn uber(&mut self, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let kind = MaterialKind::Uber {
            diffuse: self.factor(params, "Kd", 0.25)?,
            specular: self.factor(params, "Ks", 0.25)?,
            mirror: self.factor(params, "Kr", 0.0)?,
            transmission: self.factor(params, "Kt", 0.0)?,
            roughness: self.old_roughness(params, 0.1)?,
            eta: self.index(params)?,
        };
        let opacity = match self.color_input(params, "opacity", Vec3::ONE, Quantity::Unbounded)? {
            ColorInput::Constant(value) => FloatInput::Constant((value.element_sum() / 3.0).min(1.0)),
            ColorInput::Texture(id) => FloatInput::Texture(id),
        };
        if opacity == FloatInput::Constant(1.0) {
            return Ok(kind);
        }
        let amount = self.function(ScalarFunction::Complement, opacity)?;
        let solid = self.add_material(String::new(), kind, None, None)?;
        let nothing = self.add_material(String::new(), MaterialKind::Interface, None, None)?;
        Ok(MaterialKind::Mix { materials: [solid, nothing], amount })
    }

    fn translucent(&mut self, at: &Span, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let kd = self.factor(params, "Kd", 0.25)?;
        let (reflect, transmit) =
            (self.factor(params, "reflect", 0.5)?, self.factor(params, "transmit", 0.5)?);
        let ks = self.factor(params, "Ks", 0.25)?;
        let roughness = self.old_roughness(params, 0.1)?;
        // The lobes are added up: a mix of both with each divided by its share. That of the gloss is what it reflects, as
        // a dielectric has no factor on that.
        let gloss = match (ks, reflect, transmit) {
            _ if ks == BLACK || (reflect, transmit) == (BLACK, BLACK) => None,
            (ColorInput::Constant(ks), ColorInput::Constant(r), ColorInput::Constant(t)) => {
                let share = (ks * r).max_element();
                let fits = (ks * r).min_element() == share && share > 0.0 && share < 1.0;
                let tint = ks * t / share;
                (fits && tint.max_element() <= 1.0).then_some((share, tint))
            }
            _ => None,
        };
        if gloss.is_none() && ks != BLACK {
            self.warnings.at(
                at,
                "the glossy part (`Ks`) of `translucent` is left out: it needs a grey `Ks` times `reflect`, and \
                 `transmit` not above `reflect`",
            );
        }
        let rest = ColorInput::Constant(Vec3::splat(gloss.map_or(1.0, |(share, _)| 1.0 / (1.0 - share))));
        let (reflect, transmit) = (self.product(kd, reflect)?, self.product(kd, transmit)?);
        let matte = MaterialKind::DiffuseTransmission {
            reflectance: self.product(reflect, rest)?,
            transmittance: self.product(transmit, rest)?,
        };
        let Some((share, tint)) = gloss else { return Ok(matte) };
        let glossy = MaterialKind::Dielectric { eta: 1.5, roughness, tint: ColorInput::Constant(tint) };
        let matte = self.add_material(String::new(), matte, None, None)?;
        let glossy = self.add_material(String::new(), glossy, None, None)?;
        Ok(MaterialKind::Mix { materials: [matte, glossy], amount: FloatInput::Constant(share) })
    }

    /// Metal or plastic of its colour.
    fn disney(&mut self, at: &Span, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let color = self.factor(params, "color", 0.5)?;
        let metallic = match self.float_input(params, "metallic", 0.0)? {
            FloatInput::Constant(value) => value > 0.5,
            FloatInput::Texture(_) => false,
        };
        let roughness = self.float_input(params, "roughness", 0.5)?;
        // Its alpha is the square of the roughness (B. Burley 2012); without textures that is known here.
        let alpha = match roughness {
            FloatInput::Constant(r) => FloatInput::Constant(r * r),
            texture => texture,
        };
        let roughness = Roughness { u: alpha, v: alpha, remap: false };
        let eta = self.index(params)?;
        let stand_in = if metallic { "conductor" } else { "coateddiffuse" };
        self.warnings
            .at(at, format!("material `disney` is not supported: `{stand_in}` of its colour instead"));
        params.params.iter().for_each(|param| param.used.set(true));
        Ok(if metallic {
            MaterialKind::Conductor { conductor: Conductor::Reflectance(color), roughness }
        } else {
            MaterialKind::CoatedDiffuse { reflectance: color, roughness, eta }
        })
    }

    /// `mix` with `namedmaterial1` and `namedmaterial2`; `amount` is the share of the first, unlike in version 4.
    pub(super) fn old_mix(&mut self, at: &Span, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let named = |name: &str| match params.string(name)? {
            Some((material, param)) => self.named_material(material, &param.value_span(0)),
            None => Err(super::missing(name, "string", at)),
        };
        let materials = [named("namedmaterial1")?, named("namedmaterial2")?];
        let amount = match self.color_input(params, "amount", Vec3::splat(0.5), Quantity::Unbounded)? {
            ColorInput::Constant(value) => FloatInput::Constant(value.element_sum() / 3.0),
            ColorInput::Texture(id) => FloatInput::Texture(id),
        };
        Ok(MaterialKind::Mix { materials, amount: self.function(ScalarFunction::Complement, amount)? })
    }
}
