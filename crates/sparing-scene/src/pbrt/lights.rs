//! `LightSource` and `AreaLightSource`, with pbrt-v4's photometry.
//!
//! Colours: see [`super::spectrum`]. `scale` multiplies. `power` (in W of luminance 1) replaces the strength so
//! that the whole light emits it: a point light by 4 pi, a spot by the solid angle of its cone, a surface by
//! pi times its area and sides. `illuminance` does the same for distant (facing the light) and constant
//! infinite lights (a patch under the whole sky: pi). A coloured `rgb` keeps its own luminance as a factor, as
//! in pbrt. The power of a surface is that of the whole `Shape`; pbrt-v4 gives it to each triangle.

use super::Builder;
use super::dialect::Dialect;
use super::graphics_state::AreaLight;
use super::params::{ParamList, ParamType};
use super::spectrum::Quantity;
use crate::description::{
    ColorInput, EnvironmentImage, ImageId, Light, SphereMapping, SpotEdge, Texture, TextureEncoding,
    TextureId, UvMapping, Wrap,
};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;
use glam::{DVec3, Mat3, Vec3};
use std::f32::consts::PI;

const TYPES: &[&str] = &["point", "spot", "distant", "infinite", "goniometric", "projection"];

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
            "exinfinite" if self.dialect == Dialect::V2 => self.infinite(&params, at)?,
            "goniometric" => self.goniometric(&params, at)?,
            "projection" => self.projection(&params, at)?,
            other => {
                let error = SceneError::new(ErrorKind::Unknown, format!("there is no light type `{other}`"));
                let help = "known are: ".to_owned() + &TYPES.join(", ");
                return Err(error.at(at).help(help).maybe_help(did_you_mean(other, TYPES.iter().copied())));
            }
        };
        params.warn_unused(&format!("light `{ty}`"), &mut self.warnings);
        if self.state.end().is_some() {
            self.warnings.at(at, "a light that moves stands still where it starts");
        }
        if self.object.is_some() {
            self.warnings.at(at, "a light inside an object definition is ignored");
            return Ok(());
        }
        self.scene.lights.push(light);
        Ok(())
    }

    /// Colour times `scale`.
    pub(super) fn strength(&self, params: &ParamList, name: &str) -> Result<Vec3, SceneError> {
        if self.dialect != Dialect::V4 {
            return self.old_strength(params, name);
        }
        let scale = params.float_where("scale", 1.0, "not negative", |s| s >= 0.0)?;
        let color = match params.get(name) {
            Some(param) => self.color(param, Quantity::Illuminant)?,
            None => Vec3::ONE,
        };
        Ok(color * scale)
    }

    /// A positive target such as `power`; pbrt takes values of 0 or less as not given.
    pub(super) fn target(params: &ParamList, name: &str) -> Result<Option<f32>, SceneError> {
        Ok(params.float(name)?.filter(|value| *value > 0.0))
    }

    /// The picture of a light, called `filename`, or `mapname` before version 4.
    fn light_image(&mut self, params: &ParamList, at: &Span) -> Result<Option<ImageId>, SceneError> {
        for name in ["filename", "mapname"] {
            match params.string(name)? {
                Some(("", _)) | None => {}
                Some(_) if self.lacks_picture(params, name)? => return Ok(None),
                Some(_) => return self.image(params, name, TextureEncoding::Auto, at).map(Some),
            }
        }
        Ok(None)
    }

    /// How the picture of a light covers the sphere: `mapping` is an extension; versions before 4 have latitude and
    /// longitude.
    fn sphere_mapping(&self, params: &ParamList, v4: SphereMapping) -> Result<SphereMapping, SceneError> {
        Ok(match params.string("mapping")? {
            Some(("latlong", _)) => SphereMapping::LatLong,
            Some(("equalarea", _)) => SphereMapping::EqualArea,
            Some((name, param)) => {
                let error = param.value_error(0, format!("there is no mapping `{name}`"));
                return Err(error.help("mappings of lights are latlong and equalarea"));
            }
            None if self.dialect == Dialect::V4 => v4,
            None => SphereMapping::LatLong,
        })
    }

    fn goniometric(&mut self, params: &ParamList, at: &Span) -> Result<Light, SceneError> {
        let intensity = self.strength(params, "I")?;
        let image = self.light_image(params, at)?;
        if image.is_none() {
            self.warnings.at(at, "a goniometric light without a picture is a point light");
        }
        let mapping = self.sphere_mapping(params, SphereMapping::EqualArea)?;
        // The pole of the picture is the y axis of the light.
        let swap = Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::Y);
        Ok(Light::Goniometric {
            position: self.world_point(DVec3::ZERO),
            intensity,
            image,
            mapping,
            power: Self::target(params, "power")?,
            light_to_world: self.light_frame(at)? * swap,
        })
    }

    fn projection(&mut self, params: &ParamList, at: &Span) -> Result<Light, SceneError> {
        let v4 = self.dialect == Dialect::V4;
        let intensity = if v4 {
            Vec3::splat(params.float_where("scale", 1.0, "not negative", |s| s >= 0.0)?)
        } else {
            self.strength(params, "I")?
        };
        let image = self.light_image(params, at)?;
        if image.is_none() && v4 {
            return Err(super::missing("filename", "string", at));
        }
        let inside = |fov: f32| fov > 0.0 && fov < 180.0;
        let fov = params.float_where("fov", if v4 { 90.0 } else { 45.0 }, "between 0 and 180", inside)?;
        // Version 4 has the picture upright, older ones upside down.
        let flip = if v4 { Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0)) } else { Mat3::IDENTITY };
        Ok(Light::Projection {
            position: self.world_point(DVec3::ZERO),
            intensity,
            image,
            fov,
            power: Self::target(params, "power")?,
            light_to_world: self.light_frame(at)? * flip,
        })
    }

    fn point(&self, params: &ParamList) -> Result<Light, SceneError> {
        let mut intensity = self.strength(params, "I")?;
        if let Some(power) = Self::target(params, "power")? {
            intensity *= power / (4.0 * PI);
        }
        let from = params.point3("from")?.unwrap_or_default();
        Ok(Light::Point { position: self.world_point(from), intensity })
    }

    fn spot(&mut self, params: &ParamList, at: &Span) -> Result<Light, SceneError> {
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
            // As in pbrt-v4, whose smooth step integrates to half of the ring.
            let end = cone_angle.to_radians().cos();
            let start = (cone_angle - cone_delta).to_radians().cos();
            intensity *= power / (2.0 * PI * ((1.0 - start) + (start - end) / 2.0));
        }
        let edge = match params.string("falloff")? {
            Some(("smooth", _)) => SpotEdge::Smooth,
            Some(("square", _)) => SpotEdge::Square,
            Some(("fourth", _)) => SpotEdge::Fourth,
            Some((name, param)) => {
                let error = param.value_error(0, format!("there is no fall-off `{name}`"));
                return Err(error.help("fall-offs of spot lights are smooth, square and fourth"));
            }
            None if self.dialect == Dialect::V4 => SpotEdge::Smooth,
            None => SpotEdge::Fourth,
        };
        let from = params.point3("from")?.unwrap_or_default();
        let to = params.point3("to")?.unwrap_or(DVec3::Z);
        let direction = self.world_direction(to - from, at)?;
        let position = self.world_point(from);
        Ok(Light::Spot { position, direction, intensity, cone_angle, cone_delta, edge })
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
        let image = self.light_image(params, at)?;
        let v4 = self.dialect == Dialect::V4;
        if v4
            && image.is_some()
            && let Some(color) = params.get("L")
        {
            return Err(color.error("an infinite light has either `L` or `filename`"));
        }
        let illuminance = Self::target(params, "illuminance")?;
        if let (Some(illuminance), None) = (illuminance, image) {
            radiance *= illuminance / PI;
        }
        let mapping = self.sphere_mapping(params, SphereMapping::Auto)?;
        let image = image.map(|image| EnvironmentImage { image, mapping, illuminance });
        if let Some(portal) = params.get("portal") {
            self.warnings.at(&portal.span, "portals are not supported and ignored");
        }
        params.ignore(&["nsamples", "samples"]);
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
        // `area` before version 4.
        if !matches!(ty, "diffuse" | "area") {
            let error = SceneError::new(ErrorKind::Unknown, format!("there is no area light type `{ty}`"));
            return Err(error.at(at).help("the only type is `diffuse`"));
        }
        let is_texture = params.get("L").is_some_and(|param| param.ty == ParamType::Texture);
        let power = Self::target(&params, "power")?;
        let texture = match self.light_picture(&params, at, power)? {
            Some(picture) => Some(ColorInput::Texture(picture)),
            None if is_texture => Some(self.color_input(&params, "L", Vec3::ZERO, Quantity::Unbounded)?),
            None => None,
        };
        let radiance = if texture.is_some() { Vec3::ONE } else { self.strength(&params, "L")? };
        let two_sided = params.bool("twosided")?.unwrap_or(false);
        params.ignore(&["nsamples", "samples"]);
        params.warn_unused("the area light", &mut self.warnings);
        self.state.area_light = Some(AreaLight { radiance, texture, power, two_sided, span: at.clone() });
        Ok(())
    }

    /// The picture of an area light, as a texture.
    fn light_picture(
        &mut self,
        params: &ParamList,
        at: &Span,
        power: Option<f32>,
    ) -> Result<Option<TextureId>, SceneError> {
        if let (Some(color), Some(_)) = (params.get("L"), params.get("filename")) {
            return Err(color.error("an area light has either `L` or `filename`"));
        }
        let Some(image) = self.light_image(params, at)? else { return Ok(None) };
        if power.is_some() {
            self.warnings.at(at, "`power` of an area light with a picture is not supported and ignored");
        }
        let scale = params.float_where("scale", 1.0, "not negative", |s| s >= 0.0)?;
        let mapping = UvMapping::default();
        let texture = Texture::Image { image, mapping, wrap: [Wrap::Clamp; 2], scale, invert: false };
        self.add_texture(texture).map(Some)
    }
}
