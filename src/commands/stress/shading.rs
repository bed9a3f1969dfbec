//! Materials at their ends.

use super::case::{Case, Effort};
use super::scenes::{Picture, WHITE, described, picture, render, with};
use sparing_render::RenderSettings;
use sparing_render::integrator::Estimator;
use sparing_render::sampling::power_heuristic;
use sparing_scene::description::{Texture, TextureId};

const AREA: &str = "Shading";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "no-light-is-made",
        does: "Spheres of all materials, roughness 0 to 1 in steps around the switch to smooth, in white light: brightest mean.",
        unit: "mean over 1",
        bound: 2e-3,
        measure: energy,
    },
    Case {
        area: AREA,
        name: "smooth-rough-switch",
        does: "Mean radiance of metal and glass spheres under a bright square, for roughness 0 and for the least that is rough.",
        unit: "relative step",
        bound: 0.02,
        measure: switch,
    },
    Case {
        area: AREA,
        name: "indices-of-refraction",
        does: "Glass of index 0.5, 1 - 1e-6, 1, 1 + 1e-6, 1.5 and 10 in white light, which must look white.",
        unit: "error of the mean",
        bound: 2e-3,
        measure: indices,
    },
    Case {
        area: AREA,
        name: "extreme-conductors",
        does: "Metals with eta and k from 1e-6 to 1e6 in white light: brighter than their surroundings, or not finite.",
        unit: "excess and bad values",
        bound: 2e-3,
        measure: conductors,
    },
    Case {
        area: AREA,
        name: "grazing-materials",
        does: "Plains of all materials, roughness 0 to 1, seen at angles to 1e-4 of a degree, in white light: brighter than their \
               surroundings, or not finite.",
        unit: "excess of the mean",
        bound: 2e-3,
        measure: grazing,
    },
    Case {
        area: AREA,
        name: "mis-weights",
        does: "Weights of two densities of 0, denormal, 1e-38 to 1e38 and infinite, in all pairs: what is missing to a sum of 1, or out \
               of 0 to 1.",
        unit: "largest error",
        bound: 1e-6,
        measure: |_| Ok(weights()),
    },
    Case {
        area: AREA,
        name: "needle-densities",
        does: "Metal of the least roughness that is rough under a bright disk of 1e-3 and of 1e3, densities up to 1e6 and more, with each \
               estimator: values not finite, and the step from roughness 0 where the disk is large.",
        unit: "bad values and relative step",
        bound: 0.02,
        measure: needles,
    },
    Case {
        area: AREA,
        name: "degenerate-tangents",
        does: "Anisotropic metal under normal maps on sheets whose texture coordinates are all one, on a line, 1e-30 apart, mirrored or \
               huge: samples that are not finite, or light that is made.",
        unit: "excess of the mean",
        bound: 2e-3,
        measure: tangents,
    },
    Case {
        area: AREA,
        name: "thousand-bounces",
        does: "A closed glowing box of albedo 0.999 shines with 1000 times its emission.",
        unit: "relative error",
        bound: 0.02,
        measure: |e| {
            let p = glowing(0.999, 20_000, e.of(64, 1024))?;
            Ok((p / 1000.0 - 1.0).abs())
        },
    },
    Case {
        area: AREA,
        name: "roulette",
        does: "A closed glowing box of albedo 0.5 to 0.99 shines with 1 / (1 - albedo) times its emission: roulette loses nothing.",
        unit: "largest relative error",
        bound: 0.01,
        measure: |e| {
            let mut worst: f64 = 0.0;
            for albedo in [0.5, 0.9, 0.99] {
                let found = glowing(albedo, 5000, e.of(256, 4096))?;
                worst = worst.max((found * (1.0 - albedo) - 1.0).abs());
            }
            Ok(worst)
        },
    },
    Case {
        area: AREA,
        name: "black-and-white",
        does: "Every material with reflectance 0 and 1: samples that are not finite or negative.",
        unit: "values",
        bound: 0.0,
        measure: |e| {
            let mut bad = 0.0;
            for (material, _) in materials() {
                for (reflectance, roughness) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1e-4)] {
                    bad += sphere(&material(reflectance, roughness), e.of(16, 256))?.bad();
                }
            }
            Ok(bad)
        },
    },
    Case {
        area: AREA,
        name: "inward-normals",
        does: "Sheets whose shading normals point inwards or sideways: samples that are not finite, or light that is made.",
        unit: "excess of the mean",
        bound: 2e-3,
        measure: inward,
    },
    Case {
        area: AREA,
        name: "inward-normal-maps",
        does: "Sheets and balls whose normal maps point inwards, sideways, nowhere, or far out of range: samples that are not finite, or light that is made.",
        unit: "excess of the mean",
        bound: 2e-3,
        measure: inward_maps,
    },
];

/// A material of a reflectance and a roughness.
type Make = fn(f64, f64) -> String;

fn materials() -> [(Make, &'static str); 6] {
    [
        (|r, _| format!("Material \"diffuse\" \"rgb reflectance\" [{r} {r} {r}]"), "diffuse"),
        (
            |r, a| {
                format!(
                    "Material \"conductor\" \"rgb reflectance\" [{r} {r} {r}] \"float roughness\" {a} \"bool remaproughness\" false"
                )
            },
            "conductor",
        ),
        (
            |_, a| format!("Material \"dielectric\" \"float roughness\" {a} \"bool remaproughness\" false"),
            "dielectric",
        ),
        (
            |r, a| {
                format!(
                    "Material \"coateddiffuse\" \"rgb reflectance\" [{r} {r} {r}] \"float roughness\" {a} \"bool remaproughness\" false"
                )
            },
            "coateddiffuse",
        ),
        (|_, _| "Material \"thindielectric\"".to_owned(), "thindielectric"),
        (
            |r, _| {
                let h = 0.5 * r;
                format!(
                    "Material \"diffusetransmission\" \"rgb reflectance\" [{h} {h} {h}] \"rgb transmittance\" [{h} {h} {h}]"
                )
            },
            "diffusetransmission",
        ),
    ]
}

fn sphere(material: &str, spp: u32) -> anyhow::Result<Picture> {
    render(&format!("{WHITE}{material} Shape \"sphere\" \"float radius\" 1"), spp)
}

fn energy(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for (material, _) in materials() {
        for roughness in [0.0, 1e-6, 9e-4, 1.1e-3, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0] {
            let p = sphere(&material(1.0, roughness), effort.of(64, 1024))?;
            worst = worst.max(p.mean() - 1.0 + p.bad());
        }
    }
    Ok(worst)
}

fn switch(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for material in ["conductor", "dielectric"] {
        let mean = |roughness: f64| -> anyhow::Result<f64> {
            let world = format!(
                "{WHITE}AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 9 9] \"bool twosided\" true Shape \"bilinearmesh\" \"point3 P\" [-2 3 -2 2 3 -2 -2 3 2 2 3 2] AttributeEnd Material \"{material}\" \"float roughness\" {roughness} \"bool remaproughness\" false Shape \"sphere\" \"float radius\" 1"
            );
            Ok(render(&world, effort.of(512, 8192))?.mean())
        };
        let smooth = mean(0.0)?;
        for roughness in [1e-5, 1e-4, 1e-3, 2e-3] {
            worst = worst.max((mean(roughness)? / smooth - 1.0).abs());
        }
    }
    Ok(worst)
}

fn indices(effort: Effort) -> anyhow::Result<f64> {
    let camera = "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40";
    let mut worst: f64 = 0.0;
    for eta in [0.5, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.5, 10.0] {
        let world =
            format!("{WHITE}Material \"dielectric\" \"float eta\" {eta} Shape \"sphere\" \"float radius\" 1");
        let p = with(camera, &world, effort.of(256, 4096), 1000, true)?;
        worst = worst.max(p.off_white());
    }
    Ok(worst)
}

fn conductors(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for eta in [1e-6, 0.1, 1.0, 1e3, 1e6] {
        for k in [0.0, 1e-6, 1.0, 1e3, 1e6] {
            for roughness in [0.0, 0.3] {
                let material = format!(
                    "Material \"conductor\" \"rgb eta\" [{eta} {eta} {eta}] \"rgb k\" [{k} {k} {k}] \"float roughness\" {roughness}"
                );
                let p = sphere(&material, effort.of(16, 256))?;
                worst = worst.max(p.excess());
            }
        }
    }
    Ok(worst)
}

/// Mean radiance in a closed box that glows with 1.
fn glowing(albedo: f64, depth: u32, spp: u32) -> anyhow::Result<f64> {
    let camera = "LookAt 0 0 0  0.2 0.1 1  0 1 0 Camera \"perspective\" \"float fov\" 90";
    let faces = [
        "-1 -1 -1 1 -1 -1 -1 1 -1 1 1 -1",
        "-1 -1 1 1 -1 1 -1 1 1 1 1 1",
        "-1 -1 -1 1 -1 -1 -1 -1 1 1 -1 1",
        "-1 1 -1 1 1 -1 -1 1 1 1 1 1",
        "-1 -1 -1 -1 1 -1 -1 -1 1 -1 1 1",
        "1 -1 -1 1 1 -1 1 -1 1 1 1 1",
    ];
    let mut world = format!(
        "Material \"diffuse\" \"rgb reflectance\" [{albedo} {albedo} {albedo}] AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true\n"
    );
    for face in faces {
        world += &format!("Shape \"bilinearmesh\" \"point3 P\" [{face}]\n");
    }
    Ok(with(camera, &world, spp, depth, true)?.mean())
}

fn inward(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for normal in ["0 0 1", "0 0 -1", "1 0 0", "0.7 0 0.7", "0 0 0"] {
        // An open sheet of glass has the brighter inside of glass behind it.
        for (material, _) in materials().into_iter().filter(|(_, name)| *name != "dielectric") {
            let normals = [normal; 4].join(" ");
            let world = format!(
                "{WHITE}{} Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"normal N\" [{normals}] \"integer indices\" [0 2 1 0 3 2]",
                material(1.0, 0.2)
            );
            let p = render(&world, effort.of(64, 1024))?;
            worst = worst.max(p.excess());
        }
    }
    Ok(worst)
}

fn grazing(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for height in [1e-2, 1e-4, 1e-6] {
        let camera =
            format!("LookAt 0 {height} 0  0 {height} 1  0 1 0 Camera \"perspective\" \"float fov\" 1");
        let plain = "Shape \"bilinearmesh\" \"point3 P\" [-100 0 -1 100 0 -1 -100 0 1000 100 0 1000]";
        // As below: what is behind an open sheet of glass is brighter.
        for (material, _) in materials().into_iter().filter(|(_, name)| *name != "dielectric") {
            for roughness in [0.0, 1.1e-3, 0.1, 1.0] {
                let world = format!("{WHITE}{} {plain}", material(1.0, roughness));
                worst = worst.max(with(&camera, &world, effort.of(16, 256), 64, true)?.excess());
            }
        }
    }
    Ok(worst)
}

fn weights() -> f64 {
    let densities = [0.0, 1e-45, 1e-38, 1e-20, 1e-6, 1.0, 3.0, 1e6, 1e20, 1e38, f32::INFINITY];
    let mut worst: f64 = 0.0;
    for a in densities {
        for b in densities {
            let (one, other) = (f64::from(power_heuristic(a, b)), f64::from(power_heuristic(b, a)));
            let out = (one - 1.0).max(-one).max(0.0);
            let error = (one + other - 1.0).abs() + out;
            worst = worst.max(if error.is_nan() { f64::INFINITY } else { error });
        }
    }
    worst
}

fn needles(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for radius in [1e-3, 1e3] {
        let rendered = |roughness: f64, estimator: Estimator| -> anyhow::Result<Picture> {
            let world = format!(
                "AttributeBegin Translate 0 0 -100 AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" true Shape \"disk\" \"float radius\" {radius} AttributeEnd Material \"conductor\" \"rgb reflectance\" [1 1 1] \"float roughness\" {roughness} \"bool remaproughness\" false Shape \"sphere\" \"float radius\" 1"
            );
            let camera = "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 20";
            let settings = RenderSettings { max_depth: 4, estimator, ..RenderSettings::default() };
            picture(described(camera, &world)?, effort.of(256, 4096), settings, true)
        };
        let smooth = rendered(0.0, Estimator::Mis)?;
        worst = worst.max(smooth.bad());
        for estimator in [Estimator::Mis, Estimator::BsdfOnly, Estimator::LightOnly] {
            let rough = rendered(1.01e-3, estimator)?;
            worst = worst.max(rough.bad());
            if radius > 1.0 && estimator != Estimator::LightOnly {
                worst = worst.max((rough.mean() / smooth.mean() - 1.0).abs());
            }
        }
    }
    Ok(worst)
}

fn tangents(effort: Effort) -> anyhow::Result<f64> {
    let coordinates = [
        "0.3 0.3 0.3 0.3 0.3 0.3 0.3 0.3",
        "0 0 0.5 0.5 1 1 2 2",
        "0 0 1e-30 0 1e-30 1e-30 0 1e-30",
        "1 0 0 0 0 1 1 1",
        "0 0 1e30 0 1e30 1e30 0 1e30",
        "0 0 1 0 1 0 0 0",
    ];
    let camera = "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40";
    let mut worst: f64 = 0.0;
    for uv in coordinates {
        for map in [[0.5, 0.5, 1.0], [0.8, 0.4, 0.9], [1.0, 0.5, 0.5]] {
            let world = format!(
                "{WHITE}Material \"conductor\" \"rgb reflectance\" [1 1 1] \"float uroughness\" 0.05 \"float vroughness\" 0.6 Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"point2 uv\" [{uv}] \"integer indices\" [0 2 1 0 3 2]"
            );
            let mut description = described(camera, &world)?;
            description.textures.push(Texture::Constant(map.into()));
            let map = Some(TextureId(description.textures.len() as u32 - 1));
            description.materials.iter_mut().for_each(|m| m.normal_map = map);
            let settings = RenderSettings { max_depth: 16, ..RenderSettings::default() };
            worst = worst.max(picture(description, effort.of(64, 1024), settings, true)?.excess());
        }
    }
    Ok(worst)
}

/// Normal maps hold (n + 1) / 2.
const MAPS: [[f32; 3]; 10] = [
    [0.5, 0.5, 0.0],
    [1.0, 0.5, 0.0],
    [1.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
    [0.5, 0.5, 0.5],
    [0.0, 0.0, 0.0],
    [1e30, -1e30, 1e30],
    [0.5, 0.5, 0.500_001],
    // Outwards, but longer than 1.
    [0.5, 0.5, 2.0],
    [0.9, 0.5, 1.5],
];

fn inward_maps(effort: Effort) -> anyhow::Result<f64> {
    let camera = "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40";
    let sheet =
        "Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0] \"integer indices\" [0 2 1 0 3 2]";
    let mut worst: f64 = 0.0;
    for map in MAPS {
        for (material, name) in materials() {
            // As above: an open sheet of glass has the brighter inside of glass behind it.
            let shape = if name == "dielectric" { "Shape \"sphere\"" } else { sheet };
            let world = format!("{WHITE}{} {shape}", material(1.0, 0.2));
            let mut description = described(camera, &world)?;
            description.textures.push(Texture::Constant(map.into()));
            let map = Some(TextureId(description.textures.len() as u32 - 1));
            description.materials.iter_mut().for_each(|m| m.normal_map = map);
            let settings = RenderSettings { max_depth: 16, ..RenderSettings::default() };
            worst = worst.max(picture(description, effort.of(32, 512), settings, true)?.excess());
        }
    }
    Ok(worst)
}
