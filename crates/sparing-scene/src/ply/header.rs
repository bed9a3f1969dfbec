//! The head of a PLY file: format, elements, properties.

use super::input::Input;
use crate::error::{ErrorKind, SceneError};
use crate::source::SourceFile;

/// Lines of a header; real ones have less than a hundred.
const MAX_LINES: usize = 10_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    Little,
    Big,
}

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// What stands for 1 where a colour is a whole number.
    pub fn full(self) -> f32 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::I32 => i32::MAX as f32,
            Self::U32 => u32::MAX as f32,
            Self::F32 | Self::F64 => 1.0,
        }
    }

    /// Value of the first bytes; 0 where there are too few.
    #[inline]
    pub fn read(self, bytes: &[u8], format: Format) -> f64 {
        macro_rules! value {
            ($type:ty) => {
                match bytes.first_chunk() {
                    Some(&b) if format == Format::Big => f64::from(<$type>::from_be_bytes(b)),
                    Some(&b) => f64::from(<$type>::from_le_bytes(b)),
                    None => 0.0,
                }
            };
        }
        match self {
            Self::I8 => value!(i8),
            Self::U8 => value!(u8),
            Self::I16 => value!(i16),
            Self::U16 => value!(u16),
            Self::I32 => value!(i32),
            Self::U32 => value!(u32),
            Self::F32 => value!(f32),
            Self::F64 => value!(f64),
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub name: String,
    /// Type of the count, where the property is a list.
    pub count: Option<Scalar>,
    /// Type of the value or values.
    pub item: Scalar,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes of one element, at least.
    pub fn least_bytes(&self, format: Format) -> u64 {
        let each = |p: &Property| match (format, p.count) {
            (Format::Ascii, _) => 2, // a digit and a space
            (_, Some(count)) => count.size() as u64,
            (_, None) => p.item.size() as u64,
        };
        self.properties.iter().map(each).sum()
    }

    /// Index of a property.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name)
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Lines that it has.
    pub lines: usize,
}

/// Reads everything up to `end_header`.
pub(super) fn read(input: &mut Input, file: &str) -> Result<Header, SceneError> {
    let mut line = Vec::new();
    let magic = input.fill(4)?;
    if !magic.starts_with(b"ply") || !magic.get(3).is_none_or(u8::is_ascii_whitespace) {
        return Err(SceneError::new(
            ErrorKind::Format,
            "this is not a PLY file: it does not start with `ply`",
        ));
    }
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    for number in 1..=MAX_LINES {
        let Some(text) = input.line(&mut line)? else {
            return Err(SceneError::new(ErrorKind::Syntax, "the header has no end: `end_header` is missing"));
        };
        let text = String::from_utf8_lossy(&text[..text.len().min(1000)]).into_owned();
        let bad = |message: &str| {
            let span = SourceFile::line(file, number, text.as_bytes());
            Err(SceneError::new(ErrorKind::Syntax, message).at(&span))
        };
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            ["ply"] if number == 1 => {}
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, version] => {
                format = match name {
                    "ascii" => Some(Format::Ascii),
                    "binary_little_endian" => Some(Format::Little),
                    "binary_big_endian" => Some(Format::Big),
                    _ => return bad("formats are ascii, binary_little_endian and binary_big_endian"),
                };
                if version != "1.0" {
                    return bad("the only version of PLY is 1.0");
                }
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else { return bad("the number of elements is not a number") };
                elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
            }
            ["property", ref rest @ ..] => {
                let property = match *rest {
                    ["list", count, item, name] => Scalar::named(count)
                        .zip(Scalar::named(item))
                        .map(|(count, item)| Property { name: name.to_owned(), count: Some(count), item }),
                    [item, name] => {
                        Scalar::named(item).map(|item| Property { name: name.to_owned(), count: None, item })
                    }
                    _ => return bad("a property is `property TYPE NAME` or `property list TYPE TYPE NAME`"),
                };
                let Some(property) = property else {
                    return bad("types are char, uchar, short, ushort, int, uint, float and double");
                };
                if property.count.is_some_and(|count| !count.is_integer()) {
                    return bad("the number of values of a list must be of a whole type");
                }
                match elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return bad("this property belongs to no element"),
                }
            }
            ["end_header"] => {
                let Some(format) = format else { return bad("the line `format` is missing") };
                return Ok(Header { format, elements, lines: number });
            }
            _ => return bad("this line of the header is not understood"),
        }
    }
    Err(SceneError::new(ErrorKind::Limit, format!("the header has more than {MAX_LINES} lines")))
}
