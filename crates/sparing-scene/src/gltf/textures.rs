//! Textures: pictures, samplers, transformations of coordinates.

use super::Loader;
use super::container::data_uri;
use super::json::Node;
use crate::description::{
    ColorInput, FloatInput, Image, ImageId, ImageSource, Texture, TextureEncoding, TextureId, UvMapping, Wrap,
};
use crate::error::SceneError;
use crate::images::has_alpha;
use glam::Vec3;

/// Textures that are looked up by the first texture coordinates: emission knows no others, and normal maps have their axes
/// along them.
pub(super) const FIRST_UVS: [&str; 2] = ["emissiveTexture", "normalTexture"];

/// A use of a texture by a material.
pub(super) struct TextureUse<'a> {
    image: usize,
    node: Node<'a>,
    mapping: UvMapping,
    wrap: [Wrap; 2],
    /// Whether it is looked up by the second texture coordinates.
    second: bool,
}

impl<'a> Loader<'a> {
    /// The texture that `key` of a material refers to, `None` with a warning where it cannot be had.
    pub(super) fn texture(
        &mut self,
        node: &Node<'a>,
        key: &str,
    ) -> Result<Option<TextureUse<'a>>, SceneError> {
        let Some(info) = node.get(key) else { return Ok(None) };
        let Some((_, texture)) = info.named("index", &self.root, "textures")? else {
            return Err(info.error("`index` is missing"));
        };
        let Some((image, picture)) = texture.named("source", &self.root, "images")? else {
            self.warnings
                .add(format!("{}: a texture without a picture that can be read is left out", texture.path));
            return Ok(None);
        };
        let sampler = texture.named("sampler", &self.root, "samplers")?;
        let mut wrap = [Wrap::Repeat; 2];
        if let Some((_, sampler)) = sampler {
            for (wrap, key) in wrap.iter_mut().zip(["wrapS", "wrapT"]) {
                *wrap = match sampler.whole(key)?.unwrap_or(10497) {
                    10497 => Wrap::Repeat,
                    33071 => Wrap::Clamp,
                    33648 => Wrap::Mirror,
                    other => return Err(sampler.error(format!("`{key}` is {other}, which is no wrap mode"))),
                };
            }
        }
        let mapping = match info.extension("KHR_texture_transform") {
            None => UvMapping::default(),
            Some(transform) => mapping(&transform)?,
        };
        let set = self.uv_set(node, key)?;
        let second = set.is_some() && set == self.second_uv_set && !FIRST_UVS.contains(&key);
        let found = self.open_picture(image, &picture)?;
        Ok(found.then_some(TextureUse { image, node: picture, mapping, wrap, second }))
    }

    /// Which set of texture coordinates a texture reads.
    pub(super) fn uv_set(&self, node: &Node<'a>, key: &str) -> Result<Option<usize>, SceneError> {
        let Some(info) = node.get(key) else { return Ok(None) };
        let own = info.whole("texCoord")?.unwrap_or(0);
        match info.extension("KHR_texture_transform") {
            None => Ok(Some(own)),
            Some(transform) => Ok(Some(transform.whole("texCoord")?.unwrap_or(own))),
        }
    }

    /// Finds the bytes of a picture; false with a warning where they are missing.
    fn open_picture(&mut self, index: usize, node: &Node<'a>) -> Result<bool, SceneError> {
        if let Some(known) = self.pictures.get(&index) {
            return Ok(known.is_some());
        }
        let mut source = None;
        if let Some(view) = self.buffers.view(node)? {
            let kind = node.text("mimeType")?.unwrap_or_default();
            source = Some(embedded(index, kind, view.bytes()));
        } else if let Some(uri) = node.text("uri")? {
            match data_uri(uri) {
                Some(data) => {
                    let (kind, bytes) = data.map_err(|message| node.error(message))?;
                    source = Some(embedded(index, kind, &bytes));
                }
                None => {
                    let path = self.buffers.path(uri, node)?;
                    if path.is_file() {
                        source = Some(ImageSource::File(path));
                    } else {
                        let place = path.display();
                        self.warnings
                            .add(format!("{}: there is no picture `{place}`: it is left out", node.path));
                    }
                }
            }
        } else {
            return Err(node.error("it has neither a `uri` nor a `bufferView`"));
        }
        let found = source.is_some();
        self.pictures.insert(index, source);
        Ok(found)
    }

    /// Whether a picture has an alpha channel.
    pub(super) fn has_alpha(&self, texture: &TextureUse<'a>) -> bool {
        self.pictures.get(&texture.image).and_then(Option::as_ref).is_some_and(has_alpha)
    }

    fn image(&mut self, texture: &TextureUse<'a>, encoding: TextureEncoding) -> Result<ImageId, SceneError> {
        let key = (texture.image, format!("{encoding:?}"));
        if let Some(id) = self.images.get(&key) {
            return Ok(*id);
        }
        let source = self.pictures.get(&texture.image).cloned().flatten();
        let source = source.ok_or_else(|| texture.node.error("the picture is missing"))?;
        self.count_entity()?;
        let id = ImageId(self.scene.images.len() as u32);
        self.scene.images.push(Image { source, encoding });
        self.images.insert(key, id);
        Ok(id)
    }

    fn add_texture(&mut self, texture: Texture) -> Result<TextureId, SceneError> {
        if let Some(i) = self
            .scene
            .textures
            .iter()
            .rposition(|known| *known == texture)
            .filter(|_| self.scene.textures.len() < 1000)
        {
            return Ok(TextureId(i as u32));
        }
        self.count_entity()?;
        self.scene.textures.push(texture);
        Ok(TextureId(self.scene.textures.len() as u32 - 1))
    }

    fn add_image(
        &mut self,
        texture: &TextureUse<'a>,
        encoding: TextureEncoding,
        scale: f32,
    ) -> Result<TextureId, SceneError> {
        let image = self.image(texture, encoding)?;
        let (mapping, wrap) = (texture.mapping, texture.wrap);
        let picture = self.add_texture(Texture::Image { image, mapping, wrap, scale, invert: false })?;
        if texture.second {
            return self.add_texture(Texture::SecondUv { input: ColorInput::Texture(picture) });
        }
        Ok(picture)
    }

    /// A colour times an sRGB picture.
    pub(super) fn color(
        &mut self,
        factor: Vec3,
        texture: Option<&TextureUse<'a>>,
    ) -> Result<ColorInput, SceneError> {
        let Some(texture) = texture.filter(|_| factor != Vec3::ZERO) else {
            return Ok(ColorInput::Constant(factor));
        };
        let grey = factor.x == factor.y && factor.y == factor.z;
        let scale = if grey { factor.x } else { 1.0 };
        let picture = ColorInput::Texture(self.add_image(texture, TextureEncoding::Srgb, scale)?);
        if grey {
            return Ok(picture);
        }
        let product = Texture::Scale { a: picture, b: ColorInput::Constant(factor) };
        self.add_texture(product).map(ColorInput::Texture)
    }

    /// A number times one channel of a picture.
    pub(super) fn float(
        &mut self,
        factor: f32,
        texture: Option<&TextureUse<'a>>,
        channel: TextureEncoding,
    ) -> Result<FloatInput, SceneError> {
        let Some(texture) = texture.filter(|_| factor != 0.0) else {
            return Ok(FloatInput::Constant(factor));
        };
        self.add_image(texture, channel, factor).map(FloatInput::Texture)
    }

    /// The square of a number.
    pub(super) fn squared(&mut self, input: FloatInput) -> Result<FloatInput, SceneError> {
        match input {
            FloatInput::Constant(v) => Ok(FloatInput::Constant(v * v)),
            FloatInput::Texture(id) => {
                let a = ColorInput::Texture(id);
                self.add_texture(Texture::Scale { a, b: a }).map(FloatInput::Texture)
            }
        }
    }

    /// A normal map, x and y times `scale`. Only the direction counts, so that is done without numbers below 0: a
    /// factor below 1 draws x and y to 1/2, one above 1 draws z there.
    pub(super) fn normal_map(
        &mut self,
        texture: &TextureUse<'a>,
        scale: f32,
    ) -> Result<TextureId, SceneError> {
        let plain = self.add_image(texture, TextureEncoding::Linear, 1.0)?;
        if scale == 1.0 {
            return Ok(plain);
        }
        let (keep, to) = if scale < 1.0 {
            (Vec3::new(scale, scale, 1.0), Vec3::new(1.0 - scale, 1.0 - scale, 0.0))
        } else {
            (Vec3::new(1.0, 1.0, 1.0 / scale), Vec3::new(0.0, 0.0, 1.0 - 1.0 / scale))
        };
        let kept = Texture::Scale { a: ColorInput::Texture(plain), b: ColorInput::Constant(keep * 2.0) };
        let b = ColorInput::Texture(self.add_texture(kept)?);
        self.add_texture(Texture::Mix { a: ColorInput::Constant(to), b, amount: FloatInput::Constant(0.5) })
    }
}

/// A picture within the file, named by its type.
fn embedded(index: usize, kind: &str, bytes: &[u8]) -> ImageSource {
    let extension = match kind {
        "image/jpeg" => "jpg",
        "image/png" => "png",
        _ if bytes.starts_with(b"\xff\xd8") => "jpg",
        _ => "png",
    };
    ImageSource::Bytes { name: format!("images[{index}].{extension}"), bytes: bytes.into() }
}

/// KHR_texture_transform: offset, then rotation, then scale, for coordinates with v = 0 at the top. Ours has its v
/// = 0 at the bottom, on both sides.
fn mapping(node: &Node<'_>) -> Result<UvMapping, SceneError> {
    let pair = |key: &str, default: f32| {
        let pair = node.numbers::<2>(key)?.map(|p| p.map(|v| v as f32));
        Ok::<_, SceneError>(pair.unwrap_or([default; 2]))
    };
    let (offset, scale) = (pair("offset", 0.0)?, pair("scale", 1.0)?);
    let (sin, cos) = node.number("rotation", 0.0)?.sin_cos();
    // u' = a u + b v + x, v' = c u + d v + y of the extension.
    let (a, b, c, d) = (cos * scale[0], sin * scale[1], -sin * scale[0], cos * scale[1]);
    let offset = [b + offset[0], 1.0 - d - offset[1]];
    // + 0: no negative zeros.
    Ok(UvMapping { scale: [a, d], cross: [0.0 - b, 0.0 - c], offset: offset.map(|v| v + 0.0) })
}
