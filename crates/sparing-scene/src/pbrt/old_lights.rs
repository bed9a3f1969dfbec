//! Strength of lights before pbrt version 4: numbers as they stand, without photometric units.
//!
//! `scale` is a colour. A sampled spectrum keeps its own brightness; a `blackbody` is 1 at its peak, wherever that is
//! (version 3; version 2 has absolute radiances, which nobody could mean).

use super::Builder;
use super::dialect::Dialect;
use super::params::{ParamList, ParamType};
use super::spectrum::Quantity;
use crate::error::SceneError;
use glam::Vec3;

impl Builder<'_> {
    /// Colour times `scale`.
    pub(super) fn old_strength(&self, params: &ParamList, name: &str) -> Result<Vec3, SceneError> {
        let factor = |name: &str| match params.get(name) {
            Some(param) if param.ty == ParamType::Integer => {
                Ok(params.float(name)?.map_or(Vec3::ONE, Vec3::splat))
            }
            Some(param) => self.color(param, Quantity::OldIlluminant),
            None => Ok(Vec3::ONE),
        };
        debug_assert!(self.dialect != Dialect::V4, "version 4 has units");
        Ok(factor(name)? * factor("scale")?)
    }
}
