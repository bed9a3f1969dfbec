//! The list of pictures of a scene, each file and encoding once.

use crate::description::{Image, ImageId, ImageSource, SceneDescription, TextureEncoding};
use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Which pictures are already in the scene.
#[derive(Debug, Default)]
pub(crate) struct ImageTable {
    known: HashMap<(PathBuf, String), ImageId>,
}

impl ImageTable {
    /// The id of a picture file, new or known.
    pub fn file(&mut self, scene: &mut SceneDescription, path: &Path, encoding: TextureEncoding) -> ImageId {
        let key = (path.to_owned(), format!("{encoding:?}"));
        *self.known.entry(key).or_insert_with(|| {
            let id = ImageId(scene.images.len() as u32);
            scene.images.push(Image { source: ImageSource::File(path.to_owned()), encoding });
            id
        })
    }
}

/// Whether a picture is a PNG with opacity: colour types 4 and 6, or a chunk `tRNS`, by its first 64 KiB.
pub(crate) fn has_alpha(source: &ImageSource) -> bool {
    let mut start = Vec::new();
    match source {
        ImageSource::Bytes { bytes, .. } => start.extend_from_slice(&bytes[..bytes.len().min(1 << 16)]),
        ImageSource::File(path) => {
            let read = File::open(path).and_then(|file| file.take(1 << 16).read_to_end(&mut start));
            if read.is_err() {
                return false;
            }
        }
    }
    if !start.starts_with(b"\x89PNG\r\n\x1a\n") || start.len() < 26 {
        return false;
    }
    if matches!(start[25], 4 | 6) {
        return true;
    }
    let mut at = 8;
    while let (Some(length), Some(kind)) = (start.get(at..at + 4), start.get(at + 4..at + 8)) {
        match kind {
            b"tRNS" => return true,
            b"IDAT" => return false,
            _ => {}
        }
        let length = length.iter().fold(0usize, |value, b| value << 8 | usize::from(*b));
        at += length + 12;
    }
    false
}
