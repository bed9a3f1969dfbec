//! Every sampling routine against its density: chi-square at level 1e-5 a test, with a Bonferroni
//! correction over the whole table.

use glam::{DVec3, Vec3};
use sparing_render::materials::microfacet::Ggx;
use sparing_render::materials::{
    Bsdf, CoatTable, CoatedConductor, CoatedDiffuse, Conductor, Dielectric, Diffuse, DiffuseTransmission,
    MetallicRoughness, OrenNayar, Substrate, Uber,
};
use sparing_render::sampler::{Dimension, PixelSampler, SamplerKind};
use sparing_render::sampling;
use testkit::chi_square::{Settings, test_directions};

fn uniform(seed: u64) -> impl Fn(usize) -> ([f32; 2], f32) {
    let s = PixelSampler::new(SamplerKind::Independent, seed, 0, 0);
    move |i| (s.get_2d(i as u32, 0, Dimension::Bsdf), s.get_2d(i as u32, 0, Dimension::Choice)[0])
}

/// Materials with names; their delta lobes are skipped by the test.
fn materials() -> Vec<(String, Bsdf)> {
    let mut all = vec![
        ("diffuse".into(), Bsdf::Diffuse(Diffuse { reflectance: Vec3::splat(0.7) })),
        (
            "diffuse transmission".into(),
            Bsdf::DiffuseTransmission(DiffuseTransmission {
                reflectance: Vec3::splat(0.3),
                transmittance: Vec3::new(0.5, 0.1, 0.2),
            }),
        ),
    ];
    for (ax, ay) in [(0.05, 0.05), (0.2, 0.2), (0.1, 0.4), (0.7, 0.7), (1.0, 1.0)] {
        let ggx = Ggx::new(ax, ay);
        let metal = Conductor { eta: Vec3::new(0.2, 0.9, 1.1), k: Vec3::new(3.9, 2.4, 2.2), ggx };
        all.push((format!("conductor {ax} {ay}"), Bsdf::Conductor(metal)));
        for eta in [1.5, 1.0 / 1.5] {
            let glass = Dielectric { eta, tint: Vec3::ONE, ggx };
            all.push((format!("dielectric {ax} {ay} eta {eta:.2}"), Bsdf::Dielectric(glass)));
        }
        all.push((format!("coated diffuse {ax} {ay}"), Bsdf::CoatedDiffuse(coated(0.6, ggx))));
        for eta in [1.5, 1.0 / 1.5] {
            let uber = Uber {
                diffuse: Vec3::new(0.4, 0.2, 0.1),
                specular: Vec3::splat(0.5),
                mirror: Vec3::splat(0.2),
                transmission: Vec3::splat(0.1),
                eta,
                ggx,
            };
            all.push((format!("uber {ax} {ay} eta {eta:.2}"), Bsdf::Uber(uber)));
        }
        let substrate = Substrate { diffuse: Vec3::splat(0.5), specular: Vec3::splat(0.2), ggx };
        all.push((format!("substrate {ax} {ay}"), Bsdf::Substrate(substrate)));
        for coat in [Ggx::new(0.3, 0.3), Ggx::new(0.0, 0.0)] {
            let (eta, k) = (metal.eta / 1.5, metal.k / 1.5);
            let coated = CoatedConductor { coat_eta: 1.5, coat, eta, k, ggx };
            all.push((format!("coated conductor {ax} {ay} {coat:?}"), Bsdf::CoatedConductor(coated)));
        }
    }
    all.push(("Oren-Nayar".into(), Bsdf::OrenNayar(OrenNayar::new(Vec3::splat(0.8), 30.0))));
    // (alpha, metal, transmission, coat, alpha of the coat)
    for (i, (alpha, metallic, transmission, clearcoat, coat)) in [
        (0.2, 0.0, 0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0, 0.0),
        (0.05, 1.0, 0.0, 0.0, 0.0),
        (0.4, 0.3, 0.0, 1.0, 0.1),
        (0.3, 0.0, 1.0, 0.0, 0.0),
        (0.5, 0.2, 0.6, 0.5, 0.0),
        (0.0, 0.5, 0.5, 0.5, 0.3),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ]
    .into_iter()
    .enumerate()
    {
        let bsdf = MetallicRoughness {
            base_color: Vec3::new(0.8, 0.5, 0.2),
            metallic,
            transmission,
            f0: Vec3::new(0.04, 0.02, 0.08),
            f90: 0.9,
            ggx: Ggx::new(alpha, alpha),
            clearcoat,
            coat_ggx: Ggx::new(coat, coat),
        };
        all.push((format!("metallic-roughness {i}"), Bsdf::MetallicRoughness(bsdf)));
    }
    all.push(("coated diffuse smooth".into(), Bsdf::CoatedDiffuse(coated(0.6, Ggx::new(0.0, 0.0)))));
    all
}

fn coated(albedo: f32, ggx: Ggx) -> CoatedDiffuse {
    CoatTable::new(1.5).coat(Vec3::splat(albedo), ggx)
}

fn directions() -> Vec<Vec3> {
    [(0.0, 0.0), (0.5, 0.7), (1.0, 2.5), (1.4, 4.0), (1.55, 5.5)]
        .map(|(theta, phi): (f32, f32)| {
            Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()).normalize()
        })
        .to_vec()
}

#[test]
fn materials_sample_their_densities() {
    let mut failures = Vec::new();
    for (m, (name, bsdf)) in materials().iter().enumerate() {
        for (k, wo) in directions().into_iter().enumerate() {
            let u = uniform((m * 100 + k) as u64);
            let sample = |i: usize| {
                let (uv, lobe) = u(i);
                let s = bsdf.sample(wo, lobe, uv)?;
                (!s.is_delta).then(|| s.wi.as_dvec3().normalize())
            };
            let pdf = |w: DVec3| f64::from(bsdf.eval(wo, w.as_vec3()).pdf);
            let settings = Settings { samples: 100_000, level: 1e-7, ..Settings::default() };
            if let Err(e) = test_directions(settings, sample, pdf) {
                failures.push(format!("{name}, wo {wo}: {e}"));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The weight of a sample is f cos / pdf of the very direction, for every non-delta sample.
#[test]
fn sample_weights_agree_with_evaluation() {
    for (name, bsdf) in materials() {
        for wo in directions() {
            let u = uniform(5);
            for i in 0..20_000 {
                let (uv, lobe) = u(i);
                let Some(s) = bsdf.sample(wo, lobe, uv) else { continue };
                if s.is_delta || s.wi.z.abs() < 1e-3 {
                    continue;
                }
                let e = bsdf.eval(wo, s.wi);
                let weight = e.f_cos / e.pdf;
                let close = |a: f32, b: f32, tolerance: f32| {
                    (a - b).abs() <= tolerance * a.abs().max(b.abs()).max(1e-4)
                };
                assert!(close(e.pdf, s.pdf, 0.03), "{name} wo {wo} wi {}: pdf {} {}", s.wi, e.pdf, s.pdf);
                assert!(
                    (0..3).all(|k| close(weight[k], s.weight[k], 0.01)),
                    "{name} wo {wo} wi {}: weight {weight} {}",
                    s.wi,
                    s.weight
                );
            }
        }
    }
}

#[test]
fn warps_sample_their_densities() {
    let settings = Settings::default();
    let u = uniform(1);
    let cosine = |i: usize| Some(sampling::cosine_hemisphere(u(i).0).as_dvec3().normalize());
    test_directions(settings, cosine, |w| w.z.max(0.0) / std::f64::consts::PI).expect("cosine hemisphere");
    let sphere = |i: usize| Some(sampling::uniform_sphere(u(i).0).as_dvec3().normalize());
    test_directions(settings, sphere, |_| 0.25 / std::f64::consts::PI).expect("uniform sphere");
    for cos in [0.0f64, 0.5, 0.9] {
        let one_minus = (1.0 - cos) as f32;
        let cone = |i: usize| Some(sampling::uniform_cone(u(i).0, one_minus).as_dvec3().normalize());
        let density = f64::from(sampling::uniform_cone_pdf(one_minus));
        test_directions(settings, cone, |w| if w.z > cos { density } else { 0.0 }).expect("cone");
    }
    // A distribution that does not match must fail.
    assert!(test_directions(settings, cosine, |_| 0.25 / std::f64::consts::PI).is_err());
    assert!(test_directions(settings, cosine, |w| w.z.max(0.0) * 0.97 / std::f64::consts::PI).is_err());
}

/// Points of the lens and of triangles, as histograms on the unit square.
#[test]
fn area_samples_are_even() {
    let n = 400_000;
    let u = uniform(3);
    let bins = 16;
    let check = |name: &str, point: &dyn Fn([f32; 2]) -> [f64; 2], inside: &dyn Fn(f64, f64) -> f64| {
        let mut observed = vec![0.0; bins * bins];
        for i in 0..n {
            let [x, y] = point(u(i).0);
            let (bx, by) = ((x * bins as f64) as usize, (y * bins as f64) as usize);
            observed[by.min(bins - 1) * bins + bx.min(bins - 1)] += 1.0;
        }
        // Share of each bin inside the shape, by a fine grid.
        let fine = 200;
        let mut expected = vec![0.0; bins * bins];
        for (k, e) in expected.iter_mut().enumerate() {
            for i in 0..fine * fine {
                let x =
                    ((k % bins) as f64 + (i % fine) as f64 / fine as f64 + 0.5 / fine as f64) / bins as f64;
                let y =
                    ((k / bins) as f64 + (i / fine) as f64 / fine as f64 + 0.5 / fine as f64) / bins as f64;
                *e += inside(x, y);
            }
        }
        let total: f64 = expected.iter().sum();
        expected.iter_mut().for_each(|e| *e *= n as f64 / total);
        testkit::chi_square::compare(&observed, &expected, n as f64, 1e-6)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
    };
    let disk = |uv: [f32; 2]| {
        let p = sampling::concentric_disk(uv);
        [f64::from(p.x) * 0.5 + 0.5, f64::from(p.y) * 0.5 + 0.5]
    };
    check("disk", &disk, &|x, y| f64::from((x - 0.5).hypot(y - 0.5) < 0.5));
    let triangle = |uv: [f32; 2]| sampling::uniform_triangle(uv).map(f64::from);
    check("triangle", &triangle, &|x, y| f64::from(x + y < 1.0));
}
