//! Plots of the commands: a canvas that is written as SVG and drawn as PNG, its font, colours and marks.

mod canvas;
mod font;

pub(crate) use canvas::{Anchor, Canvas, Colour};

use sparing_image::atomic::{OutputError, write_atomic};
use sparing_image::png::write_png;
use std::io::Write;
use std::path::Path;

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008), without yellow.
pub(crate) const COLOURS: [Colour; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [120, 94, 60],
];
pub(crate) const GREY: Colour = [150, 150, 150];
pub(crate) const FAINT: Colour = [228, 228, 228];
pub(crate) const BLACK: Colour = [0, 0, 0];
pub(crate) const WHITE: Colour = [255, 255, 255];

/// The mark of what is below an axis.
pub(crate) const DOWN: usize = usize::MAX;

/// The mark of a line: circle, square, triangle, diamond.
pub(crate) fn marker(canvas: &mut Canvas, [x, y]: [f64; 2], kind: usize, colour: Colour) {
    let polygon = |n: usize, r: f64, turn: f64| -> Vec<[f64; 2]> {
        (0..n)
            .map(|i| (i as f64 / n as f64 + turn) * std::f64::consts::TAU)
            .map(|a| [x + r * a.sin(), y - r * a.cos()])
            .collect()
    };
    let points = match kind {
        DOWN => polygon(3, 4.5, 0.5),
        k => match k % 4 {
            0 => polygon(24, 4.0, 0.0),
            1 => polygon(4, 5.0, 0.125),
            2 => polygon(3, 5.2, 0.0),
            _ => polygon(4, 5.0, 0.0),
        },
    };
    canvas.area(points, colour, WHITE);
}

/// A number with commas.
pub(crate) fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let first = (digits.len() - 1) % 3 + 1;
    let mut out = digits[..first].to_owned();
    for i in (first..digits.len()).step_by(3) {
        out.push(',');
        out.push_str(&digits[i..i + 3]);
    }
    out
}

/// The drawing as linear pixels, `scale` a unit: width, height, rows from the top.
pub(crate) fn linear_pixels(canvas: &Canvas, scale: f64) -> (u32, u32, Vec<[f32; 3]>) {
    let (width, height, pixels) = canvas.to_pixels(scale);
    (width, height, pixels.iter().map(|p| p.map(sparing_render::texture::srgb_to_linear)).collect())
}

/// Writes a drawing as SVG and as PNG of twice its size.
pub(crate) fn write(canvas: &Canvas, svg: &Path, png: &Path) -> Result<(), OutputError> {
    write_text(svg, &canvas.to_svg())?;
    let (width, height, pixels) = linear_pixels(canvas, 2.0);
    write_png(png, width, height, &pixels, 0.0)
}

/// Writes a text file.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
    write_atomic(path, |file| file.write_all(text.as_bytes()).map_err(OutputError::io(path)))
}
