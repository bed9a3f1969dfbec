//! `sparing render`.

use super::Usage;
use super::options::{check_size, crop, duration, pixel, size, spp, threads};
use crate::session::console::{note, print};
use crate::session::memory;
use crate::session::progress::{Observer, ProgressMode, clock};
use crate::session::stats::{Rays, Statistics};
use crate::session::tev::Tev;
use crate::session::{Limits, Outcome, StoppedBy, render};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use sparing_image::atomic::{AtomicFile, check_writable};
use sparing_image::exr::{ExrAttribute, film_layers, write_exr};
use sparing_image::film::{Film, FilmOptions, TILE};
use sparing_image::png::write_png;
use sparing_render::integrator::Estimator;
use sparing_render::{BuildOptions, Needs, RenderSettings, Renderer, Scene};
use sparing_scene::SceneDescription;
use sparing_scene::description::{Projection, SamplerKind};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Arguments of `sparing render`.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// Scene: .pbrt, or .obj, which is framed and lit automatically.
    scene: PathBuf,
    /// Picture to write, .exr or .png; may be given several times. Default: the scene's own name, as .exr.
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Who gets samples.
    #[arg(long, value_enum, default_value_t)]
    policy: Policy,
    /// Sample points. Default: what the scene says, else sobol.
    #[arg(long, value_enum)]
    sampler: Option<Sampler>,
    /// Samples per pixel. Default: what the scene says, else 64.
    #[arg(long, value_parser = spp, allow_negative_numbers = true)]
    spp: Option<u32>,
    /// End sampling after this time: 90, 30s, 5m, 1h.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    time_limit: Option<Duration>,
    /// Seed of all random numbers.
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Threads, at most 1024; 0 is all.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: usize,
    /// Size of the picture, overriding the scene's.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Render only the pixels x0 <= x < x1, y0 <= y < y1: the same bits as in the full picture.
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = crop)]
    crop: Option<[u32; 4]>,
    /// Bounces after the camera ray, overriding the scene's.
    #[arg(long, value_name = "D", value_parser = clap::value_parser!(u32).range(0..=10_000), allow_negative_numbers = true)]
    max_depth: Option<u32>,
    /// Estimator of direct light, for studies.
    #[arg(long, value_enum, default_value_t, hide_short_help = true)]
    estimator: EstimatorChoice,
    /// Exposure of PNG pictures in stops.
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Add albedo, normal, depth and shape-count layers to EXR pictures.
    #[arg(long)]
    layers: bool,
    /// Faster intersection that may miss hits along the edges of meshes.
    #[arg(long)]
    no_robust: bool,
    /// Show the picture in tev, HDRView or another viewer that listens at HOST:PORT (tev's default port: 14158).
    #[arg(long, value_name = "HOST:PORT")]
    tev: Option<String>,
    /// How to report progress.
    #[arg(long, value_enum, default_value_t)]
    progress: ProgressMode,
    /// Write statistics as JSON to FILE; - is standard output.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Trace one sample of this pixel (with --sample) and print it instead of rendering.
    #[arg(long, value_name = "X,Y", value_parser = pixel, requires = "sample")]
    pixel: Option<[u32; 2]>,
    /// Index of the sample for --pixel.
    #[arg(long, value_name = "N", requires = "pixel")]
    sample: Option<u32>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Policy {
    /// Every pixel the same.
    #[default]
    Uniform,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Sampler {
    /// Owen-scrambled Sobol points.
    Sobol,
    /// Independent random points.
    Independent,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum EstimatorChoice {
    /// Light and BSDF sampling, combined.
    #[default]
    Mis,
    /// Light sampling only.
    Light,
    /// BSDF sampling only.
    Bsdf,
}

/// Runs the command.
pub(super) fn run(arguments: &RenderArguments) -> anyhow::Result<ExitCode> {
    if !arguments.exposure.is_finite() {
        return Err(Usage::error("the exposure must be a finite number"));
    }
    let load_start = Instant::now();
    let mut description = load(&arguments.scene)?;
    let load_seconds = load_start.elapsed().as_secs_f64();
    let plan = Plan::new(arguments, &mut description)?;
    for file in plan.outputs.iter().chain(arguments.stats.as_ref().filter(|p| !is_standard_output(p))) {
        check_writable(file)?;
    }
    plan.check_memory()?;
    let name = arguments.scene.display().to_string();
    let tev = arguments.tev.as_deref().map(|address| {
        Tev::connect(address, &format!("sparing {name}"))
            .with_context(|| format!("cannot reach a viewer at {address}"))
    });
    let tev = tev.transpose()?;

    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
    let build_start = Instant::now();
    let options = BuildOptions { threads: arguments.threads, robust: !arguments.no_robust };
    let scene = pool.install(|| Scene::build(description, options))?;
    let build_seconds = build_start.elapsed().as_secs_f64();
    for warning in &scene.warnings {
        note(format_args!("warning: {warning}"));
    }
    if let (Some(pixel), Some(sample)) = (arguments.pixel, arguments.sample) {
        return replay(&scene, &plan, pixel, sample);
    }

    let mut observer = Observer::new(arguments.progress, tev);
    plan.check_memory()?; // the scene has taken its part by now
    // From here on the first signal ends the render with its picture saved, the second ends the process.
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, 130, Arc::clone(&interrupt))?;
        signal_hook::flag::register(signal, Arc::clone(&interrupt))?;
    }
    let mut film = Film::new(plan.size, plan.crop, plan.film);
    let renderer = Renderer::new(&scene, plan.settings, plan.film);
    let limits = Limits { spp: plan.spp, time: arguments.time_limit };
    let outcome = pool.install(|| render(&renderer, &mut film, limits, &interrupt, &mut observer));

    let statistics = statistics(
        &name,
        &plan,
        &scene,
        &film,
        &outcome,
        pool.current_num_threads(),
        load_seconds,
        build_seconds,
    );
    save(&plan, &film, &statistics, arguments.exposure)?;
    if let Some(path) = &arguments.stats {
        write_stats(path, &statistics, arguments.progress)?;
    }
    observer.finish(outcome.stopped_by);
    report(&plan, &film, &statistics, arguments);
    Ok(if outcome.stopped_by == StoppedBy::Interrupt { ExitCode::from(130) } else { ExitCode::SUCCESS })
}

/// Loads a scene and prints its warnings; errors show the place in the file.
pub(super) fn load(path: &Path) -> anyhow::Result<SceneDescription> {
    let description = sparing_scene::load(path).map_err(|e| {
        let report = e.report();
        anyhow::anyhow!("{}", report.strip_prefix("error: ").unwrap_or(&report).trim_end())
    })?;
    for warning in &description.warnings {
        note(format_args!("warning: {warning}"));
    }
    Ok(description)
}

/// Everything decided before the scene is built.
struct Plan {
    outputs: Vec<PathBuf>,
    size: [u32; 2],
    crop: [u32; 4],
    spp: u32,
    film: FilmOptions,
    settings: RenderSettings,
    camera: Vec<(String, ExrAttribute)>,
}

impl Plan {
    fn new(a: &RenderArguments, d: &mut SceneDescription) -> anyhow::Result<Self> {
        if let Some([w, h]) = a.size {
            if [w, h] != [d.film.width, d.film.height] {
                d.film.crop = None; // the scene's crop is in pixels of the scene's size
            }
            (d.film.width, d.film.height) = (w, h);
        }
        let size = [d.film.width, d.film.height];
        check_size(size[0], size[1]).map_err(anyhow::Error::msg)?;
        let crop = a.crop.or(d.film.crop).unwrap_or([0, 0, size[0], size[1]]);
        if crop[2] > size[0] || crop[3] > size[1] {
            let [x0, y0, x1, y1] = crop;
            return Err(Usage::error(format!(
                "the crop {x0},{y0},{x1},{y1} reaches outside the picture of {}x{}",
                size[0], size[1]
            )));
        }
        let sampler = match a.sampler {
            Some(Sampler::Sobol) => SamplerKind::Sobol,
            Some(Sampler::Independent) => SamplerKind::Independent,
            None => d.sampler.kind,
        };
        let estimator = match a.estimator {
            EstimatorChoice::Mis => Estimator::Mis,
            EstimatorChoice::Light => Estimator::LightOnly,
            EstimatorChoice::Bsdf => Estimator::BsdfOnly,
        };
        let settings = RenderSettings {
            sampler,
            seed: a.seed.unwrap_or(d.sampler.seed),
            max_depth: a.max_depth.unwrap_or(d.integrator.max_depth),
            estimator,
            ..RenderSettings::default()
        };
        Ok(Self {
            outputs: outputs(a, d)?,
            size,
            crop,
            spp: a.spp.or(d.sampler.spp).unwrap_or(64),
            film: FilmOptions { auxiliary: a.layers, shapes: a.layers },
            settings,
            camera: camera_attributes(d),
        })
    }
}

/// Layers of a picture and their copies while it is written, bytes a pixel: never below what is measured.
const LAYER_BYTES: u64 = 128;

impl Plan {
    /// Whether the film and the pictures made of it fit into memory: an error now, not a kill in an hour.
    fn check_memory(&self) -> anyhow::Result<()> {
        let [x0, y0, x1, y1] = self.crop.map(u64::from);
        let tile = u64::from(TILE);
        let tiles = (x1.div_ceil(tile) - x0 / tile) * (y1.div_ceil(tile) - y0 / tile);
        let film = tiles * Film::new([TILE, TILE], [0, 0, TILE, TILE], self.film).bytes();
        let what = format!("a picture of {}x{}", x1 - x0, y1 - y0);
        memory::check(&what, film + (x1 - x0) * (y1 - y0) * LAYER_BYTES).map_err(anyhow::Error::msg)
    }
}

fn outputs(a: &RenderArguments, d: &SceneDescription) -> anyhow::Result<Vec<PathBuf>> {
    if a.output.is_empty() {
        let named = d.film.filename.as_ref().and_then(|f| Path::new(f).file_stem().map(PathBuf::from));
        let stem =
            named.or_else(|| a.scene.file_stem().map(PathBuf::from)).unwrap_or_else(|| "render".into());
        let mut name = stem.into_os_string(); // not with_extension: `a.b.pbrt` makes `a.b.exr`
        name.push(".exr");
        return Ok(vec![name.into()]);
    }
    for path in &a.output {
        if !is_exr(path) && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Usage::error(format!("{}: pictures are written as .exr or .png", path.display())));
        }
    }
    let mut targets: Vec<PathBuf> = Vec::new();
    for path in a.output.iter().chain(&a.stats) {
        let target = target(path);
        if targets.contains(&target) {
            return Err(Usage::error(format!("{} is to be written twice", path.display())));
        }
        targets.push(target);
    }
    Ok(a.output.clone())
}

/// The file that a path leads to, whether it exists already or not.
fn target(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let named = || Some(folder.canonicalize().ok()?.join(path.file_name()?));
    path.canonicalize().ok().or_else(named).unwrap_or_else(|| path.to_owned())
}

fn is_standard_output(path: &Path) -> bool {
    path == Path::new("-")
}

fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

#[allow(clippy::too_many_arguments, reason = "gathers what a render knows")]
fn statistics(
    name: &str,
    plan: &Plan,
    scene: &Scene,
    film: &Film,
    outcome: &Outcome,
    threads: usize,
    load_seconds: f64,
    build_seconds: f64,
) -> Statistics {
    let samples = film.samples();
    let rays = outcome.rays;
    let (major, minor, patch) = scene.embree().device().version();
    let mut needs = scene.needs();
    needs.set(Needs::AUXILIARY, plan.film.auxiliary);
    needs.set(Needs::SHAPE_COUNT, plan.film.shapes);
    Statistics {
        scene: name.to_owned(),
        width: film.width(),
        height: film.height(),
        policy: "uniform".to_owned(),
        model: None,
        seed: plan.settings.seed,
        threads,
        load_seconds,
        build_seconds,
        render_seconds: outcome.seconds,
        samples,
        average_spp: samples as f64 / (f64::from(film.width()) * f64::from(film.height())),
        rays: Rays { camera: rays.camera, bounce: rays.bounce, shadow: rays.shadow },
        rays_per_second: (rays.camera + rays.bounce + rays.shadow) as f64 / outcome.seconds.max(1e-9),
        layers: outcome.layers.clone(),
        invalid_samples: film.invalid_samples(),
        first_invalid: film.first_invalid().map(|([x, y], n)| [x, y, n]),
        stopped_by: outcome.stopped_by,
        peak_memory_bytes: memory::peak_bytes(),
        resident_bytes: memory::resident_bytes(),
        film_bytes: film.bytes(),
        embree_bytes: scene.statistics.embree_bytes,
        geometry_bytes: scene.statistics.geometry_bytes,
        texture_bytes: scene.statistics.texture_bytes,
        embree_version: format!("{major}.{minor}.{patch}"),
        needs: needs.names(),
        skipped: needs.complement().names(),
    }
}

fn save(plan: &Plan, film: &Film, s: &Statistics, exposure: f32) -> anyhow::Result<()> {
    for path in &plan.outputs {
        if is_exr(path) {
            write_exr(path, &film_layers(film, attributes(plan, s)))?;
        } else {
            write_png(path, film.width(), film.height(), &film.beauty(), exposure)?;
        }
    }
    Ok(())
}

fn attributes(plan: &Plan, s: &Statistics) -> Vec<(String, ExrAttribute)> {
    let text = |v: &str| ExrAttribute::String(v.to_owned());
    [
        ("software", text(&format!("Sparing {}", crate::VERSION))),
        ("sparing.scene", text(&s.scene)),
        ("sparing.policy", text(&s.policy)),
        (
            "sparing.sampler",
            text(if plan.settings.sampler == SamplerKind::Sobol { "sobol" } else { "independent" }),
        ),
        ("sparing.seed", text(&s.seed.to_string())),
        ("sparing.maxDepth", ExrAttribute::Int(plan.settings.max_depth.try_into().unwrap_or(i32::MAX))),
        ("sparing.spp", ExrAttribute::Int(plan.spp.try_into().unwrap_or(i32::MAX))),
        ("sparing.averageSpp", ExrAttribute::Double(s.average_spp)),
        ("sparing.renderSeconds", ExrAttribute::Double(s.render_seconds)),
        ("sparing.stoppedBy", text(stop_name(s.stopped_by))),
        ("sparing.embree", text(&s.embree_version)),
    ]
    .map(|(k, v)| (k.to_owned(), v))
    .into_iter()
    .chain(plan.camera.clone())
    .collect()
}

/// The camera by OpenEXR's standard names, and its optics by ours.
fn camera_attributes(d: &SceneDescription) -> Vec<(String, ExrAttribute)> {
    let c = &d.camera;
    // OpenEXR multiplies row vectors: its rows are our columns.
    let world_to_camera = c.camera_to_world.inverse().to_cols_array();
    let mut list = vec![("worldToCamera".to_owned(), ExrAttribute::M44f(world_to_camera))];
    if let Projection::Perspective { fov } = c.projection {
        list.push(("sparing.fieldOfView".to_owned(), ExrAttribute::Float(fov)));
    }
    list.push(("sparing.lensRadius".to_owned(), ExrAttribute::Float(c.lens_radius)));
    list.push(("sparing.focalDistance".to_owned(), ExrAttribute::Float(c.focal_distance)));
    list
}

fn stop_name(s: StoppedBy) -> &'static str {
    match s {
        StoppedBy::Spp => "spp",
        StoppedBy::TimeLimit => "time-limit",
        StoppedBy::Interrupt => "interrupt",
    }
}

fn write_stats(path: &Path, s: &Statistics, progress: ProgressMode) -> anyhow::Result<()> {
    if is_standard_output(path) {
        // Among progress lines the statistics are one line too.
        let one_line = progress == ProgressMode::Json;
        return print(if one_line { serde_json::to_string(s)? } else { serde_json::to_string_pretty(s)? });
    }
    let json = serde_json::to_string_pretty(s)?;
    let mut file = AtomicFile::create(path)?;
    file.write_all(json.as_bytes())
        .and_then(|()| file.write_all(b"\n"))
        .with_context(|| format!("cannot write {}", path.display()))?;
    file.commit()?;
    Ok(())
}

fn report(plan: &Plan, film: &Film, s: &Statistics, arguments: &RenderArguments) {
    if s.invalid_samples > 0 {
        let place = s
            .first_invalid
            .map_or(String::new(), |[x, y, n]| format!("; the first: --pixel {x},{y} --sample {n}"));
        note(format_args!(
            "warning: {} samples were not finite or negative and count as black{place}",
            s.invalid_samples
        ));
    }
    let empty = film.map(|t, i| t.pixels[i].count() == 0).into_iter().filter(|empty| *empty).count();
    if empty > 0 {
        note(format_args!("warning: {empty} pixels got no sample before the stop and are black"));
    }
    if arguments.progress == ProgressMode::None || arguments.progress == ProgressMode::Json {
        return;
    }
    let files: Vec<String> = plan.outputs.iter().map(|p| p.display().to_string()).collect();
    note(format_args!(
        "{}: {}x{}, {:.1} samples per pixel, {} ({:.2} million samples and {:.1} million rays a second)",
        files.join(", "),
        s.width,
        s.height,
        s.average_spp,
        clock(s.render_seconds),
        s.samples as f64 / s.render_seconds.max(1e-9) / 1e6,
        s.rays_per_second / 1e6,
    ));
    if s.stopped_by != StoppedBy::Spp {
        note(format_args!("stopped by {}; the picture so far is saved", stop_name(s.stopped_by)));
    }
}

/// Traces one sample and prints it.
fn replay(scene: &Scene, plan: &Plan, pixel: [u32; 2], sample: u32) -> anyhow::Result<ExitCode> {
    let [x, y] = pixel;
    if x >= plan.size[0] || y >= plan.size[1] {
        bail!("pixel {x},{y} is outside the picture of {}x{}", plan.size[0], plan.size[1]);
    }
    let options = FilmOptions { auxiliary: true, shapes: false };
    let mut film = Film::new(plan.size, [x, y, x + 1, y + 1], options);
    let renderer = Renderer::new(scene, plan.settings, options);
    let tile = &mut film.tiles[0];
    let rays = renderer.sample_pixel(tile, 0, sample, sample + 1);
    let value = tile.pixels[0].mean();
    let a = tile.auxiliary[0];
    let json = serde_json::json!({
        "pixel": pixel,
        "sample": sample,
        "radiance": value.to_array(),
        "invalid": tile.invalid > 0,
        "first_hit": (a.hits > 0).then(|| serde_json::json!({
            "albedo": a.albedo.to_array(), "normal": a.normal.to_array(), "depth": a.depth,
        })),
        "bounce_rays": rays.bounce,
        "shadow_rays": rays.shadow,
    });
    print(serde_json::to_string_pretty(&json)?)?;
    Ok(ExitCode::SUCCESS)
}
