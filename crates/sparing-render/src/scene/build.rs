//! From a description to a scene that is ready to render.

use super::emitters::LightBuilder;
use super::surface::{FaceLights, Mesh, ShapeGeometry, ShapeRecord};
use super::{BuildError, InstanceRecord, Placement, Scene, SceneStatistics, Way};
use crate::camera::Camera;
use crate::counters::{Counter, count};
use crate::filter::FilterSampler;
use crate::lights::{Emission, LightContext, LightTable};
use crate::materials::MaterialTable;
use crate::needs::Needs;
use crate::sampler::{hash, to_unit_float};
use crate::texture::{Image, Scalar, TextureTable};
use embree4::{BuildQuality, Device, FeatureMask, SceneBuilder, SceneFlags, SharedBuffer};
use glam::{Affine3A, Vec3};
use rayon::prelude::*;
use sparing_scene::SceneDescription;
use sparing_scene::description::{self as d, ColorInput, Geometry, ImageId};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// How to build.
#[derive(Clone, Copy, Debug)]
pub struct BuildOptions {
    /// Threads of Embree's builders; 0 for all.
    pub threads: usize,
    /// Watertight intersections.
    pub robust: bool,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self { threads: 0, robust: true }
    }
}

impl Scene {
    /// Builds a scene. Vertices are handed over to Embree without a copy.
    ///
    /// # Errors
    /// See [`BuildError`].
    pub fn build(description: SceneDescription, options: BuildOptions) -> Result<Self, BuildError> {
        let camera = Camera::new(&description.camera, description.film.width, description.film.height);
        let filter = FilterSampler::new(description.filter);
        let mut warnings = Vec::new();
        let images = decode(&description)?;
        let textures = Arc::new(TextureTable::new(&description.textures, images.clone()));
        let materials = MaterialTable::new(&description.materials, &textures);

        let device = Device::builder().threads(options.threads).build()?;
        let mut parts = Parts {
            device: device.clone(),
            robust: options.robust,
            textures: Arc::clone(&textures),
            materials: &materials,
            shapes: Vec::new(),
            emissions: Vec::new(),
            needs: Needs::empty(),
            statistics: SceneStatistics::default(),
        };
        parts.needs.set(Needs::DEPTH_OF_FIELD, camera.has_lens());
        parts.needs.set(Needs::CAMERA_MOTION, camera.moves());
        let mut top = parts.builder()?;
        for shape in description.shapes {
            parts.attach(&mut top, shape)?;
        }
        let top_level_shapes = parts.shapes.len() as u32;
        let mut objects = Vec::new();
        for object in description.objects {
            let first = parts.shapes.len() as u32;
            let mut builder = parts.builder()?;
            for shape in object.shapes {
                parts.attach(&mut builder, shape)?;
            }
            objects.push((builder.commit()?, first, parts.shapes.len() as u32));
        }
        let mut instances = Vec::new();
        let mut next_id = top_level_shapes + 1;
        for instance in &description.instances {
            let (scene, first, end) = &objects[instance.object as usize];
            let steps = match instance.end {
                None => Some(vec![instance.object_to_world]),
                Some(end) => d::Motion::new(instance.object_to_world, end)
                    .map(|motion| motion.steps(description.camera.shutter)),
            };
            let regular =
                |m: &Affine3A| m.matrix3.determinant() != 0.0 && m.inverse().is_finite() && m.is_finite();
            let Some(steps) = steps.filter(|steps| steps.iter().all(regular)) else {
                warnings.push("an object placed by a singular transform was left out".to_owned());
                continue;
            };
            let m = steps[0];
            let later = steps[1..].iter().map(Affine3A::to_cols_array);
            top.attach(embree4::Instance::new(scene, m.to_cols_array()).time_steps(later))?;
            let (place, way) = (Placement::new(m), Way::new(steps));
            parts.needs.set(Needs::MOTION, parts.needs.contains(Needs::MOTION) || way.is_some());
            instances.push(InstanceRecord {
                place,
                way,
                first_shape: *first,
                first_id: next_id,
                lights: Vec::new(),
            });
            next_id += end - first;
            parts.needs |= Needs::INSTANCES;
        }
        let embree = top.commit()?;

        let Parts { mut shapes, emissions, mut needs, mut statistics, .. } = parts;
        let context = LightContext { emissions: &emissions, textures: &textures };
        let lights = collect_lights(
            &description.lights,
            &images,
            &mut shapes,
            top_level_shapes,
            &mut instances,
            &objects.iter().map(|o| (o.1, o.2)).collect::<Vec<_>>(),
            &embree,
            &context,
        )?;
        needs |= light_needs(&lights, &emissions, &shapes, &materials);
        statistics.shapes = shapes.len() as u64;
        statistics.instances = instances.len() as u64;
        statistics.lights = lights.len() as u64;
        statistics.materials = description.materials.len() as u64;
        statistics.texture_bytes = textures.bytes() as u64;
        statistics.embree_bytes = device.memory_bytes();
        let by_chance = instances
            .iter()
            .flat_map(|instance| &instance.lights)
            .any(|lights| matches!(lights, FaceLights::ByChance));
        if by_chance {
            warnings.push(
                "shapes that emit and move are lights that only chance finds: what they light is noisy"
                    .to_owned(),
            );
        }
        if lights.is_empty() && !by_chance {
            warnings.push("the scene has no light: the picture will be black".to_owned());
        }
        Ok(Self {
            embree,
            shapes,
            instances,
            top_level_shapes,
            materials,
            textures: Arc::unwrap_or_clone(textures),
            emissions,
            lights,
            camera,
            filter,
            film_scale: description.film.scale,
            features: features(needs),
            needs,
            warnings,
            statistics,
        })
    }
}

/// Decodes the pictures that textures or lights use, in parallel.
fn decode(description: &SceneDescription) -> Result<Vec<Option<Image>>, BuildError> {
    let mut used = vec![false; description.images.len()];
    let mut mark = |id: &ImageId| used[id.0 as usize] = true;
    for texture in &description.textures {
        if let d::Texture::Image { image, .. } = texture {
            mark(image);
        }
    }
    for light in &description.lights {
        match light {
            d::Light::Environment { image: Some(map), .. } => mark(&map.image),
            d::Light::Goniometric { image: Some(image), .. }
            | d::Light::Projection { image: Some(image), .. } => {
                mark(image);
            }
            _ => {}
        }
    }
    // The first image of each source decodes it; the others share the pixels.
    let images = &description.images;
    let mut first: HashMap<Source<'_>, usize> = HashMap::new();
    let decodes: Vec<Option<usize>> = (0..images.len())
        .map(|i| used[i].then(|| *first.entry(Source::of(&images[i].source)).or_insert(i)))
        .collect();
    let pictures: Result<Vec<_>, _> = images
        .par_iter()
        .enumerate()
        .map(|(i, image)| {
            (decodes[i] == Some(i)).then(|| Image::decode(&image.source).map(Arc::new)).transpose()
        })
        .collect();
    let pictures = pictures?;
    let picture = |i: &usize| pictures[*i].clone();
    let all = images.iter().zip(&decodes);
    Ok(all.map(|(image, i)| Some(Image::shared(i.as_ref().and_then(picture)?, image.encoding))).collect())
}

/// What is decoded once: a file, or the very same bytes.
#[derive(PartialEq, Eq, Hash)]
enum Source<'a> {
    File(&'a Path),
    Bytes(*const u8, usize),
}

impl<'a> Source<'a> {
    fn of(source: &'a d::ImageSource) -> Self {
        match source {
            d::ImageSource::File(path) => Self::File(path),
            d::ImageSource::Bytes { bytes, .. } => Self::Bytes(bytes.as_ptr(), bytes.len()),
        }
    }
}

struct Parts<'a> {
    device: Device,
    robust: bool,
    textures: Arc<TextureTable>,
    materials: &'a MaterialTable,
    shapes: Vec<ShapeRecord>,
    emissions: Vec<Emission>,
    needs: Needs,
    statistics: SceneStatistics,
}

impl Parts<'_> {
    fn builder(&self) -> Result<SceneBuilder, embree4::Error> {
        let flags = if self.robust { SceneFlags::ROBUST } else { SceneFlags::empty() };
        Ok(SceneBuilder::new(&self.device)?.flags(flags).build_quality(BuildQuality::High))
    }

    fn attach(&mut self, builder: &mut SceneBuilder, shape: d::Shape) -> Result<(), BuildError> {
        let material = shape.material.0;
        if shape.emission.is_none() && self.materials.is_interface(material) {
            return Ok(()); // nothing to see, and it must not cast shadows
        }
        let alpha = shape.alpha.map(|a| self.textures.scalar(a));
        if alpha == Some(Scalar::Constant(0.0)) {
            return Ok(());
        }
        let vertices = matches!(&shape.geometry, Geometry::Triangles(m) if translucent(m));
        let alpha = alpha.filter(|a| vertices || !matches!(a, Scalar::Constant(v) if *v >= 1.0));
        let alpha = alpha.map(|value| Opacity { value, cutoff: shape.alpha_cutoff });
        self.needs |= self.materials.needs(material);
        self.needs.set(Needs::ALPHA, self.needs.contains(Needs::ALPHA) || alpha.is_some());
        let emission = shape.emission.map(|e| self.emission(&e));
        let (geometry, id) = match shape.geometry {
            Geometry::Triangles(m) => self.triangles(builder, m, alpha, material)?,
            Geometry::Quads(m) => self.quads(builder, m, alpha)?,
            Geometry::Sphere { center, radius, axes } => {
                self.needs |= Needs::SPHERES;
                let point = vec![[center.x, center.y, center.z, radius]];
                let mut g = embree4::Spheres::new(point);
                if let Some(a) = alpha {
                    let (t, axes) = (Arc::clone(&self.textures), axes);
                    let test = alpha_test(t, a, move |h| {
                        let p = Vec3::from(h.org()) + Vec3::from(h.dir()) * h.tfar();
                        (super::surface::sphere_uv((p - center).normalize_or_zero(), &axes), 1.0)
                    });
                    g = g.filter(test.clone()).occlusion_filter(test);
                }
                (ShapeGeometry::Sphere { center, radius, axes }, builder.attach(g)?)
            }
            Geometry::Disk { center, normal, tangent, radius } => {
                self.needs |= Needs::DISKS;
                let point = vec![[center.x, center.y, center.z, radius]];
                let mut g = embree4::OrientedDiscs::new(point, vec![normal.to_array()]);
                if let Some(a) = alpha {
                    let test = alpha_test(Arc::clone(&self.textures), a, move |h| {
                        let p = Vec3::from(h.org()) + Vec3::from(h.dir()) * h.tfar();
                        let q = (p - center) / radius;
                        (super::surface::disk_uv(q.dot(tangent), q.dot(normal.cross(tangent))), 1.0)
                    });
                    g = g.filter(test.clone()).occlusion_filter(test);
                }
                (ShapeGeometry::Disk { center, normal, tangent, radius }, builder.attach(g)?)
            }
        };
        debug_assert!(id.0 as usize <= self.shapes.len(), "ids follow the order of attachment");
        self.shapes.push(ShapeRecord {
            geometry,
            material,
            emission,
            flip: shape.reverse_orientation,
            lights: FaceLights::None,
        });
        Ok(())
    }

    fn emission(&mut self, e: &d::Emission) -> u32 {
        let emission = Emission { radiance: self.textures.color(e.radiance), two_sided: e.two_sided };
        self.needs |= Needs::EMISSION;
        if matches!(e.radiance, ColorInput::Texture(_)) {
            self.needs |= Needs::TEXTURE_COORDINATES;
        }
        if let Some(i) = self.emissions.iter().position(|x| *x == emission) {
            return i as u32;
        }
        self.emissions.push(emission);
        self.emissions.len() as u32 - 1
    }

    fn mesh<const N: usize>(
        &mut self,
        positions: Vec<[f32; 3]>,
        indices: Vec<[u32; N]>,
        normals: Option<Vec<[f32; 3]>>,
        uvs: Option<Vec<[f32; 2]>>,
    ) -> Mesh<N>
    where
        [u32; N]: embree4::Element,
    {
        self.needs
            .set(Needs::SHADING_NORMALS, self.needs.contains(Needs::SHADING_NORMALS) || normals.is_some());
        let count = |n: usize, each: usize| (n * each) as u64;
        self.statistics.geometry_bytes += count(positions.len(), 12)
            + count(indices.len(), 4 * N)
            + count(normals.as_ref().map_or(0, Vec::len), 12)
            + count(uvs.as_ref().map_or(0, Vec::len), 8);
        Mesh {
            positions: SharedBuffer::from(positions),
            indices: SharedBuffer::from(indices),
            normals,
            uvs: uvs.map(Arc::new),
            colors: None,
            second_uvs: None,
            tangents: None,
        }
    }

    fn triangles(
        &mut self,
        builder: &mut SceneBuilder,
        m: d::TriangleMesh,
        alpha: Option<Opacity>,
        material: u32,
    ) -> Result<(ShapeGeometry, embree4::GeometryId), BuildError> {
        self.needs |= Needs::TRIANGLES;
        self.statistics.triangles += m.indices.len() as u64;
        // Opacities count where there is a cut-out, colours where the material asks for them.
        let seen = self.materials.needs(material).contains(Needs::VERTEX_COLORS);
        let colors = m.colors.filter(|_| alpha.is_some() || seen).map(Arc::new);
        self.statistics.geometry_bytes += colors.as_ref().map_or(0, |c| 16 * c.len() as u64);
        let mut mesh = self.mesh(m.positions, m.indices, m.normals, m.uvs);
        mesh.colors = colors.clone();
        if self.textures.uses_second_uvs() && m.second_uvs.is_some() {
            self.needs |= Needs::SECOND_UVS;
            mesh.second_uvs = m.second_uvs;
        }
        mesh.tangents = m.tangents.filter(|_| self.materials.needs(material).contains(Needs::TANGENTS));
        self.statistics.geometry_bytes += mesh.second_uvs.as_ref().map_or(0, |uvs| 8 * uvs.len() as u64)
            + mesh.tangents.as_ref().map_or(0, |tangents| 12 * tangents.len() as u64);
        let mut g = embree4::TriangleMesh::new(mesh.positions.clone(), mesh.indices.clone());
        if let Some(a) = alpha {
            let (uvs, indices) = (mesh.uvs.clone(), mesh.indices.clone());
            let test = alpha_test(Arc::clone(&self.textures), a, move |h| {
                let (u, v) = (h.u(), h.v());
                let face = indices[h.prim_id() as usize];
                let mix = |a: f32, b: f32, c: f32| a * (1.0 - u - v) + b * u + c * v;
                let opacity = colors.as_ref().map_or(1.0, |colors| {
                    let [a, b, c] = face.map(|i| colors[i as usize][3]);
                    mix(a, b, c)
                });
                let Some(uvs) = &uvs else { return ([u + v, v], opacity) };
                let f = face.map(|i| uvs[i as usize]);
                ([0, 1].map(|k| mix(f[0][k], f[1][k], f[2][k])), opacity)
            });
            g = g.filter(test.clone()).occlusion_filter(test);
        }
        let id = builder.attach(g)?;
        Ok((ShapeGeometry::Triangles(mesh), id))
    }

    fn quads(
        &mut self,
        builder: &mut SceneBuilder,
        m: d::QuadMesh,
        alpha: Option<Opacity>,
    ) -> Result<(ShapeGeometry, embree4::GeometryId), BuildError> {
        self.needs |= Needs::QUADS;
        self.statistics.quads += m.indices.len() as u64;
        let mesh = self.mesh(m.positions, m.indices, m.normals, m.uvs);
        let mut g = embree4::QuadMesh::new(mesh.positions.clone(), mesh.indices.clone());
        if let Some(a) = alpha {
            let (uvs, indices) = (mesh.uvs.clone(), mesh.indices.clone());
            let test = alpha_test(Arc::clone(&self.textures), a, move |h| {
                let (u, v) = (h.u(), h.v());
                let Some(uvs) = &uvs else { return ([u, v], 1.0) };
                let f = indices[h.prim_id() as usize].map(|i| uvs[i as usize]);
                let uv = if u + v <= 1.0 {
                    [0, 1].map(|k| f[0][k] * (1.0 - u - v) + f[1][k] * u + f[3][k] * v)
                } else {
                    let (u, v) = (1.0 - u, 1.0 - v);
                    [0, 1].map(|k| f[2][k] * (1.0 - u - v) + f[3][k] * u + f[1][k] * v)
                };
                (uv, 1.0)
            });
            g = g.filter(test.clone()).occlusion_filter(test);
        }
        let id = builder.attach(g)?;
        Ok((ShapeGeometry::Quads(mesh), id))
    }
}

/// How opaque a shape is.
#[derive(Clone, Copy, Debug)]
struct Opacity {
    value: Scalar,
    /// Where it is a threshold.
    cutoff: Option<f32>,
}

/// Whether some vertex has a colour that is not opaque.
fn translucent(mesh: &d::TriangleMesh) -> bool {
    mesh.colors.iter().flatten().any(|color| color[3] < 1.0)
}

/// Opacity as a filter function: without a threshold, between 0 and 1 a number hashed from the ray and the hit
/// decides, so that a ray always sees the same. `at` gives texture coordinates and a factor.
fn alpha_test(
    textures: Arc<TextureTable>,
    alpha: Opacity,
    at: impl Fn(&embree4::FilterHit<'_>) -> ([f32; 2], f32) + Clone + Send + Sync + 'static,
) -> impl Fn(&embree4::FilterHit<'_>) -> bool + Clone + Send + Sync + 'static {
    move |h| {
        count(Counter::AlphaTest);
        let (uv, factor) = at(h);
        let a = textures.eval_scalar(alpha.value, uv) * factor;
        if let Some(cutoff) = alpha.cutoff {
            return a >= cutoff;
        }
        if a >= 1.0 {
            return true;
        }
        if a.is_nan() || a <= 0.0 {
            return false;
        }
        let d = h.dir();
        let o = h.org();
        let bits = [d[0], d[1], d[2], o[0], o[1], o[2]];
        let random = bits.iter().fold(h.prim_id(), |seed, x| hash(seed ^ x.to_bits()));
        to_unit_float(random) < a
    }
}

#[allow(clippy::too_many_arguments, reason = "one call, the parts of a scene")]
fn collect_lights(
    described: &[d::Light],
    images: &[Option<Image>],
    shapes: &mut [ShapeRecord],
    top_level: u32,
    instances: &mut [InstanceRecord],
    objects: &[(u32, u32)],
    embree: &embree4::Scene,
    context: &LightContext<'_>,
) -> Result<LightTable, BuildError> {
    let mut builder = LightBuilder::default();
    for light in described {
        builder.add(light, images)?;
    }
    for shape in &mut shapes[..top_level as usize] {
        shape.lights = builder.add_shape(shape, None, context.emissions)?;
    }
    for instance in instances {
        let Some((first, end)) = objects.iter().find(|o| o.0 == instance.first_shape) else { continue };
        let lights: Result<Vec<_>, _> = shapes[*first as usize..*end as usize]
            .iter()
            .map(|s| builder.add_shape(s, Some(instance), context.emissions))
            .collect();
        instance.lights = lights?;
    }
    let b = embree.bounds();
    let radius = 0.5 * (Vec3::from(b.upper) - Vec3::from(b.lower)).length();
    let radius = if radius.is_finite() { radius } else { 1.0 };
    Ok(LightTable::new(builder.lights, &builder.groups, radius, context))
}

fn light_needs(
    lights: &LightTable,
    emissions: &[Emission],
    shapes: &[ShapeRecord],
    materials: &MaterialTable,
) -> Needs {
    let mut needs = Needs::empty();
    let environment = lights.lights().iter().any(|l| matches!(l, crate::lights::Light::Environment(_)));
    needs.set(Needs::ENVIRONMENT, environment);
    needs.set(Needs::EMISSION, !emissions.is_empty());
    let lit = shapes.iter().any(|s| !materials.is_all_delta(s.material));
    needs.set(Needs::LIGHT_SAMPLING, lit && lights.can_sample());
    let by_chance = lights.lights().iter().any(|l| !l.is_delta());
    needs.set(Needs::MIS, needs.contains(Needs::LIGHT_SAMPLING) && by_chance);
    needs.set(Needs::CHOICE, needs.contains(Needs::LIGHT_SAMPLING) && lights.len() > 1);
    needs
}

fn features(needs: Needs) -> FeatureMask {
    let pairs = [
        (Needs::TRIANGLES, FeatureMask::TRIANGLE),
        (Needs::QUADS, FeatureMask::QUAD),
        (Needs::SPHERES, FeatureMask::POINT),
        (Needs::DISKS, FeatureMask::POINT),
        (Needs::INSTANCES, FeatureMask::INSTANCE),
        (Needs::ALPHA, FeatureMask::FILTER),
        (Needs::MOTION, FeatureMask::MOTION_BLUR),
    ];
    pairs.iter().filter(|p| needs.contains(p.0)).fold(FeatureMask::empty(), |mask, p| mask | p.1)
}
