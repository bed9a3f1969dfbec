//! PNG, JPEG, Radiance HDR and TGA, decoded within the one buffer that is kept.

use crate::picture::{MAX_SIDE, Picture, PictureError, Pixels};
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// Most bytes that the pixels of such a file may take in memory: 4 a pixel, 12 of HDR files, 8 of 16-bit colour.
pub const MAX_BYTES: u64 = 4 << 30;

/// As [`Picture::decode`].
pub(crate) fn decode(bytes: &[u8], name: &str) -> Result<Picture, PictureError> {
    let fail = |reason: String| PictureError::Decode { name: name.to_owned(), reason };
    let mut reader =
        ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| fail(e.to_string()))?;
    // TGA files do not begin with a mark of their own: the name decides.
    let is_tga = Path::new(name).extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
    if reader.format().is_none() && is_tga {
        reader.set_format(ImageFormat::Tga);
    }
    // What decoders take for themselves; pictures are checked below.
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| fail(e.to_string()))?;
    let (width, height) = decoder.dimensions();
    let side = width.max(height);
    if side > MAX_SIDE {
        return Err(fail(format!("a side of {side} pixels exceeds the limit MAX_SIDE = {MAX_SIDE}")));
    }
    if width == 0 || height == 0 {
        return Err(fail("it has no pixels".to_owned()));
    }
    let count = u64::from(width) * u64::from(height);
    let taken = decoder.total_bytes().max(4 * count);
    if taken > MAX_BYTES {
        return Err(fail(format!(
            "{width}x{height} pixels take {taken} bytes in memory, the limit is MAX_BYTES = {MAX_BYTES}"
        )));
    }
    let pixels = pixels(decoder, count as usize).map_err(fail)?;
    Ok(Picture { width, height, pixels })
}

fn pixels(decoder: impl ImageDecoder, count: usize) -> Result<Pixels, String> {
    let color = decoder.color_type();
    if color == ColorType::Rgb32F {
        let mut data = zeros::<[f32; 3]>(count)?;
        decoder.read_image(bytemuck::cast_slice_mut(&mut data)).map_err(|e| e.to_string())?;
        return Ok(Pixels::Rgb32F(data));
    }
    let size = usize::from(color.bytes_per_pixel());
    let mut data = zeros::<[u8; 4]>(count.max((count * size).div_ceil(4)))?;
    let bytes = data.as_flattened_mut();
    decoder.read_image(&mut bytes[..count * size]).map_err(|e| e.to_string())?;
    let byte = |high: u8, low: u8| ((u32::from(u16::from_ne_bytes([high, low])) + 128) / 257) as u8;
    match color {
        ColorType::Rgba8 => {}
        ColorType::L8 => spread(bytes, count, |[l]| [l, l, l, 255]),
        ColorType::La8 => spread(bytes, count, |[l, a]| [l, l, l, a]),
        ColorType::Rgb8 => spread(bytes, count, |[r, g, b]| [r, g, b, 255]),
        ColorType::L16 => spread(bytes, count, |[l0, l1]| {
            let l = byte(l0, l1);
            [l, l, l, 255]
        }),
        ColorType::La16 => spread(bytes, count, |[l0, l1, a0, a1]| {
            let l = byte(l0, l1);
            [l, l, l, byte(a0, a1)]
        }),
        ColorType::Rgb16 => {
            spread(bytes, count, |[r0, r1, g0, g1, b0, b1]| [byte(r0, r1), byte(g0, g1), byte(b0, b1), 255]);
        }
        ColorType::Rgba16 => spread(bytes, count, |[r0, r1, g0, g1, b0, b1, a0, a1]| {
            [byte(r0, r1), byte(g0, g1), byte(b0, b1), byte(a0, a1)]
        }),
        other => return Err(format!("pixels of the kind {other:?} are not supported")),
    }
    data.truncate(count);
    data.shrink_to_fit();
    Ok(Pixels::Rgba8 { data, has_alpha: color.has_alpha() })
}

/// Zeros; memory that is not there is an error, not an abort. The system gives the pages when they are written.
fn zeros<T: Copy + bytemuck::Zeroable>(count: usize) -> Result<Vec<T>, String> {
    Vec::<T>::new()
        .try_reserve_exact(count)
        .map_err(|_| format!("there is no memory for {} bytes", count.saturating_mul(size_of::<T>())))?;
    Ok(vec![T::zeroed(); count])
}

/// Pixels of C bytes at the start of the buffer become pixels of 4 bytes there. Those that grow go from the last to the
/// first, so that none is written over before it is read.
fn spread<const C: usize>(bytes: &mut [u8], count: usize, rgba: impl Fn([u8; C]) -> [u8; 4]) {
    let mut one = |i: usize| {
        let pixel = std::array::from_fn(|k| bytes[C * i + k]);
        bytes[4 * i..4 * i + 4].copy_from_slice(&rgba(pixel));
    };
    if C < 4 {
        (0..count).rev().for_each(&mut one);
    } else {
        (0..count).for_each(&mut one);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, ImageBuffer};

    fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, format).unwrap();
        file.into_inner()
    }

    /// What is decoded in place is what the library's own conversion makes.
    #[test]
    fn all_kinds_of_pixels() {
        let noise = |i: u32| (i.wrapping_mul(0x9e37_79b1) >> 7) as u16;
        let channel = |n: u32| (0..37 * 11 * n).map(noise);
        let (b8, b16) = (|n| channel(n).map(|v| v as u8).collect(), |n| channel(n).collect());
        let size = (37, 11);
        let kinds = [
            DynamicImage::ImageLuma8(ImageBuffer::from_raw(size.0, size.1, b8(1)).unwrap()),
            DynamicImage::ImageLumaA8(ImageBuffer::from_raw(size.0, size.1, b8(2)).unwrap()),
            DynamicImage::ImageRgb8(ImageBuffer::from_raw(size.0, size.1, b8(3)).unwrap()),
            DynamicImage::ImageRgba8(ImageBuffer::from_raw(size.0, size.1, b8(4)).unwrap()),
            DynamicImage::ImageLuma16(ImageBuffer::from_raw(size.0, size.1, b16(1)).unwrap()),
            DynamicImage::ImageLumaA16(ImageBuffer::from_raw(size.0, size.1, b16(2)).unwrap()),
            DynamicImage::ImageRgb16(ImageBuffer::from_raw(size.0, size.1, b16(3)).unwrap()),
            DynamicImage::ImageRgba16(ImageBuffer::from_raw(size.0, size.1, b16(4)).unwrap()),
        ];
        for picture in kinds {
            let decoded = decode(&encoded(&picture, ImageFormat::Png), "a.png").unwrap();
            assert_eq!((decoded.width, decoded.height), size);
            let Pixels::Rgba8 { data, has_alpha } = decoded.pixels else { panic!("{:?}", picture.color()) };
            let want: Vec<[u8; 4]> = picture.to_rgba8().pixels().map(|p| p.0).collect();
            assert_eq!(data, want, "{:?}", picture.color());
            assert_eq!((has_alpha, data.capacity()), (picture.color().has_alpha(), want.len()));
        }
        let floats = DynamicImage::ImageRgb32F(
            ImageBuffer::from_raw(size.0, size.1, channel(3).map(|v| f32::from(v) / 1e3).collect()).unwrap(),
        );
        let file = encoded(&floats, ImageFormat::Hdr);
        let want = image::load_from_memory(&file).unwrap().to_rgb32f();
        let Pixels::Rgb32F(data) = decode(&file, "a.hdr").unwrap().pixels else { panic!("floats") };
        assert_eq!(data, want.pixels().map(|p| p.0).collect::<Vec<_>>());
    }
}
