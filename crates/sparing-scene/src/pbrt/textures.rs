//! `Texture` directives, and the colour and number inputs that name them.
//!
//! pbrt keeps float and spectrum textures apart; so do the two maps here. A constant texture needs no entry in
//! the scene: its value goes wherever it is named.

use super::Builder;
use super::params::{Param, ParamList, ParamType};
use super::spectrum::{self, Quantity};
use crate::description::{
    ColorInput, FloatInput, ImageId, Texture, TextureEncoding, TextureId, UvMapping, Wrap,
};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;
use glam::Vec3;
use std::path::PathBuf;

const CLASSES: &[&str] = &["constant", "scale", "mix", "imagemap", "checkerboard"];
const UNSUPPORTED: &[&str] =
    &["bilerp", "directionmix", "dots", "fbm", "marble", "ptex", "windy", "wrinkled", "uv"];

impl Builder<'_> {
    /// `Texture "name" "type" "class" parameters`.
    pub(super) fn texture(
        &mut self,
        name: String,
        ty: &(String, Span),
        class: &(String, Span),
        mut params: ParamList,
    ) -> Result<(), SceneError> {
        params.add_defaults(&self.state.texture_defaults);
        let is_float = match ty.0.as_str() {
            "float" => true,
            "spectrum" | "color" => false,
            other => {
                let error =
                    SceneError::new(ErrorKind::Unknown, format!("there are no textures of type `{other}`"));
                return Err(error.at(&ty.1).help("texture types are float and spectrum"));
            }
        };
        let value = self.texture_value(class, &params, is_float)?;
        params.warn_unused(&format!("texture `{name}`"), &mut self.warnings);
        if is_float {
            let value = match value {
                ColorInput::Constant(value) => FloatInput::Constant(value.x),
                ColorInput::Texture(id) => FloatInput::Texture(id),
            };
            self.float_textures.insert(name, value);
        } else {
            self.color_textures.insert(name, value);
        }
        Ok(())
    }

    fn texture_value(
        &mut self,
        (class, class_span): &(String, Span),
        params: &ParamList,
        is_float: bool,
    ) -> Result<ColorInput, SceneError> {
        let texture = match class.as_str() {
            "constant" => return self.operand(params, "value", 1.0, is_float),
            "scale" => {
                let a = self.operand(params, "tex", 1.0, is_float)?;
                match (a, self.float_input(params, "scale", 1.0)?) {
                    (a, FloatInput::Constant(1.0)) => return Ok(a),
                    (ColorInput::Constant(a), FloatInput::Constant(b)) => {
                        return Ok(ColorInput::Constant(a * b));
                    }
                    (a, FloatInput::Constant(b)) => {
                        Texture::Scale { a, b: ColorInput::Constant(Vec3::splat(b)) }
                    }
                    (a, FloatInput::Texture(b)) => Texture::Scale { a, b: ColorInput::Texture(b) },
                }
            }
            "mix" => Texture::Mix {
                a: self.operand(params, "tex1", 0.0, is_float)?,
                b: self.operand(params, "tex2", 1.0, is_float)?,
                amount: self.float_input(params, "amount", 0.5)?,
            },
            "checkerboard" => {
                if params.integer_in("dimension", 2..=3)? == Some(3) {
                    self.warnings.at(class_span, "a checkerboard in space is drawn in texture coordinates");
                }
                Texture::Checkerboard {
                    even: self.operand(params, "tex1", 1.0, is_float)?,
                    odd: self.operand(params, "tex2", 0.0, is_float)?,
                    mapping: self.uv_mapping(params)?,
                }
            }
            "imagemap" => self.image_texture(class_span, params)?,
            other if UNSUPPORTED.contains(&other) => {
                params.params.iter().for_each(|param| param.used.set(true));
                let message = format!("textures of class `{other}` are not supported: grey 0.5 instead");
                self.warnings.at(class_span, message);
                return Ok(ColorInput::Constant(Vec3::splat(0.5)));
            }
            other => {
                let error =
                    SceneError::new(ErrorKind::Unknown, format!("there is no texture class `{other}`"));
                let help = did_you_mean(other, CLASSES.iter().copied());
                return Err(error
                    .at(class_span)
                    .help("known are: ".to_owned() + &CLASSES.join(", "))
                    .maybe_help(help));
            }
        };
        self.add_texture(texture).map(ColorInput::Texture)
    }

    pub(super) fn add_texture(&mut self, texture: Texture) -> Result<TextureId, SceneError> {
        self.count_entity()?;
        self.scene.textures.push(texture);
        Ok(TextureId((self.scene.textures.len() - 1) as u32))
    }

    fn image_texture(&mut self, class_span: &Span, params: &ParamList) -> Result<Texture, SceneError> {
        let encoding = match params.string("encoding")? {
            None => TextureEncoding::Auto,
            Some(("sRGB", _)) => TextureEncoding::Srgb,
            Some(("linear", _)) => TextureEncoding::Linear,
            Some(("alpha", _)) => TextureEncoding::Alpha,
            Some(("red", _)) => TextureEncoding::Red,
            Some(("green", _)) => TextureEncoding::Green,
            Some(("blue", _)) => TextureEncoding::Blue,
            Some((text, param)) => {
                let gamma = text.strip_prefix("gamma").and_then(|rest| rest.trim().parse::<f32>().ok());
                match gamma {
                    Some(gamma) if gamma > 0.0 && gamma.is_finite() => TextureEncoding::Gamma(gamma),
                    _ => {
                        return Err(param
                            .value_error(0, format!("there is no encoding `{text}`"))
                            .help("encodings are sRGB, linear, `gamma 2.2`, alpha, red, green and blue"));
                    }
                }
            }
        };
        let wrap = wrap_mode(params, "wrap")?.unwrap_or(Wrap::Repeat);
        let wrap = [wrap, wrap_mode(params, "wrapv")?.unwrap_or(wrap)];
        let image = self.image(params, "filename", encoding, class_span)?;
        let scale = params.float("scale")?.unwrap_or(1.0);
        let invert = params.bool("invert")?.unwrap_or(false);
        if invert && scale != 1.0 {
            self.warnings.at(class_span, "`invert` is applied before `scale`, in pbrt after it");
        }
        params.ignore(&["filter", "maxanisotropy"]);
        Ok(Texture::Image { image, mapping: self.uv_mapping(params)?, wrap, scale, invert })
    }

    /// A picture file that must exist.
    pub(super) fn image(
        &mut self,
        params: &ParamList,
        name: &str,
        encoding: TextureEncoding,
        at: &Span,
    ) -> Result<ImageId, SceneError> {
        let path = self.required_file(params, name, at)?;
        Ok(self.images.file(&mut self.scene, &path, encoding))
    }

    /// The path in a string parameter, which must be a file.
    pub(super) fn required_file(
        &self,
        params: &ParamList,
        name: &str,
        at: &Span,
    ) -> Result<PathBuf, SceneError> {
        let Some((file, param)) = params.string(name)? else {
            return Err(super::missing(name, "string", at));
        };
        self.existing_file(file, &param.value_span(0))
    }

    fn uv_mapping(&mut self, params: &ParamList) -> Result<UvMapping, SceneError> {
        if let Some((mapping, param)) = params.string("mapping")?
            && mapping != "uv"
        {
            self.warnings.at(&param.span, format!("mapping `{mapping}` is not supported: uv instead"));
            params.ignore(&["v1", "v2"]);
        }
        Ok(UvMapping {
            scale: [params.float("uscale")?.unwrap_or(1.0), params.float("vscale")?.unwrap_or(1.0)],
            offset: [params.float("udelta")?.unwrap_or(0.0), params.float("vdelta")?.unwrap_or(0.0)],
            cross: [params.float("uperv")?.unwrap_or(0.0), params.float("vperu")?.unwrap_or(0.0)],
        })
    }

    /// A texture operand: of the kind of its texture.
    fn operand(
        &self,
        params: &ParamList,
        name: &str,
        default: f32,
        is_float: bool,
    ) -> Result<ColorInput, SceneError> {
        if !is_float {
            return self.color_input(params, name, Vec3::splat(default), Quantity::Unbounded);
        }
        Ok(match self.float_input(params, name, default)? {
            FloatInput::Constant(value) => ColorInput::Constant(Vec3::splat(value)),
            FloatInput::Texture(id) => ColorInput::Texture(id),
        })
    }

    /// A colour given directly or by the name of a texture.
    pub(super) fn color_input(
        &self,
        params: &ParamList,
        name: &str,
        default: Vec3,
        quantity: Quantity,
    ) -> Result<ColorInput, SceneError> {
        let Some(param) = params.get(name) else { return Ok(ColorInput::Constant(default)) };
        if param.ty == ParamType::Texture {
            let name = texture_name(param)?;
            let found = self.color_textures.get(name).copied();
            let float = || match self.float_textures.get(name)? {
                FloatInput::Constant(value) => Some(ColorInput::Constant(Vec3::splat(*value))),
                FloatInput::Texture(id) => Some(ColorInput::Texture(*id)),
            };
            return found.or_else(float).ok_or_else(|| self.no_texture(param, name));
        }
        let value = spectrum::color(param, quantity, &self.base, self.options)?;
        if quantity == Quantity::Albedo && value.max_element() > 1.0 {
            return Err(
                param.value_error(0, format!("`{name}` must be from 0 to 1, not {}", value.max_element()))
            );
        }
        Ok(ColorInput::Constant(value))
    }

    /// A number given directly or by the name of a texture.
    pub(super) fn float_input(
        &self,
        params: &ParamList,
        name: &str,
        default: f32,
    ) -> Result<FloatInput, SceneError> {
        match params.get(name) {
            Some(param) if param.ty == ParamType::Texture => self.named_float(param),
            _ => Ok(FloatInput::Constant(params.float(name)?.unwrap_or(default))),
        }
    }

    fn named_float(&self, param: &Param) -> Result<FloatInput, SceneError> {
        let name = texture_name(param)?;
        let found = self.float_textures.get(name).copied();
        let color = || match self.color_textures.get(name)? {
            ColorInput::Constant(value) => Some(FloatInput::Constant(value.element_sum() / 3.0)),
            ColorInput::Texture(id) => Some(FloatInput::Texture(*id)),
        };
        found.or_else(color).ok_or_else(|| self.no_texture(param, name))
    }

    fn no_texture(&self, param: &Param, name: &str) -> SceneError {
        let known = self.color_textures.keys().chain(self.float_textures.keys());
        SceneError::new(ErrorKind::Unknown, format!("there is no texture named `{name}` yet"))
            .at(&param.value_span(0))
            .maybe_help(did_you_mean(name, known.map(String::as_str)))
    }
}

fn wrap_mode(params: &ParamList, name: &str) -> Result<Option<Wrap>, SceneError> {
    Ok(Some(match params.string(name)? {
        None => return Ok(None),
        Some(("repeat", _)) => Wrap::Repeat,
        Some(("clamp", _)) => Wrap::Clamp,
        Some(("black", _)) => Wrap::Black,
        Some(("mirror", _)) => Wrap::Mirror,
        Some((text, param)) => {
            return Err(param
                .value_error(0, format!("there is no wrap mode `{text}`"))
                .help("wrap modes are repeat, clamp, black and mirror"));
        }
    }))
}

fn texture_name(param: &Param) -> Result<&str, SceneError> {
    match param.strings() {
        [name] => Ok(name),
        _ => Err(param.error(format!("`{}` takes the name of one texture", param.name))),
    }
}
