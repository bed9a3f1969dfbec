//! Cameras and the lights of KHR_lights_punctual. Both look along -z of their node.

use super::Loader;
use super::json::Node;
use crate::description::{Light, Projection, SpotEdge};
use crate::error::SceneError;
use glam::{DAffine3, DVec3, Mat4, Vec3};

/// Pixels of the shorter side of a picture whose camera says its shape.
const SHORT_SIDE: f32 = 720.0;
/// Shapes beyond these make no picture.
const ASPECTS: std::ops::RangeInclusive<f32> = 0.02..=50.0;

impl<'a> Loader<'a> {
    /// Takes the first camera of the scene.
    pub(super) fn camera(&mut self, node: &Node<'a>, to_world: &DAffine3) -> Result<(), SceneError> {
        if self.has_camera {
            self.warnings.add("there are several cameras: the first one is used".to_owned());
            return Ok(());
        }
        let aspect;
        let kind = node.require("type")?;
        match kind.as_str()? {
            "perspective" => {
                let p = node.require("perspective")?;
                aspect = p.get("aspectRatio").map(|a| a.as_number().map(|v| v as f32)).transpose()?;
                let y_fov = p.require("yfov")?.as_number()? as f32;
                if !(y_fov > 1e-4 && y_fov < std::f32::consts::PI - 1e-3) {
                    return Err(p.require("yfov")?.error("the angle must be between 0 and pi"));
                }
                // Ours is that of the shorter side.
                let narrow = aspect.unwrap_or(1.0).clamp(0.0, 1.0).max(*ASPECTS.start());
                let fov = 2.0 * ((y_fov / 2.0).tan() * narrow).atan();
                self.scene.camera.projection = Projection::Perspective { fov: fov.to_degrees() };
            }
            "orthographic" => {
                let o = node.require("orthographic")?;
                let (x, y) = (o.require("xmag")?.as_number()? as f32, o.require("ymag")?.as_number()? as f32);
                if !(x.abs() > 0.0 && y.abs() > 0.0) {
                    return Err(o.error("`xmag` and `ymag` must not be 0"));
                }
                aspect = Some((x / y).abs());
                self.scene.camera.projection = Projection::Orthographic;
                self.scene.camera.screen_window = Some([-x.abs(), x.abs(), -y.abs(), y.abs()]);
            }
            _ => return Err(kind.error("cameras are perspective or orthographic")),
        }
        let axes = [to_world.matrix3.x_axis, to_world.matrix3.y_axis, -to_world.matrix3.z_axis];
        let axes = axes.map(|axis| axis.normalize_or_zero().as_vec3());
        if axes.contains(&Vec3::ZERO) {
            return Err(node.error("its node squashes space"));
        }
        let [x, y, z] = axes.map(|axis| axis.extend(0.0));
        let eye = to_world.translation.as_vec3().extend(1.0);
        self.scene.camera.camera_to_world = Mat4::from_cols(x, y, z, eye);
        if let Some(aspect) = aspect.filter(|aspect| aspect.is_finite() && *aspect > 0.0) {
            let aspect = aspect.clamp(*ASPECTS.start(), *ASPECTS.end());
            let (width, height) = (SHORT_SIDE * aspect.max(1.0), SHORT_SIDE / aspect.min(1.0));
            self.scene.film.width = width.round() as u32;
            self.scene.film.height = height.round() as u32;
        }
        self.has_camera = true;
        Ok(())
    }

    /// Adds a light: 1 cd is a radiant intensity of luminance 1, 1 lx an irradiance of luminance 1.
    pub(super) fn light(&mut self, node: &Node<'a>, to_world: &DAffine3) -> Result<(), SceneError> {
        let lights =
            self.root.extension("KHR_lights_punctual").ok_or_else(|| node.error("the file has no lights"))?;
        let (_, light) =
            node.named("light", &lights, "lights")?.ok_or_else(|| node.error("`light` is missing"))?;
        let strength = light.color("color", Vec3::ONE)? * light.number("intensity", 1.0)?.max(0.0);
        if !strength.is_finite() {
            return Err(light.error("its intensity is not finite"));
        }
        let position = to_world.translation.as_vec3();
        let direction = to_world.transform_vector3(DVec3::NEG_Z).normalize_or_zero().as_vec3();
        if direction == Vec3::ZERO || !position.is_finite() {
            return Err(node.error("its node squashes space"));
        }
        if light.get("range").is_some() {
            // A hint where to cut off (KHR_lights_punctual), which light that is transported has no use for.
            let message = format!(
                "{}: its `range` is ignored, light falls off with the square of the distance",
                light.path
            );
            self.warnings.add(message);
        }
        let kind = light.require("type")?;
        let light = match kind.as_str()? {
            "point" => Light::Point { position, intensity: strength },
            "directional" => Light::Distant { direction, irradiance: strength },
            "spot" => {
                let (inner, outer) = match light.get("spot") {
                    None => (0.0, std::f32::consts::FRAC_PI_4),
                    Some(spot) => (
                        spot.number("innerConeAngle", 0.0)?,
                        spot.number("outerConeAngle", std::f32::consts::FRAC_PI_4)?,
                    ),
                };
                if !(outer > 0.0
                    && outer <= std::f32::consts::FRAC_PI_2 + 1e-5
                    && (0.0..=outer).contains(&inner))
                {
                    return Err(
                        light.error("its angles must be 0 <= inner <= outer <= pi/2 and outer above 0")
                    );
                }
                let cone_angle = outer.to_degrees();
                let cone_delta = (outer - inner).to_degrees().clamp(0.0, cone_angle);
                let edge = SpotEdge::Square;
                Light::Spot { position, direction, intensity: strength, cone_angle, cone_delta, edge }
            }
            _ => return Err(kind.error("lights are point, spot and directional")),
        };
        self.count_entity()?;
        self.scene.lights.push(light);
        self.lit_by_itself = true;
        Ok(())
    }
}
