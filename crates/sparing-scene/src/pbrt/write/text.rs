//! Text of parameters. Numbers are the shortest that read back the same.

use glam::Vec3;
use std::fmt::Write;

/// Lines, indented by blocks.
#[derive(Default)]
pub(super) struct Text(String);

impl Text {
    pub fn line(&mut self, text: &str) {
        self.0.push_str(text);
        self.0.push('\n');
    }

    pub fn finish(self) -> String {
        self.0
    }
}

/// ` "float name" value`.
pub(super) fn number(name: &str, value: f32) -> String {
    format!(" \"float {name}\" {value}")
}

/// ` "rgb name" [ r g b ]`.
pub(super) fn color(name: &str, value: Vec3) -> String {
    format!(" \"rgb {name}\" [ {} {} {} ]", value.x, value.y, value.z)
}

/// ` "type name" [ ... ]`, broken into lines.
pub(super) fn numbers<T: std::fmt::Display>(name: &str, values: &[T]) -> String {
    let mut text = format!(" \"{name}\" [");
    for (i, value) in values.iter().enumerate() {
        text.push_str(if i % 12 == 0 && i > 0 { "\n    " } else { " " });
        // Writing to a string does not fail.
        let _ = write!(text, "{value}");
    }
    text + " ]"
}

/// A string as pbrt reads it back; characters that would end the line become blanks.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out + "\""
}
