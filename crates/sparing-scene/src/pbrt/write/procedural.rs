//! Textures that are functions of position or noise.

use super::surfaces::{color_input, float_input, mapping};
use super::text::{color, number};
use crate::description::{Noise, ScalarFunction, Texture, TextureProjection};
use glam::Affine3A;

/// World to texture space, and class with parameters; written where the inverse is the current transformation.
pub(super) fn texture(texture: &Texture) -> (Affine3A, String) {
    let identity = Affine3A::IDENTITY;
    match *texture {
        Texture::Function { input, function } => {
            let name = match function {
                ScalarFunction::RoughnessPolynomial => "roughness-v3",
                ScalarFunction::BlinnRoughness => "roughness-v2",
                ScalarFunction::Complement => "complement",
            };
            (identity, format!("\"function\" \"string function\" \"{name}\"{}", float_input("input", input)))
        }
        Texture::Projected { projection, from_world, input } => {
            let how = match projection {
                TextureProjection::Spherical => "spherical".to_owned(),
                TextureProjection::Cylindrical { normalize: false } => "cylindrical".to_owned(),
                TextureProjection::Cylindrical { normalize: true } => "cylindrical-v3".to_owned(),
                TextureProjection::Planar { .. } => "planar".to_owned(),
            };
            let mut text = format!("\"projected\" \"string mapping\" \"{how}\"{}", color_input("tex", input));
            if let TextureProjection::Planar { u, v, offset } = projection {
                let vector =
                    |name: &str, v: glam::Vec3| format!(" \"vector3 {name}\" [ {} {} {} ]", v.x, v.y, v.z);
                text += &(vector("v1", u) + &vector("v2", v));
                text += &(number("udelta", offset[0]) + &number("vdelta", offset[1]));
            }
            (from_world, text)
        }
        Texture::Cubes { from_world, even, odd } => {
            let colors = color_input("tex1", even) + &color_input("tex2", odd);
            (from_world, format!("\"checkerboard\" \"integer dimension\" 3{colors}"))
        }
        Texture::Dots { mapping: ref uv, inside, outside } => {
            let colors = color_input("inside", inside) + &color_input("outside", outside);
            (identity, format!("\"dots\"{colors}{}", mapping(uv)))
        }
        Texture::Noise { from_world, noise } => (from_world, self::noise(noise)),
        Texture::DirectionMix { direction: d, a, b } => {
            let colors = color_input("tex1", a) + &color_input("tex2", b);
            let text = format!("\"directionmix\" \"vector3 dir\" [ {} {} {} ]{colors}", d.x, d.y, d.z);
            (identity, text)
        }
        Texture::Bilinear { mapping: ref uv, corners } => {
            let names = ["v00", "v01", "v10", "v11"];
            let corners: String = names.iter().zip(corners).map(|(name, c)| color(name, c)).collect();
            (identity, format!("\"bilerp\"{corners}{}", mapping(uv)))
        }
        Texture::SecondUv { input } => (identity, format!("\"seconduv\"{}", color_input("tex", input))),
        Texture::Coordinates { mapping: ref uv } => (identity, format!("\"uv\"{}", mapping(uv))),
        // The others are written by the caller.
        Texture::Constant(_)
        | Texture::Image { .. }
        | Texture::Checkerboard { .. }
        | Texture::Scale { .. }
        | Texture::Mix { .. } => (identity, String::new()),
    }
}

fn noise(noise: Noise) -> String {
    let sum = |octaves: u32, roughness: f32| {
        format!(" \"integer octaves\" {octaves}{}", number("roughness", roughness))
    };
    match noise {
        Noise::Fbm { octaves, roughness } => format!("\"fbm\"{}", sum(octaves, roughness)),
        Noise::Wrinkled { octaves, roughness } => format!("\"wrinkled\"{}", sum(octaves, roughness)),
        Noise::Windy => "\"windy\"".to_owned(),
        Noise::Marble { octaves, roughness, scale, variation } => {
            let further = number("scale", scale) + &number("variation", variation);
            format!("\"marble\"{}{further}", sum(octaves, roughness))
        }
    }
}
