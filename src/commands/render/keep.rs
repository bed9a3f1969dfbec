//! `--checkpoint` and `--resume`.

use super::RenderArguments;
use super::identity::identity;
use super::plan::Plan;
use crate::commands::Usage;
use crate::session::checkpoint::{self, Header, Identity, Lock, Part, Timer};
use crate::session::console::note;
use anyhow::{Context, bail};
use sparing_adaptive::state::State;
use sparing_image::atomic::check_writable;
use sparing_image::exr::ExrAttribute;
use sparing_scene::SceneDescription;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A checkpoint's file, held by this process.
struct Place {
    path: PathBuf,
    interval: Duration,
    resume: bool,
    _lock: Lock,
}

/// Before the first sample.
pub(super) struct Keeper {
    /// `None` if neither checkpoints nor shards want it.
    identity: Option<Identity>,
    place: Option<Place>,
}

impl Keeper {
    /// Takes the checkpoint's place; refuses to overwrite one that is not to be resumed.
    pub(super) fn new(a: &RenderArguments, plan: &Plan, d: &SceneDescription) -> anyhow::Result<Self> {
        let wanted = a.checkpoint.is_some() || a.shard.is_some();
        let identity = wanted.then(|| identity(a, plan, d)).transpose()?;
        let Some(path) = a.checkpoint.clone() else { return Ok(Self { identity, place: None }) };
        if !super::plan::is_exr(&path) {
            return Err(Usage::error(format!("{}: checkpoints are .exr files", path.display())));
        }
        let lock = Lock::take(&path)?;
        check_writable(&path)?;
        if path.exists() && !a.resume {
            bail!(
                "{} is there from an earlier render: say --resume to go on from it, or remove it",
                path.display()
            );
        }
        let place = Place { path, interval: a.checkpoint_interval, resume: a.resume, _lock: lock };
        Ok(Self { identity, place: Some(place) })
    }

    /// The state to begin with: an earlier one, or an empty film.
    pub(super) fn begin(self, plan: &Plan) -> anyhow::Result<(State, Kept)> {
        let mut state = None;
        if let (Some(place), Some(identity)) = (&self.place, &self.identity) {
            if place.path.exists() {
                let found = checkpoint::read(&place.path)?;
                let other = || format!("{} is of another render", place.path.display());
                identity_of(&found.header)
                    .check(&named(identity, plan.shard.part), &[])
                    .with_context(other)?;
                if found.state.film.crop != plan.shard.rendered || found.state.film.options != plan.film {
                    bail!("{}: its pixels are not those of this render", other());
                }
                state = Some(found.state);
            } else if place.resume {
                note(format_args!("no checkpoint {} yet: from the beginning", place.path.display()));
            }
        }
        let state = state.unwrap_or_else(|| State::new(plan.shard.film(plan.size, plan.film)));
        let most = plan.shard.most(plan.choice.bounds.max_spp);
        Ok((
            state,
            Kept {
                identity: self.identity,
                place: self.place,
                part: (plan.shard.part, plan.shard.whole),
                most,
            },
        ))
    }
}

/// The part as one of the things that must agree.
fn named(identity: &Identity, part: Part) -> Identity {
    let mut identity = identity.clone();
    identity.0.insert("part".to_owned(), format!("{part:?}"));
    identity
}

fn identity_of(header: &Header) -> Identity {
    named(&header.identity, header.part)
}

/// During the render and after it.
pub(super) struct Kept {
    identity: Option<Identity>,
    place: Option<Place>,
    part: (Part, [u32; 4]),
    most: u32,
}

impl Kept {
    /// What writes checkpoints, if they are wanted.
    pub(super) fn timer(&self) -> Option<Timer> {
        let (place, identity) = (self.place.as_ref()?, self.identity.clone()?);
        Some(Timer::new(place.path.clone(), identity, self.part, self.most, place.interval))
    }

    /// Writes a finished part.
    pub(super) fn write_shard(
        &self,
        path: &Path,
        state: &State,
        decisions: &[f32],
        attributes: Vec<(String, ExrAttribute)>,
    ) -> anyhow::Result<()> {
        let identity = self.identity.clone().unwrap_or_default();
        let header = Header::new(identity, self.part, true, self.most, state);
        checkpoint::write(path, &header, state, decisions, attributes)
    }

    /// After all is saved: the checkpoint goes if the render is finished, else it stays.
    pub(super) fn end(self, finished: bool, timer: Option<Timer>) -> anyhow::Result<()> {
        let Some(timer) = timer else { return Ok(()) };
        if finished {
            timer.finish();
        } else if !timer.succeeded() {
            bail!("the checkpoint could not be written");
        }
        Ok(())
    }
}
