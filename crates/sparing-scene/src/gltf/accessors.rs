//! Accessors: typed numbers in buffers, dense or sparse.

use super::container::{Buffers, View};
use super::json::Node;
use crate::error::{ErrorKind, SceneError};

/// Values of all accessors together that no bytes of the file stand for (a sparse accessor without a view is zero).
const MAX_ZEROS: usize = 1 << 24;

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(node: &Node<'_>) -> Result<Self, SceneError> {
        let kind = node.require("componentType")?;
        Ok(match kind.as_whole()? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => return Err(kind.error(format!("there is no component type {other}"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn is_index(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }

    /// The number at the start of `bytes`, normalised on request (glTF 2.0, section 3.6.2.2).
    #[inline]
    fn read(self, bytes: &[u8], normalized: bool) -> f32 {
        macro_rules! value {
            ($type:ty) => {
                bytes.first_chunk().map_or(0.0, |b| <$type>::from_le_bytes(*b) as f32)
            };
        }
        let (value, full) = match self {
            Self::I8 => (value!(i8), 127.0),
            Self::U8 => (value!(u8), 255.0),
            Self::I16 => (value!(i16), 32767.0),
            Self::U16 => (value!(u16), 65535.0),
            Self::U32 => (value!(u32), u32::MAX as f32),
            Self::F32 => return value!(f32),
        };
        if normalized { (value / full).max(-1.0) } else { value }
    }

    #[inline]
    fn read_index(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => bytes.first().map_or(0, |b| u32::from(*b)),
            Self::U16 => bytes.first_chunk().map_or(0, |b| u32::from(u16::from_le_bytes(*b))),
            _ => bytes.first_chunk().map_or(0, |b| u32::from_le_bytes(*b)),
        }
    }
}

/// An accessor whose bytes are known to exist.
pub(super) struct Accessor<'a> {
    node: Node<'a>,
    count: usize,
    component: Component,
    components: usize,
    normalized: bool,
    view: Option<(View, usize, usize)>,
    sparse: Option<Sparse>,
}

struct Sparse {
    count: usize,
    indices: (View, usize, Component),
    values: (View, usize),
}

/// Reads accessors; counts what has no bytes.
#[derive(Default)]
pub(super) struct Reader {
    zeros: usize,
}

impl Reader {
    /// Looks an accessor up and checks that all its bytes exist.
    pub fn open<'a>(
        &mut self,
        node: Node<'a>,
        buffers: &mut Buffers<'a>,
    ) -> Result<Accessor<'a>, SceneError> {
        let count = node.require("count")?.as_whole()?;
        let component = Component::of(&node)?;
        let kind = node.require("type")?;
        let components = match kind.as_str()? {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            other => {
                let other: String = other.chars().take(20).collect();
                return Err(kind.error(format!("accessors of type `{other}` are not used here")));
            }
        };
        let size = component.size() * components;
        let start = node.whole("byteOffset")?.unwrap_or(0);
        let view = match buffers.view(&node)? {
            Some(view) => {
                let stride = view.stride.unwrap_or(size);
                check(&node, &view, start, stride, size, count)?;
                Some((view, start, stride))
            }
            None => {
                self.zeros = self.zeros.saturating_add(count);
                if self.zeros > MAX_ZEROS {
                    let message = format!("more than {MAX_ZEROS} values that are nowhere in the file");
                    return Err(node.error_of(ErrorKind::Limit, message));
                }
                None
            }
        };
        let sparse = match node.get("sparse") {
            None => None,
            Some(sparse) => Some(Sparse::open(&sparse, buffers, count, size)?),
        };
        let normalized = node.flag("normalized")?;
        Ok(Accessor { node, count, component, components, normalized, view, sparse })
    }
}

/// That `count` values fit into a view.
fn check(
    node: &Node<'_>,
    view: &View,
    start: usize,
    stride: usize,
    size: usize,
    count: usize,
) -> Result<(), SceneError> {
    if stride < size && count > 1 {
        return Err(node.error(format!("values of {size} bytes lie {stride} bytes apart")));
    }
    let end = match count {
        0 => Some(0),
        count => (count - 1).checked_mul(stride).and_then(|v| v.checked_add(start)?.checked_add(size)),
    };
    if end.is_none_or(|end| end > view.length) {
        return Err(node.error(format!("{count} values do not fit into its view of {} bytes", view.length)));
    }
    Ok(())
}

impl Sparse {
    fn open<'a>(
        node: &Node<'a>,
        buffers: &mut Buffers<'a>,
        of: usize,
        size: usize,
    ) -> Result<Self, SceneError> {
        let count = node.require("count")?.as_whole()?;
        if count > of {
            return Err(node.error(format!("{count} values replace {of}")));
        }
        let mut part = |name: &str| {
            let part = node.require(name)?;
            let view = buffers.view(&part)?.ok_or_else(|| part.error("`bufferView` is missing"))?;
            let start = part.whole("byteOffset")?.unwrap_or(0);
            Ok::<_, SceneError>((part, view, start))
        };
        let (indices, index_view, index_start) = part("indices")?;
        let (values, value_view, value_start) = part("values")?;
        let component = Component::of(&indices)?;
        if !component.is_index() {
            return Err(indices.error("indices must be whole numbers without sign"));
        }
        check(&indices, &index_view, index_start, component.size(), component.size(), count)?;
        check(&values, &value_view, value_start, size, size, count)?;
        let sparse =
            Self { count, indices: (index_view, index_start, component), values: (value_view, value_start) };
        if let Some(index) = sparse.indices().find(|i| *i >= of) {
            return Err(indices.error(format!("index {index} of {of} values")));
        }
        Ok(sparse)
    }

    fn indices(&self) -> impl Iterator<Item = usize> {
        let (view, start, component) = &self.indices;
        let bytes = view.bytes();
        (0..self.count).map(move |i| component.read_index(&bytes[start + i * component.size()..]) as usize)
    }
}

impl Accessor<'_> {
    pub fn count(&self) -> usize {
        self.count
    }

    pub fn components(&self) -> usize {
        self.components
    }

    pub fn error(&self, message: impl std::fmt::Display) -> SceneError {
        self.node.error(message)
    }

    /// Calls `put` with the number and the bytes of each value, those of a sparse one twice.
    fn each(&self, mut put: impl FnMut(usize, &[u8])) {
        if let Some((view, start, stride)) = &self.view {
            let bytes = view.bytes();
            (0..self.count).for_each(|i| put(i, &bytes[start + i * stride..]));
        }
        if let Some(sparse) = &self.sparse {
            let (view, start) = &sparse.values;
            let (bytes, size) = (view.bytes(), self.component.size() * self.components);
            sparse.indices().enumerate().for_each(|(k, i)| put(i, &bytes[start + k * size..]));
        }
    }

    /// All values as vectors; components that the accessor does not have are `missing`.
    pub fn vectors<const N: usize>(&self, missing: f32) -> Result<Vec<[f32; N]>, SceneError> {
        let mut all = vec![[0.0; N]; self.count];
        let (size, component, normalized) = (self.component.size(), self.component, self.normalized);
        let have = self.components.min(N);
        all.iter_mut().for_each(|value| value[have..].fill(missing));
        if component == Component::F32 && have == N {
            self.each(|i, bytes| {
                let words = bytes.as_chunks::<4>().0;
                all[i] = std::array::from_fn(|k| words.get(k).map_or(0.0, |b| f32::from_le_bytes(*b)));
            });
        } else {
            self.each(|i, bytes| {
                for (k, value) in all[i][..have].iter_mut().enumerate() {
                    *value = component.read(&bytes[k * size..], normalized);
                }
            });
        }
        if let Some(i) = all.iter().position(|value| !value.iter().all(|v| v.is_finite())) {
            return Err(self.error(format!("value {i} is not finite")));
        }
        Ok(all)
    }

    /// All values as indices.
    pub fn indices(&self) -> Result<Vec<u32>, SceneError> {
        if self.components != 1 || !self.component.is_index() {
            return Err(self.error("indices must be single whole numbers without sign"));
        }
        let mut all = vec![0; self.count];
        self.each(|i, bytes| all[i] = self.component.read_index(bytes));
        Ok(all)
    }
}
