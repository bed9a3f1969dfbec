//! `Texture` directives, and the colour and number inputs that name them.
//!
//! pbrt keeps float and spectrum textures apart; so do the two maps here. A constant texture needs no entry in
//! the scene: its value goes wherever it is named.

use super::Builder;
use super::dialect::Dialect;
use super::params::{Param, ParamList, ParamType};
use super::spectrum::Quantity;
use crate::description::{
    ColorInput, FloatInput, ImageId, Texture, TextureEncoding, TextureId, UvMapping, Wrap,
};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;
use glam::Vec3;
use std::path::PathBuf;

const CLASSES: &[&str] = &[
    "constant",
    "scale",
    "mix",
    "imagemap",
    "checkerboard",
    "dots",
    "fbm",
    "wrinkled",
    "windy",
    "marble",
    "directionmix",
    "bilerp",
    "uv",
    "ptex",
];

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
            // Before version 4 `tex1` and `tex2` are of the same kind.
            "scale" if params.get("tex1").is_some() || params.get("tex2").is_some() => {
                let (a, b) = (
                    self.operand(params, "tex1", 1.0, is_float)?,
                    self.operand(params, "tex2", 1.0, is_float)?,
                );
                match (a, b) {
                    (ColorInput::Constant(a), ColorInput::Constant(b)) => {
                        return Ok(ColorInput::Constant(a * b));
                    }
                    (a, b) => Texture::Scale { a, b },
                }
            }
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
            "checkerboard" => return self.checkerboard(class_span, params, is_float),
            "imagemap" if self.lacks_picture(params, "filename")? => {
                params.params.iter().for_each(|param| param.used.set(true));
                let scale = params.float("scale")?.unwrap_or(1.0);
                return Ok(ColorInput::Constant(Vec3::splat(scale)));
            }
            "imagemap" => {
                let (mapping, projection) = self.mapping(params, class_span)?;
                let texture = self.image_texture(class_span, params, mapping)?;
                return self.projected(texture, projection);
            }
            "ptex" => {
                params.params.iter().for_each(|param| param.used.set(true));
                self.warnings.at(class_span, "textures of class `ptex` are not supported: grey 0.5 instead");
                return Ok(ColorInput::Constant(Vec3::splat(0.5)));
            }
            other => {
                if let Some(texture) = self.procedural(other, class_span, params, is_float)? {
                    return Ok(texture);
                }
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

    fn image_texture(
        &mut self,
        class_span: &Span,
        params: &ParamList,
        mapping: UvMapping,
    ) -> Result<Texture, SceneError> {
        let encoding = self.encoding(params)?;
        let wrap = wrap_mode(params, "wrap")?.unwrap_or(Wrap::Repeat);
        let wrap = [wrap, wrap_mode(params, "wrapv")?.unwrap_or(wrap)];
        let image = self.image(params, "filename", encoding, class_span)?;
        let scale = params.float("scale")?.unwrap_or(1.0);
        let invert = params.bool("invert")?.unwrap_or(false);
        if invert && scale != 1.0 {
            self.warnings.at(class_span, "`invert` is applied before `scale`, in pbrt after it");
        }
        params.ignore(&["filter", "maxanisotropy", "trilinear"]);
        let mut mapping = mapping;
        if self.dialect == Dialect::V2 {
            // Version 2 has v = 0 at the top of a picture.
            mapping.scale[1] = -mapping.scale[1];
            mapping.cross[1] = -mapping.cross[1];
            mapping.offset[1] = 1.0 - mapping.offset[1];
        }
        Ok(Texture::Image { image, mapping, wrap, scale, invert })
    }

    /// What the numbers of a picture mean: `encoding`, or `gamma` before version 4 (a number in version 2, in
    /// version 3 whether the picture is sRGB: PNG and TGA are).
    fn encoding(&self, params: &ParamList) -> Result<TextureEncoding, SceneError> {
        if let Some((text, param)) = params.string("encoding")? {
            return match text {
                "sRGB" => Ok(TextureEncoding::Srgb),
                "linear" => Ok(TextureEncoding::Linear),
                "alpha" => Ok(TextureEncoding::Alpha),
                "red" => Ok(TextureEncoding::Red),
                "green" => Ok(TextureEncoding::Green),
                "blue" => Ok(TextureEncoding::Blue),
                _ => {
                    let gamma = text.strip_prefix("gamma").and_then(|rest| rest.trim().parse::<f32>().ok());
                    match gamma {
                        Some(gamma) if gamma > 0.0 && gamma.is_finite() => Ok(TextureEncoding::Gamma(gamma)),
                        _ => Err(param
                            .value_error(0, format!("there is no encoding `{text}`"))
                            .help("encodings are sRGB, linear, `gamma 2.2`, alpha, red, green and blue")),
                    }
                }
            };
        }
        let gamma_is_bool = params.get("gamma").is_some_and(|param| param.ty == ParamType::Bool);
        Ok(match self.dialect {
            Dialect::V4 => TextureEncoding::Auto,
            _ if gamma_is_bool => match params.bool("gamma")? {
                Some(true) => TextureEncoding::Srgb,
                _ => TextureEncoding::Linear,
            },
            Dialect::V3 => TextureEncoding::Auto,
            Dialect::V2 => match params.float_where("gamma", 1.0, "positive", |gamma| gamma > 0.0)? {
                1.0 => TextureEncoding::Linear,
                gamma => TextureEncoding::Gamma(gamma),
            },
        })
    }

    /// Whether a picture of an older scene is missing, which those versions render without: a warning.
    pub(super) fn lacks_picture(&mut self, params: &ParamList, name: &str) -> Result<bool, SceneError> {
        let Some((file, param)) = params.string(name)?.filter(|_| self.dialect != Dialect::V4) else {
            return Ok(false);
        };
        let lacks = self.find_file(file, &param.value_span(0))?.is_none();
        if lacks {
            let message = format!("there is no file `{}`: even instead", super::parser::shorten(file));
            self.warnings.at(&param.value_span(0), message);
        }
        Ok(lacks)
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

    /// A texture operand: of the kind of its texture.
    pub(super) fn operand(
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
        let value = self.color(param, quantity)?;
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
