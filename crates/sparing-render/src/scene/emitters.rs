//! From emitting shapes to lights.

use super::surface::{FaceLights, ShapeGeometry, ShapeRecord};
use super::{BuildError, InstanceRecord, Placement};
use crate::lights::{
    DiskLight, DistantLight, Emission, Environment, EnvironmentMap, FlatLight, GoniometricLight, Light,
    PointLight, ProjectionLight, SphereLight, SpotLight,
};
use crate::sampling::Frame;
use crate::texture::{Color, Image};
use glam::Vec3;
use sparing_scene::description as d;

/// Lights as they are collected.
#[derive(Debug, Default)]
pub(super) struct LightBuilder {
    pub lights: Vec<Light>,
    /// Source that each light is part of.
    pub groups: Vec<u32>,
    sources: u32,
}

impl LightBuilder {
    fn push(&mut self, light: Light) -> u32 {
        self.lights.push(light);
        self.groups.push(self.sources);
        self.lights.len() as u32 - 1
    }

    /// A light that is not a shape.
    pub fn add(&mut self, light: &d::Light, images: &[Option<Image>]) -> Result<(), BuildError> {
        let light = match light {
            d::Light::Point { position, intensity } => {
                Light::Point(PointLight { position: *position, intensity: *intensity })
            }
            d::Light::Spot { position, direction, intensity, cone_angle, cone_delta, edge } => {
                let start = (cone_angle - cone_delta).max(0.0);
                Light::Spot(SpotLight {
                    position: *position,
                    direction: direction.normalize_or(Vec3::Z),
                    intensity: *intensity,
                    cos_start: start.to_radians().cos(),
                    cos_end: cone_angle.to_radians().cos(),
                    edge: *edge,
                })
            }
            d::Light::Distant { direction, irradiance } => Light::Distant(DistantLight {
                towards: -direction.normalize_or(Vec3::NEG_Y),
                irradiance: *irradiance,
            }),
            d::Light::Environment { radiance, image, light_to_world } => {
                let mut radiance = *radiance;
                let loaded = image.and_then(|map| Some((map, images[map.image.0 as usize].clone()?)));
                let map = match loaded {
                    None => None,
                    Some((map, image)) => {
                        let (w, h) = (image.width(), image.height());
                        let prepared = EnvironmentMap::with_mapping(image, map.mapping).ok_or_else(|| {
                            BuildError::Invalid(format!(
                                "an environment map must be square (equal-area) or twice as wide as high \
                                 (latitude-longitude), not {w}x{h}"
                            ))
                        })?;
                        if let Some(target) = map.illuminance {
                            let found = prepared.illuminance();
                            radiance *= if found > 0.0 { target / found } else { 0.0 };
                        }
                        Some(prepared)
                    }
                };
                Light::Environment(Environment { radiance, map, light_to_world: *light_to_world })
            }
            d::Light::Goniometric { position, intensity, image, mapping, power, light_to_world } => {
                let image = image.and_then(|i| images[i.0 as usize].clone());
                let square = image.as_ref().is_none_or(|i| i.width() == i.height());
                let equal_area = match mapping {
                    d::SphereMapping::Auto => square,
                    d::SphereMapping::LatLong => false,
                    d::SphereMapping::EqualArea if square => true,
                    d::SphereMapping::EqualArea => {
                        let message = "the equal-area picture of a goniometric light must be square";
                        return Err(BuildError::Invalid(message.to_owned()));
                    }
                };
                let light = GoniometricLight {
                    position: *position,
                    intensity: *intensity,
                    image,
                    equal_area,
                    light_to_world: *light_to_world,
                };
                Light::Goniometric(Box::new(match power {
                    Some(watt) => light.with_power(*watt),
                    None => light,
                }))
            }
            d::Light::Projection { position, intensity, image, fov, power, light_to_world } => {
                let image = image.and_then(|i| images[i.0 as usize].clone());
                let light = ProjectionLight::new(*position, *intensity, image, *fov, *light_to_world);
                Light::Projection(Box::new(match power {
                    Some(watt) => light.with_power(*watt),
                    None => light,
                }))
            }
        };
        self.push(light);
        self.sources += 1;
        Ok(())
    }

    /// The lights of an emitting shape, placed by `instance`.
    pub fn add_shape(
        &mut self,
        shape: &ShapeRecord,
        instance: Option<&InstanceRecord>,
        emissions: &[Emission],
    ) -> Result<FaceLights, BuildError> {
        let Some(emission) = shape.emission else { return Ok(FaceLights::None) };
        if instance.is_some_and(|i| i.way.is_some()) {
            return Ok(FaceLights::ByChance);
        }
        let instance = instance.map(|i| &i.place);
        let place = |p: Vec3| instance.map_or(p, |i| i.object_to_world.transform_point3(p));
        let mirrored = instance.is_some_and(|i| i.handedness < 0.0);
        let flip = shape.flip != mirrored;
        let lights = match &shape.geometry {
            ShapeGeometry::Triangles(mesh) => {
                let faces: Vec<Face> =
                    mesh.indices
                        .iter()
                        .map(|f| {
                            let uvs = mesh.uvs.as_ref().map_or([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], |uvs| {
                                f.map(|i| uvs[i as usize])
                            });
                            let p = f.map(|i| place(Vec3::from(mesh.positions[i as usize])));
                            let turned = against_normals(&p, mesh.normals.as_deref(), f, instance);
                            Face { p, uvs, flip: turned.unwrap_or(mirrored) != shape.flip }
                        })
                        .collect();
                let textured = matches!(emissions[emission as usize].radiance, Color::Texture(_));
                self.add_triangles(&faces, emission, textured)
            }
            ShapeGeometry::Quads(mesh) => {
                let mut lights = Vec::with_capacity(mesh.indices.len());
                for f in mesh.indices.iter() {
                    let p = f.map(|i| place(Vec3::from(mesh.positions[i as usize])));
                    let uvs =
                        mesh.uvs.as_ref().map_or([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], |uvs| {
                            f.map(|i| uvs[i as usize])
                        });
                    let mut half = |[a, b, c]: [usize; 3], parallelogram| {
                        let corners = [p[a], p[b], p[c]];
                        let normals = mesh.normals.as_deref();
                        let turned = against_normals(&corners, normals, &[f[a], f[b], f[c]], instance);
                        let flip = turned.unwrap_or(mirrored) != shape.flip;
                        let (u, v) = (p[b] - p[a], p[c] - p[a]);
                        let uvs = [uvs[a], uvs[b], uvs[c]];
                        let light = FlatLight::new(p[a], u, v, flip, parallelogram, uvs, emission);
                        light.map_or(FaceLights::DARK, |l| self.push(Light::Flat(l)))
                    };
                    lights.push(if is_parallelogram(&p) {
                        [half([0, 1, 3], true); 2]
                    } else {
                        [half([0, 1, 3], false), half([2, 3, 1], false)]
                    });
                }
                self.sources += 1;
                return Ok(FaceLights::PerHalf(lights));
            }
            ShapeGeometry::Sphere { center, radius, axes } => {
                let (scale, rotation) = similarity(instance)?;
                let axes = axes.map(|a| rotation * a);
                let light = SphereLight {
                    center: place(*center),
                    radius: radius * scale,
                    axes,
                    flip: shape.flip,
                    emission,
                };
                vec![self.push(Light::Sphere(light))]
            }
            ShapeGeometry::Disk { center, normal, tangent, radius } => {
                let (scale, rotation) = similarity(instance)?;
                let (normal, tangent) = (rotation * *normal, rotation * *tangent);
                let z = if flip { -normal } else { normal };
                let frame = Frame { x: tangent, y: normal.cross(tangent), z };
                vec![self.push(Light::Disk(DiskLight {
                    center: place(*center),
                    frame,
                    radius: radius * scale,
                    emission,
                }))]
            }
        };
        self.sources += 1;
        Ok(FaceLights::PerFace(lights))
    }

    /// Two triangles that follow each other and make a parallelogram become one light, with better-spread samples.
    fn add_triangles(&mut self, faces: &[Face], emission: u32, textured: bool) -> Vec<u32> {
        let mut lights = Vec::with_capacity(faces.len());
        while lights.len() < faces.len() {
            let face = &faces[lights.len()];
            if let Some(light) =
                faces.get(lights.len() + 1).and_then(|next| parallelogram(face, next, emission, textured))
            {
                let id = self.push(Light::Flat(light));
                lights.extend([id, id]);
                continue;
            }
            let [a, b, c] = face.p;
            let light = FlatLight::new(a, b - a, c - a, face.flip, false, face.uvs, emission);
            lights.push(light.map_or(FaceLights::DARK, |l| self.push(Light::Flat(l))));
        }
        lights
    }
}

struct Face {
    p: [Vec3; 3],
    uvs: [[f32; 2]; 3],
    flip: bool,
}

/// The parallelogram of triangles (a, b, c) and (a, c, d): the usual halves of a quad.
fn parallelogram(first: &Face, second: &Face, emission: u32, textured: bool) -> Option<FlatLight> {
    let [a, b, c] = first.p;
    let shared = second.p[0] == a && second.p[1] == c;
    if !shared || first.flip != second.flip || !is_parallelogram(&[a, b, c, second.p[2]]) {
        return None;
    }
    let uv_closes = !textured
        || second.uvs[0] == first.uvs[0]
            && second.uvs[1] == first.uvs[2]
            && (0..2).all(|k| {
                (first.uvs[1][k] + second.uvs[2][k] - first.uvs[0][k] - first.uvs[2][k]).abs() <= 1e-5
            });
    let uvs = [first.uvs[0], first.uvs[1], second.uvs[2]];
    uv_closes.then(|| FlatLight::new(a, b - a, second.p[2] - a, first.flip, true, uvs, emission)).flatten()
}

fn is_parallelogram(p: &[Vec3; 4]) -> bool {
    let gap = (p[1] + p[3]) - (p[0] + p[2]);
    gap.length() <= 1e-5 * ((p[2] - p[0]).length() + (p[3] - p[1]).length())
}

/// Whether the winding of a face disagrees with its vertex normals; `None` without normals.
fn against_normals(
    p: &[Vec3; 3],
    normals: Option<&[[f32; 3]]>,
    face: &[u32; 3],
    instance: Option<&Placement>,
) -> Option<bool> {
    let normals = normals?;
    let sum: Vec3 = face.iter().map(|i| Vec3::from(normals[*i as usize])).sum();
    let sum = instance.map_or(sum, |i| Vec3::from(i.normal_to_world * glam::Vec3A::from(sum)));
    let ng = (p[1] - p[0]).cross(p[2] - p[0]);
    (sum.length_squared() > 0.0 && sum.is_finite()).then(|| ng.dot(sum) < 0.0)
}

/// Scale and rotation (or mirroring) of a placement of a round light.
fn similarity(instance: Option<&Placement>) -> Result<(f32, glam::Mat3), BuildError> {
    let Some(i) = instance else { return Ok((1.0, glam::Mat3::IDENTITY)) };
    let m = glam::Mat3::from(i.object_to_world.matrix3);
    let scale = m.x_axis.length();
    let r = m * (1.0 / scale);
    if !(r.transpose() * r).abs_diff_eq(glam::Mat3::IDENTITY, 1e-3) {
        return Err(BuildError::Invalid(
            "an emitting sphere or disk cannot be placed with shear or uneven scale".into(),
        ));
    }
    Ok((scale, r))
}
