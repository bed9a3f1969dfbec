//! `.gltf` and `.glb` files, and the bytes that they refer to.

use super::json::Node;
use crate::error::{ErrorKind, SceneError};
use crate::options::LoadOptions;
use crate::source;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes of JSON text: parsed it takes several times as much memory.
const MAX_JSON: usize = 1 << 30;

/// A file taken apart.
pub(super) struct Container {
    pub json: Value,
    /// The chunk of binary data in a `.glb` file.
    pub binary: Option<Vec<u8>>,
}

/// Reads a file of either kind, told apart by its first bytes.
pub(super) fn read(path: &Path, options: &LoadOptions) -> Result<Container, SceneError> {
    let file = source::read(path, options)?;
    let bytes = &file.bytes;
    if !bytes.starts_with(b"glTF") {
        return Ok(Container { json: parse(bytes)?, binary: None });
    }
    let broken = |message: &str| SceneError::new(ErrorKind::Format, message);
    let word = |at: usize| bytes.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(broken("the file ends within its head"));
    };
    if version != 2 {
        return Err(SceneError::new(
            ErrorKind::Unsupported,
            format!("this is version {version} of glTF; only 2 is read"),
        ));
    }
    if length as usize > bytes.len() {
        return Err(broken("the file is shorter than its head says"));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while let (Some(size), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..size as usize)) else {
            return Err(broken("a chunk is longer than the file"));
        };
        match kind {
            0x4e4f_534a if json.is_none() => json = Some(parse(chunk)?),
            0x004e_4942 if binary.is_none() => binary = Some(chunk.to_vec()),
            _ => {}
        }
        at += 8 + size as usize;
    }
    let json = json.ok_or_else(|| broken("there is no JSON in the file"))?;
    Ok(Container { json, binary })
}

fn parse(text: &[u8]) -> Result<Value, SceneError> {
    if text.len() > MAX_JSON {
        let message = format!("{} bytes of JSON, more than {MAX_JSON}", text.len());
        return Err(SceneError::new(ErrorKind::Limit, message));
    }
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let json: Value = serde_json::from_slice(text)
        .map_err(|error| SceneError::new(ErrorKind::Syntax, format!("this is not JSON: {error}")))?;
    if !json.is_object() {
        return Err(SceneError::new(ErrorKind::Format, "this is not glTF: it is not an object"));
    }
    Ok(json)
}

/// The bytes of all buffers, read when they are first asked for.
pub(super) struct Buffers<'a> {
    root: Node<'a>,
    folder: PathBuf,
    options: &'a LoadOptions,
    binary: Option<Arc<[u8]>>,
    loaded: Vec<Option<Arc<[u8]>>>,
    total: u64,
}

/// Part of a buffer.
#[derive(Clone)]
pub(super) struct View {
    pub bytes: Arc<[u8]>,
    pub start: usize,
    pub length: usize,
    pub stride: Option<usize>,
}

impl View {
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[self.start..self.start + self.length]
    }
}

impl<'a> Buffers<'a> {
    pub fn new(
        root: Node<'a>,
        binary: Option<Vec<u8>>,
        path: &Path,
        options: &'a LoadOptions,
    ) -> Result<Self, SceneError> {
        let count = root.list("buffers")?.len();
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let binary = binary.map(Arc::from);
        Ok(Self { root, folder, options, binary, loaded: vec![None; count], total: 0 })
    }

    /// The view that `node` names.
    pub fn view(&mut self, node: &Node<'a>) -> Result<Option<View>, SceneError> {
        let Some((_, view)) = node.named("bufferView", &self.root, "bufferViews")? else { return Ok(None) };
        let Some((index, buffer)) = view.named("buffer", &self.root, "buffers")? else {
            return Err(view.error("`buffer` is missing"));
        };
        let bytes = self.buffer(index, &buffer)?;
        let start = view.whole("byteOffset")?.unwrap_or(0);
        let length = view.require("byteLength")?.as_whole()?;
        if start.checked_add(length).is_none_or(|end| end > bytes.len()) {
            let message = format!("it is not within its buffer of {} bytes", bytes.len());
            return Err(view.error(message));
        }
        Ok(Some(View { bytes, start, length, stride: view.whole("byteStride")? }))
    }

    fn buffer(&mut self, index: usize, node: &Node<'a>) -> Result<Arc<[u8]>, SceneError> {
        if let Some(bytes) = &self.loaded[index] {
            return Ok(Arc::clone(bytes));
        }
        let bytes: Arc<[u8]> = match (node.text("uri")?, &self.binary) {
            (Some(uri), _) => self.uri(uri, &node.require("uri")?)?.into(),
            (None, Some(binary)) if index == 0 => Arc::clone(binary),
            _ => return Err(node.error("it has neither a `uri` nor a binary chunk")),
        };
        let length = node.require("byteLength")?.as_whole()?;
        if bytes.len() < length {
            return Err(node.error(format!("it has {} bytes instead of {length}", bytes.len())));
        }
        self.total += bytes.len() as u64;
        if self.total > self.options.max_total_bytes {
            return Err(self.options.exceeded("max_total_bytes", self.options.max_total_bytes, self.total));
        }
        self.loaded[index] = Some(Arc::clone(&bytes));
        Ok(bytes)
    }

    fn uri(&self, uri: &str, node: &Node<'a>) -> Result<Vec<u8>, SceneError> {
        match data_uri(uri) {
            Some(data) => data.map(|(_, bytes)| bytes).map_err(|message| node.error(message)),
            None => {
                let path = self.path(uri, node)?;
                let read = source::read(&path, self.options).map_err(|error| {
                    node.error_of(error.kind(), format!("`{}`: {}", path.display(), error.message()))
                })?;
                Ok(Arc::try_unwrap(read).map_or_else(|shared| shared.bytes.clone(), |file| file.bytes))
            }
        }
    }

    /// The file that a relative reference names.
    pub fn path(&self, uri: &str, node: &Node<'a>) -> Result<PathBuf, SceneError> {
        let scheme = uri.split_once(':').is_some_and(|(scheme, _)| {
            scheme.len() > 1 && scheme.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b))
        });
        if scheme {
            let message = "only files and data in the file itself are read, nothing from elsewhere";
            return Err(node.error_of(ErrorKind::Unsupported, message));
        }
        Ok(self.folder.join(percent_decoded(uri)))
    }
}

/// Type and bytes of a `data:` reference; `None` if it is none.
pub(super) fn data_uri(uri: &str) -> Option<Result<(&str, Vec<u8>), &'static str>> {
    let (head, data) = uri.strip_prefix("data:")?.split_once(',')?;
    let Some(kind) = head.strip_suffix(";base64") else {
        return Some(Err("data in a reference must be base64"));
    };
    Some(base64(data.as_bytes()).map(|bytes| (kind, bytes)).ok_or("this is not base64"))
}

/// RFC 4648, with or without padding.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.trim_ascii_end();
    let text = text.strip_suffix(b"==").or(text.strip_suffix(b"=")).unwrap_or(text);
    let digit = |b: u8| {
        Some(u32::from(match b {
            b'A'..=b'Z' => b - b'A',
            b'a'..=b'z' => b - b'a' + 26,
            b'0'..=b'9' => b - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        }))
    };
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for group in text.chunks(4) {
        let mut word = 0;
        for (i, b) in group.iter().enumerate() {
            word |= digit(*b)? << (18 - 6 * i);
        }
        let count = group.len().checked_sub(1).filter(|count| *count > 0)?;
        bytes.extend_from_slice(&word.to_be_bytes()[1..=count]);
    }
    Some(bytes)
}

fn percent_decoded(uri: &str) -> PathBuf {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&b, after)) = rest.split_first() {
        let code = (b == b'%').then(|| after.get(..2)).flatten();
        let code = code
            .and_then(|hex| std::str::from_utf8(hex).ok())
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        bytes.push(code.unwrap_or(b));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned().into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_percent_codes() {
        assert_eq!(base64(b"SGVsbG8=").as_deref(), Some(&b"Hello"[..]));
        assert_eq!(base64(b"SGVsbG8h").as_deref(), Some(&b"Hello!"[..]));
        assert_eq!(base64(b"AA==").as_deref(), Some(&[0u8][..]));
        assert_eq!(base64(b""), Some(vec![]));
        assert!(base64(b"A").is_none() && base64(b"????").is_none());
        assert_eq!(percent_decoded("a%20b%zz%"), PathBuf::from("a b%zz%"));
        assert!(data_uri("data.bin").is_none());
        assert!(data_uri("data:,abc").unwrap().is_err());
    }
}
