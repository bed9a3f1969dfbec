//! The same picture, bit for bit, for any number of threads, any crop and any split into waves.

mod common;

use common::{closed_box, diffuse, emitter, scene_with, shape, square};
use glam::Vec3;
use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::description::{ColorInput, FloatInput, MaterialId, MaterialKind, Roughness};

const SIZE: [u32; 2] = [45, 37];
const OPTIONS: FilmOptions = FilmOptions { auxiliary: true, shapes: true, luminance: false };

fn description() -> SceneDescription {
    let glass = MaterialKind::Dielectric {
        eta: 1.5,
        roughness: Roughness { u: FloatInput::Constant(0.2), v: FloatInput::Constant(0.2), remap: false },
        tint: ColorInput::Constant(Vec3::ONE),
    };
    let mut d = scene_with(vec![diffuse(0.6), glass]);
    (d.film.width, d.film.height) = (SIZE[0], SIZE[1]);
    d.camera.lens_radius = 0.05;
    d.camera.focal_distance = 3.0;
    d.filter = sparing_scene::description::PixelFilter::default();
    let mut room = shape(closed_box(4.0));
    room.reverse_orientation = true;
    let mut glass = shape(closed_box(0.5));
    glass.material = MaterialId(1);
    if let sparing_scene::description::Geometry::Triangles(m) = &mut glass.geometry {
        m.positions.iter_mut().for_each(|p| p[2] += 2.5);
    }
    let lamp = square(Vec3::new(0.0, 3.9, 1.0), Vec3::X, Vec3::Z);
    d.shapes = vec![room, glass, emitter(lamp, 10.0)];
    d
}

fn picture(threads: usize, crop: [u32; 4], waves: &[u32]) -> Film {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| {
        let scene = Scene::build(description(), BuildOptions { threads, robust: true }).expect("builds");
        let renderer = Renderer::new(&scene, RenderSettings::default(), OPTIONS);
        let mut film = Film::new(SIZE, crop, OPTIONS);
        for target in waves {
            renderer.run(&mut film, &Wave::default(), |_, _| *target);
        }
        film
    })
}

/// Everything a film keeps, as bits.
fn bits(film: &Film) -> Vec<Vec<u64>> {
    film.map(|t, i| {
        let (p, a) = (&t.pixels[i], &t.auxiliary[i]);
        let mut v: Vec<u64> = p
            .blocks()
            .flat_map(|(s, n)| s.to_array().map(f64::to_bits).into_iter().chain([u64::from(n)]))
            .collect();
        v.extend(p.squares().to_array().map(f64::to_bits));
        v.extend(
            [a.albedo, a.normal]
                .iter()
                .flat_map(|x| x.to_array())
                .chain([a.depth])
                .map(|x| u64::from(x.to_bits())),
        );
        v.extend([u64::from(a.hits), u64::from(t.shapes[i].len())]);
        v
    })
}

const FULL: [u32; 4] = [0, 0, SIZE[0], SIZE[1]];

#[test]
fn threads_and_waves_do_not_matter() {
    let reference = bits(&picture(1, FULL, &[8, 16, 32, 48]));
    for threads in [2, 5] {
        assert!(bits(&picture(threads, FULL, &[8, 16, 32, 48])) == reference, "{threads} threads");
    }
    assert!(bits(&picture(2, FULL, &[48])) == reference, "one wave");
    assert!(bits(&picture(2, FULL, &[16, 48])) == reference, "two waves");
    assert!(bits(&picture(1, FULL, &[8, 16, 32])) != reference, "fewer samples must differ");
}

#[test]
fn crops_are_parts_of_the_full_picture() {
    let full = bits(&picture(2, FULL, &[24]));
    for crop in [[0, 0, 7, 5], [13, 9, 30, 21], [44, 36, 45, 37], [8, 8, 16, 16]] {
        let [x0, y0, x1, _] = crop;
        let part = bits(&picture(2, crop, &[8, 24]));
        for (k, pixel) in part.iter().enumerate() {
            let (x, y) = (x0 + k as u32 % (x1 - x0), y0 + k as u32 / (x1 - x0));
            assert!(*pixel == full[(y * SIZE[0] + x) as usize], "crop {crop:?} pixel {x},{y}");
        }
    }
}
