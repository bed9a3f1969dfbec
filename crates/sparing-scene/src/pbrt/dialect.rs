//! Which version of pbrt a scene was written for, told from the words that only one of them knows.
//!
//! Versions 2 and 3 differ from 4 in defaults (film, filter, sampler), in what `roughness` means, in the units of
//! lights and in the layout of maps of the surroundings. Nothing in a file says which it is, so its first part is
//! searched for directives and types of one version only. Without any such word it is version 4.

use super::tokenizer::{TokenKind, token_at, unquote};
use crate::source::SourceFile;
use std::sync::Arc;

/// A version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Dialect {
    /// The book of 2010.
    V2,
    /// The book of 2016.
    V3,
    /// The book of 2023.
    V4,
}

/// Bytes of a file that are searched.
const SEARCHED: usize = 4 << 20;

/// Directives of one version.
const DIRECTIVES: &[(&str, Dialect)] = &[
    ("SurfaceIntegrator", Dialect::V2),
    ("VolumeIntegrator", Dialect::V2),
    ("Renderer", Dialect::V2),
    ("Volume", Dialect::V2),
    ("ColorSpace", Dialect::V4),
    ("Option", Dialect::V4),
    ("Attribute", Dialect::V4),
    ("Import", Dialect::V4),
];

/// Types of one version, after their directive.
const TYPES: &[(&str, &str, Dialect)] = &[
    ("Film", "rgb", Dialect::V4),
    ("Film", "gbuffer", Dialect::V4),
    ("Film", "spectral", Dialect::V4),
    ("Film", "image", Dialect::V3),
    ("Sampler", "bestcandidate", Dialect::V2),
    ("Sampler", "adaptive", Dialect::V2),
    ("Sampler", "zsobol", Dialect::V4),
    ("Sampler", "pmj02bn", Dialect::V4),
    ("Sampler", "paddedsobol", Dialect::V4),
    ("Sampler", "independent", Dialect::V4),
    ("Sampler", "02sequence", Dialect::V3),
    ("Sampler", "lowdiscrepancy", Dialect::V3),
    ("Sampler", "maxmindist", Dialect::V3),
    ("Accelerator", "grid", Dialect::V2),
    ("AreaLightSource", "area", Dialect::V3),
    ("LightSource", "exinfinite", Dialect::V2),
    ("Shape", "bilinearmesh", Dialect::V4),
    ("Material", "matte", Dialect::V3),
    ("Material", "plastic", Dialect::V3),
    ("Material", "metal", Dialect::V3),
    ("Material", "mirror", Dialect::V3),
    ("Material", "glass", Dialect::V3),
    ("Material", "uber", Dialect::V3),
    ("Material", "substrate", Dialect::V3),
    ("Material", "translucent", Dialect::V3),
    ("Material", "disney", Dialect::V3),
    ("Material", "fourier", Dialect::V3),
    ("Material", "shinymetal", Dialect::V2),
    ("Material", "diffuse", Dialect::V4),
    ("Material", "coateddiffuse", Dialect::V4),
    ("Material", "conductor", Dialect::V4),
    ("Material", "coatedconductor", Dialect::V4),
    ("Material", "dielectric", Dialect::V4),
    ("Material", "thindielectric", Dialect::V4),
    ("Material", "diffusetransmission", Dialect::V4),
    ("Material", "interface", Dialect::V4),
];

/// The version of a scene file.
pub(super) fn detect(source: &Arc<SourceFile>) -> Dialect {
    let (mut at, mut directive) = (0, None);
    let mut found = [false; 3];
    while at < SEARCHED {
        // What is broken is reported when the file is read.
        let Ok(Some(token)) = token_at(source, at) else { break };
        at = token.end;
        let bytes = token.bytes(source);
        match token.kind {
            TokenKind::Word if bytes.first().is_some_and(u8::is_ascii_alphabetic) => {
                let word = String::from_utf8_lossy(bytes).into_owned();
                if let Some((_, dialect)) = DIRECTIVES.iter().find(|(name, _)| *name == word) {
                    found[*dialect as usize] = true;
                }
                directive = Some(word);
            }
            TokenKind::Str => {
                if let Some(directive) = directive.take() {
                    let ty = unquote(bytes);
                    let known = TYPES.iter().find(|(name, known, _)| *name == directive && *known == ty);
                    if let Some((.., dialect)) = known {
                        found[*dialect as usize] = true;
                    }
                }
            }
            _ => {}
        }
    }
    // A word of version 4 decides: later files often keep old names. Version 2 and 3 share most words.
    match found {
        [_, _, true] => Dialect::V4,
        [true, ..] => Dialect::V2,
        [_, true, _] => Dialect::V3,
        _ => Dialect::V4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_tell_the_version() {
        let of = |text: &str| {
            let bytes = text.as_bytes().to_vec();
            detect(&Arc::new(SourceFile { name: "t".into(), bytes, lines_before: 0 }))
        };
        assert_eq!(of(""), Dialect::V4);
        assert_eq!(of("Camera \"perspective\" WorldBegin Shape \"sphere\""), Dialect::V4);
        assert_eq!(of("Film \"image\" WorldBegin"), Dialect::V3);
        assert_eq!(of("Film \"image\" SurfaceIntegrator \"path\" WorldBegin"), Dialect::V2);
        assert_eq!(of("Integrator \"path\" WorldBegin Material \"matte\""), Dialect::V3);
        assert_eq!(of("Film \"rgb\" WorldBegin Material \"matte\""), Dialect::V4);
        assert_eq!(of("# Film \"image\"\nWorldBegin \"string"), Dialect::V4);
    }
}
