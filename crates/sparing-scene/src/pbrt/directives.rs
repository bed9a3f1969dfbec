//! The directives, one arm each.

use super::colorspace::ColorSpace;
use super::graphics_state::{Active, look_at, rotate};
use super::parser::{Next, Parser, shorten};
use super::{Builder, Scope};
use crate::description::ObjectDefinition;
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::{self, Span};
use glam::{DMat4, DVec3};

const DIRECTIVES: &[&str] = &[
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "Renderer",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "SurfaceIntegrator",
    "Texture",
    "Transform",
    "TransformBegin",
    "TransformEnd",
    "TransformTimes",
    "Translate",
    "Volume",
    "VolumeIntegrator",
    "WorldBegin",
    "WorldEnd",
];

impl Builder<'_> {
    /// Runs all directives.
    pub(super) fn run(&mut self, parser: &mut Parser<'_>) -> Result<(), SceneError> {
        loop {
            match parser.next_directive()? {
                Next::Directive(name, at) => self.directive(&name, &at, parser)?,
                Next::ImportEnd => self.restore(Scope::Import, None)?,
                Next::End => return Ok(()),
            }
        }
    }

    fn directive(&mut self, name: &str, at: &Span, parser: &mut Parser<'_>) -> Result<(), SceneError> {
        if self.transform(name, at, parser)? || self.block(name, at, parser)? {
            return Ok(());
        }
        match name {
            "Camera" | "Film" | "PixelFilter" | "Sampler" | "Integrator" | "SurfaceIntegrator"
            | "VolumeIntegrator" | "Renderer" | "Accelerator"
                if self.in_world =>
            {
                let message = format!("{name} is not allowed after WorldBegin");
                return Err(SceneError::new(ErrorKind::Syntax, message).at(at));
            }
            "Camera" => {
                let (ty, span) = parser.string(at)?;
                self.camera(&ty, &span, &parser.params(at)?)?;
            }
            "Film" => {
                let (ty, span) = parser.string(at)?;
                self.film(&ty, &span, &parser.params(at)?)?;
            }
            "PixelFilter" => {
                let (ty, span) = parser.string(at)?;
                self.pixel_filter(&ty, &span, &parser.params(at)?)?;
            }
            "Sampler" => {
                let (ty, span) = parser.string(at)?;
                self.sampler(&ty, &span, &parser.params(at)?)?;
            }
            "Integrator" | "SurfaceIntegrator" => {
                let (ty, span) = parser.string(at)?;
                self.integrator(&ty, &span, &parser.params(at)?)?;
            }
            // Rays always go through Embree.
            "Accelerator" => {
                parser.string(at)?;
                parser.params(at)?;
            }
            // Before version 3 light in volumes was an integrator of its own; a volume itself is a warning.
            "VolumeIntegrator" => {
                parser.string(at)?;
                parser.params(at)?;
            }
            "Renderer" => {
                let (ty, span) = parser.string(at)?;
                parser.params(at)?;
                if ty != "sampler" {
                    let message = format!("renderer `{}` is replaced by the path tracer", shorten(&ty));
                    self.warnings.at(&span, message);
                }
            }
            "Volume" => {
                let (_, span) = parser.string(at)?;
                parser.params(at)?;
                self.warnings.at(&span, "participating media are not supported and ignored");
            }
            "ColorSpace" => {
                let (space, span) = parser.string(at)?;
                let Some(known) = ColorSpace::parse(&space) else {
                    let message = format!("there is no colour space `{}`", shorten(&space));
                    let error = SceneError::new(ErrorKind::Unknown, message).at(&span);
                    return Err(error.help("known are srgb, dci-p3, rec2020 and aces2065-1"));
                };
                self.state.color_space = known;
            }
            "Option" => {
                let params = parser.params(at)?;
                if let Some(seed) = params.integer("seed")? {
                    self.scene.sampler.seed = u64::from(seed as u32);
                }
                for param in params.params.iter().filter(|param| !param.used.get()) {
                    self.warnings.at(&param.span, format!("option `{}` is ignored", param.name));
                }
            }
            "Texture" => {
                let (texture, _) = parser.string(at)?;
                let ty = parser.string(at)?;
                let class = parser.string(at)?;
                let params = parser.params(at)?;
                self.texture(texture, &ty, &class, params)?;
            }
            "Material" => {
                let (ty, span) = parser.string(at)?;
                let params = parser.params(at)?;
                self.state.material = Some(self.material(String::new(), &ty, &span, params)?);
            }
            "MakeNamedMaterial" => {
                let (name, span) = parser.string(at)?;
                let params = parser.params(at)?;
                let Some((ty, param)) = params.string("type")? else {
                    return Err(super::missing("type", "string", &span));
                };
                let (ty, span) = (ty.to_owned(), param.value_span(0));
                let id = self.material(name.clone(), &ty, &span, params)?;
                self.named_materials.insert(name, id);
            }
            "NamedMaterial" => {
                let (name, span) = parser.string(at)?;
                self.state.material = Some(self.named_material(&name, &span)?);
            }
            "AreaLightSource" => {
                let (ty, span) = parser.string(at)?;
                let params = parser.params(at)?;
                self.area_light_source(&ty, &span, params)?;
            }
            "LightSource" => {
                let (ty, span) = parser.string(at)?;
                let params = parser.params(at)?;
                self.light_source(&ty, &span, params)?;
            }
            "Shape" => {
                let (ty, span) = parser.string(at)?;
                let params = parser.params(at)?;
                self.shape_at_rest_or_moving(&ty, &span, params)?;
            }
            "ObjectInstance" => {
                let (name, span) = parser.string(at)?;
                self.instance(&name, &span)?;
            }
            "MakeNamedMedium" => {
                let (_, span) = parser.string(at)?;
                parser.params(at)?;
                self.warnings.at(&span, "participating media are not supported and ignored");
            }
            "MediumInterface" => {
                parser.string(at)?;
                parser.strings_left()?;
                self.warnings.add("MediumInterface is ignored: participating media are not supported".into());
            }
            "Include" | "Import" => {
                let (file, span) = parser.string(at)?;
                let path = self.existing_file(&file, &span)?;
                let text = source::read(&path, self.options)?;
                self.expect_meshes(&text);
                let import = name == "Import";
                parser.include(text, import, &span)?;
                if import {
                    self.save(Scope::Import, at)?;
                }
            }
            other => {
                let word = shorten(other);
                let error = SceneError::new(ErrorKind::Unknown, format!("there is no directive `{word}`"));
                return Err(error.at(at).maybe_help(did_you_mean(other, DIRECTIVES.iter().copied())));
            }
        }
        Ok(())
    }

    /// The directives that change the current transformation.
    fn transform(&mut self, name: &str, at: &Span, parser: &mut Parser<'_>) -> Result<bool, SceneError> {
        let invalid = |message: &str| SceneError::new(ErrorKind::Value, message).at(at);
        match name {
            "Identity" => self.state.set(DMat4::IDENTITY),
            "Translate" => self.state.concat(DMat4::from_translation(DVec3::from_array(parser.numbers(at)?))),
            "Scale" => {
                let scale = DVec3::from_array(parser.numbers(at)?);
                if scale.to_array().contains(&0.0) {
                    return Err(invalid("Scale by 0 squashes space"));
                }
                self.state.concat(DMat4::from_scale(scale));
            }
            "Rotate" => {
                let [degrees, x, y, z] = parser.numbers(at)?;
                let rotation = rotate(degrees, DVec3::new(x, y, z));
                self.state.concat(rotation.ok_or_else(|| invalid("Rotate needs an axis that is not 0"))?);
            }
            "LookAt" => {
                let v: [f64; 9] = parser.numbers(at)?;
                let point = |i: usize| DVec3::new(v[i], v[i + 1], v[i + 2]);
                let matrix = look_at(point(0), point(3), point(6));
                let message = "LookAt needs an eye away from its target and an up vector across the view";
                self.state.concat(matrix.ok_or_else(|| invalid(message))?);
            }
            "Transform" => self.state.set(DMat4::from_cols_array(&parser.numbers(at)?)),
            "ConcatTransform" => self.state.concat(DMat4::from_cols_array(&parser.numbers(at)?)),
            "CoordinateSystem" => {
                let (system, _) = parser.string(at)?;
                self.coordinate_systems.insert(system, [self.state.ctm, self.state.ctm_end]);
            }
            "CoordSysTransform" => {
                let (system, span) = parser.string(at)?;
                let Some(matrices) = self.coordinate_systems.get(&system) else {
                    let message = format!("there is no coordinate system `{}`", shorten(&system));
                    let known = self.coordinate_systems.keys().map(String::as_str);
                    let error = SceneError::new(ErrorKind::Unknown, message).at(&span);
                    return Err(error.maybe_help(did_you_mean(&system, known)));
                };
                [self.state.ctm, self.state.ctm_end] = *matrices;
            }
            "ReverseOrientation" => self.state.reverse_orientation = !self.state.reverse_orientation,
            "ActiveTransform" => {
                let (word, span) = parser.word("StartTime, EndTime or All", at)?;
                self.state.active = match word.as_str() {
                    "All" => Active::All,
                    "StartTime" => Active::StartTime,
                    "EndTime" => Active::EndTime,
                    other => {
                        let message = format!("there is no transformation `{}`", shorten(other));
                        let error = SceneError::new(ErrorKind::Unknown, message).at(&span);
                        return Err(error.help("known are StartTime, EndTime and All"));
                    }
                };
            }
            "TransformTimes" => {
                let [start, end] = parser.numbers(at)?;
                if start >= end {
                    return Err(invalid("TransformTimes takes a start and a later end"));
                }
                if self.in_world {
                    let message = "TransformTimes is not allowed after WorldBegin";
                    return Err(SceneError::new(ErrorKind::Syntax, message).at(at));
                }
                self.transform_times = [start, end];
            }
            _ => return Ok(false),
        }
        if !(self.state.ctm.is_finite() && self.state.ctm_end.is_finite()) {
            return Err(invalid("the transformation grew beyond all numbers"));
        }
        Ok(true)
    }

    /// The directives that open and close blocks.
    fn block(&mut self, name: &str, at: &Span, parser: &mut Parser<'_>) -> Result<bool, SceneError> {
        match name {
            "WorldBegin" => {
                if self.in_world {
                    let message = "a scene has one WorldBegin";
                    return Err(SceneError::new(ErrorKind::Syntax, message).at(at));
                }
                self.in_world = true;
                (self.state.ctm, self.state.ctm_end) = (DMat4::IDENTITY, DMat4::IDENTITY);
                self.state.active = Active::All;
                self.coordinate_systems.insert("world".to_owned(), [DMat4::IDENTITY; 2]);
            }
            // The end of a scene before pbrt-v4.
            "WorldEnd" => {}
            "AttributeBegin" => self.save(Scope::Attribute, at)?,
            "AttributeEnd" => self.restore(Scope::Attribute, Some((name, at)))?,
            "TransformBegin" => self.save(Scope::Transform, at)?,
            "TransformEnd" => self.restore(Scope::Transform, Some((name, at)))?,
            "ObjectBegin" => {
                let (object, _) = parser.string(at)?;
                if self.object.is_some() {
                    let message = "an object definition cannot contain another";
                    return Err(SceneError::new(ErrorKind::Syntax, message).at(at));
                }
                self.count_entity()?;
                self.save(Scope::Object, at)?;
                let index = self.scene.objects.len() as u32;
                self.scene.objects.push(ObjectDefinition { name: object.clone(), shapes: Vec::new() });
                self.objects.insert(object, index);
                self.object = Some(index);
            }
            "ObjectEnd" => {
                self.restore(Scope::Object, Some((name, at)))?;
                self.object = None;
            }
            "Attribute" => {
                let (target, span) = parser.string(at)?;
                let params = parser.params(at)?.params;
                let state = &mut self.state;
                let defaults = match target.as_str() {
                    "shape" => &mut state.shape_defaults,
                    "light" => &mut state.light_defaults,
                    "material" => &mut state.material_defaults,
                    "texture" => &mut state.texture_defaults,
                    "medium" => return Ok(true),
                    other => {
                        let message = format!("there are no attributes of `{}`", shorten(other));
                        let error = SceneError::new(ErrorKind::Unknown, message).at(&span);
                        return Err(error.help("known are shape, light, material, medium and texture"));
                    }
                };
                defaults.retain(|old| params.iter().all(|new| new.name != old.name));
                defaults.extend(params);
                let count = defaults.len() as u64;
                if count > self.options.max_params {
                    return Err(self.options.exceeded("max_params", self.options.max_params, count).at(at));
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn save(&mut self, scope: Scope, at: &Span) -> Result<(), SceneError> {
        let depth = self.saved.len() as u64;
        if depth >= self.options.max_nesting {
            return Err(self.options.exceeded("max_nesting", self.options.max_nesting, depth + 1).at(at));
        }
        self.saved.push((scope, self.state.clone(), at.clone()));
        Ok(())
    }

    /// Restores what the matching `save` kept; `end` is the closing directive.
    fn restore(&mut self, scope: Scope, end: Option<(&str, &Span)>) -> Result<(), SceneError> {
        match (self.saved.pop(), end) {
            (Some((opened, state, _)), _) if opened == scope => {
                if scope == Scope::Transform {
                    (self.state.ctm, self.state.ctm_end) = (state.ctm, state.ctm_end);
                    self.state.active = state.active;
                } else {
                    self.state = state;
                }
                Ok(())
            }
            (Some((_, _, opened_at)), Some((name, at))) => {
                let (line, _) = opened_at.line_column();
                let message = format!("{name} does not close the block opened in line {line}");
                Err(SceneError::new(ErrorKind::Syntax, message).at(at))
            }
            (None, Some((name, at))) => {
                let message = format!("{name} without its beginning");
                Err(SceneError::new(ErrorKind::Syntax, message).at(at))
            }
            (opened, None) => {
                let error =
                    SceneError::new(ErrorKind::Syntax, "a block is not closed within its imported file");
                Err(match opened {
                    Some((_, _, at)) => error.at(&at),
                    None => error,
                })
            }
        }
    }
}
