//! White furnace and reciprocity of every material: under uniform light of radiance 1 no material sends back
//! more than it gets, and those that should lose nothing lose nothing.

use glam::Vec3;
use sparing_render::materials::microfacet::Ggx;
use sparing_render::materials::{
    Bsdf, CoatTable, CoatedConductor, Conductor, Dielectric, Diffuse, DiffuseTransmission, MetallicRoughness,
    Mirror, OrenNayar, Substrate, ThinDielectric, Uber,
};
use sparing_render::sampler::{Dimension, PixelSampler, SamplerKind};

/// Reflected share of uniform light: the mean of the sample weights. `radiance` undoes the 1/eta² of refraction.
fn albedo(bsdf: &Bsdf, wo: Vec3, refraction: f32) -> f32 {
    let s = PixelSampler::new(SamplerKind::Sobol, 1, 2, 3);
    let n = 16_384;
    let sum: f64 = (0..n)
        .filter_map(|i| {
            let u = s.get_2d(i, 0, Dimension::Bsdf);
            let lobe = s.get_2d(i, 0, Dimension::Choice)[0];
            let b = bsdf.sample(wo, lobe, u)?;
            let factor = if b.wi.z < 0.0 { refraction } else { 1.0 };
            Some(f64::from(b.weight.x * factor))
        })
        .sum();
    (sum / f64::from(n)) as f32
}

fn angles() -> impl Iterator<Item = Vec3> {
    [0.0f32, 0.4, 0.9, 1.3, 1.5, 1.56]
        .into_iter()
        .map(|t| Vec3::new(t.sin() * 0.6, t.sin() * 0.8, t.cos()).normalize())
}

fn alphas() -> [Ggx; 5] {
    [(0.0, 0.0), (0.01, 0.01), (0.2, 0.2), (0.1, 0.6), (1.0, 1.0)].map(|(x, y)| Ggx::new(x, y))
}

#[test]
fn nothing_gains_energy_and_smooth_white_loses_none() {
    let coat = CoatTable::new(1.5);
    for wo in angles() {
        let check = |name: &str, bsdf: Bsdf, refraction: f32, lower: f32| {
            let a = albedo(&bsdf, wo, refraction);
            assert!(a <= 1.01 && a >= lower, "{name} at {wo}: {a}, lower bound {lower}");
        };
        check("diffuse", Bsdf::Diffuse(Diffuse { reflectance: Vec3::ONE }), 1.0, 0.9999);
        let leaf = DiffuseTransmission { reflectance: Vec3::splat(0.4), transmittance: Vec3::splat(0.6) };
        check("diffuse transmission", Bsdf::DiffuseTransmission(leaf), 1.0, 0.99);
        check("thin dielectric", Bsdf::ThinDielectric(ThinDielectric { eta: 1.5 }), 1.0, 0.9999);
        check("interface", Bsdf::Interface, 1.0, 1.0);
        check("mirror", Bsdf::Mirror(Mirror { reflectance: Vec3::ONE }), 1.0, 1.0);
        for sigma in [0.0, 20.0, 60.0] {
            // Grooves lose light between them at normal incidence, and show their lit sides at grazing angles.
            let lower = if sigma == 0.0 { 0.9999 } else { 0.6 };
            check("Oren-Nayar", Bsdf::OrenNayar(OrenNayar::new(Vec3::ONE, sigma)), 1.0, lower);
        }
        for ggx in alphas() {
            // Light that meets a second facet is lost, as in pbrt: up to ln 2 of it at alpha 1 (see below).
            let smooth = ggx.is_smooth();
            let k = Conductor::k_from_reflectance(Vec3::ONE);
            let metal = Conductor { eta: Vec3::ONE, k, ggx };
            check("white metal", Bsdf::Conductor(metal), 1.0, if smooth { 0.99 } else { 0.28 });
            for eta in [1.5f32, 1.0 / 1.5, 1.0] {
                let glass = Dielectric { eta, tint: Vec3::ONE, ggx };
                check(
                    "glass",
                    Bsdf::Dielectric(glass),
                    eta * eta,
                    if smooth || eta == 1.0 { 0.9998 } else { 0.25 },
                );
            }
            // Kd, Ks, Kr and Kt that add up to 1 where the dielectric reflects or refracts all.
            let (half, black) = (Vec3::splat(0.5), Vec3::ZERO);
            for eta in [1.5f32, 1.0 / 1.5] {
                let clear = Uber {
                    diffuse: black,
                    specular: black,
                    mirror: Vec3::ONE,
                    transmission: Vec3::ONE,
                    eta,
                    ggx,
                };
                check("clear uber", Bsdf::Uber(clear), eta * eta, 0.9998);
                let glossy =
                    Uber { diffuse: half, specular: half, mirror: black, transmission: black, eta, ggx };
                check("glossy uber", Bsdf::Uber(glossy), 1.0, 0.4);
            }
            let substrate = Substrate { diffuse: Vec3::splat(0.9), specular: Vec3::splat(0.04), ggx };
            check("substrate", Bsdf::Substrate(substrate), 1.0, 0.15);
            for coat_ggx in alphas() {
                let lacquer = CoatedConductor { coat_eta: 1.5, coat: coat_ggx, eta: Vec3::ONE, k, ggx };
                let both = smooth && coat_ggx.is_smooth();
                check("lacquer", Bsdf::CoatedConductor(lacquer), 1.0, if both { 0.99 } else { 0.1 });
            }
            let plastic = coat.coat(Vec3::ONE, ggx);
            // The coat's table is of isotropic lobes, and coarse at grazing angles.
            let a = albedo(&Bsdf::CoatedDiffuse(plastic), wo, 1.0);
            let (lower, upper) = if ggx.is_anisotropic() { (0.85, 1.05) } else { (0.98, 1.02) };
            assert!((lower..=upper).contains(&a), "white plastic {ggx:?} at {wo}: {a}");
        }
    }
}

/// A white dielectric over a matte base loses and gains nothing, whatever its roughness; metal and thin glass lose what
/// meets a second facet; a coat keeps a little of what comes back from below.
#[test]
fn metallic_roughness_is_sound() {
    let white = MetallicRoughness {
        base_color: Vec3::ONE,
        metallic: 0.0,
        transmission: 0.0,
        f0: Vec3::splat(0.04),
        f90: 1.0,
        ggx: Ggx::new(0.0, 0.0),
        clearcoat: 0.0,
        coat_ggx: Ggx::new(0.0, 0.0),
    };
    for wo in angles() {
        for ggx in alphas().into_iter().filter(|ggx| !ggx.is_anisotropic()) {
            let white = MetallicRoughness { ggx, ..white };
            for (name, bsdf, lower, upper) in [
                ("matte", white, 0.985, 1.015),
                ("strong", MetallicRoughness { f0: Vec3::splat(0.5), ..white }, 0.985, 1.015),
                ("without specular", MetallicRoughness { f0: Vec3::ZERO, f90: 0.0, ..white }, 0.999, 1.001),
                (
                    "metal",
                    MetallicRoughness { metallic: 1.0, ..white },
                    if ggx.is_smooth() { 0.99 } else { 0.28 },
                    1.005,
                ),
                (
                    "glass",
                    MetallicRoughness { transmission: 1.0, ..white },
                    if ggx.is_smooth() { 0.99 } else { 0.28 },
                    1.005,
                ),
                (
                    "coated",
                    MetallicRoughness { clearcoat: 1.0, coat_ggx: Ggx::new(0.1, 0.1), ..white },
                    0.75,
                    1.01,
                ),
                (
                    "everything",
                    MetallicRoughness { clearcoat: 0.5, metallic: 0.5, transmission: 0.5, ..white },
                    0.28,
                    1.01,
                ),
            ] {
                let a = albedo(&Bsdf::MetallicRoughness(bsdf), wo, 1.0);
                assert!((lower..=upper).contains(&a), "{name} {ggx:?} at {wo}: {a}");
            }
        }
    }
    // Schlick: smooth metal reflects its colour head-on, everything at grazing angles.
    let gold = MetallicRoughness { base_color: Vec3::new(1.0, 0.75, 0.3), metallic: 1.0, ..white };
    let reflected = |wo: Vec3| Bsdf::MetallicRoughness(gold).sample(wo, 0.5, [0.5; 2]).unwrap().weight;
    assert!(reflected(Vec3::Z).abs_diff_eq(gold.base_color, 1e-6));
    assert!(reflected(Vec3::new(1.0, 0.0, 1e-4).normalize()).abs_diff_eq(Vec3::ONE, 1e-3));
    // A matte surface without reflection is Lambert's.
    let matte = MetallicRoughness { f0: Vec3::ZERO, f90: 0.0, ggx: Ggx::new(1.0, 1.0), ..gold };
    let matte = Bsdf::MetallicRoughness(MetallicRoughness { metallic: 0.0, ..matte });
    let f_cos = matte.eval(Vec3::Z, Vec3::new(0.6, 0.0, 0.8)).f_cos;
    assert!(f_cos.abs_diff_eq(gold.base_color * 0.8 / std::f32::consts::PI, 1e-5), "{f_cos}");
}

/// f(wo, wi) = f(wi, wo) for reflection; f(wo, wi) eta_i^-2 = f(wi, wo) eta_o^-2 for refraction (E. Veach
/// 1997, eq. 5.14).
#[test]
fn materials_are_reciprocal() {
    let up: Vec<Vec3> = angles().chain(angles().map(|v| Vec3::new(-v.y, v.x, v.z))).collect();
    for ggx in &alphas()[1..] {
        let plastic = CoatTable::new(1.5).coat(Vec3::splat(0.6), *ggx);
        let metal = Conductor { eta: Vec3::splat(0.3), k: Vec3::splat(3.0), ggx: *ggx };
        let layered = MetallicRoughness {
            base_color: Vec3::splat(0.6),
            metallic: 0.3,
            transmission: 0.4,
            f0: Vec3::splat(0.04),
            f90: 1.0,
            ggx: *ggx,
            clearcoat: 0.7,
            coat_ggx: Ggx::new(0.2, 0.2),
        };
        for bsdf in [
            Bsdf::Diffuse(Diffuse { reflectance: Vec3::splat(0.5) }),
            Bsdf::CoatedDiffuse(plastic),
            Bsdf::Conductor(metal),
            Bsdf::Dielectric(Dielectric { eta: 1.5, tint: Vec3::ONE, ggx: *ggx }),
            Bsdf::OrenNayar(OrenNayar::new(Vec3::splat(0.5), 25.0)),
            Bsdf::Uber(Uber {
                diffuse: Vec3::splat(0.3),
                specular: Vec3::splat(0.4),
                mirror: Vec3::splat(0.1),
                transmission: Vec3::splat(0.1),
                eta: 1.5,
                ggx: *ggx,
            }),
            Bsdf::Substrate(Substrate { diffuse: Vec3::splat(0.3), specular: Vec3::splat(0.2), ggx: *ggx }),
            Bsdf::CoatedConductor(CoatedConductor {
                coat_eta: 1.5,
                coat: Ggx::new(0.3, 0.3),
                eta: Vec3::splat(0.3),
                k: Vec3::splat(2.0),
                ggx: *ggx,
            }),
            Bsdf::MetallicRoughness(layered),
        ] {
            for a in &up {
                for b in &up {
                    let f = |o: Vec3, i: Vec3| bsdf.eval(o, i).f_cos.x / i.z;
                    let (x, y) = (f(*a, *b), f(*b, *a));
                    assert!((x - y).abs() <= 2e-3 * x.max(y) + 1e-6, "{bsdf:?} {a} {b}: {x} {y}");
                }
            }
        }
        // A thin sheet looks the same from below.
        for (wo, wi) in up.iter().flat_map(|wo| up.iter().map(move |wi| (*wo, *wi))) {
            let f = |o: Vec3, i: Vec3| {
                Bsdf::MetallicRoughness(layered).eval(o, Vec3::new(i.x, i.y, -i.z)).f_cos.x / i.z
            };
            let (x, y) = (f(wo, wi), f(wi, wo));
            assert!((x - y).abs() <= 2e-3 * x.max(y) + 1e-6, "thin sheet {ggx:?} {wo} {wi}: {x} {y}");
        }
        // Through the interface: from above with eta, from below with 1 / eta (frame turned over).
        let eta = 1.5f32;
        let above = Bsdf::Dielectric(Dielectric { eta, tint: Vec3::ONE, ggx: *ggx });
        let below = Bsdf::Dielectric(Dielectric { eta: 1.0 / eta, tint: Vec3::ONE, ggx: *ggx });
        for wo in &up {
            for wi in &up {
                let down = -*wi;
                let x = above.eval(*wo, down).f_cos.x / down.z.abs();
                // The lower side sees the same interface turned over.
                let turned = |v: Vec3| Vec3::new(v.x, v.y, -v.z);
                let y = below.eval(turned(down), turned(*wo)).f_cos.x / wo.z;
                let y = y / (eta * eta);
                assert!((x - y).abs() <= 5e-3 * x.max(y) + 1e-5, "alpha {ggx:?} {wo} {wi}: {x} {y}");
            }
        }
    }
}

/// A fully rough white mirror seen head-on reflects 1 - ln 2: at alpha 1 facet normals follow a cosine, half of
/// them reflect upwards, with c = cos of the outgoing angle uniform, and G1 = 2 c / (1 + c).
#[test]
fn rough_white_metal_has_its_closed_form() {
    let white = Conductor { eta: Vec3::ONE, k: Vec3::splat(1e6), ggx: Ggx::new(1.0, 1.0) };
    let a = albedo(&Bsdf::Conductor(white), Vec3::Z, 1.0);
    assert!((a - (1.0 - 2f32.ln())).abs() < 1e-3, "{a}");
}
