//! Materials of a scene, compiled: what does not vary over a surface is computed once.

use super::coated_diffuse::CoatTable;
use super::metallic_roughness::Inputs;
use super::{
    Bsdf, CoatedConductor, Conductor, Dielectric, Diffuse, DiffuseTransmission, Mirror, OrenNayar, Substrate,
    ThinDielectric, Uber,
};
use crate::materials::microfacet::Ggx;
use crate::needs::Needs;
use crate::texture::{Color, Scalar, TexturePoint, TextureTable};
use glam::Vec3;
use sparing_scene::description::{self as d, MaterialKind};
use std::sync::Arc;

/// Where and how a material is looked up.
#[derive(Clone, Copy, Debug)]
pub struct ShadingInput {
    /// Texture coordinates and position.
    pub uv: TexturePoint,
    /// Whether `wo` is on the side of the geometric normal.
    pub front: bool,
    /// Uniform in [0, 1): which material of a mix.
    pub choice: f32,
    /// Colour of the vertices around, white where they have none.
    pub color: Vec3,
}

/// A compiled material.
#[derive(Clone, Debug)]
pub struct Material {
    model: Model,
    /// Texture of tangent-space normals.
    pub normal_map: Option<Color>,
    /// Texture of heights.
    pub bump: Option<Scalar>,
}

#[derive(Clone, Debug)]
enum Model {
    /// Nothing varies: seen from the front, from the back.
    Fixed([Bsdf; 2]),
    Diffuse(Color),
    Conductor {
        substance: Substance,
        roughness: Roughness,
    },
    Dielectric {
        eta: f32,
        tint: Color,
        roughness: Roughness,
    },
    CoatedDiffuse {
        reflectance: Color,
        coat: Arc<CoatTable>,
        roughness: Roughness,
    },
    DiffuseTransmission {
        reflectance: Color,
        transmittance: Color,
    },
    Mix {
        materials: [u32; 2],
        amount: Scalar,
    },
    OrenNayar {
        reflectance: Color,
        sigma: Scalar,
    },
    Mirror(Color),
    Uber {
        /// Matte, glossy, mirror, refraction.
        factors: [Color; 4],
        eta: f32,
        roughness: Roughness,
    },
    Substrate {
        diffuse: Color,
        specular: Color,
        roughness: Roughness,
    },
    CoatedConductor {
        substance: Substance,
        roughness: Roughness,
        eta: f32,
        coat_roughness: Roughness,
    },
    MetallicRoughness(Box<Inputs>),
}

#[derive(Clone, Copy, Debug)]
enum Substance {
    EtaK(Color, Color),
    Reflectance(Color),
}

#[derive(Clone, Copy, Debug)]
struct Roughness {
    u: Scalar,
    v: Scalar,
    remap: bool,
}

impl Roughness {
    fn ggx(&self, textures: &TextureTable, uv: TexturePoint) -> Ggx {
        let alpha = |s| {
            let r = textures.eval_scalar(s, uv);
            if self.remap { r.max(0.0).sqrt() } else { r }
        };
        Ggx::new(alpha(self.u), alpha(self.v))
    }

    fn is_constant(&self) -> bool {
        matches!((self.u, self.v), (Scalar::Constant(_), Scalar::Constant(_)))
    }
}

/// Tables of coats, one for each index of refraction.
#[derive(Debug, Default)]
struct Coats(Vec<(f32, Arc<CoatTable>)>);

impl Coats {
    fn get(&mut self, eta: f32) -> Arc<CoatTable> {
        if let Some((_, table)) = self.0.iter().find(|c| c.0 == eta) {
            return Arc::clone(table);
        }
        let table = Arc::new(CoatTable::new(eta));
        self.0.push((eta, Arc::clone(&table)));
        table
    }
}

/// All materials of a scene.
#[derive(Clone, Debug, Default)]
pub struct MaterialTable {
    materials: Vec<Material>,
}

impl MaterialTable {
    /// Compiles the materials of a scene.
    #[must_use]
    pub fn new(materials: &[d::Material], textures: &TextureTable) -> Self {
        let mut coats = Coats::default();
        Self { materials: materials.iter().map(|m| Material::new(m, textures, &mut coats)).collect() }
    }

    /// The material with an index.
    #[inline]
    #[must_use]
    pub fn get(&self, id: u32) -> &Material {
        &self.materials[id as usize]
    }

    /// The BSDF of material `id` at a point, and the material that a mix chose.
    #[inline]
    #[must_use]
    pub fn bsdf(&self, id: u32, textures: &TextureTable, input: ShadingInput) -> (Bsdf, &Material) {
        let mut material = self.get(id);
        let mut input = input;
        // Loaders refuse cyclic mixes; the bound is for descriptions made by hand.
        for _ in 0..16 {
            let Model::Mix { materials, amount } = &material.model else { break };
            let t = textures.eval_scalar(*amount, input.uv).clamp(0.0, 1.0);
            let second = input.choice < t;
            input.choice = if second { input.choice / t } else { (input.choice - t) / (1.0 - t) };
            material = self.get(materials[usize::from(second)]);
        }
        (material.model.bsdf(textures, input), material)
    }

    /// What material `id` asks of the integrator.
    #[must_use]
    pub fn needs(&self, id: u32) -> Needs {
        self.needs_to_depth(id, 16)
    }

    fn needs_to_depth(&self, id: u32, depth: u32) -> Needs {
        let m = self.get(id);
        let mut needs = Needs::empty();
        needs.set(Needs::NORMAL_MAPS, m.normal_map.is_some() || m.bump.is_some());
        needs.set(Needs::TANGENTS, needs.contains(Needs::NORMAL_MAPS) || m.is_anisotropic());
        needs.set(Needs::TEXTURE_COORDINATES, m.varies() || needs.contains(Needs::NORMAL_MAPS));
        match &m.model {
            Model::Fixed([Bsdf::Diffuse(_) | Bsdf::Conductor(_) | Bsdf::Interface, _]) => {}
            Model::Fixed([Bsdf::OrenNayar(_) | Bsdf::Mirror(_), _]) => {}
            Model::Diffuse(_) | Model::Conductor { .. } | Model::OrenNayar { .. } | Model::Mirror(_) => {}
            Model::Fixed([b, _]) => {
                needs |= Needs::CHOICE;
                needs.set(Needs::TRANSMISSION, b.is_transmissive());
            }
            Model::Dielectric { .. } | Model::DiffuseTransmission { .. } => {
                needs |= Needs::CHOICE | Needs::TRANSMISSION;
            }
            Model::Uber { factors, .. } => {
                needs |= Needs::CHOICE;
                needs.set(Needs::TRANSMISSION, factors[3] != Color::Constant(Vec3::ZERO));
            }
            Model::Mix { materials, .. } => {
                needs |= Needs::CHOICE | Needs::MIXES;
                if depth > 0 {
                    for id in materials {
                        needs |= self.needs_to_depth(*id, depth - 1);
                    }
                }
            }
            Model::MetallicRoughness(inputs) => {
                needs |= Needs::CHOICE;
                needs.set(Needs::TRANSMISSION, inputs.is_transmissive());
                needs.set(Needs::VERTEX_COLORS, inputs.uses_vertex_colors());
            }
            _ => needs |= Needs::CHOICE,
        }
        needs
    }

    /// Whether no light sample can contribute at material `id`.
    #[must_use]
    pub fn is_all_delta(&self, id: u32) -> bool {
        matches!(&self.get(id).model, Model::Fixed([a, b]) if a.is_all_delta() && b.is_all_delta())
    }

    /// Whether material `id` is nothing at all.
    #[must_use]
    pub fn is_interface(&self, id: u32) -> bool {
        matches!(self.get(id).model, Model::Fixed([Bsdf::Interface, _]))
    }
}

impl Material {
    fn new(m: &d::Material, textures: &TextureTable, coats: &mut Coats) -> Self {
        let model = Model::new(&m.kind, textures, coats);
        let normal_map = m.normal_map.map(|t| textures.color(d::ColorInput::Texture(t)));
        let bump = m.bump.map(|t| textures.scalar(d::FloatInput::Texture(t)));
        // A constant height changes nothing.
        let bump = bump.filter(|b| matches!(b, Scalar::Texture(_)));
        Self { model, normal_map, bump }
    }

    fn is_anisotropic(&self) -> bool {
        match &self.model {
            Model::Fixed(sides) => sides.iter().any(Bsdf::is_anisotropic),
            Model::Conductor { roughness, .. }
            | Model::Dielectric { roughness, .. }
            | Model::CoatedDiffuse { roughness, .. }
            | Model::Uber { roughness, .. }
            | Model::Substrate { roughness, .. } => roughness.u != roughness.v,
            Model::CoatedConductor { roughness, coat_roughness, .. } => {
                roughness.u != roughness.v || coat_roughness.u != coat_roughness.v
            }
            _ => false,
        }
    }

    fn varies(&self) -> bool {
        match &self.model {
            Model::Fixed(_) => false,
            Model::Mix { amount, .. } => matches!(amount, Scalar::Texture(_)),
            _ => true,
        }
    }
}

impl Model {
    fn new(kind: &MaterialKind, textures: &TextureTable, coats: &mut Coats) -> Self {
        let roughness =
            |r: &d::Roughness| Roughness { u: textures.scalar(r.u), v: textures.scalar(r.v), remap: r.remap };
        let color = |c: &d::ColorInput| textures.color(*c);
        let fixed = |c: Color| matches!(c, Color::Constant(_));
        let substance = |conductor: &d::Conductor| match conductor {
            d::Conductor::EtaK { eta, k } => {
                let (eta, k) = (color(eta), color(k));
                (Substance::EtaK(eta, k), fixed(eta) && fixed(k))
            }
            d::Conductor::Reflectance(c) => {
                let c = color(c);
                (Substance::Reflectance(c), fixed(c))
            }
        };
        let (model, is_fixed) = match kind {
            MaterialKind::Diffuse { reflectance } => {
                let c = color(reflectance);
                (Self::Diffuse(c), fixed(c))
            }
            MaterialKind::Conductor { conductor, roughness: r } => {
                let (substance, constant) = substance(conductor);
                let roughness = roughness(r);
                (Self::Conductor { substance, roughness }, constant && roughness.is_constant())
            }
            MaterialKind::Dielectric { eta, roughness: r, tint } => {
                let (roughness, tint) = (roughness(r), color(tint));
                (Self::Dielectric { eta: *eta, tint, roughness }, fixed(tint) && roughness.is_constant())
            }
            MaterialKind::ThinDielectric { eta } => {
                let b = Bsdf::ThinDielectric(ThinDielectric { eta: *eta });
                return Self::Fixed([b, b]);
            }
            MaterialKind::CoatedDiffuse { reflectance, roughness: r, eta } => {
                let (roughness, reflectance) = (roughness(r), color(reflectance));
                let m = Self::CoatedDiffuse { reflectance, coat: coats.get(*eta), roughness };
                (m, fixed(reflectance) && roughness.is_constant())
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance } => {
                let (reflectance, transmittance) = (color(reflectance), color(transmittance));
                let constant = fixed(reflectance) && fixed(transmittance);
                (Self::DiffuseTransmission { reflectance, transmittance }, constant)
            }
            MaterialKind::Mix { materials, amount } => {
                let materials = [materials[0].0, materials[1].0];
                return Self::Mix { materials, amount: textures.scalar(*amount) };
            }
            MaterialKind::MetallicRoughness(m) => {
                let inputs = Inputs::new(m, textures);
                (Self::MetallicRoughness(Box::new(inputs)), inputs.is_constant())
            }
            MaterialKind::Interface => return Self::Fixed([Bsdf::Interface; 2]),
            MaterialKind::OrenNayar { reflectance, sigma } => {
                let (reflectance, sigma) = (color(reflectance), textures.scalar(*sigma));
                let constant = fixed(reflectance) && matches!(sigma, Scalar::Constant(_));
                (Self::OrenNayar { reflectance, sigma }, constant)
            }
            MaterialKind::Mirror { reflectance } => {
                let c = color(reflectance);
                (Self::Mirror(c), fixed(c))
            }
            MaterialKind::Uber { diffuse, specular, mirror, transmission, roughness: r, eta } => {
                let factors = [diffuse, specular, mirror, transmission].map(color);
                let roughness = roughness(r);
                let constant = factors.into_iter().all(fixed) && roughness.is_constant();
                (Self::Uber { factors, eta: *eta, roughness }, constant)
            }
            MaterialKind::Substrate { diffuse, specular, roughness: r } => {
                let (diffuse, specular, roughness) = (color(diffuse), color(specular), roughness(r));
                let constant = fixed(diffuse) && fixed(specular) && roughness.is_constant();
                (Self::Substrate { diffuse, specular, roughness }, constant)
            }
            MaterialKind::CoatedConductor { conductor, roughness: r, eta, coat_roughness } => {
                let (substance, constant) = substance(conductor);
                let (roughness, coat_roughness) = (roughness(r), roughness(coat_roughness));
                let constant = constant && roughness.is_constant() && coat_roughness.is_constant();
                (Self::CoatedConductor { substance, roughness, eta: *eta, coat_roughness }, constant)
            }
        };
        if is_fixed {
            let at = |front| {
                let uv = TexturePoint::default();
                model.bsdf(textures, ShadingInput { uv, front, choice: 0.0, color: Vec3::ONE })
            };
            return Self::Fixed([at(true), at(false)]);
        }
        model
    }

    #[inline]
    fn bsdf(&self, textures: &TextureTable, input: ShadingInput) -> Bsdf {
        match self {
            Self::Fixed(sides) => sides[usize::from(!input.front)],
            other => other.varying_bsdf(textures, input),
        }
    }

    fn varying_bsdf(&self, textures: &TextureTable, input: ShadingInput) -> Bsdf {
        let uv = input.uv;
        // Negative and NaN reflectances become 0; above 1 a surface would emit.
        let albedo = |c: Color| unit(textures.eval_color(c, uv));
        let indices = |substance: &Substance| match substance {
            Substance::EtaK(eta, k) => (textures.eval_color(*eta, uv), textures.eval_color(*k, uv)),
            Substance::Reflectance(c) => (Vec3::ONE, Conductor::k_from_reflectance(albedo(*c))),
        };
        match self {
            Self::Fixed(sides) => sides[usize::from(!input.front)],
            Self::Diffuse(c) => Bsdf::Diffuse(Diffuse { reflectance: albedo(*c) }),
            Self::Conductor { substance, roughness } => {
                let (eta, k) = indices(substance);
                Bsdf::Conductor(Conductor { eta, k, ggx: roughness.ggx(textures, uv) })
            }
            Self::Dielectric { eta, tint, roughness } => {
                let eta = if input.front { *eta } else { 1.0 / *eta };
                let (tint, ggx) = (albedo(*tint), roughness.ggx(textures, uv));
                Bsdf::Dielectric(Dielectric { eta, tint, ggx })
            }
            Self::CoatedDiffuse { reflectance, coat, roughness } => {
                Bsdf::CoatedDiffuse(coat.coat(albedo(*reflectance), roughness.ggx(textures, uv)))
            }
            Self::DiffuseTransmission { reflectance, transmittance } => {
                let (r, t) = (albedo(*reflectance), albedo(*transmittance));
                let excess = (r + t).max(Vec3::ONE); // never more than all of the light
                Bsdf::DiffuseTransmission(DiffuseTransmission {
                    reflectance: r / excess,
                    transmittance: t / excess,
                })
            }
            Self::OrenNayar { reflectance, sigma } => {
                Bsdf::OrenNayar(OrenNayar::new(albedo(*reflectance), textures.eval_scalar(*sigma, uv)))
            }
            Self::Mirror(c) => Bsdf::Mirror(Mirror { reflectance: albedo(*c) }),
            Self::Uber { factors, eta, roughness } => {
                let [diffuse, specular, mirror, transmission] = factors.map(albedo);
                let eta = if input.front { *eta } else { 1.0 / *eta };
                let ggx = roughness.ggx(textures, uv);
                Bsdf::Uber(Uber { diffuse, specular, mirror, transmission, eta, ggx })
            }
            Self::Substrate { diffuse, specular, roughness } => {
                let (diffuse, specular) = (albedo(*diffuse), albedo(*specular));
                Bsdf::Substrate(Substrate { diffuse, specular, ggx: roughness.ggx(textures, uv) })
            }
            Self::CoatedConductor { substance, roughness, eta: coat_eta, coat_roughness } => {
                let (eta, k) = indices(substance);
                Bsdf::CoatedConductor(CoatedConductor {
                    coat_eta: *coat_eta,
                    coat: coat_roughness.ggx(textures, uv),
                    eta: eta / *coat_eta,
                    k: k / *coat_eta,
                    ggx: roughness.ggx(textures, uv),
                })
            }
            Self::MetallicRoughness(inputs) => inputs.bsdf(textures, input),
            Self::Mix { .. } => Bsdf::Interface, // resolved by MaterialTable::bsdf
        }
    }
}

fn unit(v: Vec3) -> Vec3 {
    let clean = |x: f32| if x > 0.0 { x.min(1.0) } else { 0.0 };
    Vec3::new(clean(v.x), clean(v.y), clean(v.z))
}
