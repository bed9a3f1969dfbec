//! Every light that rays can hit: its samples follow its density, and the densities of sampling and of
//! hitting agree. Chi-square at level 1e-6 a test.

use glam::{DVec3, Mat3, Vec3};
use sparing_image::picture::{Picture, Pixels};
use sparing_render::lights::{
    DiskLight, Emission, Environment, EnvironmentMap, FlatLight, Light, LightContext, LightTable, SphereLight,
};
use sparing_render::sampler::{Dimension, PixelSampler, SamplerKind};
use sparing_render::sampling::Frame;
use sparing_render::texture::{Color, Image, TextureTable};
use sparing_scene::description::TextureEncoding;
use testkit::chi_square::{Settings, test_directions};

/// The point where a ray meets a light: distance and cosine.
fn meet(light: &Light, p: DVec3, w: DVec3) -> Option<(f64, f64)> {
    match light {
        Light::Flat(l) => {
            let (o, u, v) = (l.corner.as_dvec3(), l.edge_u.as_dvec3(), l.edge_v.as_dvec3());
            let n = u.cross(v);
            let t = n.dot(o - p) / n.dot(w);
            let q = p + w * t - o;
            let b = v.cross(n).dot(q) / v.cross(n).dot(u);
            let c = u.cross(n).dot(q) / u.cross(n).dot(v);
            let inside =
                b >= 0.0 && c >= 0.0 && if l.parallelogram { b <= 1.0 && c <= 1.0 } else { b + c <= 1.0 };
            (t > 0.0 && inside).then(|| (t, (n.normalize().dot(w)).abs()))
        }
        Light::Disk(l) => {
            let n = l.frame.z.as_dvec3();
            let t = n.dot(l.center.as_dvec3() - p) / n.dot(w);
            let inside = (p + w * t - l.center.as_dvec3()).length() <= f64::from(l.radius);
            (t > 0.0 && inside).then(|| (t, n.dot(w).abs()))
        }
        Light::Sphere(l) => {
            let (c, r) = (l.center.as_dvec3() - p, f64::from(l.radius));
            let b = c.dot(w);
            let d = b * b - c.length_squared() + r * r;
            let t = if c.length() > r { b - d.max(0.0).sqrt() } else { b + d.max(0.0).sqrt() };
            (d >= 0.0 && t > 0.0).then(|| (t, ((p + w * t - l.center.as_dvec3()) / r).dot(w).abs()))
        }
        _ => None,
    }
}

#[test]
fn shapes() {
    let textures = TextureTable::default();
    let emissions = [Emission { radiance: Color::Constant(Vec3::ONE), two_sided: true }];
    let context = LightContext { emissions: &emissions, textures: &textures };
    let flat = |parallelogram| {
        let (u, v) = (Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.1, 0.3, 1.2));
        Light::Flat(
            FlatLight::new(Vec3::new(-0.5, 0.8, -0.4), u, v, false, parallelogram, [[0.0; 2]; 3], 0)
                .expect("has area"),
        )
    };
    let sphere = |center, radius| {
        Light::Sphere(SphereLight {
            center,
            radius,
            axes: [Vec3::X, Vec3::Y, Vec3::Z],
            flip: false,
            emission: 0,
        })
    };
    let disk = DiskLight {
        center: Vec3::new(0.2, 0.3, 1.0),
        frame: Frame::from_z(Vec3::new(0.3, 0.1, -1.0).normalize()),
        radius: 0.8,
        emission: 0,
    };
    let lights = [
        ("triangle", flat(false)),
        ("parallelogram", flat(true)),
        ("sphere outside", sphere(Vec3::new(0.5, 1.0, 2.0), 0.7)),
        ("sphere near", sphere(Vec3::new(0.0, 0.0, 1.01), 1.0)),
        ("sphere inside", sphere(Vec3::new(0.1, 0.2, 0.3), 1.0)),
        ("disk", Light::Disk(disk)),
    ];
    for (k, (name, light)) in lights.iter().enumerate() {
        let p = Vec3::ZERO;
        let table = LightTable::new(vec![light.clone()], &[0], 1.0, &context);
        let s = PixelSampler::new(SamplerKind::Independent, k as u64, 0, 0);
        let sample = |i: usize| {
            let l = table.sample(p, 0.5, s.get_2d(i as u32, 0, Dimension::Light), &context)?;
            if i < 1000 {
                let (t, cos) =
                    meet(light, p.as_dvec3(), l.wi.as_dvec3()).unwrap_or((f64::from(l.distance), -1.0));
                assert!((t - f64::from(l.distance)).abs() < 1e-3 * t, "{name}: distance {} {t}", l.distance);
                if cos > 0.05 {
                    let pdf = table.pdf_hit(0, p, l.distance, cos as f32);
                    assert!((pdf / l.pdf - 1.0).abs() < 1e-2, "{name}: pdf {pdf} {}", l.pdf);
                }
            }
            Some(l.wi.as_dvec3().normalize())
        };
        let pdf = |w: DVec3| match meet(light, p.as_dvec3(), w) {
            Some((t, cos)) => f64::from(table.pdf_hit(0, p, t as f32, cos as f32)),
            None => 0.0,
        };
        let settings = Settings { rows: 32, columns: 64, samples: 200_000, level: 1e-6 };
        if let Err(e) = test_directions(settings, sample, pdf) {
            panic!("{name}: {e}");
        }
    }
}

fn sky(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Image {
    let data = (0..width * height).map(|i| [texel(i % width, i / width); 3]).collect();
    Image::new(Picture { width, height, pixels: Pixels::Rgb32F(data) }, TextureEncoding::Linear)
}

#[test]
fn environments() {
    let textures = TextureTable::default();
    let context = LightContext { emissions: &[], textures: &textures };
    let bright = |x: u32, y: u32| if (x, y) == (11, 3) { 50.0 } else { 0.2 + (x % 3) as f32 * 0.1 };
    let rotation = Mat3::from_euler(glam::EulerRot::XYZ, 0.3, -0.7, 1.9);
    let maps = [
        ("constant", None),
        ("latitude-longitude", EnvironmentMap::new(sky(32, 16, bright))),
        ("one texel", EnvironmentMap::new(sky(2, 1, |_, _| 1.0))),
        ("equal area", EnvironmentMap::new(sky(16, 16, bright))),
        ("with holes", EnvironmentMap::new(sky(32, 16, |x, y| if y < 8 { f32::NAN } else { x as f32 }))),
    ];
    for (name, map) in maps {
        let light = Light::Environment(Environment { radiance: Vec3::ONE, map, light_to_world: rotation });
        let table = LightTable::new(vec![light], &[0], 1.0, &context);
        let s = PixelSampler::new(SamplerKind::Independent, 77, 0, 0);
        let sample = |i: usize| {
            let l = table.sample(Vec3::ZERO, 0.5, s.get_2d(i as u32, 0, Dimension::Light), &context)?;
            let (radiance, pdf) = table.environment(l.wi);
            assert!((pdf / l.pdf - 1.0).abs() < 2e-2 || l.wi.z.abs() > 0.999, "{name}: {pdf} {}", l.pdf);
            assert!(radiance.is_finite());
            Some(l.wi.as_dvec3().normalize())
        };
        let pdf = |w: DVec3| f64::from(table.environment(w.as_vec3()).1);
        let settings = Settings { rows: 24, columns: 48, samples: 200_000, level: 1e-6 };
        if let Err(e) = test_directions(settings, sample, pdf) {
            panic!("{name}: {e}");
        }
    }
}

/// Wherever there is light, sampling can go: no texel of radiance above 0 has density 0.
#[test]
fn no_light_is_out_of_reach() {
    let map = EnvironmentMap::new(sky(64, 32, |x, y| f32::from(u8::from((x, y) == (40, 20))))).expect("2:1");
    let light = Light::Environment(Environment {
        radiance: Vec3::ONE,
        map: Some(map),
        light_to_world: Mat3::IDENTITY,
    });
    let textures = TextureTable::default();
    let table =
        LightTable::new(vec![light], &[0], 1.0, &LightContext { emissions: &[], textures: &textures });
    let s = PixelSampler::new(SamplerKind::Sobol, 0, 0, 0);
    let mut lit = 0;
    for i in 0..200_000 {
        let w = sparing_render::sampling::uniform_sphere(s.get_2d(i, 0, Dimension::Light));
        let (radiance, pdf) = table.environment(w);
        if radiance.x > 0.0 {
            lit += 1;
            assert!(pdf > 0.0, "{w}");
        }
    }
    assert!(lit > 50);
}
