//! What tells two scenes apart.

use super::{Geometry, Image, ImageSource, QuadMesh, SceneDescription, Shape, TriangleMesh};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::io::{self, Read};

/// Takes text as bytes.
struct Hasher(Sha256);

impl std::fmt::Write for Hasher {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

impl SceneDescription {
    /// SHA-256 of what is seen and how it is lit, pictures by their contents, in hexadecimal digits. Where the files lie, what
    /// they are called and how they are written does not matter; nor does what the command line can say as well: size,
    /// crop, samples and depth.
    ///
    /// # Errors
    /// A picture cannot be read.
    pub fn fingerprint(&self) -> io::Result<String> {
        let mut hasher = Hasher(Sha256::new());
        for image in &self.images {
            hash_image(&mut hasher, image)?;
        }
        for shape in &self.shapes {
            hash_shape(&mut hasher, shape);
        }
        for object in &self.objects {
            let _ = write!(hasher, "object {}", object.shapes.len());
            for shape in &object.shapes {
                hash_shape(&mut hasher, shape);
            }
        }
        // Numbers in their shortest form that gives them back; none of this is large.
        let _ = write!(
            hasher,
            "{:?}{:?}{:?}{:?}{:?}{:?}{:?}",
            self.camera,
            self.film.scale,
            self.filter,
            self.textures,
            self.materials,
            self.instances,
            self.lights
        );
        Ok(hasher.0.finalize().iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        }))
    }
}

fn hash_image(hasher: &mut Hasher, image: &Image) -> io::Result<()> {
    let _ = write!(hasher, "image {:?}", image.encoding);
    match &image.source {
        ImageSource::File(path) => {
            let mut file = std::fs::File::open(path).map_err(|e| named(path, &e))?;
            let mut buffer = vec![0; 1 << 16];
            loop {
                let n = file.read(&mut buffer).map_err(|e| named(path, &e))?;
                if n == 0 {
                    break;
                }
                hasher.0.update(&buffer[..n]);
            }
        }
        ImageSource::Bytes { bytes, .. } => hasher.0.update(bytes),
    }
    Ok(())
}

fn named(path: &std::path::Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("cannot read {}: {error}", path.display()))
}

fn hash_shape(hasher: &mut Hasher, shape: &Shape) {
    let Shape { geometry, material, emission, alpha, reverse_orientation, alpha_cutoff } = shape;
    let _ = write!(hasher, "shape {material:?}{emission:?}{alpha:?}{reverse_orientation}{alpha_cutoff:?}");
    // All fields are named here and above, so that a new one cannot be forgotten.
    match geometry {
        Geometry::Triangles(mesh) => {
            let TriangleMesh { positions, indices, normals, uvs, colors, second_uvs, tangents } = mesh;
            let _ = write!(hasher, "triangles");
            numbers(hasher, positions);
            numbers(hasher, indices);
            optional(hasher, normals.as_deref());
            optional(hasher, uvs.as_deref());
            optional(hasher, colors.as_deref());
            // Rare ones leave no trace where they are not.
            if let Some(uvs) = second_uvs {
                let _ = write!(hasher, "second");
                numbers(hasher, uvs);
            }
            if let Some(tangents) = tangents {
                let _ = write!(hasher, "tangents");
                numbers(hasher, tangents);
            }
        }
        Geometry::Quads(QuadMesh { positions, indices, normals, uvs }) => {
            let _ = write!(hasher, "quads");
            numbers(hasher, positions);
            numbers(hasher, indices);
            optional(hasher, normals.as_deref());
            optional(hasher, uvs.as_deref());
        }
        other => {
            let _ = write!(hasher, "{other:?}");
        }
    }
}

fn numbers<T: bytemuck::NoUninit>(hasher: &mut Hasher, values: &[T]) {
    let _ = write!(hasher, "{} ", values.len());
    hasher.0.update(bytemuck::cast_slice(values));
}

fn optional<T: bytemuck::NoUninit>(hasher: &mut Hasher, values: Option<&[T]>) {
    let _ = write!(hasher, "{}", values.is_some());
    numbers(hasher, values.unwrap_or_default());
}

#[cfg(test)]
mod tests {
    use crate::{LoadOptions, load_pbrt_text};
    use std::path::Path;

    const SCENE: &str =
        "Camera \"perspective\" \"float fov\" 40 WorldBegin LightSource \"infinite\" \"rgb L\" [1 1 1]
        Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]
        Shape \"trianglemesh\" \"point3 P\" [0 0 1 1 0 1 0 1 1] \"point2 uv\" [0 0 1 0 0 1]
        ObjectBegin \"a\" Shape \"sphere\" ObjectEnd ObjectInstance \"a\"";

    fn of(text: &str) -> String {
        let scene =
            load_pbrt_text(text.as_bytes(), Path::new("."), &LoadOptions::default()).expect("it loads");
        scene.fingerprint().expect("nothing to read")
    }

    #[test]
    fn every_change_that_is_seen_changes_it() {
        let first = of(SCENE);
        assert_eq!(first.len(), 64);
        assert_eq!(first, of(&format!("# a comment\n{}", SCENE.replace("0.5 0.5", "0.50   0.5"))));
        for (from, to) in [
            ("40", "41"),
            ("[1 1 1]", "[1 1 1.0001]"),
            ("[0.5 0.5 0.5]", "[0.5 0.5 0.51]"),
            ("[0 0 1 1 0 1 0 1 1]", "[0 0 1 1 0 1 0 1 1.0000001]"),
            ("[0 0 1 0 0 1]", "[0 0 1 0 0 2]"),
            ("\"point2 uv\" [0 0 1 0 0 1]", ""),
            ("ObjectInstance \"a\"", "Translate 1e-3 0 0 ObjectInstance \"a\""),
            ("\"sphere\"", "\"sphere\" \"float radius\" 2"),
            ("\"infinite\"", "\"distant\""),
            ("ObjectInstance", "ActiveTransform EndTime Translate 1 0 0 ObjectInstance"),
            ("Camera", "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All Camera"),
            ("40", "40 \"float shutterclose\" 0.5"),
        ] {
            assert_ne!(first, of(&SCENE.replace(from, to)), "{from} {to}");
        }
    }
}
