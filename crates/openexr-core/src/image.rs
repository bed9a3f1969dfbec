//! An image in memory: window, channels, attributes.

use crate::half;

/// A rectangle of pixels; y points down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the first pixel.
    pub origin: [i32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl Window {
    /// A window that begins at (0, 0).
    #[must_use]
    pub fn of_size(width: u32, height: u32) -> Self {
        Self { origin: [0, 0], size: [width, height] }
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// The values of one channel, one a pixel, in rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// 32-bit floating point.
    F32(Vec<f32>),
    /// 16-bit floating point, as bits; see [`half`].
    Half(Vec<u16>),
    /// 32-bit unsigned.
    U32(Vec<u32>),
}

impl Samples {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        SamplesRef::from(self).len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All values as f32: exact for halves, rounded to nearest for integers above 2^24.
    #[must_use]
    pub fn into_f32(self) -> Vec<f32> {
        match self {
            Self::F32(v) => v,
            Self::Half(v) => v.into_iter().map(half::to_f32).collect(),
            Self::U32(v) => v.into_iter().map(|x| x as f32).collect(),
        }
    }
}

/// Borrowed values of one channel, for writing without a copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SamplesRef<'a> {
    /// 32-bit floating point.
    F32(&'a [f32]),
    /// 16-bit floating point, as bits.
    Half(&'a [u16]),
    /// 32-bit unsigned.
    U32(&'a [u32]),
}

impl SamplesRef<'_> {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::Half(v) => v.len(),
            Self::U32(v) => v.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a> From<&'a Samples> for SamplesRef<'a> {
    fn from(samples: &'a Samples) -> Self {
        match samples {
            Samples::F32(v) => Self::F32(v),
            Samples::Half(v) => Self::Half(v),
            Samples::U32(v) => Self::U32(v),
        }
    }
}

/// One channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Full name, for example `R` or `Albedo.R`; 1 to 255 bytes.
    pub name: String,
    /// Values.
    pub samples: Samples,
}

/// The value of a header attribute.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text, UTF-8 by convention, without NUL.
    String(String),
    /// 32-bit integer.
    Int(i32),
    /// 32-bit floating point.
    Float(f32),
    /// 64-bit floating point.
    Double(f64),
    /// Two integers.
    V2i([i32; 2]),
    /// Two floats.
    V2f([f32; 2]),
    /// Three integers.
    V3i([i32; 3]),
    /// Three floats.
    V3f([f32; 3]),
    /// A 4x4 matrix in rows.
    M44f([f32; 16]),
    /// CIE xy of red, green, blue and white.
    Chromaticities([f32; 8]),
    /// Any number of floats.
    FloatVector(Vec<f32>),
    /// Any number of texts.
    StringVector(Vec<String>),
}

/// A flat single-part image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// The full picture, of which `data` may be a part.
    pub display: Window,
    /// The pixels that are stored.
    pub data: Window,
    /// Channels; the file keeps them sorted by name.
    pub channels: Vec<Channel>,
    /// Attributes besides those that describe the layout of the file, in file order.
    pub attributes: Vec<(String, Attribute)>,
}

impl Image {
    /// No channels, no attributes; `window` is both display and data window.
    #[must_use]
    pub fn new(window: Window) -> Self {
        Self { display: window, data: window, ..Self::default() }
    }

    /// The channel of this exact name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// The attribute of this exact name.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, a)| a)
    }
}

/// How pixels are packed in a file; both lose nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Deflate, 16 lines at a time: what every reader knows.
    #[default]
    Zip,
    /// None: many times faster to write.
    None,
}

/// A borrowed [`Image`], for writing without a copy.
#[derive(Clone, Debug)]
pub struct ImageRef<'a> {
    /// The full picture.
    pub display: Window,
    /// The pixels that are stored.
    pub data: Window,
    /// Names and values.
    pub channels: Vec<(&'a str, SamplesRef<'a>)>,
    /// Attributes besides those that describe the layout of the file.
    pub attributes: &'a [(String, Attribute)],
    /// How to pack them.
    pub compression: Compression,
}

impl<'a> From<&'a Image> for ImageRef<'a> {
    fn from(image: &'a Image) -> Self {
        let channels = image.channels.iter().map(|c| (c.name.as_str(), SamplesRef::from(&c.samples)));
        Self {
            display: image.display,
            data: image.data,
            channels: channels.collect(),
            attributes: &image.attributes,
            compression: Compression::Zip,
        }
    }
}
