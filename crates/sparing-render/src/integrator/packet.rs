//! Paths of up to sixteen samples of one pixel, traced together.

use super::inspect::{PathVertex, VertexHit, Witness};
use super::replay::Query;
use super::shading::{Vertex, survival};
use super::{Estimator, RenderSettings};
use crate::counters::{Counter, count};
use crate::materials::BsdfSample;
use crate::needs::Needs;
use crate::sampler::{Dimension, PixelSampler};
use crate::sampling::power_heuristic;
use crate::scene::Scene;
use crate::scene::surface::{FaceLights, SurfacePoint};
use embree4::{QueryOptions, Ray, Ray16, RayHit, RayHit16, Valid16};
use glam::Vec3;
use sparing_image::film::Tile;
use std::cell::RefCell;

/// Samples traced together.
pub const PACKET: usize = 16;

/// Rays traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceStatistics {
    /// From the camera.
    pub camera: u64,
    /// From surfaces, by BSDF sampling.
    pub bounce: u64,
    /// From surfaces to lights.
    pub shadow: u64,
}

impl std::ops::AddAssign for TraceStatistics {
    fn add_assign(&mut self, o: Self) {
        self.camera += o.camera;
        self.bounce += o.bounce;
        self.shadow += o.shadow;
    }
}

/// Samples `first .. first + n` (n at most [`PACKET`]) of the pixel with `index` in `tile`.
pub(super) type TracePacket = fn(&Packet<'_>, &mut Tile, usize, u32, usize) -> TraceStatistics;

/// What does not change from pixel to pixel.
pub(super) struct Packet<'a> {
    pub scene: &'a Scene,
    pub settings: &'a RenderSettings,
    /// Where queries go when they are recorded.
    pub recorder: Option<&'a RefCell<Vec<Query>>>,
    /// Where paths go when they are looked into.
    pub witness: Option<&'a RefCell<Vec<Witness>>>,
}

impl Packet<'_> {
    #[inline(always)]
    fn record(&self, query: impl FnOnce() -> Query) {
        if let Some(recorder) = self.recorder {
            recorder.borrow_mut().push(query());
        }
    }

    #[inline(always)]
    fn see(&self, what: impl FnOnce() -> Witness) {
        if let Some(witness) = self.witness {
            witness.borrow_mut().push(what());
        }
    }
}

/// The state of one path.
#[derive(Clone, Copy)]
struct Path {
    throughput: Vec3,
    radiance: Vec3,
    /// Product of the squared relative indices of refraction: kept out of Russian roulette, since the radiance
    /// gained by refraction is lost again on the way out.
    eta_scale: f32,
    /// Density of the BSDF sample that led here; infinite after a delta lobe or from the camera.
    pdf: f32,
    /// Origin of the segment, for light densities.
    origin: Vec3,
    filter_weight: f32,
}

impl Path {
    const NONE: Self = Self {
        throughput: Vec3::ONE,
        radiance: Vec3::ZERO,
        eta_scale: 1.0,
        pdf: f32::INFINITY,
        origin: Vec3::ZERO,
        filter_weight: 1.0,
    };
}

/// Light on its way to a vertex, pending a shadow ray.
struct Shadows {
    rays: Ray16,
    light: [Vec3; PACKET],
    lanes: u32,
}

/// Needs that change the compiled code; the others are decided at scene build.
const SURFACE: Needs = Needs::TEXTURE_COORDINATES
    .union(Needs::NORMAL_MAPS)
    .union(Needs::TANGENTS)
    .union(Needs::MIXES)
    .union(Needs::VERTEX_COLORS)
    .union(Needs::SECOND_UVS);
const SHAPES: Needs = Needs::SHADING_NORMALS.union(Needs::INSTANCES);
const OUTPUT: Needs = Needs::AUXILIARY.union(Needs::SHAPE_COUNT);
/// What makes rays start at different times.
const TIME: Needs = Needs::MOTION.union(Needs::CAMERA_MOTION);
/// What scenes with moving objects have compiled in, needed or not: groups of their own would double the code once more.
const MOVING: Needs = Needs::MOTION.union(SURFACE).union(SHAPES).union(Needs::CHOICE).union(OUTPUT);

/// The tracer compiled for the smallest set of needs that covers `needs`.
pub(super) fn select(needs: Needs) -> TracePacket {
    macro_rules! pick {
        ([$($done:expr),*]) => {
            trace_packet::<{ Needs::empty()$(.union($done))*.bits() }>
        };
        ([$($done:expr),*] $flags:expr $(, $rest:expr)*) => {
            if needs.intersects($flags) {
                pick!([$($done,)* $flags] $($rest),*)
            } else {
                pick!([$($done),*] $($rest),*)
            }
        };
    }
    if needs.contains(Needs::MOTION) {
        return pick!([MOVING] Needs::LIGHT_SAMPLING, Needs::MIS);
    }
    pick!([] SURFACE, SHAPES, Needs::CHOICE, Needs::LIGHT_SAMPLING, Needs::MIS, OUTPUT)
}

fn trace_packet<const NEEDS: u32>(
    packet: &Packet<'_>,
    tile: &mut Tile,
    index: usize,
    first: u32,
    n: usize,
) -> TraceStatistics {
    let needs = Needs::from_bits_retain(NEEDS);
    let (scene, settings) = (packet.scene, packet.settings);
    let (x, y) = (
        tile.x0 + index as u32 % sparing_image::film::TILE,
        tile.y0 + index as u32 / sparing_image::film::TILE,
    );
    let sampler = PixelSampler::new(settings.sampler, settings.seed, x, y);
    let mut statistics = TraceStatistics { camera: n as u64, ..TraceStatistics::default() };

    let mut paths = [Path::NONE; PACKET];
    let mut hits = RayHit16::new(Ray16::EMPTY);
    let mut cos_axis = [1.0f32; PACKET];
    let pixel_u = sampler.get_2d_packet(first, 0, Dimension::Pixel);
    let lens_u = if scene.camera.has_lens() {
        count(Counter::Lens);
        sampler.get_2d_packet(first, 0, Dimension::Lens)
    } else {
        [[0.5; PACKET]; 2]
    };
    let times = if scene.needs().intersects(TIME) {
        count(Counter::Time);
        sampler.get_2d_packet(first, 0, Dimension::Time)[0]
    } else {
        [0.0; PACKET]
    };
    // Without motion of objects a ray's time matters to the camera alone.
    let time = |lane: usize| if needs.contains(Needs::MOTION) { times[lane] } else { 0.0 };
    for lane in 0..n {
        let (offset, weight) = scene.filter.sample([pixel_u[0][lane], pixel_u[1][lane]]);
        let lens = [lens_u[0][lane], lens_u[1][lane]];
        let raster = [x as f32 + 0.5 + offset[0], y as f32 + 0.5 + offset[1]];
        let ray = if scene.needs().contains(Needs::CAMERA_MOTION) {
            scene.camera.at(times[lane]).ray(raster[0], raster[1], lens)
        } else {
            scene.camera.ray(raster[0], raster[1], lens)
        };
        hits.ray.set(lane, &Ray::new(ray.origin.to_array(), ray.direction.to_array()).at_time(time(lane)));
        paths[lane].filter_weight = weight;
        paths[lane].origin = ray.origin;
        cos_axis[lane] = ray.cos_axis;
    }
    let coherent = QueryOptions { coherent: true, feature_mask: scene.features };
    let incoherent = QueryOptions { coherent: false, feature_mask: scene.features };
    packet.record(|| Query::Camera(Box::new(hits.ray), n as u32));
    scene.embree.intersect16_with(&coherent, &Valid16::first(n), &mut hits);

    let context = scene.light_context();
    let mut points = [SurfacePoint::NONE; PACKET];
    let mut shapes = [0u32; PACKET];
    let mut vertices = [Vertex::NONE; PACKET];
    let mut active: u32 = (1u32 << n) - 1;
    let mut depth = 0;
    loop {
        let bsdf_u = sampler.get_2d_packet(first, depth + 1, Dimension::Bsdf);
        let light_u = if needs.contains(Needs::LIGHT_SAMPLING) {
            sampler.get_2d_packet(first, depth + 1, Dimension::Light)
        } else {
            [[0.5; PACKET]; 2]
        };
        let choice_u = if needs.contains(Needs::CHOICE) {
            count(Counter::Choice);
            sampler.get_2d_packet(first, depth + 1, Dimension::Choice)
        } else {
            [[0.5; PACKET]; 2]
        };
        let roulette_u = if depth >= settings.roulette_depth || needs.contains(Needs::MIXES) {
            sampler.get_2d_packet(first, depth + 1, Dimension::Roulette)
        } else {
            [[0.0; PACKET]; 2]
        };
        // In stages over all lanes, so that the processor overlaps the dependency chains of neighbours.
        for lane in Lanes(active) {
            let path = &mut paths[lane];
            let wi = direction(&hits.ray, lane);
            let hit = scene.hit(
                hits.hit.geom_id[lane],
                hits.hit.inst_id[0][lane],
                hits.hit.prim_id[lane],
                hits.hit.u[lane],
                hits.hit.v[lane],
            );
            if needs.contains(Needs::SHAPE_COUNT) && depth == 0 && !tile.shapes.is_empty() {
                count(Counter::Shape);
                tile.shapes[index].insert(hit.as_ref().map_or(0, |h| scene.shape_id(h)));
            }
            let Some(hit) = hit else {
                active &= !(1 << lane);
                if scene.needs().contains(Needs::ENVIRONMENT) {
                    let (radiance, pdf) = scene.lights.environment(wi);
                    let weight = hit_weight::<NEEDS>(settings, path.pdf, || pdf);
                    path.radiance += path.throughput * radiance * weight;
                }
                packet.see(|| vertex_seen(lane, depth, &hits.ray, path, None));
                continue;
            };
            let t = hits.ray.tfar[lane];
            let surface = scene.surface_point::<NEEDS>(&hit, path.origin, wi, t, time(lane));
            if let Some(light) = scene.light_of(&hit) {
                let le = scene.emitted(&hit, surface.ng, surface.uv, -wi);
                if le != Vec3::ZERO {
                    let light_pdf = || {
                        count(Counter::LightPdf);
                        scene.lights.pdf_hit(light, path.origin, t, surface.ng.dot(wi).abs())
                    };
                    let weight = if needs.contains(Needs::MOTION) && light == FaceLights::BY_CHANCE {
                        1.0
                    } else {
                        hit_weight::<NEEDS>(settings, path.pdf, light_pdf)
                    };
                    path.radiance += path.throughput * le * weight;
                }
            }
            packet.see(|| {
                let material = scene.shapes[hit.shape as usize].material;
                let (p, ng, ns) = (surface.p, surface.ng, surface.ns);
                let met = VertexHit { surface: hit, material, t, p, ng, ns };
                vertex_seen(lane, depth, &hits.ray, path, Some(met))
            });
            points[lane] = surface;
            shapes[lane] = hit.shape;
        }
        let auxiliary = needs.contains(Needs::AUXILIARY) && depth == 0 && !tile.auxiliary.is_empty();
        if depth == settings.max_depth && !auxiliary {
            break;
        }
        for lane in Lanes(active) {
            let wo = -direction(&hits.ray, lane);
            vertices[lane] = scene.vertex::<NEEDS>(shapes[lane], &points[lane], wo, roulette_u[1][lane]);
        }
        if auxiliary {
            for lane in Lanes(active) {
                count(Counter::Auxiliary);
                let a = &mut tile.auxiliary[index];
                a.albedo += vertices[lane].bsdf.albedo();
                a.normal += vertices[lane].frame.z;
                a.depth += hits.ray.tfar[lane] * cos_axis[lane];
                a.hits += 1;
            }
            if depth == settings.max_depth {
                break;
            }
        }
        if needs.contains(Needs::LIGHT_SAMPLING) && settings.estimator != Estimator::BsdfOnly {
            let mut shadows = Shadows { rays: Ray16::EMPTY, light: [Vec3::ZERO; PACKET], lanes: 0 };
            for lane in Lanes(active) {
                let (vertex, point) = (&vertices[lane], &points[lane]);
                if vertex.bsdf.is_all_delta() {
                    continue;
                }
                count(Counter::LightSample);
                let u = [light_u[0][lane], light_u[1][lane]];
                let Some(light) = scene.lights.sample(point.p, choice_u[1][lane], u, &context) else {
                    continue;
                };
                let wi = vertex.frame.to_local(light.wi);
                if !vertex.is_consistent(light.wi, wi) {
                    continue;
                }
                let e = vertex.bsdf.eval(vertex.wo, wi);
                let weight = if light.is_delta || settings.estimator == Estimator::LightOnly {
                    1.0
                } else {
                    power_heuristic(light.pdf, e.pdf)
                };
                let contribution = paths[lane].throughput * e.f_cos * light.radiance * (weight / light.pdf);
                if contribution != Vec3::ZERO {
                    let ray = shadow_ray(point, light.wi, light.distance).at_time(time(lane));
                    shadows.rays.set(lane, &ray);
                    shadows.light[lane] = contribution;
                    shadows.lanes |= 1 << lane;
                }
            }
            statistics.shadow += u64::from(shadows.lanes.count_ones());
            let options = if depth == 0 { &coherent } else { &incoherent };
            if shadows.lanes != 0 {
                packet.record(|| Query::Shadows(Box::new(shadows.rays), shadows.lanes, depth == 0));
            }
            trace_shadows(scene, options, &mut shadows, &mut paths);
        }
        for lane in Lanes(active) {
            let (vertex, point, path) = (&vertices[lane], &points[lane], &mut paths[lane]);
            let u = [bsdf_u[0][lane], bsdf_u[1][lane]];
            let next = vertex.bsdf.sample(vertex.wo, choice_u[0][lane], u).and_then(|s| {
                let direction = nearly_unit(vertex.frame.to_world(s.wi));
                continue_path(path, &s, vertex.is_consistent(direction, s.wi)).then_some(direction)
            });
            let survive = survival(settings, depth, path.throughput * path.eta_scale);
            let Some(direction) = next.filter(|_| survive >= 1.0 || roulette_u[0][lane] < survive) else {
                active &= !(1 << lane);
                continue;
            };
            path.throughput /= survive;
            // Light densities are those from the surface, not from the offset origin.
            path.origin = point.p;
            let origin = point.ray_origin(direction);
            hits.ray.set(lane, &Ray::new(origin.to_array(), direction.to_array()).at_time(time(lane)));
        }
        if active == 0 {
            break;
        }
        depth += 1;
        statistics.bounce += u64::from(active.count_ones());
        for lane in Lanes(active) {
            let mut query = RayHit::new(hits.ray.get(lane));
            packet.record(|| Query::Bounce(query.ray));
            scene.embree.intersect_with(&incoherent, &mut query);
            hits.ray.tfar[lane] = query.ray.tfar;
            hits.hit.u[lane] = query.hit.u;
            hits.hit.v[lane] = query.hit.v;
            hits.hit.prim_id[lane] = query.hit.prim_id;
            hits.hit.geom_id[lane] = query.hit.geom_id;
            hits.hit.inst_id[0][lane] = query.hit.inst_id[0];
        }
    }
    for (lane, path) in paths.iter().enumerate().take(n) {
        let radiance = path.radiance * scene.film_scale;
        packet.see(|| Witness::Sample(lane, radiance, path.filter_weight));
        tile.add_sample(index, first + lane as u32, radiance, path.filter_weight);
    }
    statistics
}

/// The segment from a point to `distance` along `wi`, kept off the surfaces at both ends. It aims from the offset
/// origin at the point on the light, so that large offsets (far from the world's origin) do not overshoot.
#[inline]
fn shadow_ray(point: &SurfacePoint, wi: Vec3, distance: f32) -> Ray {
    let origin = point.ray_origin(wi);
    if distance == f32::INFINITY {
        return Ray::new(origin.to_array(), wi.to_array());
    }
    let to_light = point.p + wi * distance - origin;
    let end = (0.9999 - point.offset / distance).max(0.0);
    Ray::segment(origin.to_array(), to_light.to_array(), 0.0, end)
}

#[cold]
fn vertex_seen(lane: usize, depth: u32, rays: &Ray16, path: &Path, hit: Option<VertexHit>) -> Witness {
    let ray = rays.get(lane);
    let (origin, direction) = (ray.org.into(), ray.dir.into());
    let Path { throughput, pdf, radiance, .. } = *path;
    Witness::Vertex(PathVertex { lane, depth, origin, direction, hit, throughput, pdf, radiance })
}

#[inline]
fn direction(rays: &Ray16, lane: usize) -> Vec3 {
    Vec3::new(rays.dir_x[lane], rays.dir_y[lane], rays.dir_z[lane])
}

/// One Newton step to length 1, for vectors that are a few ulp off.
#[inline]
fn nearly_unit(v: Vec3) -> Vec3 {
    v * (1.5 - 0.5 * v.length_squared())
}

/// Weight of emission that a path found by chance, having sampled its direction with density `bsdf_pdf`.
#[inline]
fn hit_weight<const NEEDS: u32>(
    settings: &RenderSettings,
    bsdf_pdf: f32,
    light_pdf: impl FnOnce() -> f32,
) -> f32 {
    if !Needs::from_bits_retain(NEEDS).contains(Needs::MIS) || bsdf_pdf == f32::INFINITY {
        return 1.0; // light sampling cannot find it
    }
    match settings.estimator {
        Estimator::Mis => power_heuristic(bsdf_pdf, light_pdf()),
        Estimator::LightOnly => f32::from(light_pdf() == 0.0),
        Estimator::BsdfOnly => 1.0,
    }
}

/// Updates a path with a BSDF sample; false where no light can come from there.
#[inline]
fn continue_path(path: &mut Path, s: &BsdfSample, consistent: bool) -> bool {
    if !consistent || s.weight == Vec3::ZERO {
        return false;
    }
    path.throughput *= s.weight;
    if s.wi.z < 0.0 && s.is_delta {
        // weight holds 1 / eta²; tints only lower it further, which roulette may use
        path.eta_scale /= s.weight.max_element().max(1e-4);
    }
    path.pdf = if s.is_delta { f32::INFINITY } else { s.pdf };
    true
}

/// Adds the light of all shadow rays that reach it.
#[inline]
fn trace_shadows(scene: &Scene, options: &QueryOptions, shadows: &mut Shadows, paths: &mut [Path; PACKET]) {
    let lanes = shadows.lanes;
    if lanes.count_ones() <= 2 {
        for lane in Lanes(lanes) {
            let mut ray = shadows.rays.get(lane);
            if !scene.embree.occluded_with(options, &mut ray) {
                paths[lane].radiance += shadows.light[lane];
            }
        }
        return;
    }
    let valid = Valid16::from_fn(|lane| lanes >> lane & 1 == 1);
    scene.embree.occluded16_with(options, &valid, &mut shadows.rays);
    for lane in Lanes(lanes) {
        if shadows.rays.tfar[lane] != f32::NEG_INFINITY {
            paths[lane].radiance += shadows.light[lane];
        }
    }
}

/// The lanes of a bit mask, lowest first.
struct Lanes(u32);

impl Iterator for Lanes {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let lane = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(lane)
    }
}
