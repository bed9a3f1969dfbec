//! The rays of a render, recorded and traced again by bare Embree calls: the limit that shading can approach.

use super::packet::Packet;
use super::render::Renderer;
use crate::scene::Scene;
use embree4::{QueryOptions, Ray, Ray16, RayHit, RayHit16, Valid16};
use rayon::prelude::*;
use sparing_image::film::{Film, TILE};
use std::cell::RefCell;

/// One call of Embree.
#[derive(Clone, Debug)]
pub enum Query {
    /// The first `n` camera rays of a packet.
    Camera(Box<Ray16>, u32),
    /// A ray between surfaces.
    Bounce(Ray),
    /// Shadow rays of the lanes of a bit mask, coherent or not.
    Shadows(Box<Ray16>, u32, bool),
}

/// All queries of a render, by tile.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    tiles: Vec<Vec<Query>>,
}

impl Renderer<'_> {
    /// Renders `spp` samples of every pixel of an empty film and keeps the rays.
    #[must_use]
    pub fn record(&self, film: &mut Film, spp: u32) -> Recording {
        let mut recording = Recording::default();
        for tile in &mut film.tiles {
            let queries = RefCell::new(Vec::new());
            let packet = Packet {
                scene: self.scene(),
                settings: self.settings(),
                recorder: Some(&queries),
                witness: None,
            };
            for y in 0..tile.height {
                for x in 0..tile.width {
                    self.packets(0, spp, |first, n| {
                        (self.trace)(&packet, tile, (y * TILE + x) as usize, first, n);
                    });
                }
            }
            recording.tiles.push(queries.into_inner());
        }
        recording
    }
}

impl Recording {
    /// Number of rays.
    #[must_use]
    pub fn rays(&self) -> u64 {
        let count = |q: &Query| match q {
            Query::Camera(_, n) => u64::from(*n),
            Query::Bounce(_) => 1,
            Query::Shadows(_, lanes, _) => u64::from(lanes.count_ones()),
        };
        self.tiles.iter().flatten().map(count).sum()
    }

    /// Traces all rays again, tiles in parallel. Returns how many met something.
    #[must_use]
    pub fn replay(&self, scene: &Scene) -> u64 {
        let coherent = QueryOptions { coherent: true, feature_mask: scene.features };
        let incoherent = QueryOptions { coherent: false, feature_mask: scene.features };
        let trace = |query: &Query| match query {
            Query::Camera(rays, n) => {
                let mut hits = RayHit16::new(**rays);
                scene.embree.intersect16_with(&coherent, &Valid16::first(*n as usize), &mut hits);
                u64::from(hits.hit.geom_id[0] != embree4::INVALID_ID)
            }
            Query::Bounce(ray) => {
                let mut hit = RayHit::new(*ray);
                scene.embree.intersect_with(&incoherent, &mut hit);
                u64::from(hit.hit.geom_id != embree4::INVALID_ID)
            }
            Query::Shadows(rays, lanes, is_coherent) => {
                let options = if *is_coherent { &coherent } else { &incoherent };
                let mut rays = **rays;
                let valid = Valid16::from_fn(|lane| lanes >> lane & 1 == 1);
                scene.embree.occluded16_with(options, &valid, &mut rays);
                u64::from(rays.tfar[0] == f32::NEG_INFINITY)
            }
        };
        self.tiles.par_iter().map(|tile| tile.iter().map(trace).sum::<u64>()).sum()
    }
}
