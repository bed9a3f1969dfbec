//! The list of pictures of a scene, each file and encoding once.

use crate::description::{Image, ImageId, ImageSource, SceneDescription, TextureEncoding};
use std::collections::HashMap;
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
