//! Letters as strokes, from `glyphs.txt`.

use super::canvas::Anchor;
use std::collections::HashMap;
use std::sync::LazyLock;

type Stroke = Vec<[f64; 2]>;

/// Strokes and width of each character, capitals 7 high.
static GLYPHS: LazyLock<HashMap<char, (Vec<Stroke>, f64)>> = LazyLock::new(|| {
    let lines = include_str!("glyphs.txt").lines().filter(|l| !l.starts_with('#'));
    lines.filter_map(glyph).collect()
});

/// Space between letters, and the width of a space.
const GAP: f64 = 1.7;
const SPACE: f64 = 1.6;
/// Height of a capital as a share of the font size.
const CAPITAL: f64 = 0.72;

fn glyph(line: &str) -> Option<(char, (Vec<Stroke>, f64))> {
    let mut words = line.split_whitespace();
    let character = words.next()?.chars().next()?;
    let mut parts: Vec<(char, Stroke)> = Vec::new();
    for word in words {
        match word.split_once(',') {
            Some((x, y)) => parts.last_mut()?.1.push([x.parse().ok()?, y.parse().ok()?]),
            None => parts.push((word.chars().next()?, Vec::new())),
        }
    }
    let strokes: Vec<Stroke> = parts.into_iter().map(|(kind, points)| curve(kind, points)).collect();
    let width = strokes.iter().flatten().map(|p| p[0]).fold(0.0, f64::max);
    Some((character, (strokes, width)))
}

/// A quadratic B-spline as short lines; straight lines stay.
fn curve(kind: char, mut points: Stroke) -> Stroke {
    let closed = kind == 'O';
    if kind == 'L' || points.len() < 3 {
        return points;
    }
    if closed {
        points.extend_from_within(..2);
    }
    let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let last = points.len() - 1;
    let mut out = Vec::new();
    for i in 1..last {
        let from = if i == 1 && !closed { points[0] } else { middle(points[i - 1], points[i]) };
        let to = if i == last - 1 && !closed { points[last] } else { middle(points[i], points[i + 1]) };
        for step in 0..=8 {
            let t = f64::from(step) / 8.0;
            let (a, b, c) = ((1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t);
            out.push([0, 1].map(|k| a * from[k] + b * points[i][k] + c * to[k]));
        }
    }
    out
}

/// The strokes of a text, x to the right from its anchor, y upwards from the baseline. Characters that the font
/// does not have are left blank.
pub(crate) fn strokes(text: &str, size: f64, anchor: Anchor) -> Vec<Stroke> {
    let scale = size * CAPITAL / 7.0;
    let mut x = 0.0;
    let mut out: Vec<Stroke> = Vec::new();
    for character in text.chars() {
        let Some((strokes, width)) = GLYPHS.get(&character) else {
            x += SPACE + GAP;
            continue;
        };
        out.extend(
            strokes.iter().map(|s| s.iter().map(|p| [(x + p[0]) * scale, p[1] * scale]).collect::<Stroke>()),
        );
        x += width + GAP;
    }
    let width = (x - GAP).max(0.0) * scale;
    let shift = match anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -0.5 * width,
        Anchor::End => -width,
    };
    out.iter_mut().flatten().for_each(|p| p[0] += shift);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_that_plots_use_has_a_glyph() {
        let used = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.,:-+=%()/_'<>";
        for c in used.chars() {
            let (strokes, width) = &GLYPHS[&c];
            assert!(!strokes.is_empty() && (0.0..8.0).contains(width), "{c}");
            assert!(strokes.iter().all(|s| s.len() >= 2), "{c}");
        }
        let at = |anchor| strokes("100", 12.0, anchor)[0][0][0];
        assert!(at(Anchor::Start) > at(Anchor::Middle) && at(Anchor::Middle) > at(Anchor::End));
    }
}
