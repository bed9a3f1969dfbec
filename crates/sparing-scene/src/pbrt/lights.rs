//! `LightSource` and `AreaLightSource`, with pbrt-v4's photometry.
//!
//! Colours: see [`super::spectrum`]. `scale` multiplies. `power` (in W of luminance 1) replaces the strength so
//! that the whole light emits it: a point light by 4 pi, a spot by the solid angle of its cone, a surface by
//! pi times its area and sides. `illuminance` does the same for distant (facing the light) and constant
//! infinite lights (a patch under the whole sky: pi). A coloured `rgb` keeps its own luminance as a factor, as
//! in pbrt. The power of a surface is that of the whole `Shape`; pbrt-v4 gives it to each triangle.

use super::Builder;
use super::graphics_state::AreaLight;
use super::params::{ParamList, ParamType};
use super::spectrum::{self, Quantity};
use crate::description::{Light, TextureEncoding};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;
use glam::{DVec3, Mat3, Vec3};
use std::f32::consts::PI;

const TYPES: &[&str] = &["point", "spot", "distant", "infinite"];

impl Builder<'_> {
    /// `LightSource "type" parameters`.
    pub(super) fn light_source(
        &mut self,
        ty: &str,
        at: &Span,
        mut params: ParamList,
    ) -> Result<(), SceneError> {
        params.add_defaults(&self.state.light_defaults);
        self.count_entity()?;
        let light = match ty {
            "point" => self.point(&params)?,
            "spot" => self.spot(&params, at)?,
            "distant" => self.distant(&params, at)?,
            "infinite" => self.infinite(&params, at)?,
            "goniometric" | "projection" => {
                let error =
                    SceneError::new(ErrorKind::Unsupported, format!("{ty} lights are not supported yet"));
                return Err(error.at(at));
            }
            other => {
                let error = SceneError::new(ErrorKind::Unknown, format!("there is no light type `{other}`"));
                let help = "known are: ".to_owned() + &TYPES.join(", ");
                return Err(error.at(at).help(help).maybe_help(did_you_mean(other, TYPES.iter().copied())));
            }
        };
        params.warn_unused(&format!("light `{ty}`"), &mut self.warnings);
        if self.object.is_some() {
            self.warnings.at(at, "a light inside an object definition is ignored");
            return Ok(());
        }
        self.scene.lights.push(light);
        Ok(())
    }

    /// Colour times `scale`.
    fn strength(&self, params: &ParamList, name: &str) -> Result<Vec3, SceneError> {
        let scale = params.float_where("scale", 1.0, "not negative", |s| s >= 0.0)?;
        let color = match params.get(name) {
            Some(param) => spectrum::color(param, Quantity::Illuminant, &self.base, self.options)?,
            None => Vec3::ONE,
        };
        Ok(color * scale)
    }

    /// A positive target such as `power`; pbrt takes values of 0 or less as not given.
    fn target(params: &ParamList, name: &str) -> Result<Option<f32>, SceneError> {
        Ok(params.float(name)?.filter(|value| *value > 0.0))
    }

    fn point(&self, params: &ParamList) -> Result<Light, SceneError> {
        let mut intensity = self.strength(params, "I")?;
        if let Some(power) = Self::target(params, "power")? {
            intensity *= power / (4.0 * PI);
        }
        let from = params.point3("from")?.unwrap_or_default();
        Ok(Light::Point { position: self.world_point(from), intensity })
    }

    fn spot(&self, params: &ParamList, at: &Span) -> Result<Light, SceneError> {
        let mut intensity = self.strength(params, "I")?;
        let in_range = |angle: f32| angle > 0.0 && angle <= 180.0;
        let cone_angle = params.float_where("coneangle", 30.0, "above 0 and at most 180", in_range)?;
        let not_wider = |delta: f32| (0.0..=cone_angle).contains(&delta);
        let cone_delta = params.float_where(
            "conedeltaangle",
            cone_angle.min(5.0),
            "from 0 to the cone angle",
            not_wider,
        )?;
        if let Some(power) = Self::target(params, "power")? {
            let end = cone_angle.to_radians().cos();
            let start = (cone_angle - cone_delta).to_radians().cos();
            intensity *= power / (2.0 * PI * ((1.0 - start) + (start - end) / 2.0));
        }
        let from = params.point3("from")?.unwrap_or_default();
        let to = params.point3("to")?.unwrap_or(DVec3::Z);
        let direction = self.world_direction(to - from, at)?;
        Ok(Light::Spot { position: self.world_point(from), direction, intensity, cone_angle, cone_delta })
    }

    fn distant(&self, params: &ParamList, at: &Span) -> Result<Light, SceneError> {
        let mut irradiance = self.strength(params, "L")?;
        if let Some(illuminance) = Self::target(params, "illuminance")? {
            irradiance *= illuminance;
        }
        let from = params.point3("from")?.unwrap_or_default();
        let to = params.point3("to")?.unwrap_or(DVec3::Z);
        Ok(Light::Distant { direction: self.world_direction(to - from, at)?, irradiance })
    }

    fn infinite(&mut self, params: &ParamList, at: &Span) -> Result<Light, SceneError> {
        let mut radiance = self.strength(params, "L")?;
        let has_file = params.get("filename").is_some();
        if has_file && let Some(color) = params.get("L") {
            return Err(color.error("an infinite light has either `L` or `filename`"));
        }
        if let Some(illuminance) = Self::target(params, "illuminance")? {
            if has_file {
                self.warnings.at(at, "`illuminance` of a light with a picture is not supported and ignored");
            } else {
                radiance *= illuminance / PI;
            }
        }
        let image =
            if has_file { Some(self.image(params, "filename", TextureEncoding::Auto, at)?) } else { None };
        if let Some(portal) = params.get("portal") {
            self.warnings.at(&portal.span, "portals are not supported and ignored");
        }
        Ok(Light::Environment { radiance, image, light_to_world: self.light_frame(at)? })
    }

    /// The rotation (and mirroring) of the current transformation.
    fn light_frame(&mut self, at: &Span) -> Result<Mat3, SceneError> {
        let m = self.state.ctm;
        let flat = || SceneError::new(ErrorKind::Value, "the current transformation squashes space").at(at);
        let x = m.x_axis.truncate().try_normalize().ok_or_else(flat)?;
        let given_y = m.y_axis.truncate().try_normalize().ok_or_else(flat)?;
        let given_z = m.z_axis.truncate().try_normalize().ok_or_else(flat)?;
        let y = (given_y - x * x.dot(given_y)).try_normalize().ok_or_else(flat)?;
        let cross = x.cross(y);
        let z = if cross.dot(given_z) < 0.0 { -cross } else { cross };
        if !(y.abs_diff_eq(given_y, 1e-4) && z.abs_diff_eq(given_z, 1e-4)) {
            self.warnings.at(at, "the shear of this infinite light's transformation is ignored");
        }
        Ok(Mat3::from_cols(x.as_vec3(), y.as_vec3(), z.as_vec3()))
    }

    fn world_point(&self, p: DVec3) -> Vec3 {
        self.state.ctm.transform_point3(p).as_vec3()
    }

    fn world_direction(&self, v: DVec3, at: &Span) -> Result<Vec3, SceneError> {
        let direction = self.state.ctm.transform_vector3(v).try_normalize();
        let error = || SceneError::new(ErrorKind::Value, "`from` and `to` must be different points").at(at);
        Ok(direction.ok_or_else(error)?.as_vec3())
    }

    /// `AreaLightSource "diffuse" parameters`, for the shapes that follow.
    pub(super) fn area_light_source(
        &mut self,
        ty: &str,
        at: &Span,
        mut params: ParamList,
    ) -> Result<(), SceneError> {
        params.add_defaults(&self.state.light_defaults);
        if ty != "diffuse" {
            let error = SceneError::new(ErrorKind::Unknown, format!("there is no area light type `{ty}`"));
            return Err(error.at(at).help("the only type is `diffuse`"));
        }
        let is_texture = params.get("L").is_some_and(|param| param.ty == ParamType::Texture);
        let texture = match is_texture {
            true => Some(self.color_input(&params, "L", Vec3::ZERO, Quantity::Unbounded)?),
            false => None,
        };
        let radiance = if is_texture { Vec3::ONE } else { self.strength(&params, "L")? };
        if let Some(file) = params.get("filename") {
            self.warnings.at(&file.span, "the picture of an area light is not supported and ignored");
        }
        let power = Self::target(&params, "power")?;
        let two_sided = params.bool("twosided")?.unwrap_or(false);
        params.warn_unused("the area light", &mut self.warnings);
        self.state.area_light = Some(AreaLight { radiance, texture, power, two_sided, span: at.clone() });
        Ok(())
    }
}
