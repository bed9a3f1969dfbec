//! What happens where a path meets a surface.

use super::RenderSettings;
use crate::counters::{Counter, count};
use crate::materials::{Bsdf, Material, ShadingInput};
use crate::needs::Needs;
use crate::sampling::Frame;
use crate::scene::Scene;
use crate::scene::surface::SurfacePoint;
use crate::texture::{Color, Scalar, TexturePoint};
use glam::Vec3;

/// A path vertex ready for scattering.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub frame: Frame,
    pub bsdf: Bsdf,
    /// Local direction back along the path; z > 0.
    pub wo: Vec3,
    /// Geometric normal on the side of `wo`.
    pub ng: Vec3,
}

impl Vertex {
    /// A place holder.
    pub const NONE: Self = Self {
        frame: Frame { x: Vec3::X, y: Vec3::Y, z: Vec3::Z },
        bsdf: Bsdf::Interface,
        wo: Vec3::Z,
        ng: Vec3::Z,
    };
}

/// Cosine to which shading normals are bent towards the viewer where they point away.
const MIN_COS: f32 = 1e-3;

impl Scene {
    /// The vertex at a point of `shape` seen along `-wo` (unit, world, away from the surface).
    #[inline]
    pub(super) fn vertex<const NEEDS: u32>(
        &self,
        shape: u32,
        surface: &SurfacePoint,
        wo: Vec3,
        choice: f32,
    ) -> Vertex {
        let needs = Needs::from_bits_retain(NEEDS);
        let front = surface.ng.dot(wo) >= 0.0;
        let material_id = self.shapes[shape as usize].material;
        let input = ShadingInput { uv: surface.texture_point(), front, choice, color: surface.color };
        let (bsdf, material) = self.materials.bsdf(material_id, &self.textures, input);
        let mut ns = surface.ns;
        if needs.contains(Needs::NORMAL_MAPS) && (material.normal_map.is_some() || material.bump.is_some()) {
            count(Counter::NormalMap);
            ns = self.perturbed_normal(surface, material);
        }
        let (ng, mut ns) = if front { (surface.ng, ns) } else { (-surface.ng, -ns) };
        // A shading normal that faces away would make black edges: it is bent until it just faces the viewer.
        let cos = ns.dot(wo);
        if cos < MIN_COS {
            ns = (ns + wo * (MIN_COS - cos)).normalize_or(ng);
        }
        let frame = if needs.contains(Needs::TANGENTS) {
            Frame::from_z_and_tangent(ns, surface.dpdu)
        } else {
            Frame::from_z(ns)
        };
        let mut local = frame.to_local(wo);
        local.z = local.z.max(1e-6);
        Vertex { frame, bsdf, wo: local, ng }
    }

    #[cold]
    fn perturbed_normal(&self, s: &SurfacePoint, material: &Material) -> Vec3 {
        let mut ns = s.ns;
        if let Some(bump) = material.bump {
            ns = self.bumped_normal(s, ns, bump);
        }
        if let Some(map) = material.normal_map {
            let n = match map {
                Color::Constant(v) => v,
                texture => self.textures.eval_color(texture, s.texture_point()),
            } * 2.0
                - 1.0;
            let frame = Frame::from_z_and_tangent(ns, s.dpdu);
            // The bitangent follows dp/dv, so mirrored texture coordinates turn the map the right way.
            let y = if frame.y.dot(s.dpdv) < 0.0 { -frame.y } else { frame.y };
            let mapped = frame.x * n.x + y * n.y + frame.z * n.z;
            ns = mapped.normalize_or(ns);
        }
        if ns.dot(s.ng) <= 0.0 { s.ng } else { ns }
    }

    /// Normal of the surface displaced by a height texture (J. Blinn 1978), by forward differences.
    fn bumped_normal(&self, s: &SurfacePoint, ns: Vec3, bump: Scalar) -> Vec3 {
        const STEP: f32 = 5e-4;
        let at = |du: f32, dv: f32| {
            let (uv, p) = ([s.uv[0] + du, s.uv[1] + dv], s.p + s.dpdu * du + s.dpdv * dv);
            self.textures.eval_scalar(bump, TexturePoint { uv, p, ..s.texture_point() })
        };
        let height = at(0.0, 0.0);
        let (du, dv) = ((at(STEP, 0.0) - height) / STEP, (at(0.0, STEP) - height) / STEP);
        let (dpdu, dpdv) = (s.dpdu + ns * du, s.dpdv + ns * dv);
        let n = dpdu.cross(dpdv);
        let n = if n.dot(ns) < 0.0 { -n } else { n };
        n.normalize_or(ns)
    }
}

impl Vertex {
    /// Whether a world direction lies on the side of the surface that its local direction says: light must not
    /// leak through where shading and geometric normals disagree.
    #[inline]
    pub fn is_consistent(&self, wi_world: Vec3, wi_local: Vec3) -> bool {
        self.ng.dot(wi_world) * wi_local.z > 0.0
    }
}

/// Survival probability of a path of this throughput (already corrected for refraction), or 1.
#[inline]
pub(super) fn survival(settings: &RenderSettings, depth: u32, throughput: Vec3) -> f32 {
    if depth < settings.roulette_depth { 1.0 } else { throughput.max_element().clamp(0.02, 1.0) }
}
