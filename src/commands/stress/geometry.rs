//! Surfaces in hard places.

use super::case::{Case, Effort};
use super::scenes::{Picture, WHITE, described, render, with};
use embree4::{Ray, RayHit};
use glam::Vec3;
use sparing_render::{BuildOptions, Scene};
use sparing_scene::description::Geometry;
use sparing_scene::generate::icosphere;

const AREA: &str = "Geometry";

pub(super) const CASES: &[Case] = &[
    Case {
        area: AREA,
        name: "scales",
        does: "A white sphere in white light, of a radius of 1e-6 to 1e6: it must shine as its surroundings, with 1.",
        unit: "largest error of the mean",
        bound: 2e-3,
        measure: scales,
    },
    Case {
        area: AREA,
        name: "offsets",
        does: "The same sphere of radius 1 as a mesh, 1e2 to 1e4 away from the origin.",
        unit: "largest error of the mean",
        bound: 2e-3,
        measure: |e| offsets(e, &[1e2, 1e3, 1e4]),
    },
    Case {
        area: AREA,
        name: "offset-1e6",
        does: "1e6 away, where a unit has 16 steps of f32: the sphere is a staircase, but no light is made or lost by much.",
        unit: "error of the mean",
        bound: 0.05,
        measure: |e| {
            let p = render_at(1e6, e.of(16, 256))?;
            Ok(p.off_white())
        },
    },
    Case {
        area: AREA,
        name: "leaks-robust",
        does: "A camera in a closed box of 768 thin triangles, light outside: pixels that see any.",
        unit: "pixels",
        bound: 0.0,
        measure: |e| Ok(leaks(true, e)?.lit()),
    },
    Case {
        area: AREA,
        name: "leaks-fast",
        does: "The same with --no-robust, which may miss edges: the light that comes in, of 1 outside.",
        unit: "mean",
        bound: 1e-4,
        measure: |e| Ok(leaks(false, e)?.mean()),
    },
    Case {
        area: AREA,
        name: "leaks-wedges",
        does: "Closed white wedges of 1 to 30 degrees with a camera in them that looks along the edge's cross section, light outside: \
               pixels that see any.",
        unit: "pixels",
        bound: 0.0,
        measure: wedges,
    },
    Case {
        area: AREA,
        name: "rays-at-edges",
        does: "Rays from three places within a ball of 5,120 triangles to points on all of its edges: those that miss.",
        unit: "rays",
        bound: 0.0,
        measure: |e| missed(true, 1..e.of(4, 64)),
    },
    Case {
        area: AREA,
        name: "rays-at-vertices",
        does: "The same to all of its vertices, to the last bit: the part that misses.",
        unit: "of the rays",
        bound: 0.01,
        measure: |_| missed(true, 0..1),
    },
    Case {
        area: AREA,
        name: "rays-at-edges-fast",
        does: "To points on edges with --no-robust, which may miss them: the part that does.",
        unit: "of the rays",
        bound: 0.25,
        measure: |e| missed(false, 1..e.of(4, 64)),
    },
    Case {
        area: AREA,
        name: "degenerate-triangles",
        does: "Slivers of 1e-20, triangles without area, points and duplicates in a mesh: samples that are not finite.",
        unit: "values",
        bound: 0.0,
        measure: |e| Ok(render(&degenerate(), e.of(64, 2048))?.bad()),
    },
    Case {
        area: AREA,
        name: "coplanar-layers",
        does: "Ten white squares 1e-6 apart in white light: more light than there is, or pixels not finite.",
        unit: "excess of the mean",
        bound: 2e-3,
        measure: coplanar,
    },
    Case {
        area: AREA,
        name: "interpenetrating-glass",
        does: "Two glass spheres that overlap, in white light, which must look white.",
        unit: "error of the mean",
        bound: 2e-3,
        measure: glass,
    },
    Case {
        area: AREA,
        name: "hard-instances",
        does: "A white sphere placed with shear, a mirror and a scale of 1e-4 in one axis, in white light.",
        unit: "error of the mean",
        bound: 2e-3,
        measure: instances,
    },
    Case {
        area: AREA,
        name: "camera-on-a-surface",
        does: "A camera exactly on a white wall that it looks along, in white light: pixels that are not finite or too bright.",
        unit: "excess of the mean",
        bound: 2e-3,
        measure: |e| {
            let camera = "LookAt 0 0 0  0 0 1  0 1 0 Camera \"perspective\" \"float fov\" 90";
            let wall = "Material \"diffuse\" \"rgb reflectance\" [1 1 1] Shape \"bilinearmesh\" \"point3 P\" [-9 0 -9 9 0 -9 -9 0 9 9 0 9]";
            let p = with(camera, &format!("{WHITE}{wall}"), e.of(64, 1024), 64, true)?;
            Ok(p.excess())
        },
    },
    Case {
        area: AREA,
        name: "light-inside-glass",
        does: "A glowing sphere in a glass one: samples that are not finite.",
        unit: "values",
        bound: 0.0,
        measure: |e| {
            let world = "Material \"dielectric\" Shape \"sphere\" \"float radius\" 1.2 AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] Shape \"sphere\" \"float radius\" 0.3 AttributeEnd";
            let p = render(world, e.of(64, 2048))?;
            Ok(p.bad() + if p.lit() > 10.0 { 0.0 } else { 1.0 })
        },
    },
    Case {
        area: AREA,
        name: "grazing-rays",
        does: "A white plain seen at angles to 1e-4 of a degree, in white light.",
        unit: "error of the mean",
        bound: 2e-3,
        measure: grazing,
    },
];

const WHITE_MATERIAL: &str = "Material \"diffuse\" \"rgb reflectance\" [1 1 1]\n";

fn scales(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for exponent in -6..=6 {
        let r = 10_f64.powi(exponent);
        let camera = format!("LookAt 0 0 {}  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40", -4.0 * r);
        let world = format!("{WHITE}{WHITE_MATERIAL}Shape \"sphere\" \"float radius\" {r}");
        worst = worst.max(Picture::off_white(&with(&camera, &world, effort.of(16, 256), 64, true)?));
    }
    Ok(worst)
}

/// A sphere of quads around a point.
fn ball(center: f64) -> String {
    let (rings, columns) = (32, 64);
    let (mut points, mut indices) = (String::new(), String::new());
    for i in 0..=rings {
        for k in 0..=columns {
            let theta = std::f64::consts::PI * f64::from(i) / f64::from(rings);
            let phi = std::f64::consts::TAU * f64::from(k % columns) / f64::from(columns);
            let p = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
            points += &format!("{} {} {} ", p[0] + center, p[1] + center, p[2] + center);
        }
    }
    for i in 0..rings {
        for k in 0..columns {
            let at = i * (columns + 1) + k;
            let (right, below) = (at + 1, at + columns + 1);
            indices += &format!("{at} {below} {right} {right} {below} {} ", below + 1);
        }
    }
    format!("Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [{indices}]")
}

fn render_at(center: f64, spp: u32) -> anyhow::Result<Picture> {
    let c = center;
    let camera =
        format!("LookAt {c} {c} {}  {c} {c} {c}  0 1 0 Camera \"perspective\" \"float fov\" 40", c - 4.0);
    with(&camera, &format!("{WHITE}{WHITE_MATERIAL}{}", ball(center)), spp, 64, true)
}

fn offsets(effort: Effort, centers: &[f64]) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for &center in centers {
        worst = worst.max(Picture::off_white(&render_at(center, effort.of(16, 256))?));
    }
    Ok(worst)
}

fn leaks(robust: bool, effort: Effort) -> anyhow::Result<Picture> {
    let n = 8;
    let (mut points, mut indices) = (String::new(), String::new());
    let mut count = 0;
    for side in 0..6 {
        for i in 0..=n {
            for k in 0..=n {
                // Uneven steps make thin triangles; edges of neighbouring sides have the same points.
                let step = |j: i32| {
                    let t = f64::from(j) / f64::from(n);
                    let bent = t * t * (3.0 - 2.0 * t);
                    ((2.0 * bent - 1.0) as f32).to_string()
                };
                let (u, v, w) = (step(i), step(k), if side % 2 == 0 { "-1" } else { "1" });
                let p = match side / 2 {
                    0 => format!("{w} {u} {v} "),
                    1 => format!("{v} {w} {u} "),
                    _ => format!("{u} {v} {w} "),
                };
                points += &p;
            }
        }
        for i in 0..n {
            for k in 0..n {
                let at = count + i * (n + 1) + k;
                let below = at + n + 1;
                indices += &format!("{at} {below} {} {} {below} {} ", at + 1, at + 1, below + 1);
            }
        }
        count += (n + 1) * (n + 1);
    }
    let camera = "LookAt 0.1 0.2 0.05  0.3 0.4 1  0 1 0 Camera \"perspective\" \"float fov\" 150";
    let world = format!(
        "{WHITE}{WHITE_MATERIAL}Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [{indices}]"
    );
    with(camera, &world, effort.of(256, 16_384), 24, robust)
}

fn degenerate() -> String {
    let p =
        "-1 -1 0  1 -1 0  1 1 0  -1 1 0  0 1e-20 0  0 0 0  0 0 0  0.5 0.5 1e-30  1e-38 0 0  1e30 1e30 1e30";
    let i = "0 1 2  0 2 3  0 1 4  5 6 5  5 5 5  5 6 8  0 1 2  0 2 3  7 8 5  4 8 6  0 1 9";
    format!("{WHITE}{WHITE_MATERIAL}Shape \"trianglemesh\" \"point3 P\" [{p}] \"integer indices\" [{i}]")
}

fn coplanar(effort: Effort) -> anyhow::Result<f64> {
    let mut world = format!("{WHITE}{WHITE_MATERIAL}");
    for k in 0..10 {
        let z = f64::from(k) * 1e-6;
        world += &format!(
            "Shape \"trianglemesh\" \"point3 P\" [-1 -1 {z} 1 -1 {z} 1 1 {z} -1 1 {z}] \"integer indices\" [0 1 2 0 2 3]\n"
        );
    }
    let p = render(&world, effort.of(64, 1024))?;
    Ok(p.excess())
}

fn glass(effort: Effort) -> anyhow::Result<f64> {
    let world = format!(
        "{WHITE}Material \"dielectric\" \"float eta\" 1.5 Shape \"sphere\" \"float radius\" 1 Translate 0.7 0.1 0.2 Shape \"sphere\" \"float radius\" 0.9"
    );
    let camera = "LookAt 0 0 -4  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 40";
    let p = with(camera, &world, effort.of(256, 4096), 1000, true)?;
    Ok(p.off_white())
}

fn instances(effort: Effort) -> anyhow::Result<f64> {
    let placed = [
        "ConcatTransform [1 0 0 0  0.8 1 0 0  0 0.3 1 0  0 0 0 1]",
        "Scale -1 1 1",
        "Scale 1 1 1e-4",
        "Scale 1e-4 1 -1 Rotate 30 1 1 0",
    ];
    let mut worst: f64 = 0.0;
    for transform in placed {
        let world = format!(
            "{WHITE}ObjectBegin \"a\" {WHITE_MATERIAL}{} ObjectEnd AttributeBegin {transform} ObjectInstance \"a\" AttributeEnd",
            ball(0.0)
        );
        let p = render(&world, effort.of(32, 512))?;
        worst = worst.max(p.off_white());
    }
    Ok(worst)
}

fn grazing(effort: Effort) -> anyhow::Result<f64> {
    let mut worst: f64 = 0.0;
    for height in [1e-2, 1e-4, 1e-6] {
        let camera =
            format!("LookAt 0 {height} 0  0 {height} 1  0 1 0 Camera \"perspective\" \"float fov\" {}", 1.0);
        let plain = "Shape \"bilinearmesh\" \"point3 P\" [-100 0 -1 100 0 -1 -100 0 1000 100 0 1000]";
        let p = with(&camera, &format!("{WHITE}{WHITE_MATERIAL}{plain}"), effort.of(64, 1024), 64, true)?;
        worst = worst.max(p.off_white());
    }
    Ok(worst)
}

fn wedges(effort: Effort) -> anyhow::Result<f64> {
    let mut lit = 0.0;
    for degrees in [1.0_f64, 2.0, 5.0, 10.0, 20.0, 30.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let points =
            [-1, 1].map(|y| format!("0 {y} 0  1 {y} 0  {} {y} {} ", cos as f32, sin as f32)).concat();
        let (half_sin, half_cos) = (0.5 * degrees).to_radians().sin_cos();
        let from = |r: f64| format!("{} 0.1 {}", r * half_cos, r * half_sin);
        let camera =
            format!("LookAt {} {} 0 1 0 Camera \"perspective\" \"float fov\" 90", from(0.02), from(0.0));
        let world = format!(
            "{WHITE}{WHITE_MATERIAL}Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [0 1 2 3 5 4 0 4 1 0 3 4 1 5 2 1 4 5 2 3 0 2 5 3]"
        );
        lit += with(&camera, &world, effort.of(256, 1024), 64, true)?.lit();
    }
    Ok(lit)
}

/// The part of rays from three points in the ball that misses, aimed at 64ths of its edges.
fn missed(robust: bool, steps: std::ops::Range<u8>) -> anyhow::Result<f64> {
    let mesh = icosphere(4);
    let mut description = described("Camera \"perspective\"", "Shape \"sphere\"")?;
    description.shapes[0].geometry = Geometry::Triangles(mesh.clone());
    let scene = Scene::build(description, BuildOptions { threads: 0, robust })?;
    let (mut rays, mut out) = (0, 0);
    for origin in [Vec3::ZERO, Vec3::new(0.1, -0.3, 0.2), Vec3::new(-0.01, 0.9, 0.02)] {
        for [a, b, c] in &mesh.indices {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let [from, to] = [from, to].map(|i| Vec3::from(mesh.positions[*i as usize]));
                for k in steps.clone() {
                    let aim = from.lerp(to, f32::from(k) / 64.0) - origin;
                    for direction in [aim, aim.normalize()] {
                        let mut query = RayHit::new(Ray::new(origin.to_array(), direction.to_array()));
                        scene.embree().intersect(&mut query);
                        rays += 1;
                        out += u32::from(query.hit.geom_id == embree4::INVALID_ID);
                    }
                }
            }
        }
    }
    Ok(f64::from(out) / f64::from(rays))
}
