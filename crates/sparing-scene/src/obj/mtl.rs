//! MTL materials.
//!
//! | in the file | becomes |
//! | --- | --- |
//! | `illum` 4, 6, 7, 9, or `d` < 1 with `Ni` other than 1 | dielectric, tint = square root of `Tf` (two crossings) |
//! | `map_Pm` | a mix by its red channel of the last two rows and a conductor of reflectance `Kd` |
//! | `Pm` > 0.5 | conductor of reflectance `Kd` (`Ks` where that is black) |
//! | `illum` 3 or 5 with `Ks` brighter than `Kd` | conductor of reflectance `Ks` |
//! | `Ks` > 0 | diffuse `Kd` under a coat of index `Ni` (1.5 where it makes no sense) |
//! | else | diffuse `Kd` |
//!
//! GGX alpha is `Pr`, else from the Blinn-Phong exponent: sqrt(2 / (Ns + 2)) (Walter et al. 2007); an `Ns` of
//! 10000 or more is smooth. `map_Kd` is multiplied by `Kd` unless that is black. `Ke` emits from both sides, as
//! the winding of OBJ files is not to be trusted. Opacity: `map_d`, else the alpha channel of a `map_Kd` PNG, else
//! `d`. `norm` and `map_Kn` are normal maps, `bump` and `map_Bump` heights. Units of `-bm` are scene units.

use super::ObjFile;
use crate::description::{
    ColorInput, Conductor, Emission, FloatInput, ImageSource, Material, MaterialId, MaterialKind, Roughness,
    SceneDescription, Texture, TextureEncoding, TextureId, UvMapping, Wrap,
};
use crate::error::SceneError;
use crate::images::{ImageTable, has_alpha};
use crate::options::LoadOptions;
use crate::source::{self, SourceFile};
use crate::warnings::Warnings;
use glam::Vec3;
use std::path::{Path, PathBuf};

/// A material with what belongs to the shapes that have it.
pub(crate) struct ObjMaterial {
    pub material: MaterialId,
    pub emission: Option<Emission>,
    pub alpha: Option<FloatInput>,
}

/// The files that an `mtllib` line names: one name with spaces, or several.
pub(super) fn library_paths(folder: &Path, name: &str) -> Vec<PathBuf> {
    let name = name.replace('\\', "/");
    let whole = folder.join(&name);
    if whole.is_file() || !name.contains(' ') {
        return vec![whole];
    }
    name.split_ascii_whitespace().map(|part| folder.join(part)).collect()
}

/// Reads an MTL file; lines that make no sense are warnings.
pub(super) fn read_library(
    path: &Path,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<Vec<tobj::Material>, SceneError> {
    let file = source::read(path, options)?;
    let text = String::from_utf8_lossy(&file.bytes);
    let mut clean = String::with_capacity(text.len());
    let mut named = false;
    let text = text.trim_start_matches('\u{feff}').replace("\r\n", "\n");
    for (number, line) in text.split(['\n', '\r']).enumerate() {
        let mut words = line.split_ascii_whitespace();
        let Some(key) = words.next() else { continue };
        named |= key == "newmtl";
        if key.starts_with('#') || !named {
            continue;
        }
        // Comments at the end of a line and several numbers where one is meant are common.
        let values: Vec<&str> = words.take_while(|word| !word.starts_with('#')).collect();
        let numbers = values.iter().map_while(|word| word.parse::<f32>().ok().filter(|v| v.is_finite()));
        let numbers: Vec<f32> = numbers.take(3).collect();
        let fixed = match (key, &numbers[..]) {
            ("Ka" | "Kd" | "Ks" | "Ke" | "Tf", [r, g, b]) => Some(format!("{key} {r} {g} {b}")),
            ("Ka" | "Kd" | "Ks" | "Ke" | "Tf", [grey]) => Some(format!("{key} {grey} {grey} {grey}")),
            ("Ns" | "Ni" | "d" | "Tr" | "Pr" | "Pm", [value, ..]) => Some(format!("{key} {value}")),
            ("illum", [value, ..]) if (0.0..=255.0).contains(value) => {
                Some(format!("illum {}", *value as u8))
            }
            ("Ka" | "Kd" | "Ks" | "Ke" | "Tf" | "Ns" | "Ni" | "d" | "Tr" | "Pr" | "Pm" | "illum", _) => None,
            _ if values.is_empty() => None,
            _ => Some(format!("{key} {}", values.join(" "))),
        };
        match fixed {
            Some(line) => {
                clean.push_str(&line);
                clean.push('\n');
            }
            None => {
                let span = SourceFile::line(&file.name, number + 1, line.as_bytes());
                warnings.at(&span, format!("`{}` is not understood here and ignored", line.trim()));
            }
        }
    }
    match tobj::load_mtl_buf(&mut clean.as_bytes()) {
        Ok((materials, _)) => Ok(materials),
        Err(error) => {
            warnings.add(format!("{}: {error}", file.name));
            Ok(Vec::new())
        }
    }
}

/// Adds all materials of a file to the scene.
pub(crate) fn add_materials(
    file: &ObjFile,
    scene: &mut SceneDescription,
    images: &mut ImageTable,
    warnings: &mut Warnings,
) -> Vec<ObjMaterial> {
    let mut adder = Adder { folder: &file.folder, scene, images, warnings };
    file.materials.iter().map(|material| adder.add(material)).collect()
}

struct Adder<'a> {
    folder: &'a Path,
    scene: &'a mut SceneDescription,
    images: &'a mut ImageTable,
    warnings: &'a mut Warnings,
}

/// A texture reference with its options.
struct MapReference {
    path: PathBuf,
    mapping: UvMapping,
    wrap: [Wrap; 2],
    strength: f32,
    /// What `-imfchan` asks for.
    channel: Option<TextureEncoding>,
}

impl Adder<'_> {
    fn add(&mut self, m: &tobj::Material) -> ObjMaterial {
        let number = |key: &str| m.unknown_param.get(key).and_then(|value| value.parse::<f32>().ok());
        let unknown = |keys: &[&str]| keys.iter().find_map(|key| m.unknown_param.get(*key)).cloned();
        let color = |value: Option<[f32; 3]>| value.map(|v| Vec3::from(v).max(Vec3::ZERO));
        let albedo = |value: Option<[f32; 3]>| color(value).map(|v| v.min(Vec3::ONE));
        let kd = albedo(m.diffuse).unwrap_or(Vec3::splat(0.5));
        let ks = albedo(m.specular).unwrap_or(Vec3::ZERO);
        let opacity = m.dissolve.or(number("Tr").map(|tr| 1.0 - tr)).unwrap_or(1.0).clamp(0.0, 1.0);
        let ni = m.optical_density.filter(|ni| (0.1..=10.0).contains(ni));

        let diffuse_map = self.map(m.diffuse_texture.as_deref());
        let cutout = match self.map(m.dissolve_texture.as_deref()) {
            Some(map) => Some(map),
            None => diffuse_map.as_ref().filter(|map| has_alpha(&ImageSource::File(map.path.clone()))).map(
                |map| MapReference {
                    path: map.path.clone(),
                    mapping: map.mapping,
                    wrap: map.wrap,
                    strength: 1.0,
                    channel: None,
                },
            ),
        };
        let kd_input = self.color(kd, diffuse_map);
        let illum = m.illumination_model.unwrap_or(2);
        let clear = matches!(illum, 4 | 6 | 7 | 9) && ni.is_some();
        let clear = clear || (opacity < 1.0 && cutout.is_none() && ni.is_some_and(|ni| ni != 1.0));
        let metalness = self.map(unknown(&["map_Pm"]).as_deref()).filter(|_| !clear);
        let metal = number("Pm").unwrap_or(0.0) > 0.5 && metalness.is_none();
        let mirror = matches!(illum, 3 | 5) && ks.element_sum() > kd.element_sum() && metalness.is_none();
        let kind = if clear {
            let tf = unknown(&["Tf"]).and_then(|text| three(&text)).unwrap_or(Vec3::ONE);
            MaterialKind::Dielectric {
                eta: ni.unwrap_or(1.5),
                roughness: self.roughness(m, number("Pr"), true),
                tint: ColorInput::Constant(tf.clamp(Vec3::ZERO, Vec3::ONE).powf(0.5)),
            }
        } else if metal || mirror {
            let base = if mirror || kd == Vec3::ZERO {
                let map = self.map(m.specular_texture.as_deref());
                self.color(ks, map)
            } else {
                kd_input
            };
            MaterialKind::Conductor {
                conductor: Conductor::Reflectance(base),
                roughness: self.roughness(m, number("Pr"), false),
            }
        } else if ks.max_element() > 0.0 {
            MaterialKind::CoatedDiffuse {
                reflectance: kd_input,
                roughness: self.roughness(m, number("Pr"), false),
                eta: ni.filter(|ni| (1.05..=3.0).contains(ni)).unwrap_or(1.5),
            }
        } else {
            MaterialKind::Diffuse { reflectance: kd_input }
        };

        let normal_map = self.map(unknown(&["norm", "map_Kn", "map_kn"]).as_deref());
        let normal_map = normal_map.map(|map| self.texture(&map, TextureEncoding::Linear, 1.0));
        let bump = self.map(m.normal_texture.as_deref());
        let bump = bump.map(|map| self.texture(&map, TextureEncoding::Linear, map.strength));
        let alpha = match cutout {
            Some(map) => Some(FloatInput::Texture(self.texture(&map, TextureEncoding::Alpha, 1.0))),
            None => (opacity < 1.0 && !clear).then_some(FloatInput::Constant(opacity)),
        };
        let kind = match metalness {
            None => kind,
            Some(map) => {
                let amount = FloatInput::Texture(self.texture(&map, TextureEncoding::Red, 1.0));
                let roughness = self.roughness(m, number("Pr"), false);
                let metal =
                    MaterialKind::Conductor { conductor: Conductor::Reflectance(kd_input), roughness };
                let mut part = |name: &str, kind| {
                    let name = format!("{} ({name})", m.name);
                    self.scene.materials.push(Material { name, kind, normal_map, bump });
                    MaterialId((self.scene.materials.len() - 1) as u32)
                };
                MaterialKind::Mix { materials: [part("no metal", kind), part("metal", metal)], amount }
            }
        };
        let ke = color(m.emissive).unwrap_or(Vec3::ZERO);
        let emission_map = self.map(unknown(&["map_Ke", "map_ke"]).as_deref());
        let emits = ke != Vec3::ZERO || emission_map.is_some();
        let emission = emits.then(|| Emission { radiance: self.color(ke, emission_map), two_sided: true });
        self.scene.materials.push(Material { name: m.name.clone(), kind, normal_map, bump });
        let material = MaterialId((self.scene.materials.len() - 1) as u32);
        ObjMaterial { material, emission, alpha }
    }

    /// A factor, or a picture times the factor; a black factor of a picture counts as white.
    fn color(&mut self, factor: Vec3, map: Option<MapReference>) -> ColorInput {
        let Some(map) = map else { return ColorInput::Constant(factor) };
        let a = ColorInput::Texture(self.texture(&map, TextureEncoding::Auto, 1.0));
        if factor == Vec3::ONE || factor == Vec3::ZERO {
            return a;
        }
        self.scene.textures.push(Texture::Scale { a, b: ColorInput::Constant(factor) });
        ColorInput::Texture(TextureId((self.scene.textures.len() - 1) as u32))
    }

    fn roughness(&mut self, m: &tobj::Material, pr: Option<f32>, smooth: bool) -> Roughness {
        let map = self.map(m.unknown_param.get("map_Pr").map(String::as_str));
        let value = match (map, pr, m.shininess) {
            (Some(map), ..) => FloatInput::Texture(self.texture(&map, TextureEncoding::Linear, 1.0)),
            (None, Some(pr), _) => FloatInput::Constant(pr.clamp(0.0, 1.0)),
            (None, None, Some(ns)) if !smooth && ns < 10_000.0 => {
                FloatInput::Constant((2.0 / (ns.max(0.0) + 2.0)).sqrt())
            }
            _ => FloatInput::Constant(0.0),
        };
        Roughness { u: value, v: value, remap: false }
    }

    fn texture(&mut self, map: &MapReference, encoding: TextureEncoding, scale: f32) -> TextureId {
        let image = self.images.file(self.scene, &map.path, map.channel.unwrap_or(encoding));
        let (mapping, wrap) = (map.mapping, map.wrap);
        self.scene.textures.push(Texture::Image { image, mapping, wrap, scale, invert: false });
        TextureId((self.scene.textures.len() - 1) as u32)
    }

    /// A texture reference such as `-s 2 2 1 wood.png`; a missing file is a warning.
    fn map(&mut self, text: Option<&str>) -> Option<MapReference> {
        let mut words = text?.split_ascii_whitespace().peekable();
        let mut reference = MapReference {
            path: PathBuf::new(),
            mapping: UvMapping::default(),
            wrap: [Wrap::Repeat; 2],
            strength: 1.0,
            channel: None,
        };
        while let Some(option) = words.next_if(|word| word.starts_with('-') && word.len() > 1) {
            match option {
                "-s" | "-o" | "-t" => {
                    let mut values = Vec::new();
                    while let Some(value) = words.peek().and_then(|word| word.parse::<f32>().ok())
                        && values.len() < 3
                    {
                        values.push(if value.is_finite() { value } else { 0.0 });
                        words.next();
                    }
                    let target = match option {
                        "-s" => &mut reference.mapping.scale,
                        "-o" => &mut reference.mapping.offset,
                        _ => continue,
                    };
                    target.iter_mut().zip(values).for_each(|(target, value)| *target = value);
                }
                "-bm" => {
                    let value = words.next().and_then(|word| word.parse::<f32>().ok());
                    reference.strength = value.filter(|v| v.is_finite()).unwrap_or(1.0);
                }
                "-imfchan" => {
                    reference.channel = match words.next() {
                        Some("r") => Some(TextureEncoding::Red),
                        Some("g") => Some(TextureEncoding::Green),
                        Some("b") => Some(TextureEncoding::Blue),
                        Some("m") => Some(TextureEncoding::Alpha),
                        _ => None,
                    };
                }
                "-clamp" if words.next() == Some("on") => reference.wrap = [Wrap::Clamp; 2],
                "-clamp" => {}
                "-mm" => {
                    words.next();
                    words.next();
                }
                _ => {
                    words.next();
                }
            }
        }
        let name = words.collect::<Vec<_>>().join(" ").replace('\\', "/");
        reference.path = self.folder.join(&name);
        if name.is_empty() || !reference.path.is_file() {
            self.warnings.add(format!("there is no picture `{}`: it is left out", reference.path.display()));
            return None;
        }
        Some(reference)
    }
}

fn three(text: &str) -> Option<Vec3> {
    let mut numbers = text.split_ascii_whitespace().map(str::parse::<f32>);
    let mut next = || numbers.next()?.ok();
    Some(Vec3::new(next()?, next()?, next()?))
}
