//! Portable float maps: a text header, then 32-bit floats in rows from the **bottom**.
//!
//! `PF` is colour, `Pf` grey; then width, height and a scale whose sign tells the byte order (negative: little
//! endian) and whose magnitude multiplies the values. One white-space byte ends the header.

use crate::picture::{MAX_SIDE, Picture, PictureError, Pixels};

/// Whether the bytes begin like a PFM file.
#[must_use]
pub fn is_pfm(bytes: &[u8]) -> bool {
    matches!(bytes, [b'P', b'F' | b'f', space, ..] if space.is_ascii_whitespace())
}

/// Decodes a file in memory; `name` is for messages. Grey becomes RGB.
///
/// # Errors
/// A damaged header, no pixels or a side over [`MAX_SIDE`], fewer values than the header promises.
pub fn decode(bytes: &[u8], name: &str) -> Result<Picture, PictureError> {
    let fail = |reason: &str| PictureError::Decode { name: name.to_owned(), reason: reason.to_owned() };
    let mut header = Header { rest: bytes };
    let channels = match header.word() {
        Some("PF") => 3,
        Some("Pf") => 1,
        _ => return Err(fail("it is no portable float map")),
    };
    let side = |word: Option<&str>| word?.parse::<u32>().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    let width = side(header.word()).ok_or_else(|| fail("its width is missing, 0 or too large"))?;
    let height = side(header.word()).ok_or_else(|| fail("its height is missing, 0 or too large"))?;
    let scale: f32 =
        header.word().and_then(|w| w.parse().ok()).ok_or_else(|| fail("its scale is missing"))?;
    if !scale.is_finite() || scale == 0.0 {
        return Err(fail("its scale is 0 or not finite"));
    }
    let row = width as usize * channels * 4;
    let data = header.rest.get(1..).unwrap_or(&[]);
    if data.len() / row < height as usize {
        return Err(fail("it ends before its last pixel"));
    }
    let value = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        (if scale < 0.0 { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }) * scale.abs()
    };
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for line in data.chunks_exact(row).take(height as usize).rev() {
        pixels.extend(line.chunks_exact(4 * channels).map(|p| match channels {
            1 => [value(p); 3],
            _ => [value(&p[0..]), value(&p[4..]), value(&p[8..])],
        }));
    }
    // Rows after the promised ones would have shifted the picture: only the first `height` were taken.
    Ok(Picture { width, height, pixels: Pixels::Rgb32F(pixels) })
}

struct Header<'a> {
    rest: &'a [u8],
}

impl<'a> Header<'a> {
    /// The next word of at most 32 bytes; leaves the white space behind it.
    fn word(&mut self) -> Option<&'a str> {
        let start = self.rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &self.rest[start..];
        let end = rest.iter().take(33).position(u8::is_ascii_whitespace)?;
        self.rest = &rest[end..];
        std::str::from_utf8(&rest[..end]).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, values: &[f32], big: bool) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        let values = values.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() });
        bytes.extend(values);
        bytes
    }

    #[test]
    fn rows_come_bottom_up_in_either_byte_order() {
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        for (header, big) in [("PF\n1 2\n-1.0\n", false), ("PF\n1 2\n1.0\n", true)] {
            let p = Picture::decode(&file(header, &values, big), "x").unwrap();
            assert!(matches!(p.pixels, Pixels::Rgb32F(ref d) if *d == [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]));
        }
        let p = Picture::decode(&file("Pf 2 1 -0.5 ", &[2.0, f32::INFINITY], false), "x").unwrap();
        assert!(matches!(p.pixels, Pixels::Rgb32F(ref d) if *d == [[1.0; 3], [f32::INFINITY; 3]]));
    }

    #[test]
    fn damaged_files_are_errors() {
        let headers = ["PF", "PF\n", "PF\n1", "PF\n0 1\n-1\n", "PF\n-1 1\n-1\n", "PF\n99999999999 1\n-1\n"];
        let more =
            ["PF\n32768 32768\n-1\n", "PF\n1 1\n0\n", "PF\n1 1\nnan\n", "PF\n1 1\n-1", "PF\n1 1\n-1\n"];
        for header in headers.into_iter().chain(more) {
            assert!(decode(header.as_bytes(), "x").is_err(), "{header:?}");
        }
    }
}
