//! One sample of a pixel with all that its path met, for people who look for what went wrong.

use super::packet::{PACKET, Packet};
use super::render::Renderer;
use crate::scene::surface::SurfaceHit;
use glam::Vec3;
use sparing_image::film::{Film, FilmOptions};
use std::cell::RefCell;

/// Where a segment of a path ended.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// Lane of the packet.
    pub(super) lane: usize,
    /// Bounces before.
    pub depth: u32,
    /// Origin of the ray.
    pub origin: Vec3,
    /// Direction of the ray.
    pub direction: Vec3,
    /// What it met; `None` is the surroundings.
    pub hit: Option<VertexHit>,
    /// Throughput of the path up to here.
    pub throughput: Vec3,
    /// Density of the BSDF sample that led here; infinite after a delta lobe or from the camera.
    pub pdf: f32,
    /// Radiance gathered so far, emission at this vertex included, light sampled at it not.
    pub radiance: Vec3,
}

/// The surface at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct VertexHit {
    /// By Embree's ids.
    pub surface: SurfaceHit,
    /// Index of the material.
    pub material: u32,
    /// Distance.
    pub t: f32,
    /// Position.
    pub p: Vec3,
    /// Geometric normal.
    pub ng: Vec3,
    /// Shading normal, before normal maps.
    pub ns: Vec3,
}

/// What a packet tells about its paths when it is asked.
#[derive(Clone, Copy, Debug)]
pub(super) enum Witness {
    Vertex(PathVertex),
    /// Lane, radiance as it goes to the film, and the filter's weight.
    Sample(usize, Vec3, f32),
}

/// A sample, looked into.
#[derive(Clone, Debug, Default)]
pub struct Inspection {
    /// Its path.
    pub vertices: Vec<PathVertex>,
    /// Its radiance, whether valid or not.
    pub radiance: Vec3,
    /// Weight of the pixel filter.
    pub weight: f32,
}

impl Renderer<'_> {
    /// Traces a sample of a pixel in the packet that it travels in when the pixel gets `spp` samples in all: the same bits.
    #[must_use]
    pub fn inspect(&self, size: [u32; 2], [x, y]: [u32; 2], sample: u32, spp: u32) -> Inspection {
        let mut film = Film::new(size, [x, y, x + 1, y + 1], FilmOptions::default());
        let witness = RefCell::new(Vec::new());
        let packet = Packet {
            scene: self.scene(),
            settings: self.settings(),
            recorder: None,
            witness: Some(&witness),
        };
        let start = if sample < 16 { sample / 8 * 8 } else { sample / PACKET as u32 * PACKET as u32 };
        let mut own = None;
        self.packets(start, spp.max(sample.saturating_add(1)), |first, n| {
            let lane = sample.wrapping_sub(first) as usize;
            if lane < n {
                own = Some(lane);
                let index = film.tiles[0].index(x, y);
                (self.trace)(&packet, &mut film.tiles[0], index, first, n);
            }
        });
        let mut inspection = Inspection::default();
        for seen in witness.into_inner() {
            match seen {
                Witness::Vertex(vertex) if Some(vertex.lane) == own => inspection.vertices.push(vertex),
                Witness::Sample(lane, radiance, weight) if Some(lane) == own => {
                    (inspection.radiance, inspection.weight) = (radiance, weight);
                }
                _ => {}
            }
        }
        inspection
    }
}
