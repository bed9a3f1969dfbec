//! The own material `metallicroughness`: the model of glTF 2.0.

use super::Builder;
use super::params::ParamList;
use super::spectrum::Quantity;
use crate::description::{MaterialKind, MetallicRoughness};
use crate::error::SceneError;
use glam::Vec3;

impl Builder<'_> {
    pub(super) fn metallic_roughness(&self, params: &ParamList) -> Result<MaterialKind, SceneError> {
        let color = |name, quantity| self.color_input(params, name, Vec3::ONE, quantity);
        let number = |name, default| self.float_input(params, name, default);
        Ok(MaterialKind::MetallicRoughness(MetallicRoughness {
            base_color: color("basecolor", Quantity::Albedo)?,
            metallic: number("metallic", 0.0)?,
            roughness: number("roughness", 1.0)?,
            eta: params.float_where("eta", 1.5, "from 0 to 10", |eta| (0.0..=10.0).contains(&eta))?,
            specular: number("specular", 1.0)?,
            specular_color: color("specularcolor", Quantity::Unbounded)?,
            transmission: number("transmission", 0.0)?,
            clearcoat: number("clearcoat", 0.0)?,
            clearcoat_roughness: number("clearcoatroughness", 0.0)?,
            vertex_colors: params.bool("vertexcolors")?.unwrap_or(false),
        }))
    }
}
