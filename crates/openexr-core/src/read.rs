//! The reader: single part, flat, no subsampling, lossless compression, scan lines or tiles.

use std::ffi::CStr;
use std::io::{Read, Seek};

use openexr_core_sys as sys;

use crate::context::{Context, Source};
use crate::error::check;
use crate::image::{Channel, Image, Samples, Window};
use crate::{Error, attribute};

/// Attributes that describe the layout of the file: not among [`Image::attributes`], and not for the caller to set.
pub(crate) const LAYOUT_ATTRIBUTES: [&str; 13] = [
    "channels",
    "chunkCount",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "name",
    "pixelAspectRatio",
    "screenWindowCenter",
    "screenWindowWidth",
    "tiles",
    "type",
    "version",
];

/// No lossless method of the format packs more than about a thousand bytes into one (deflate does 1032); a file
/// that claims more than this has nothing to fill its pixels with.
const MAX_EXPANSION: u64 = 4096;

/// How much a file may ask for.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest width or height, pixels.
    pub max_side: u32,
    /// Most channels.
    pub max_channels: usize,
    /// Most memory for the decoded samples, bytes.
    pub max_bytes: u64,
}

impl Default for Limits {
    /// 65536 pixels a side, 1024 channels, 16 GiB.
    fn default() -> Self {
        Self { max_side: 65_536, max_channels: 1024, max_bytes: 16 << 30 }
    }
}

/// What a header says, checked.
struct Layout {
    display: Window,
    data: Window,
    /// Name and type of each channel, in file order.
    channels: Vec<(String, sys::exr_pixel_type_t)>,
    compression: sys::exr_compression_t,
    /// Size of tiles, or lines of a chunk at full width.
    block: [u32; 2],
    tiled: bool,
}

/// Decodes a file in memory.
///
/// # Errors
/// [`Error::Unsupported`] for valid files of other kinds, [`Error::TooLarge`] beyond the limits, otherwise
/// [`Error::Library`] or [`Error::Damaged`].
pub fn read(bytes: &[u8], limits: &Limits) -> Result<Image, Error> {
    let context = Context::read(&bytes, limits.max_side)?;
    let layout = layout(&context, bytes.len() as u64, limits)?;
    let attributes = attribute::all(&context)?;
    let pixels = usize::try_from(layout.data.pixels()).map_err(|_| Error::TooLarge("its pixels".into()))?;
    let mut channels: Vec<Channel> = layout
        .channels
        .iter()
        .map(|(name, kind)| {
            let samples = match *kind {
                sys::exr_pixel_type_t::EXR_PIXEL_FLOAT => Samples::F32(vec![0.0; pixels]),
                sys::exr_pixel_type_t::EXR_PIXEL_HALF => Samples::Half(vec![0; pixels]),
                _ => Samples::U32(vec![0; pixels]),
            };
            Channel { name: name.clone(), samples }
        })
        .collect();
    let [width, height] = layout.data.size;
    let [block_width, block_height] = layout.block;
    for y in (0..height).step_by(block_height as usize) {
        for x in (0..width).step_by(block_width as usize) {
            decode(&context, &layout, x, y, &mut channels)?;
        }
    }
    Ok(Image { display: layout.display, data: layout.data, channels, attributes })
}

/// Decodes everything but the pixels: the channels are there with no samples.
///
/// # Errors
/// As [`read()`].
pub fn read_header(bytes: &[u8], limits: &Limits) -> Result<Image, Error> {
    header(&Context::read(&bytes, limits.max_side)?, bytes.len() as u64, limits)
}

/// As [`read_header`], of a file, of which no more is read than the header.
///
/// # Errors
/// As [`read()`], and [`Error::Io`] if the file cannot be read.
///
/// # Panics
/// Only if `input` does.
pub fn read_header_from<R: Read + Seek>(input: R, limits: &Limits) -> Result<Image, Error> {
    let mut source = Source::new(input).map_err(Error::Io)?;
    let length = source.length();
    let found =
        Context::read_from(&mut source, limits.max_side).and_then(|context| header(&context, length, limits));
    if let Some(panic) = source.panic {
        std::panic::resume_unwind(panic);
    }
    match source.error {
        Some(error) => Err(Error::Io(error)),
        None => found,
    }
}

fn header(context: &Context<'_>, file_size: u64, limits: &Limits) -> Result<Image, Error> {
    let layout = layout(context, file_size, limits)?;
    let attributes = attribute::all(context)?;
    let empty = |kind| match kind {
        sys::exr_pixel_type_t::EXR_PIXEL_FLOAT => Samples::F32(Vec::new()),
        sys::exr_pixel_type_t::EXR_PIXEL_HALF => Samples::Half(Vec::new()),
        _ => Samples::U32(Vec::new()),
    };
    let channels =
        layout.channels.into_iter().map(|(name, kind)| Channel { name, samples: empty(kind) }).collect();
    Ok(Image { display: layout.display, data: layout.data, channels, attributes })
}

fn layout(context: &Context<'_>, file_size: u64, limits: &Limits) -> Result<Layout, Error> {
    let c = context.raw();
    let mut parts = 0;
    // SAFETY: the context is open for reading; the pointer is to a live value.
    check(unsafe { sys::exr_get_count(c, &mut parts) })?;
    if parts != 1 {
        return Err(Error::Unsupported(format!("it has {parts} parts, one is wanted")));
    }
    let mut storage = sys::exr_storage_t::EXR_STORAGE_LAST_TYPE;
    let mut compression = sys::exr_compression_t::EXR_COMPRESSION_LAST_TYPE;
    let (mut data, mut display) = (sys::exr_attr_box2i_t::default(), sys::exr_attr_box2i_t::default());
    let mut chunks = 0;
    // SAFETY: the context is open for reading and has part 0; the pointers are to live values.
    unsafe {
        check(sys::exr_get_storage(c, 0, &mut storage))?;
        check(sys::exr_get_compression(c, 0, &mut compression))?;
        check(sys::exr_get_data_window(c, 0, &mut data))?;
        check(sys::exr_get_display_window(c, 0, &mut display))?;
    }
    let tiled = match storage {
        sys::exr_storage_t::EXR_STORAGE_SCANLINE => false,
        sys::exr_storage_t::EXR_STORAGE_TILED => true,
        _ => return Err(Error::Unsupported("deep data".into())),
    };
    check_compression(compression)?;
    let (data, display) = (from_box(&data, "data")?, from_box(&display, "display")?);
    if data.size.iter().any(|side| *side > limits.max_side) {
        let [w, h] = data.size;
        return Err(Error::TooLarge(format!("{w} x {h} pixels, the limit is {} a side", limits.max_side)));
    }
    // SAFETY: as above.
    check(unsafe { sys::exr_get_chunk_count(c, 0, &mut chunks) })?;
    let chunks = u64::try_from(chunks).unwrap_or(u64::MAX);
    if chunks.saturating_mul(8) > file_size {
        return Err(Error::Damaged(format!("{chunks} chunks in {file_size} bytes")));
    }
    let channels = channels(context, limits)?;
    let bytes_per_pixel: u64 = channels.iter().map(|(_, kind)| bytes_of(*kind)).sum();
    let total = data.pixels().saturating_mul(bytes_per_pixel);
    if total > limits.max_bytes || total > file_size.saturating_mul(MAX_EXPANSION) {
        return Err(Error::TooLarge(format!("{total} bytes of pixels from a file of {file_size} bytes")));
    }
    let block = block(context, tiled, &data)?;
    Ok(Layout { display, data, channels, compression, block, tiled })
}

fn check_compression(compression: sys::exr_compression_t) -> Result<(), Error> {
    use sys::exr_compression_t as C;
    let name = match compression {
        C::EXR_COMPRESSION_NONE
        | C::EXR_COMPRESSION_RLE
        | C::EXR_COMPRESSION_ZIPS
        | C::EXR_COMPRESSION_ZIP
        | C::EXR_COMPRESSION_PIZ => return Ok(()),
        C::EXR_COMPRESSION_PXR24 => "PXR24",
        C::EXR_COMPRESSION_B44 => "B44",
        C::EXR_COMPRESSION_B44A => "B44A",
        C::EXR_COMPRESSION_DWAA => "DWAA",
        C::EXR_COMPRESSION_DWAB => "DWAB",
        _ => "unknown",
    };
    Err(Error::Unsupported(format!("{name} compression; NONE, RLE, ZIPS, ZIP and PIZ are read")))
}

fn from_box(raw: &sys::exr_attr_box2i_t, what: &str) -> Result<Window, Error> {
    // SAFETY: every bit pattern is a valid pair of i32, whichever field of the union wrote it.
    let (min, max) = unsafe { (raw.min.__bindgen_anon_1.arr, raw.max.__bindgen_anon_1.arr) };
    let side =
        |axis: usize| u32::try_from(i64::from(max[axis]) - i64::from(min[axis]) + 1).ok().filter(|n| *n > 0);
    match (side(0), side(1)) {
        (Some(w), Some(h)) => Ok(Window { origin: min, size: [w, h] }),
        _ => Err(Error::Damaged(format!("its {what} window is from {min:?} to {max:?}"))),
    }
}

fn bytes_of(kind: sys::exr_pixel_type_t) -> u64 {
    if kind == sys::exr_pixel_type_t::EXR_PIXEL_HALF { 2 } else { 4 }
}

fn channels(context: &Context<'_>, limits: &Limits) -> Result<Vec<(String, sys::exr_pixel_type_t)>, Error> {
    let mut list = std::ptr::null();
    // SAFETY: the context is open for reading and has part 0.
    check(unsafe { sys::exr_get_channels(context.raw(), 0, &mut list) })?;
    // SAFETY: on success the pointer is to a list that lives as long as the context.
    let list = unsafe { list.as_ref() }.ok_or_else(|| Error::Damaged("it has no channel list".into()))?;
    let count = usize::try_from(list.num_channels).unwrap_or(0);
    if count == 0 || list.entries.is_null() {
        return Err(Error::Damaged("it has no channels".into()));
    }
    if count > limits.max_channels {
        return Err(Error::TooLarge(format!("{count} channels, the limit is {}", limits.max_channels)));
    }
    // SAFETY: the library keeps `num_channels` entries there, unchanged while reading.
    let entries = unsafe { std::slice::from_raw_parts(list.entries, count) };
    let mut out: Vec<(String, sys::exr_pixel_type_t)> = Vec::with_capacity(count);
    for entry in entries {
        if entry.name.str_.is_null() {
            return Err(Error::Damaged("a channel has no name".into()));
        }
        // SAFETY: not null, and the library ends names with a NUL.
        let name = unsafe { CStr::from_ptr(entry.name.str_) }.to_str();
        let name = name.map_err(|_| Error::Unsupported("a channel's name is not UTF-8".into()))?.to_owned();
        if entry.x_sampling != 1 || entry.y_sampling != 1 {
            return Err(Error::Unsupported(format!("channel {name:?} is subsampled")));
        }
        if !(0..=2).contains(&entry.pixel_type.0) {
            return Err(Error::Damaged(format!("channel {name:?} is of an unknown type")));
        }
        if out.iter().any(|(other, _)| *other == name) {
            return Err(Error::Damaged(format!("two channels are named {name:?}")));
        }
        out.push((name, entry.pixel_type));
    }
    Ok(out)
}

fn block(context: &Context<'_>, tiled: bool, data: &Window) -> Result<[u32; 2], Error> {
    let [mut w, mut h] = [data.size[0] as i32, 0];
    // SAFETY: the context is open for reading and has part 0, tiled if `tiled`; the pointers are to live values.
    check(unsafe {
        if tiled {
            sys::exr_get_tile_sizes(context.raw(), 0, 0, 0, &mut w, &mut h)
        } else {
            sys::exr_get_scanlines_per_chunk(context.raw(), 0, &mut h)
        }
    })?;
    match (u32::try_from(w), u32::try_from(h)) {
        (Ok(w @ 1..), Ok(h @ 1..)) => Ok([w, h]),
        _ => Err(Error::Damaged(format!("its blocks are of {w} x {h} pixels"))),
    }
}

/// A decode pipeline, destroyed on drop.
struct Pipeline<'a> {
    context: &'a Context<'a>,
    raw: sys::exr_decode_pipeline_t,
}

impl Drop for Pipeline<'_> {
    fn drop(&mut self) {
        // SAFETY: the pipeline was initialised with this context, or is all zero, which destroys nothing.
        let _ = check(unsafe { sys::exr_decoding_destroy(self.context.raw(), &mut self.raw) });
    }
}

/// Decodes the block whose first pixel is (`x`, `y`) from the data window's corner.
fn decode(context: &Context<'_>, layout: &Layout, x: u32, y: u32, out: &mut [Channel]) -> Result<(), Error> {
    let [width, height] = layout.data.size;
    let [bw, bh] = [layout.block[0].min(width - x), layout.block[1].min(height - y)];
    let info = chunk_info(context, layout, x, y, [bw, bh])?;
    let mut pipeline = Pipeline { context, raw: sys::exr_decode_pipeline_t::default() };
    // SAFETY: the context is open for reading, part 0 exists, the pointers are to live values; the pipeline is
    // not moved between initialisation and destruction (it may point into itself).
    let channels = unsafe {
        check(sys::exr_decoding_initialize(context.raw(), 0, &info, &mut pipeline.raw))?;
        if pipeline.raw.channels.is_null() || pipeline.raw.channel_count as usize != out.len() {
            return Err(Error::Damaged("its channels change between chunks".into()));
        }
        std::slice::from_raw_parts_mut(pipeline.raw.channels, out.len())
    };
    let line_stride = |bytes: i32| {
        i32::try_from(i64::from(bytes) * i64::from(width)).map_err(|_| Error::TooLarge("its lines".into()))
    };
    for (channel, ours) in channels.iter_mut().zip(out) {
        // What the library is about to write: `height` lines of `width` values of this type.
        let kind = u32::from(channel.data_type);
        if channel.width as u32 != bw || channel.height as u32 != bh {
            return Err(Error::Damaged(format!("channel {:?} has a chunk of another size", ours.name)));
        }
        let first = y as usize * width as usize + x as usize;
        let (pointer, bytes, our_kind): (*mut u8, i32, sys::exr_pixel_type_t) = match &mut ours.samples {
            Samples::F32(v) => (v[first..].as_mut_ptr().cast(), 4, sys::exr_pixel_type_t::EXR_PIXEL_FLOAT),
            Samples::Half(v) => (v[first..].as_mut_ptr().cast(), 2, sys::exr_pixel_type_t::EXR_PIXEL_HALF),
            Samples::U32(v) => (v[first..].as_mut_ptr().cast(), 4, sys::exr_pixel_type_t::EXR_PIXEL_UINT),
        };
        if kind != our_kind.0 {
            return Err(Error::Damaged(format!("channel {:?} changes its type", ours.name)));
        }
        channel.user_bytes_per_element = bytes as i16;
        channel.user_data_type = channel.data_type;
        channel.user_pixel_stride = bytes;
        channel.user_line_stride = line_stride(bytes)?;
        channel.__bindgen_anon_1.decode_to_ptr = pointer;
    }
    // SAFETY: each channel's pointer is to the block's first value in a vector of the whole window; the library
    // writes `bh` lines of `bw` values with our strides, and x + bw <= width, y + bh <= height were ensured.
    unsafe {
        check(sys::exr_decoding_choose_default_routines(context.raw(), 0, &mut pipeline.raw))?;
        check(sys::exr_decoding_run(context.raw(), 0, &mut pipeline.raw))
    }
}

/// Where a chunk is, with sizes that agree with the header: older libraries trust the chunk's own.
fn chunk_info(
    context: &Context<'_>,
    layout: &Layout,
    x: u32,
    y: u32,
    block: [u32; 2],
) -> Result<sys::exr_chunk_info_t, Error> {
    let mut info = sys::exr_chunk_info_t::default();
    // SAFETY: the context is open for reading, part 0 exists and is tiled or not as `layout` says.
    check(unsafe {
        if layout.tiled {
            let (tx, ty) = ((x / layout.block[0]) as i32, (y / layout.block[1]) as i32);
            sys::exr_read_tile_chunk_info(context.raw(), 0, tx, ty, 0, 0, &mut info)
        } else {
            sys::exr_read_scanline_chunk_info(context.raw(), 0, layout.data.origin[1] + y as i32, &mut info)
        }
    })?;
    let bytes_per_pixel: u64 = layout.channels.iter().map(|(_, kind)| bytes_of(*kind)).sum();
    let want = u64::from(block[0]) * u64::from(block[1]) * bytes_per_pixel;
    let raw = layout.compression == sys::exr_compression_t::EXR_COMPRESSION_NONE;
    let packed_fits = if raw { info.packed_size == want } else { (1..=want).contains(&info.packed_size) };
    if info.unpacked_size != want || !packed_fits {
        return Err(Error::Damaged(format!("the chunk at ({x}, {y}) has a wrong size")));
    }
    Ok(info)
}
