//! Textures, compiled: constants folded, pictures decoded once.

use crate::noise;
use glam::{Affine3A, Vec3};
use sparing_image::picture::{Picture, PictureError, Pixels};
use sparing_scene::description::{
    self as d, ColorInput, FloatInput, ImageSource, Noise, ScalarFunction, TextureEncoding,
    TextureProjection, UvMapping, Wrap,
};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

/// A colour parameter after compilation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Color {
    /// The same everywhere.
    Constant(Vec3),
    /// Index of a texture.
    Texture(u32),
}

/// A scalar parameter after compilation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// The same everywhere.
    Constant(f32),
    /// Index of a texture.
    Texture(u32),
}

#[derive(Clone, Debug)]
enum Node {
    Constant(Vec3),
    Image { image: u32, mapping: UvMapping, wrap: [Wrap; 2], scale: f32, invert: bool },
    Checkerboard { mapping: UvMapping, even: Color, odd: Color },
    Scale { a: Color, b: Color },
    Mix { a: Color, b: Color, amount: Scalar },
    Function { input: Scalar, function: ScalarFunction },
    Projected { projection: TextureProjection, from_world: Affine3A, input: Color },
    Cubes { from_world: Affine3A, even: Color, odd: Color },
    Dots { mapping: UvMapping, inside: Color, outside: Color },
    Noise { from_world: Affine3A, noise: Noise },
    DirectionMix { direction: Vec3, a: Color, b: Color },
    Bilinear { mapping: UvMapping, corners: [Vec3; 4] },
    Coordinates { mapping: UvMapping },
    SecondUv { input: Color },
}

/// Where a texture is looked up. Most textures want `uv` only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TexturePoint {
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Second texture coordinates.
    pub second_uv: [f32; 2],
    /// Position in world space.
    pub p: Vec3,
    /// Geometric normal in world space.
    pub n: Vec3,
}

impl From<[f32; 2]> for TexturePoint {
    /// Texture coordinates without a place: light samples and cut-outs know no more.
    fn from(uv: [f32; 2]) -> Self {
        Self { uv, ..Self::default() }
    }
}

/// A decoded picture with the meaning of its numbers.
#[derive(Clone, Debug)]
pub struct Image {
    picture: Arc<Picture>,
    /// Linear value of each byte.
    decode: Box<[f32; 256]>,
    /// The channel that is the value, if it is just one.
    channel: Option<u8>,
}

impl Image {
    /// Decodes the picture of a scene.
    ///
    /// # Errors
    /// See [`PictureError`].
    pub fn load(image: &d::Image) -> Result<Self, PictureError> {
        Ok(Self::shared(Arc::new(Self::decode(&image.source)?), image.encoding))
    }

    /// The pixels of a picture, before they have a meaning.
    ///
    /// # Errors
    /// See [`PictureError`].
    pub fn decode(source: &ImageSource) -> Result<Picture, PictureError> {
        match source {
            ImageSource::File(path) => Picture::read(path),
            ImageSource::Bytes { name, bytes } => Picture::decode(bytes, name),
        }
    }

    /// A picture from memory.
    #[must_use]
    pub fn new(picture: Picture, encoding: TextureEncoding) -> Self {
        Self::shared(Arc::new(picture), encoding)
    }

    /// A picture that several textures read in different ways.
    #[must_use]
    pub fn shared(picture: Arc<Picture>, encoding: TextureEncoding) -> Self {
        let decode = Box::new(std::array::from_fn(|i| {
            let v = i as f32 / 255.0;
            match encoding {
                TextureEncoding::Auto | TextureEncoding::Srgb => srgb_to_linear(v),
                TextureEncoding::Gamma(g) => v.powf(g),
                TextureEncoding::Linear | TextureEncoding::Alpha => v,
                TextureEncoding::Red | TextureEncoding::Green | TextureEncoding::Blue => v,
            }
        }));
        let has_alpha = matches!(picture.pixels, Pixels::Rgba8 { has_alpha: true, .. });
        let channel = match encoding {
            TextureEncoding::Red => Some(0),
            TextureEncoding::Green => Some(1),
            TextureEncoding::Blue => Some(2),
            TextureEncoding::Alpha if has_alpha => Some(3),
            _ => None,
        };
        Self { picture, decode, channel }
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.picture.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.picture.height
    }

    /// Bytes of the decoded picture.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let n = self.width() as usize * self.height() as usize;
        match self.picture.pixels {
            Pixels::Rgba8 { .. } => 4 * n,
            Pixels::Rgb32F(_) => 12 * n,
        }
    }

    /// Linear value of a pixel; row 0 is the top.
    #[inline]
    #[must_use]
    pub fn texel(&self, x: u32, y: u32) -> Vec3 {
        let i = y as usize * self.picture.width as usize + x as usize;
        match &self.picture.pixels {
            Pixels::Rgba8 { data, .. } => {
                let pixel = data[i];
                if let Some(channel) = self.channel {
                    return Vec3::splat(f32::from(pixel[channel as usize & 3]) / 255.0);
                }
                let [r, g, b, _] = pixel;
                Vec3::new(self.decode[r as usize], self.decode[g as usize], self.decode[b as usize])
            }
            Pixels::Rgb32F(data) => match self.channel {
                Some(channel) => Vec3::splat(data[i][channel.min(2) as usize]),
                None => Vec3::from(data[i]),
            },
        }
    }

    /// Bilinear value at texture coordinates; v = 0 is the bottom.
    #[must_use]
    pub fn bilinear(&self, uv: [f32; 2], [wrap_u, wrap_v]: [Wrap; 2]) -> Vec3 {
        let (w, h) = (self.width(), self.height());
        let x = wrap_coordinate(uv[0], wrap_u) * w as f32 - 0.5;
        let y = wrap_coordinate(1.0 - uv[1], wrap_v) * h as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at = |dx: i64, dy: i64| match (
            wrap_index(x0 as i64 + dx, w, wrap_u),
            wrap_index(y0 as i64 + dy, h, wrap_v),
        ) {
            (Some(x), Some(y)) => self.texel(x, y),
            _ => Vec3::ZERO,
        };
        let top = at(0, 0) * (1.0 - fx) + at(1, 0) * fx;
        let bottom = at(0, 1) * (1.0 - fx) + at(1, 1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// The sRGB transfer function, undone (IEC 61966-2-1).
#[must_use]
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Reduces a coordinate so that huge values keep a meaning; NaN becomes 0.
fn wrap_coordinate(v: f32, wrap: Wrap) -> f32 {
    let v = if v.is_finite() { v } else { 0.0 };
    match wrap {
        Wrap::Repeat => v - v.floor(),
        Wrap::Mirror => v - 2.0 * (v * 0.5).floor(),
        // Far outside, any value on the same side gives the same result.
        Wrap::Clamp | Wrap::Black => v.clamp(-2.0, 3.0),
    }
}

fn wrap_index(i: i64, n: u32, wrap: Wrap) -> Option<u32> {
    let size = i64::from(n);
    let wrapped = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * size);
            if m < size { m } else { 2 * size - 1 - m }
        }
        Wrap::Black if (0..size).contains(&i) => i,
        Wrap::Black => return None,
    };
    Some(wrapped as u32)
}

/// All textures of a scene.
#[derive(Clone, Debug, Default)]
pub struct TextureTable {
    nodes: Vec<Node>,
    images: Vec<Option<Image>>,
}

impl TextureTable {
    /// Compiles the textures of a scene, whose pictures are `images` (`None` where no texture needs one).
    #[must_use]
    pub fn new(textures: &[d::Texture], images: Vec<Option<Image>>) -> Self {
        let mut table = Self { nodes: Vec::with_capacity(textures.len()), images };
        for texture in textures {
            let node = table.compile(texture);
            table.nodes.push(node);
        }
        table
    }

    fn compile(&self, texture: &d::Texture) -> Node {
        match *texture {
            d::Texture::Constant(v) => Node::Constant(v),
            d::Texture::Image { image, mapping, wrap, scale, invert } => {
                Node::Image { image: image.0, mapping, wrap, scale, invert }
            }
            d::Texture::Checkerboard { mapping, even, odd } => {
                Node::Checkerboard { mapping, even: self.color(even), odd: self.color(odd) }
            }
            d::Texture::Scale { a, b } => match (self.color(a), self.color(b)) {
                (Color::Constant(a), Color::Constant(b)) => Node::Constant(a * b),
                (a, b) => Node::Scale { a, b },
            },
            d::Texture::Mix { a, b, amount } => match (self.color(a), self.color(b), self.scalar(amount)) {
                (Color::Constant(a), Color::Constant(b), Scalar::Constant(t)) => Node::Constant(a.lerp(b, t)),
                (a, b, amount) => Node::Mix { a, b, amount },
            },
            d::Texture::Function { input, function } => match self.scalar(input) {
                Scalar::Constant(v) => Node::Constant(Vec3::splat(function.apply(v))),
                input => Node::Function { input, function },
            },
            d::Texture::Projected { projection, from_world, input } => match self.color(input) {
                Color::Constant(v) => Node::Constant(v),
                input => Node::Projected { projection, from_world, input },
            },
            d::Texture::Cubes { from_world, even, odd } => {
                Node::Cubes { from_world, even: self.color(even), odd: self.color(odd) }
            }
            d::Texture::Dots { mapping, inside, outside } => {
                Node::Dots { mapping, inside: self.color(inside), outside: self.color(outside) }
            }
            d::Texture::Noise { from_world, noise } => Node::Noise { from_world, noise },
            d::Texture::DirectionMix { direction, a, b } => {
                Node::DirectionMix { direction, a: self.color(a), b: self.color(b) }
            }
            d::Texture::Bilinear { mapping, corners } => Node::Bilinear { mapping, corners },
            d::Texture::Coordinates { mapping } => Node::Coordinates { mapping },
            d::Texture::SecondUv { input } => match self.color(input) {
                Color::Constant(v) => Node::Constant(v),
                input => Node::SecondUv { input },
            },
        }
    }

    /// Compiles a parameter; textures that are constant become constants.
    #[must_use]
    pub fn color(&self, input: ColorInput) -> Color {
        match input {
            ColorInput::Constant(v) => Color::Constant(v),
            ColorInput::Texture(id) => match self.nodes[id.0 as usize] {
                Node::Constant(v) => Color::Constant(v),
                _ => Color::Texture(id.0),
            },
        }
    }

    /// Compiles a parameter; textures that are constant become constants.
    #[must_use]
    pub fn scalar(&self, input: FloatInput) -> Scalar {
        match input {
            FloatInput::Constant(v) => Scalar::Constant(v),
            FloatInput::Texture(id) => match self.nodes[id.0 as usize] {
                Node::Constant(v) => Scalar::Constant(mean(v)),
                _ => Scalar::Texture(id.0),
            },
        }
    }

    /// Value of a colour parameter at a point.
    #[inline]
    #[must_use]
    pub fn eval_color(&self, color: Color, at: impl Into<TexturePoint>) -> Vec3 {
        match color {
            Color::Constant(v) => v,
            Color::Texture(id) => self.eval(id, &at.into()),
        }
    }

    /// Value of a scalar parameter at a point: the mean of the channels.
    #[inline]
    #[must_use]
    pub fn eval_scalar(&self, scalar: Scalar, at: impl Into<TexturePoint>) -> f32 {
        match scalar {
            Scalar::Constant(v) => v,
            Scalar::Texture(id) => mean(self.eval(id, &at.into())),
        }
    }

    fn eval(&self, id: u32, at: &TexturePoint) -> Vec3 {
        crate::counters::count(crate::counters::Counter::TextureLookup);
        match &self.nodes[id as usize] {
            Node::Constant(v) => *v,
            Node::Image { image, mapping, wrap, scale, invert } => {
                let Some(image) = &self.images[*image as usize] else { return Vec3::ZERO };
                let v = image.bilinear(map(mapping, at.uv), *wrap);
                let v = if *invert { Vec3::ONE - v } else { v };
                v * *scale
            }
            Node::Checkerboard { mapping, even, odd } => {
                let [u, v] = map(mapping, at.uv);
                let even_square = is_even(u.floor() + v.floor());
                self.eval_color(if even_square { *even } else { *odd }, *at)
            }
            Node::Scale { a, b } => self.eval_color(*a, *at) * self.eval_color(*b, *at),
            Node::Mix { a, b, amount } => {
                let t = self.eval_scalar(*amount, *at);
                self.eval_color(*a, *at) * (1.0 - t) + self.eval_color(*b, *at) * t
            }
            rare => self.eval_rare(rare, at),
        }
    }

    /// The textures that few scenes have, kept out of the way of the others.
    #[inline(never)]
    fn eval_rare(&self, node: &Node, at: &TexturePoint) -> Vec3 {
        match node {
            Node::Function { input, function } => Vec3::splat(function.apply(self.eval_scalar(*input, *at))),
            Node::Projected { projection, from_world, input } => {
                let uv = project(*projection, from_world.transform_point3(at.p));
                self.eval_color(*input, TexturePoint { uv, ..*at })
            }
            Node::SecondUv { input } => self.eval_color(*input, TexturePoint { uv: at.second_uv, ..*at }),
            Node::Cubes { from_world, even, odd } => {
                let p = from_world.transform_point3(at.p).floor();
                self.eval_color(if is_even(p.x + p.y + p.z) { *even } else { *odd }, *at)
            }
            Node::Dots { mapping, inside, outside } => {
                self.eval_color(if noise::in_dot(map(mapping, at.uv)) { *inside } else { *outside }, *at)
            }
            Node::Noise { from_world, noise } => noise::eval(*noise, from_world.transform_point3(at.p)),
            Node::DirectionMix { direction, a, b } => {
                let t = at.n.dot(*direction).abs();
                self.eval_color(*a, *at) * t + self.eval_color(*b, *at) * (1.0 - t)
            }
            Node::Bilinear { mapping, corners: [v00, v01, v10, v11] } => {
                let [u, v] = map(mapping, at.uv);
                (*v00 * (1.0 - v) + *v01 * v) * (1.0 - u) + (*v10 * (1.0 - v) + *v11 * v) * u
            }
            Node::Coordinates { mapping } => {
                let [u, v] = map(mapping, at.uv);
                Vec3::new(u - u.floor(), v - v.floor(), 0.0)
            }
            _ => Vec3::ZERO, // the others are in `eval`
        }
    }

    /// Whether some texture is looked up by the second texture coordinates.
    #[must_use]
    pub fn uses_second_uvs(&self) -> bool {
        self.nodes.iter().any(|node| matches!(node, Node::SecondUv { .. }))
    }

    /// Bytes of all decoded pictures.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.images.iter().flatten().map(Image::bytes).sum()
    }
}

fn map(mapping: &UvMapping, uv: [f32; 2]) -> [f32; 2] {
    let UvMapping { scale, offset, cross } = mapping;
    [uv[0] * scale[0] + uv[1] * cross[0] + offset[0], uv[1] * scale[1] + uv[0] * cross[1] + offset[1]]
}

/// Parity of a whole number in floating point: no overflow at huge coordinates.
fn is_even(sum: f32) -> bool {
    let half = sum * 0.5;
    half == half.floor()
}

/// Texture coordinates of a position ("Physically Based Rendering", 4th edition, section 10.2).
fn project(projection: TextureProjection, p: Vec3) -> [f32; 2] {
    match projection {
        TextureProjection::Spherical => {
            let phi = p.y.atan2(p.x);
            let phi = if phi < 0.0 { phi + 2.0 * PI } else { phi };
            [p.x.hypot(p.y).atan2(p.z) * FRAC_1_PI, phi * 0.5 * FRAC_1_PI]
        }
        TextureProjection::Cylindrical { normalize } => {
            let v = if normalize { p.normalize_or_zero().z } else { p.z };
            [(PI + p.y.atan2(p.x)) * 0.5 * FRAC_1_PI, v]
        }
        TextureProjection::Planar { u, v, offset } => [offset[0] + p.dot(u), offset[1] + p.dot(v)],
    }
}

fn mean(v: Vec3) -> f32 {
    (v.x + v.y + v.z) * (1.0 / 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> Image {
        let data = vec![[0, 0, 0, 255], [255, 0, 0, 128], [0, 255, 0, 64], [255, 255, 255, 0]];
        let pixels = Pixels::Rgba8 { data, has_alpha: true };
        Image::new(Picture { width: 2, height: 2, pixels }, TextureEncoding::Linear)
    }

    #[test]
    fn v_zero_is_the_bottom_row_and_centres_are_exact() {
        let i = gradient();
        assert_eq!(i.bilinear([0.25, 0.75], [Wrap::Clamp; 2]), Vec3::ZERO);
        assert_eq!(i.bilinear([0.75, 0.75], [Wrap::Clamp; 2]), Vec3::X);
        assert_eq!(i.bilinear([0.25, 0.25], [Wrap::Clamp; 2]), Vec3::Y);
        assert_eq!(i.bilinear([0.75, 0.25], [Wrap::Clamp; 2]), Vec3::ONE);
        assert_eq!(i.bilinear([0.5, 0.5], [Wrap::Clamp; 2]), Vec3::new(0.5, 0.5, 0.25));
    }

    #[test]
    fn wrap_modes() {
        let i = gradient();
        assert_eq!(i.bilinear([1.25, 0.75], [Wrap::Repeat; 2]), Vec3::ZERO);
        assert_eq!(i.bilinear([-0.25, 0.75], [Wrap::Repeat; 2]), Vec3::X);
        assert_eq!(i.bilinear([1.25, 0.75], [Wrap::Mirror; 2]), Vec3::X);
        assert_eq!(i.bilinear([9.0, 0.75], [Wrap::Clamp; 2]), Vec3::X);
        assert_eq!(i.bilinear([9.0, 0.75], [Wrap::Black; 2]), Vec3::ZERO);
        for uv in [[f32::NAN, 0.5], [1e30, -1e30], [f32::INFINITY, 0.0], [1e6, -1e6]] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp, Wrap::Black] {
                assert!(i.bilinear(uv, [wrap; 2]).is_finite(), "{uv:?} {wrap:?}");
            }
        }
    }

    #[test]
    fn alpha_encoding_reads_the_alpha_channel() {
        let i = gradient();
        let alpha = Image { channel: Some(3), ..i };
        assert!((alpha.texel(1, 0).x - 128.0 / 255.0).abs() < 1e-6);
    }

    #[test]
    fn constants_fold_and_checkers_alternate() {
        use d::{Texture, TextureId};
        let two = ColorInput::Constant(Vec3::splat(2.0));
        let textures = [
            Texture::Constant(Vec3::splat(0.25)),
            Texture::Scale { a: ColorInput::Texture(TextureId(0)), b: two },
            Texture::Checkerboard {
                mapping: UvMapping::default(),
                even: ColorInput::Texture(TextureId(1)),
                odd: two,
            },
        ];
        let t = TextureTable::new(&textures, vec![]);
        assert_eq!(t.color(ColorInput::Texture(TextureId(1))), Color::Constant(Vec3::splat(0.5)));
        assert_eq!(t.eval_scalar(Scalar::Texture(2), [0.5, 0.5]), 0.5);
        assert_eq!(t.eval_scalar(Scalar::Texture(2), [1.5, 0.5]), 2.0);
        assert_eq!(t.eval_scalar(Scalar::Texture(2), [-0.5, 0.5]), 2.0);
        assert_eq!(t.eval_scalar(Scalar::Texture(2), [-0.5, -3.5]), 2.0);
    }

    /// One texture on its own.
    fn single(texture: d::Texture) -> (TextureTable, Color) {
        let t = TextureTable::new(&[texture], vec![]);
        let color = t.color(ColorInput::Texture(d::TextureId(0)));
        (t, color)
    }

    #[test]
    fn functions_of_the_position() {
        let at = |p: Vec3| TexturePoint {
            uv: [0.3, 0.4],
            p,
            n: Vec3::new(0.6, 0.8, 0.0),
            ..TexturePoint::default()
        };
        let (one, two) = (ColorInput::Constant(Vec3::ONE), ColorInput::Constant(Vec3::splat(2.0)));
        let from_world = Affine3A::from_scale(Vec3::splat(2.0));
        let (t, cubes) = single(d::Texture::Cubes { from_world, even: one, odd: two });
        // In the space of the cubes: (0.2, 0.2, 0.2), (1.2, 0.2, 0.2), (-0.2, 0.2, 0.2), (1.2, 1.2, -0.2).
        for (p, value) in
            [([0.1, 0.1, 0.1], 1.0), ([0.6, 0.1, 0.1], 2.0), ([-0.1, 0.1, 0.1], 2.0), ([0.6, 0.6, -0.1], 2.0)]
        {
            assert_eq!(t.eval_color(cubes, at(p.into())).x, value, "{p:?}");
        }
        let (t, mix) = single(d::Texture::DirectionMix { direction: Vec3::X, a: one, b: two });
        assert!((t.eval_color(mix, at(Vec3::ZERO)).x - (0.6 + 0.4 * 2.0)).abs() < 1e-6);
        let mapping = UvMapping { scale: [2.0, 1.0], offset: [0.0, 0.1], ..UvMapping::default() };
        let (t, uv) = single(d::Texture::Coordinates { mapping });
        assert!(t.eval_color(uv, [0.7, 0.4]).abs_diff_eq(Vec3::new(0.4, 0.5, 0.0), 1e-6));
        let corners = [0.0, 1.0, 2.0, 3.0].map(Vec3::splat);
        let (t, patch) = single(d::Texture::Bilinear { mapping: UvMapping::default(), corners });
        // (u, v) = (1, 0) is the third corner, and u counts double.
        assert_eq!(t.eval_color(patch, [1.0, 0.0]).x, 2.0);
        assert!((t.eval_color(patch, [0.25, 0.5]).x - 1.0).abs() < 1e-6);
    }

    #[test]
    fn projections() {
        let close = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-6 && (a[1] - b[1]).abs() < 1e-6;
        let p = Vec3::new(0.0, 2.0, 0.0);
        assert!(close(project(TextureProjection::Spherical, p), [0.5, 0.25]));
        assert!(close(project(TextureProjection::Spherical, Vec3::new(1.0, -1.0, 0.0)), [0.5, 0.875]));
        let tall = Vec3::new(0.0, 3.0, 4.0);
        assert!(close(project(TextureProjection::Cylindrical { normalize: false }, tall), [0.75, 4.0]));
        assert!(close(project(TextureProjection::Cylindrical { normalize: true }, tall), [0.75, 0.8]));
        let plane = TextureProjection::Planar { u: Vec3::Y, v: Vec3::Z * 2.0, offset: [0.5, -1.0] };
        assert!(close(project(plane, tall), [3.5, 7.0]));
    }
}
