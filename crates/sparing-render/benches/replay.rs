//! Rays a second of the renderer as a share of bare Embree tracing the very same rays in the same run.
//!
//!     cargo bench -p sparing-render --bench replay [-- SCENE...]
//!
//! Without arguments: the Cornell box, a 70,000-triangle and a 500,000-triangle mesh of our own. Prints a Markdown
//! table: medians of paired runs, one thread and all.

use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::description::{Geometry, TriangleMesh};
use sparing_scene::generate;
use std::path::{Path, PathBuf};
use std::time::Instant;

const SIZE: u32 = 128;
const SPP: u32 = 32;
const RUNS: usize = 7;

fn main() {
    let paths: Vec<PathBuf> =
        std::env::args().skip(1).filter(|a| !a.starts_with("--")).map(PathBuf::from).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut scenes: Vec<(String, SceneDescription)> = Vec::new();
    for path in &paths {
        scenes.push((path.display().to_string(), load(path)));
    }
    if paths.is_empty() {
        scenes.push(("Cornell box".into(), load(&root.join("scenes/cornell-box.pbrt"))));
        for (name, level) in [("mesh of 70k triangles", 700), ("mesh of 500k triangles", 2000)] {
            let mut d = load(&root.join("scenes/mesh.pbrt"));
            replace_mesh(&mut d, level);
            scenes.push((name.into(), d));
        }
    }
    println!("| scene | threads | renderer, M rays/s | replay, M rays/s | share | M samples/s |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for (name, mut d) in scenes {
        (d.film.width, d.film.height) = (SIZE, SIZE);
        let settings = RenderSettings { max_depth: d.integrator.max_depth, ..RenderSettings::default() };
        let triangles = d.triangle_count();
        let scene = Scene::build(d, BuildOptions::default()).expect("the scene builds");
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        for threads in if threads > 1 { vec![1, threads] } else { vec![1] } {
            measure(&format!("{name} ({triangles})"), &scene, settings, threads);
        }
    }
}

fn load(path: &Path) -> SceneDescription {
    sparing_scene::load(path).unwrap_or_else(|e| panic!("{}", e.report()))
}

/// Puts a torus knot of about n² / 7 triangles where the scene's own mesh was.
fn replace_mesh(d: &mut SceneDescription, n: u32) {
    let largest = d.shapes.iter_mut().max_by_key(|s| s.geometry.triangle_count()).expect("a shape");
    let Geometry::Triangles(old) = &largest.geometry else { panic!("a mesh") };
    let new = generate::torus_knot(2, 3, n, n / 14, 0.35);
    largest.geometry = Geometry::Triangles(fit(new, old));
}

/// Moves and scales a mesh into the bounds of another.
fn fit(mut mesh: TriangleMesh, into: &TriangleMesh) -> TriangleMesh {
    let bounds = |m: &TriangleMesh| {
        m.positions.iter().fold(([f32::MAX; 3], [f32::MIN; 3]), |(lo, hi), p| {
            ([0, 1, 2].map(|k| lo[k].min(p[k])), [0, 1, 2].map(|k| hi[k].max(p[k])))
        })
    };
    let ((a, b), (c, d)) = (bounds(&mesh), bounds(into));
    let scale = (0..3).map(|k| (d[k] - c[k]) / (b[k] - a[k])).fold(f32::MAX, f32::min);
    for p in &mut mesh.positions {
        *p = [0, 1, 2].map(|k| (p[k] - 0.5 * (a[k] + b[k])) * scale + 0.5 * (c[k] + d[k]));
    }
    mesh
}

fn measure(name: &str, scene: &Scene, settings: RenderSettings, threads: usize) {
    let options = FilmOptions::default();
    let renderer = Renderer::new(scene, settings, options);
    let film = || Film::new([SIZE, SIZE], [0, 0, SIZE, SIZE], options);
    let recording = renderer.record(&mut film(), SPP);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    let (mut shares, mut rendered, mut replayed) = (Vec::new(), Vec::new(), Vec::new());
    let mut samples = Vec::new();
    for _ in 0..RUNS {
        let mut f = film();
        let start = Instant::now();
        let rays = pool.install(|| renderer.run(&mut f, &Wave::default(), |_, _| SPP));
        let seconds = start.elapsed().as_secs_f64();
        let traced = rays.camera + rays.bounce + rays.shadow;
        assert_eq!(traced, recording.rays(), "the recording holds all rays");
        let start = Instant::now();
        std::hint::black_box(pool.install(|| recording.replay(scene)));
        let bare = start.elapsed().as_secs_f64();
        rendered.push(traced as f64 / seconds / 1e6);
        replayed.push(traced as f64 / bare / 1e6);
        shares.push(bare / seconds);
        samples.push(rays.camera as f64 / seconds / 1e6);
    }
    println!(
        "| {name} | {threads} | {:.1} | {:.1} | {:.2} | {:.2} |",
        median(&mut rendered),
        median(&mut replayed),
        median(&mut shares),
        median(&mut samples)
    );
}

fn median(v: &mut [f64]) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}
