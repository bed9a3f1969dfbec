//! What tells two scenes apart.

use super::{Geometry, Image, ImageSource, SceneDescription, Shape};
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
    let Shape { geometry, material, emission, alpha, reverse_orientation } = shape;
    let _ = write!(hasher, "shape {material:?}{emission:?}{alpha:?}{reverse_orientation}");
    match geometry {
        Geometry::Triangles(mesh) => {
            let _ = write!(hasher, "triangles {} {}", mesh.positions.len(), mesh.indices.len());
            hasher.0.update(bytemuck::cast_slice(&mesh.positions));
            hasher.0.update(bytemuck::cast_slice(&mesh.indices));
            hash_attributes(hasher, mesh.normals.as_deref(), mesh.uvs.as_deref());
        }
        Geometry::Quads(mesh) => {
            let _ = write!(hasher, "quads {} {}", mesh.positions.len(), mesh.indices.len());
            hasher.0.update(bytemuck::cast_slice(&mesh.positions));
            hasher.0.update(bytemuck::cast_slice(&mesh.indices));
            hash_attributes(hasher, mesh.normals.as_deref(), mesh.uvs.as_deref());
        }
        other => {
            let _ = write!(hasher, "{other:?}");
        }
    }
}

fn hash_attributes(hasher: &mut Hasher, normals: Option<&[[f32; 3]]>, uvs: Option<&[[f32; 2]]>) {
    let _ = write!(hasher, "{} {}", normals.is_some(), uvs.is_some());
    hasher.0.update(bytemuck::cast_slice(normals.unwrap_or_default()));
    hasher.0.update(bytemuck::cast_slice(uvs.unwrap_or_default()));
}
