//! 8-bit PNG for looking at: exposure, sRGB transfer function, no tone curve.

use std::path::Path;

use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;

use crate::atomic::{OutputError, write_atomic};
use crate::color::srgb_encode;

/// Writes linear Rec.709 pixels, in rows from the top, scaled by 2^`exposure_ev`.
///
/// Values are clamped to 0..=1 after exposure: infinity is white; NaN and negatives are black. The file appears
/// under its name only when it is complete.
///
/// # Errors
/// The disk or folder refuses; the number of pixels is not `width * height`; no pixels.
pub fn write_png(
    path: &Path,
    width: u32,
    height: u32,
    rgb_linear: &[[f32; 3]],
    exposure_ev: f32,
) -> Result<(), OutputError> {
    let encode = |reason: String| OutputError::encode(path, reason);
    if rgb_linear.is_empty() || rgb_linear.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(encode(format!("{} pixels are not {width} x {height}", rgb_linear.len())));
    }
    let scale = exposure_ev.exp2();
    let bytes: Vec<u8> = rgb_linear.par_iter().flat_map_iter(|p| p.map(|x| to_byte(x, scale))).collect();
    write_atomic(path, |file| {
        let encoder = image::codecs::png::PngEncoder::new(&mut *file);
        encoder.write_image(&bytes, width, height, ExtendedColorType::Rgb8).map_err(|error| match error {
            image::ImageError::IoError(source) => OutputError::io(path)(source),
            other => encode(other.to_string()),
        })
    })
}

fn to_byte(linear: f32, scale: f32) -> u8 {
    // 0 * inf and NaN end at 0: the cast takes NaN to 0.
    let exposed = (linear * scale).clamp(0.0, 1.0);
    (srgb_encode(f64::from(exposed)) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_known_values() {
        assert_eq!(to_byte(0.0, 1.0), 0);
        assert_eq!(to_byte(1.0, 1.0), 255);
        assert_eq!(to_byte(0.5, 1.0), 188);
        assert_eq!(to_byte(0.5, 2.0), 255);
        assert_eq!(to_byte(0.18, 1.0), 118);
        assert_eq!(to_byte(f32::NAN, 1.0), 0);
        assert_eq!(to_byte(f32::INFINITY, 1.0), 255);
        assert_eq!(to_byte(f32::NEG_INFINITY, 1.0), 0);
        assert_eq!(to_byte(-3.0, 1.0), 0);
        assert_eq!(to_byte(1e30, f32::INFINITY), 255);
        assert_eq!(to_byte(0.0, f32::INFINITY), 0);
    }

    #[test]
    fn the_file_reads_back() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("p.png");
        write_png(&path, 2, 1, &[[0.0, 0.25, 1.0], [f32::NAN, -1.0, f32::INFINITY]], 1.0)?;
        let back = image::open(&path)?.into_rgb8();
        assert_eq!(back.dimensions(), (2, 1));
        assert_eq!(back.as_raw(), &[0, 188, 255, 0, 0, 255]);
        assert!(write_png(&path, 3, 1, &[[0.0; 3]; 2], 0.0).is_err());
        assert!(write_png(&path, 0, 0, &[], 0.0).is_err());
        Ok(())
    }
}
