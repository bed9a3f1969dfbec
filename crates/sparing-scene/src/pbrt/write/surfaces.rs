//! Textures, materials, shapes and their placements.

use super::text::{color, number, numbers, quoted};
use super::{Writer, procedural, unsupported};
use crate::description::{
    ColorInput, Conductor, FloatInput, Geometry, Material, MaterialKind, MetallicRoughness, Roughness, Shape,
    Texture, TextureEncoding, TextureId, TriangleMesh, UvMapping, Wrap,
};
use crate::error::SceneError;
use glam::{Mat3, Mat4, Vec3};
use std::collections::HashSet;

fn name(id: TextureId) -> String {
    format!("\"texture {}\"", id.0)
}

pub(super) fn color_input(parameter: &str, input: ColorInput) -> String {
    match input {
        ColorInput::Constant(value) => color(parameter, value),
        ColorInput::Texture(id) => format!(" \"texture {parameter}\" {}", name(id)),
    }
}

pub(super) fn float_input(parameter: &str, input: FloatInput) -> String {
    match input {
        FloatInput::Constant(value) => number(parameter, value),
        FloatInput::Texture(id) => format!(" \"texture {parameter}\" {}", name(id)),
    }
}

fn roughness(roughness: &Roughness) -> String {
    let remap = format!(" \"bool remaproughness\" {}", roughness.remap);
    float_input("uroughness", roughness.u) + &float_input("vroughness", roughness.v) + &remap
}

pub(super) fn mapping(mapping: &UvMapping) -> String {
    let ([su, sv], [du, dv]) = (mapping.scale, mapping.offset);
    let [uv, vu] = mapping.cross;
    let cross =
        if mapping.cross == [0.0; 2] { String::new() } else { number("uperv", uv) + &number("vperu", vu) };
    number("uscale", su) + &number("vscale", sv) + &number("udelta", du) + &number("vdelta", dv) + &cross
}

/// Repetition outside 0..1 along u and v.
fn wraps([u, v]: [Wrap; 2]) -> String {
    let name = |wrap: Wrap| match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Clamp => "clamp",
        Wrap::Black => "black",
        Wrap::Mirror => "mirror",
    };
    let second = if u == v { String::new() } else { format!(" \"string wrapv\" \"{}\"", name(v)) };
    format!(" \"string wrap\" \"{}\"{second}", name(u))
}

impl<'a> Writer<'a> {
    /// Textures that are normal maps and nothing else: they are written with their materials.
    fn only_normal_maps(&self) -> HashSet<TextureId> {
        let scene = self.scene;
        let maps = scene.materials.iter().filter_map(|m| m.normal_map);
        let mut only: HashSet<TextureId> = maps.filter(|id| self.plain_picture(*id).is_some()).collect();
        let mut used = Vec::new();
        let mut color = |input: &ColorInput| {
            if let ColorInput::Texture(id) = input {
                used.push(*id);
            }
        };
        let float = |input: &FloatInput| match input {
            FloatInput::Texture(id) => ColorInput::Texture(*id),
            FloatInput::Constant(value) => ColorInput::Constant(Vec3::splat(*value)),
        };
        for texture in &scene.textures {
            texture.inputs().iter().for_each(&mut color);
        }
        for material in &scene.materials {
            material.bump.iter().for_each(|id| color(&ColorInput::Texture(*id)));
            let mut rough = |r: &Roughness| [float(&r.u), float(&r.v)].iter().for_each(&mut color);
            match &material.kind {
                MaterialKind::Diffuse { reflectance } => color(reflectance),
                MaterialKind::Conductor { conductor, roughness } => {
                    rough(roughness);
                    match conductor {
                        Conductor::EtaK { eta, k } => [eta, k].into_iter().for_each(&mut color),
                        Conductor::Reflectance(reflectance) => color(reflectance),
                    }
                }
                MaterialKind::Dielectric { roughness, tint: input, .. }
                | MaterialKind::CoatedDiffuse { roughness, reflectance: input, .. } => {
                    rough(roughness);
                    color(input);
                }
                MaterialKind::DiffuseTransmission { reflectance, transmittance } => {
                    [reflectance, transmittance].into_iter().for_each(&mut color);
                }
                MaterialKind::Mix { amount, .. } => color(&float(amount)),
                MaterialKind::MetallicRoughness(m) => {
                    [m.base_color, m.specular_color].iter().for_each(&mut color);
                    let numbers = [m.metallic, m.roughness, m.specular, m.transmission, m.clearcoat];
                    let numbers = numbers.iter().chain([&m.clearcoat_roughness]);
                    numbers.for_each(|number| color(&float(number)));
                }
                MaterialKind::ThinDielectric { .. } | MaterialKind::Interface => {}
                MaterialKind::OrenNayar { reflectance, sigma } => {
                    [reflectance, &float(sigma)].into_iter().for_each(&mut color);
                }
                MaterialKind::Mirror { reflectance } => color(reflectance),
                MaterialKind::Uber { diffuse, specular, mirror, transmission, roughness, .. } => {
                    rough(roughness);
                    [diffuse, specular, mirror, transmission].into_iter().for_each(&mut color);
                }
                MaterialKind::Substrate { diffuse, specular, roughness } => {
                    rough(roughness);
                    [diffuse, specular].into_iter().for_each(&mut color);
                }
                MaterialKind::CoatedConductor { conductor, roughness, coat_roughness, .. } => {
                    rough(roughness);
                    rough(coat_roughness);
                    match conductor {
                        Conductor::EtaK { eta, k } => [eta, k].into_iter().for_each(&mut color),
                        Conductor::Reflectance(reflectance) => color(reflectance),
                    }
                }
            }
        }
        let objects = scene.objects.iter().flat_map(|object| &object.shapes);
        for shape in scene.shapes.iter().chain(objects) {
            shape.alpha.iter().for_each(|alpha| color(&float(alpha)));
            shape.emission.iter().for_each(|emission| color(&emission.radiance));
        }
        used.iter().for_each(|id| {
            only.remove(id);
        });
        only
    }

    pub fn textures(&mut self) -> Result<(), SceneError> {
        let skip = self.only_normal_maps();
        for (i, texture) in self.scene.textures.iter().enumerate() {
            let id = TextureId(i as u32);
            if skip.contains(&id) {
                continue;
            }
            let text = match texture {
                Texture::Constant(value) => format!("\"constant\"{}", color("value", *value)),
                Texture::Image { image, mapping: uv, wrap, scale, invert } => {
                    let encoding = match self.scene.images[image.0 as usize].encoding {
                        TextureEncoding::Auto => String::new(),
                        TextureEncoding::Srgb => " \"string encoding\" \"sRGB\"".to_owned(),
                        TextureEncoding::Linear => " \"string encoding\" \"linear\"".to_owned(),
                        TextureEncoding::Gamma(gamma) => format!(" \"string encoding\" \"gamma {gamma}\""),
                        TextureEncoding::Alpha => " \"string encoding\" \"alpha\"".to_owned(),
                        TextureEncoding::Red => " \"string encoding\" \"red\"".to_owned(),
                        TextureEncoding::Green => " \"string encoding\" \"green\"".to_owned(),
                        TextureEncoding::Blue => " \"string encoding\" \"blue\"".to_owned(),
                    };
                    let wrap = wraps(*wrap);
                    let file = format!(" \"string filename\" {}", self.pictures[image.0 as usize]);
                    let further = number("scale", *scale) + &mapping(uv);
                    format!("\"imagemap\"{file}{encoding}{wrap} \"bool invert\" {invert}{further}")
                }
                Texture::Checkerboard { mapping: uv, even, odd } => {
                    let colors = color_input("tex1", *even) + &color_input("tex2", *odd);
                    format!("\"checkerboard\"{colors}{}", mapping(uv))
                }
                Texture::Scale { a, b } => scaled(*a, *b),
                Texture::Mix { a, b, amount } => {
                    let colors = color_input("tex1", *a) + &color_input("tex2", *b);
                    format!("\"mix\"{colors}{}", float_input("amount", *amount))
                }
                rare => {
                    let (frame, text) = procedural::texture(rare);
                    let matrix = numbers_of(&Mat4::from(frame.inverse()));
                    let directive = format!("Texture {} \"spectrum\" {text}", name(id));
                    self.out.line(&format!(
                        "AttributeBegin\n  Transform [ {matrix} ]\n  {directive}\nAttributeEnd"
                    ));
                    continue;
                }
            };
            self.out.line(&format!("Texture {} \"spectrum\" {text}", name(id)));
        }
        Ok(())
    }

    pub fn materials(&mut self) {
        for (i, material) in self.scene.materials.iter().enumerate() {
            let kind = self.material_kind(material);
            let maps = self.maps(material);
            let name = &self.names.materials[i];
            self.out.line(&format!("MakeNamedMaterial {name} \"string type\" {kind}{maps}"));
        }
    }

    fn material_kind(&self, material: &Material) -> String {
        match &material.kind {
            MaterialKind::Diffuse { reflectance } => {
                format!("\"diffuse\"{}", color_input("reflectance", *reflectance))
            }
            MaterialKind::Conductor { conductor, roughness: r } => {
                let substance = match conductor {
                    Conductor::EtaK { eta, k } => color_input("eta", *eta) + &color_input("k", *k),
                    Conductor::Reflectance(value) => color_input("reflectance", *value),
                };
                format!("\"conductor\"{substance}{}", roughness(r))
            }
            MaterialKind::Dielectric { eta, roughness: r, tint } => {
                let tint = color_input("tint", *tint);
                format!("\"dielectric\"{}{tint}{}", number("eta", *eta), roughness(r))
            }
            MaterialKind::ThinDielectric { eta } => format!("\"thindielectric\"{}", number("eta", *eta)),
            MaterialKind::CoatedDiffuse { reflectance, roughness: r, eta } => {
                let base = color_input("reflectance", *reflectance) + &number("eta", *eta);
                format!("\"coateddiffuse\"{base}{}", roughness(r))
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance } => {
                let transmitted = color_input("transmittance", *transmittance);
                format!("\"diffusetransmission\"{}{transmitted}", color_input("reflectance", *reflectance))
            }
            MaterialKind::Mix { materials, amount } => {
                let [a, b] = materials.map(|id| self.names.materials[id.0 as usize].as_str());
                format!("\"mix\" \"string materials\" [ {a} {b} ]{}", float_input("amount", *amount))
            }
            MaterialKind::Interface => "\"interface\"".to_owned(),
            MaterialKind::OrenNayar { reflectance, sigma } => {
                format!("\"matte\"{}{}", color_input("Kd", *reflectance), float_input("sigma", *sigma))
            }
            MaterialKind::Mirror { reflectance } => format!("\"mirror\"{}", color_input("Kr", *reflectance)),
            MaterialKind::Uber { diffuse, specular, mirror, transmission, roughness: r, eta } => {
                let matte = color_input("Kd", *diffuse) + &color_input("Ks", *specular);
                let clear = color_input("Kr", *mirror) + &color_input("Kt", *transmission);
                format!("\"uber\"{matte}{clear}{}{}", number("index", *eta), roughness(r))
            }
            MaterialKind::Substrate { diffuse, specular, roughness: r } => {
                let colors = color_input("Kd", *diffuse) + &color_input("Ks", *specular);
                format!("\"substrate\"{colors}{}", roughness(r))
            }
            MaterialKind::CoatedConductor { conductor, roughness: r, eta, coat_roughness: coat } => {
                let substance = match conductor {
                    Conductor::EtaK { eta, k } => {
                        color_input("conductor.eta", *eta) + &color_input("conductor.k", *k)
                    }
                    Conductor::Reflectance(value) => color_input("reflectance", *value),
                };
                let axis = |name: &str, v: FloatInput| float_input(name, v);
                let rough = axis("conductor.uroughness", r.u) + &axis("conductor.vroughness", r.v);
                let coat = axis("interface.uroughness", coat.u) + &axis("interface.vroughness", coat.v);
                let remap = format!(" \"bool remaproughness\" {}", r.remap);
                format!("\"coatedconductor\"{substance}{rough}{coat}{}{remap}", number("interface.eta", *eta))
            }
            MaterialKind::MetallicRoughness(m) => metallic_roughness(m),
        }
    }

    /// The file of a texture that is a linear picture and nothing else, as pbrt wants normal maps.
    fn plain_picture(&self, id: TextureId) -> Option<&str> {
        match &self.scene.textures[id.0 as usize] {
            Texture::Image {
                image,
                mapping,
                wrap: [Wrap::Repeat, Wrap::Repeat],
                scale: 1.0,
                invert: false,
            } if *mapping == UvMapping::default()
                && self.scene.images[image.0 as usize].encoding == TextureEncoding::Linear =>
            {
                Some(&self.pictures[image.0 as usize])
            }
            _ => None,
        }
    }

    fn maps(&self, material: &Material) -> String {
        let mut text = String::new();
        if let Some(id) = material.normal_map {
            text += &match self.plain_picture(id) {
                Some(picture) => format!(" \"string normalmap\" {picture}"),
                None => format!(" \"texture normalmap\" {}", name(id)),
            };
        }
        if let Some(id) = material.bump {
            text += &format!(" \"texture displacement\" {}", name(id));
        }
        text
    }

    pub fn shapes(&mut self) -> Result<(), SceneError> {
        let scene = self.scene;
        for shape in &scene.shapes {
            self.shape(shape)?;
        }
        // What moves and emits is written as shapes where the transformation moves: objects cannot emit.
        let emits: Vec<bool> =
            scene.objects.iter().map(|o| o.shapes.iter().any(|s| s.emission.is_some())).collect();
        for (i, (object, name)) in scene.objects.iter().zip(self.names.objects.clone()).enumerate() {
            if emits[i] {
                let mut placed = scene.instances.iter().filter(|instance| instance.object as usize == i);
                if placed.any(|instance| instance.end.is_none()) {
                    return Err(unsupported("emission inside an object"));
                }
                continue;
            }
            self.out.line(&format!("ObjectBegin {name}"));
            for shape in &object.shapes {
                self.shape(shape)?;
            }
            self.out.line("ObjectEnd");
        }
        for instance in &scene.instances {
            self.out.line("AttributeBegin");
            let end = instance.end.map(|end| numbers_of(&Mat4::from(end)));
            self.transform(&numbers_of(&Mat4::from(instance.object_to_world)), end);
            let object = instance.object as usize;
            if emits[object] {
                for shape in &scene.objects[object].shapes {
                    self.shape(shape)?;
                }
            } else {
                let name = &self.names.objects[object];
                self.out.line(&format!("  ObjectInstance {name}"));
            }
            self.out.line("AttributeEnd");
        }
        Ok(())
    }

    /// Sets the current transformation, or both of one that moves.
    pub fn transform(&mut self, start: &str, end: Option<String>) {
        self.out.line(&format!("  Transform [ {start} ]"));
        if let Some(end) = end {
            self.out.line(&format!("  ActiveTransform EndTime Transform [ {end} ] ActiveTransform All"));
        }
    }

    /// A mesh in a file of its own.
    fn ply_mesh(&mut self, mesh: &'a TriangleMesh) -> Result<String, SceneError> {
        let Some(folder) = &self.meshes else {
            return Err(unsupported(match mesh.colors {
                Some(_) => "the colours of vertices",
                None => "second texture coordinates and tangents",
            }));
        };
        let file = folder.join(format!("mesh-{}.ply", self.files.meshes.len()));
        let text = format!("\"plymesh\" \"string filename\" {}", quoted(&file.to_string_lossy()));
        self.files.meshes.push((file, mesh));
        Ok(text)
    }

    fn shape(&mut self, shape: &'a Shape) -> Result<(), SceneError> {
        let (frame, geometry) = match &shape.geometry {
            Geometry::Triangles(mesh) if mesh.indices.is_empty() => return Ok(()),
            Geometry::Quads(mesh) if mesh.indices.is_empty() => return Ok(()),
            Geometry::Triangles(mesh) if self.meshes.is_some() || needs_file(mesh) => {
                (None, self.ply_mesh(mesh)?)
            }
            Geometry::Triangles(mesh) => {
                let vertices = vertices(&mesh.positions, mesh.normals.as_deref(), mesh.uvs.as_deref());
                let indices = numbers("integer indices", mesh.indices.as_flattened());
                (None, format!("\"trianglemesh\"{indices}{vertices}"))
            }
            Geometry::Quads(mesh) => {
                let vertices = vertices(&mesh.positions, mesh.normals.as_deref(), mesh.uvs.as_deref());
                let patches: Vec<[u32; 4]> = mesh.indices.iter().map(|&[a, b, c, d]| [a, b, d, c]).collect();
                let indices = numbers("integer indices", patches.as_flattened());
                (None, format!("\"bilinearmesh\"{indices}{vertices}"))
            }
            Geometry::Sphere { center, radius, axes: [x, y, z] } => {
                let frame = (Mat3::from_cols(*x, *y, *z), *center);
                (Some(frame), format!("\"sphere\"{}", number("radius", *radius)))
            }
            Geometry::Disk { center, normal, tangent, radius } => {
                let frame = (Mat3::from_cols(*tangent, normal.cross(*tangent), *normal), *center);
                (Some(frame), format!("\"disk\"{}", number("radius", *radius)))
            }
        };
        self.out.line("AttributeBegin");
        if let Some((axes, center)) = frame {
            let mut matrix = Mat4::from_mat3(axes);
            matrix.w_axis = center.extend(1.0);
            // Relative to what may move around it; outside of that the transformation is the identity.
            self.out.line(&format!("  ConcatTransform [ {} ]", numbers_of(&matrix)));
        }
        if shape.reverse_orientation {
            self.out.line("  ReverseOrientation");
        }
        if let Some(emission) = &shape.emission {
            let sides = if emission.two_sided { " \"bool twosided\" true" } else { "" };
            let radiance = color_input("L", emission.radiance);
            self.out.line(&format!("  AreaLightSource \"diffuse\"{radiance}{sides}"));
        }
        let mut alpha = shape.alpha.map(|alpha| float_input("alpha", alpha)).unwrap_or_default();
        alpha += &shape.alpha_cutoff.map(|cutoff| number("alphacutoff", cutoff)).unwrap_or_default();
        self.out.line(&format!("  NamedMaterial {}", self.names.materials[shape.material.0 as usize]));
        self.out.line(&format!("  Shape {geometry}{alpha}\nAttributeEnd"));
        Ok(())
    }
}

fn metallic_roughness(m: &MetallicRoughness) -> String {
    let colors = [("basecolor", m.base_color), ("specularcolor", m.specular_color)];
    let numbers = [
        ("metallic", m.metallic),
        ("roughness", m.roughness),
        ("specular", m.specular),
        ("transmission", m.transmission),
        ("clearcoat", m.clearcoat),
        ("clearcoatroughness", m.clearcoat_roughness),
    ];
    let mut text = format!("\"metallicroughness\"{}", number("eta", m.eta));
    text.extend(colors.map(|(name, input)| color_input(name, input)));
    text.extend(numbers.map(|(name, input)| float_input(name, input)));
    if m.vertex_colors {
        text += " \"bool vertexcolors\" true";
    }
    text
}

/// A product: of a texture or colour and a number or texture, or of two of the same kind as before version 4.
fn scaled(a: ColorInput, b: ColorInput) -> String {
    let factor = match (a, b) {
        (ColorInput::Constant(a), ColorInput::Constant(b)) => {
            return format!("\"constant\"{}", color("value", a * b));
        }
        (_, ColorInput::Constant(b)) if b.x == b.y && b.y == b.z => FloatInput::Constant(b.x),
        (_, ColorInput::Texture(b)) => FloatInput::Texture(b),
        _ => return format!("\"scale\"{}{}", color_input("tex1", a), color_input("tex2", b)),
    };
    format!("\"scale\"{}{}", color_input("tex", a), float_input("scale", factor))
}

fn numbers_of(matrix: &Mat4) -> String {
    matrix.to_cols_array().map(|v| v.to_string()).join(" ")
}

/// Whether a mesh has what the text of a shape cannot say.
fn needs_file(mesh: &TriangleMesh) -> bool {
    mesh.colors.is_some() || mesh.second_uvs.is_some() || mesh.tangents.is_some()
}

fn vertices(positions: &[[f32; 3]], normals: Option<&[[f32; 3]]>, uvs: Option<&[[f32; 2]]>) -> String {
    let mut text = numbers("point3 P", positions.as_flattened());
    if let Some(normals) = normals {
        text += &numbers("normal N", normals.as_flattened());
    }
    if let Some(uvs) = uvs {
        text += &numbers("point2 uv", uvs.as_flattened());
    }
    text
}
