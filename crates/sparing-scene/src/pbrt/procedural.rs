//! Texture classes that are functions, and the mappings that give textures their coordinates.
//!
//! Functions of the position work in the space of the `Texture` directive. Versions 2 and 3 apply that transformation
//! to the point where its inverse is meant; scenes of theirs are taken as they are drawn there.

use super::Builder;
use super::dialect::Dialect;
use super::graphics_state::invert;
use super::params::ParamList;
use crate::description::{ColorInput, Noise, ScalarFunction, Texture, TextureProjection, UvMapping};
use crate::error::{ErrorKind, SceneError};
use crate::source::Span;
use glam::{Affine3A, Vec3};

/// A projection and the space it works in.
type Projection = Option<(TextureProjection, Affine3A)>;

impl Builder<'_> {
    /// A texture of a class that is a function; `None` if there is no such class.
    pub(super) fn procedural(
        &mut self,
        class: &str,
        at: &Span,
        params: &ParamList,
        is_float: bool,
    ) -> Result<Option<ColorInput>, SceneError> {
        let texture = match class {
            "dots" => {
                let inside = self.operand(params, "inside", 1.0, is_float)?;
                let outside = self.operand(params, "outside", 0.0, is_float)?;
                let (mapping, projection) = self.mapping(params, at)?;
                if projection.is_none() {
                    Texture::Dots { mapping, inside, outside }
                } else {
                    let (one, zero) = (ColorInput::Constant(Vec3::ONE), ColorInput::Constant(Vec3::ZERO));
                    let mask = Texture::Dots { mapping, inside: one, outside: zero };
                    return self.masked(mask, projection, inside, outside).map(Some);
                }
            }
            "fbm" | "wrinkled" | "windy" | "marble" => {
                let noise = self.noise(class, params)?;
                Texture::Noise { from_world: self.noise_space(at)?, noise }
            }
            "directionmix" => {
                let given = params.point3("dir")?.unwrap_or(glam::DVec3::Y);
                let Some(direction) = self.state.ctm.transform_vector3(given).try_normalize() else {
                    return Err(SceneError::new(ErrorKind::Value, "`dir` must have a length").at(at));
                };
                Texture::DirectionMix {
                    direction: direction.as_vec3(),
                    a: self.operand(params, "tex1", 0.0, is_float)?,
                    b: self.operand(params, "tex2", 1.0, is_float)?,
                }
            }
            "bilerp" => {
                let mut corners = [Vec3::ZERO; 4];
                for (corner, (name, default)) in
                    corners.iter_mut().zip([("v00", 0.0), ("v01", 1.0), ("v10", 0.0), ("v11", 1.0)])
                {
                    match self.operand(params, name, default, is_float)? {
                        ColorInput::Constant(value) => *corner = value,
                        ColorInput::Texture(_) => {
                            let error =
                                SceneError::new(ErrorKind::Value, "the corners of `bilerp` are constants");
                            return Err(error.at(at));
                        }
                    }
                }
                let (mapping, projection) = self.mapping(params, at)?;
                return self.projected(Texture::Bilinear { mapping, corners }, projection).map(Some);
            }
            "uv" => {
                let (mapping, projection) = self.mapping(params, at)?;
                return self.projected(Texture::Coordinates { mapping }, projection).map(Some);
            }
            // What the writer needs to say.
            "function" => {
                let function = match params.string("function")? {
                    Some(("roughness-v2", _)) => ScalarFunction::BlinnRoughness,
                    Some(("roughness-v3", _)) => ScalarFunction::RoughnessPolynomial,
                    Some(("complement", _)) => ScalarFunction::Complement,
                    Some((name, param)) => {
                        return Err(param.value_error(0, format!("there is no function `{name}`")));
                    }
                    None => return Err(super::missing("function", "string", at)),
                };
                Texture::Function { input: self.float_input(params, "input", 0.0)?, function }
            }
            "seconduv" => Texture::SecondUv { input: self.operand(params, "tex", 0.0, is_float)? },
            "projected" => {
                let input = self.operand(params, "tex", 0.0, is_float)?;
                let (_, projection) = self.mapping(params, at)?;
                let Some((projection, from_world)) = projection else {
                    return Err(super::missing("mapping", "string", at));
                };
                Texture::Projected { projection, from_world, input }
            }
            _ => return Ok(None),
        };
        self.add_texture(texture).map(|id| Some(ColorInput::Texture(id)))
    }

    pub(super) fn checkerboard(
        &mut self,
        at: &Span,
        params: &ParamList,
        is_float: bool,
    ) -> Result<ColorInput, SceneError> {
        let even = self.operand(params, "tex1", 1.0, is_float)?;
        let odd = self.operand(params, "tex2", 0.0, is_float)?;
        params.ignore(&["aamode"]);
        if params.integer_in("dimension", 2..=3)? == Some(3) {
            let texture = Texture::Cubes { from_world: self.noise_space(at)?, even, odd };
            return self.add_texture(texture).map(ColorInput::Texture);
        }
        let (mapping, projection) = self.mapping(params, at)?;
        if projection.is_none() {
            return self.add_texture(Texture::Checkerboard { mapping, even, odd }).map(ColorInput::Texture);
        }
        let (one, zero) = (ColorInput::Constant(Vec3::ONE), ColorInput::Constant(Vec3::ZERO));
        self.masked(Texture::Checkerboard { mapping, even: one, odd: zero }, projection, even, odd)
    }

    /// `a` where a projected mask is 1, `b` where it is 0: both keep their own coordinates.
    fn masked(
        &mut self,
        mask: Texture,
        projection: Projection,
        a: ColorInput,
        b: ColorInput,
    ) -> Result<ColorInput, SceneError> {
        let amount = match self.projected(mask, projection)? {
            ColorInput::Texture(id) => crate::description::FloatInput::Texture(id),
            ColorInput::Constant(value) => crate::description::FloatInput::Constant(value.x),
        };
        self.add_texture(Texture::Mix { a: b, b: a, amount }).map(ColorInput::Texture)
    }

    /// Adds a texture, with coordinates from the position if there is a projection.
    pub(super) fn projected(
        &mut self,
        texture: Texture,
        projection: Projection,
    ) -> Result<ColorInput, SceneError> {
        let id = ColorInput::Texture(self.add_texture(texture)?);
        match projection {
            None => Ok(id),
            Some((projection, from_world)) => self
                .add_texture(Texture::Projected { projection, from_world, input: id })
                .map(ColorInput::Texture),
        }
    }

    /// `mapping` and its parameters.
    pub(super) fn mapping(
        &mut self,
        params: &ParamList,
        at: &Span,
    ) -> Result<(UvMapping, Projection), SceneError> {
        let number = |name: &str, default: f32| params.float(name).map(|v| v.unwrap_or(default));
        let uv = UvMapping {
            scale: [number("uscale", 1.0)?, number("vscale", 1.0)?],
            offset: [number("udelta", 0.0)?, number("vdelta", 0.0)?],
            cross: [number("uperv", 0.0)?, number("vperu", 0.0)?],
        };
        let old = self.dialect != Dialect::V4;
        let projection = match params.string("mapping")? {
            None | Some(("uv", _)) => return Ok((uv, None)),
            Some(("spherical", _)) => TextureProjection::Spherical,
            Some(("cylindrical", _)) => TextureProjection::Cylindrical { normalize: old },
            Some(("cylindrical-v3", _)) => TextureProjection::Cylindrical { normalize: true },
            Some(("planar", _)) => {
                let vector = |name: &str, default: Vec3| {
                    Ok::<_, SceneError>(params.point3(name)?.map_or(default, |v| v.as_vec3()))
                };
                let (u, v) = (vector("v1", Vec3::X)?, vector("v2", Vec3::Y)?);
                let planar = TextureProjection::Planar { u, v, offset: uv.offset };
                // Before version 4 planes are those of the world.
                let space = if old { Affine3A::IDENTITY } else { self.texture_space(at)? };
                return Ok((UvMapping::default(), Some((planar, space))));
            }
            Some((name, param)) => {
                return Err(param
                    .value_error(0, format!("there is no mapping `{name}`"))
                    .help("mappings are uv, spherical, cylindrical and planar"));
            }
        };
        Ok((UvMapping::default(), Some((projection, self.texture_space(at)?))))
    }

    /// World space to that of the texture being made.
    fn texture_space(&self, at: &Span) -> Result<Affine3A, SceneError> {
        let flat = || SceneError::new(ErrorKind::Value, "the current transformation squashes space").at(at);
        let inverse = invert(self.state.ctm).ok_or_else(flat)?;
        let space = Affine3A::from_mat4(inverse.as_mat4());
        if space.is_finite() { Ok(space) } else { Err(flat()) }
    }

    /// World space to that of noise and cubes.
    fn noise_space(&self, at: &Span) -> Result<Affine3A, SceneError> {
        if self.dialect == Dialect::V4 {
            return self.texture_space(at);
        }
        Ok(Affine3A::from_mat4(self.state.ctm.as_mat4()))
    }

    fn noise(&mut self, class: &str, params: &ParamList) -> Result<Noise, SceneError> {
        if class == "windy" {
            return Ok(Noise::Windy);
        }
        let octaves = params.integer_in("octaves", 1..=64)?.map_or(8, i32::unsigned_abs);
        let roughness = params.float("roughness")?.unwrap_or(0.5);
        Ok(match class {
            "fbm" => Noise::Fbm { octaves, roughness },
            "wrinkled" => Noise::Wrinkled { octaves, roughness },
            _ => Noise::Marble {
                octaves,
                roughness,
                scale: params.float("scale")?.unwrap_or(1.0),
                variation: params.float("variation")?.unwrap_or(0.2),
            },
        })
    }
}
