//! One scene, ready to render, and one render.

use super::plan::{Plan, SceneFile};
use crate::commands::options::check_size;
use crate::session::cpu::thread_seconds;
use crate::session::memory;
use indicatif::ProgressBar;
use sparing_adaptive::goal::Bounds;
use sparing_adaptive::layers::{Limits, Observe, Outcome, Progress, StoppedBy, render};
use sparing_adaptive::policy::Policy;
use sparing_adaptive::state::State;
use sparing_image::film::{Film, FilmOptions, TILE};
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use sparing_scene::description::SamplerKind;
use std::sync::atomic::AtomicBool;

/// A scene with its picture's size. Crops are left out.
pub(super) struct Stage {
    pub(super) name: String,
    pub(super) size: [u32; 2],
    pub(super) fingerprint: u64,
    scene: Scene,
    max_depth: u32,
}

/// One finished render.
pub(super) struct Rendered {
    pub(super) film: Film,
    pub(super) outcome: Outcome,
    /// Processor time over the number of threads, where the system tells.
    pub(super) cpu_seconds: Option<f64>,
}

/// Films and pictures of one render at a time, bytes a pixel besides the film.
const PICTURE_BYTES: u64 = 256;

impl Stage {
    pub(super) fn new(file: &SceneFile, plan: &Plan) -> anyhow::Result<Self> {
        let mut description = plan.files.load(&file.path)?;
        if let Some([w, h]) = plan.size {
            (description.film.width, description.film.height) = (w, h);
        }
        let size = [description.film.width, description.film.height];
        check_size(size[0], size[1]).map_err(anyhow::Error::msg)?;
        let tiles = size.map(|s| u64::from(s.div_ceil(TILE)));
        let options = FilmOptions { auxiliary: false, shapes: true, luminance: false };
        let film = tiles[0] * tiles[1] * Film::new([TILE, TILE], [0, 0, TILE, TILE], options).bytes();
        let pictures = u64::from(size[0]) * u64::from(size[1]) * PICTURE_BYTES;
        memory::check(&format!("a picture of {}x{}", size[0], size[1]), film + pictures)
            .map_err(anyhow::Error::msg)?;
        let max_depth = description.integrator.max_depth;
        let options = BuildOptions { threads: plan.threads, robust: true };
        let scene = Scene::build(description, options)?;
        Ok(Self { name: file.name.clone(), size, fingerprint: file.fingerprint, scene, max_depth })
    }

    /// Pixels of the picture.
    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.size[0]) * f64::from(self.size[1])
    }

    /// Renders with Owen-scrambled Sobol points; `None` if interrupted.
    pub(super) fn render(
        &self,
        policy: &mut dyn Policy,
        bounds: Bounds,
        seed: u64,
        interrupt: &AtomicBool,
        bar: Option<&ProgressBar>,
    ) -> Option<Rendered> {
        let options = policy.film_options();
        let settings = RenderSettings {
            sampler: SamplerKind::Sobol,
            seed,
            max_depth: self.max_depth,
            ..RenderSettings::default()
        };
        let mut state = State::new(Film::new(self.size, [0, 0, self.size[0], self.size[1]], options));
        let renderer = Renderer::new(&self.scene, settings, options);
        let limits = Limits { bounds, time: None, exposure: None };
        let before = thread_seconds();
        let outcome = render(&renderer, &mut state, policy, &limits, interrupt, &mut Watch(bar));
        let spent = thread_seconds().zip(before).map(|(after, before)| (after - before).max(0.0));
        let cpu_seconds = spent.map(|s| s / rayon::current_num_threads() as f64);
        (outcome.stopped_by != StoppedBy::Interrupt).then_some(Rendered {
            film: state.film,
            outcome,
            cpu_seconds,
        })
    }
}

/// Shows where a render is.
struct Watch<'a>(Option<&'a ProgressBar>);

impl Observe for Watch<'_> {
    fn tick(&self, p: &Progress) {
        if let Some(bar) = self.0 {
            bar.set_prefix(format!("{} spp, {} pixels", p.spp, p.active_pixels));
        }
    }

    fn barrier(&mut self, _film: &Film, progress: &Progress) {
        self.tick(progress);
    }
}
