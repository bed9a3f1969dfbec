//! Decoded pictures as textures and environment maps use them.

use std::path::Path;

use crate::color::srgb_decode;
use crate::exr::{ExrImage, decode_exr};
use crate::pfm;

/// Pixels in rows from the top.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// 8-bit RGBA as stored, transfer function not undone; `has_alpha` says whether A means anything.
    Rgba8 {
        /// Four bytes a pixel.
        data: Vec<[u8; 4]>,
        /// Whether the file had an alpha channel.
        has_alpha: bool,
    },
    /// Linear floating point RGB.
    Rgb32F(Vec<[f32; 3]>),
}

/// A decoded picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across, at least 1.
    pub width: u32,
    /// Pixels down, at least 1.
    pub height: u32,
    /// Contents.
    pub pixels: Pixels,
}

/// Why a picture could not be read.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file could not be opened or read.
    #[error("cannot read {name}: {source}")]
    Io {
        /// File or embedded name.
        name: String,
        /// Cause.
        source: std::io::Error,
    },
    /// The contents are not a picture of a known format.
    #[error("cannot decode {name}: {reason}")]
    Decode {
        /// File or embedded name.
        name: String,
        /// Cause.
        reason: String,
    },
}

/// Largest width or height accepted.
pub const MAX_SIDE: u32 = 65_536;
pub use crate::decode::MAX_BYTES;

impl Picture {
    /// Reads PNG, JPEG, Radiance HDR, OpenEXR, PFM or TGA from a file, chosen by content (TGA by its name).
    ///
    /// # Errors
    /// Unreadable file, unknown format, damaged data, a side over [`MAX_SIDE`], more than [`MAX_BYTES`].
    pub fn read(path: &Path) -> Result<Self, PictureError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|source| PictureError::Io { name: name.clone(), source })?;
        Self::decode(&bytes, &name)
    }

    /// Decodes PNG, JPEG, Radiance HDR, OpenEXR, PFM or TGA bytes; `name` is for messages, and tells TGA.
    ///
    /// Of an OpenEXR file it takes the data window's R, G and B, or its Y, or else the first layer by name that has
    /// these. Channels such as depth are not colour: a file without any of them is an error.
    ///
    /// # Errors
    /// Unknown format, damaged data, a side over [`MAX_SIDE`], more than [`MAX_BYTES`].
    pub fn decode(bytes: &[u8], name: &str) -> Result<Self, PictureError> {
        if bytes.starts_with(&openexr_core::MAGIC) {
            return Self::from_exr(&decode_exr(bytes, name)?, name);
        }
        if pfm::is_pfm(bytes) {
            return pfm::decode(bytes, name);
        }
        crate::decode::decode(bytes, name)
    }

    fn from_exr(image: &ExrImage, name: &str) -> Result<Self, PictureError> {
        let rgb = image.rgb_layers().first().and_then(|layer| image.rgb(layer));
        let data = rgb.ok_or_else(|| {
            let channels: Vec<&str> = image.channels.iter().take(20).map(|c| c.name.as_str()).collect();
            let reason = format!("it has no R, G, B or Y channels, only {}", channels.join(", "));
            PictureError::Decode { name: name.to_owned(), reason }
        })?;
        Ok(Self { width: image.width, height: image.height, pixels: Pixels::Rgb32F(data) })
    }

    /// All pixels as linear RGB: 8-bit ones are taken as sRGB, their alpha is dropped.
    #[must_use]
    pub fn to_linear(&self) -> Vec<[f32; 3]> {
        match &self.pixels {
            Pixels::Rgb32F(data) => data.clone(),
            Pixels::Rgba8 { data, .. } => {
                let table: Vec<f32> = (0..256).map(|i| srgb_decode(f64::from(i) / 255.0) as f32).collect();
                data.iter().map(|p| [p[0], p[1], p[2]].map(|b| table[usize::from(b)])).collect()
            }
        }
    }
}
