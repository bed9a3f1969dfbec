//! `Shape` directives.

use super::Builder;
use super::loopsubdiv;
use super::mesh::mirrors;
use super::params::{Param, ParamList, ParamType};
use super::tessellate;
use crate::description::{ColorInput, Emission, FloatInput, Geometry, QuadMesh, TriangleMesh};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::obj;
use crate::source::Span;
use glam::DVec3;
use std::f64::consts::PI;

const TYPES: &[&str] = &[
    "trianglemesh",
    "bilinearmesh",
    "plymesh",
    "loopsubdiv",
    "curve",
    "sphere",
    "disk",
    "cylinder",
    "objmesh",
];
/// Types of version 2 that nothing stands in for.
const LOST: &[&str] = &["cone", "paraboloid", "hyperboloid", "heightfield", "nurbs"];

impl Builder<'_> {
    /// `Shape "type" parameters`.
    pub(super) fn shape(&mut self, ty: &str, at: &Span, mut params: ParamList) -> Result<(), SceneError> {
        params.add_defaults(&self.state.shape_defaults);
        self.alpha = match self.float_input(&params, "alpha", 1.0)? {
            // Said to be opaque, vertices may still have opacities.
            FloatInput::Constant(alpha) if alpha >= 1.0 && params.get("alpha").is_none() => None,
            alpha => Some(alpha),
        };
        self.alpha_cutoff = params.float("alphacutoff")?;
        let before = self.triangles;
        match ty {
            "trianglemesh" => self.triangle_mesh(at, &mut params)?,
            "bilinearmesh" => self.bilinear_mesh(at, &mut params)?,
            "sphere" => self.sphere(at, &params)?,
            "disk" => self.disk(at, &params)?,
            "cylinder" => {
                let (z_min, z_max) = heights(&params, -1.0, 1.0)?;
                let mesh = tessellate::cylinder(radius(&params)?, z_min, z_max, phi_max(&params)?);
                self.add_mesh(mesh, at)?;
            }
            "objmesh" => self.obj_mesh(at, &params)?,
            "plymesh" => {
                let path = self.required_file(&params, "filename", at)?;
                let mesh = self.ply_mesh(&path)?;
                params.ignore(&["displacement", "displacement.edgelength"]);
                self.add_mesh(mesh, at)?;
            }
            "loopsubdiv" => self.loop_subdiv(at, &mut params)?,
            "curve" => self.curve(at, &params)?,
            other if LOST.contains(&other) => {
                params.params.iter().for_each(|param| param.used.set(true));
                self.warnings.at(at, format!("shapes of type `{other}` are not supported and left out"));
            }
            other => {
                let message = format!("there is no shape type `{}`", super::parser::shorten(other));
                let known = TYPES.iter().copied();
                let error = SceneError::new(ErrorKind::Unknown, message).at(at);
                let help = "supported are: ".to_owned() + &TYPES.join(", ");
                return Err(error.help(help).maybe_help(did_you_mean(other, known)));
            }
        }
        // Files count their triangles themselves, while they are read ahead.
        if !matches!(ty, "plymesh" | "objmesh") {
            self.options.count_triangles(self.triangles - before);
        }
        params.warn_unused(&format!("shape `{ty}`"), &mut self.warnings);
        Ok(())
    }

    /// The emission of a shape with that area, from the area light in force.
    pub(super) fn emission(&mut self, area: f64, at: &Span) -> Option<Emission> {
        let light = self.state.area_light.clone()?;
        if self.object.is_some() && self.moving.is_none() {
            // As in pbrt: instances cannot be lights.
            self.warnings.at(at, "shapes inside an object definition do not emit light");
            return None;
        }
        if let Some(radiance) = light.texture {
            return Some(Emission { radiance, two_sided: light.two_sided });
        }
        let mut radiance = light.radiance;
        if let Some(power) = light.power {
            let sides = if light.two_sided { 2.0 } else { 1.0 };
            // A shape that moves was measured in its own space; exact where that is scaled evenly.
            let scale =
                self.moving.map_or(1.0, |m| glam::DMat3::from_mat4(m).determinant().abs().powf(2.0 / 3.0));
            radiance *= (f64::from(power) / (PI * area * scale * sides)) as f32;
        }
        if !radiance.is_finite() {
            self.warnings.at(&light.span, "the radiance of this light is not finite: it is ignored");
            return None;
        }
        let radiance = ColorInput::Constant(radiance);
        Some(Emission { radiance, two_sided: light.two_sided })
    }

    fn triangle_mesh(&mut self, at: &Span, params: &mut ParamList) -> Result<(), SceneError> {
        let vertices = vertices(at, params, 3)?;
        let count = vertices.positions.len();
        let indices = indices::<3>(params, count, [0, 1, 2], at)?;
        params.ignore(&["S", "faceIndices"]);
        let Vertices { positions, normals, uvs } = vertices;
        self.add_mesh(TriangleMesh { positions, indices, normals, uvs, ..TriangleMesh::default() }, at)
    }

    fn loop_subdiv(&mut self, at: &Span, params: &mut ParamList) -> Result<(), SceneError> {
        let vertices = vertices(at, params, 3)?;
        let count = vertices.positions.len();
        let indices = indices::<3>(params, count, [0, 1, 2], at)?;
        // `nlevels` before version 4.
        let name = if params.get("nlevels").is_some() { "nlevels" } else { "levels" };
        let levels = params.integer_in(name, 0..=20)?.map_or(3, i32::unsigned_abs);
        params.ignore(&["scheme"]);
        let limit = self.options.max_triangles;
        let faces = loopsubdiv::faces(indices.len(), levels).unwrap_or(u64::MAX);
        if faces > limit {
            return Err(self.options.exceeded("max_triangles", limit, faces).at(at));
        }
        self.add_mesh(loopsubdiv::subdivide(&vertices.positions, &indices, levels), at)
    }

    /// pbrt orders a patch's vertices (u, v) = (0,0), (1,0), (0,1), (1,1); a quad goes round.
    fn bilinear_mesh(&mut self, at: &Span, params: &mut ParamList) -> Result<(), SceneError> {
        let vertices = vertices(at, params, 4)?;
        let count = vertices.positions.len();
        let patches = indices::<4>(params, count, [0, 1, 2, 3], at)?;
        if let Some(file) = params.get("emissionfilename") {
            self.warnings.at(&file.span, "`emissionfilename` is not supported and ignored");
        }
        let indices = patches.iter().map(|&[p00, p10, p01, p11]| [p00, p10, p11, p01]);
        let Vertices { positions, normals, uvs } = vertices;
        if uvs.is_some() {
            let indices = indices.collect();
            return self.add_quads(QuadMesh { positions, indices, normals, uvs }, at);
        }
        // Without texture coordinates each patch has its own from 0 to 1.
        let corners: Vec<usize> = indices.flatten().map(|i| i as usize).collect();
        let quads = corners.len() / 4;
        let mesh = QuadMesh {
            positions: corners.iter().map(|&i| positions[i]).collect(),
            normals: normals.map(|normals| corners.iter().map(|&i| normals[i]).collect()),
            uvs: Some([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].repeat(quads)),
            indices: (0..quads as u32).map(|q| [4 * q, 4 * q + 1, 4 * q + 2, 4 * q + 3]).collect(),
        };
        self.add_quads(mesh, at)
    }

    fn sphere(&mut self, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let radius = radius(params)?;
        let (z_min, z_max) = heights(params, -radius, radius)?;
        let phi_max = phi_max(params)?;
        let full = z_min <= -radius && z_max >= radius && phi_max >= 2.0 * PI;
        let axes = self.axes();
        match axes {
            Some((axes, scale)) if full => {
                let center = self.state.ctm.transform_point3(DVec3::ZERO).as_vec3();
                let radius = radius * scale;
                if !(center.is_finite() && (radius as f32).is_finite() && radius as f32 > 0.0) {
                    let message = "the sphere is not finite after the transformation";
                    return Err(SceneError::new(ErrorKind::Value, message).at(at));
                }
                let area = 4.0 * PI * radius * radius;
                let geometry =
                    Geometry::Sphere { center, radius: radius as f32, axes: axes.map(|axis| axis.as_vec3()) };
                self.add_shape(geometry, area, self.state.reverse_orientation, at)
            }
            _ => self.add_mesh(tessellate::sphere(radius, z_min, z_max, phi_max), at),
        }
    }

    fn disk(&mut self, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let height = f64::from(params.float("height")?.unwrap_or(0.0));
        let radius = radius(params)?;
        let inner = params
            .float_where("innerradius", 0.0, "from 0 to the radius", |r| r >= 0.0 && f64::from(r) < radius)?;
        let phi_max = phi_max(params)?;
        match self.axes() {
            Some(([x, _, z], scale)) if inner == 0.0 && phi_max >= 2.0 * PI && !mirrors(&self.state.ctm) => {
                let center = self.state.ctm.transform_point3(DVec3::Z * height).as_vec3();
                let radius = radius * scale;
                if !(center.is_finite() && (radius as f32).is_finite() && radius as f32 > 0.0) {
                    let message = "the disk is not finite after the transformation";
                    return Err(SceneError::new(ErrorKind::Value, message).at(at));
                }
                let geometry = Geometry::Disk {
                    center,
                    normal: z.as_vec3(),
                    tangent: x.as_vec3(),
                    radius: radius as f32,
                };
                self.add_shape(geometry, PI * radius * radius, self.state.reverse_orientation, at)
            }
            _ => self.add_mesh(tessellate::disk(height, radius, f64::from(inner), phi_max), at),
        }
    }

    /// Unit axes and scale of the current transformation, if it scales evenly without shear.
    fn axes(&self) -> Option<([DVec3; 3], f64)> {
        let m = self.state.ctm;
        if m.row(3) != glam::DVec4::W {
            return None;
        }
        let axes = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate());
        let scale = axes[0].length();
        let even = axes.iter().all(|axis| (axis.length() / scale - 1.0).abs() < 1e-5);
        let unit = axes.map(|axis| axis / scale);
        let [x, y, z] = unit;
        let right = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()) < 1e-5;
        (even && right).then_some((unit, scale))
    }

    /// `objmesh`: the triangles of an OBJ file, with the current material or, on request, the file's own.
    fn obj_mesh(&mut self, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let path = self.required_file(params, "filename", at)?;
        let own_materials = params.bool("mtl")?.unwrap_or(false);
        let file = obj::read(&path, self.options, &mut self.warnings)?;
        if file.parts.iter().all(|part| part.mesh.indices.is_empty()) {
            let message = format!("there are no faces in `{}`", path.display());
            return Err(SceneError::new(ErrorKind::Invalid, message).at(at));
        }
        let materials = if own_materials {
            obj::add_materials(&file, &mut self.scene, &mut self.images, &mut self.warnings)
        } else {
            Vec::new()
        };
        let alpha = self.alpha;
        for part in file.parts {
            let own = part.material.and_then(|index| materials.get(index));
            self.mesh_material = own.map(|own| own.material);
            self.alpha = alpha.or(own.and_then(|own| own.alpha));
            let saved = self.state.area_light.clone();
            let object = self.object.and_then(|index| self.scene.objects.get(index as usize));
            let shapes = object.map_or(self.scene.shapes.len(), |object| object.shapes.len());
            self.add_mesh(part.mesh, at)?;
            if let (Some(emission), None) = (own.and_then(|own| own.emission.clone()), saved)
                && (self.object.is_none() || self.moving.is_some())
            {
                let list = match self.object.and_then(|index| self.scene.objects.get_mut(index as usize)) {
                    Some(object) => &mut object.shapes,
                    None => &mut self.scene.shapes,
                };
                list[shapes..].iter_mut().for_each(|shape| shape.emission = Some(emission.clone()));
            }
        }
        self.mesh_material = None;
        Ok(())
    }
}

fn radius(params: &ParamList) -> Result<f64, SceneError> {
    params.float_where("radius", 1.0, "positive", |r| r > 0.0).map(f64::from)
}

fn heights(params: &ParamList, low: f64, high: f64) -> Result<(f64, f64), SceneError> {
    let z_min = params.float("zmin")?.map_or(low, f64::from);
    let z_max = params.float("zmax")?.map_or(high, f64::from);
    if z_min < z_max {
        return Ok((z_min, z_max));
    }
    match params.get("zmin").or_else(|| params.get("zmax")) {
        Some(param) => Err(param.error(format!("`zmin` must be below `zmax`, not {z_min} and {z_max}"))),
        None => Ok((low, high)),
    }
}

fn phi_max(params: &ParamList) -> Result<f64, SceneError> {
    let rule = "above 0 and at most 360";
    let degrees = params.float_where("phimax", 360.0, rule, |phi| phi > 0.0 && phi <= 360.0)?;
    Ok(f64::from(degrees).to_radians())
}

/// The vertices of a mesh.
struct Vertices {
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    uvs: Option<Vec<[f32; 2]>>,
}

fn vertices(at: &Span, params: &mut ParamList, fewest: usize) -> Result<Vertices, SceneError> {
    let Some((param, p)) = params.groups("P", &[ParamType::Point3], 3)? else {
        return Err(super::missing("P", "point3", at));
    };
    let count = p.len() / 3;
    if count < fewest {
        return Err(param.error(format!("`P` needs at least {fewest} points, not {count}")));
    }
    let fits = |param: &Param, found: usize| {
        let (name, ty) = (&param.name, param.ty.name());
        let message = format!("`{ty} {name}` is for {found} vertices, but `P` has {count}");
        if found == count { Ok(()) } else { Err(param.error(message)) }
    };
    let mut has_normals = false;
    if let Some((param, n)) = params.groups("N", &[ParamType::Normal, ParamType::Point3], 3)? {
        fits(param, n.len() / 3)?;
        has_normals = true;
    }
    let mut uvs = None;
    for name in ["uv", "st"] {
        if let Some((param, uv)) = params.groups(name, &[ParamType::Point2, ParamType::Float], 2)? {
            fits(param, uv.len() / 2)?;
            uvs.get_or_insert(uv.as_chunks::<2>().0.to_vec());
        }
    }
    let positions = params.take_points("P");
    let normals = has_normals.then(|| params.take_points("N"));
    Ok(Vertices { positions, normals, uvs })
}

fn indices<const N: usize>(
    params: &ParamList,
    count: usize,
    only: [u32; N],
    at: &Span,
) -> Result<Vec<[u32; N]>, SceneError> {
    let Some((param, values)) = params.integers("indices")? else {
        if count == N {
            return Ok(vec![only]);
        }
        return Err(super::missing("indices", "integer", at));
    };
    let (groups, rest) = values.as_chunks::<N>();
    if !rest.is_empty() || groups.is_empty() {
        let found = values.len();
        return Err(
            param.error(format!("`indices` has {found} values, which is not a multiple of {N} above 0"))
        );
    }
    if let Some(i) = values.iter().position(|&v| usize::try_from(v).map_or(true, |v| v >= count)) {
        let message = format!("index {} is not in 0..{count}, the range of `P`", values[i]);
        return Err(param.value_error(i, message));
    }
    Ok(groups.iter().map(|group| group.map(i32::unsigned_abs)).collect())
}
