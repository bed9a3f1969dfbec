//! Lines, areas and text for a plot, written as SVG or drawn as pixels. The PNG's letters are strokes of our
//! own (`glyphs.txt`), so that they are there on machines without fonts.

use std::fmt::Write as _;

/// Where a text's position is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A colour, sRGB.
pub(crate) type Colour = [u8; 3];

enum Shape {
    Line { points: Vec<[f64; 2]>, width: f64, dash: Option<[f64; 2]>, colour: Colour },
    Area { points: Vec<[f64; 2]>, fill: Colour, edge: Colour },
    Text { at: [f64; 2], size: f64, anchor: Anchor, up: bool, text: String },
}

/// A drawing in its own units, y downwards, on white.
pub(crate) struct Canvas {
    size: [f64; 2],
    shapes: Vec<Shape>,
}

const BLACK: Colour = [0, 0, 0];

impl Canvas {
    pub(crate) fn new(size: [f64; 2]) -> Self {
        Self { size, shapes: Vec::new() }
    }

    pub(crate) fn line(&mut self, points: Vec<[f64; 2]>, width: f64, dash: Option<[f64; 2]>, colour: Colour) {
        self.shapes.push(Shape::Line { points, width, dash, colour });
    }

    /// A filled polygon with a thin edge.
    pub(crate) fn area(&mut self, points: Vec<[f64; 2]>, fill: Colour, edge: Colour) {
        self.shapes.push(Shape::Area { points, fill, edge });
    }

    /// Text on its baseline, upwards when `up`.
    pub(crate) fn text(
        &mut self,
        at: [f64; 2],
        size: f64,
        anchor: Anchor,
        up: bool,
        text: impl Into<String>,
    ) {
        self.shapes.push(Shape::Text { at, size, anchor, up, text: text.into() });
    }

    /// The drawing as SVG; text stays text.
    pub(crate) fn to_svg(&self) -> String {
        let [w, h] = self.size;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n"
        );
        let hex = |c: &Colour| format!("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
        for shape in &self.shapes {
            let _ = match shape {
                Shape::Line { points, width, dash, colour } => {
                    let dash = dash.map_or(String::new(), |[a, b]| format!(" stroke-dasharray=\"{a} {b}\""));
                    let (points, colour) = (list(points), hex(colour));
                    writeln!(
                        svg,
                        "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" \
                         stroke-linejoin=\"round\"{dash}/>"
                    )
                }
                Shape::Area { points, fill, edge } => writeln!(
                    svg,
                    "<polygon points=\"{}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"0.8\"/>",
                    list(points),
                    hex(fill),
                    hex(edge)
                ),
                Shape::Text { at: [x, y], size, anchor, up, text } => {
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let turn =
                        if *up { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
                    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
                    writeln!(
                        svg,
                        "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size}\" text-anchor=\"{anchor}\"{turn}>{text}</text>"
                    )
                }
            };
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// The drawing as sRGB pixels, `scale` a unit: width, height, rows from the top.
    pub(crate) fn to_pixels(&self, scale: f64) -> (u32, u32, Vec<[f32; 3]>) {
        let [w, h] = self.size.map(|s| (s * scale).ceil() as usize);
        let mut image = Image { w, h, pixels: vec![[1.0; 3]; w * h] };
        let scaled = |points: &[[f64; 2]]| points.iter().map(|p| p.map(|v| v * scale)).collect::<Vec<_>>();
        for shape in &self.shapes {
            match shape {
                Shape::Line { points, width, dash, colour } => {
                    let lines = dash.map_or_else(|| vec![points.clone()], |dash| dashes(points, dash));
                    let lines: Vec<_> = lines.iter().map(|l| scaled(l)).collect();
                    image.strokes(&lines, width * scale, *colour);
                }
                Shape::Area { points, fill, edge } => {
                    let mut points = scaled(points);
                    image.fill(&points, *fill);
                    points.push(points[0]);
                    image.strokes(&[points], 0.8 * scale, *edge);
                }
                Shape::Text { at, size, anchor, up, text } => {
                    let strokes = super::font::strokes(text, *size, *anchor);
                    let place =
                        |[x, y]: [f64; 2]| if *up { [at[0] - y, at[1] - x] } else { [at[0] + x, at[1] - y] };
                    let lines: Vec<_> = strokes
                        .iter()
                        .map(|l| scaled(&l.iter().map(|p| place(*p)).collect::<Vec<_>>()))
                        .collect();
                    image.strokes(&lines, size * scale * 0.085, BLACK);
                }
            }
        }
        (w as u32, h as u32, image.pixels)
    }
}

fn list(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

/// The drawn parts of a dashed line.
fn dashes(points: &[[f64; 2]], [on, off]: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
    let mut parts = Vec::new();
    let mut at = 0.0; // along the pattern
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let point = |s: f64| [a[0] + (b[0] - a[0]) * s / length, a[1] + (b[1] - a[1]) * s / length];
        let mut s = 0.0;
        while s < length {
            let phase: f64 = at % (on + off);
            let step = (if phase < on { on - phase } else { on + off - phase }).max(1e-3).min(length - s);
            if phase < on {
                parts.push(vec![point(s), point(s + step)]);
            }
            s += step;
            at += step;
        }
    }
    parts
}

struct Image {
    w: usize,
    h: usize,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// The pixels that a box around points touches: x0, y0, x1, y1, ends exclusive.
    fn window<'a>(&self, points: impl Iterator<Item = &'a [f64; 2]>, margin: f64) -> [usize; 4] {
        let mut b = [f64::INFINITY, f64::INFINITY, 0.0, 0.0];
        for [x, y] in points {
            b = [b[0].min(*x), b[1].min(*y), b[2].max(*x), b[3].max(*y)];
        }
        let clamp = |v: f64, most: usize| v.clamp(0.0, most as f64) as usize;
        [
            clamp(b[0] - margin, self.w),
            clamp(b[1] - margin, self.h),
            clamp(b[2] + margin + 1.0, self.w),
            clamp(b[3] + margin + 1.0, self.h),
        ]
    }

    fn blend(&mut self, x: usize, y: usize, coverage: f64, colour: Colour) {
        for (p, c) in self.pixels[y * self.w + x].iter_mut().zip(colour) {
            *p += (f32::from(c) / 255.0 - *p) * coverage as f32;
        }
    }

    /// Round strokes: a pixel's coverage falls off over one pixel around the edge. All lines are one area.
    fn strokes(&mut self, lines: &[Vec<[f64; 2]>], width: f64, colour: Colour) {
        let half = (width / 2.0).max(0.3);
        let [x0, y0, x1, y1] = self.window(lines.iter().flatten(), half + 1.0);
        if x0 >= x1 || y0 >= y1 {
            return;
        }
        let mut coverage = vec![0.0_f64; (x1 - x0) * (y1 - y0)];
        for pair in lines.iter().flat_map(|line| line.windows(2)) {
            let [a, b] = [pair[0], pair[1]];
            let [u0, v0, u1, v1] = self.window(pair.iter(), half + 1.0);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let length2 = (dx * dx + dy * dy).max(1e-12);
            for y in v0..v1 {
                for x in u0..u1 {
                    let (px, py) = (x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]);
                    let t = ((px * dx + py * dy) / length2).clamp(0.0, 1.0);
                    let c = (half + 0.5 - (px - t * dx).hypot(py - t * dy)).clamp(0.0, 1.0);
                    let place = &mut coverage[(y - y0) * (x1 - x0) + x - x0];
                    *place = place.max(c);
                }
            }
        }
        for (i, c) in coverage.iter().enumerate().filter(|(_, c)| **c > 0.0) {
            self.blend(x0 + i % (x1 - x0), y0 + i / (x1 - x0), *c, colour);
        }
    }

    /// A polygon by the even-odd rule with 4 x 4 points a pixel.
    fn fill(&mut self, points: &[[f64; 2]], colour: Colour) {
        let inside = |x: f64, y: f64| {
            let mut odd = false;
            for (i, a) in points.iter().enumerate() {
                let b = points[(i + 1) % points.len()];
                if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
                    odd = !odd;
                }
            }
            odd
        };
        let [x0, y0, x1, y1] = self.window(points.iter(), 1.0);
        for y in y0..y1 {
            for x in x0..x1 {
                let at = |k: usize| {
                    (x as f64 + 0.125 + 0.25 * (k % 4) as f64, y as f64 + 0.125 + 0.25 * (k / 4) as f64)
                };
                let hits = (0..16).filter(|&k| inside(at(k).0, at(k).1)).count();
                self.blend(x, y, hits as f64 / 16.0, colour);
            }
        }
    }
}
