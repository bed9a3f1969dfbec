//! Reads the meshes that a file will name before they are asked for, some at a time and in parallel.
//!
//! The text is searched for `Shape "plymesh"` with a file name; what is found is only a guess. Whatever could not be
//! read here is read again, and reported, where it is used. At most [`AHEAD`] meshes wait.

use super::Builder;
use super::tokenizer::{TokenKind, token_at, unquote};
use crate::description::TriangleMesh;
use crate::error::SceneError;
use crate::source::SourceFile;
use crate::warnings::Warnings;
use rayon::prelude::*;
use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Meshes that are read at once.
const AHEAD: usize = 32;

/// Meshes to come.
#[derive(Debug, Default)]
pub(super) struct Prefetch {
    names: VecDeque<PathBuf>,
    ready: HashMap<PathBuf, (TriangleMesh, Warnings)>,
}

/// The names of meshes in a text, in order.
fn names(source: &Arc<SourceFile>) -> VecDeque<String> {
    let (mut at, mut names) = (0, VecDeque::new());
    let mut words: [Vec<u8>; 2] = Default::default();
    let mut is_mesh = false;
    while let Ok(Some(token)) = token_at(source, at) {
        at = token.end;
        let text = token.bytes(source);
        match token.kind {
            TokenKind::Word if text.first().is_some_and(u8::is_ascii_alphabetic) => {
                is_mesh = false;
                words[1] = text.to_vec();
            }
            TokenKind::Str => {
                let before = std::mem::replace(&mut words[1], text.to_vec());
                is_mesh |= before == b"Shape" && text == b"\"plymesh\"";
                if is_mesh && words[0] == b"\"string filename\"" {
                    names.push_back(unquote(text));
                }
                words[0] = text.to_vec();
            }
            _ => {}
        }
    }
    names
}

impl Builder<'_> {
    /// Notes the meshes of a text that is about to be read.
    pub(super) fn expect_meshes(&mut self, source: &Arc<SourceFile>) {
        // The usual scene has none: one look at the bytes.
        if !source.bytes.windows(9).any(|w| w == b"\"plymesh\"") {
            return;
        }
        let beside = Path::new(&source.name).parent().map(Path::to_owned).unwrap_or_default();
        let find = |name: String| {
            [self.base.join(&name), beside.join(&name)].into_iter().find(|path| path.is_file())
        };
        let found: Vec<PathBuf> = names(source).into_iter().filter_map(find).collect();
        // An included file comes before the rest of the one that includes it.
        for path in found.into_iter().rev() {
            self.prefetch.names.push_front(path);
        }
    }

    /// A mesh, read now or before.
    pub(super) fn ply_mesh(&mut self, path: &Path) -> Result<TriangleMesh, SceneError> {
        let Prefetch { names, ready } = &mut self.prefetch;
        if !ready.contains_key(path)
            && let Some(from) = names.iter().position(|name| name == path)
        {
            names.drain(..from);
            let mut next: Vec<PathBuf> = Vec::with_capacity(AHEAD);
            while let Some(name) = names.front().filter(|_| next.len() < AHEAD) {
                if next.contains(name) {
                    break; // the same mesh again: once the first is used
                }
                next.extend(names.pop_front());
            }
            let options = self.options;
            let read = |path: PathBuf| {
                let mut warnings = Warnings::new(options.max_warnings);
                let mesh = crate::ply::load(&path, options, &mut warnings).ok()?;
                Some((path, (mesh, warnings)))
            };
            ready.clear();
            ready.par_extend(next.into_par_iter().filter_map(read));
        }
        match ready.remove(path) {
            Some((mesh, warnings)) => {
                self.warnings.append(warnings);
                Ok(mesh)
            }
            None => crate::ply::load(path, self.options, &mut self.warnings),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_order() {
        let text = "Texture \"a\" \"color\" \"imagemap\" \"string filename\" \"no.png\"\n\
                    Shape \"plymesh\" \"string filename\" \"a.ply\" \"float alpha\" 1\n\
                    Shape \"plymesh\" \"float alpha\" 1 \"string filename\" [ \"b.ply\" ]\n\
                    Shape \"objmesh\" \"string filename\" \"c.obj\"";
        let source = SourceFile { name: "t".into(), bytes: text.as_bytes().to_vec(), lines_before: 0 };
        assert_eq!(names(&Arc::new(source)), ["a.ply", "b.ply"]);
    }
}
