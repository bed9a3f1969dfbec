//! Small scenes for tests.
#![allow(dead_code, reason = "each test uses its part")]

use glam::Vec3;
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::description::{
    ColorInput, Emission, Geometry, Material, MaterialId, MaterialKind, PixelFilter, QuadMesh, Shape,
    TriangleMesh,
};

/// A scene of 8 x 8 pixels with these materials and a camera at the origin looking along +z.
pub fn scene_with(materials: Vec<MaterialKind>) -> SceneDescription {
    let mut d = SceneDescription::default();
    d.film.width = 8;
    d.film.height = 8;
    d.filter = PixelFilter::Box { radius: [0.5, 0.5] };
    d.materials = materials
        .into_iter()
        .map(|kind| Material { name: String::new(), kind, normal_map: None, bump: None })
        .collect();
    d
}

/// Lambert.
pub fn diffuse(albedo: f32) -> MaterialKind {
    MaterialKind::Diffuse { reflectance: ColorInput::Constant(Vec3::splat(albedo)) }
}

/// A shape of material 0.
pub fn shape(geometry: Geometry) -> Shape {
    Shape {
        geometry,
        material: MaterialId(0),
        emission: None,
        alpha: None,
        alpha_cutoff: None,
        reverse_orientation: false,
    }
}

/// A one-sided emitter of material 0.
pub fn emitter(geometry: Geometry, radiance: f32) -> Shape {
    let radiance = ColorInput::Constant(Vec3::splat(radiance));
    Shape { emission: Some(Emission { radiance, two_sided: false }), ..shape(geometry) }
}

/// A square of side `2 h` at `center` spanned by `x` and `y`; its normal is `x` cross `y`.
pub fn square(center: Vec3, x: Vec3, y: Vec3) -> Geometry {
    let p = [center - x - y, center + x - y, center + x + y, center - x + y];
    Geometry::Triangles(TriangleMesh {
        positions: p.map(|v| v.to_array()).to_vec(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    })
}

const FACES: [[u32; 4]; 6] =
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];

fn corners(h: f32) -> Vec<[f32; 3]> {
    (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { h } else { -h })).collect()
}

/// A cube of half-size `h`, normals outwards.
pub fn closed_box(h: f32) -> Geometry {
    let indices = FACES.iter().flat_map(|f| [[f[0], f[2], f[1]], [f[0], f[3], f[2]]]).collect();
    Geometry::Triangles(TriangleMesh { positions: corners(h), indices, ..TriangleMesh::default() })
}

/// The same of quads.
pub fn quad_box(h: f32) -> Geometry {
    let indices = FACES.iter().map(|f| [f[0], f[3], f[2], f[1]]).collect();
    Geometry::Quads(QuadMesh { positions: corners(h), indices, normals: None, uvs: None })
}

/// A prism whose sides meet at `degrees` in an edge along y.
pub fn wedge(degrees: f32) -> Geometry {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let ends = [-1.0, 1.0].map(|y| [[0.0, y, 0.0], [1.0, y, 0.0], [cos, y, sin]]);
    let indices =
        vec![[0, 1, 2], [3, 5, 4], [0, 4, 1], [0, 3, 4], [1, 5, 2], [1, 4, 5], [2, 3, 0], [2, 5, 3]];
    Geometry::Triangles(TriangleMesh { positions: ends.concat(), indices, ..TriangleMesh::default() })
}

/// Builds and renders with `spp` samples.
pub fn render(description: SceneDescription, settings: RenderSettings, spp: u32) -> Film {
    render_with(description, settings, spp, FilmOptions::default())
}

/// Builds and renders with `spp` samples.
pub fn render_with(
    description: SceneDescription,
    settings: RenderSettings,
    spp: u32,
    options: FilmOptions,
) -> Film {
    let size = [description.film.width, description.film.height];
    let crop = description.film.crop.unwrap_or([0, 0, size[0], size[1]]);
    let scene = Scene::build(description, BuildOptions::default()).expect("the scene builds");
    let mut film = Film::new(size, crop, options);
    let wave = Wave::default();
    Renderer::new(&scene, settings, options).run(&mut film, &wave, |_, _| spp);
    assert_eq!(film.invalid_samples(), 0, "first at {:?}", film.named_invalid().next());
    film
}

/// Mean of all channels of all pixels, and its standard error as if samples were independent.
pub fn film_mean(film: &Film) -> (f64, f64) {
    let n = f64::from(film.width() * film.height());
    let means = film.map(|t, i| (t.pixels[i].mean().element_sum() / 3.0, t.pixels[i].variance_of_mean().x));
    let mean = means.iter().map(|m| m.0).sum::<f64>() / n;
    (mean, (means.iter().map(|m| m.1).sum::<f64>() / n / n).sqrt())
}
